// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Direct raster: fragments go straight from their triangle into the render targets, without tiles, where the shader is
// constant and every target takes a fragment by one atomic (direct_target.cuh). Coarse raster, sort and tile images
// cost a small triangle more than the few voxels that it touches.
//
// One kernel reads the mesh once and sorts triangles by what they cost: one line of voxels is written at once; small
// ones wait in shared memory until there is a full block of them, the smallest a thread each, larger ones eight lanes
// each; what 32-bit coverage cannot hold goes to a list in global memory, which a second kernel shares out by columns.

#include <voxelpipe/core/small_triangle.hpp>
#include <voxelpipe/device/direct_target.cuh>
#include <voxelpipe/device/scene.cuh>
#include <voxelpipe/device/tile_image.cuh>
#include <voxelpipe/device/wide_path.cuh>
#include <voxelpipe/device/work_share.cuh>

namespace voxelpipe::device {

// ---- triangles ------------------------------------------------------------------------------------------------------

// Snapped vertices of one draw: made by its vertex shader on the spot, where that is cheap and makes no varyings.
template <class Mesh, class VertexShader>
struct shading_source {
    Mesh mesh;
    VertexShader shader;
    core::snap_transform snap;
    std::uint32_t draw;

    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::vec3 shade(std::uint32_t vertex) const {
        const auto result = shader(core::fetch_vertex(mesh, vertex, draw));
        return core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool near_position(std::uint32_t vertex, std::int32_t (&q)[3]) const {
        const glm::vec3 p = shade(vertex);
        return core::snap_near(snap, p.x, p.y, p.z, q);
    }
    [[nodiscard]] __device__ core::snapped_position position(std::uint32_t vertex) const {
        const glm::vec3 p = shade(vertex);
        return core::snap(snap, p.x, p.y, p.z);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 triangle(std::uint32_t i) const { return mesh.triangles[i]; }
};

// The same from the positions that vertex_shade left.
struct stored_source {
    draw_geometry geometry;

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool near_position(std::uint32_t vertex, std::int32_t (&q)[3]) const {
        const core::snapped_position p = geometry.positions[vertex];
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        q[0] = static_cast<std::int32_t>(p.x);
        q[1] = static_cast<std::int32_t>(p.y);
        q[2] = static_cast<std::int32_t>(p.z);
        return p.x <= limit && p.x >= -limit && p.y <= limit && p.y >= -limit && p.z <= limit && p.z >= -limit;
    }
    [[nodiscard]] __device__ core::snapped_position position(std::uint32_t vertex) const {
        return geometry.positions[vertex];
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 triangle(std::uint32_t i) const {
        return geometry.triangles[i];
    }
};

// Triangles that the small path cannot take, in order of arrival, each with the number of its first record of 32
// chunks: a warp finds the triangle of a record by bisection. `next` packs how many triangles and records there are, so
// that one atomic places both.
struct large_list {
    static constexpr int record_bits = 36;
    std::uint32_t* triangles;
    unsigned long long* first_records;
    unsigned long long* next;

    [[nodiscard]] static constexpr bool holds(std::uint64_t triangles, std::uint64_t records_each) {
        return triangles < (std::uint64_t{1} << (64 - record_bits)) &&
               triangles * records_each < (std::uint64_t{1} << record_bits);
    }
    __device__ void push(std::uint32_t triangle, unsigned long long records) const {
        const unsigned long long at = atomicAdd(next, (1ull << record_bits) + records);
        triangles[at >> record_bits] = triangle;
        first_records[at >> record_bits] = at & ((1ull << record_bits) - 1);
    }
};

template <coverage Rule, class Source, class Framebuffer, class Values>
struct direct_call {
    static constexpr coverage rule = Rule;
    Source source;
    std::uint32_t num_triangles;
    int fraction;
    glm::ivec3 extent;
    Framebuffer fb;
    Values values;
    int counting_target; // which target tells first touches, for the voxel counter; -1: none is wanted
    large_list large;
};

// Fragments and first touches of one thread.
struct direct_counts {
    std::uint64_t fragments = 0, voxels = 0;
};

// Fragments in the voxels x0 + i of a row, for the bits i of the mask, into every target.
template <class Call>
__device__ VOXELPIPE_INLINE void blend_into_all(const Call& call, int x0, int y, int z, word mask,
                                                direct_counts& counts) {
    if (mask == 0) return;
    counts.fragments += static_cast<unsigned>(__popc(mask));
    core::for_each_index<targets_of<decltype(call.fb)>::count>([&]<std::size_t K>() {
        const auto& t = voxelpipe::get<K>(call.fb.targets);
        if (t.load == load_operation::off) return;
        counts.voxels +=
            blend_row(t, x0, y, z, mask, voxelpipe::get<K>(call.values), call.counting_target == static_cast<int>(K));
    });
}

// ---- small triangles ------------------------------------------------------------------------------------------------

inline constexpr int direct_threads = 256;
inline constexpr int direct_min_blocks = 3; // per multiprocessor: registers for that many
inline constexpr int thread_cells = 48;     // a bounding box of so many voxels is one thread's work
inline constexpr int line_cells = 4;        // a line of so many voxels is written without waiting
inline constexpr int medium_lanes = 8;      // of a warp, for one larger triangle
inline constexpr int medium_batch = 64;     // triangles

// Triangles that wait, each in a column of words.
template <int Capacity>
struct small_queue {
    std::int32_t p[9][Capacity];
    std::int32_t origin[3][Capacity]; // lowest voxel of the bounding box
    std::uint32_t part[Capacity];     // small_box, 5 bits a number
    int count;

    __device__ VOXELPIPE_INLINE void put(int at, const core::small_triangle& t, const std::int32_t (&lo)[3],
                                         const core::small_box& box) {
        for (int i = 0; i < 9; ++i) p[i][at] = t.p[i / 3][i % 3];
        std::uint32_t packed = 0;
        for (int i = 0; i < 3; ++i) {
            origin[i][at] = lo[i];
            packed |= static_cast<std::uint32_t>(box.lo[i]) << (10 * i) | static_cast<std::uint32_t>(box.hi[i])
                                                                              << (10 * i + 5);
        }
        part[at] = packed;
    }
    __device__ VOXELPIPE_INLINE void get(int at, core::small_triangle& t, std::int32_t (&lo)[3],
                                         core::small_box& box) const {
        for (int i = 0; i < 9; ++i) t.p[i / 3][i % 3] = p[i][at];
        const std::uint32_t packed = part[at];
        for (int i = 0; i < 3; ++i) {
            lo[i] = origin[i][at];
            box.lo[i] = static_cast<int>(packed >> (10 * i) & 31);
            box.hi[i] = static_cast<int>(packed >> (10 * i + 5) & 31);
        }
    }
};

// Places for the threads that want one; all threads of the warp take part.
__device__ VOXELPIPE_INLINE int take_place(bool wanted, int* count) {
    const unsigned who = __ballot_sync(0xffffffffu, wanted);
    const unsigned lane = threadIdx.x % 32;
    int first = 0;
    if (lane == 0 && who != 0) first = atomicAdd(count, __popc(who));
    first = __shfl_sync(0xffffffffu, first, 0);
    return first + __popc(who & ((1u << lane) - 1));
}

// The fragments of a small triangle's rows first, first + step, ...; false where it has no area and is not drawn.
template <class Call>
__device__ VOXELPIPE_INLINE bool raster_small(const Call& call, const core::small_triangle& t,
                                              const std::int32_t (&lo)[3], const core::small_box& box, int first,
                                              int step, direct_counts& counts) {
    if constexpr (Call::rule == coverage::conservative) {
        const core::small_conservative s(t, call.fraction);
        int y = box.lo[1] + first, z = box.lo[2];
        const int rows = box.hi[1] - box.lo[1] + 1;
        for (;; y += step) {
            while (y > box.hi[1]) {
                y -= rows;
                ++z;
            }
            if (z > box.hi[2]) break;
            blend_into_all(call, lo[0] + box.lo[0], lo[1] + y, lo[2] + z, s.row(box.lo[0], box.hi[0], y, z), counts);
        }
    } else {
        const core::triple<std::int64_t> normal = core::small_normal(t);
        const std::int64_t mx = core::magnitude(normal[0]), my = core::magnitude(normal[1]),
                           mz = core::magnitude(normal[2]);
        if ((mx | my | mz) == 0) return false;
        const int axis = mx >= my && mx >= mz ? 0 : my >= mz ? 1 : 2;
        const core::small_thin s(t, normal, axis, call.fraction);
        const auto begin = core::to_uvw(axis, box.lo[0], box.lo[1], box.lo[2]);
        const auto end = core::to_uvw(axis, box.hi[0], box.hi[1], box.hi[2]);
        const int depth = axis == 0 ? call.extent.x : axis == 1 ? call.extent.y : call.extent.z;
        const int lowest = axis == 0 ? lo[0] : axis == 1 ? lo[1] : lo[2];
        for (int v = begin[1] + first; v <= end[1]; v += step)
            s.row(begin[0], end[0], v, [&](int u, int w) {
                if (lowest + w < 0 || lowest + w >= depth) return;
                const auto at = core::to_xyz(axis, u, v, w);
                blend_into_all(call, lo[0] + at[0], lo[1] + at[1], lo[2] + at[2], 1u, counts);
            });
    }
    return true;
}

// ---- large triangles ------------------------------------------------------------------------------------------------

// Columns of a large triangle's box in chunks along x where x is not the dominant axis: neighbours share words of bits.
struct large_chunks {
    int axis;
    core::triple<std::int64_t> lo, hi; // uvw
    std::int64_t per_row;

    VOXELPIPE_HD large_chunks(const core::voxel_box& box, int axis_)
        : axis(axis_), lo(core::to_uvw(axis_, box.lo[0], box.lo[1], box.lo[2])),
          hi(core::to_uvw(axis_, box.hi[0], box.hi[1], box.hi[2])),
          per_row((hi[run()] - lo[run()] + chunk_columns) / chunk_columns) {}

    [[nodiscard]] VOXELPIPE_HD int run() const { return axis == 1 ? 1 : 0; } // x is v where w is y
    [[nodiscard]] VOXELPIPE_HD std::int64_t count() const { return per_row * (hi[1 - run()] - lo[1 - run()] + 1); }
    [[nodiscard]] VOXELPIPE_HD std::int64_t records() const {
        return (count() + chunks_per_record - 1) / chunks_per_record;
    }
    [[nodiscard]] VOXELPIPE_HD core::voxel_box chunk(std::int64_t i) const {
        const std::int64_t across = lo[1 - run()] + i / per_row, along = lo[run()] + i % per_row * chunk_columns;
        const std::int64_t end = along + chunk_columns - 1 < hi[run()] ? along + chunk_columns - 1 : hi[run()];
        const bool v_runs = run() == 1;
        return {core::to_xyz(axis, v_runs ? across : along, v_runs ? along : across, lo[2]),
                core::to_xyz(axis, v_runs ? across : end, v_runs ? end : across, hi[2])};
    }
    // The most records that a triangle can have in a grid.
    [[nodiscard]] static std::uint64_t most_records(glm::ivec3 extent) {
        const auto of = [](std::int64_t along, std::int64_t across) {
            const std::int64_t chunks = (along + chunk_columns - 1) / chunk_columns * across;
            return static_cast<std::uint64_t>((chunks + chunks_per_record - 1) / chunks_per_record);
        };
        const std::uint64_t a = of(extent.x, extent.y), b = of(extent.x, extent.z), c = of(extent.y, extent.z);
        return core::max3(a, b, c);
    }
};

// Decides about a triangle in full width; one that is drawn goes to the list.
template <class Call>
__device__ __noinline__ core::triangle_class push_large(const Call& call, std::uint32_t triangle, glm::uvec3 index) {
    const core::snapped_position a = call.source.position(index.x), b = call.source.position(index.y),
                                 c = call.source.position(index.z);
    const core::voxel_box whole{{{0, 0, 0}}, {{call.extent.x - 1, call.extent.y - 1, call.extent.z - 1}}};
    core::voxel_box reach{};
    core::triangle_class kind = core::classify<Call::rule>(a, b, c, call.fraction, whole, reach);
    if (kind != core::triangle_class::drawn) return kind;
    if (Call::rule == coverage::thin && core::has_zero_area(a, b, c)) return core::triangle_class::zero_area;
    const large_chunks chunks(reach, core::dominant_axis(a, b, c, call.fraction));
    call.large.push(triangle, static_cast<unsigned long long>(chunks.records()));
    return kind;
}

// Rows of bits along x from spans of columns: columns next to each other with one voxel at the same depth become one.
template <class Call>
struct span_writer {
    const Call& call;
    direct_counts& counts;
    int x = 0, y = 0, z = 0; // of the row that waits
    word mask = 0;

    __device__ VOXELPIPE_INLINE void flush() {
        blend_into_all(call, x, y, z, mask, counts);
        mask = 0;
    }
    __device__ VOXELPIPE_INLINE void span(int axis, int u, int v, int w0, int w1) {
        if (axis == 0) {
            for (int at = w0; at <= w1; at += 32) {
                const int n = w1 - at + 1;
                blend_into_all(call, at, u, v, n >= 32 ? ~0u : (1u << n) - 1, counts);
            }
            return;
        }
        for (int w = w0; w <= w1; ++w) {
            const auto p = core::to_xyz(axis, u, v, w);
            if (mask != 0 && p[1] == y && p[2] == z && p[0] - x < 32) {
                mask |= 1u << (p[0] - x);
            } else {
                flush();
                x = p[0];
                y = p[1];
                z = p[2];
                mask = 1;
            }
        }
    }
};

// ---- kernels --------------------------------------------------------------------------------------------------------

// Before anything is written: whether every index is one of a vertex.
template <class Index>
__global__ void check_indices_kernel(const Index* indices, std::uint64_t count, Index num_vertices,
                                     pipeline_state* state) {
    bool bad = false;
    const std::uint64_t thread = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const std::uint64_t threads = std::uint64_t{gridDim.x} * blockDim.x;
    std::uint64_t done = 0;
    if (reinterpret_cast<std::uintptr_t>(indices) % 16 == 0) {
        for (std::uint64_t i = thread; i < count / 4; i += threads) {
            const uint4 v = __ldg(reinterpret_cast<const uint4*>(indices) + i);
            bad = bad || v.x >= num_vertices || v.y >= num_vertices || v.z >= num_vertices || v.w >= num_vertices;
        }
        done = count / 4 * 4;
    }
    for (std::uint64_t i = done + thread; i < count; i += threads) bad = bad || indices[i] >= num_vertices;
    if (__syncthreads_or(static_cast<int>(bad)) != 0 && threadIdx.x == 0) atomicOr(&state->index_error, 1u);
}

template <class Call>
__global__ __launch_bounds__(direct_threads,
                             direct_min_blocks) void direct_raster_kernel(const __grid_constant__ Call call,
                                                                          pipeline_state* state) {
    using core::triangle_class;
    __shared__ small_queue<2 * direct_threads> small;
    __shared__ small_queue<direct_threads + medium_batch> medium;
    if (state->index_error != 0) return;
    if (threadIdx.x == 0) small.count = medium.count = 0;
    __syncthreads();

    direct_counts counts;
    unsigned drawn = 0, nonfinite = 0, too_far = 0, zero_area = 0, outside = 0;
    const auto count_class = [&](triangle_class kind) {
        drawn += static_cast<unsigned>(kind == triangle_class::drawn);
        nonfinite += static_cast<unsigned>(kind == triangle_class::nonfinite);
        too_far += static_cast<unsigned>(kind == triangle_class::too_far);
        zero_area += static_cast<unsigned>(kind == triangle_class::zero_area);
        outside += static_cast<unsigned>(kind == triangle_class::outside);
    };
    const int extent[3] = {call.extent.x, call.extent.y, call.extent.z};
    const int thread = static_cast<int>(threadIdx.x);

    // One thread a triangle: the last `n` that wait, at most one each.
    const auto raster_threads = [&](int n) {
        if (thread < n) {
            core::small_triangle t;
            std::int32_t lo[3];
            core::small_box box;
            small.get(small.count - n + thread, t, lo, box);
            const bool has_area = raster_small(call, t, lo, box, 0, 1, counts);
            if constexpr (Call::rule == coverage::thin)
                count_class(has_area ? triangle_class::drawn : triangle_class::zero_area);
        }
        __syncthreads();
        if (thread == 0) small.count -= n;
        __syncthreads();
    };
    // medium_lanes a triangle.
    const auto raster_lanes = [&](int n) {
        for (int i = thread / medium_lanes; i < n; i += direct_threads / medium_lanes) {
            core::small_triangle t;
            std::int32_t lo[3];
            core::small_box box;
            medium.get(i, t, lo, box);
            const int lane = thread % medium_lanes;
            const bool has_area = raster_small(call, t, lo, box, lane, medium_lanes, counts);
            if (Call::rule == coverage::thin && lane == 0)
                count_class(has_area ? triangle_class::drawn : triangle_class::zero_area);
        }
        __syncthreads();
        if (thread == 0) medium.count = 0;
        __syncthreads();
    };

    const std::uint32_t step = gridDim.x * direct_threads;
    for (std::uint32_t first = blockIdx.x * direct_threads; first < call.num_triangles; first += step) {
        const std::uint32_t i = first + threadIdx.x;
        bool to_small = false, to_medium = false;
        core::small_triangle t;
        std::int32_t lo[3];
        core::small_box box;
        if (i < call.num_triangles) {
            const glm::uvec3 index = call.source.triangle(i);
            const bool near = call.source.near_position(index.x, t.p[0]) & call.source.near_position(index.y, t.p[1]) &
                              call.source.near_position(index.z, t.p[2]);
            bool is_out = false;
            int cells[3], most = 0, wide = 0;
            for (int k = 0; k < 3; ++k) {
                const std::int32_t low = core::min3(t.p[0][k], t.p[1][k], t.p[2][k]);
                const std::int32_t high = core::max3(t.p[0][k], t.p[1][k], t.p[2][k]);
                lo[k] = ((low + (1 << call.fraction) - 1) >> call.fraction) - 1; // ceil - 1: a face touches both sides
                const std::int32_t last = (high >> call.fraction) - lo[k];
                // A thin fragment may lie one voxel beyond the triangle's own depths.
                constexpr int beyond = Call::rule == coverage::thin ? 1 : 0;
                is_out = is_out || lo[k] - beyond >= extent[k] || lo[k] + last + beyond < 0;
                box.lo[k] = lo[k] < 0 ? -lo[k] : 0;
                box.hi[k] = lo[k] + last < extent[k] ? last : extent[k] - 1 - lo[k];
                if (box.lo[k] > box.hi[k]) { // thin, beside the grid: no columns, but maybe depths
                    box.lo[k] = 1;
                    box.hi[k] = 0;
                }
                cells[k] = last + 1;
                most = cells[k] > most ? cells[k] : most;
                wide += static_cast<int>(last != 0);
                const std::int32_t corner = lo[k] << call.fraction;
                for (int v = 0; v < 3; ++v) t.p[v][k] -= corner;
            }
            const bool is_line = Call::rule == coverage::conservative && wide <= 1 && most <= line_cells;
            if (!near || most > core::small_voxels(call.fraction)) {
                count_class(push_large(call, i, index));
            } else if (is_out) {
                count_class(triangle_class::outside);
            } else if (is_line) {
                count_class(triangle_class::drawn);
                const word mask = (2u << (box.hi[0] - box.lo[0])) - 1;
                for (int z = box.lo[2]; z <= box.hi[2]; ++z)
                    for (int y = box.lo[1]; y <= box.hi[1]; ++y)
                        blend_into_all(call, lo[0] + box.lo[0], lo[1] + y, lo[2] + z, mask, counts);
            } else {
                if constexpr (Call::rule == coverage::conservative) {
                    count_class(triangle_class::drawn);
                    to_small = cells[0] * cells[1] * cells[2] <= thread_cells;
                } else {
                    // The column decides, but its depth may lie beyond the bounding box: nothing is cut along w here.
                    to_small =
                        core::max3(cells[0] * cells[1], cells[1] * cells[2], cells[2] * cells[0]) <= thread_cells / 2;
                }
                to_medium = !to_small;
            }
        }
        const int small_place = take_place(to_small, &small.count);
        if (to_small) small.put(small_place, t, lo, box);
        const int medium_place = take_place(to_medium, &medium.count);
        if (to_medium) medium.put(medium_place, t, lo, box);
        __syncthreads();
        const int small_waiting = small.count, medium_waiting = medium.count;
        __syncthreads(); // all have read, before the next batch adds
        if (small_waiting >= direct_threads) raster_threads(direct_threads);
        if (medium_waiting >= medium_batch) raster_lanes(medium_waiting);
    }
    if (const int n = small.count; n > 0) raster_threads(n);
    if (const int n = medium.count; n > 0) raster_lanes(n);

    const auto add = [&](std::uint64_t mine, unsigned long long* total) {
        const unsigned long long sum = block_sum(mine);
        if (threadIdx.x == 0 && sum != 0) atomicAdd(total, sum);
    };
    add(counts.fragments, &state->fragments);
    add(drawn, &state->drawn);
    if (call.counting_target >= 0) add(counts.voxels, &state->voxels);
    if (__syncthreads_or(static_cast<int>((nonfinite | too_far | zero_area | outside) != 0)) != 0) {
        add(nonfinite, &state->nonfinite);
        add(too_far, &state->too_far);
        add(zero_area, &state->zero_area);
        add(outside, &state->outside);
    }
}

template <class Call>
__global__ __launch_bounds__(threads_per_block, 2) void direct_large_kernel(const __grid_constant__ Call call,
                                                                            pipeline_state* state) {
    if (state->index_error != 0) return;
    constexpr auto rule = core::to_rule(Call::rule);
    const unsigned long long packed = *call.large.next;
    const unsigned long long records = packed & ((1ull << large_list::record_bits) - 1);
    const unsigned long long num = packed >> large_list::record_bits;
    const unsigned long long warps = std::uint64_t{gridDim.x} * blockDim.x / 32;
    const unsigned lane = threadIdx.x % 32;
    const core::voxel_box whole{{{0, 0, 0}}, {{call.extent.x - 1, call.extent.y - 1, call.extent.z - 1}}};
    direct_counts counts;
    for (unsigned long long r = (std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x) / 32; r < records; r += warps) {
        unsigned long long lo = 0, hi = num; // the last triangle whose records begin at or before r
        while (hi - lo > 1) {
            const unsigned long long middle = lo + (hi - lo) / 2;
            if (call.large.first_records[middle] <= r)
                lo = middle;
            else
                hi = middle;
        }
        const std::uint64_t chunk = (r - call.large.first_records[lo]) * chunks_per_record + lane;
        const glm::uvec3 index = call.source.triangle(call.large.triangles[lo]);
        const core::snapped_position a = call.source.position(index.x), b = call.source.position(index.y),
                                     c = call.source.position(index.z);
        core::voxel_box reach{};
        (void)core::classify<Call::rule>(a, b, c, call.fraction, whole, reach);
        const int axis = core::dominant_axis(a, b, c, call.fraction);
        const large_chunks chunks(reach, axis);
        if (chunk >= static_cast<std::uint64_t>(chunks.count())) continue;
        const core::voxel_box box = chunks.chunk(static_cast<std::int64_t>(chunk));
        span_writer<Call> writer{call, counts};
        if (core::fits_narrow(a, b, c, call.fraction)) {
            const auto t = core::setup_triangle<rule, std::int64_t>(a, b, c, call.fraction);
            core::for_each_span<rule>(t, box, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
                writer.span(t.axis, static_cast<int>(u), static_cast<int>(v), static_cast<int>(w0),
                            static_cast<int>(w1));
            });
        } else {
            for_each_wide_span<rule>(a, b, c, call.fraction, box,
                                     [&](const wide_span& s) { writer.span(axis, s.u, s.v, s.w_first, s.w_last); });
        }
        writer.flush();
    }
    const unsigned long long fragments = block_sum(counts.fragments);
    if (threadIdx.x == 0 && fragments != 0) atomicAdd(&state->fragments, fragments);
    if (call.counting_target >= 0) {
        const unsigned long long voxels = block_sum(counts.voxels);
        if (threadIdx.x == 0 && voxels != 0) atomicAdd(&state->voxels, voxels);
    }
}

inline void check_indices(const glm::uvec3* triangles, std::uint64_t num_triangles, std::uint64_t num_vertices,
                          pipeline_state* state, cudaStream_t stream) {
    check_indices_kernel<std::uint32_t><<<fill_device(num_triangles), threads_per_block, 0, stream>>>(
        reinterpret_cast<const std::uint32_t*>(triangles), 3 * num_triangles, static_cast<std::uint32_t>(num_vertices),
        state);
    check(cudaGetLastError(), stage::coarse_raster);
}

template <class Call>
void direct_raster(const Call& call, pipeline_state* state, cudaStream_t stream) {
    const auto batches =
        static_cast<unsigned>((std::uint64_t{call.num_triangles} + direct_threads - 1) / direct_threads);
    const unsigned most = static_cast<unsigned>(num_multiprocessors()) * direct_min_blocks;
    const unsigned blocks = batches < most ? batches : most;
    direct_raster_kernel<Call><<<blocks, direct_threads, 0, stream>>>(call, state);
    check(cudaGetLastError(), stage::fine_raster);
    direct_large_kernel<Call>
        <<<static_cast<unsigned>(num_multiprocessors()) * 2, threads_per_block, 0, stream>>>(call, state);
    check(cudaGetLastError(), stage::fine_raster);
}

} // namespace voxelpipe::device
