// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The oracle by itself: cases worked out by hand, the snap against exact rational rounding, all widths of arithmetic
// against each other.

#include "oracle.hpp"
#include "triangles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <vector>

namespace oracle {

void PrintTo(const voxel& v, std::ostream* os) { *os << '(' << v.i << ',' << v.j << ',' << v.k << ')'; }

namespace {

using voxels = std::vector<voxel>;

constexpr grid unit_grid(int nx, int ny, int nz) { return {{0, 0, 0}, {1, 1, 1}, {nx, ny, nz}}; }

struct vec {
    float x, y, z;
};
snapped_triangle snapped(const grid& g, vec a, vec b, vec c) {
    const float v[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}};
    return snap(g, v);
}

TEST(OracleFractionBits, FollowTheLargestExtent) {
    EXPECT_EQ(fraction_bits(unit_grid(1, 1, 1)), 16);
    EXPECT_EQ(fraction_bits(unit_grid(256, 3, 1)), 16);
    EXPECT_EQ(fraction_bits(unit_grid(1, 257, 1)), 15);
    EXPECT_EQ(fraction_bits(unit_grid(1, 1, 512)), 15);
    EXPECT_EQ(fraction_bits(unit_grid(1024, 1024, 1024)), 14);
    EXPECT_EQ(fraction_bits(unit_grid(1025, 1, 1)), 13);
    EXPECT_EQ(fraction_bits(unit_grid(4096, 4096, 4096)), 12);
    EXPECT_EQ(fraction_bits(unit_grid(1 << 24, 1, 1)), 0);
    EXPECT_THROW(static_cast<void>(fraction_bits(unit_grid(0, 1, 1))), std::invalid_argument);
    EXPECT_THROW(static_cast<void>(fraction_bits(unit_grid(1, (1 << 24) + 1, 1))), std::invalid_argument);
}

TEST(OracleSnap, RoundsHalfToEven) {
    const grid g = unit_grid(1024, 1024, 1024); // 2^14 units a voxel
    const float step = 0x1p-15f;                // half a unit
    const snapped_triangle t =
        snapped(g, {1 * step, 3 * step, 5 * step}, {-1 * step, -3 * step, 0}, {7 * step, 2 * step, 1.0f});
    const std::int64_t expected[3][3] = {{0, 2, 2}, {0, -2, 0}, {4, 1, 16384}};
    for (int vertex = 0; vertex < 3; ++vertex)
        for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(t.v[vertex][axis], expected[vertex][axis]) << vertex << axis;
}

TEST(OracleSnap, DropsWhatIsNotANumberOrTooFar) {
    const grid g = unit_grid(256, 256, 256); // 2^16 units a voxel, so 2^24 voxels is the limit
    const float limit = 0x1p24f;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(snapped(g, {limit, -limit, 0}, {1, 1, 1}, {2, 2, 2}).dropped);
    EXPECT_TRUE(snapped(g, {std::nextafter(limit, infinity), 0, 0}, {1, 1, 1}, {2, 2, 2}).dropped);
    EXPECT_TRUE(snapped(g, {1, 1, 1}, {0, 0, -std::nextafter(limit, infinity)}, {2, 2, 2}).dropped);
    EXPECT_TRUE(snapped(g, {1, 1, 1}, {2, 2, 2}, {0, nan, 0}).dropped);
    EXPECT_TRUE(snapped(g, {1, 1, 1}, {2, 2, 2}, {-infinity, 0, 0}).dropped);
}

// ---- The snap formula again, in exact integers: value = significand * 2^exponent ----

struct exact {
    wide_int<8> significand;
    int exponent;
};

exact of(double value) {
    int exponent = 0;
    const double fraction = std::frexp(value, &exponent); // value = fraction * 2^exponent
    return {wide_int<8>(static_cast<std::int64_t>(std::ldexp(fraction, 53))), exponent - 53};
}

// Nearest integer multiple of 2^to, ties to even.
wide_int<8> round_to(const exact& value, int to) {
    if (value.exponent >= to) return value.significand.shifted_left(value.exponent - to);
    const wide_int<8> divisor = wide_int<8>(1).shifted_left(to - value.exponent);
    const wide_int<8> below = wide_int<8>::floor_divide(value.significand, divisor);
    const wide_int<8> rest = value.significand - below * divisor;
    const auto order = rest + rest <=> divisor;
    if (order < 0 || (order == 0 && !below.bit(0))) return below;
    return below + 1;
}

exact rounded_to_double(const exact& value) {
    if (value.significand.sign() == 0) return {0, 0};
    const int to = value.exponent + value.significand.bit_width() - 53; // a carry to 2^53 is still a double
    return {round_to(value, to), to};
}

std::int64_t exact_snap(float p, double origin, double voxel_size, int fraction) {
    const exact a = of(p), b = of(-origin);
    const int low = std::min(a.exponent, b.exponent);
    const exact offset = rounded_to_double(
        {a.significand.shifted_left(a.exponent - low) + b.significand.shifted_left(b.exponent - low), low});
    // scale = 2^fraction / voxel_size to 53 bits: divide with plenty of them and mark what is left.
    const exact size = of(voxel_size);
    const auto parts = wide_int<8>::divide_magnitudes(wide_int<8>(1).shifted_left(200), size.significand);
    const wide_int<8> quotient = parts.quotient + parts.quotient + wide_int<8>(parts.remainder.sign());
    const exact scale = rounded_to_double({quotient, fraction - 201 - size.exponent});
    const exact product = rounded_to_double({offset.significand * scale.significand, offset.exponent + scale.exponent});
    return round_to(product, 0).to_int64();
}

TEST(OracleSnap, IsTheFormulaInExactRationalArithmetic) {
    splitmix64 random(11);
    const int cases = repeats(6000);
    long compared = 0;
    for (int n = 0; n < cases; ++n) {
        const auto& grids = test_grids();
        grid g = grids[random.below(grids.size())].g;
        if (random.one_in(2))
            for (int axis = 0; axis < 3; ++axis) {
                g.origin[axis] = random.uniform(-1.0, 1.0) * std::exp2(random.uniform(-20.0, 20.0));
                g.voxel_size[axis] = std::exp2(random.uniform(-20.0, 10.0));
            }
        float v[3][3];
        for (auto& position : v)
            for (int axis = 0; axis < 3; ++axis) {
                const double voxels =
                    random.uniform(-1.0, 2.0) * g.extent[axis] * std::exp2(random.uniform(-12.0, 8.0));
                position[axis] = static_cast<float>(g.origin[axis] + voxels * g.voxel_size[axis]);
            }
        const snapped_triangle t = snap(g, v);
        if (t.dropped) continue;
        for (int vertex = 0; vertex < 3; ++vertex)
            for (int axis = 0; axis < 3; ++axis) {
                ASSERT_EQ(t.v[vertex][axis],
                          exact_snap(v[vertex][axis], g.origin[axis], g.voxel_size[axis], fraction_bits(g)));
                ++compared;
            }
    }
    EXPECT_GT(compared, 20 * cases / 3);
}

// ---- Conservative, by hand ----

TEST(OracleConservative, PointOnACornerTouchesEightVoxels) {
    const grid g = unit_grid(4, 4, 4);
    const snapped_triangle t = snapped(g, {2, 2, 2}, {2, 2, 2}, {2, 2, 2});
    EXPECT_EQ(conservative(g, t),
              (voxels{{1, 1, 1}, {2, 1, 1}, {1, 2, 1}, {2, 2, 1}, {1, 1, 2}, {2, 1, 2}, {1, 2, 2}, {2, 2, 2}}));
    EXPECT_TRUE(thin(g, t).empty());
}

TEST(OracleConservative, PointInsideTouchesOne) {
    const grid g = unit_grid(4, 4, 4);
    EXPECT_EQ(conservative(g, snapped(g, {2.5f, 0.25f, 3.75f}, {2.5f, 0.25f, 3.75f}, {2.5f, 0.25f, 3.75f})),
              (voxels{{2, 0, 3}}));
}

TEST(OracleConservative, SegmentThroughCornersTouchesTheirNeighbours) {
    const grid g = unit_grid(3, 3, 1);
    // The diagonal of the square passes (1,1) and (2,2): the voxels off the diagonal touch it there.
    EXPECT_EQ(conservative(g, snapped(g, {0.5f, 0.5f, 0.5f}, {2.5f, 2.5f, 0.5f}, {1.5f, 1.5f, 0.5f})),
              (voxels{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}, {1, 2, 0}, {2, 2, 0}}));
}

TEST(OracleConservative, OneUnitBesideTheCornerDecides) {
    const grid g = unit_grid(2, 2, 2);
    const float unit = 0x1p-16f;
    const auto diagonal = [&](float shift) { // x + y = 2 + shift over the corner (1,1), at z = 0.5
        return snapped(g, {2 + shift, 0, 0.5f}, {0, 2 + shift, 0.5f}, {0, 2 + shift, 0.5f});
    };
    EXPECT_TRUE(covers_conservative(g, diagonal(0), 0, 0, 0));
    EXPECT_TRUE(covers_conservative(g, diagonal(0), 1, 1, 0));
    EXPECT_FALSE(covers_conservative(g, diagonal(unit), 0, 0, 0));
    EXPECT_TRUE(covers_conservative(g, diagonal(unit), 1, 1, 0));
    EXPECT_TRUE(covers_conservative(g, diagonal(-unit), 0, 0, 0));
    EXPECT_FALSE(covers_conservative(g, diagonal(-unit), 1, 1, 0));
}

TEST(OracleConservative, PlaneOfATriangleDecidesWhereItsBoxDoesNot) {
    const grid g = unit_grid(4, 4, 4);
    // x + y + z = 4 in the octant: voxel (i,j,k) meets the plane iff i+j+k <= 4 <= i+j+k+3, and all such do meet the
    // triangle.
    const snapped_triangle t = snapped(g, {4, 0, 0}, {0, 4, 0}, {0, 0, 4});
    voxels expected;
    for (int k = 0; k < 4; ++k)
        for (int j = 0; j < 4; ++j)
            for (int i = 0; i < 4; ++i)
                if (i + j + k <= 4 && 4 <= i + j + k + 3) expected.push_back({i, j, k});
    EXPECT_EQ(conservative(g, t), expected);
}

TEST(OracleConservative, EdgeCrossEdgeAxisSeparates) {
    const grid g = unit_grid(2, 2, 2);
    // The segment from (2,0.5,1.75) to (0.5,2,0.75)... passes x + y = 2.5: above the corner (1,1), so no voxel of the
    // column (0,0).
    const snapped_triangle t = snapped(g, {2, 0.5f, 1.75f}, {0.5f, 2, 0.75f}, {2, 2, 1});
    EXPECT_FALSE(covers_conservative(g, t, 0, 0, 0));
    EXPECT_FALSE(covers_conservative(g, t, 0, 0, 1));
    EXPECT_TRUE(covers_conservative(g, t, 1, 1, 1));
    EXPECT_TRUE(covers_conservative(g, t, 1, 1, 0)); // (2,2,1) is in its top face
}

TEST(OracleConservative, TriangleOnAFaceTouchesBothSides) {
    const grid g = unit_grid(3, 3, 3);
    const snapped_triangle t = snapped(g, {1.25f, 1.25f, 1}, {1.75f, 1.25f, 1}, {1.25f, 1.75f, 1});
    EXPECT_EQ(conservative(g, t), (voxels{{1, 1, 0}, {1, 1, 1}}));
    EXPECT_EQ(thin(g, t), (voxels{{1, 1, 1}}));
}

TEST(OracleConservative, IsExactFarAway) {
    const grid g = unit_grid(2, 2, 2);
    // 2^24 voxels to either side: the edge x = y passes the corner of (0,1) and (1,0) and the insides of (0,0) and
    // (1,1).
    const float far = 0x1p24f;
    const snapped_triangle t = snapped(g, {-far, -far, 0.5f}, {far, far, 0.5f}, {far, -far, 0.5f});
    ASSERT_FALSE(t.dropped);
    EXPECT_EQ(conservative(g, t), (voxels{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
    // Lift the other end by 2^-16 voxel: at the grid the edge leaves the corner by half of that, so (0,1) stays clear.
    snapped_triangle lifted = t;
    lifted.v[1][1] -= 1;
    EXPECT_EQ(conservative(g, lifted), (voxels{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}));
}

TEST(OracleConservative, NothingForADroppedTriangle) {
    const grid g = unit_grid(2, 2, 2);
    const snapped_triangle t = snapped(g, {0, 0, 0}, {2, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0});
    EXPECT_TRUE(conservative(g, t).empty());
    EXPECT_TRUE(thin(g, t).empty());
}

// ---- Thin, by hand ----

TEST(OracleThin, EveryClosedColumnOnceAtTheFloorOfItsCentre) {
    const grid g = unit_grid(4, 4, 4);
    // z = x / 2 over the square's lower half; columns touched only along x + y = 3 or at its ends count too.
    const snapped_triangle t = snapped(g, {0, 0, 0}, {3, 0, 1.5f}, {0, 3, 0});
    EXPECT_EQ(dominant_axis(t), 2);
    voxels expected;
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
            if (i + j <= 3) expected.push_back({i, j, (2 * i + 1) / 4}); // floor((i + 1/2) / 2)
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(thin(g, t), expected);
}

TEST(OracleThin, TiesOfTheDominantAxisGoToXThenY) {
    const grid g = unit_grid(4, 4, 4);
    EXPECT_EQ(dominant_axis(snapped(g, {4, 0, 0}, {0, 4, 0}, {0, 0, 4})), 0);
    EXPECT_EQ(dominant_axis(snapped(g, {0, 4, 0}, {0, 0, 4}, {4, 4, 0})), 1); // y + z = 4
    EXPECT_EQ(dominant_axis(snapped(g, {4, 0, 0}, {0, 4, 0}, {4, 0, 4})), 0); // x + y = 4
    EXPECT_EQ(dominant_axis(snapped(g, {4, 0, 0}, {0, 4, 0}, {0, 0, 3.75f})), 2);
    EXPECT_EQ(dominant_axis(snapped(g, {0, 0, 0}, {1, 1, 1}, {3, 3, 3})), -1);
}

TEST(OracleThin, FloorIsExactAtAnInteger) {
    const grid g = unit_grid(4, 4, 4);
    const float unit = 0x1p-16f;
    // z = x + 1/2 at the centre x = 1/2 is exactly 1; one unit lower and it is below.
    const auto plane = [&](float lift) {
        return snapped(g, {0, 0, 0.5f + lift}, {1, 0, 1.5f + lift}, {0, 0.5f, 0.5f + lift});
    };
    EXPECT_EQ(dominant_axis(plane(0)), 0); // |nx| = |nz|
    const auto gentler = [&](float lift) { // z = 3/4 + x/2, 1 at the centre
        return snapped(g, {0.125f, 0.125f, 0.8125f + lift}, {0.875f, 0.125f, 1.1875f + lift},
                       {0.125f, 0.875f, 0.8125f + lift});
    };
    EXPECT_EQ(thin(g, gentler(0)), (voxels{{0, 0, 1}}));
    EXPECT_EQ(thin(g, gentler(-unit)), (voxels{{0, 0, 0}}));
}

TEST(OracleThin, DoesNotReportOutsideTheGrid) {
    const grid g = unit_grid(2, 2, 2);
    EXPECT_TRUE(thin(g, snapped(g, {0, 0, 2}, {2, 0, 2}, {0, 2, 2})).empty());                // depth 2 is voxel 2
    EXPECT_EQ(conservative(g, snapped(g, {0, 0, 2}, {2, 0, 2}, {0, 2, 2})).size(), 4u);       // the closed top touches
    EXPECT_TRUE(thin(g, snapped(g, {0, 0, -0.25f}, {2, 0, -0.25f}, {0, 2, -0.25f})).empty()); // floor is -1, not 0
    EXPECT_EQ(thin(g, snapped(g, {-9, -9, 0.5f}, {9, -9, 0.5f}, {0, 9, 0.5f})).size(), 4u);
}

TEST(OracleThin, ZeroAreaGivesNone) {
    const grid g = unit_grid(4, 4, 4);
    EXPECT_TRUE(thin(g, snapped(g, {0, 0, 0}, {3, 2, 1}, {0, 0, 0})).empty());
    EXPECT_TRUE(thin(g, snapped(g, {1, 1, 1}, {2, 2, 2}, {4, 4, 4})).empty());
    EXPECT_FALSE(conservative(g, snapped(g, {1, 1, 1}, {2, 2, 2}, {4, 4, 4})).empty());
}

TEST(OracleRegion, IsTheCropOfTheWhole) {
    splitmix64 random(8);
    for (const triangle_class kind : all_triangle_classes) {
        for (int n = 0; n < 20; ++n) {
            const test_grid& where = test_grids()[random.below(8)];
            region part{};
            for (int axis = 0; axis < 3; ++axis) {
                part.lo[axis] = static_cast<int>(random.between(0, where.g.extent[axis] - 1));
                part.hi[axis] = static_cast<int>(random.between(part.lo[axis] + 1, where.g.extent[axis]));
            }
            const world_triangle w = make_triangle(random, where, kind);
            const snapped_triangle t = snap(where.g, w.v);
            const auto crop = [&](voxels all) {
                std::erase_if(all, [&](const voxel& v) {
                    return v.i < part.lo[0] || v.i >= part.hi[0] || v.j < part.lo[1] || v.j >= part.hi[1] ||
                           v.k < part.lo[2] || v.k >= part.hi[2];
                });
                return all;
            };
            ASSERT_EQ(conservative(where.g, t, part), crop(conservative(where.g, t))) << name(kind);
            ASSERT_EQ(thin(where.g, t, part), crop(thin(where.g, t))) << name(kind);
        }
    }
}

// ---- Fragments ----

TEST(OracleBarycentrics, AreExactRationals) {
    const grid g = unit_grid(4, 4, 4);
    const snapped_triangle t = snapped(g, {0, 0, 0}, {3, 0, 1.5f}, {0, 3, 0});
    const auto at_first = barycentrics(g, t, {0, 0, 0}); // centre (1/2,1/2): b1 = 1/6, b2 = 1/6
    EXPECT_TRUE(at_first[1].numerator * wide(6) == at_first[1].denominator);
    EXPECT_TRUE(at_first[2].numerator * wide(6) == at_first[2].denominator);
    EXPECT_TRUE(at_first[0].numerator * wide(3) == at_first[0].denominator * wide(2));
    EXPECT_EQ(nearest_float(at_first[1]), 1.0f / 6.0f);
    const auto beyond = barycentrics(g, t, {2, 1, 1}); // centre (5/2,3/2) lies outside: b0 = 1 - 5/6 - 1/2
    EXPECT_EQ(nearest_float(beyond[0]), -1.0f / 3.0f);
    const ratio at = depth(g, t, {2, 1, 1});
    EXPECT_EQ(nearest_float(at), 1.25f);
}

TEST(OracleBarycentrics, SumToOneAndReproduceTheDepth) {
    splitmix64 random(5);
    const test_grid& where = test_grids()[2];
    const int cases = repeats(4000);
    int seen = 0;
    for (int n = 0; n < cases; ++n) {
        const world_triangle w =
            make_triangle(random, where, n % 2 == 0 ? triangle_class::medium : triangle_class::far_away);
        const snapped_triangle t = snap(where.g, w.v);
        const int axis = t.dropped ? -1 : dominant_axis(t);
        for (const voxel& at : thin(where.g, t)) {
            const auto b = barycentrics(where.g, t, at);
            ASSERT_TRUE(b[0].numerator + b[1].numerator + b[2].numerator == b[0].denominator);
            wide_int<8> sum = 0; // sum of b * depth of the vertices, in units
            for (std::size_t vertex = 0; vertex < 3; ++vertex)
                sum = sum + wide_int<8>(b[vertex].numerator.to_int128()) * wide_int<8>(t.v[vertex][axis]);
            const ratio d = depth(where.g, t, at);
            // sum / area = (depth / 1 voxel) * 2^F
            const wide_int<8> left = sum * wide_int<8>(d.denominator.to_int128());
            const wide_int<8> right = wide_int<8>(d.numerator.to_int128()) *
                                      wide_int<8>(b[0].denominator.to_int128()).shifted_left(fraction_bits(where.g));
            ASSERT_TRUE(left == right);
            ++seen;
        }
    }
    EXPECT_GT(seen, 5 * cases / 2);
}

TEST(OracleNearestFloat, RoundsOnceTiesToEven) {
    const auto of_ratio = [](std::int64_t n, std::int64_t d) { return nearest_float({wide(n), wide(d)}); };
    EXPECT_EQ(of_ratio(0, -3), 0.0f);
    EXPECT_FALSE(std::signbit(of_ratio(0, -3)));
    EXPECT_EQ(of_ratio(1, 3), 1.0f / 3.0f);
    EXPECT_EQ(of_ratio(-2, 3), -2.0f / 3.0f);
    EXPECT_EQ(of_ratio(2, -3), -2.0f / 3.0f);
    EXPECT_EQ(of_ratio((1 << 24) + 1, 1), 16777216.0f); // tie, to even
    EXPECT_EQ(of_ratio((1 << 24) + 3, 1), 16777220.0f); // tie, to even above
    EXPECT_EQ(of_ratio((std::int64_t{1} << 40) + (1 << 16) + 1, std::int64_t{1} << 40), 1.0f + 0x1p-23f);
    EXPECT_EQ(of_ratio((std::int64_t{1} << 40) + (1 << 16), std::int64_t{1} << 40), 1.0f);
    splitmix64 random(6);
    for (int n = 0; n < 100000; ++n) { // a double quotient of 24-bit numbers rounds to float as the exact one does
        const auto a = static_cast<float>(random.between(-(1 << 24), 1 << 24));
        const auto b = static_cast<float>(random.between(1, 1 << 24));
        ASSERT_EQ(of_ratio(static_cast<std::int64_t>(a), static_cast<std::int64_t>(b)), a / b);
    }
    EXPECT_THROW(static_cast<void>(nearest_float({wide(1).shifted_left(129), wide(1)})), std::overflow_error);
}

TEST(OracleNearestDouble, RoundsOnceTiesToEven) {
    const std::int64_t tie = (std::int64_t{1} << 53) + 1;
    EXPECT_EQ(nearest_double({wide(tie), wide(1)}), 0x1p53);
    EXPECT_EQ(nearest_double({wide(tie + 2), wide(-1)}), -(0x1p53 + 4));
    EXPECT_EQ(nearest_double({wide(tie).shifted_left(80) + wide(1), wide(1)}), 0x1p133 + 0x1p81);
    splitmix64 random(9);
    for (int n = 0; n < repeats(30000); ++n) {
        const std::int64_t a = random.between(-(std::int64_t{1} << 53), std::int64_t{1} << 53);
        const std::int64_t b = random.between(1, std::int64_t{1} << 53);
        ASSERT_EQ(nearest_double({wide(a), wide(b)}), static_cast<double>(a) / static_cast<double>(b));
        ASSERT_EQ(nearest_double({wide(a) * wide(b), wide(1)}), static_cast<double>(a) * static_cast<double>(b));
    }
}

// ---- Widths ----

TEST(OracleArithmetic, EveryWidthGivesTheSameVoxels) {
    splitmix64 random(7);
    long in_64 = 0, in_128 = 0;
    for (const triangle_class kind : all_triangle_classes) {
        for (const test_grid& where : test_grids()) {
            if (!where.dense && covers_much(kind)) continue; // millions of voxels a triangle
            const int count = covers_much(kind) ? 3 : 7;
            for (int n = 0; n < count; ++n) {
                const world_triangle w = make_triangle(random, where, kind);
                const snapped_triangle t = snap(where.g, w.v);
                if (t.dropped) continue;
                const voxels solid = conservative(where.g, t);
                if (solid.size() > 150) continue;
                const voxels columns = thin(where.g, t);
                ASSERT_EQ(conservative(where.g, t, arithmetic::bits256), solid) << name(kind) << ' ' << where.name;
                ASSERT_EQ(thin(where.g, t, arithmetic::bits256), columns) << name(kind) << ' ' << where.name;
                ASSERT_EQ(conservative(where.g, t, arithmetic::bits128), solid) << name(kind) << ' ' << where.name;
                ASSERT_EQ(thin(where.g, t, arithmetic::bits128), columns) << name(kind) << ' ' << where.name;
                try {
                    ASSERT_EQ(conservative(where.g, t, arithmetic::bits64), solid);
                    ++in_64;
                } catch (const std::overflow_error&) {
                    ++in_128;
                }
            }
        }
    }
    EXPECT_GT(in_64, 300); // both ways were taken
    EXPECT_GT(in_128, 100);
}

TEST(OracleArithmetic, RefusesToBeTooNarrow) {
    const grid g = unit_grid(2, 2, 2);
    const snapped_triangle t = snapped(g, {-0x1p24f, 0, 0}, {0x1p24f, 0, 0}, {0, 0x1p24f, 0});
    EXPECT_THROW(static_cast<void>(conservative(g, t, arithmetic::bits64)), std::overflow_error);
    snapped_triangle beyond = t;
    beyond.v[0][0] = -farthest_position - 1;
    EXPECT_THROW(static_cast<void>(conservative(g, beyond, arithmetic::bits128)), std::overflow_error);
    EXPECT_EQ(conservative(g, beyond).size(), 4u);
}

} // namespace
} // namespace oracle
