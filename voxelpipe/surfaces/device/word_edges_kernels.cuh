// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Crossed edges of words of cells (passes/words.hpp), on a GPU: a thread an edge for what finds or shades crossings,
// and vertices from the crossings of their sheets. The results are those of passes::edges_of_cell and place_vertices.

#include <voxelpipe/surfaces/device/word_mesh_kernels.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Calls use(number, axis, low, goes_out) as passes::edges_of_cell. Lanes have edges along the same axis unless all are
// wanted.
template <int Axis, class Use>
__global__ __launch_bounds__(words_per_block) void for_word_edges_kernel(const __grid_constant__ surface_words all,
                                                                         const __grid_constant__ Use use) {
    await_stream();
    using namespace core::passes;
    __shared__ word_item items[word_items];
    __shared__ block_scan<std::uint32_t, words_per_block> scan;
    const std::uint64_t n = *all.num_words, begin = std::uint64_t{blockIdx.x} * words_per_block,
                        i = begin + threadIdx.x;
    if (begin >= n) return;
    word_edges own = i < n ? all.edges[i] : word_edges{};
    if (Axis != all_axes) {
        if (Axis != 0) own.x = 0;
        if (Axis != 1) own.y = 0;
        if (Axis != 2) own.z = 0;
    }
    const std::uint32_t first = scan.sum_before(own.count()), total = scan.sum();
    const auto list = [&](const auto& add) {
        for (std::uint32_t left = own.x | own.y | own.z; left != 0; left &= left - 1) {
            const int bit = exact::lowest_one(left);
            if ((own.x >> bit & 1) != 0) add(word_item::of(threadIdx.x, bit, 0));
            if ((own.y >> bit & 1) != 0) add(word_item::of(threadIdx.x, bit, 1));
            if ((own.z >> bit & 1) != 0) add(word_item::of(threadIdx.x, bit, 2));
        }
    };
    for_word_items(items, first, total, list, [&](std::uint32_t, word_item item, bool is_one) {
        if (!is_one) return;
        const int axis = Axis == all_axes ? item.which() : Axis;
        const std::uint64_t i_word = begin + item.word();
        const surface_word word = all.words[i_word];
        const cell_key at{all.keys[i_word]};
        const glm::ivec3 low(at.x() + item.bit() - 1, at.y() - 1, at.z() - 1);
        const bool goes_out = (all.states[word.cell(item.bit())] & 1) != 0;
        use(word.first_edge + all.edges[i_word].before(item.bit(), axis), axis, low, goes_out);
    });
}

// ---- vertices -------------------------------------------------------------------------------------------------------

// Finds the words after word i along x (1), y (2) and z (4), as far as the grid goes. What has no cell is not
// meaningful. Of a row's words that have a cell, the one after another is the number after it.
__device__ VOXELPIPE_INLINE void find_words_after(const surface_words& all, std::uint64_t i, words_around& found) {
    const core::passes::cell_key at{all.keys[i]};
    const core::passes::sample_bits& samples = all.where.cells.samples;
    const int w = at.x() >> 5, y = at.y(), z = at.z();
#pragma unroll
    for (int k = 0; k < 8; k += 2) {
        const int dy = k >> 1 & 1, dz = k >> 2;
        core::passes::word_groups::place word{static_cast<std::uint32_t>(i), true};
        if (k != 0)
            word = y + dy <= samples.ny && z + dz <= samples.nz ? all.where.look(w, y + dy, z + dz)
                                                                : core::passes::word_groups::place{};
        found[k][threadIdx.x] = word.number;
        found[k + 1][threadIdx.x] = word.number + (word.exists ? 1 : 0);
    }
}

// The edges of a sheet.
struct sheet_edges {
    const surface_words& all;
    const words_around& after;
    unsigned word; // in the block
    int bit;
    std::uint32_t edges; // a bit an edge of the cell

    __device__ sheet_edges(const surface_words& words, const words_around& found, word_item item,
                           const core::cell_sheets& sheets)
        : all(words), after(found), word(item.word()), bit(item.bit()), edges(0) {
#pragma unroll
        for (int e = 0; e < 12; ++e) edges |= (sheets.of_edge(e) == item.which() ? 1u : 0u) << e;
    }
    // Calls f(edge of the cell, number of the crossed edge), in the order of the edges.
    template <class F>
    __device__ VOXELPIPE_INLINE void each(const F& f) const {
        for (std::uint32_t left = edges; left != 0; left &= left - 1) {
            const int e = exact::lowest_one(left), corner = core::edge_corner(e);
            const bool is_after = (corner & 1) != 0 && bit == 31;
            const std::uint32_t i = after[(is_after ? 1 : 0) | (corner & 6)][word];
            const int in_word = (bit + (corner & 1)) & 31;
            f(e, all.words[i].first_edge + all.edges[i].before(in_word, e >> 2));
        }
    }
};

// What place_crossed_kernel writes.
struct crossed_vertices {
    voxelpipe::place where;
    const core::edge_crossing* crossings;
    const std::uint32_t* primitives; // of the triangles of crossings; null: sources are not wanted
    surface_vertex* vertices;
    std::uint32_t* sources;
};

// The vertices of words by the crossings of their sheets. Sheets whose planes meet outside of their cell take far
// longer: they are listed, and threads next to each other take those.
template <int = 0>
__global__ __launch_bounds__(words_per_block) void place_crossed_kernel(const __grid_constant__ surface_words all,
                                                                        const __grid_constant__ crossed_vertices out) {
    await_stream();
    using namespace core::passes;
    constexpr std::uint32_t size = sizeof(surface_vertex) / sizeof(std::uint32_t);
    __shared__ word_item items[word_items];
    __shared__ words_around after;
    __shared__ std::uint32_t staged[words_per_block * size];
    __shared__ std::uint16_t beyond[words_per_block]; // threads whose point lies outside
    __shared__ word_item item_of[words_per_block];
    __shared__ std::uint32_t num_beyond;
    const std::uint64_t n = *all.num_words, begin = std::uint64_t{blockIdx.x} * words_per_block,
                        i = begin + threadIdx.x, end = begin + words_per_block < n ? begin + words_per_block : n;
    if (begin >= n) return;
    const std::uint32_t first = all.words[begin].first_vertex, total = all.words[end].first_vertex - first;
    const surface_word own = i < n ? all.words[i] : surface_word{};
    if (i < n) find_words_after(all, i, after);
    const auto list = [&](const auto& add) {
        for (std::uint32_t left = own.active; left != 0; left &= left - 1) {
            const int bit = exact::lowest_one(left), sheets = own.num_sheets(bit);
            for (int s = 0; s < sheets; ++s) add(word_item::of(threadIdx.x, bit, s));
        }
    };
    const auto edges_of = [&](word_item item) {
        const std::uint32_t cell = all.words[begin + item.word()].cell(item.bit());
        return sheet_edges(all, after, item, all.table[all.states[cell]]);
    };
    const auto planes_of = [&](const sheet_edges& edges, const core::sheet_mean& mean) {
        core::sheet_planes planes(mean);
        edges.each([&](int e, std::uint64_t number) {
            const core::edge_crossing c = out.crossings[number];
            planes.add(core::point_on_edge(e >> 2, core::edge_corner(e), c.t), c.nx, c.ny, c.nz);
        });
        return planes;
    };
    const auto stage_place = [&](std::uint32_t thread, word_item item, const core::cell_place& q) {
        std::uint32_t* const to = staged + size * thread;
        to[3] = q.q[0] | static_cast<std::uint32_t>(q.q[1]) << 16;
        to[4] = q.q[2] | static_cast<std::uint32_t>(item.which()) << 16;
    };
    for_word_items(items, own.first_vertex - first, total, list, [&](std::uint32_t k, word_item item, bool is_one) {
        if (threadIdx.x == 0) num_beyond = 0;
        __syncthreads();
        if (is_one) {
            const sheet_edges edges = edges_of(item);
            core::sheet_mean mean;
            std::uint32_t source = ~std::uint32_t{0};
            edges.each([&](int e, std::uint64_t number) {
                const core::edge_crossing& c = out.crossings[number];
                mean.add(core::point_on_edge(e >> 2, core::edge_corner(e), c.t));
                if (out.primitives == nullptr || c.triangle == core::edge_crossing::no_triangle) return;
                const std::uint32_t primitive = out.primitives[c.triangle];
                source = primitive < source ? primitive : source;
            });
            const cell_key at{all.keys[begin + item.word()]};
            std::uint32_t* const to = staged + size * threadIdx.x;
            to[0] = static_cast<std::uint32_t>(at.x() + item.bit() - 1);
            to[1] = static_cast<std::uint32_t>(at.y() - 1);
            to[2] = static_cast<std::uint32_t>(at.z() - 1);
            if (out.primitives != nullptr) out.sources[first + k + threadIdx.x] = source;
            if (out.where == voxelpipe::place::corner) {
                stage_place(threadIdx.x, item, {{{32768, 32768, 32768}}});
            } else if (out.where == voxelpipe::place::mean) {
                stage_place(threadIdx.x, item, mean.place());
            } else {
                const core::sheet_planes planes = planes_of(edges, mean);
                const core::triple<double> y = planes.least();
                if (planes.has(y)) {
                    stage_place(threadIdx.x, item, planes.place(y));
                } else {
                    item_of[threadIdx.x] = item;
                    beyond[atomicAdd(&num_beyond, 1u)] = static_cast<std::uint16_t>(threadIdx.x);
                }
            }
        }
        __syncthreads();
        if (threadIdx.x < num_beyond) {
            const std::uint32_t thread = beyond[threadIdx.x];
            const word_item other = item_of[thread];
            const sheet_edges edges = edges_of(other);
            core::sheet_mean mean;
            edges.each([&](int e, std::uint64_t number) {
                mean.add(core::point_on_edge(e >> 2, core::edge_corner(e), out.crossings[number].t));
            });
            const core::sheet_planes planes = planes_of(edges, mean);
            stage_place(thread, other, planes.place(planes.least_on_border()));
        }
        const std::uint32_t count = total - k < words_per_block ? total - k : words_per_block;
        copy_staged(reinterpret_cast<std::uint32_t*>(out.vertices + first + k), staged, size * count);
    });
}

// ---- launches -------------------------------------------------------------------------------------------------------

template <int Axis, class Use>
void for_word_edges(const surface_words& all, std::uint32_t blocks, const Use& use, cudaStream_t stream) {
    launch_behind(for_word_edges_kernel<Axis, Use>, blocks, words_per_block, stream, stage::vertex_shade, all, use);
}
template <int = 0>
void place_crossed(const surface_words& all, std::uint32_t blocks, const crossed_vertices& out, cudaStream_t stream) {
    launch_behind(place_crossed_kernel<>, blocks, words_per_block, stream, stage::vertex_shade, all, out);
}

} // namespace voxelpipe::device
