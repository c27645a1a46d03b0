// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Vertices, faces and components of a surface from words of cells (passes/words.hpp), on a GPU. A block has 256 words;
// it lists what they have in shared memory and gives each thread one item, so that neighbouring threads write
// neighbouring items. The results are those of passes::place_vertices, list_quads and cut_quads.

#include <voxelpipe/core/disjoint_sets.hpp>
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

// An item of a block's words: the word in the block, its cell, and a sheet or an axis.
struct word_item {
    std::uint16_t bits;
    [[nodiscard]] __device__ static word_item of(unsigned word, int bit, int which) {
        return {
            static_cast<std::uint16_t>(word | static_cast<unsigned>(bit) << 8 | static_cast<unsigned>(which) << 13)};
    }
    [[nodiscard]] __device__ unsigned word() const { return bits & 255u; }
    [[nodiscard]] __device__ int bit() const { return bits >> 8 & 31; }
    [[nodiscard]] __device__ int which() const { return bits >> 13; }
};
inline constexpr std::uint32_t word_items = 2048; // of a list in shared memory

// Calls use(k, item, is_one) for the `total` items of the block, k counted from 0, a thread an item; all threads call
// it equally often, and is_one is false for those without an item. list(add) calls add(item) for the thread's own items
// in their order, the first of which is number `first`.
template <class List, class Use>
__device__ VOXELPIPE_INLINE void for_word_items(word_item (&items)[word_items], std::uint32_t first,
                                                std::uint32_t total, const List& list, const Use& use) {
    for (std::uint32_t begin = 0; begin < total; begin += word_items) {
        __syncthreads();
        std::uint32_t at = first - begin; // below 0: large
        list([&](word_item item) {
            if (at < word_items) items[at] = item;
            ++at;
        });
        __syncthreads();
        const std::uint32_t count = total - begin < word_items ? total - begin : word_items;
        for (std::uint32_t k = 0; k < count; k += words_per_block) {
            const bool is_one = k + threadIdx.x < count;
            use(begin + k, is_one ? items[k + threadIdx.x] : word_item{0}, is_one);
        }
    }
}

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

// Finds the words before word i, as far as there are rows and words. What has no cell is not meaningful.
__device__ VOXELPIPE_INLINE void find_words_before(const surface_words& all, std::uint64_t i, bool along_x,
                                                   words_around& found) {
    const core::passes::cell_key at{all.keys[i]};
    const int w = at.x() >> 5, y = at.y(), z = at.z();
    found[0][threadIdx.x] = static_cast<std::uint32_t>(i);
#pragma unroll
    for (int k = 1; k < 8; ++k) {
        const int dw = k & 1, dy = k >> 1 & 1, dz = k >> 2;
        std::uint32_t word = 0;
        if ((along_x || dw == 0) && w >= dw && y >= dy && z >= dz) word = all.where.find(w - dw, y - dy, z - dz);
        found[k][threadIdx.x] = word;
    }
}

// Where the faces go: to triangles, or to quads.
struct face_arrays {
    const surface_vertex* vertices; // of triangles; may be null for quads
    bool folds;                     // as is_cut_from_first
    glm::uvec3* triangles;
    glm::uvec4* quads;
};

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
        if ((own.x | own.y | own.z) != 0) find_words_before(all, i, ((own.y | own.z) & 1) != 0, around);
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
            core::lattice_vertex places[4];
#pragma unroll
            for (int corner = 0; corner < 4; ++corner) {
                // Around the edge, as passes::list_quads.
                const int turn = goes_out ? corner : (4 - corner) & 3;
                const int along_b = turn == 0 || turn == 3 ? 1 : 0, along_d = turn < 2 ? 1 : 0;
                const int dx = b == 0   ? along_b
                               : d == 0 ? along_d
                                        : 0,
                          dy = b == 1   ? along_b
                               : d == 1 ? along_d
                                        : 0,
                          dz = b == 2   ? along_b
                               : d == 2 ? along_d
                                        : 0;
                const int in_word_before = dx != 0 && bit == 0 ? 1 : 0, in_word = (bit - dx) & 31;
                const surface_word w = all.words[around[in_word_before | dy << 1 | dz << 2][item.word()]];
                v[corner] = w.vertex(in_word);
                if (w.has_several(in_word)) {
                    const int edge =
                        b < d ? core::cell_edge(axis, along_b, along_d) : core::cell_edge(axis, along_d, along_b);
                    v[corner] += all.sheet(w, in_word, edge);
                }
                if constexpr (!MakesQuads) { // from the edge's lowest cell on
                    const surface_vertex at = out.vertices[v[corner]];
                    places[corner] = {std::int64_t{at.q[0]} - 65536 * dx, std::int64_t{at.q[1]} - 65536 * dy,
                                      std::int64_t{at.q[2]} - 65536 * dz};
                }
            }
            if constexpr (MakesQuads) {
                out.quads[first + k + threadIdx.x] = glm::uvec4(v[0], v[1], v[2], v[3]);
            } else {
                const bool from_first = core::is_cut_from_first(places[0], places[1], places[2], places[3], out.folds);
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

// ---- components -----------------------------------------------------------------------------------------------------

// Joins vertices that an edge of the mesh joins. A row of linked cells is one vertex from the start, and neighbouring
// rows are joined once for each two that touch.
struct join_words {
    surface_words all;
    core::disjoint_sets<std::uint32_t> sets; // vertices, counted from first_vertex
    std::uint32_t first_vertex;

    // Joins a word's cells with those before them, as far as is_wanted(i) for the word i that has the other cell.
    // Returns how many sets became fewer.
    template <class IsWanted>
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t join(std::uint64_t i, const IsWanted& is_wanted) const {
        const core::passes::surface_word own = all.words[i];
        const core::passes::cell_key at{all.keys[i]};
        const int w = at.x() >> 5, y = at.y(), z = at.z();
        const core::passes::word_faces faces = all.faces[i];
        std::uint32_t along_x = all.edges[i].faces_x & ~own.linked, fewer = 0;
        if ((along_x & 1) != 0) {
            const std::uint32_t before = all.where.find(w - 1, y, z);
            if (is_wanted(before)) fewer += join_cells(all.words[before], 31, own, 0, 0);
        }
        along_x &= ~1u;
        if (along_x != 0 && is_wanted(i))
            for (; along_x != 0; along_x &= along_x - 1) {
                const int bit = exact::lowest_one(along_x);
                fewer += join_cells(own, bit - 1, own, bit, 0);
            }
        for (int axis = 1; axis < 3; ++axis) {
            const std::uint32_t along = axis == 1 ? faces.y : faces.z;
            if (along == 0) continue;
            const std::uint32_t before = axis == 1 ? all.where.find(w, y - 1, z) : all.where.find(w, y, z - 1);
            if (is_wanted(before)) fewer += join_along(all.words[before], own, along, axis);
        }
        return fewer;
    }

private:
    // Joins a word and the one before it along y or z through these faces.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t join_along(const core::passes::surface_word& before,
                                                                       const core::passes::surface_word& own,
                                                                       std::uint32_t faces, int axis) const {
        const std::uint32_t plain = faces & own.single() & before.single(),
                            known = plain << 1 & own.linked & before.linked; // joined through the cell before
        std::uint32_t fewer = 0;
        for (std::uint32_t left = faces & ~(plain & known); left != 0; left &= left - 1) {
            const int bit = exact::lowest_one(left);
            fewer += join_cells(before, bit, own, bit, axis);
        }
        return fewer;
    }
    // Joins the sheets of two cells through the face between them; b is the upper one along `axis`.
    [[nodiscard]] __device__ std::uint32_t join_cells(const core::passes::surface_word& a, int bit_a,
                                                      const core::passes::surface_word& b, int bit_b, int axis) const {
        const bool several_a = a.has_several(bit_a), several_b = b.has_several(bit_b);
        if (!several_a && !several_b) return join_vertices(row(a, bit_a), row(b, bit_b));
        const int corners = all.states[b.cell(bit_b)] & 255;
        std::uint32_t fewer = 0;
        for (int other = 0; other < 3; ++other) {
            if (other == axis) continue;
            for (int side = 0; side < 2; ++side) { // along the third axis
                const auto edge = [&](int along_axis) {
                    return axis == core::low_axis(other) ? core::cell_edge(other, along_axis, side)
                                                         : core::cell_edge(other, side, along_axis);
                };
                if (!core::is_crossed(corners, edge(0))) continue;
                fewer += join_vertices(several_a ? a.vertex(bit_a) + all.sheet(a, bit_a, edge(1)) : row(a, bit_a),
                                       several_b ? b.vertex(bit_b) + all.sheet(b, bit_b, edge(0)) : row(b, bit_b));
            }
        }
        return fewer;
    }
    // The vertex that stands for the row of linked cells of a cell.
    [[nodiscard]] __device__ static std::uint32_t row(const core::passes::surface_word& w, int bit) {
        return w.vertex(w.begin_of_links(bit));
    }
    [[nodiscard]] __device__ std::uint32_t join_vertices(std::uint32_t v, std::uint32_t u) const {
        return sets.join(v - first_vertex, u - first_vertex) ? 1 : 0;
    }
};

// Vertices of a block that are joined in shared memory. A block with more leaves all to join_blocks_kernel.
inline constexpr std::uint32_t joined_vertices = 6144;

// Adds to *components what a warp's lanes have; numbers modulo 2^32 with a sign.
__device__ VOXELPIPE_INLINE void add_components(std::uint64_t* components, std::uint32_t own) {
    const auto sum = static_cast<std::int32_t>(__reduce_add_sync(0xffffffffu, own));
    if (threadIdx.x % 32 == 0 && sum != 0)
        atomicAdd(reinterpret_cast<unsigned long long*>(components),
                  static_cast<unsigned long long>(std::int64_t{sum}));
}

// Starts the sets of vertices, joins those of each block's words, and adds what is left to *components.
template <int = 0>
__global__ __launch_bounds__(words_per_block) void join_in_blocks_kernel(const __grid_constant__ surface_words all,
                                                                         std::uint32_t* parents,
                                                                         std::uint64_t* components) {
    await_stream();
    __shared__ std::uint32_t of_block[joined_vertices];
    const std::uint64_t n = *all.num_words, begin = std::uint64_t{blockIdx.x} * words_per_block,
                        i = begin + threadIdx.x, end = begin + words_per_block < n ? begin + words_per_block : n;
    if (begin >= n) return;
    const std::uint32_t first = all.words[begin].first_vertex, total = all.words[end].first_vertex - first;
    std::uint32_t left = 0;
    if (i < n) {
        const core::passes::surface_word own = all.words[i];
        left = own.num_vertices() - static_cast<std::uint32_t>(__popc(own.linked));
    }
    if (total <= joined_vertices) {
        for (std::uint32_t k = threadIdx.x; k < total; k += words_per_block) of_block[k] = k;
        __syncthreads();
        const join_words pass{all, {of_block}, first};
        if (i < n) left -= pass.join(i, [&](std::uint64_t other) { return other >= begin; });
        __syncthreads();
        for (std::uint32_t k = threadIdx.x; k < total; k += words_per_block)
            parents[first + k] = first + pass.sets.find(k);
    } else {
        for (std::uint32_t k = threadIdx.x; k < total; k += words_per_block) parents[first + k] = first + k;
    }
    add_components(components, left);
}

// Joins what join_in_blocks_kernel has not joined.
template <int = 0>
__global__ __launch_bounds__(words_per_block) void join_blocks_kernel(const __grid_constant__ surface_words all,
                                                                      std::uint32_t* parents,
                                                                      std::uint64_t* components) {
    await_stream();
    const std::uint64_t n = *all.num_words, begin = std::uint64_t{blockIdx.x} * words_per_block,
                        i = begin + threadIdx.x, end = begin + words_per_block < n ? begin + words_per_block : n;
    if (begin >= n) return;
    const bool is_joined = all.words[end].first_vertex - all.words[begin].first_vertex <= joined_vertices;
    std::uint32_t fewer = 0;
    if (i < n)
        fewer = join_words{all, {parents}, 0}.join(i, [&](std::uint64_t other) { return !is_joined || other < begin; });
    add_components(components, 0 - fewer);
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
// Sets *components, which is 0, to the number of components.
template <int = 0>
void count_components(const surface_words& all, std::uint32_t blocks, std::uint32_t* parents, std::uint64_t* components,
                      cudaStream_t stream) {
    launch_behind(join_in_blocks_kernel<>, blocks, words_per_block, stream, stage::vertex_shade, all, parents,
                  components);
    launch_behind(join_blocks_kernel<>, blocks, words_per_block, stream, stage::vertex_shade, all, parents, components);
}

} // namespace voxelpipe::device
