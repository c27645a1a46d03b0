// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior without its cover (solid_options::with_cover): of the touched voxels those are outside whose centre
// sees that of a neighbour that the flood reaches and no triangle touches.

#include <voxelpipe/solid/device/vote.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Takes the voxels that are seen from outside out of the mask, which is what the flood does not reach. segments: the
// crossed ones (row_use::segments). A thread changes bits of touched voxels in its own word, and reads those of others
// where they are not touched.
template <class Word>
__global__ __launch_bounds__(threads_per_block) void drop_seen_kernel(const Word* touched,
                                                                      const __grid_constant__ parity_masks segments,
                                                                      const __grid_constant__ bit_box box, Word* mask) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word own = touched[i] & mask[i];
        if (own == 0) return;
        const word_at_box at(box, i);
        const auto x = static_cast<int>(at.word_x) * 32;
        // What lies beyond the grid is reached, and nothing touches it.
        const auto open = [&](int dx, int dy, int dz) {
            return ~(box.bits_from(touched, x + dx, at.y + dy, at.z + dz) |
                     box.bits_from(mask, x + dx, at.y + dy, at.z + dz));
        };
        const std::uint64_t row = i / box.words_x();
        const int last = box.extent.x - 1 - x; // the bit of the row's last voxel, if it is below 32
        word behind = box.bits_from(segments.inside[0], x + 1, at.y, at.z);
        if (last < 32 && (segments.open[0][row / 32] >> row % 32 & 1u) != 0) behind |= 1u << last;
        word seen = (open(-1, 0, 0) & ~segments.inside[0][i]) | (open(1, 0, 0) & ~behind);
        behind = at.y + 1 < box.extent.y
                     ? segments.inside[1][i + box.words_x()]
                     : segments.open[1][static_cast<std::uint64_t>(at.z) * box.words_x() + at.word_x];
        seen |= (open(0, -1, 0) & ~segments.inside[1][i]) | (open(0, 1, 0) & ~behind);
        behind = at.z + 1 < box.extent.z
                     ? segments.inside[2][i + std::uint64_t{box.words_x()} * static_cast<std::uint32_t>(box.extent.y)]
                     : segments.open[2][static_cast<std::uint64_t>(at.y) * box.words_x() + at.word_x];
        seen |= (open(0, 0, -1) & ~segments.inside[2][i]) | (open(0, 0, 1) & ~behind);
        mask[i] &= ~(own & seen);
    });
}

struct side_memory {
    word* touched = nullptr; // the cover, once the mask is the inside
    vote_memory rows;

    [[nodiscard]] static side_memory take(arena& memory, const glm::ivec3& extent) {
        side_memory m;
        m.touched = memory.take<word>(bit_box{extent}.num_words());
        m.rows = vote_memory::take(memory, extent);
        return m;
    }
    // Before the flood.
    void keep_cover(const word* mask, cudaStream_t stream) const {
        check(cudaMemcpyAsync(touched, mask, rows.box.num_words() * sizeof(word), cudaMemcpyDeviceToDevice, stream),
              stage::fine_raster);
    }
};

// After the flood: drops what is seen from outside, by the triangles of a body.
template <int = 0>
void drop_seen(const side_memory& m, const stored_triangles& source, std::uint32_t first_triangle,
               std::uint32_t num_triangles, const row_grid& grid, word* mask, pipeline_state* state,
               cudaStream_t stream) {
    m.rows.masks.clear(m.rows.box, stream);
    toggle_rows(m.rows, source, first_triangle, num_triangles, grid, row_use::segments, state, stream);
    drop_seen_kernel<word><<<fill_device(m.rows.box.num_words(), 16), threads_per_block, 0, stream>>>(
        m.touched, m.rows.masks, m.rows.box, mask);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
