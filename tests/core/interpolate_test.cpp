// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// core/interpolate.hpp: barycentrics and normals against exact rationals, varyings of every kind, clamping.

#include "hard_triangles.hpp"
#include "test_support.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/core/interpolate.hpp>
#include <voxelpipe/grid.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace {

namespace vp = voxelpipe;
using unit::splitmix64;
using vp::int128;
using vp::core::snapped_position;

constexpr int fraction = 14;

struct triangle {
    snapped_position v[3];
};

// Edges up to 2^bits units.
triangle random_triangle(splitmix64& random, int bits) {
    triangle t{};
    const std::int64_t size = std::int64_t{1} << random.between(2, bits), at = std::int64_t{1} << 25;
    const auto c = [&] { return random.between(-at, at); };
    const std::int64_t x = c(), y = c(), z = c();
    for (auto& v : t.v) v = {x + random.between(0, size), y + random.between(0, size), z + random.between(0, size)};
    return t;
}

// The same in wide integers: normal, dominant axis, barycentric numerators over twice the projected area.
struct model {
    unit::wide normal[3]; // x y z
    int axis;             // -1: zero area

    explicit model(const triangle& t) {
        const auto sub = [](std::int64_t a, std::int64_t b) { return unit::wide(a) - unit::wide(b); };
        const unit::wide e1[3] = {sub(t.v[1].x, t.v[0].x), sub(t.v[1].y, t.v[0].y), sub(t.v[1].z, t.v[0].z)};
        const unit::wide e2[3] = {sub(t.v[2].x, t.v[0].x), sub(t.v[2].y, t.v[0].y), sub(t.v[2].z, t.v[0].z)};
        unit::wide size[3];
        for (std::size_t a = 0; a < 3; ++a) {
            normal[a] = e1[(a + 1) % 3] * e2[(a + 2) % 3] - e1[(a + 2) % 3] * e2[(a + 1) % 3];
            size[a] = normal[a].sign() < 0 ? -normal[a] : normal[a];
        }
        axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
        if (size[static_cast<std::size_t>(axis)].sign() == 0) axis = -1;
    }

    // Weights at the centre of column (u, v), as exact ratios.
    [[nodiscard]] std::array<unit::rational, 3> weights(const triangle& t, std::int64_t u, std::int64_t v,
                                                        int fraction_bits = fraction) const {
        const auto coordinate = [](const snapped_position& p, int a) {
            return unit::wide(a == 0 ? p.x : a == 1 ? p.y : p.z);
        };
        const int ua = (axis + 1) % 3, va = (axis + 2) % 3;
        const unit::wide half = unit::power_of_two(fraction_bits - 1);
        const unit::wide cu = unit::wide(u).shifted_left(fraction_bits) + half,
                         cv = unit::wide(v).shifted_left(fraction_bits) + half;
        std::array<unit::rational, 3> w;
        for (std::size_t i = 0; i < 3; ++i) {
            const snapped_position &p = t.v[(i + 1) % 3], &q = t.v[(i + 2) % 3];
            unit::wide n = (coordinate(q, ua) - coordinate(p, ua)) * (cv - coordinate(p, va)) -
                           (coordinate(q, va) - coordinate(p, va)) * (cu - coordinate(p, ua));
            unit::wide d = normal[static_cast<std::size_t>(axis)];
            if (d.sign() < 0) {
                n = -n;
                d = -d;
            }
            w[i] = {n, d};
        }
        return w;
    }
};

unit::rational sum(const unit::rational& a, const unit::rational& b) {
    return {a.numerator * b.denominator + b.numerator * a.denominator, a.denominator * b.denominator};
}
unit::rational product(const unit::rational& a, const unit::rational& b) {
    return {a.numerator * b.numerator, a.denominator * b.denominator};
}
double rounded_product(double a, double b) { return unit::nearest_double(product(unit::exact(a), unit::exact(b))); }
double rounded_fma(double a, double b, double c) {
    return unit::nearest_double(sum(product(unit::exact(a), unit::exact(b)), unit::exact(c)));
}

// The triangle in 32 bits, relative to the lowest voxel of its box.
vp::core::small_triangle in_box(const triangle& t, const vp::core::voxel_box& box, int fraction_bits) {
    vp::core::small_triangle small{};
    for (int k = 0; k < 3; ++k)
        for (int a = 0; a < 3; ++a) {
            const std::int64_t q = a == 0 ? t.v[k].x : a == 1 ? t.v[k].y : t.v[k].z;
            small.p[k][a] = static_cast<std::int32_t>(q - (box.lo[a] << fraction_bits));
        }
    return small;
}

template <class Int>
void check_barycentrics(splitmix64& random, int bits) {
    const triangle t = random_triangle(random, bits);
    const model m(t);
    const auto setup = vp::core::setup_triangle<vp::core::span_rule::thin, Int>(t.v[0], t.v[1], t.v[2], fraction);
    ASSERT_EQ(setup.zero_area, m.axis < 0);
    if (m.axis < 0) {
        EXPECT_EQ(vp::core::barycentric(setup, 0, 0), glm::vec3(1.0f / 3.0f));
        return;
    }
    ASSERT_EQ(setup.axis, m.axis);
    const std::int64_t u = setup.origin[0] + random.between(-1, setup.last[0] + 1);
    const std::int64_t v = setup.origin[1] + random.between(-1, setup.last[1] + 1);
    const glm::vec3 b = vp::core::barycentric(setup, u, v);
    const auto exact = m.weights(t, u, v);
    for (int i = 0; i < 3; ++i) {
        const unit::rational& w = exact[static_cast<std::size_t>(i)];
        // Numerator and denominator are rounded to double if they do not fit, then the quotient, then the float.
        const double n = unit::nearest_double({w.numerator + w.numerator}),
                     d = unit::nearest_double({w.denominator + w.denominator});
        ASSERT_EQ(b[i], static_cast<float>(n / d));
        if constexpr (std::is_same_v<Int, std::int64_t>) {
            ASSERT_EQ(b[i], static_cast<float>(unit::nearest_double(w))); // 64-bit path: exact before the roundings
        }
    }
    ASSERT_NEAR(b.x + b.y + b.z, 1.0f, 1e-5f * (1.0f + std::fabs(b.x) + std::fabs(b.y) + std::fabs(b.z)));
}

TEST(Barycentric, IsTheExactRatioRounded) {
    splitmix64 random(1);
    for (std::int64_t i = 0; i < unit::cases(20'000); ++i) {
        check_barycentrics<std::int64_t>(random, 24);
        check_barycentrics<int128>(random, i % 2 == 0 ? 24 : 40);
    }
}

// The 32-bit frame of a small triangle gives the same bits as the 64-bit one: weights, axis and normal.
TEST(Barycentric, OfASmallTriangleIsTheSame) {
    splitmix64 random(5);
    int zero_areas = 0;
    for (std::int64_t i = 0; i < unit::cases(50'000); ++i) {
        triangle t = random_triangle(random, random.one_in(3) ? 3 : 18);
        if (random.one_in(7)) t.v[2] = t.v[random.below(2)];
        const auto setup = vp::core::make_frame<std::int64_t>(t.v[0], t.v[1], t.v[2], fraction);
        const vp::core::voxel_box box = vp::core::bounds(t.v[0], t.v[1], t.v[2], fraction);
        const vp::core::small_frame frame(in_box(t, box, fraction), fraction);
        ASSERT_EQ(frame.axis, setup.axis);
        ASSERT_EQ(frame.zero_area, setup.zero_area);
        zero_areas += frame.zero_area;
        const auto last =
            vp::core::to_uvw(frame.axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
        ASSERT_LT(vp::core::max3(last[0], last[1], last[2]), vp::core::small_voxels(fraction));
        const auto u = static_cast<int>(random.between(0, last[0])), v = static_cast<int>(random.between(0, last[1]));
        const glm::vec3 a = vp::core::barycentric(setup, setup.origin[0] + u, setup.origin[1] + v),
                        b = vp::core::barycentric(frame, u, v);
        ASSERT_EQ(std::memcmp(&a, &b, sizeof(a)), 0);
        const vp::core::triple<double> factors{{1.0, 0.5, 3.0}};
        const glm::vec3 n = vp::core::unit_normal(setup, factors), m = vp::core::unit_normal(frame, factors);
        ASSERT_EQ(std::memcmp(&n, &m, sizeof(n)), 0);
    }
    EXPECT_GT(zero_areas, 100);
}

// The weights of the table's triangles lie on the middle between two floats once they are doubles: a quotient rounded
// straight to float differs for some, a product with the area's reciprocal for others.
TEST(Barycentric, OfHardTrianglesIsRoundedToDoubleThenFloat) {
    int known = 0, once = 0, by_reciprocal = 0;
    for (const golden::hard_triangle& h : golden::hard_triangles) {
        if (h.voxel[0] < 0) continue;
        ++known;
        triangle t{};
        for (std::size_t k = 0; k < 3; ++k) t.v[k] = {h.vertices[k][0], h.vertices[k][1], h.vertices[k][2]};
        const auto check = [&](const glm::vec3& b, const char* frame) {
            for (int a = 0; a < 3; ++a)
                EXPECT_EQ(std::bit_cast<std::uint32_t>(b[a]), h.barycentric[a]) << h.name << ", " << frame;
        };
        const auto narrow = vp::core::make_frame<std::int64_t>(t.v[0], t.v[1], t.v[2], 16);
        const auto at = vp::core::to_uvw(narrow.axis, h.voxel[0], h.voxel[1], h.voxel[2]);
        check(vp::core::barycentric(narrow, at[0], at[1]), "64 bits");
        check(vp::core::barycentric(vp::core::make_frame<int128>(t.v[0], t.v[1], t.v[2], 16), at[0], at[1]),
              "128 bits");
        const vp::core::voxel_box box = vp::core::bounds(t.v[0], t.v[1], t.v[2], 16);
        const auto last =
            vp::core::to_uvw(narrow.axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
        if (vp::core::max3(last[0], last[1], last[2]) < vp::core::small_voxels(16)) {
            const vp::core::small_frame small(in_box(t, box, 16), 16);
            check(vp::core::barycentric(small, static_cast<int>(at[0] - narrow.origin[0]),
                                        static_cast<int>(at[1] - narrow.origin[1])),
                  "32 bits");
        }
        const auto exact = model(t).weights(t, at[0], at[1], 16);
        const auto first = std::bit_cast<float>(h.barycentric[0]);
        once += unit::nearest_float(exact[0]) != first ? 1 : 0;
        const double n = unit::nearest_double({exact[0].numerator}), d = unit::nearest_double({exact[0].denominator});
        by_reciprocal += static_cast<float>(n * (1.0 / d)) != first ? 1 : 0;
    }
    EXPECT_GT(known, 20);
    EXPECT_GT(once, 3);
    EXPECT_GT(by_reciprocal, 3);
}

// (x + y) + z, each sum rounded once, and a quotient each.
TEST(Barycentric, ClampedIsTheWrittenStepsRoundedOnce) {
    splitmix64 random(7);
    int other_order = 0;
    for (std::int64_t i = 0; i < unit::cases(20'000); ++i) {
        const auto f = [&] { return static_cast<float>(random.uniform(-0.3, 1.0)); };
        const glm::vec3 b{f(), f(), f()};
        float kept[3];
        for (int k = 0; k < 3; ++k) kept[k] = b[k] > 0 ? b[k] : 0.0f;
        if (kept[0] + kept[1] + kept[2] == 0) continue;
        const auto rounded_sum = [](float p, float q) {
            return unit::nearest_float(sum(unit::exact(p), unit::exact(q)));
        };
        const float total = rounded_sum(rounded_sum(kept[0], kept[1]), kept[2]);
        other_order += rounded_sum(kept[0], rounded_sum(kept[1], kept[2])) != total ? 1 : 0;
        const unit::rational divisor = unit::exact(total);
        const glm::vec3 c = vp::core::clamp_barycentric(b);
        for (int k = 0; k < 3; ++k) {
            const unit::rational n = unit::exact(kept[k]);
            ASSERT_EQ(c[k],
                      unit::nearest_float({n.numerator * divisor.denominator, n.denominator * divisor.numerator}));
        }
    }
    EXPECT_GT(other_order, 0);
}

TEST(Barycentric, ClampedLiesOnTheTriangle) {
    splitmix64 random(2);
    for (std::int64_t i = 0; i < unit::cases(100'000); ++i) {
        const auto f = [&] { return static_cast<float>(unit::spread_double(random, -5, 5)); };
        glm::vec3 b{f(), f(), 0};
        b.z = 1.0f - b.x - b.y; // so that the weights sum to 1, as for a point of the plane
        const glm::vec3 c = vp::core::clamp_barycentric(b);
        for (int k = 0; k < 3; ++k) {
            ASSERT_GE(c[k], 0.0f);
            ASSERT_LE(c[k], 1.0f);
            ASSERT_TRUE(b[k] > 0 || c[k] == 0.0f);
        }
        ASSERT_NEAR(c.x + c.y + c.z, 1.0f, 3e-7f);
        const bool inside = b.x >= 0 && b.y >= 0 && b.z >= 0 && b.x + b.y + b.z == 1.0f;
        ASSERT_TRUE(!inside || c == b); // untouched
    }
}

// ---- normals --------------------------------------------------------------------------------------------------------

// The normal by exact numbers and one rounding for each written step: integer to double, times the factor, x * x, then
// two fused steps, square root, quotient, to float.
glm::vec3 normal_model(const unit::wide (&normal)[3], const vp::core::triple<double>& factors) {
    double n[3];
    for (int a = 0; a < 3; ++a) n[a] = rounded_product(unit::nearest_double({normal[a]}), factors[a]);
    const double square = rounded_fma(n[2], n[2], rounded_fma(n[1], n[1], rounded_product(n[0], n[0])));
    const double length = std::sqrt(square);
    glm::vec3 r;
    for (int a = 0; a < 3; ++a) r[a] = static_cast<float>(n[a] / length);
    return r;
}

bool same_bits(const glm::vec3& a, const glm::vec3& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

template <class Int>
void check_normal(splitmix64& random, int bits) {
    const triangle t = random_triangle(random, bits);
    const model m(t);
    const auto setup = vp::core::setup_triangle<vp::core::span_rule::thin, Int>(t.v[0], t.v[1], t.v[2], fraction);
    const auto factor = [&] { return random.one_in(3) ? 1.0 : random.uniform(0.01, 1.0); };
    const vp::core::triple<double> factors{{factor(), factor(), factor()}};
    const glm::vec3 n = vp::core::unit_normal(setup, factors);
    if (m.axis < 0) {
        ASSERT_EQ(n, glm::vec3(0.0f));
    } else {
        ASSERT_TRUE(same_bits(n, normal_model(m.normal, factors)));
    }
}

TEST(UnitNormal, IsTheExactNormalRoundedStepByStep) {
    splitmix64 random(3);
    for (std::int64_t i = 0; i < unit::cases(10'000); ++i) {
        check_normal<std::int64_t>(random, 24);
        check_normal<int128>(random, i % 2 == 0 ? 24 : 40);
    }
}

// Triangles for which any other order of the fused steps gives another float; a random triangle shows that once in
// 10^9.
TEST(UnitNormal, OfHardTrianglesIsThatOfTheWrittenOrder) {
    const vp::core::triple<double> ones{{1.0, 1.0, 1.0}};
    int small_frames = 0;
    for (const golden::hard_triangle& h : golden::hard_triangles) {
        triangle t{};
        for (std::size_t k = 0; k < 3; ++k) t.v[k] = {h.vertices[k][0], h.vertices[k][1], h.vertices[k][2]};
        glm::vec3 expected;
        for (int a = 0; a < 3; ++a) expected[a] = std::bit_cast<float>(h.normal[a]);
        ASSERT_TRUE(same_bits(normal_model(model(t).normal, ones), expected)) << "the table is not the model's";
        const auto narrow = vp::core::make_frame<std::int64_t>(t.v[0], t.v[1], t.v[2], 16);
        const auto wide = vp::core::make_frame<int128>(t.v[0], t.v[1], t.v[2], 16);
        EXPECT_TRUE(same_bits(vp::core::unit_normal(narrow, ones), expected)) << h.name;
        EXPECT_TRUE(same_bits(vp::core::unit_normal(wide, ones), expected)) << h.name;
        const vp::core::voxel_box box = vp::core::bounds(t.v[0], t.v[1], t.v[2], 16);
        bool small = true;
        for (int a = 0; a < 3; ++a) small = small && box.hi[a] - box.lo[a] < vp::core::small_voxels(16);
        if (!small) continue;
        ++small_frames;
        const vp::core::small_frame frame(in_box(t, box, 16), 16);
        EXPECT_TRUE(same_bits(vp::core::unit_normal(frame, ones), expected)) << h.name;
    }
    EXPECT_GT(small_frames, 5);
}

// The table refutes each other way to round the length: the five other orders and sums that are not fused.
TEST(UnitNormal, HardTrianglesTellEveryOrderApart) {
    std::array<int, 3> order{0, 1, 2};
    do {
        for (const bool fused : {true, false}) {
            int refuted = 0;
            for (const golden::hard_triangle& h : golden::hard_triangles) {
                triangle t{};
                for (std::size_t k = 0; k < 3; ++k) t.v[k] = {h.vertices[k][0], h.vertices[k][1], h.vertices[k][2]};
                const model m(t);
                double n[3];
                for (std::size_t a = 0; a < 3; ++a) n[a] = unit::nearest_double({m.normal[a]});
                const double x = n[order[0]], y = n[order[1]], z = n[order[2]];
                const double xx = rounded_product(x, x), yy = rounded_product(y, y), zz = rounded_product(z, z);
                const double square = fused ? rounded_fma(z, z, rounded_fma(y, y, xx)) : (xx + yy) + zz;
                const double length = std::sqrt(square);
                for (int a = 0; a < 3; ++a)
                    refuted += std::bit_cast<std::uint32_t>(static_cast<float>(n[a] / length)) != h.normal[a] ? 1 : 0;
            }
            const bool written = fused && order == std::array<int, 3>{0, 1, 2};
            if (written)
                EXPECT_EQ(refuted, 0);
            else
                EXPECT_GT(refuted, 0) << "order " << order[0] << order[1] << order[2] << (fused ? "" : ", not fused");
        }
    } while (std::next_permutation(order.begin(), order.end()));
}

TEST(UnitNormal, FollowsTheShapeOfTheVoxels) {
    // In voxels of 1 x 2 x 4 a triangle through one voxel's corners on the three axes has the world normal (4, 2, 1).
    const snapped_position x{1 << fraction, 0, 0}, y{0, 1 << fraction, 0}, z{0, 0, 1 << fraction};
    const auto setup = vp::core::setup_triangle<vp::core::span_rule::thin, std::int64_t>(x, y, z, fraction);
    vp::grid g;
    g.extent = glm::ivec3(4);
    g.voxel_size = {1.0, 2.0, 4.0};
    const glm::vec3 n = vp::core::unit_normal(setup, vp::core::normal_factors(g));
    const double length = std::sqrt(21.0);
    EXPECT_NEAR(n.x, 4 / length, 1e-7);
    EXPECT_NEAR(n.y, 2 / length, 1e-7);
    EXPECT_NEAR(n.z, 1 / length, 1e-7);
}

// Each size over the largest, rounded; then the product of the two others, rounded.
TEST(NormalFactors, AreQuotientsThenProductsRoundedOnceEach) {
    splitmix64 random(6);
    for (std::int64_t i = 0; i < unit::cases(5'000); ++i) {
        vp::grid g;
        for (int a = 0; a < 3; ++a) g.voxel_size[a] = random.uniform(0.1, 9.0);
        const double largest = std::max(g.voxel_size.x, std::max(g.voxel_size.y, g.voxel_size.z));
        double relative[3];
        for (int a = 0; a < 3; ++a) {
            const unit::rational size = unit::exact(g.voxel_size[a]), of = unit::exact(largest);
            relative[a] = unit::nearest_double({size.numerator * of.denominator, size.denominator * of.numerator});
        }
        const auto factors = vp::core::normal_factors(g);
        for (int a = 0; a < 3; ++a)
            ASSERT_EQ(factors[a], rounded_product(relative[(a + 1) % 3], relative[(a + 2) % 3])) << a;
    }
    vp::grid cubes;
    cubes.voxel_size = glm::dvec3(0.3);
    for (int a = 0; a < 3; ++a) EXPECT_EQ(vp::core::normal_factors(cubes)[a], 1.0);
}

// ---- varyings -------------------------------------------------------------------------------------------------------

struct everything {
    float scalar;
    glm::vec2 two;
    glm::vec3 three;
    glm::vec4 four;
    std::array<float, 5> many;
    vp::flat<std::uint64_t> id;
};
struct twelve {
    float a, b, c, d, e, f, g, h, i, j, k, l;
};
struct one {
    float a;
};
struct nothing {};

static_assert(vp::core::num_members<everything>() == 6);
static_assert(vp::core::num_members<twelve>() == 12);
static_assert(vp::core::num_members<one>() == 1);
static_assert(vp::core::is_varyings<everything>() && vp::core::is_varyings<twelve>() &&
              vp::core::is_varyings<nothing>());

everything make_varyings(float base, std::uint64_t id) {
    everything v{};
    v.scalar = base;
    v.two = {base + 1, base + 2};
    v.three = {base + 3, base + 4, base + 5};
    v.four = {base + 6, base + 7, base + 8, base + 9};
    for (std::size_t i = 0; i < 5; ++i) v.many[i] = base + 10 + static_cast<float>(i);
    v.id.value = id;
    return v;
}

float mixed(float a, float b, float c, float t1, float t2) {
    const float first = std::fma(t1, vp::exact::sub(b, a), a);
    return std::fma(t2, vp::exact::sub(c, a), first);
}

TEST(Varyings, EveryMemberIsInterpolatedByTheWrittenSteps) {
    splitmix64 random(4);
    for (std::int64_t i = 0; i < unit::cases(10'000); ++i) {
        const auto f = [&] { return static_cast<float>(unit::spread_double(random, -8, 8)); };
        const float x = f(), y = f(), z = f(), t1 = f(), t2 = f();
        const everything a = make_varyings(x, 1), b = make_varyings(y, 2), c = make_varyings(z, 3);
        const everything m = vp::core::mix(a, b, c, t1, t2);
        ASSERT_EQ(m.scalar, mixed(x, y, z, t1, t2));
        for (int k = 0; k < 2; ++k) ASSERT_EQ(m.two[k], mixed(a.two[k], b.two[k], c.two[k], t1, t2));
        for (int k = 0; k < 3; ++k) ASSERT_EQ(m.three[k], mixed(a.three[k], b.three[k], c.three[k], t1, t2));
        for (int k = 0; k < 4; ++k) ASSERT_EQ(m.four[k], mixed(a.four[k], b.four[k], c.four[k], t1, t2));
        for (std::size_t k = 0; k < 5; ++k) ASSERT_EQ(m.many[k], mixed(a.many[k], b.many[k], c.many[k], t1, t2));
        ASSERT_EQ(m.id.value, 1u); // the first vertex's
    }
}

TEST(Varyings, TwelveMembersComeOutInOrder) {
    const twelve a{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    twelve b = a, c = a;
    b.d = 100;
    c.l = 200;
    const twelve m = vp::core::mix(a, b, c, 0.5f, 0.25f);
    EXPECT_EQ(m.d, 52.0f);
    EXPECT_EQ(m.l, 59.0f);
    EXPECT_EQ(m.a, 1.0f); // all vertices agree, so the value is exact for any weights
    EXPECT_EQ(m.k, 11.0f);
    EXPECT_EQ(vp::core::mix(one{1}, one{3}, one{9}, 0.5f, 0.0f).a, 2.0f);
    static_assert(std::is_empty_v<decltype(vp::core::mix(nothing{}, nothing{}, nothing{}, 0.f, 0.f))>);
}

TEST(Varyings, AtTheVerticesAreTheVertices) {
    const everything a = make_varyings(0.1f, 1), b = make_varyings(7.7f, 2), c = make_varyings(-3.3f, 3);
    EXPECT_EQ(vp::core::mix(a, b, c, 0.0f, 0.0f).four, a.four);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(vp::core::mix(a, b, c, 1.0f, 0.0f).four[k], b.four[k], 2e-6);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(vp::core::mix(a, b, c, 0.0f, 1.0f).four[k], c.four[k], 2e-6);
}

} // namespace
