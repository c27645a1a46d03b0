// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// core/fixed_point.hpp and grid.hpp: the sub-voxel format, snapping against exact rationals rounded step by step, fit,
// crop and validate.

#include "test_support.hpp"

#include <voxelpipe/grid.hpp>

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <vector>

namespace {

namespace vp = voxelpipe;
using unit::splitmix64;

TEST(FractionBits, AreWhatAFloatHasLeft) {
    for (int extent = 1; extent <= 1 << 20; extent = extent < 5000 ? extent + 1 : extent * 2 - 1) {
        int log2 = 0;
        while ((std::int64_t{1} << log2) < extent) ++log2;
        EXPECT_EQ(vp::core::fraction_bits(extent), std::min(16, 24 - log2)) << extent;
    }
}

// The formula in exact rationals. Each step is rounded to double explicitly.
std::optional<std::int64_t> snap_model(double p, double origin, double scale) {
    const unit::rational a = unit::exact(p), b = unit::exact(origin);
    const unit::rational difference{a.numerator * b.denominator - b.numerator * a.denominator,
                                    a.denominator * b.denominator};
    const unit::rational d = unit::exact(unit::nearest_double(difference)), s = unit::exact(scale);
    const double product = unit::nearest_double({d.numerator * s.numerator, d.denominator * s.denominator});
    if (std::fabs(product) > 0x1p40) return std::nullopt;
    return unit::round_to_integer(unit::exact(product)).to_int64();
}

TEST(Snap, IsTheFormulaWithEveryStepRoundedOnce) {
    splitmix64 random(1);
    for (std::int64_t i = 0; i < unit::cases(3000); ++i) {
        vp::core::snap_transform t{};
        t.fraction = 14;
        float p[3];
        for (int a = 0; a < 3; ++a) {
            t.origin[a] = unit::spread_double(random, -30, 10);
            t.scale[a] = std::fabs(unit::spread_double(random, -10, 30)) + 0x1p-20;
            p[a] = static_cast<float>(unit::spread_double(random, -30, 12));
        }
        const std::optional<std::int64_t> expected[3] = {snap_model(p[0], t.origin[0], t.scale[0]),
                                                         snap_model(p[1], t.origin[1], t.scale[1]),
                                                         snap_model(p[2], t.origin[2], t.scale[2])};
        const vp::core::snapped_position q = vp::core::snap(t, p[0], p[1], p[2]);
        if (expected[0] && expected[1] && expected[2]) {
            ASSERT_TRUE(vp::core::is_drawable(q));
            ASSERT_EQ(q.x, *expected[0]);
            ASSERT_EQ(q.y, *expected[1]);
            ASSERT_EQ(q.z, *expected[2]);
        } else {
            ASSERT_EQ(q.x, vp::core::too_far_mark);
        }
    }
}

// Positions whose product is exactly half a unit, after a difference that was rounded: any other order of the steps, or
// one rounding fewer, leaves the tie and snaps some of them to the other unit.
TEST(Snap, RoundsTheDifferenceThenTheProduct) {
    splitmix64 random(4);
    int ties = 0, fused_differs = 0;
    for (std::int64_t i = 0; i < unit::cases(3'000); ++i) {
        const double scale = random.uniform(3000.0, 70000.0);
        const double half_units =
            static_cast<double>(random.between(std::int64_t{1} << 36, std::int64_t{1} << 39)) + 0.5;
        const double difference = half_units / scale;
        const auto p = static_cast<float>(difference * random.uniform(-1.0, 1.0));
        const double origin = double{p} - difference;
        if (double{p} - origin != difference || difference * scale != half_units) continue;
        ++ties;
        vp::core::snap_transform t{};
        t.fraction = 14;
        for (int a = 0; a < 3; ++a) {
            t.origin[a] = origin;
            t.scale[a] = scale;
        }
        const std::int64_t expected = snap_model(p, origin, scale).value();
        const vp::core::snapped_position q = vp::core::snap(t, p, p, p);
        ASSERT_EQ(q.x, expected);
        ASSERT_EQ(q.y, expected);
        ASSERT_EQ(q.z, expected);
        fused_differs += std::llrint(std::fma(double{p}, scale, -(origin * scale))) != expected ? 1 : 0;
    }
    EXPECT_GT(ties, 20);
    EXPECT_GT(fused_differs, ties / 50);
}

// Positions half-way between two sub-voxel units go to the even one.
TEST(Snap, TakesTiesToEven) {
    vp::grid g;
    g.extent = glm::ivec3(1024);
    g.origin = glm::dvec3(-3.0, 0.0, 5.0);
    const vp::core::snap_transform t = vp::core::make_snap_transform(g);
    ASSERT_EQ(t.fraction, 14);
    splitmix64 random(2);
    for (std::int64_t i = 0; i < unit::cases(100'000); ++i) {
        const std::int64_t units = random.between(-(1 << 20), 1 << 20);
        // A float holds (units + 1/2) / 2^14 exactly, and so the sum with the origin.
        const double offset = std::ldexp(static_cast<double>(2 * units + 1), -15);
        const auto x = static_cast<float>(offset - 3.0), z = static_cast<float>(offset + 5.0);
        ASSERT_EQ(double{x} + 3.0, offset);
        ASSERT_EQ(double{z} - 5.0, offset);
        const std::int64_t even = units + (units & 1);
        const auto q = vp::core::snap(t, x, 0.0f, z);
        ASSERT_EQ(q.x, even);
        ASSERT_EQ(q.y, 0);
        ASSERT_EQ(q.z, even);
    }
}

TEST(Snap, MarksWhatCannotBeDrawn) {
    vp::grid g;
    g.extent = glm::ivec3(1024);
    const vp::core::snap_transform t = vp::core::make_snap_transform(g);
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = HUGE_VALF;
    for (const float bad : {nan, -nan, inf, -inf})
        for (int a = 0; a < 3; ++a) {
            float p[3] = {1, 1, 1};
            p[a] = bad;
            EXPECT_EQ(vp::core::snap(t, p[0], p[1], p[2]).x, vp::core::nonfinite_mark);
        }
    // 2^40 units of 2^-14 voxel: 2^26 is the last position that counts as near.
    for (int a = 0; a < 3; ++a)
        for (const float sign : {1.0f, -1.0f}) {
            float p[3] = {1, 1, 1};
            p[a] = sign * 0x1p26f;
            EXPECT_TRUE(vp::core::is_drawable(vp::core::snap(t, p[0], p[1], p[2])));
            p[a] = sign * std::nextafterf(0x1p26f, HUGE_VALF);
            EXPECT_EQ(vp::core::snap(t, p[0], p[1], p[2]).x, vp::core::too_far_mark);
            p[a] = sign * std::numeric_limits<float>::max();
            EXPECT_EQ(vp::core::snap(t, p[0], p[1], p[2]).x, vp::core::too_far_mark);
        }
}

TEST(Grid, CropSnapsAsTheWholeDoes) {
    vp::grid g;
    g.extent = {100, 700, 30};
    g.origin = {0.1, -7.3, 2e3};
    g.voxel_size = {0.01, 0.3, 1.7};
    const vp::grid part = g.crop({7, 11, 2}, {20, 300, 5}).crop({1, 2, 3}, {4, 5, 1});
    EXPECT_EQ(part.offset, glm::ivec3(8, 13, 5));
    EXPECT_EQ(part.extent, glm::ivec3(4, 5, 1));
    EXPECT_EQ(part.whole_extent(), g.extent);
    EXPECT_TRUE(vp::validate(part).ok());
    const auto whole = vp::core::make_snap_transform(g), cropped = vp::core::make_snap_transform(part);
    EXPECT_EQ(whole.fraction, 14); // of the whole grid's longest side
    EXPECT_EQ(cropped.fraction, whole.fraction);
    splitmix64 random(3);
    for (int i = 0; i < 1000; ++i) {
        const auto f = [&](int a) {
            return static_cast<float>(g.origin[a] + g.voxel_size[a] * random.uniform(-10.0, 2.0 * g.extent[a]));
        };
        const float x = f(0), y = f(1), z = f(2);
        const auto a = vp::core::snap(whole, x, y, z), b = vp::core::snap(cropped, x, y, z);
        ASSERT_EQ(a.x - (8 << 14), b.x);
        ASSERT_EQ(a.y - (13 << 14), b.y);
        ASSERT_EQ(a.z - (5 << 14), b.z);
    }
}

TEST(Grid, ValidateNamesWhatIsWrong) {
    vp::grid good;
    good.extent = {1, 2, 3};
    EXPECT_TRUE(vp::validate(good).ok());
    const auto code = [&](auto change) {
        vp::grid g = good;
        change(g);
        return vp::validate(g).code;
    };
    using vp::status_code;
    for (int a = 0; a < 3; ++a) {
        for (const int n : {0, -1, std::numeric_limits<int>::min()})
            EXPECT_EQ(code([&](vp::grid& g) { g.extent[a] = n; }), status_code::bad_extent);
        EXPECT_EQ(code([&](vp::grid& g) { g.extent[a] = vp::grid::max_extent; }), status_code::ok);
        EXPECT_EQ(code([&](vp::grid& g) { g.extent[a] = vp::grid::max_extent + 1; }), status_code::extent_too_large);
        for (const double bad : {HUGE_VAL, -HUGE_VAL, std::nan("")}) {
            EXPECT_EQ(code([&](vp::grid& g) { g.origin[a] = bad; }), status_code::bad_origin);
            EXPECT_EQ(code([&](vp::grid& g) { g.voxel_size[a] = bad; }), status_code::bad_voxel_size);
        }
        for (const double bad : {0.0, -0.0, -1.0, 1e-320, 5e-305, 1.7e308})
            EXPECT_EQ(code([&](vp::grid& g) { g.voxel_size[a] = bad; }), status_code::bad_voxel_size) << bad;
        EXPECT_EQ(code([&](vp::grid& g) { g.offset[a] = -1; }), status_code::bad_crop);
        EXPECT_EQ(code([&](vp::grid& g) { g = g.crop(glm::ivec3(0), g.extent + 1); }), status_code::bad_crop);
        EXPECT_EQ(code([&](vp::grid& g) {
                      g.whole = {4, 4, 4};
                      g.offset[a] = 4;
                  }),
                  status_code::bad_crop);
    }
}

// The formula in exact rationals: each step is rounded once, 1 + 2 margin and the origin by a fused step.
TEST(Fit, IsTheFormulaWithEveryStepRoundedOnce) {
    const auto plus = [](const unit::rational& a, const unit::rational& b) {
        return unit::rational{a.numerator * b.denominator + b.numerator * a.denominator, a.denominator * b.denominator};
    };
    const auto times = [](const unit::rational& a, const unit::rational& b) {
        return unit::rational{a.numerator * b.numerator, a.denominator * b.denominator};
    };
    splitmix64 random(5);
    int fusing_shows = 0;
    for (std::int64_t i = 0; i < unit::cases(500); ++i) {
        std::vector<glm::vec3> positions;
        for (int n = 0; n < 2; ++n)
            positions.emplace_back(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(-9, 9));
        const glm::ivec3 extent(static_cast<int>(random.between(1, 3000)));
        const double margin = random.uniform(0.0, 0.1);
        const unit::rational two{unit::wide(2)}, one{unit::wide(1)};
        const double larger = unit::nearest_double(plus(times(two, unit::exact(margin)), one));
        double size = 0, lo[3], hi[3];
        for (int a = 0; a < 3; ++a) {
            lo[a] = std::min(positions[0][a], positions[1][a]);
            hi[a] = std::max(positions[0][a], positions[1][a]);
            const double box = unit::nearest_double(plus(unit::exact(hi[a]), unit::exact(-lo[a])));
            const unit::rational side = unit::exact(unit::nearest_double(times(unit::exact(box), unit::exact(larger))));
            size = std::max(size, unit::nearest_double({side.numerator, side.denominator * unit::wide(extent.x)}));
        }
        const vp::grid g = vp::fit(positions, extent, margin);
        for (int a = 0; a < 3; ++a) {
            ASSERT_EQ(g.voxel_size[a], size);
            const double middle = 0.5 * unit::nearest_double(plus(unit::exact(lo[a]), unit::exact(hi[a])));
            const unit::rational half = times(unit::exact(-0.5 * extent[a]), unit::exact(size));
            ASSERT_EQ(g.origin[a], unit::nearest_double(plus(half, unit::exact(middle))));
            const double rounded = unit::nearest_double(half);
            fusing_shows +=
                unit::nearest_double(plus(unit::exact(rounded), unit::exact(middle))) != g.origin[a] ? 1 : 0;
        }
    }
    EXPECT_GT(fusing_shows, unit::cases(500) / 5);
}

TEST(Fit, CentresABoxOfCubicVoxelsRoundThePositions) {
    const std::vector<glm::vec3> positions{
        {-1, 2, 3}, {5, 4, 3.5f}, {2, 3, 3}, {std::nanf(""), 0, 0}, {0, -HUGE_VALF, 0}};
    for (const glm::ivec3 extent : {glm::ivec3(100), glm::ivec3(600, 10, 300), glm::ivec3(1, 1, 1)}) {
        const vp::grid g = vp::fit(positions, extent);
        EXPECT_EQ(g.extent, extent);
        EXPECT_TRUE(vp::validate(g).ok());
        EXPECT_EQ(g.voxel_size.x, g.voxel_size.y);
        EXPECT_EQ(g.voxel_size.x, g.voxel_size.z);
        const glm::dvec3 size{6, 2, 0.5}, centre{2, 3, 3.25};
        double tightest = 0;
        for (int a = 0; a < 3; ++a) {
            EXPECT_NEAR(g.origin[a] + 0.5 * extent[a] * g.voxel_size[a], centre[a], 1e-12);
            tightest = std::max(tightest, size[a] / (extent[a] * g.voxel_size[a]));
        }
        EXPECT_NEAR(tightest, 1.0 / 1.0002, 1e-12);
    }
    EXPECT_NEAR(vp::fit(positions, glm::ivec3(100), 0.0).voxel_size.x, 0.06, 1e-15);
    // One point, or none: voxels of size 1.
    EXPECT_EQ(vp::fit(std::vector<glm::vec3>{{7, 7, 7}}, glm::ivec3(4)).voxel_size, glm::dvec3(1.0));
    EXPECT_EQ(vp::fit(std::vector<glm::vec3>{}, glm::ivec3(4)).origin, glm::dvec3(-2.0));
}

} // namespace
