// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Finds the words of cells that a surface passes (passes/words.hpp), on a GPU: a pass over the samples marks them, they
// are listed in the order of their cells, and one pass over the list decides flips and numbers cells, vertices and
// crossed edges. All but the marks is in proportion to the surface.

#include <voxelpipe/device/base/block_scan.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/lookback.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/surfaces/passes/words.hpp>

#include <cstdint>

namespace voxelpipe::device {

inline constexpr unsigned mark_words_warps = 4; // of a block
inline constexpr int mark_words_side = 8;       // rows and layers of a warp
inline constexpr unsigned words_per_block = 256;

// The samples' words of a lane in the rows that a warp's cells have, of one layer: the rows of its own cells and the
// one below them. `before`: of each row the last sample of the word before lane 0, a bit a row.
struct word_rows {
    std::uint32_t rows[mark_words_side + 1];
    std::uint32_t before;
};

// Groups of words that warps go through. Rows of a multiple of 1024 samples end with a group of one word that has only
// the cell above their last sample: the warp before it marks that.
[[nodiscard]] VOXELPIPE_HD inline std::uint32_t marked_groups(const core::passes::word_groups& where) {
    const std::uint32_t groups = where.groups();
    return where.cells.samples.nx % 1024 == 0 ? groups - 1 : groups;
}

// Marks words with a cell that the surface passes, a bit a word, counts those of each group, and adds up the cells. A
// warp has 32 words of a row, of eight rows and eight layers, so that a word is read by 1.3 warps on average.
template <int = 0>
__global__
__launch_bounds__(32 * mark_words_warps) void mark_words_kernel(const __grid_constant__ core::passes::word_groups where,
                                                                std::uint32_t* masks, std::uint32_t* counts,
                                                                std::uint64_t* num_cells) {
    await_stream();
    constexpr int side = mark_words_side;
    constexpr unsigned all_lanes = 0xffffffffu;
    const core::passes::sample_bits& s = where.cells.samples;
    const std::uint32_t groups = where.groups(), marked = marked_groups(where);
    const auto strips_y = static_cast<std::uint32_t>(s.ny / side + 1),
               strips_z = static_cast<std::uint32_t>(s.nz / side + 1);
    const std::uint64_t warp = std::uint64_t{blockIdx.x} * mark_words_warps + warp_in_block();
    if (warp == 0 && threadIdx.x == 0) counts[where.count()] = 0;
    const std::uint64_t row_of_strips = warp / marked;
    const auto group = static_cast<std::uint32_t>(warp - row_of_strips * marked);
    const auto strip_z = static_cast<std::uint32_t>(row_of_strips / strips_y);
    if (strip_z >= strips_z) return;
    const int y_begin = static_cast<int>(row_of_strips - std::uint64_t{strip_z} * strips_y) * side,
              z_begin = static_cast<int>(strip_z) * side;
    const int lane = static_cast<int>(threadIdx.x % 32), w = static_cast<int>(32 * group) + lane, words = s.row_words();
    const int left = s.nx - 32 * w; // samples from the word on
    const std::uint32_t valid = left >= 32 ? ~0u : left <= 0 ? 0u : (1u << left) - 1;
    const bool has_before = lane == 0 && w > 0 && w <= words, has_tail = group + 1 == marked && marked != groups;
    std::uint32_t exist = 0; // rows, a bit a row
#pragma unroll
    for (int k = 0; k <= side; ++k) exist |= (y_begin - 1 + k >= 0 && y_begin - 1 + k < s.ny ? 1u : 0u) << k;
    const std::uint32_t to_read = w < words ? exist : 0, to_look = has_before ? exist : 0;

    const auto read = [&](int z) {
        word_rows r{};
        if (z < 0 || z >= s.nz) return r;
        const std::int64_t first = (std::int64_t{z} * s.ny + y_begin - 1) * words + w;
#pragma unroll
        for (int k = 0; k <= side; ++k)
            if ((to_read >> k & 1) != 0) r.rows[k] = s.words[first + std::int64_t{k} * words] & valid;
        if (to_look != 0)
#pragma unroll
            for (int k = 0; k <= side; ++k)
                if ((to_look >> k & 1) != 0) r.before |= (s.words[first + std::int64_t{k} * words - 1] >> 31) << k;
        return r;
    };

    std::uint32_t cells = 0;
    word_rows below = read(z_begin - 1);
    for (int z = z_begin; z < z_begin + side && z <= s.nz; ++z) {
        const word_rows here = read(z);
        std::uint32_t mine = 0, tails = 0, any = below.before | here.before; // mine: the mask of row y_begin + lane
#pragma unroll
        for (int k = 0; k <= side; ++k) any |= below.rows[k] | here.rows[k];
        if (__any_sync(all_lanes, any != 0)) { // otherwise all are outside
            // The last samples before lane 0, of both layers.
            const std::uint32_t one_before = __shfl_sync(all_lanes, below.before | here.before, 0),
                                both_before = __shfl_sync(all_lanes, below.before & here.before, 0);
#pragma unroll
            for (int k = 0; k < side; ++k) {
                const std::uint32_t one = below.rows[k] | here.rows[k] | below.rows[k + 1] | here.rows[k + 1],
                                    both = below.rows[k] & here.rows[k] & below.rows[k + 1] & here.rows[k + 1];
                // Words of which a sample is inside, and those of which all are, with the samples before them.
                const std::uint32_t lasts = __ballot_sync(all_lanes, one >> 31 != 0),
                                    all_lasts = __ballot_sync(all_lanes, both >> 31 != 0);
                const std::uint32_t some = __ballot_sync(all_lanes, one != 0) | lasts << 1 |
                                           ((one_before >> k | one_before >> (k + 1)) & 1),
                                    all = __ballot_sync(all_lanes, both == ~0u) &
                                          (all_lasts << 1 | (both_before >> k & both_before >> (k + 1) & 1));
                const std::uint32_t mask = some & ~all;
                tails |= lasts >> 31 << k;
                if (mask == 0) continue; // of the whole warp
                if (lane == k) mine = mask;
                std::uint32_t one_last = __shfl_up_sync(all_lanes, one, 1),
                              both_last = __shfl_up_sync(all_lanes, both, 1);
                if (lane == 0) {
                    one_last = (one_before >> k | one_before >> (k + 1)) << 31;
                    both_last = (both_before >> k & both_before >> (k + 1)) << 31;
                }
                const std::uint32_t active =
                    (one | one << 1 | one_last >> 31) & ~(both & (both << 1 | both_last >> 31));
                cells += static_cast<std::uint32_t>(__popc(active));
            }
        }
        if (lane < side && y_begin + lane <= s.ny) {
            const std::uint64_t at = where.cells.row(y_begin + lane, z) * groups + group;
            masks[at] = mine;
            counts[at] = static_cast<std::uint32_t>(__popc(mine));
            if (has_tail) { // the cell above the last samples: inside or not, the one above is not
                const std::uint32_t tail = tails >> lane & 1;
                masks[at + 1] = counts[at + 1] = tail;
                cells += tail;
            }
        }
        below = here;
    }
    cells = __reduce_add_sync(all_lanes, cells);
    if (lane == 0 && cells != 0)
        atomicAdd(reinterpret_cast<unsigned long long*>(num_cells), static_cast<unsigned long long>(cells));
}

// Writes the key of the first cell of each marked word, unless there are none.
template <int = 0>
__global__
__launch_bounds__(threads_per_block) void list_words_kernel(const __grid_constant__ core::passes::word_groups where,
                                                            const std::uint64_t* num_words, std::uint64_t* keys) {
    await_stream();
    const std::uint64_t i = std::uint64_t{blockIdx.x} * threads_per_block + threadIdx.x;
    if (i >= where.count() || *num_words == 0) return;
    std::uint32_t left = where.masks[i];
    if (left == 0) return;
    const std::uint64_t row = i / where.groups();
    const int y = where.cells.y(row), z = where.cells.z(row), w = 32 * static_cast<int>(i - row * where.groups());
    for (std::uint64_t at = where.first[i]; left != 0; left &= left - 1)
        keys[at++] = core::passes::cell_key::of(32 * (w + exact::lowest_one(left)), y, z).key;
}

// What number_words_kernel reads and writes.
struct word_numbering {
    core::passes::cell_grid cells;
    const core::cell_sheets* table;
    const std::uint64_t* num_words;
    const std::uint64_t* keys;         // of the words' first cells
    core::passes::surface_word* words; // one more, in which numbers begin that follow
    core::passes::word_edges* edges;
    core::passes::word_faces* faces;
    std::uint16_t* states;    // of cells: corners, and 256 if its joined face is flipped
    unsigned long long* sums; // three of each block, zeros
    std::uint32_t num_blocks;
    std::uint64_t* totals; // cells, vertices and crossed edges
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

// The samples of a block's words, as core::passes::cell_rows has them.
struct block_rows {
    std::uint32_t low[4][words_per_block], high[4][words_per_block];

    __device__ VOXELPIPE_INLINE int corners(unsigned word, int bit) const {
        std::uint32_t c = 0;
#pragma unroll
        for (int k = 0; k < 4; ++k)
            c |= (low[k][word] >> bit & 1) << (2 * k) | (high[k][word] >> bit & 1) << (2 * k + 1);
        return static_cast<int>(c);
    }
};

// Decides the flips of the words' cells, as passes::flip_cells, and numbers what they have.
template <int = 0>
__global__ __launch_bounds__(words_per_block) void number_words_kernel(const __grid_constant__ word_numbering pass) {
    await_stream();
    using namespace core::passes;
    __shared__ block_scan<std::uint32_t, words_per_block> scan_cells;
    __shared__ block_scan<unsigned long long, words_per_block> scan;
    __shared__ unsigned long long earlier[3];
    __shared__ word_item items[word_items];
    __shared__ block_rows samples_of;
    __shared__ std::uint32_t flips[words_per_block], more[words_per_block], many[words_per_block];
    const std::uint64_t n = *pass.num_words, first = std::uint64_t{blockIdx.x} * words_per_block,
                        i = first + threadIdx.x;
    if (first >= n) {
        if (i == 0) {
            pass.words[0] = surface_word{};
            for (int k = 0; k < 3; ++k) pass.totals[k] = 0;
        }
        return;
    }
    const sample_bits& samples = pass.cells.samples;
    surface_word word{};
    word_edges edges{};
    word_faces faces{};
    flips[threadIdx.x] = more[threadIdx.x] = many[threadIdx.x] = 0;
    if (i < n) {
        const cell_key at{pass.keys[i]};
        const cell_rows rows(samples, at.x() >> 5, at.y(), at.z());
        const std::uint32_t *const low = rows.low, *const high = rows.high;
        word.active = rows.active();
        edges.x = low[0] ^ high[0];
        edges.y = low[0] ^ low[1];
        edges.z = low[0] ^ low[2];
        edges.faces_x = (low[0] | low[1] | low[2] | low[3]) & ~(low[0] & low[1] & low[2] & low[3]);
        faces = {(low[0] | high[0] | low[2] | high[2]) & ~(low[0] & high[0] & low[2] & high[2]),
                 (low[0] | high[0] | low[1] | high[1]) & ~(low[0] & high[0] & low[1] & high[1])};
#pragma unroll
        for (int k = 0; k < 4; ++k) {
            samples_of.low[k][threadIdx.x] = low[k];
            samples_of.high[k][threadIdx.x] = high[k];
        }
    }
    const std::uint32_t cells_before = scan_cells.sum_before(static_cast<std::uint32_t>(__popc(word.active))),
                        num_cells = scan_cells.sum();
    const auto list = [&](const auto& add) {
        for (std::uint32_t left = word.active; left != 0; left &= left - 1)
            add(word_item::of(threadIdx.x, exact::lowest_one(left), 0));
    };
    for_word_items(items, cells_before, num_cells, list, [&](std::uint32_t, word_item item, bool is_one) {
        if (!is_one) return;
        const int bit = item.bit(), corners = samples_of.corners(item.word(), bit);
        core::cell_sheets sheets = pass.table[corners];
        const int face = sheets.joined_face();
        if (face != core::cell_sheets::no_face) {
            const cell_key at{pass.keys[first + item.word()]};
            const int axis = face >> 1, step = (face & 1) != 0 ? 1 : -1;
            const int across = samples.corners(at.x() + bit + (axis == 0 ? step : 0), at.y() + (axis == 1 ? step : 0),
                                               at.z() + (axis == 2 ? step : 0));
            if (pass.table[across].joined_face() == (face ^ 1)) {
                atomicOr(&flips[item.word()], 1u << bit);
                sheets = pass.table[256 + corners];
            }
        }
        if (sheets.count() == 1) return;
        const auto beyond_one = static_cast<std::uint32_t>(sheets.count() - 1);
        if ((beyond_one & 1) != 0) atomicOr(&more[item.word()], 1u << bit);
        if (beyond_one >> 1 != 0) atomicOr(&many[item.word()], 1u << bit);
    });
    __syncthreads();
    word.more = more[threadIdx.x];
    word.many = many[threadIdx.x];
    word.linked = edges.faces_x & word.single() & word.single() << 1;
    // At most 2^13 cells, 2^15 vertices and 2^15 edges a block: all of them in one sum.
    constexpr int bits = 20;
    constexpr unsigned long long one = (1ull << bits) - 1;
    const unsigned long long own = static_cast<unsigned long long>(__popc(word.active)) |
                                   static_cast<unsigned long long>(word.num_vertices()) << bits |
                                   static_cast<unsigned long long>(edges.count()) << (2 * bits);
    const unsigned long long before = scan.sum_before(own), all = scan.sum();
    const unsigned warp = warp_in_block();
    if (warp < 3) {
        unsigned long long* const sums = pass.sums + std::uint64_t{warp} * pass.num_blocks;
        const unsigned long long sum = all >> (bits * warp) & one;
        if (threadIdx.x % 32 == 0) lookback::publish(sums, blockIdx.x, sum);
        const unsigned long long found =
            lookback::before(sums, blockIdx.x, sum, [](unsigned long long part) { return warp_sum(part); });
        if (threadIdx.x % 32 == 0) earlier[warp] = found;
    }
    __syncthreads();
    if (i < n) {
        word.first_cell = static_cast<std::uint32_t>(earlier[0] + (before & one));
        word.first_vertex = static_cast<std::uint32_t>(earlier[1] + (before >> bits & one));
        word.first_edge = earlier[2] + (before >> (2 * bits) & one);
        pass.words[i] = word;
        pass.edges[i] = edges;
        pass.faces[i] = faces;
    }
    const std::uint64_t first_cell = earlier[0];
    for_word_items(items, cells_before, num_cells, list, [&](std::uint32_t k, word_item item, bool is_one) {
        if (!is_one) return;
        const int state =
            samples_of.corners(item.word(), item.bit()) | static_cast<int>(flips[item.word()] >> item.bit() & 1) << 8;
        pass.states[first_cell + k + threadIdx.x] = static_cast<std::uint16_t>(state);
    });
    if (i + 1 != n) return;
    const std::uint64_t cells = earlier[0] + num_cells,
                        vertices = earlier[1] + (before >> bits & one) + word.num_vertices(),
                        last = word.first_edge + edges.count();
    surface_word end{};
    end.first_cell = static_cast<std::uint32_t>(cells);
    end.first_vertex = static_cast<std::uint32_t>(vertices);
    end.first_edge = last;
    pass.words[n] = end;
    pass.totals[0] = cells;
    pass.totals[1] = vertices;
    pass.totals[2] = last;
}

// ---- launches -------------------------------------------------------------------------------------------------------

template <int = 0>
void mark_words(const core::passes::word_groups& where, std::uint32_t* masks, std::uint32_t* counts,
                std::uint64_t* num_cells, cudaStream_t stream) {
    const core::passes::sample_bits& s = where.cells.samples;
    const std::uint64_t warps = std::uint64_t{marked_groups(where)} *
                                static_cast<std::uint64_t>(s.ny / mark_words_side + 1) *
                                static_cast<std::uint64_t>(s.nz / mark_words_side + 1);
    launch_behind(mark_words_kernel<>, static_cast<unsigned>((warps - 1) / mark_words_warps + 1), 32 * mark_words_warps,
                  stream, stage::coarse_raster, where, masks, counts, num_cells);
}
template <int = 0>
void list_words(const core::passes::word_groups& where, const std::uint64_t* num_words, std::uint64_t* keys,
                cudaStream_t stream) {
    launch_behind(list_words_kernel<>, static_cast<unsigned>((where.count() - 1) / threads_per_block + 1),
                  threads_per_block, stream, stage::coarse_raster, where, num_words, keys);
}

// Blocks of kernels with a thread a word.
[[nodiscard]] inline std::uint32_t word_blocks(std::uint64_t num_words) {
    return static_cast<std::uint32_t>(num_words == 0 ? 1 : (num_words - 1) / words_per_block + 1);
}
template <int = 0>
void number_surface_words(const word_numbering& pass, cudaStream_t stream) {
    check(cudaMemsetAsync(pass.sums, 0, 3 * sizeof(unsigned long long) * pass.num_blocks, stream));
    launch_behind(number_words_kernel<>, pass.num_blocks, words_per_block, stream, stage::coarse_raster, pass);
}

} // namespace voxelpipe::device
