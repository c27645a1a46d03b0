// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::vote: the parity of crossings along x, y and z at every voxel, and what most of the closed rows say.

#include <voxelpipe/solid/device/bit_sweeps.cuh>
#include <voxelpipe/solid/device/emit_crossings.cuh>
#include <voxelpipe/solid/solid.hpp>

#include <cstdint>

namespace voxelpipe::device {

// For each axis, bits of voxels, and of rows that are open: their number of crossings is odd.
struct parity_masks {
    word* inside[3];
    word* open[3]; // along x a bit for each row, by number; along y and z rows of words as those of the voxels

    [[nodiscard]] VOXELPIPE_HD static std::uint64_t num_open_words(const bit_box& box, int axis) {
        const auto ny = static_cast<std::uint64_t>(box.extent.y), nz = static_cast<std::uint64_t>(box.extent.z);
        return axis == 0 ? (ny * nz + 31) / 32 : box.words_x() * (axis == 1 ? nz : ny);
    }
    [[nodiscard]] static parity_masks take(arena& memory, const bit_box& box) {
        parity_masks m{};
        for (int axis = 0; axis < 3; ++axis) {
            m.inside[axis] = memory.take<word>(box.num_words());
            m.open[axis] = memory.take<word>(num_open_words(box, axis));
        }
        return m;
    }
    void clear(const bit_box& box, cudaStream_t stream) const {
        for (int axis = 0; axis < 3; ++axis) {
            check(cudaMemsetAsync(inside[axis], 0, box.num_words() * sizeof(word), stream), stage::fine_raster);
            check(cudaMemsetAsync(open[axis], 0, num_open_words(box, axis) * sizeof(word), stream), stage::fine_raster);
        }
    }
};

// Changes the bit of the first voxel behind each crossing along an axis, and that of its row. A warp takes a triangle,
// a lane every 32nd line of its rows. Along x triangles and crossings are counted. is_slab: the box is a slab along z,
// whose columns begin with the parity below it, and are known to be open or not (solid_options::slab).
template <int Axis, class State>
__global__ __launch_bounds__(threads_per_block,
                             2) void toggle_along_kernel(const __grid_constant__ stored_triangles source,
                                                         std::uint32_t first_triangle, std::uint32_t num_triangles,
                                                         const __grid_constant__ row_grid grid,
                                                         const __grid_constant__ bit_box box, bool is_slab,
                                                         word* inside, word* open, State* state) {
    using core::triangle_class;
    const std::uint32_t lane = threadIdx.x % 32;
    const core::voxel_box whole = grid.whole_box();
    unsigned long long crossings = 0, classes[num_triangle_classes] = {};
    const std::uint64_t warps = std::uint64_t{gridDim.x} * (threads_per_block / 32);
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * (threads_per_block / 32) + warp_in_block(); i < num_triangles;
         i += warps) {
        const auto at = source.locate(first_triangle + static_cast<std::uint32_t>(i));
        if (!at.index_ok) {
            if (lane == 0) atomicOr(&state->index_error, bad_index);
            continue;
        }
        const core::snapped_position p[3] = {source.exact(at, at.index.x), source.exact(at, at.index.y),
                                             source.exact(at, at.index.z)};
        const triangle_class kind = core::classify_for_rows(p[0], p[1], p[2], grid.fraction, whole, true);
        if (lane == 0) ++classes[static_cast<int>(kind)];
        if (kind != triangle_class::drawn) continue;
        if constexpr (Axis == 2) // crossings below the slab are in its parities
            if (is_slab && core::bounds(p[0], p[1], p[2], grid.fraction).hi[2] < 0) continue;
        const core::row_box rows = core::rows_within<Axis>(p[0], p[1], p[2], grid.fraction, whole);
        for (std::int64_t v = rows.v.lo + lane; v <= rows.v.hi; v += 32)
            core::for_each_crossing<Axis, core::centre_offset<>>(
                p[0], p[1], p[2], grid.fraction, {rows.u, {v, v}},
                [&](std::int64_t u, std::int64_t, std::int64_t first, int) {
                    ++crossings;
                    if (Axis == 2 && is_slab && first < 0) return;
                    const int n = Axis == 0 ? box.extent.x : Axis == 1 ? box.extent.y : box.extent.z;
                    const auto w = static_cast<int>(first < 0 ? 0 : first < n ? first : n);
                    const auto q = core::to_xyz(Axis, static_cast<int>(u), static_cast<int>(v), w);
                    if (w < n) atomicXor(inside + box.first_word(q[1], q[2]) + q[0] / 32, 1u << q[0] % 32);
                    if constexpr (Axis == 0) {
                        const std::uint64_t row = grid.row(q[1], q[2]);
                        atomicXor(open + row / 32, 1u << row % 32);
                    } else if (Axis == 1 || !is_slab) {
                        atomicXor(open + static_cast<std::uint64_t>(Axis == 1 ? q[2] : q[1]) * box.words_x() +
                                      q[0] / 32,
                                  1u << q[0] % 32);
                    }
                });
        __syncwarp();
    }
    if constexpr (Axis == 0) {
        const auto add = [](unsigned long long one, unsigned long long* total) {
            const unsigned long long sum = block_sum(one);
            if (threadIdx.x == 0 && sum != 0) atomicAdd(total, sum);
        };
        add(crossings, &state->solid.crossings);
        add(classes[static_cast<int>(triangle_class::drawn)], &state->drawn);
        add(classes[static_cast<int>(triangle_class::nonfinite)], &state->nonfinite);
        add(classes[static_cast<int>(triangle_class::too_far)], &state->too_far);
        add(classes[static_cast<int>(triangle_class::outside)], &state->outside);
    }
}

// Each bit becomes the parity of those up to it: along x, a thread a row, or along y or z.
template <class Word>
__global__ void accumulate_rows_kernel(Word* bits, const __grid_constant__ bit_box box) {
    const std::uint64_t rows = static_cast<std::uint64_t>(box.extent.y) * static_cast<std::uint64_t>(box.extent.z);
    const std::uint32_t n = box.words_x();
    for_each_number(rows, [&](std::uint64_t i) {
        word carry = 0;
        for (std::uint32_t k = 0; k < n; ++k) {
            word w = bits[i * n + k];
            for (int step = 1; step < 32; step *= 2) w ^= w << step;
            w ^= carry;
            carry = (w >> 31) != 0 ? ~0u : 0u;
            bits[i * n + k] = w & box.valid_bits(k);
        }
    });
}
template <class Word>
__global__ void accumulate_lines_kernel(Word* bits, const __grid_constant__ bit_box box, int axis) {
    const word_lines lines(box, axis);
    for_each_number(lines.count, [&](std::uint64_t l) {
        const std::uint64_t first = lines.first(l, box, axis);
        word parity = 0;
        for (int i = 0; i < lines.length; ++i) {
            word& w = bits[first + static_cast<std::uint64_t>(i) * lines.stride];
            w = parity ^= w;
        }
    });
}

// The mask's touched voxels are joined by those that more of the closed rows call inside than outside. Counts the open
// rows along x.
template <class State>
__global__ __launch_bounds__(threads_per_block) void count_votes_kernel(const __grid_constant__ parity_masks masks,
                                                                        const __grid_constant__ bit_box box, word* mask,
                                                                        State* state) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word_at_box at(box, i);
        const std::uint64_t row = i / box.words_x();
        const word open[3] = {(masks.open[0][row / 32] >> row % 32 & 1u) != 0 ? ~0u : 0u,
                              masks.open[1][static_cast<std::uint64_t>(at.z) * box.words_x() + at.word_x],
                              masks.open[2][static_cast<std::uint64_t>(at.y) * box.words_x() + at.word_x]};
        word yes[3], no = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const word inside = masks.inside[axis][i];
            yes[axis] = inside & ~open[axis];
            no |= ~inside & ~open[axis];
        }
        const word two = (yes[0] & yes[1]) | (yes[1] & yes[2]) | (yes[2] & yes[0]);
        const word alone = (yes[0] | yes[1] | yes[2]) & ~no;
        mask[i] |= (two | alone) & box.valid_bits(at.word_x);
    });
    unsigned long long num_open = 0;
    for_each_number(parity_masks::num_open_words(box, 0),
                    [&](std::uint64_t i) { num_open += static_cast<unsigned>(__popc(masks.open[0][i])); });
    const unsigned long long sum = block_sum(num_open);
    if (threadIdx.x == 0 && sum != 0) atomicAdd(&state->solid.open_rows, sum);
}

struct vote_memory {
    bit_box box{};
    parity_masks masks{};

    [[nodiscard]] static vote_memory take(arena& memory, const glm::ivec3& extent) {
        vote_memory m;
        m.box = {extent};
        m.masks = parity_masks::take(memory, m.box);
        return m;
    }
};

// Joins what the triangles of a body vote for to the mask of its cover. slab: null, or the bits of its columns.
template <int = 0>
void add_votes(const vote_memory& m, const stored_triangles& source, std::uint32_t first_triangle,
               std::uint32_t num_triangles, const row_grid& grid, const solid_slab* slab, word* mask,
               pipeline_state* state, cudaStream_t stream) {
    const bit_box& box = m.box;
    const parity_masks& masks = m.masks;
    masks.clear(box, stream);
    if (slab != nullptr) {
        copy_from_slab(masks.inside[2], slab->below, box, 1, stream);
        copy_from_slab(masks.open[2], slab->open, box, 1, stream);
    }
    const unsigned blocks = fill_device(std::uint64_t{num_triangles} * 32, 4);
    const auto toggle = [&]<int Axis>() {
        toggle_along_kernel<Axis, pipeline_state>
            <<<blocks, threads_per_block, 0, stream>>>(source, first_triangle, num_triangles, grid, box,
                                                       slab != nullptr, masks.inside[Axis], masks.open[Axis], state);
        check(cudaGetLastError(), stage::coarse_raster);
    };
    toggle.template operator()<0>();
    toggle.template operator()<1>();
    toggle.template operator()<2>();
    const unsigned for_words = fill_device(box.num_words(), 16);
    accumulate_rows_kernel<word><<<for_words, threads_per_block, 0, stream>>>(masks.inside[0], box);
    for (const int axis : {1, 2})
        accumulate_lines_kernel<word><<<for_words, threads_per_block, 0, stream>>>(masks.inside[axis], box, axis);
    count_votes_kernel<pipeline_state><<<for_words, threads_per_block, 0, stream>>>(masks, box, mask, state);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
