// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior without its cover (solid_options::with_cover): of the touched voxels those are outside whose centre
// sees that of a voxel, one or two away along an axis, that the flood reaches and no triangle touches.

#include <voxelpipe/solid/device/vote.cuh>

#include <cstdint>

namespace voxelpipe::device {

// The segments of parity_masks (row_use::segments) that end at the 32 voxels of a word, moved by some voxels along an
// axis: a bit for each that is crossed. Those beyond the first and the last of a row are not.
class crossed_segments {
public:
    __device__ VOXELPIPE_INLINE crossed_segments(const parity_masks& masks, const bit_box& box, std::uint64_t i)
        : masks_(masks), box_(box), at_(box, i), row_(i / box.words_x()) {}

    [[nodiscard]] __device__ VOXELPIPE_INLINE word along_x(int by) const {
        const int first = static_cast<int>(at_.word_x) * 32;
        word bits = box_.bits_from(masks_.inside[0], first + by, at_.y, at_.z);
        const int out = box_.extent.x - by - first; // the bit of the segment out of the grid
        if (out >= 0 && out < 32 && (masks_.open[0][row_ / 32] >> row_ % 32 & 1u) != 0) bits |= 1u << out;
        return bits;
    }
    // axis: 1 or 2.
    [[nodiscard]] __device__ VOXELPIPE_INLINE word along(int axis, int by) const {
        const int w = (axis == 1 ? at_.y : at_.z) + by, n = axis == 1 ? box_.extent.y : box_.extent.z;
        if (w < 0 || w > n) return 0;
        if (w == n)
            return masks_
                .open[axis][static_cast<std::uint64_t>(axis == 1 ? at_.z : at_.y) * box_.words_x() + at_.word_x];
        const std::uint64_t first = axis == 1 ? box_.first_word(w, at_.z) : box_.first_word(at_.y, w);
        return masks_.inside[axis][first + at_.word_x];
    }

private:
    const parity_masks& masks_;
    const bit_box& box_;
    word_at_box at_;
    std::uint64_t row_;
};

// Takes the voxels that are seen from outside out of the mask, which is what the flood does not reach. A thread changes
// bits of touched voxels in its own word, and reads those of others where they are not touched.
template <class Word>
__global__ __launch_bounds__(threads_per_block) void drop_seen_kernel(const Word* touched,
                                                                      const __grid_constant__ parity_masks masks,
                                                                      const __grid_constant__ bit_box box, Word* mask) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word own = touched[i] & mask[i];
        if (own == 0) return;
        const word_at_box at(box, i);
        const crossed_segments segments(masks, box, i);
        // What lies beyond the grid is reached, and nothing touches it.
        const auto open = [&](int axis, int by) {
            const int x = static_cast<int>(at.word_x) * 32 + (axis == 0 ? by : 0), y = at.y + (axis == 1 ? by : 0),
                      z = at.z + (axis == 2 ? by : 0);
            return ~(box.bits_from(touched, x, y, z) | box.bits_from(mask, x, y, z));
        };
        word seen = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const auto clear = [&](int by) { return ~(axis == 0 ? segments.along_x(by) : segments.along(axis, by)); };
            const word down = clear(0), up = clear(1);
            seen |= (open(axis, -1) & down) | (open(axis, 1) & up);
            seen |= (open(axis, -2) & down & clear(-1)) | (open(axis, 2) & up & clear(2));
        }
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
