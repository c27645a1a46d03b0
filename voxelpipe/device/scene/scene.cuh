// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The scene as kernels see it. geometry: triangles and snapped positions, which is all that the coarse stages read.
// scene: geometry with the draws' shaders and varyings.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/numbering.hpp>
#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/device/base/call_state.cuh>
#include <voxelpipe/device/base/launch.cuh>
#include <voxelpipe/device/base/memory.cuh>
#include <voxelpipe/device/base/warp.cuh>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/mesh.hpp>
#include <voxelpipe/shader.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// A snapped position in 32 bits, valid if it is at most 2^30 units from the first voxel of the computed part. One
// 16-byte load instead of three of 8.
struct __align__(16) int32_position {
    std::int32_t q[3];
    std::uint32_t fits_int32; // 0 if q is not valid

    [[nodiscard]] VOXELPIPE_HD static int32_position of(const core::snapped_position& p) {
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        const bool fits =
            p.x <= limit && p.x >= -limit && p.y <= limit && p.y >= -limit && p.z <= limit && p.z >= -limit;
        return {{static_cast<std::int32_t>(p.x), static_cast<std::int32_t>(p.y), static_cast<std::int32_t>(p.z)}, fits};
    }
};
// The output positions of vertex_shade, in both forms.
struct vertex_positions {
    core::snapped_position* exact;
    int32_position* int32;

    [[nodiscard]] static vertex_positions take(arena& memory, std::size_t num_vertices) {
        core::snapped_position* const exact = memory.take<core::snapped_position>(num_vertices);
        return {exact, memory.take<int32_position>(num_vertices)};
    }
    // The positions from this vertex on. Stays null if the arena only adds up bytes.
    [[nodiscard]] vertex_positions from(std::size_t vertex) const {
        return exact == nullptr ? *this : vertex_positions{exact + vertex, int32 + vertex};
    }
};

struct draw_geometry {
    core::instanced_triangles triangles;
    vertex_positions positions;
    std::uint32_t first_primitive, num_vertices; // vertices of all instances

    // The triangle, instance and vertices of a primitive of this draw.
    template <class Triangle>
    VOXELPIPE_HD VOXELPIPE_INLINE void locate(std::uint32_t primitive, Triangle& t) const {
        const std::uint32_t i = primitive - first_primitive;
        const auto at = triangles.find(i);
        t.triangle = at.triangle;
        t.instance = at.instance;
        t.index = triangles[i];
    }
};

struct loaded_triangle {
    std::uint32_t draw, triangle, instance;
    glm::uvec3 index;
    bool index_ok;
    core::snapped_position a, b, c; // unset unless index_ok
};

struct geometry {
    draw_geometry one;         // the draw, if there is only one
    const draw_geometry* many; // otherwise all of them
    std::uint32_t num_draws, num_primitives;
    core::snap_transform snap;
    glm::ivec3 extent;
    core::arm_set arms; // leave out the conservative voxels whose arms a triangle does not meet

    [[nodiscard]] VOXELPIPE_HD const draw_geometry& draw(std::uint32_t d) const {
        return many != nullptr ? many[d] : one;
    }

    [[nodiscard]] VOXELPIPE_HD std::uint32_t find_draw(std::uint32_t primitive) const {
        // Empty draws precede the one that begins at the same primitive.
        return core::bisect_last(0u, num_draws, [&](std::uint32_t d) { return draw(d).first_primitive <= primitive; });
    }

    [[nodiscard]] VOXELPIPE_HD loaded_triangle load(std::uint32_t primitive) const {
        loaded_triangle t;
        t.draw = find_draw(primitive);
        const draw_geometry& d = draw(t.draw);
        d.locate(primitive, t);
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
    const Varyings* varyings; // per vertex; null if there are none
    core::numbering numbers;
};

template <class FragmentShader, class Varyings>
struct scene {
    using varyings = Varyings;
    using shading = draw_shading<FragmentShader, Varyings>;

    geometry geo;
    shading one;
    const shading* many;
    core::triple<double> normal_factors;
    glm::ivec3 offset; // of the computed part in the whole grid

    [[nodiscard]] VOXELPIPE_HD const shading& draw(std::uint32_t d) const { return many != nullptr ? many[d] : one; }
};

// A voxel of the computed part, from its linear number: x fastest, then y, then z.
struct voxel_position {
    int x, y, z;
};
[[nodiscard]] VOXELPIPE_HD inline voxel_position position_of(std::uint32_t voxel, const glm::ivec3& extent) {
    const auto nx = static_cast<std::uint32_t>(extent.x), ny = static_cast<std::uint32_t>(extent.y);
    const std::uint32_t row = voxel / nx, z = row / ny;
    return {static_cast<int>(voxel - row * nx), static_cast<int>(row - z * ny), static_cast<int>(z)};
}

} // namespace voxelpipe::device
