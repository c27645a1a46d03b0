// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Marks for the parts of a grid that triangles may touch, so that a last pass over a large target need not read all of
// it: 4 GiB, against 0.2 GB for the chunks of the dragon in 1024^3. The raster marks the chunks of a small triangle's
// bounding box, and those that it draws of a split one. Marks may cover more than what is touched, never less.

#include <voxelpipe/core/brick_triangle.hpp>
#include <voxelpipe/core/change_log.hpp>
#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/device/targets/global_target.cuh>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

using core::chunk_x, core::chunk_yz, core::log2_chunk_x, core::log2_chunk_yz;

// The words of the marks (core/change_log.hpp).
struct chunk_marks {
    word* words = nullptr; // null: nothing is marked
    glm::ivec3 extent{};   // of the grid
    core::chunk_rows rows;

    chunk_marks() = default;
    chunk_marks(word* words_, const glm::ivec3& extent_) : words(words_), extent(extent_), rows(extent_) {}
    [[nodiscard]] static chunk_marks take(arena& memory, const glm::ivec3& extent) {
        return {memory.take<word>(core::chunk_rows(extent).num_words()), extent};
    }

    // A row of chunks, by its chunk numbers along y and z.
    [[nodiscard]] __device__ VOXELPIPE_INLINE word* row(int y, int z) const {
        return words + (static_cast<std::size_t>(z) * static_cast<unsigned>(rows.y) + static_cast<unsigned>(y)) *
                           static_cast<unsigned>(rows.words);
    }
    // Marks the brick (core/brick_triangle.hpp) with this lowest voxel; group_lanes lanes call it.
    __device__ VOXELPIPE_INLINE void mark_brick(const std::int32_t (&corner)[3], unsigned lane) const {
        constexpr unsigned across = core::raster_brick_size / chunk_yz;
        static_assert(core::raster_brick_size % chunk_yz == 0 && chunk_x % core::raster_brick_size == 0 &&
                      across * across <= static_cast<unsigned>(tuning::group_lanes));
        const int y = corner[1] + static_cast<int>(lane % across) * chunk_yz,
                  z = corner[2] + static_cast<int>(lane / across) * chunk_yz;
        if (lane < across * across && y < extent.y && z < extent.z) mark_row(corner[0], corner[0], y, z);
    }
    // Marks voxels x0 to x1 of a row, at most 32. Any lanes call it.
    __device__ VOXELPIPE_INLINE void mark_row(int x0, int x1, int y, int z) const {
        word* const at = row(y >> log2_chunk_yz, z >> log2_chunk_yz);
        for (int chunk = x0 >> log2_chunk_x; chunk <= x1 >> log2_chunk_x; ++chunk) {
            const word bit = 1u << chunk % 32;
            if ((__ldcg(at + chunk / 32) & bit) == 0) reduce_or(at + chunk / 32, bit);
        }
    }
};

// ---- iteration over chunks
// -------------------------------------------------------------------------------------------

// Up to chunk_yz elements in consecutive rows along y.
template <class Unit>
struct unit_column {
    Unit* first;
    std::size_t step; // distance from one row to the next, in elements
    int rows;
};

// Calls f for the marked chunks of a target in rows along x. Each lane gets columns of 16 bytes or of one element, next
// to those of its neighbours.
template <class Unit, class Element, class F>
__device__ VOXELPIPE_INLINE void for_each_marked(Element* elements, const chunk_marks& marks, F&& f) {
    constexpr int per_unit = static_cast<int>(sizeof(Unit) / sizeof(Element));
    const int lane = static_cast<int>(threadIdx.x) % 32;
    const unsigned warps = gridDim.x * (blockDim.x / 32);
    const std::size_t slices = static_cast<std::size_t>(marks.rows.y) * static_cast<unsigned>(marks.extent.z);
    for (std::size_t slice = blockIdx.x * (blockDim.x / 32) + threadIdx.x / 32; slice < slices; slice += warps) {
        const auto z = static_cast<int>(slice / static_cast<unsigned>(marks.rows.y)),
                   y = static_cast<int>(slice % static_cast<unsigned>(marks.rows.y)) * chunk_yz;
        const word* const row = marks.row(y >> log2_chunk_yz, z >> log2_chunk_yz);
        const int rows = marks.extent.y - y < chunk_yz ? marks.extent.y - y : chunk_yz;
        for (int w = 0; w < marks.rows.words; ++w) {
            const word marked = row[w];
            if (marked == 0) continue;
            for (int x0 = 0; x0 < 32 * chunk_x; x0 += 32 * per_unit) {
                const int inside = x0 + lane * per_unit, x = w * 32 * chunk_x + inside;
                if ((marked >> (inside >> log2_chunk_x) & 1u) == 0 || x >= marks.extent.x) continue;
                const std::size_t first =
                    (static_cast<std::size_t>(z) * static_cast<unsigned>(marks.extent.y) + static_cast<unsigned>(y)) *
                        static_cast<unsigned>(marks.extent.x) +
                    static_cast<unsigned>(x);
                f(unit_column<Unit>{reinterpret_cast<Unit*>(elements + first),
                                    static_cast<std::size_t>(marks.extent.x / per_unit), rows});
            }
        }
    }
}

// True if rows can be accessed 16 bytes at a time.
template <class Element>
[[nodiscard]] __device__ VOXELPIPE_INLINE bool has_wide_rows(const Element* elements, const chunk_marks& marks) {
    return reinterpret_cast<std::uintptr_t>(elements) % 16 == 0 &&
           static_cast<unsigned>(marks.extent.x) * sizeof(Element) % 16 == 0;
}

} // namespace voxelpipe::device
