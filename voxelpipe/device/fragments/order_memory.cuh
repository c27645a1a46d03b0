// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Memory of the fragment order (fragments/order_voxels.cuh): lists of long voxels, words that tiles publish, output
// pointers, and what must be zero before.

#include <voxelpipe/device/fragments/radix_sort.cuh>
#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

#include <bit>
#include <cstdint>

namespace voxelpipe::device {

inline constexpr int num_warp_sorts = 2; // with 16 or 32 fragments a lane
inline constexpr std::uint32_t max_of_warp = 32 * 32;
inline constexpr int narrow_primitive_bits = 24; // in 32 bits, beside the rank of a voxel in its window
inline constexpr std::uint64_t only_dense = tuning::max_of_block + 1; // longest_ordered of dense voxels without runs

// A range of fragments.
struct fragment_run {
    unsigned long long begin, length;
};
// A run of at most max_of_block fragments, and the longer voxel that it belongs to.
struct voxel_run {
    fragment_run run, voxel;
};

// Voxels that are too long for a window, by how they are sorted. The lists cannot overflow: each voxel in them has more
// fragments than the list has slots for.
struct order_lists {
    static constexpr int block_list = num_warp_sorts, dense_list = num_warp_sorts + 1, run_list = num_warp_sorts + 2,
                         num_lists = num_warp_sorts + 3;
    fragment_run* voxels[num_warp_sorts + 2]; // for warps; for blocks; dense ones
    voxel_run* runs;
    std::uint32_t num_primitives = 0; // if a voxel of the call may be dense; otherwise 0
    unsigned int* counts;             // of all lists; zero before
    unsigned long long* longest_run;  // of the voxels; zero before

    [[nodiscard]] static order_lists take(arena& memory, std::uint64_t capacity) {
        order_lists w{};
        for (int k = 0; k < num_lists - 1; ++k) w.voxels[k] = memory.take<fragment_run>(capacity / (max_below(k) + 1));
        w.runs = memory.take<voxel_run>(2 * (capacity / tuning::max_of_block)); // each voxel's last run may be short
        return w;
    }
    // Sets the pointers to the counters.
    [[nodiscard]] order_lists with(pipeline_state* state) const {
        static_assert(sizeof(state->num_ordered) == num_lists * sizeof(*counts));
        order_lists w = *this;
        w.counts = state->num_ordered;
        w.longest_run = &state->longest_run;
        return w;
    }
    // The most fragments of a voxel that is too small for list k.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint32_t max_below(int k) {
        return k == 0 ? tuning::max_of_window : k == 1 ? 32 * 16 : k == 2 ? max_of_warp : tuning::max_of_block;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint32_t dense_parts() const { // per voxel
        return (num_primitives + tuning::dense_part - 1) / tuning::dense_part;
    }
    // The list of a voxel that is neither divided into runs nor dense, or -1.
    [[nodiscard]] VOXELPIPE_HD static constexpr int list_of(unsigned long long length) {
        return length > tuning::max_of_block || length <= tuning::max_of_window ? -1
               : length > max_below(2)                                          ? 2
               : length > max_below(1)                                          ? 1
                                                                                : 0;
    }
    // Stores a voxel in a slot that was reserved for it in list_of(length).
    __device__ VOXELPIPE_INLINE void add(unsigned at, unsigned long long begin, unsigned long long length) const {
#pragma unroll
        for (int k = 0; k <= block_list; ++k) // an index that is not constant would put the pointers into local memory
            if (list_of(length) == k) voxels[k][at] = {begin, length};
    }
    // Appends a voxel that begins at `begin` to its list. One thread calls it.
    __device__ void push(unsigned long long begin, unsigned long long length) const {
        const bool is_dense =
            length > tuning::max_of_block && num_primitives != 0 && length >= num_primitives / tuning::min_dense;
        if (is_dense) {
            atomicMax(longest_run, static_cast<unsigned long long>(only_dense));
            voxels[dense_list][atomicAdd(&counts[dense_list], 1u)] = {begin, length};
            return;
        }
        if (length > tuning::max_of_block) {
            atomicMax(longest_run, length > only_dense ? length : only_dense + 1);
            const auto entries = static_cast<unsigned>((length + tuning::max_of_block - 1) / tuning::max_of_block);
            const unsigned at = atomicAdd(&counts[run_list], entries);
            for (unsigned k = 0; k < entries; ++k) {
                const unsigned long long from = std::uint64_t{k} * tuning::max_of_block, rest = length - from;
                runs[at + k] = {{begin + from, rest < tuning::max_of_block ? rest : tuning::max_of_block},
                                {begin, length}};
            }
            return;
        }
        static_assert(block_list == 2);
        add(atomicAdd(&counts[list_of(length)], 1u), begin, length);
    }
};

// Output arrays of lists: the voxels, ascending, in either of two types; the offset of each voxel's first fragment, and
// one more element with the number of fragments; the primitives by voxel; payloads. Voxels beyond `voxel_capacity` are
// counted, not written.
struct csr_pointers {
    std::uint64_t* voxels = nullptr; // or
    std::uint32_t* narrow_voxels = nullptr;
    std::uint64_t* offsets = nullptr;
    std::uint64_t voxel_capacity = 0;
    std::uint32_t* primitives = nullptr;
    void* payloads = nullptr;
};

// Output pointers of a call; null if the lists stay in the call's memory. With a page, which the device can read, the
// pointers are read from it when the call runs, so that a call kept as a graph finds new arrays.
struct output_pointers {
    csr_pointers value;
    const csr_pointers* page = nullptr;
};

// Number of voxels that begin in each tile of windows, published for later tiles: one word each, zero before.
struct tile_counts {
    static constexpr std::uint32_t length = tuning::order_warps * tuning::window_length; // fragments of a tile
    unsigned long long* words;

    [[nodiscard]] VOXELPIPE_HD static std::uint64_t num(std::uint64_t capacity) {
        return (capacity + length - 1) / length;
    }
};

// Memory of a counting sort (fragments/counting_sort.cuh), which replaces sort_memory.
struct counting_memory {
    static constexpr std::uint32_t tile = tuning::counting_tile; // voxels

    std::uint64_t num_voxels = 0;     // of the grid, rounded up to whole tiles; 0 if there is no counting sort
    std::uint64_t capacity = 0;       // fragments
    std::uint32_t* counts = nullptr;  // of each voxel; then the offset of its first fragment. Zero before
    std::uint32_t* numbers = nullptr; // of each fragment within its voxel
    std::uint32_t* starts = nullptr; // one bit per offset at which a voxel begins, and one behind the last. Zero before
    unsigned long long* tiles = nullptr; // words that tiles of voxels publish. Zero before

    // True if up to `capacity` fragments of a grid can be sorted by counting, with few counters per fragment.
    [[nodiscard]] static bool suits(std::uint64_t num_voxels, std::uint64_t capacity) {
        return num_voxels <= tuning::max_counted_voxels && num_voxels <= 8 * capacity && capacity < max_sorted;
    }
    [[nodiscard]] static counting_memory take(arena& memory, std::uint64_t capacity, std::uint64_t num_voxels) {
        counting_memory m{};
        m.num_voxels = (num_voxels + tile - 1) / tile * tile;
        m.capacity = capacity;
        m.counts = memory.take<std::uint32_t>(m.num_voxels);
        m.numbers = memory.take<std::uint32_t>(capacity);
        m.starts = memory.take<std::uint32_t>(m.num_starts());
        m.tiles = memory.take<unsigned long long>(m.num_tiles());
        return m;
    }
    [[nodiscard]] VOXELPIPE_HD bool is_used() const { return num_voxels != 0; }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_tiles() const { return num_voxels / tile; }
    // Words of `starts`: windows read beyond the last fragment.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_starts() const { return (capacity / 1024 + 3) * 32; }
    // Zeros what must be zero before. All threads of a launch call it.
    __device__ void zero(std::uint64_t thread, std::uint64_t threads) const {
        for (std::uint64_t i = thread; i < num_voxels / 4; i += threads) reinterpret_cast<uint4*>(counts)[i] = {};
        for (std::uint64_t i = thread; i < num_starts() / 4; i += threads) reinterpret_cast<uint4*>(starts)[i] = {};
        for (std::uint64_t i = thread; i < num_tiles(); i += threads) tiles[i] = 0;
    }
};

// Work that the sort and the order of a call's fragments need before they begin. The raster that lists the fragments
// does it on its way: zeroing, and reading the output pointers from the page.
struct sort_preparation {
    bool is_wanted = false;
    bool sorts = false;         // sort_fragments will run, unless
    counting_memory counting{}; // this is in use: then the counting sort
    sort_memory sort{};
    std::uint64_t capacity = 0;       // fragments
    tile_counts tiles{};              // may be empty
    csr_pointers* pointers = nullptr; // may be null
    output_pointers outputs;

    // All threads of a launch call it.
    __device__ VOXELPIPE_INLINE void run(std::uint64_t thread, std::uint64_t threads) const {
        if (pointers != nullptr && thread == 0) *pointers = outputs.page != nullptr ? *outputs.page : outputs.value;
        if (tiles.words != nullptr)
            for (std::uint64_t i = thread; i < tile_counts::num(capacity); i += threads) tiles.words[i] = 0;
        if (counting.is_used())
            counting.zero(thread, threads);
        else if (sorts)
            sort.zero(capacity, thread, threads);
    }
};

// Memory for the order of up to `capacity` fragments.
struct order_memory {
    tile_counts tiles;
    order_lists lists;

    [[nodiscard]] static order_memory take(arena& memory, std::uint64_t capacity) {
        order_memory m{};
        m.tiles.words = memory.take<unsigned long long>(tile_counts::num(capacity));
        m.lists = order_lists::take(memory, capacity);
        return m;
    }
};

// Arrays of the fragment order. keys: the voxels of the fragments, ascending; null if a counting sort has listed the
// voxels, which then made `starts`. from: their primitives, in any order within a voxel; overwritten. spare: room for
// as many; may alias keys. The lists go to the pointers *outputs, which lie in device memory, or to `here` if these are
// null.
struct order_buffers {
    const std::uint32_t* keys;
    std::uint32_t* from;
    std::uint32_t* spare;
    const csr_pointers* outputs;
    csr_pointers here;
    tile_counts tiles;
    order_lists lists;
    int primitive_bits = 32; // of the largest primitive
    const std::uint32_t* starts = nullptr;

    [[nodiscard]] __device__ VOXELPIPE_INLINE const csr_pointers& pointers() const {
        return outputs->voxels != nullptr ? *outputs : here;
    }
};

} // namespace voxelpipe::device
