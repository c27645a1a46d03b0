// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Components of a surface from words of cells (passes/words.hpp), on a GPU, without its faces: sheets that go on
// through the face between two cells are joined. A block joins those of its words in shared memory.

#include <voxelpipe/core/disjoint_sets.hpp>
#include <voxelpipe/surfaces/device/word_mesh_kernels.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Joins vertices that an edge of the mesh joins, by join_two(v, u), which returns whether two sets became one. A row of
// linked cells is one vertex from the start, and neighbouring rows are joined once for each two that touch.
template <class JoinTwo>
struct join_words {
    const surface_words& all;
    JoinTwo join_two;

    // Joins a word's cells with those before them, as far as is_wanted(i) for the word i that has the other cell.
    // Returns how many sets became fewer.
    template <class IsWanted>
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t join(std::uint64_t i, const IsWanted& is_wanted) {
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
                                                                       std::uint32_t faces, int axis) {
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
                                                      const core::passes::surface_word& b, int bit_b, int axis) {
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
    [[nodiscard]] __device__ std::uint32_t join_vertices(std::uint32_t v, std::uint32_t u) {
        return join_two(v, u) ? 1 : 0;
    }
};

// Vertices of a block that are joined in shared memory. A block with more leaves all to join_blocks_kernel.
inline constexpr std::uint32_t joined_vertices = 6144;

// Adds to *components what the block's threads have; numbers modulo 2^32 with a sign. All threads call it.
__device__ VOXELPIPE_INLINE void add_components(std::uint64_t* components, std::uint32_t own) {
    const unsigned long long sum =
        block_sum(static_cast<unsigned long long>(std::int64_t{static_cast<std::int32_t>(own)}));
    if (threadIdx.x == 0 && sum != 0) atomicAdd(reinterpret_cast<unsigned long long*>(components), sum);
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
        const core::disjoint_sets<std::uint32_t> sets{of_block};
        const auto join_two = [&](std::uint32_t v, std::uint32_t u) { return sets.join(v - first, u - first); };
        if (i < n)
            left -= join_words<decltype(join_two)>{all, join_two}.join(
                i, [&](std::uint64_t other) { return other >= begin; });
        __syncthreads();
        for (std::uint32_t k = threadIdx.x; k < total; k += words_per_block) parents[first + k] = first + sets.find(k);
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
    const core::disjoint_sets<std::uint32_t> sets{parents};
    // Faces of a word that lie next to each other are mostly of the same two sets of blocks.
    std::uint32_t last_v = ~0u, last_u = ~0u, fewer = 0;
    const auto join_two = [&](std::uint32_t v, std::uint32_t u) {
        v = sets.parent(v);
        u = sets.parent(u);
        if (v == last_v && u == last_u) return false;
        last_v = v;
        last_u = u;
        return sets.join(v, u);
    };
    if (i < n)
        fewer = join_words<decltype(join_two)>{all, join_two}.join(
            i, [&](std::uint64_t other) { return !is_joined || other < begin; });
    add_components(components, 0 - fewer);
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
