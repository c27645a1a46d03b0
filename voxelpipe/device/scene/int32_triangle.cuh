// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A triangle of a raster without tiles: vertices in 32 bits, and the bounding box (triangle_source.cuh loads it).

#include <voxelpipe/core/small_triangle.hpp>

#include <cstdint>

namespace voxelpipe::device {

// A triangle whose vertices are within 2^30 units of the first voxel, with its bounding box.
struct int32_triangle {
    std::int32_t q[3][3]; // [vertex][axis], in units of 2^-F voxel from the first voxel of the computed part
    std::int32_t lo[3];   // lowest voxel of the bounding box
    std::int32_t hi[3];   // highest voxel
    int last[3];          // highest voxel, counted from the lowest
    bool fits_int32;      // otherwise no other member is valid

    __device__ VOXELPIPE_INLINE void find_box(int fraction) {
        for (int k = 0; k < 3; ++k) {
            const std::int32_t low = core::min3(q[0][k], q[1][k], q[2][k]),
                               high = core::max3(q[0][k], q[1][k], q[2][k]);
            // ceil - 1: a face touches both sides. Unsigned, so that invalid positions do not overflow.
            lo[k] = static_cast<std::int32_t>(static_cast<std::uint32_t>(low) - 1u) >> fraction;
            hi[k] = high >> fraction;
            last[k] = hi[k] - lo[k];
        }
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int longest_side() const {
        return core::max3(last[0], last[1], last[2]) + 1;
    }
    // Negative if some of the box lies outside the grid. An int instead of a bool, which would take two more
    // instructions at each use.
    [[nodiscard]] __device__ VOXELPIPE_INLINE int inside(const glm::ivec3& extent) const {
        return lo[0] | lo[1] | lo[2] | (extent.x - 1 - hi[0]) | (extent.y - 1 - hi[1]) | (extent.z - 1 - hi[2]);
    }
    // True if no voxel of the grid can be covered. A thin fragment may lie one voxel beyond the triangle's own depths.
    template <coverage Rule>
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_outside(const glm::ivec3& extent) const {
        constexpr int beyond = Rule == coverage::thin ? 1 : 0;
        return lo[0] - beyond >= extent.x || lo[1] - beyond >= extent.y || lo[2] - beyond >= extent.z ||
               hi[0] + beyond < 0 || hi[1] + beyond < 0 || hi[2] + beyond < 0;
    }
    // The part of the box within the grid; along an axis without any, lo = 1 and hi = 0.
    [[nodiscard]] __device__ VOXELPIPE_INLINE core::small_box part(const glm::ivec3& extent) const {
        core::small_box box;
        for (int k = 0; k < 3; ++k) {
            const int end = (k == 0 ? extent.x : k == 1 ? extent.y : extent.z) - 1 - lo[k];
            box.lo[k] = lo[k] < 0 ? -lo[k] : 0;
            box.hi[k] = last[k] < end ? last[k] : end;
            if (box.lo[k] > box.hi[k]) {
                box.lo[k] = 1;
                box.hi[k] = 0;
            }
        }
        return box;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE core::small_triangle relative(int fraction) const {
        core::small_triangle t;
        for (int k = 0; k < 3; ++k)
            for (int v = 0; v < 3; ++v) t.p[v][k] = q[v][k] - (lo[k] << fraction);
        return t;
    }
};

} // namespace voxelpipe::device
