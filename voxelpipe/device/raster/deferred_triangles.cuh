// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Triangles that one kernel leaves to the next, in one list per size class in global memory. Warps first gather many of
// a class in shared memory, so that neither an atomic nor a store serves a single triangle.

#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/device/raster/size_class.cuh>

#include <algorithm>
#include <bit>
#include <cstdint>

namespace voxelpipe::device {

inline constexpr int num_triangle_classes = 5;

// Adds a block's counts of dropped triangles, by triangle_class, to the state, and returns their sum. One thread calls
// it.
__device__ inline unsigned count_dropped(const unsigned (&dropped)[num_triangle_classes], pipeline_state* state) {
    using core::triangle_class;
    const auto number = [&](triangle_class kind, unsigned long long* total) {
        const unsigned n = dropped[static_cast<int>(kind)];
        if (n != 0) atomicAdd(total, static_cast<unsigned long long>(n));
        return n;
    };
    return number(triangle_class::nonfinite, &state->nonfinite) + number(triangle_class::too_far, &state->too_far) +
           number(triangle_class::zero_area, &state->zero_area) + number(triangle_class::outside, &state->outside);
}
// The same, and counts all other triangles that the warps read as drawn. All threads call it.
__device__ inline void count_looked_at(unsigned looked_at, const unsigned (&dropped)[num_triangle_classes],
                                       pipeline_state* state) {
    const unsigned long long all = block_sum(threadIdx.x % 32 == 0 ? looked_at : 0);
    if (threadIdx.x != 0) return;
    const unsigned none = count_dropped(dropped, state);
    if (all != none) atomicAdd(&state->drawn, all - none);
}

// Encodes the triangles that a warp reads in 16 bits: 32 x round + lane, where the blocks of raster_threads go through
// the mesh round by round. Decoding needs only blockIdx and threadIdx, so no register is held.
struct warp_triangles {
    static constexpr std::uint32_t max_rounds = 1u << 11;
    [[nodiscard]] __device__ VOXELPIPE_INLINE static std::uint32_t of(std::uint32_t code) {
        return of(code, threadIdx.x / 32);
    }
    // A triangle of another warp of the block.
    [[nodiscard]] __device__ VOXELPIPE_INLINE static std::uint32_t of(std::uint32_t code, unsigned warp) {
        return (code / 32 * gridDim.x + blockIdx.x) * tuning::raster_threads + warp * 32 + code % 32;
    }
};

struct deferred_triangles {
    // Two lists share an array, from both ends: a triangle is in one list only.
    std::uint32_t* arrays[size_class::count / 2];
    unsigned long long* lengths; // [size_class::count]
    std::uint32_t capacity;      // of an array

    // Split triangles, each with the number of its first work item: a warp finds the triangle of a work item by
    // bisection. `next` packs the numbers of triangles and work items, so that one atomic reserves both.
    int work_item_bits; // the lowest; those above them number all triangles
    std::uint32_t* split;
    unsigned long long* first_work_items;
    unsigned long long* next;

    // Setups of split triangles (raster/split_setup.cuh), if they are kept: room for num_setups, and how many are
    // ready.
    static constexpr std::size_t setup_bytes = 384;
    std::byte* setups;
    unsigned long long* setups_ready;
    std::uint32_t num_setups;

    // Oversized triangles that a block of the first pass leaves until its end, in a part of the array for each block;
    // not used by outputs whose blocks find them again. Later, if setups are kept: the setup of each work item.
    std::uint32_t* oversized;
    std::uint64_t oversized_capacity;

    [[nodiscard]] static deferred_triangles take(arena& memory, std::size_t num_triangles) {
        deferred_triangles l = take_lists(memory, num_triangles);
        l.take_setups(memory, num_triangles);
        return l;
    }
    // The lists alone, for outputs whose blocks find oversized triangles again: no setups are kept.
    [[nodiscard]] static deferred_triangles take_lists(arena& memory, std::size_t num_triangles) {
        deferred_triangles l{};
        l.work_item_bits = work_item_bits_for(num_triangles);
        for (auto& array : l.arrays) array = memory.take<std::uint32_t>(num_triangles);
        l.capacity = static_cast<std::uint32_t>(num_triangles);
        l.split = memory.take<std::uint32_t>(num_triangles);
        l.first_work_items = memory.take<unsigned long long>(num_triangles);
        return l;
    }
    void take_setups(arena& memory, std::size_t num_triangles) {
        // A block's part holds whole batches of all threads of a persistent kernel.
        const std::size_t threads = std::max(static_cast<std::size_t>(num_multiprocessors()) * 2048,
                                             num_triangles / warp_triangles::max_rounds + tuning::raster_threads);
        oversized_capacity = num_triangles + std::min(threads, num_triangles + 2048);
        oversized = memory.take<std::uint32_t>(oversized_capacity);
        num_setups = static_cast<std::uint32_t>(std::min(num_triangles, tuning::max_setups));
        setups = memory.take<std::byte>(num_setups * setup_bytes);
    }
    // Sets the pointers to the counters, which must be zero.
    [[nodiscard]] deferred_triangles with(pipeline_state* state) const {
        deferred_triangles l = *this;
        l.lengths = state->deferred.lengths;
        l.next = &state->deferred.split;
        l.setups_ready = &state->deferred.setups_ready;
        return l;
    }
    [[nodiscard]] static constexpr int work_item_bits_for(std::uint64_t triangles) {
        return 64 - static_cast<int>(std::bit_width(triangles));
    }
    // Fewer than 2^32 triangles, with fewer than 2^31 work items each.
    [[nodiscard]] static constexpr bool holds(std::uint64_t triangles, std::uint64_t work_items_each) {
        return triangles * work_items_each < (std::uint64_t{1} << work_item_bits_for(triangles));
    }
    __device__ std::uint32_t& at(int size, unsigned long long i) const {
        std::uint32_t* const array = arrays[size / 2];
        return size % 2 == 0 ? array[i] : array[capacity - 1 - i];
    }
    // Appends a triangle of each lane that wants it to a list. All lanes call it.
    __device__ VOXELPIPE_INLINE void push(int size, bool wanted, std::uint32_t triangle) const {
        const unsigned who = __ballot_sync(0xffffffffu, wanted);
        if (who == 0) return;
        const unsigned lane = threadIdx.x % 32;
        unsigned long long first = 0;
        if (lane == 0) first = atomicAdd(&lengths[size], static_cast<unsigned long long>(__popc(who)));
        first = __shfl_sync(0xffffffffu, first, 0);
        if (wanted) at(size, first + static_cast<unsigned>(__popc(who & ((1u << lane) - 1)))) = triangle;
    }
    // Appends a split triangle of each lane that has work items. All lanes call it.
    __device__ void push_split(std::uint32_t triangle, unsigned long long items) const {
        const unsigned lane = threadIdx.x % 32;
        const unsigned long long mine = (items != 0 ? 1ull << work_item_bits : 0) + items;
        unsigned long long sum = mine;
        for (unsigned d = 1; d < 32; d *= 2) {
            const unsigned long long other = __shfl_up_sync(0xffffffffu, sum, d);
            if (lane >= d) sum += other;
        }
        unsigned long long first = 0;
        if (lane == 31 && sum != 0) first = atomicAdd(next, sum);
        const unsigned long long packed = __shfl_sync(0xffffffffu, first, 31) + sum - mine;
        if (items == 0) return;
        const unsigned long long number = packed >> work_item_bits;
        split[number] = triangle;
        first_work_items[number] = packed & ((1ull << work_item_bits) - 1);
    }
};

// Returns the slot of a lane that wants one, behind the `count` that wait, and adds the new ones to count. All lanes
// call it.
__device__ VOXELPIPE_INLINE int take_slot(bool wanted, int& count) {
    const unsigned who = __ballot_sync(0xffffffffu, wanted);
    const int slot = count + __popc(who & ((1u << threadIdx.x % 32) - 1));
    count += __popc(who);
    return slot;
}

// A warp's triangles that wait for their lists, by warp_triangles; the counts are registers with the same value in all
// lanes. All warps of the device add to the same list lengths. An atomic that returns them blocks that part of L2 for
// whatever else lies there: with one per 32 triangles, first passes took some 20 % more or less, depending on where
// state and target lay.
struct class_queues {
    static constexpr int slots = tuning::class_slots, at_once = slots - 32;
    std::uint16_t triangles[size_class::count][slots];
};

struct class_writer {
    const deferred_triangles& lists;
    class_queues& queues;
    int waiting[size_class::count] = {};

    // Queues the triangle of every lane whose size class is not negative. All lanes call it.
    __device__ VOXELPIPE_INLINE void push(int size, std::uint32_t code) {
        const unsigned classes = __reduce_or_sync(0xffffffffu, size < 0 ? 0 : 1u << size); // mostly one or two
        for (int k = 0; k < size_class::count; ++k) {
            if ((classes >> k & 1u) == 0) continue;
            const int slot = take_slot(size == k, waiting[k]);
            if (size == k) queues.triangles[k][slot] = static_cast<std::uint16_t>(code);
            if (waiting[k] < class_queues::at_once) continue;
            __syncwarp();
            waiting[k] -= class_queues::at_once;
            write(k, take(k, class_queues::at_once), waiting[k], class_queues::at_once);
            __syncwarp();
        }
    }
    // Stores how much waits in the warp's queues to shared memory, for the whole block, which must synchronise next.
    // All threads call it.
    template <int Warps>
    __device__ VOXELPIPE_INLINE void note(unsigned (&slots)[size_class::count][Warps]) const {
        if (threadIdx.x % 32 == 0)
            for (int k = 0; k < size_class::count; ++k) slots[k][threadIdx.x / 32] = static_cast<unsigned>(waiting[k]);
    }
    // Number of triangles that wait in the block, or at least `many` if some of them are large. Synchronises the block.
    static constexpr int many = 32;
    [[nodiscard]] __device__ VOXELPIPE_INLINE int count() const {
        const bool has_large = (waiting[size_class::thread_heavy] | waiting[size_class::warp_group]) != 0;
        const int lane = static_cast<int>(threadIdx.x) % 32,
                  small = waiting[size_class::tiny] + waiting[size_class::thread];
        return __syncthreads_count(has_large || lane < small);
    }
    // Appends the queued triangles to the lists. The block reserves room for all of its warps at once. All threads call
    // it.
    template <int Warps>
    __device__ VOXELPIPE_INLINE void finish(unsigned (&slots)[size_class::count][Warps]) {
        const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
        for (int k = static_cast<int>(warp); k < size_class::count; k += Warps) {
            unsigned n = 0, before = 0;
            for (unsigned w = 0; w < Warps; ++w) {
                before += w < lane ? slots[k][w] : 0;
                n += slots[k][w];
            }
            if (n == 0) continue;
            __syncwarp();
            const auto first = static_cast<unsigned>(take(k, n)); // fewer than 2^32 exist
            if (lane < Warps) slots[k][lane] = first + before;
        }
        __syncthreads();
        for (int k = 0; k < size_class::count; ++k)
            if (waiting[k] != 0) write(k, slots[k][warp], 0, waiting[k]);
    }

private:
    // Stores n queued triangles of a class, from `at` on, to slots `first` and on of its list.
    __device__ VOXELPIPE_INLINE void write(int size, unsigned long long first, int at, int n) const {
#pragma unroll 1
        for (int i = static_cast<int>(threadIdx.x) % 32; i < n; i += 32)
            lists.at(size, first + static_cast<unsigned>(i)) = warp_triangles::of(queues.triangles[size][at + i]);
    }
    // Reserves room for n triangles.
    [[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long take(int size, unsigned n) const {
        unsigned long long first = 0;
        if (threadIdx.x % 32 == 0) first = atomicAdd(&lists.lengths[size], static_cast<unsigned long long>(n));
        return __shfl_sync(0xffffffffu, first, 0);
    }
};

} // namespace voxelpipe::device
