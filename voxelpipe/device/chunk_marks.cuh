// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Marks for the parts of a grid that triangles may touch, so that a last pass over a large target need not read all of
// it: 4 GiB against 0.2 GB for the chunks of the dragon in 1024^3. The raster marks the chunks of a small triangle's
// bounding box, and of what it draws of a large one; more than what is touched may be marked, never less.

#include <voxelpipe/device/direct_target.cuh>
#include <voxelpipe/device/small_raster.cuh>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// A chunk is a box of voxels: a few lines of memory in each row of a target.
inline constexpr int log2_chunk_x = 5, log2_chunk_yz = 3;
inline constexpr int chunk_x = 1 << log2_chunk_x, chunk_yz = 1 << log2_chunk_yz;

// A bit for each chunk, 32 along x to a word; each row of chunks along x begins a word.
struct chunk_marks {
    word* words = nullptr; // none: nothing is marked
    glm::ivec3 extent{};   // of the grid
    int per_row = 0, rows_y = 0;

    [[nodiscard]] static chunk_marks take(arena& memory, const glm::ivec3& extent) {
        chunk_marks m{nullptr, extent, (extent.x + 32 * chunk_x - 1) / (32 * chunk_x),
                      (extent.y + chunk_yz - 1) / chunk_yz};
        m.words = memory.take<word>(m.num_words());
        return m;
    }
    [[nodiscard]] std::size_t num_words() const {
        return static_cast<std::size_t>(per_row) * static_cast<unsigned>(rows_y) *
               static_cast<unsigned>((extent.z + chunk_yz - 1) / chunk_yz);
    }

    // Of a row of chunks, by their numbers along y and z.
    [[nodiscard]] __device__ VOXELPIPE_INLINE word* row(int y, int z) const {
        return words + (static_cast<std::size_t>(z) * static_cast<unsigned>(rows_y) + static_cast<unsigned>(y)) *
                           static_cast<unsigned>(per_row);
    }
    // The brick (core/brick_triangle.hpp) whose lowest voxel this is, by medium_lanes lanes.
    __device__ VOXELPIPE_INLINE void mark_brick(const std::int32_t (&corner)[3], unsigned lane) const {
        constexpr unsigned across = core::brick_size / chunk_yz;
        static_assert(core::brick_size % chunk_yz == 0 && chunk_x % core::brick_size == 0 &&
                      across * across <= static_cast<unsigned>(medium_lanes));
        const int y = corner[1] + static_cast<int>(lane % across) * chunk_yz,
                  z = corner[2] + static_cast<int>(lane / across) * chunk_yz;
        if (lane < across * across && y < extent.y && z < extent.z) mark_row(corner[0], corner[0], y, z);
    }
    // Voxels x0 to x1 of a row, at most 32, by any lane.
    __device__ VOXELPIPE_INLINE void mark_row(int x0, int x1, int y, int z) const {
        word* const at = row(y >> log2_chunk_yz, z >> log2_chunk_yz);
        for (int chunk = x0 >> log2_chunk_x; chunk <= x1 >> log2_chunk_x; ++chunk) {
            const word bit = 1u << chunk % 32;
            if ((__ldcg(at + chunk / 32) & bit) == 0) reduce_or(at + chunk / 32, bit);
        }
    }
};

// The chunks of each lane's bounding box where the lane wants that: a box of up to 32 voxels a side, not outside the
// grid. All lanes take part. Triangles next to each other mostly share a word, which then is written once, without a
// look, that all would wait for.
template <coverage Rule>
__device__ VOXELPIPE_INLINE void mark_boxes(const chunk_marks& marks, bool wanted, const near_triangle& r) {
    constexpr int beyond = Rule == coverage::thin ? 1 : 0; // a thin fragment may lie one voxel beyond the triangle
    int lo[3] = {}, hi[3] = {};
    if (wanted)
        for (int k = 0; k < 3; ++k) {
            const int end = (k == 0 ? marks.extent.x : k == 1 ? marks.extent.y : marks.extent.z) - 1;
            const int low = r.lo[k] - beyond, high = r.lo[k] + r.last[k] + beyond;
            const int shift = k == 0 ? log2_chunk_x : log2_chunk_yz;
            lo[k] = (low > 0 ? low : 0) >> shift;
            hi[k] = (high < end ? high : end) >> shift;
        }
    // Chunk by chunk of the box: two or three along x at most, which may lie in two words.
    const int nx = hi[0] - lo[0] + 1, ny = hi[1] - lo[1] + 1, nz = hi[2] - lo[2] + 1;
    const int first_word = lo[0] / 32, num_words = hi[0] / 32 - first_word + 1;
    const word low_bits = nx >= 32 ? ~0u : (1u << nx) - 1;
    const int num = wanted ? num_words * ny * nz : 0;
    for (int i = 0;; ++i) {
        unsigned left = __ballot_sync(0xffffffffu, i < num);
        if (left == 0) break;
        const int w = i % num_words, row = i / num_words, y = lo[1] + row % ny, z = lo[2] + row / ny;
        const word bits = w == 0 ? low_bits << lo[0] % 32 : low_bits >> (32 - lo[0] % 32);
        const auto at = reinterpret_cast<unsigned long long>(marks.row(y, z) + first_word + w);
        do {
            const int leader = __ffs(static_cast<int>(left)) - 1;
            const auto of_leader = __shfl_sync(0xffffffffu, at, leader);
            const bool same = i < num && at == of_leader;
            const word all = __reduce_or_sync(0xffffffffu, same ? bits : 0u);
            if (static_cast<int>(threadIdx.x % 32) == leader) reduce_or(reinterpret_cast<word*>(at), all);
            left &= ~__ballot_sync(0xffffffffu, same);
        } while (left != 0);
    }
}

// ---- going through chunks -------------------------------------------------------------------------------------------

// Places one above the other along y: up to chunk_yz.
template <class Place>
struct column_of_places {
    Place* first;
    std::size_t step; // places from one row to the next
    int rows;
};

// The chunks with marks of a target in rows along x. Each lane gets columns of places, 16 bytes or one element each,
// beside those of its neighbours.
template <class Place, class Element, class F>
__device__ VOXELPIPE_INLINE void for_each_marked(Element* elements, const chunk_marks& marks, F&& f) {
    constexpr int per_place = static_cast<int>(sizeof(Place) / sizeof(Element));
    const int lane = static_cast<int>(threadIdx.x) % 32;
    const unsigned warps = gridDim.x * (blockDim.x / 32);
    const std::size_t slices = static_cast<std::size_t>(marks.rows_y) * static_cast<unsigned>(marks.extent.z);
    for (std::size_t slice = blockIdx.x * (blockDim.x / 32) + threadIdx.x / 32; slice < slices; slice += warps) {
        const auto z = static_cast<int>(slice / static_cast<unsigned>(marks.rows_y)),
                   y = static_cast<int>(slice % static_cast<unsigned>(marks.rows_y)) * chunk_yz;
        const word* const row = marks.row(y >> log2_chunk_yz, z >> log2_chunk_yz);
        const int rows = marks.extent.y - y < chunk_yz ? marks.extent.y - y : chunk_yz;
        for (int w = 0; w < marks.per_row; ++w) {
            const word marked = row[w];
            if (marked == 0) continue;
            for (int x0 = 0; x0 < 32 * chunk_x; x0 += 32 * per_place) {
                const int inside = x0 + lane * per_place, x = w * 32 * chunk_x + inside;
                if ((marked >> (inside >> log2_chunk_x) & 1u) == 0 || x >= marks.extent.x) continue;
                const std::size_t first =
                    (static_cast<std::size_t>(z) * static_cast<unsigned>(marks.extent.y) + static_cast<unsigned>(y)) *
                        static_cast<unsigned>(marks.extent.x) +
                    static_cast<unsigned>(x);
                f(column_of_places<Place>{reinterpret_cast<Place*>(elements + first),
                                          static_cast<std::size_t>(marks.extent.x / per_place), rows});
            }
        }
    }
}

// Whether rows can go 16 bytes at a time.
template <class Element>
[[nodiscard]] __device__ VOXELPIPE_INLINE bool has_wide_rows(const Element* elements, const chunk_marks& marks) {
    return reinterpret_cast<std::uintptr_t>(elements) % 16 == 0 &&
           static_cast<unsigned>(marks.extent.x) * sizeof(Element) % 16 == 0;
}

} // namespace voxelpipe::device
