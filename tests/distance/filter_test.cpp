// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The distance in float by which GPUs reject triangles (distance/device/triangle_frame.cuh): its error stays within the
// bound that is proved there, for triangles of every shape. Each test reports the worst share of the bound that it saw.
// VOXELPIPE_TEST_SCALE above 1: as many times more triangles.

#include "../test_scale.hpp"
#include "distance_support.hpp"

#include <voxelpipe/distance/core/point_triangle.hpp>
#include <voxelpipe/distance/device/triangle_frame.cuh>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

namespace distances {
namespace {

namespace device = vp::device;
using position = vp::core::snapped_position;

struct lattice_case {
    int fraction;
    glm::dvec3 voxel; // units of the largest side
    device::frame_scale scale{};
    vp::core::distance_scale exact;

    lattice_case(int f, const glm::dvec3& size)
        : fraction(f), voxel(size), exact(vp::core::make_distance_scale(size, f)) {
        for (int k = 0; k < 3; ++k) {
            scale.exact[k] = std::ldexp(size[k], -f);
            scale.unit[k] = static_cast<float>(scale.exact[k]);
            scale.voxel[k] = static_cast<float>(size[k]);
        }
    }
    [[nodiscard]] double distance(const std::array<position, 3>& t, const position& p) const {
        return std::sqrt(vp::core::find_distance(vp::core::see_wide(t[0], t[1], t[2], p), exact).square);
    }
};

// Triangles with 24 bits a coordinate at most: of any shape, needles of a few units' width, and points and segments.
std::array<position, 3> random_triangle(splitmix64& random, int kind, int bits) {
    const auto number = [&](int b) {
        const auto half = std::int64_t{1} << b;
        return static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(2 * half))) - half;
    };
    const auto anywhere = [&](int b) { return position{number(b), number(b), number(b)}; };
    const auto beside = [&](const position& p, int b) {
        const position d = anywhere(b);
        return position{p.x + d.x, p.y + d.y, p.z + d.z};
    };
    const position a = anywhere(bits);
    switch (kind % 5) {
    case 0:
        return {a, anywhere(bits), anywhere(bits)};
    case 1: // a small one, far from the origin
        return {a, beside(a, 12), beside(a, 12)};
    case 2: { // a needle
        const position b = anywhere(bits);
        return {a, b, beside(b, 2)};
    }
    case 3: { // its third corner lies near the middle of an edge
        const position b = anywhere(bits);
        return {a, b, beside({(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2}, 2)};
    }
    default:
        return {a, a, random.below(2) == 0 ? a : anywhere(bits)};
    }
}

// Calls check(case, triangle, frame, integer point) for triangles and points near and far.
template <class Check>
void for_each_pair(int seed, const Check& check) {
    splitmix64 random(static_cast<std::uint64_t>(seed));
    const lattice_case cases[] = {{16, glm::dvec3(1.0)}, {10, glm::dvec3(1.0)}, {12, {1.0, 0.37, 0.011}}};
    const std::int64_t rounds = unit::cases(20000);
    for (std::int64_t i = 0; i < rounds; ++i) {
        const lattice_case& c = cases[i % 3];
        const int bits = 14 + static_cast<int>(random.below(10));
        const auto t = random_triangle(random, static_cast<int>(i / 3 % 5), bits);
        const device::triangle_frame f = device::make_triangle_frame(t[0], t[1], t[2], c.scale);
        for (int k = 0; k < 8; ++k) {
            const position& near = t[static_cast<std::size_t>(k) % 3];
            const auto half = std::int64_t{1} << (k < 4 ? 10 + k * 3 : bits);
            const auto at = [&](std::int64_t v) {
                return v + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(2 * half))) - half;
            };
            check(c, t, f, position{at(near.x), at(near.y), at(near.z)});
        }
    }
}

device::frame_point seen_from(const lattice_case& c, const device::triangle_frame& f, const position& p) {
    return device::to_frame(f, c.scale, static_cast<std::int32_t>(p.x), static_cast<std::int32_t>(p.y),
                            static_cast<std::int32_t>(p.z));
}

TEST(DistanceFilter, DistancesInFloatAreWithinTheBound) {
    double worst = 0.0;
    for_each_pair(71, [&](const lattice_case& c, const auto& t, const device::triangle_frame& f, const position& p) {
        const device::frame_point at = seen_from(c, f, p);
        const double error = std::abs(std::sqrt(double{device::measure(f, at)}) - c.distance(t, p));
        worst = std::max(worst, error / double{device::error_at(f, at, 0.0f)});
    });
    RecordProperty("worst_share_of_the_bound", std::to_string(worst));
    EXPECT_LT(worst, 1.0);
    EXPECT_GT(worst, 1.0 / 64) << "the bound would be far too wide";
}

// Samples are a centre and an offset of halves of voxels, which the bound's reach stands for.
TEST(DistanceFilter, OffsetsFromACentreAreWithinTheBound) {
    double worst = 0.0;
    for_each_pair(72, [&](const lattice_case& c, const auto& t, const device::triangle_frame& f, const position& p) {
        device::frame_point at = seen_from(c, f, p);
        const float reach = 2.0f * (c.scale.voxel[0] + c.scale.voxel[1] + c.scale.voxel[2]);
        for (int corner = 0; corner < 8; ++corner) {
            float o[3];
            std::int64_t units[3];
            for (int k = 0; k < 3; ++k) {
                const int halves = (corner >> k & 1) != 0 ? 3 : -3;
                o[k] = 0.5f * static_cast<float>(halves) * c.scale.voxel[k];
                units[k] = static_cast<std::int64_t>(halves) << (c.fraction - 1);
            }
            const device::frame_point moved{at.x + (f.x_axis[0] * o[0] + f.x_axis[1] * o[1] + f.x_axis[2] * o[2]),
                                            at.y + (f.y_axis[0] * o[0] + f.y_axis[1] * o[1] + f.y_axis[2] * o[2]),
                                            at.z + (f.z_axis[0] * o[0] + f.z_axis[1] * o[1] + f.z_axis[2] * o[2])};
            const double exact = c.distance(t, {p.x + units[0], p.y + units[1], p.z + units[2]});
            const double error = std::abs(std::sqrt(double{device::measure(f, moved)}) - exact);
            worst = std::max(worst, error / double{device::error_at(f, at, reach)});
        }
    });
    RecordProperty("worst_share_of_the_bound", std::to_string(worst));
    EXPECT_LT(worst, 1.0);
}

// A plane's height bounds the distance from below, in whatever direction it was made.
TEST(DistanceFilter, HeightsAboveAPlaneAreLowerBounds) {
    double worst = 0.0;
    for_each_pair(73, [&](const lattice_case& c, const auto& t, const device::triangle_frame& f, const position& p) {
        const device::frame_point at = seen_from(c, f, p), away = device::from_closest(f, at);
        const float length = std::sqrt(away.x * away.x + away.y * away.y + away.z * away.z);
        if (!(length > 0.0f)) return;
        const device::frame_plane plane = device::make_plane(f, c.scale, at, away, length);
        const double above = double{plane.height} - c.distance(t, p);
        worst = std::max(worst, above / double{device::error_at(f, at, 0.0f)});
    });
    RecordProperty("worst_share_of_the_bound", std::to_string(worst));
    EXPECT_LT(worst, 1.0);
}

} // namespace
} // namespace distances
