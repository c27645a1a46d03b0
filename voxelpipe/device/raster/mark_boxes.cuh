// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Marks the chunks that small triangles may touch, by their bounding boxes (targets/dirty_chunks.cuh).

#include <voxelpipe/device/scene/triangle_source.cuh>
#include <voxelpipe/device/targets/dirty_chunks.cuh>

namespace voxelpipe::device {

// Marks the chunks of each lane's bounding box, if `wanted`: at most 32 voxels a side, not outside the grid. All lanes
// call it. Triangles of a warp mostly lie within two chunks along each axis: then all of these are marked. Otherwise
// they mostly share words, each of which is written once. Nothing is read first: all lanes would wait for it.
template <coverage Rule>
__device__ VOXELPIPE_INLINE void mark_boxes(const chunk_marks& marks, bool wanted, const int32_triangle& r) {
    constexpr int beyond = Rule == coverage::thin ? 1 : 0; // a thin fragment may lie one voxel beyond the triangle
    if (!__any_sync(0xffffffffu, wanted)) return;
    int lo[3] = {}, hi[3] = {};
    if (wanted)
        for (int k = 0; k < 3; ++k) {
            const int end = (k == 0 ? marks.extent.x : k == 1 ? marks.extent.y : marks.extent.z) - 1;
            const int low = r.lo[k] - beyond, high = r.lo[k] + r.last[k] + beyond;
            const int shift = k == 0 ? log2_chunk_x : log2_chunk_yz;
            lo[k] = (low > 0 ? low : 0) >> shift;
            hi[k] = (high < end ? high : end) >> shift;
        }
    unsigned first[3], num_of_all[3];
    for (int k = 0; k < 3; ++k) {
        first[k] = __reduce_min_sync(0xffffffffu, wanted ? static_cast<unsigned>(lo[k]) : ~0u);
        num_of_all[k] = __reduce_max_sync(0xffffffffu, wanted ? static_cast<unsigned>(hi[k]) : 0u) - first[k] + 1;
    }
    if (num_of_all[0] <= 2 && num_of_all[1] <= 2 && num_of_all[2] <= 2 && first[0] % 32 + num_of_all[0] <= 32) {
        const unsigned lane = threadIdx.x % 32, y = lane % 2, z = lane / 2;
        if (y < num_of_all[1] && z < num_of_all[2])
            reduce_or(marks.row(static_cast<int>(first[1] + y), static_cast<int>(first[2] + z)) + first[0] / 32,
                      (num_of_all[0] == 2 ? 3u : 1u) << first[0] % 32);
        return;
    }
    // One word at a time. A box spans at most three chunks along x, which may lie in two words.
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

} // namespace voxelpipe::device
