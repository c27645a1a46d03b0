// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragment lists: raster/raster.cuh with a sink that appends fragments to one list, in any order. One pass: no fragment
// is counted before it is written, and none is shaded. A warp gathers fragments in shared memory and reserves room in
// the list for all of them at once.

#include <voxelpipe/device/fragments/order_memory.cuh>
#include <voxelpipe/device/raster/raster.cuh>
#include <voxelpipe/tuning/tuning_fragments.hpp>

namespace voxelpipe::device {

// Room: fragments that fit a warp's shared memory. FlushAt: number from which on they are written to the list. That
// takes an atomic on a word shared by all warps of the device (see class_queues), so batches should be large; but the
// fragments of 32 triangles should fit in the rest, or they must be emitted twice.
template <class Call, unsigned Capacity, unsigned FlushAt>
struct listing_sink : sink_base<Call> {
    static constexpr bool stages_in_shared = true;
    static constexpr bool merges_equal_voxels = false;
    static constexpr bool splits_long_rows = false; // a lane's row is written by itself, whatever its length
    static constexpr bool takes_warp_rounds = true;
    static constexpr unsigned staging_capacity = Capacity;
    static constexpr unsigned flush_at = FlushAt;
    struct memory {
        std::uint32_t voxels[staging_capacity], primitives[staging_capacity];
        unsigned n;
    };

    __device__ VOXELPIPE_INLINE listing_sink(const Call& call, unsigned* dropped, memory& m)
        : sink_base<Call>{call, dropped}, m_(m) {
        if (threadIdx.x % 32 == 0) m_.n = 0;
        __syncwarp();
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(const glm::uvec3& index) const {
        const std::uint32_t num = this->call.out.num_vertices;
        const bool ok = index.x < num && index.y < num && index.z < num;
        if (!ok) atomicOr(&this->call.out.state->index_error, bad_index);
        return ok;
    }
    __device__ VOXELPIPE_INLINE void begin(std::uint32_t triangle) {
        primitive_ = this->call.out.first_primitive + triangle;
    }
    __device__ VOXELPIPE_INLINE void drop(core::triangle_class kind) {
        if (!bypasses_staging_) sink_base<Call>::drop(kind); // only once if the triangle is emitted twice
    }
    __device__ VOXELPIPE_INLINE void row(int x0, int y, int z, word mask) {
        if (mask == 0) return;
        write_row(atomicAdd(&m_.n, static_cast<unsigned>(__popc(mask))), voxel(x0, y, z), mask);
    }
    template <class Position>
    __device__ VOXELPIPE_INLINE void voxels(word bits, const Position& position_of) {
        if (bits == 0) return;
        for (unsigned at = atomicAdd(&m_.n, static_cast<unsigned>(__popc(bits))); bits != 0; bits &= bits - 1)
            write(at++, position_of(__ffs(static_cast<int>(bits)) - 1));
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t position(int x, int y, int z) const {
        return voxel(x, y, z);
    }
    __device__ VOXELPIPE_INLINE void emit(std::uint32_t voxel, bool wanted) {
        if (wanted) write(atomicAdd(&m_.n, 1u), voxel);
    }
    __device__ VOXELPIPE_INLINE void emit_line(std::uint32_t first, std::uint32_t step, unsigned count) {
        for (unsigned at = atomicAdd(&m_.n, count), end = at + count; at < end; ++at, first += step) write(at, first);
    }
    // Writes them to the list at once: lanes with a fragment write neighbouring elements.
    template <class IsDone, class Next>
    __device__ VOXELPIPE_INLINE void rounds(std::uint32_t count, IsDone&& is_done, Next&& next) {
        const unsigned all = __reduce_add_sync(0xffffffffu, count), before = (1u << threadIdx.x % 32) - 1;
        if (all == 0) return;
        const unsigned long long first = take(all), rest = remaining_from(first);
        std::uint32_t *const voxels = this->call.out.voxels + first, *const primitives =
                                                                         this->call.out.primitives + first;
        unsigned given = 0;
        for (unsigned lanes = 0; (lanes = __ballot_sync(0xffffffffu, !is_done())) != 0;) {
            if ((lanes & (before + 1)) != 0) {
                const std::uint32_t voxel = next();
                const unsigned at = given + static_cast<unsigned>(__popc(lanes & before));
                if (at < rest) {
                    voxels[at] = voxel;
                    primitives[at] = primitive_;
                }
            }
            given += static_cast<unsigned>(__popc(lanes));
            __syncwarp();
        }
    }
    // Writes up to 31 fragments per lane to the list, distributed over all lanes: of(lane, i) is the voxel of a lane's
    // fragment i. All lanes call it.
    template <class Of>
    __device__ VOXELPIPE_INLINE void distribute(std::uint32_t count, Of&& of) {
        const unsigned begin = sum_before<0, 5>(count), all = __shfl_sync(0xffffffffu, begin + count, 31);
        if (all == 0) return;
        const unsigned long long first = take(all), rest = remaining_from(first);
        std::uint32_t *const voxels = this->call.out.voxels + first, *const primitives =
                                                                         this->call.out.primitives + first;
        for (unsigned given = 0; given < all; given += 32) {
            const unsigned at = given + threadIdx.x % 32, number = at < all ? at : all - 1;
            unsigned lane = 0; // the last lane that begins here or before
#pragma unroll
            for (unsigned step = 16; step != 0; step /= 2)
                lane += __shfl_sync(0xffffffffu, begin, lane + step) <= number ? step : 0;
            const std::uint32_t voxel = of(lane, number - __shfl_sync(0xffffffffu, begin, lane));
            if (at < all && at < rest) {
                voxels[at] = voxel;
                primitives[at] = primitive_;
            }
        }
    }
    // Stages the rows of a round. If there is no room for it, what is staged is written to the list first.
    template <class IsDone, class Next>
    __device__ VOXELPIPE_INLINE void row_rounds(IsDone&& is_done, Next&& next) {
        static_assert(staging_capacity >= 32 * max_long_side);
        for (bool more = !is_done(); __any_sync(0xffffffffu, more); more = !is_done()) {
            word mask = 0;
            std::uint32_t first = 0;
            if (more)
                next([&](int x0, int y, int z, word bits) VOXELPIPE_INLINE_LAMBDA {
                    mask = bits;
                    first = voxel(x0, y, z);
                });
            const auto length = static_cast<unsigned>(__popc(mask));
            unsigned at = sum_before<0, 3>(length);
            if (__any_sync(0xffffffffu, length > 7)) at += sum_before<3, 5>(length);
            const unsigned all = __shfl_sync(0xffffffffu, at + length, 31);
            if (kept_ + all > staging_capacity) {
                __syncwarp();
                flush(kept_);
                kept_ = 0;
                __syncwarp();
            }
            if (mask != 0) {
                first += static_cast<unsigned>(__ffs(static_cast<int>(mask)) - 1); // a run of consecutive voxels
                at += kept_;
                for (const unsigned end = at + length; at < end; ++at, ++first) {
                    m_.voxels[at] = first;
                    m_.primitives[at] = primitive_;
                }
            }
            kept_ += all;
        }
        restart();
    }
    __device__ VOXELPIPE_INLINE void cube(int x, int y, int z, word bits) {
        if (bits == 0) return;
        const std::uint32_t first = voxel(x, y, z), row = voxel(0, 1, 0), slice = voxel(0, 0, 1);
        for (unsigned at = atomicAdd(&m_.n, static_cast<unsigned>(__popc(bits))); bits != 0; bits &= bits - 1) {
            const unsigned i = static_cast<unsigned>(__ffs(static_cast<int>(bits)) - 1);
            write(at++, first + (i & 1u) + ((i & 2u) != 0 ? row : 0) + ((i & 4u) != 0 ? slice : 0));
        }
    }
    __device__ VOXELPIPE_INLINE void slim(int x, int y, int z, const core::slim_rows& rows) {
        const std::uint32_t first = voxel(x, y, z), row = voxel(0, 1, 0), slice = voxel(0, 0, 1);
        const std::uint32_t even = rows.along_y ? row : slice, odd = rows.along_y ? slice : row;
        word bits = rows.bits;
        for (unsigned at = atomicAdd(&m_.n, static_cast<unsigned>(__popc(bits))); bits != 0; bits &= bits - 1) {
            const unsigned i = static_cast<unsigned>(__ffs(static_cast<int>(bits)) - 1);
            write(at++, first + (i & 3u) + ((i & 4u) != 0 ? odd : 0) + i / 8 * even);
        }
    }
    // Call between triangles, by all lanes. Returns true if the shared memory was too small for the fragments since the
    // last call: they have been counted, and must be emitted again, straight to the list.
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool commit() {
        const unsigned n = m_.n;
        __syncwarp();
        if (bypasses_staging_) {
            bypasses_staging_ = false;
            restart();
            return false;
        }
        if (n > staging_capacity) {
            flush(kept_);
            base_ = take(n - kept_);
            kept_ = 0;
            bypasses_staging_ = true;
            restart();
            return true;
        }
        kept_ = n;
        if (n >= flush_at) {
            flush(n);
            kept_ = 0;
            restart();
        }
        return false;
    }
    struct totals {};
    [[nodiscard]] __device__ VOXELPIPE_INLINE totals end() {
        __syncwarp();
        flush(kept_);
        kept_ = 0;
        return {};
    }
    __device__ VOXELPIPE_INLINE void take_over(const totals&) {}
    __device__ void finish(pipeline_state*) { (void)end(); }

private:
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint32_t voxel(int x, int y, int z) const { // modulo 2^32
        const glm::ivec3& e = this->call.in.extent;
        return (static_cast<std::uint32_t>(z) * static_cast<std::uint32_t>(e.y) + static_cast<std::uint32_t>(y)) *
                   static_cast<std::uint32_t>(e.x) +
               static_cast<std::uint32_t>(x);
    }
    __device__ VOXELPIPE_INLINE unsigned write_row(unsigned at, std::uint32_t first, word mask) {
        for (; mask != 0; mask &= mask - 1)
            write(at++, first + static_cast<unsigned>(__ffs(static_cast<int>(mask)) - 1));
        return at;
    }
    __device__ VOXELPIPE_INLINE void write(unsigned at, std::uint32_t voxel) {
        if (!bypasses_staging_) {
            if (at >= staging_capacity) return;
            m_.voxels[at] = voxel;
            m_.primitives[at] = primitive_;
        } else if (base_ + at < this->call.out.capacity) {
            this->call.out.voxels[base_ + at] = voxel;
            this->call.out.primitives[base_ + at] = primitive_;
        }
    }
    // Reserves n elements of the list; beyond its capacity, fragments are only counted.
    [[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long take(unsigned n) const {
        unsigned long long first = 0;
        if (threadIdx.x % 32 == 0)
            first = atomicAdd(&this->call.out.state->list_fragments, static_cast<unsigned long long>(n));
        return __shfl_sync(0xffffffffu, first, 0);
    }
    // Elements that the list has from number `first` on.
    [[nodiscard]] __device__ VOXELPIPE_INLINE unsigned long long remaining_from(unsigned long long first) const {
        const unsigned long long capacity = this->call.out.capacity;
        return first < capacity ? capacity - first : 0;
    }
    __device__ VOXELPIPE_INLINE void flush(unsigned n) const {
        if (n == 0) return;
        const unsigned long long first = take(n);
        for (unsigned i = threadIdx.x % 32; i < n && first + i < this->call.out.capacity; i += 32) {
            this->call.out.voxels[first + i] = m_.voxels[i];
            this->call.out.primitives[first + i] = m_.primitives[i];
        }
    }
    // Prefix sum over the lanes before this one of the bits [Begin, End) of a number below 32.
    template <int Begin, int End>
    [[nodiscard]] __device__ VOXELPIPE_INLINE static unsigned sum_before(unsigned number) {
        const unsigned before = (1u << threadIdx.x % 32) - 1;
        unsigned sum = 0;
#pragma unroll
        for (int b = Begin; b < End; ++b)
            sum += static_cast<unsigned>(__popc(__ballot_sync(0xffffffffu, (number >> b & 1u) != 0) & before)) << b;
        return sum;
    }
    __device__ VOXELPIPE_INLINE void restart() {
        __syncwarp();
        if (threadIdx.x % 32 == 0) m_.n = kept_;
        __syncwarp();
    }

    memory& m_;
    unsigned kept_ = 0;             // staged fragments; later ones belong to this round
    bool bypasses_staging_ = false; // this round is written straight to the list,
    unsigned long long base_ = 0;   // from here on
    std::uint32_t primitive_ = 0;
};

struct list_output {
    // A box of 2 x 2 x 2 voxels has at most eight fragments, four of a
    // thin triangle.
    template <class Call>
    using sink = listing_sink<Call, tuning::staged_fragments,
                              tuning::staged_fragments - 32 * (Call::rule == coverage::thin ? 4 : 8)>;
    template <class Call>
    using deferred_sink = listing_sink<Call, tuning::deferred_staged_fragments, tuning::deferred_flush_at>;
    static constexpr bool defers = true;
    static constexpr bool may_draw_few = true;
    static constexpr bool only_blends = false, only_sets = false;
    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool is_checked() { return false; }

    std::uint32_t* voxels; // by fragment
    std::uint32_t* primitives;
    unsigned long long capacity;
    std::uint32_t num_vertices, first_primitive;
    pipeline_state* state;
    sort_preparation preparation;

    __device__ VOXELPIPE_INLINE void prepare(std::uint64_t thread, std::uint64_t threads) const {
        if (preparation.is_wanted) preparation.run(thread, threads);
    }
};

// True if the raster without tiles serves a draw, whose triangles have at most `most_work_items` work items each.
[[nodiscard]] inline bool is_rastered(std::uint64_t num_triangles, int fraction, glm::ivec3 extent,
                                      std::uint64_t most_work_items) {
    return core::small_voxels(fraction) > 0 && std::max({extent.x, extent.y, extent.z}) <= max_immediate_extent &&
           deferred_triangles::holds(num_triangles, most_work_items);
}
// True if the fragments of a draw can be listed this way.
[[nodiscard]] inline bool is_listable(std::uint64_t num_triangles, int fraction, glm::ivec3 extent) {
    return is_rastered(num_triangles, fraction, extent, max_work_items(extent));
}

// Appends the fragments of a draw to two arrays of limits.fragments elements each, and counts them in the state.
// first_primitive: of the draw. Runs `preparation`, if it is wanted.
template <coverage Rule, class Source>
void list_raster(const raster_input<Source>& in, std::uint32_t num_vertices, std::uint32_t first_primitive,
                 const deferred_triangles& deferred, std::uint32_t* voxels, std::uint32_t* primitives,
                 const sort_preparation& preparation, pipeline_state* state, const capacities& limits,
                 cudaStream_t stream) {
    const raster_call<Rule, Source, list_output> call{
        in, {voxels, primitives, limits.fragments, num_vertices, first_primitive, state, preparation}, deferred};
    launch_raster(call, state, stage::abuffer_emit, stream, false, limits.deferred);
}

} // namespace voxelpipe::device
