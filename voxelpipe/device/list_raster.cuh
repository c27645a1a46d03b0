// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The two passes of work_share.cuh, count and emit, for fragments of a constant shader: small triangles go through
// small_raster.cuh, which knows their fragments without shading any. Larger ones are cut into chunks as before. The
// fragments and their order are those of the other way.

#include <voxelpipe/device/small_raster.cuh>
#include <voxelpipe/device/work_share.cuh>

namespace voxelpipe::device {

// Counts the fragments of every triangle; larger triangles leave records of chunks.
template <class Op>
struct counting_sink {
    static constexpr bool names_triangles = true;
    static constexpr bool takes_mediums = false;

    const geometry& geo;
    const Op& op;
    const share_buffers& b;
    unsigned* dropped; // by triangle_class, of the block
    unsigned* bad;     // of the block: whether an index is none of a vertex
    std::uint32_t triangle = 0, n = 0;
    unsigned fragments = 0;

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool check(std::uint32_t i, const glm::uvec3& index) {
        const bool ok =
            index.x < geo.one.num_vertices && index.y < geo.one.num_vertices && index.z < geo.one.num_vertices;
        if (!ok) {
            *bad = 1;
            none(i);
        }
        return ok;
    }
    __device__ VOXELPIPE_INLINE void begin(std::uint32_t i) {
        triangle = i;
        n = 0;
    }
    __device__ VOXELPIPE_INLINE void row(int, int, int, std::uint32_t mask) {
        n += static_cast<unsigned>(__popc(mask));
    }
    __device__ VOXELPIPE_INLINE void four(int, int, int, const std::uint32_t (&mask)[4], bool) {
        for (int k = 0; k < 4; ++k) n += static_cast<unsigned>(__popc(mask[k]));
    }
    __device__ VOXELPIPE_INLINE void end() {
        b.counts[triangle] = n;
        fragments += n;
    }
    __device__ VOXELPIPE_INLINE void none(std::uint32_t i) { b.counts[i] = 0; }
    __device__ VOXELPIPE_INLINE void drop(core::triangle_class kind) {
        atomicAdd(&dropped[static_cast<int>(kind)], 1u);
    }
    __device__ __noinline__ core::triangle_class big(std::uint32_t i, const glm::uvec3& index) {
        b.counts[i] = 0; // share_count_large adds to it
        const core::snapped_position p = geo.one.positions[index.x], q = geo.one.positions[index.y],
                                     r = geo.one.positions[index.z];
        core::voxel_box reach{};
        const core::triangle_class kind = core::classify<Op::rule>(p, q, r, geo.snap.fraction, geo.whole_box(), reach);
        if (kind != core::triangle_class::drawn) return kind;
        if (Op::rule == coverage::thin && core::has_zero_area(p, q, r)) return core::triangle_class::zero_area;
        const chunk_grid chunks(op.cells(reach), core::dominant_axis(p, q, r, geo.snap.fraction));
        const auto records = static_cast<unsigned long long>(chunks.records());
        const unsigned long long first = atomicAdd(b.num_records, records);
        for (unsigned long long k = 0; k < records && first + k < b.record_capacity; ++k)
            b.records[first + k] = {i, static_cast<std::uint32_t>(k)};
        return kind;
    }
};

// Writes the fragments of every small triangle to their places.
template <class Op>
struct listing_sink {
    static constexpr bool names_triangles = true;
    static constexpr bool takes_mediums = false;

    const geometry& geo;
    const Op& op;
    const share_buffers& b;
    std::uint32_t triangle = 0;
    unsigned long long at = 0;

    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool check(std::uint32_t, const glm::uvec3&) { return true; }
    __device__ VOXELPIPE_INLINE void begin(std::uint32_t i) {
        triangle = i;
        at = b.offsets[i];
    }
    __device__ VOXELPIPE_INLINE void row(int x0, int y, int z, std::uint32_t mask) {
        const std::uint64_t first =
            (static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(geo.extent.y) + static_cast<std::uint64_t>(y)) *
                static_cast<std::uint64_t>(geo.extent.x) +
            static_cast<std::uint64_t>(x0);
        for (; mask != 0; mask &= mask - 1)
            op.store(
                at++, triangle,
                {first + static_cast<unsigned>(__ffs(static_cast<int>(mask)) - 1), {op.s.one.fragment_shader.values}});
    }
    __device__ VOXELPIPE_INLINE void four(int x, int y, int z, const std::uint32_t (&mask)[4], bool along_y) {
#pragma unroll 1
        for (int k = 0; k < 4; ++k)
            if (mask[k] != 0) row(x, y + (k == 2 && along_y ? 1 : k % 2), z + (k == 2 && along_y ? 0 : k / 2), mask[k]);
    }
    __device__ VOXELPIPE_INLINE static void end() {}
    __device__ VOXELPIPE_INLINE static void none(std::uint32_t) {}
    __device__ VOXELPIPE_INLINE static void drop(core::triangle_class) {}
    __device__ VOXELPIPE_INLINE static core::triangle_class big(std::uint32_t, const glm::uvec3&) {
        return core::triangle_class::drawn; // share_emit_large has it
    }
};

template <class Op>
__global__ __launch_bounds__(raster_threads,
                             raster_min_blocks) void list_count_kernel(const __grid_constant__ geometry geo,
                                                                       const __grid_constant__ Op op, share_buffers b,
                                                                       pipeline_state* state) {
    using core::triangle_class;
    constexpr int warps = raster_threads / 32;
    __shared__ warp_queues queues[warps];
    __shared__ int left[3][warps];
    __shared__ unsigned dropped[5], bad;
    if (threadIdx.x < 5) dropped[threadIdx.x] = 0;
    if (threadIdx.x == 0) bad = 0;
    __syncthreads();
    const raster_input<stored_source> in{{geo.one}, geo.num_primitives, geo.snap.fraction, geo.extent};
    counting_sink<Op> sink{geo, op, b, dropped, &bad};
    raster_warp<Op::rule, stored_source, counting_sink<Op>> warp{in, queues[threadIdx.x / 32], sink};
    const unsigned looked_at = warp.run(queues, left);

    const unsigned long long fragments = block_sum(sink.fragments);
    const unsigned long long all = block_sum(threadIdx.x % 32 == 0 ? looked_at : 0);
    if (threadIdx.x != 0) return;
    if (fragments != 0) atomicAdd(b.num_cells, fragments);
    if (bad != 0) atomicOr(&state->index_error, 1u);
    if (!op.counts_triangles) return;
    const auto number = [&](triangle_class kind, unsigned long long* total) {
        const unsigned n = dropped[static_cast<int>(kind)];
        if (n != 0) atomicAdd(total, static_cast<unsigned long long>(n));
        return n;
    };
    const unsigned none =
        number(triangle_class::nonfinite, &state->nonfinite) + number(triangle_class::too_far, &state->too_far) +
        number(triangle_class::zero_area, &state->zero_area) + number(triangle_class::outside, &state->outside);
    if (all != none) atomicAdd(&state->drawn, all - none);
}

template <class Op>
__global__ __launch_bounds__(raster_threads,
                             raster_min_blocks) void list_emit_kernel(const __grid_constant__ geometry geo,
                                                                      const __grid_constant__ Op op, share_buffers b,
                                                                      const pipeline_state* state, capacities limits) {
    constexpr int warps = raster_threads / 32;
    __shared__ warp_queues queues[warps];
    __shared__ int left[3][warps];
    if (has_failed(*state, limits)) return;
    const raster_input<stored_source> in{{geo.one}, geo.num_primitives, geo.snap.fraction, geo.extent};
    listing_sink<Op> sink{geo, op, b};
    raster_warp<Op::rule, stored_source, listing_sink<Op>> warp{in, queues[threadIdx.x / 32], sink};
    (void)warp.run(queues, left);
}

// Whether the fragments of a scene can be listed this way.
[[nodiscard]] inline bool is_listable(const geometry& geo) {
    return geo.num_draws == 1 && core::small_voxels(geo.snap.fraction) > 0;
}

template <class Op>
void list_count(const geometry& geo, const Op& op, const share_buffers& b, pipeline_state* state, void* scan_storage,
                std::size_t scan_bytes, stage where, cudaStream_t stream) {
    list_count_kernel<<<raster_blocks(geo.num_primitives), raster_threads, 0, stream>>>(geo, op, b, state);
    check(cudaGetLastError(), where);
    share_count_rest(geo, op, b, state, scan_storage, scan_bytes, where, stream);
}

template <class Op>
void list_emit(const geometry& geo, const Op& op, const share_buffers& b, const pipeline_state* state,
               const capacities& limits, stage where, cudaStream_t stream) {
    list_emit_kernel<<<raster_blocks(geo.num_primitives), raster_threads, 0, stream>>>(geo, op, b, state, limits);
    check(cudaGetLastError(), where);
    share_emit_rest(geo, op, b, state, limits, where, stream);
}

} // namespace voxelpipe::device
