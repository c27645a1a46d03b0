// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::vote: the parity of crossings along x, y and z at every voxel, and what most of the closed rows say.

#include <voxelpipe/device/base/block_scan.cuh>
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

// A triangle of a block, and its lines: those of the rows along one axis that have the same second coordinate v.
struct voting_triangle {
    core::snapped_position p[3];
    std::int32_t u_lo, u_hi, v_lo;
};
// The triangles of a block. Their lines are numbered through, and the threads take them in turn: most triangles have
// one or two, and a few of a room's walls have a thousand.
struct voting_triangles {
    block_scan<std::uint32_t, threads_per_block> scan;
    std::uint32_t first_line[threads_per_block];
    voting_triangle triangle[threads_per_block];

    // The triangle that has a line: the last one that begins at it or before. Triangles without lines begin where the
    // next one does.
    [[nodiscard]] __device__ VOXELPIPE_INLINE unsigned of_line(std::uint32_t line) const {
        unsigned t = 0;
        for (unsigned step = threads_per_block / 2; step > 0; step /= 2)
            if (first_line[t + step] <= line) t += step;
        return t;
    }
};

// What crossings do to the bits of parity_masks.
enum class row_use : std::uint8_t {
    parities,      // change the bit of the first voxel behind them, and that of their row
    slab_parities, // the same in a slab along z, whose columns begin with the parity below it, and are known to be open
                   // or not (solid_options::slab)
    segments,      // set the bit of the first voxel behind them if they lie between the centres of neighbours: `inside`
                   // for the segment from the voxel below, `open` for the one from the last voxel out of the grid
};

// Goes through the crossings along an axis. A block takes as many triangles as it has threads, and divides their lines;
// `shares` blocks take the same triangles. Along x triangles and crossings are counted, but for segments.
template <int Axis, class State>
__global__ __launch_bounds__(threads_per_block,
                             2) void toggle_along_kernel(const __grid_constant__ stored_triangles source,
                                                         std::uint32_t first_triangle, std::uint32_t num_triangles,
                                                         unsigned shares, const __grid_constant__ row_grid grid,
                                                         const __grid_constant__ bit_box box, row_use use, word* inside,
                                                         word* open, State* state) {
    using core::triangle_class;
    __shared__ voting_triangles all;
    const core::voxel_box whole = grid.whole_box();
    constexpr unsigned neighbours = 8; // triangles of a block that follow each other in the mesh
    const unsigned share = blockIdx.x % shares;
    const bool is_slab = use == row_use::slab_parities;
    row_totals totals;
    // The number of the thread's triangle's lines; 0 where it has none to take.
    const auto lines_of = [&](std::uint32_t i) -> std::uint32_t {
        const auto at = source.locate(first_triangle + i);
        if (!at.index_ok) {
            atomicOr(&state->index_error, bad_index);
            return 0;
        }
        const core::snapped_position p[3] = {source.exact(at, at.index.x), source.exact(at, at.index.y),
                                             source.exact(at, at.index.z)};
        const triangle_class kind = core::classify_for_rows(p[0], p[1], p[2], grid.fraction, whole, true);
        if (share == 0) totals.see(kind);
        if (kind != triangle_class::drawn) return 0;
        if constexpr (Axis == 2) // crossings below the slab are in its parities
            if (is_slab && core::bounds(p[0], p[1], p[2], grid.fraction).hi[2] < 0) return 0;
        const core::row_box rows = core::rows_within<Axis>(p[0], p[1], p[2], grid.fraction, whole);
        if (rows.empty()) return 0;
        all.triangle[threadIdx.x] = {{p[0], p[1], p[2]},
                                     static_cast<std::int32_t>(rows.u.lo),
                                     static_cast<std::int32_t>(rows.u.hi),
                                     static_cast<std::int32_t>(rows.v.lo)};
        return static_cast<std::uint32_t>(rows.v.hi - rows.v.lo + 1);
    };
    const std::uint64_t batches = (std::uint64_t{num_triangles} + threads_per_block - 1) / threads_per_block;
    for (std::uint64_t batch = blockIdx.x / shares; batch < batches; batch += gridDim.x / shares) {
        // Neighbours in the mesh are alike: large ones lie in many blocks.
        const std::uint64_t i = (threadIdx.x / neighbours * batches + batch) * neighbours + threadIdx.x % neighbours;
        const std::uint32_t mine = i < num_triangles ? lines_of(static_cast<std::uint32_t>(i)) : 0;
        all.first_line[threadIdx.x] = all.scan.sum_before(mine);
        const std::uint32_t lines = all.scan.sum();
        __syncthreads();
        for (std::uint32_t line = share * threads_per_block + threadIdx.x; line < lines;
             line += shares * threads_per_block) {
            const unsigned k = all.of_line(line);
            const voting_triangle& t = all.triangle[k];
            const std::int64_t v = t.v_lo + static_cast<std::int64_t>(line - all.first_line[k]);
            core::for_each_crossing<Axis, core::centre_offset<>>(
                t.p[0], t.p[1], t.p[2], grid.fraction, {{t.u_lo, t.u_hi}, {v, v}},
                [&](std::int64_t u, std::int64_t, std::int64_t behind, int) {
                    ++totals.crossings;
                    if (Axis == 2 && is_slab && behind < 0) return;
                    const int n = Axis == 0 ? box.extent.x : Axis == 1 ? box.extent.y : box.extent.z;
                    const auto w = static_cast<int>(behind < 0 ? 0 : behind < n ? behind : n);
                    const auto q = core::to_xyz(Axis, static_cast<int>(u), static_cast<int>(v), w);
                    word* const voxel = inside + box.first_word(q[1], q[2]) + q[0] / 32;
                    const std::uint64_t row = grid.row(q[1], q[2]);
                    word* const of_row =
                        Axis == 0
                            ? open + row / 32
                            : open + static_cast<std::uint64_t>(Axis == 1 ? q[2] : q[1]) * box.words_x() + q[0] / 32;
                    const word voxel_bit = 1u << q[0] % 32, row_bit = Axis == 0 ? 1u << row % 32 : voxel_bit;
                    if (use == row_use::segments) {
                        if (behind < 0 || behind > n) return;
                        atomicOr(w < n ? voxel : of_row, w < n ? voxel_bit : row_bit);
                        return;
                    }
                    if (w < n) atomicXor(voxel, voxel_bit);
                    if (Axis != 2 || !is_slab) atomicXor(of_row, row_bit);
                });
        }
        __syncthreads();
    }
    if constexpr (Axis == 0)
        if (use != row_use::segments) totals.add_up(true, state);
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

// Goes through the crossings of a body's triangles along all three axes.
template <int = 0>
void toggle_rows(const vote_memory& m, const stored_triangles& source, std::uint32_t first_triangle,
                 std::uint32_t num_triangles, const row_grid& grid, row_use use, pipeline_state* state,
                 cudaStream_t stream) {
    constexpr unsigned per_multiprocessor = 4;
    const unsigned batches = fill_device(num_triangles, per_multiprocessor),
                   most = fill_device(~0u, per_multiprocessor), shares = most / batches > 1 ? most / batches : 1;
    const auto toggle = [&]<int Axis>() {
        toggle_along_kernel<Axis, pipeline_state><<<batches * shares, threads_per_block, 0, stream>>>(
            source, first_triangle, num_triangles, shares, grid, m.box, use, m.masks.inside[Axis], m.masks.open[Axis],
            state);
        check(cudaGetLastError(), stage::coarse_raster);
    };
    toggle.template operator()<0>();
    toggle.template operator()<1>();
    toggle.template operator()<2>();
}

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
    toggle_rows(m, source, first_triangle, num_triangles, grid,
                slab != nullptr ? row_use::slab_parities : row_use::parities, state, stream);
    const unsigned for_words = fill_device(box.num_words(), 16);
    accumulate_rows_kernel<word><<<for_words, threads_per_block, 0, stream>>>(masks.inside[0], box);
    for (const int axis : {1, 2})
        accumulate_lines_kernel<word><<<for_words, threads_per_block, 0, stream>>>(masks.inside[axis], box, axis);
    count_votes_kernel<pipeline_state><<<for_words, threads_per_block, 0, stream>>>(masks, box, mask, state);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
