// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Vertices and faces of a surface from words of cells (passes/words.hpp), on a GPU. A block has 256 words;
// it lists what they have in shared memory and gives each thread one item, so that neighbouring threads write
// neighbouring items. The results are those of passes::place_vertices, list_quads and cut_quads.

#include <voxelpipe/surfaces/device/word_kernels.cuh>
#include <voxelpipe/surfaces/passes/vertices.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>

namespace voxelpipe::device {

// The words of a surface, numbered.
struct surface_words {
    core::passes::word_groups where;
    const core::cell_sheets* table;
    const std::uint64_t* num_words;
    const std::uint64_t* keys; // of the words' first cells
    const core::passes::surface_word* words;
    const core::passes::word_edges* edges;
    const core::passes::word_faces* faces;
    const std::uint16_t* states; // of cells

    // The sheet of an edge of a cell of word i.
    [[nodiscard]] __device__ std::uint32_t sheet(const core::passes::surface_word& word, int bit, int edge) const {
        return static_cast<std::uint32_t>(table[states[word.cell(bit)]].of_edge(edge));
    }
};

// Copies what the block's threads have left in shared memory, `count` numbers, so that neighbouring threads write
// neighbouring ones. All threads call it.
__device__ VOXELPIPE_INLINE void copy_staged(std::uint32_t* to, const std::uint32_t* staged, std::uint32_t count) {
    __syncthreads();
    for (std::uint32_t k = threadIdx.x; k < count; k += words_per_block) to[k] = staged[k];
    __syncthreads();
}

// ---- cells ----------------------------------------------------------------------------------------------------------

// The arrays of passes::indexed_cells, in which passes that know no words find the cells. first_vertices and
// first_edges have one number more.
template <int = 0>
__global__ __launch_bounds__(words_per_block) void list_cells_kernel(const __grid_constant__ surface_words all,
                                                                     std::uint64_t* keys, std::uint64_t* first_vertices,
                                                                     std::uint64_t* first_edges) {
    await_stream();
    using namespace core::passes;
    __shared__ word_item items[word_items];
    const std::uint64_t n = *all.num_words, begin = std::uint64_t{blockIdx.x} * words_per_block,
                        i = begin + threadIdx.x, end = begin + words_per_block < n ? begin + words_per_block : n;
    if (i + 1 == n || n == 0) { // the same numbers where n is 0
        first_vertices[all.words[n].first_cell] = all.words[n].first_vertex;
        first_edges[all.words[n].first_cell] = all.words[n].first_edge;
    }
    if (begin >= n) return;
    const std::uint32_t first = all.words[begin].first_cell, total = all.words[end].first_cell - first;
    const surface_word own = i < n ? all.words[i] : surface_word{};
    const auto list = [&](const auto& add) {
        for (std::uint32_t left = own.active; left != 0; left &= left - 1)
            add(word_item::of(threadIdx.x, exact::lowest_one(left), 0));
    };
    for_word_items(items, own.first_cell - first, total, list, [&](std::uint32_t k, word_item item, bool is_one) {
        if (!is_one) return;
        const std::uint64_t word = begin + item.word(), cell = std::uint64_t{first} + k + threadIdx.x;
        const surface_word w = all.words[word];
        keys[cell] = all.keys[word] + static_cast<std::uint64_t>(item.bit());
        first_vertices[cell] = w.vertex(item.bit());
        first_edges[cell] = w.first_edge + all.edges[word].before(item.bit(), 0);
    });
}

// ---- vertices -------------------------------------------------------------------------------------------------------

// The place of a sheet's vertex where all crossings lie in the middle of their edges: number 4 state + sheet.
struct place_states {
    const core::cell_sheets* table;
    voxelpipe::place where;
    core::cell_place* places;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        using placing = core::passes::place_vertices<core::passes::cell_list>;
        const core::cell_sheets sheets = table[i >> 2];
        const int sheet = static_cast<int>(i & 3);
        if (sheet >= sheets.count()) return;
        std::uint32_t source = 0;
        places[i] = placing::place_of(where, placing{}.points_of({}, sheets, sheet, source));
    }
};
inline constexpr std::uint64_t num_placed_states = 2048;

// The vertices of words by the places of their cells' states.
template <int = 0>
__global__ __launch_bounds__(words_per_block) void place_words_kernel(const __grid_constant__ surface_words all,
                                                                      const core::cell_place* places,
                                                                      surface_vertex* vertices) {
    await_stream();
    using namespace core::passes;
    constexpr std::uint32_t size = sizeof(surface_vertex) / sizeof(std::uint32_t);
    __shared__ word_item items[word_items];
    __shared__ std::uint32_t staged[words_per_block * size];
    const std::uint64_t n = *all.num_words, begin = std::uint64_t{blockIdx.x} * words_per_block,
                        i = begin + threadIdx.x, end = begin + words_per_block < n ? begin + words_per_block : n;
    if (begin >= n) return;
    const std::uint32_t first = all.words[begin].first_vertex, total = all.words[end].first_vertex - first;
    const surface_word own = i < n ? all.words[i] : surface_word{};
    const auto list = [&](const auto& add) {
        for (std::uint32_t left = own.active; left != 0; left &= left - 1) {
            const int bit = exact::lowest_one(left), sheets = own.num_sheets(bit);
            for (int s = 0; s < sheets; ++s) add(word_item::of(threadIdx.x, bit, s));
        }
    };
    for_word_items(items, own.first_vertex - first, total, list, [&](std::uint32_t k, word_item item, bool is_one) {
        if (is_one) {
            const std::uint64_t word = begin + item.word();
            const std::uint32_t state = all.states[all.words[word].cell(item.bit())];
            const cell_key at{all.keys[word]};
            const core::cell_place q = places[4 * state + static_cast<std::uint32_t>(item.which())];
            std::uint32_t* const to = staged + size * threadIdx.x;
            to[0] = static_cast<std::uint32_t>(at.x() + item.bit() - 1);
            to[1] = static_cast<std::uint32_t>(at.y() - 1);
            to[2] = static_cast<std::uint32_t>(at.z() - 1);
            to[3] = q.q[0] | static_cast<std::uint32_t>(q.q[1]) << 16;
            to[4] = q.q[2] | static_cast<std::uint32_t>(item.which()) << 16;
        }
        const std::uint32_t count = total - k < words_per_block ? total - k : words_per_block;
        copy_staged(reinterpret_cast<std::uint32_t*>(vertices + first + k), staged, size * count);
    });
}

// ---- faces ----------------------------------------------------------------------------------------------------------

// Words around those of a block: each itself, and those next to it along x (1), y (2) and z (4).
using words_around = std::uint32_t[8][words_per_block];

// Finds the words before word i, as far as there are rows and words. What has no cell is not meaningful. Of a row's
// words that have a cell, the one before another is the number before it.
__device__ VOXELPIPE_INLINE void find_words_before(const surface_words& all, std::uint64_t i, words_around& found) {
    const core::passes::cell_key at{all.keys[i]};
    const int w = at.x() >> 5, y = at.y(), z = at.z();
#pragma unroll
    for (int k = 0; k < 8; k += 2) {
        const int dy = k >> 1 & 1, dz = k >> 2;
        std::uint32_t word = static_cast<std::uint32_t>(i);
        if (k != 0) word = y >= dy && z >= dz ? all.where.find(w, y - dy, z - dz) : 0;
        found[k][threadIdx.x] = word;
        found[k + 1][threadIdx.x] = word == 0 ? 0 : word - 1;
    }
}

// Where the faces go: to triangles, or to quads.
struct face_arrays {
    const surface_vertex* vertices; // of triangles; may be null for quads
    bool folds;                     // as is_cut_from_first
    glm::uvec3* triangles;
    glm::uvec4* quads;
};

// The place of a face's vertex from the lowest sample of its edge, in units of 2^-16: below 2^17.
struct place_from {
    std::int32_t at[3];

    // back: the axes, as bits, along which the vertex's cell lies before the edge's lowest one.
    [[nodiscard]] __device__ VOXELPIPE_INLINE static place_from of(const surface_vertex& v, int back) {
        // The three numbers of 16 bits, by two of 32.
        const auto* const q = reinterpret_cast<const std::uint32_t*>(&v) + 3;
        const std::uint32_t xy = q[0], z = q[1];
        return {{static_cast<std::int32_t>(xy & 0xffffu) - ((back & 1) << 16),
                 static_cast<std::int32_t>(xy >> 16) - ((back & 2) << 15),
                 static_cast<std::int32_t>(z & 0xffffu) - ((back & 4) << 14)}};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::int64_t square_to(const place_from& o) const {
        std::int64_t sum = 0;
#pragma unroll
        for (int a = 0; a < 3; ++a) {
            const std::int32_t apart = at[a] - o.at[a];
            sum += std::int64_t{apart} * apart;
        }
        return sum;
    }
    [[nodiscard]] __device__ core::lattice_vertex wide() const { return {at[0], at[1], at[2]}; }
};
// As core::is_cut_from_first.
[[nodiscard]] __device__ VOXELPIPE_INLINE bool is_cut_from_first(const place_from (&p)[4], bool folds) {
    if (folds) return core::is_cut_from_first(p[0].wide(), p[1].wide(), p[2].wide(), p[3].wide(), true);
    return p[0].square_to(p[2]) <= p[1].square_to(p[3]);
}

// The face of each crossed edge that begins at a word's cells, as passes::list_quads.
template <bool MakesQuads>
__global__ __launch_bounds__(words_per_block) void list_faces_kernel(const __grid_constant__ surface_words all,
                                                                     const __grid_constant__ face_arrays out) {
    await_stream();
    using namespace core::passes;
    constexpr std::uint32_t size = 6; // numbers of two triangles
    __shared__ word_item items[word_items];
    __shared__ words_around around;
    __shared__ std::uint32_t staged[MakesQuads ? 1 : words_per_block * size];
    const std::uint64_t n = *all.num_words, begin = std::uint64_t{blockIdx.x} * words_per_block,
                        i = begin + threadIdx.x, end = begin + words_per_block < n ? begin + words_per_block : n;
    if (begin >= n) return;
    const std::uint64_t first = all.words[begin].first_edge;
    const auto total = static_cast<std::uint32_t>(all.words[end].first_edge - first);
    word_edges own{};
    std::uint32_t own_first = 0;
    if (i < n) {
        own = all.edges[i];
        own_first = static_cast<std::uint32_t>(all.words[i].first_edge - first);
        if ((own.x | own.y | own.z) != 0) find_words_before(all, i, around);
    }
    const auto list = [&](const auto& add) {
        for (std::uint32_t left = own.x | own.y | own.z; left != 0; left &= left - 1) {
            const int bit = exact::lowest_one(left);
            if ((own.x >> bit & 1) != 0) add(word_item::of(threadIdx.x, bit, 0));
            if ((own.y >> bit & 1) != 0) add(word_item::of(threadIdx.x, bit, 1));
            if ((own.z >> bit & 1) != 0) add(word_item::of(threadIdx.x, bit, 2));
        }
    };
    for_word_items(items, own_first, total, list, [&](std::uint32_t k, word_item item, bool is_one) {
        if (is_one) {
            const int axis = item.which(), bit = item.bit();
            // The axes b and d that make a right-handed frame with this one.
            const int b = axis == 2 ? 0 : axis + 1, d = axis == 0 ? 2 : axis - 1;
            const surface_word word = all.words[begin + item.word()];
            const bool goes_out = (all.states[word.cell(bit)] & 1) != 0; // the lower sample is inside
            std::uint32_t v[4];
            place_from places[4];
#pragma unroll
            for (int corner = 0; corner < 4; ++corner) {
                // Around the edge from its lowest cell: (1, 1) (0, 1) (0, 0) (1, 0) as the edge lies in the cell.
                const int along_b = corner == 0 || corner == 3 ? 1 : 0, along_d = corner < 2 ? 1 : 0;
                const int back = along_b << b | along_d << d; // the axes, as bits, along which the cell lies before
                const int in_word = (bit - (back & 1)) & 31;
                const surface_word w =
                    all.words[around[(back & 6) | ((back & 1) != 0 && bit == 0 ? 1 : 0)][item.word()]];
                v[corner] = w.vertex(in_word);
                if (w.has_several(in_word)) {
                    const int edge =
                        b < d ? core::cell_edge(axis, along_b, along_d) : core::cell_edge(axis, along_d, along_b);
                    v[corner] += all.sheet(w, in_word, edge);
                }
                if constexpr (!MakesQuads) places[corner] = place_from::of(out.vertices[v[corner]], back);
            }
            if (!goes_out) { // the other way round
                const std::uint32_t second = v[1];
                v[1] = v[3];
                v[3] = second;
                if constexpr (!MakesQuads) {
                    const place_from second_place = places[1];
                    places[1] = places[3];
                    places[3] = second_place;
                }
            }
            if constexpr (MakesQuads) {
                out.quads[first + k + threadIdx.x] = glm::uvec4(v[0], v[1], v[2], v[3]);
            } else {
                const bool from_first = is_cut_from_first(places, out.folds);
                std::uint32_t* const to = staged + size * threadIdx.x;
                to[0] = v[0];
                to[1] = v[1];
                to[2] = from_first ? v[2] : v[3];
                to[3] = from_first ? v[0] : v[1];
                to[4] = v[2];
                to[5] = v[3];
            }
        }
        if constexpr (!MakesQuads) {
            const std::uint32_t count = total - k < words_per_block ? total - k : words_per_block;
            copy_staged(reinterpret_cast<std::uint32_t*>(out.triangles + 2 * (first + k)), staged, size * count);
        }
    });
}

// ---- launches -------------------------------------------------------------------------------------------------------

template <int = 0>
void list_cells(const surface_words& all, std::uint32_t blocks, std::uint64_t* keys, std::uint64_t* first_vertices,
                std::uint64_t* first_edges, cudaStream_t stream) {
    launch_behind(list_cells_kernel<>, blocks, words_per_block, stream, stage::vertex_shade, all, keys, first_vertices,
                  first_edges);
}
template <int = 0>
void place_words(const surface_words& all, std::uint32_t blocks, const core::cell_place* places,
                 surface_vertex* vertices, cudaStream_t stream) {
    launch_behind(place_words_kernel<>, blocks, words_per_block, stream, stage::vertex_shade, all, places, vertices);
}
template <int = 0>
void list_faces(const surface_words& all, std::uint32_t blocks, const face_arrays& out, cudaStream_t stream) {
    launch_behind(out.quads != nullptr ? list_faces_kernel<true> : list_faces_kernel<false>, blocks, words_per_block,
                  stream, stage::vertex_shade, all, out);
}
} // namespace voxelpipe::device
