// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the kernels of a distance call read: the triangles, exact and in frames of their own, the samples' grid and the
// band.

#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/distance/device/triangle_frame.cuh>
#include <voxelpipe/distance/distance.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace voxelpipe::device {

inline constexpr int distance_brick = 8; // samples of a brick's side
inline constexpr std::uint32_t brick_samples = 512;
inline constexpr int octant_side = 4;
inline constexpr unsigned octant_samples = 64;
inline constexpr std::uint32_t no_primitive = ~0u; // of a sample beyond the band
inline constexpr std::uint32_t no_slot = ~0u;      // of a brick that no triangle is near

// Snapped positions. A narrow triangle has them in 32 bits, and the formula's narrow form for all samples of the call.
struct alignas(16) kept_triangle {
    std::int32_t vertex[3][3];
    std::uint32_t is_narrow;
    std::uint32_t unused[2];
};
static_assert(sizeof(kept_triangle) == 48);

struct distance_input {
    geometry geo;
    core::distance_scale scale; // world units
    frame_scale units;
    core::triple<std::int64_t> most;   // see core::is_narrow
    glm::ivec3 extent, bricks;         // samples, and bricks an axis
    core::voxel_box reach;             // the voxels of triangles that are drawn
    glm::ivec3 halo;                   // layers of samples around a triangle's voxels that the band may reach
    float band;                        // world units; infinity: the whole field
    float band_units;                  // not less, in units of the largest voxel
    float brick_radius, octant_radius; // of the balls that hold the samples of a brick and of its eighth
    kept_triangle* triangles;          // by primitive
    triangle_frame* frames;            // by primitive
    std::uint32_t num_counted;         // triangles of the draws; those behind them close holes

    [[nodiscard]] VOXELPIPE_HD std::uint32_t num_bricks() const {
        return static_cast<std::uint32_t>(bricks.x) * static_cast<std::uint32_t>(bricks.y) *
               static_cast<std::uint32_t>(bricks.z);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t brick_number(int x, int y, int z) const {
        return (static_cast<std::uint32_t>(z) * static_cast<std::uint32_t>(bricks.y) + static_cast<std::uint32_t>(y)) *
                   static_cast<std::uint32_t>(bricks.x) +
               static_cast<std::uint32_t>(x);
    }
    // The lowest sample of a brick.
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 first_sample(std::uint32_t brick) const {
        const voxel_position p = position_of(brick, bricks);
        return {p.x * distance_brick, p.y * distance_brick, p.z * distance_brick};
    }
    // Snapped coordinate of a sample.
    [[nodiscard]] VOXELPIPE_HD std::int64_t at(int i) const {
        return (2 * std::int64_t{i} + 1) << (geo.snap.fraction - 1);
    }
    [[nodiscard]] VOXELPIPE_HD core::snapped_position position(const glm::ivec3& s) const {
        return {at(s.x), at(s.y), at(s.z)};
    }
};

// The triangle as seen from a snapped position, exactly. The narrow form is for samples only.
[[nodiscard]] __device__ inline core::seen_triangle see_exactly(const distance_input& in, std::uint32_t primitive,
                                                                const core::snapped_position& p, bool is_sample) {
    const kept_triangle& t = in.triangles[primitive];
    if (is_sample && t.is_narrow != 0) {
        const auto vertex = [&](int i) VOXELPIPE_INLINE_LAMBDA {
            return core::snapped_position{t.vertex[i][0], t.vertex[i][1], t.vertex[i][2]};
        };
        return core::see(core::make_narrow(vertex(0), vertex(1), vertex(2)), static_cast<double>(p.x),
                         static_cast<double>(p.y), static_cast<double>(p.z));
    }
    const loaded_triangle wide = in.geo.load(primitive);
    return core::see_wide(wide.a, wide.b, wide.c, p);
}
// Out of line, so that the loops around it keep their registers.
[[nodiscard]] __device__ __noinline__ inline double find_square(const distance_input& in, std::uint32_t primitive,
                                                                const core::snapped_position& p, bool is_sample) {
    return core::find_distance(see_exactly(in, primitive, p, is_sample), in.scale).square;
}

// Fills all but the geometry and the arrays.
[[nodiscard]] inline distance_input make_distance_input(const grid& samples, const distance_options& options) {
    distance_input in{};
    const int fraction = core::make_snap_transform(samples).fraction;
    const glm::dvec3 size = samples.voxel_size;
    const double largest = std::max({size.x, size.y, size.z});
    in.scale = core::make_distance_scale(size, fraction);
    double diagonal = 0.0;
    const glm::ivec3 halo = core::band_halo(options.band, samples);
    for (int i = 0; i < 3; ++i) {
        const double voxel = size[i] / largest;
        in.units.exact[i] = std::ldexp(voxel, -fraction);
        in.units.unit[i] = static_cast<float>(in.units.exact[i]);
        in.units.voxel[i] = static_cast<float>(voxel);
        diagonal += voxel * voxel;
        in.most[i] = std::int64_t{samples.extent[i]} << fraction;
        in.bricks[i] = (samples.extent[i] + distance_brick - 1) / distance_brick;
        // Positions reach 2^40 units at most, so this is everything.
        const std::int64_t layers = options.band.is_whole ? std::int64_t{1} << 42 : halo[i];
        in.reach.lo[i] = -layers;
        in.reach.hi[i] = samples.extent[i] - 1 + layers;
    }
    diagonal = std::sqrt(diagonal);
    in.extent = samples.extent;
    in.halo = halo;
    in.brick_radius = static_cast<float>(3.5 * diagonal) * (1.0f + 0x1p-20f);
    in.octant_radius = static_cast<float>(1.5 * diagonal) * (1.0f + 0x1p-20f);
    in.band = core::band_distance(options.band, samples);
    in.band_units = static_cast<float>(static_cast<double>(in.band) / largest) * (1.0f + 0x1p-20f);
    return in;
}

} // namespace voxelpipe::device
