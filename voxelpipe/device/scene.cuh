// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the kernels know of a call: geometry (triangles and snapped positions, all that the coarse stages read), scene
// (geometry with the draws' shaders and varyings), and pipeline_state, the counters and flags of a call in progress.

#include <voxelpipe/core/launch_size.hpp>
#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/device/launch.cuh>
#include <voxelpipe/device/memory.cuh>
#include <voxelpipe/voxelize.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>

namespace voxelpipe::device {

// In global memory, zeroed when a call starts. Totals go on counting past a capacity, so that they say what is needed.
struct pipeline_state {
    unsigned long long nonfinite, too_far, zero_area, outside, drawn;
    unsigned long long fragments, discarded, voxels;
    unsigned long long tile_pairs, tile_records;         // coarse raster
    unsigned long long list_fragments, fragment_records; // A-buffer
    unsigned long long list_voxels;
    unsigned long long filtered, kept; // of listed fragments: those that the shader discards, and all others
    unsigned int index_error;
    unsigned int num_items, num_splits, num_images; // tile split
    unsigned int next_item;                         // fine raster
    unsigned int num_ordered[5];                    // fragment order: order_lists
    unsigned long long longest_run;                 // of those, fragments of a voxel that no block takes
    struct {
        unsigned long long cut, lengths[4];
        unsigned long long set_up; // of what is cut, what all its pieces need
        [[nodiscard]] VOXELPIPE_HD bool are_none() const {
            return (cut | lengths[0] | lengths[1] | lengths[2] | lengths[3]) == 0;
        }
        // How many there are that a first kernel by itself would be left with at its end, or ~0 where some are more
        // than little work for one thread. Thin tiny ones wait for others of their warp only.
        [[nodiscard]] VOXELPIPE_HD unsigned long long left_alone(coverage rule) const {
            if ((cut | lengths[2] | lengths[3]) != 0) return ~0ull;
            return rule == coverage::thin ? lengths[1] : lengths[0] + lengths[1];
        }
    } handed_on; // direct raster, of one draw: triangle_lists

    // See capacities: 0 where the windows put all voxels in order, 1 where a block takes the longest that they leave.
    [[nodiscard]] VOXELPIPE_HD unsigned long long longest_ordered() const {
        return longest_run != 0 ? longest_run : (num_ordered[0] | num_ordered[1] | num_ordered[2]) != 0 ? 1 : 0;
    }
};

// How many elements the arrays of a call have. What does not fit is counted, not written.
struct capacities {
    unsigned long long tile_pairs, tile_records, fragments, fragment_records;
    // What a call is launched without, for the one before it hardly needed that: kernels for voxels of more fragments,
    // and a second kernel of a draw.
    unsigned long long longest_ordered = ~0ull;
    unsigned long long leaves_none = 0; // or 1: the first kernel does it all. As wide as the rest, see call_bytes
};

// Whether triangles were handed on to a kernel that has not been launched.
[[nodiscard]] VOXELPIPE_HD inline bool misses_triangles(const pipeline_state& s, const capacities& c) {
    return c.leaves_none != 0 && !s.handed_on.are_none();
}
// Whether the call must not write anything: a bad index, or something that did not fit.
[[nodiscard]] VOXELPIPE_HD inline bool has_failed(const pipeline_state& s, const capacities& c) {
    return s.index_error != 0 || s.tile_pairs > c.tile_pairs || s.tile_records > c.tile_records ||
           s.list_fragments > c.fragments || s.fragment_records > c.fragment_records ||
           s.longest_ordered() > c.longest_ordered || misses_triangles(s, c);
}

// Writes zeros. A template, as all kernels in headers are.
template <class Word>
__global__ void zero_kernel(Word* memory, std::uint64_t words) {
    await_stream();
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < words;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        memory[i] = {};
}

// A state on its way to the host, in words of which each says that it has arrived: whoever finds `arrived` in all of
// them has the state, in whatever order they came, and sees all that the stream did before. No store waits for another.
template <class State>
struct sent_state {
    static_assert(sizeof(State) % sizeof(std::uint32_t) == 0);
    static constexpr unsigned count = sizeof(State) / sizeof(std::uint32_t);
    static constexpr std::uint64_t arrived = std::uint64_t{1} << 32; // beside 32 bits of the state
    std::uint64_t words[count];
};

// Sends the state to memory that the host sees, and leaves zeros for the next call. One warp.
template <class State>
__global__ void send_state_kernel(State* state, sent_state<State>* to) {
    await_stream();
    using sent = sent_state<State>;
    std::uint32_t words[(sent::count + 31) / 32];
    const auto each = [&](auto&& f) VOXELPIPE_INLINE_LAMBDA {
#pragma unroll
        for (unsigned k = 0; k < (sent::count + 31) / 32; ++k)
            if (const unsigned i = 32 * k + threadIdx.x; i < sent::count) f(words[k], i);
    };
    each([&](std::uint32_t& word, unsigned i) { word = reinterpret_cast<const std::uint32_t*>(state)[i]; });
    __threadfence_system();
    each([&](std::uint32_t& word, unsigned i) {
        *static_cast<volatile std::uint64_t*>(&to->words[i]) = sent::arrived | word;
    });
    each([&](std::uint32_t&, unsigned i) { reinterpret_cast<std::uint32_t*>(state)[i] = 0; });
}

// A snapped position in 32 bits, where it is no further than 2^30 units from the first voxel of what is rasterised. One
// load of 16 bytes, where the position has three of 8.
struct __align__(16) near_position {
    std::int32_t q[3];
    std::uint32_t is_near; // or 0, and then q holds nothing

    [[nodiscard]] VOXELPIPE_HD static near_position of(const core::snapped_position& p) {
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        const bool near =
            p.x <= limit && p.x >= -limit && p.y <= limit && p.y >= -limit && p.z <= limit && p.z >= -limit;
        return {{static_cast<std::int32_t>(p.x), static_cast<std::int32_t>(p.y), static_cast<std::int32_t>(p.z)}, near};
    }
};
// The positions that vertex_shade leaves, in both forms.
struct vertex_positions {
    core::snapped_position* exact;
    near_position* near;

    [[nodiscard]] static vertex_positions take(arena& memory, std::size_t num_vertices) {
        core::snapped_position* const exact = memory.take<core::snapped_position>(num_vertices);
        return {exact, memory.take<near_position>(num_vertices)};
    }
    // Those of a mesh whose first vertex is this one of all. With an arena that only adds up, nothing.
    [[nodiscard]] vertex_positions from(std::size_t vertex) const {
        return exact == nullptr ? *this : vertex_positions{exact + vertex, near + vertex};
    }
};

struct draw_geometry {
    const glm::uvec3* triangles;
    vertex_positions positions;
    std::uint32_t first_primitive, num_vertices;
};

struct loaded_triangle {
    std::uint32_t draw, triangle;
    glm::uvec3 index;
    bool index_ok;
    core::snapped_position a, b, c; // unset where the index is not ok
};

struct geometry {
    draw_geometry one;         // the draw, where there is only one
    const draw_geometry* many; // otherwise all of them
    std::uint32_t num_draws, num_primitives;
    core::snap_transform snap;
    glm::ivec3 extent;

    [[nodiscard]] VOXELPIPE_HD const draw_geometry& draw(std::uint32_t d) const {
        return many != nullptr ? many[d] : one;
    }

    [[nodiscard]] VOXELPIPE_HD std::uint32_t find_draw(std::uint32_t primitive) const {
        std::uint32_t lo = 0,
                      hi = num_draws; // the last draw that begins at or before the primitive; empty draws precede
        while (hi - lo > 1) {
            const std::uint32_t middle = lo + (hi - lo) / 2;
            if (draw(middle).first_primitive <= primitive)
                lo = middle;
            else
                hi = middle;
        }
        return lo;
    }

    [[nodiscard]] VOXELPIPE_HD loaded_triangle load(std::uint32_t primitive) const {
        loaded_triangle t;
        t.draw = find_draw(primitive);
        const draw_geometry& d = draw(t.draw);
        t.triangle = primitive - d.first_primitive;
        t.index = d.triangles[t.triangle];
        t.index_ok = t.index.x < d.num_vertices && t.index.y < d.num_vertices && t.index.z < d.num_vertices;
        if (t.index_ok) {
            t.a = d.positions.exact[t.index.x];
            t.b = d.positions.exact[t.index.y];
            t.c = d.positions.exact[t.index.z];
        }
        return t;
    }

    [[nodiscard]] VOXELPIPE_HD core::voxel_box whole_box() const {
        return {{{0, 0, 0}}, {{extent.x - 1, extent.y - 1, extent.z - 1}}};
    }
};

template <class FragmentShader, class Varyings>
struct draw_shading {
    FragmentShader fragment_shader;
    const Varyings* varyings; // per vertex; null where there are none
};

template <class FragmentShader, class Varyings>
struct scene {
    using varyings = Varyings;
    using fragment_output = std::remove_cvref_t<std::invoke_result_t<const FragmentShader&, const fragment<Varyings>&>>;
    using shading = draw_shading<FragmentShader, Varyings>;

    geometry geo;
    shading one;
    const shading* many;
    core::triple<double> normal_factors;
    glm::ivec3 offset; // of the computed part in the whole grid

    [[nodiscard]] VOXELPIPE_HD const shading& draw(std::uint32_t d) const { return many != nullptr ? many[d] : one; }
};

// A voxel of the computed part, and which one has a number: x first, then y, then z.
struct voxel_place {
    int x, y, z;
};
[[nodiscard]] VOXELPIPE_HD inline voxel_place place_of(std::uint32_t voxel, const glm::ivec3& extent) {
    const auto nx = static_cast<std::uint32_t>(extent.x), ny = static_cast<std::uint32_t>(extent.y);
    const std::uint32_t row = voxel / nx, z = row / ny;
    return {static_cast<int>(voxel - row * nx), static_cast<int>(row - z * ny), static_cast<int>(z)};
}

// ---- launches -------------------------------------------------------------------------------------------------------

inline constexpr int threads_per_block = 256; // of kernels that have no tuning of their own

// A value that all lanes of a warp have, in a way that the compiler knows it: what is read from memory, or follows from
// threadIdx, may differ for all that it can see, and then it lets the lanes of a loop with such a bound run apart for
// good (a __syncwarp within such a loop makes them meet, not stay together). All lanes take part.
__device__ VOXELPIPE_INLINE std::uint32_t uniform(std::uint32_t value) { return __reduce_max_sync(0xffffffffu, value); }
__device__ VOXELPIPE_INLINE unsigned long long uniform(unsigned long long value) {
    return static_cast<unsigned long long>(uniform(static_cast<std::uint32_t>(value >> 32))) << 32 |
           uniform(static_cast<std::uint32_t>(value));
}
__device__ VOXELPIPE_INLINE unsigned warp_in_block() { return uniform(threadIdx.x / 32); }

// Of a kernel with a thread an item.
[[nodiscard]] inline unsigned num_blocks(std::uint64_t items) {
    VOXELPIPE_ASSERT(items <= std::numeric_limits<std::uint32_t>::max()); // validated: see core::most_numbered
    return core::blocks_for_each(static_cast<std::uint32_t>(items), threads_per_block);
}

[[nodiscard]] inline int num_multiprocessors() {
    int device = 0, count = 0;
    check(cudaGetDevice(&device));
    check(cudaDeviceGetAttribute(&count, cudaDevAttrMultiProcessorCount, device));
    return count;
}

// Of the current device: 90 for 9.0.
[[nodiscard]] inline int compute_capability() {
    int device = 0, major = 0, minor = 0;
    check(cudaGetDevice(&device));
    check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    check(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
    return 10 * major + minor;
}

// Blocks of a grid-stride or persistent kernel: enough to fill the device, no more than there is work.
[[nodiscard]] inline unsigned fill_device(std::uint64_t items, unsigned blocks_per_multiprocessor = 8) {
    return core::blocks_to_fill(items, threads_per_block, static_cast<std::uint32_t>(num_multiprocessors()),
                                blocks_per_multiprocessor);
}

// Where a call starts that leaves no zeros for the next: the start of its memory, whole uint4s. By a kernel, for the
// next one can begin early behind a kernel, and not behind cudaMemsetAsync.
inline void zero_memory(void* memory, std::size_t bytes, cudaStream_t stream) {
    launch_behind(zero_kernel<uint4>, fill_device(bytes / sizeof(uint4)), threads_per_block, stream, stage::validate,
                  static_cast<uint4*>(memory), std::uint64_t{bytes / sizeof(uint4)});
}

// Copies a few host values to the device as kernel arguments: no host memory has to outlive the call, and a captured
// graph replays it.
template <class T, int N>
struct argument_chunk {
    T items[N];
};
template <class T, int N>
__global__ void write_chunk(T* to, const __grid_constant__ argument_chunk<T, N> chunk, int count) {
    const int i = static_cast<int>(threadIdx.x);
    if (i < count) to[i] = chunk.items[i];
}

template <class T, class Source>
void upload(T* to, std::size_t count, Source&& source, cudaStream_t stream) {
    constexpr int n = sizeof(T) > 1024 ? 1 : static_cast<int>(3072 / sizeof(T) < 256 ? 3072 / sizeof(T) : 256);
    static_assert(sizeof(T) <= 4000, "voxelpipe: a shader has too much data by value; let it hold a pointer");
    for (std::size_t first = 0; first < count; first += n) {
        argument_chunk<T, n> chunk{};
        const std::size_t part = count - first < n ? count - first : n;
        for (std::size_t i = 0; i < part; ++i) chunk.items[i] = source(first + i);
        write_chunk<T, n><<<1, 256, 0, stream>>>(to + first, chunk, static_cast<int>(part));
        check(cudaGetLastError(), stage::vertex_shade);
    }
}

} // namespace voxelpipe::device
