// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Loads triangles for a raster without tiles: vertices from the mesh or from vertex_shade, positions in 32 bits if they
// fit, bounding boxes, and prefetching of the next triangles.

#include <voxelpipe/core/instances.hpp>
#include <voxelpipe/core/small_triangle.hpp>
#include <voxelpipe/device/scene/int32_triangle.cuh>
#include <voxelpipe/device/scene/scene.cuh>
#include <voxelpipe/device/scene/vertex_shade.cuh>

#include <cstdint>
#include <cstring>

namespace voxelpipe::device {

// ---- sources of vertices
// ---------------------------------------------------------------------------------------------

// Shades the mesh's vertices when they are loaded: for cheap vertex shaders without varyings, for which all instances
// are equal.
template <class Mesh, class VertexShader>
struct shading_source {
    Mesh mesh;
    VertexShader shader;
    core::snap_transform snap;
    std::uint32_t draw;
    core::remainder_by triangle_of_mesh = core::remainder_by(static_cast<std::uint32_t>(mesh.triangles.size()));

    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::vec3 shade(std::uint32_t vertex) const {
        const auto result = shader(core::fetch_vertex(mesh, vertex, draw));
        return core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
    }
    using loaded = glm::vec3; // a vertex as loaded from memory
    [[nodiscard]] __device__ VOXELPIPE_INLINE loaded load(std::uint32_t vertex) const { return shade(vertex); }
    // Loading in two steps, for shaders that read positions only, as all cheap ones do.
    using stored = glm::vec3;
    [[nodiscard]] __device__ VOXELPIPE_INLINE const stored* address(std::uint32_t vertex) const {
        return mesh.positions.data() + vertex;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE loaded load(const stored& position) const {
        const auto result = shader(voxelpipe::vertex<>{0, draw, position, {}});
        return core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool int32_position(const loaded& p, std::int32_t (&q)[3]) const {
        return core::snap_int32(snap, p.x, p.y, p.z, q);
    }
    [[nodiscard]] __device__ core::snapped_position position(std::uint32_t vertex) const {
        const glm::vec3 p = shade(vertex);
        return core::snap(snap, p.x, p.y, p.z);
    }
    // Without a branch: one kept loads of several triangles from being in flight together, for up to 20 % of a call.
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 triangle(std::uint32_t i) const {
        return mesh.triangles[triangle_of_mesh.of(i)];
    }
};

// Reads the positions that vertex_shade stored.
struct stored_source {
    draw_geometry geometry;

    using loaded = device::int32_position;
    [[nodiscard]] __device__ VOXELPIPE_INLINE loaded load(std::uint32_t vertex) const {
        return geometry.positions.int32[vertex];
    }
    using stored = loaded;
    [[nodiscard]] __device__ VOXELPIPE_INLINE const stored* address(std::uint32_t vertex) const {
        return geometry.positions.int32 + vertex;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static loaded load(const stored& position) { return position; }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool int32_position(const loaded& p, std::int32_t (&q)[3]) const {
        for (int k = 0; k < 3; ++k) q[k] = p.q[k];
        return p.fits_int32 != 0;
    }
    [[nodiscard]] __device__ core::snapped_position position(std::uint32_t vertex) const {
        const device::int32_position p = geometry.positions.int32[vertex];
        return p.fits_int32 != 0 ? core::snapped_position{p.q[0], p.q[1], p.q[2]} : geometry.positions.exact[vertex];
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 triangle(std::uint32_t i) const {
        return geometry.triangles[i];
    }
};

// One draw, as a raster kernel is given it.
template <class Source>
struct raster_input {
    Source source;
    std::uint32_t num_triangles;
    int fraction;
    glm::ivec3 extent;
};
// The vertices of triangle i; zeros beyond the last.
template <class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE glm::uvec3 load_index(const raster_input<Source>& in, std::uint32_t i) {
    return i < in.num_triangles ? in.source.triangle(i) : glm::uvec3(0);
}

// ---- triangles in 32 bits
// --------------------------------------------------------------------------------------------

template <class Source>
struct loaded_corners {
    typename Source::loaded of[3];
};
template <class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE loaded_corners<Source> load_corners(const raster_input<Source>& call,
                                                                              const glm::uvec3& index) {
    return {{call.source.load(index.x), call.source.load(index.y), call.source.load(index.z)}};
}
template <class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE int32_triangle make_int32_triangle(const raster_input<Source>& call,
                                                                             const loaded_corners<Source>& corners) {
    int32_triangle r;
    r.fits_int32 = call.source.int32_position(corners.of[0], r.q[0]) &
                   call.source.int32_position(corners.of[1], r.q[1]) &
                   call.source.int32_position(corners.of[2], r.q[2]);
    r.find_box(call.fraction);
    return r;
}
template <class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE int32_triangle load_int32(const raster_input<Source>& call,
                                                                    const glm::uvec3& index) {
    return make_int32_triangle(call, load_corners(call, index));
}

// Copy a word, or four if both addresses are multiples of 16 bytes, to an address in shared memory, asynchronously and
// through no register. await_copies waits for the thread's own copies.
__device__ VOXELPIPE_INLINE void copy_word(std::uint32_t to, const std::uint32_t* from) {
    asm volatile("cp.async.ca.shared.global [%0], [%1], 4;" ::"r"(to), "l"(__cvta_generic_to_global(from)) : "memory");
}
__device__ VOXELPIPE_INLINE void copy_four_words(std::uint32_t to, const uint4* from) {
    asm volatile("cp.async.cg.shared.global [%0], [%1], 16;" ::"r"(to), "l"(__cvta_generic_to_global(from)) : "memory");
}
__device__ VOXELPIPE_INLINE void await_copies() { asm volatile("cp.async.wait_all;" ::: "memory"); }

// Prefetches the corners of a warp's next triangles into shared memory, while the previous ones are drawn: there are
// too few registers to hold them so long. Each lane has its own column of words, so no lane waits for another.
template <class Source>
struct next_corners {
    using stored = typename Source::stored;
    static constexpr std::uint32_t words_each = sizeof(stored) / sizeof(std::uint32_t);
    static_assert(sizeof(stored) % sizeof(std::uint32_t) == 0);
    std::uint32_t words[3 * words_each][32];

    __device__ VOXELPIPE_INLINE void fetch(const Source& source, const glm::uvec3& index) {
        const auto to = static_cast<std::uint32_t>(__cvta_generic_to_shared(words[0] + threadIdx.x % 32));
#pragma unroll
        for (std::uint32_t v = 0; v < 3; ++v) {
            const auto* const from = reinterpret_cast<const std::uint32_t*>(source.address(v == 0   ? index.x
                                                                                           : v == 1 ? index.y
                                                                                                    : index.z));
#pragma unroll
            for (std::uint32_t k = 0; k < words_each; ++k) copy_word(to + 128 * (v * words_each + k), from + k);
        }
    }
    // The corners that were fetched last.
    [[nodiscard]] __device__ VOXELPIPE_INLINE int32_triangle take(const raster_input<Source>& call) const {
        await_copies();
        loaded_corners<Source> corners;
#pragma unroll
        for (std::uint32_t v = 0; v < 3; ++v) {
            std::uint32_t mine[words_each];
#pragma unroll
            for (std::uint32_t k = 0; k < words_each; ++k) mine[k] = words[v * words_each + k][threadIdx.x % 32];
            stored position;
            memcpy(&position, mine, sizeof(position));
            corners.of[v] = call.source.load(position);
        }
        return make_int32_triangle(call, corners);
    }
};

} // namespace voxelpipe::device
