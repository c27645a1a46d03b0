// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The written formula of one triangle and one sample, against exact fractions.

#include "distance_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace distances {
namespace {

using oracle::lattice_point;
using oracle::lattice_triangle;

vp::core::snapped_position snapped(const lattice_point& p) { return {p[0], p[1], p[2]}; }

vp::core::seen_triangle see_wide(const lattice_triangle& t, const lattice_point& p) {
    return vp::core::see_wide(snapped(t[0]), snapped(t[1]), snapped(t[2]), snapped(p));
}
vp::core::seen_triangle see_narrow(const lattice_triangle& t, const lattice_point& p) {
    return vp::core::see(vp::core::make_narrow(snapped(t[0]), snapped(t[1]), snapped(t[2])), static_cast<double>(p[0]),
                         static_cast<double>(p[1]), static_cast<double>(p[2]));
}

// A triangle and a sample of one of the families that break such formulas; coordinates from 0 to `size`.
struct pair {
    lattice_triangle triangle;
    lattice_point sample;
};
constexpr int num_families = 12;
pair make_pair(splitmix64& random, int family, std::int64_t size) {
    const auto anywhere = [&] {
        return lattice_point{random.between(0, size), random.between(0, size), random.between(0, size)};
    };
    const auto near = [&](const lattice_point& p, std::int64_t by) {
        lattice_point q = p;
        for (std::int64_t& c : q) c = std::clamp(c + random.between(-by, by), std::int64_t{0}, size);
        return q;
    };
    const auto between = [&](const lattice_point& a, const lattice_point& b, double t) {
        lattice_point q{};
        for (std::size_t k = 0; k < 3; ++k)
            q[k] = a[k] + static_cast<std::int64_t>(std::llround(t * static_cast<double>(b[k] - a[k])));
        return q;
    };
    const lattice_point a = anywhere(), b = anywhere(), c = anywhere();
    switch (family) {
    case 0: // of any size
        return {{a, b, c}, anywhere()};
    case 1: { // small, and near
        const lattice_triangle t{a, near(a, 100), near(a, 100)};
        return {t, near(a, 200)};
    }
    case 2: // a sliver: the third vertex within a few steps of an edge
        return {{a, b, near(between(a, b, random.unit()), 2)}, near(between(a, b, random.uniform(-0.2, 1.2)), 50)};
    case 3: { // the thinnest needle, seen from beyond its tips
        const lattice_triangle t{a, b, near(b, 1)};
        return {t, near(between(a, b, random.uniform(-0.3, 1.3)), 3)};
    }
    case 4: // a point
        return {{a, a, a}, random.one_in(2) ? near(a, 3) : b};
    case 5: // a segment
        return {{a, b, random.one_in(2) ? a : b}, near(between(a, b, random.uniform(-0.3, 1.3)), 1000)};
    case 6: { // in one line
        const lattice_point d{random.between(-9, 9), random.between(-9, 9), random.between(-9, 9)};
        lattice_triangle t{a, a, a};
        const std::int64_t m = random.between(0, size / 40), n = random.between(0, size / 40);
        for (std::size_t k = 0; k < 3; ++k) {
            t[1][k] += m * d[k];
            t[2][k] += n * d[k];
        }
        return {t, random.one_in(2) ? near(t[1], 20) : c};
    }
    case 7: { // the sample in the plane of an axis-parallel face, in, on and around it
        lattice_triangle t{a, b, c};
        const std::size_t k = random.below(3);
        t[1][k] = t[2][k] = t[0][k];
        lattice_point p = random.one_in(2) ? between(between(a, b, random.unit()), c, random.unit()) : anywhere();
        p[k] = t[0][k];
        return {t, p};
    }
    case 8: // the sample at a vertex, or a step from it
        return {{a, b, c}, random.one_in(2) ? b : near(b, 1)};
    case 9: // near an edge
        return {{a, b, c}, near(between(b, c, random.unit()), 5)};
    case 10: { // in front of the middle of a face
        return {{a, b, c}, near(between(between(a, b, 0.5), c, 1.0 / 3.0), 1 + size / 100)};
    }
    default: // an obtuse triangle, the sample beyond its blunt vertex
        return {{a, near(between(a, c, 0.5), 1 + size / 50), c}, near(between(a, c, random.unit()), 1 + size / 25)};
    }
}

// Checks a pair: the float is nearest, the square within 19.1 * 2^-53, the same from all orders and from both forms.
void check(const pair& p, const std::array<double, 3>& voxel_size, int fraction, const oracle::distance_oracle& exact) {
    const vp::core::distance_scale scale =
        vp::core::make_distance_scale({voxel_size[0], voxel_size[1], voxel_size[2]}, fraction);
    const vp::core::seen_triangle seen = see_wide(p.triangle, p.sample);
    const vp::core::squared_distance found = vp::core::find_distance(seen, scale);
    const oracle::exact_square expected = exact.square(p.triangle, p.sample);
    ASSERT_TRUE(exact.is_nearest_float(expected, vp::core::distance_of(found.square)));
    ASSERT_TRUE(exact.is_close(found.square, expected, 48));

    const vp::core::triple<std::int64_t> most{{1 << 24, 1 << 24, 1 << 24}};
    if (vp::core::is_narrow(snapped(p.triangle[0]), snapped(p.triangle[1]), snapped(p.triangle[2]), most)) {
        const vp::core::squared_distance narrow = vp::core::find_distance(see_narrow(p.triangle, p.sample), scale);
        ASSERT_EQ(narrow.square, found.square);
        ASSERT_EQ(narrow.region, found.region);
    }
    std::array<std::size_t, 3> order{0, 1, 2};
    do {
        const lattice_triangle t{p.triangle[order[0]], p.triangle[order[1]], p.triangle[order[2]]};
        ASSERT_EQ(vp::core::find_distance(see_wide(t, p.sample), scale).square, found.square);
        lattice_triangle turned{};
        lattice_point sample{};
        for (std::size_t k = 0; k < 3; ++k) {
            sample[k] = p.sample[order[k]];
            for (std::size_t i = 0; i < 3; ++i) turned[i][k] = p.triangle[i][order[k]];
        }
        const vp::core::distance_scale other =
            vp::core::make_distance_scale({voxel_size[order[0]], voxel_size[order[1]], voxel_size[order[2]]}, fraction);
        ASSERT_EQ(vp::core::find_distance(see_wide(turned, sample), other).square, found.square);
    } while (std::next_permutation(order.begin(), order.end()));

    // The closest point lies where its weights say, and where its offset says.
    const vp::core::triple<double> w = vp::core::closest_weights(seen, scale, found.region);
    const vp::core::triple<double> to = vp::core::to_closest(seen, scale, found.region);
    double size = 0.0, length = 0.0;
    for (int k = 0; k < 3; ++k) {
        ASSERT_TRUE(w[k] >= 0.0 && w[k] <= 1.0);
        length = std::hypot(length, to[k]);
        for (int i = 0; i < 3; ++i) size = std::max(size, std::abs(seen.vertex[i][k]) * scale.length[k]);
    }
    ASSERT_NEAR(w[0] + w[1] + w[2], 1.0, 1e-15);
    ASSERT_NEAR(length, std::sqrt(found.square), 1e-14 * length);
    // A sliver's weights move it along itself only.
    double miss = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double at = w[0] * seen.vertex[0][k] + w[1] * seen.vertex[1][k] + w[2] * seen.vertex[2][k];
        miss = std::hypot(miss, at * scale.length[k] - to[k]);
    }
    ASSERT_LE(miss, 1e-9 * size + 1e-13 * length);
}

TEST(DistanceFormula, IsTheNearestFloatInTheGrid) {
    splitmix64 random(59);
    const std::array<double, 3> cubes{1.0, 1.0, 1.0}, odd{0.1, 0.1, 0.1}, flat{0.1, 0.37, 0.9},
        stretched{3.0, 0.01, 1.0};
    const std::int64_t n = unit::cases(250);
    for (const auto& voxel_size : {cubes, odd, flat, stretched}) {
        const oracle::distance_oracle exact(voxel_size, 14);
        for (int family = 0; family < num_families; ++family)
            for (std::int64_t i = 0; i < n; ++i) {
                const std::int64_t size = std::int64_t{1} << random.between(8, 24);
                SCOPED_TRACE(::testing::Message() << "family " << family << " pair " << i);
                check(make_pair(random, family, size), voxel_size, 14, exact);
                if (HasFatalFailure()) return;
            }
    }
}

TEST(DistanceFormula, HoldsForTrianglesFarLargerThanTheGrid) {
    splitmix64 random(60);
    const std::array<double, 3> cubes{0.3, 0.3, 0.3}, flat{0.1, 0.37, 0.9};
    const std::int64_t n = unit::cases(150);
    for (const auto& voxel_size : {cubes, flat}) {
        const oracle::distance_oracle exact(voxel_size, 14);
        for (int family = 0; family < num_families; ++family)
            for (std::int64_t i = 0; i < n; ++i) {
                const std::int64_t size = std::int64_t{1} << random.between(25, 41);
                pair p = make_pair(random, family, size);
                const std::int64_t half = size / 2;
                const auto centre = [&](lattice_point& q) {
                    for (std::int64_t& c : q) c -= half;
                };
                for (lattice_point& q : p.triangle) centre(q);
                centre(p.sample);
                SCOPED_TRACE(::testing::Message() << "family " << family << " pair " << i);
                check(p, voxel_size, 14, exact);
                if (HasFatalFailure()) return;
            }
    }
}

TEST(DistanceFormula, HoldsForVoxelSizesFromTwoToTheMinusHundredToTwoToTheHundred) {
    splitmix64 random(61);
    for (const double size : {0x1p-100, 0x1.8p-100, 0x1p100, 0x1.fp99}) {
        const std::array<double, 3> voxel_size{size, size, size};
        const oracle::distance_oracle exact(voxel_size, 16);
        const vp::core::distance_scale scale = vp::core::make_distance_scale(glm::dvec3(size), 16);
        for (int i = 0; i < 200; ++i) {
            const pair p = make_pair(random, i % num_families, std::int64_t{1} << 24);
            const double found = vp::core::find_distance(see_wide(p.triangle, p.sample), scale).square;
            ASSERT_TRUE(exact.is_close(found, exact.square(p.triangle, p.sample), 48));
        }
    }
}

} // namespace
} // namespace distances
