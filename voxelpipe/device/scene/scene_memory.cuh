// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Device memory for the draws' geometry and shading, for calls into framebuffers and A-buffers.

#include <voxelpipe/core/numbering.hpp>
#include <voxelpipe/device/scene/vertex_shade.cuh>

#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe::device {

template <class Mesh>
[[nodiscard]] draw_geometry geometry_from(const Mesh& m, const vertex_positions& positions,
                                          std::uint32_t first_primitive) {
    return {core::triangles_of(m), positions, first_primitive, static_cast<std::uint32_t>(m.num_vertices())};
}

template <class Mesh, class VertexShader, class FragmentShader>
struct scene_memory {
    using varyings = typename core::shaded<Mesh, VertexShader>::varyings;
    using scene_type = scene<FragmentShader, varyings>;
    using draw_type = draw<Mesh, VertexShader, FragmentShader>;

    vertex_positions positions;
    varyings* vertex_varyings;
    draw_geometry* geometries; // null if there is one draw
    typename scene_type::shading* shadings;

    scene_memory(arena& memory, std::span<const draw_type> draws) {
        std::size_t vertices = 0;
        for (const auto& d : draws) vertices += d.mesh.num_vertices();
        positions = vertex_positions::take(memory, vertices);
        vertex_varyings = memory.take<varyings>(std::is_empty_v<varyings> ? 0 : vertices);
        geometries = memory.take<draw_geometry>(draws.size() > 1 ? draws.size() : 0);
        shadings = memory.take<typename scene_type::shading>(draws.size() > 1 ? draws.size() : 0);
    }

    // Runs the vertex shaders and returns the scene that the other stages read. arms: see geometry; only for
    // the tiled strategy and fragments that are counted first.
    [[nodiscard]] scene_type shade(std::span<const draw_type> draws, const grid& g, cudaStream_t stream,
                                   core::arm_set arms = core::arm_set::none) const {
        scene_type s{};
        s.geo.arms = arms;
        s.geo.num_draws = static_cast<std::uint32_t>(draws.size());
        s.geo.snap = core::make_snap_transform(g);
        s.geo.extent = g.extent;
        s.normal_factors = core::normal_factors(g);
        s.offset = g.offset;
        std::vector<draw_geometry> geometry_of(draws.size());
        std::vector<core::numbering> numbers = core::make_numberings(draws);
        numbers.resize(draws.size());
        std::size_t vertex = 0;
        std::uint32_t primitive = 0;
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const Mesh& m = draws[d].mesh;
            const vertex_positions of_draw = positions.from(vertex);
            geometry_of[d] = geometry_from(m, of_draw, primitive);
            vertex_shade(m, draws[d].vertex_shader, s.geo.snap, static_cast<std::uint32_t>(d), of_draw,
                         varyings_at(vertex), stream);
            vertex += m.num_vertices();
            primitive += static_cast<std::uint32_t>(m.num_triangles());
        }
        s.geo.num_primitives = primitive;
        s.geo.one = geometry_of[0];
        s.one = {draws[0].fragment_shader, varyings_at(0), numbers[0]};
        if (draws.size() > 1) {
            upload(
                geometries, draws.size(), [&](std::size_t d) { return geometry_of[d]; }, stream);
            std::size_t first = 0;
            upload(
                shadings, draws.size(),
                [&](std::size_t d) {
                    const typename scene_type::shading one{draws[d].fragment_shader, varyings_at(first), numbers[d]};
                    first += draws[d].mesh.num_vertices();
                    return one;
                },
                stream);
            s.geo.many = geometries;
            s.many = shadings;
        }
        return s;
    }

private:
    [[nodiscard]] varyings* varyings_at(std::size_t vertex) const {
        return std::is_empty_v<varyings> ? nullptr : vertex_varyings + vertex;
    }
};

[[nodiscard]] inline std::uint64_t num_voxels(const grid& g) {
    return static_cast<std::uint64_t>(g.extent.x) * static_cast<std::uint64_t>(g.extent.y) *
           static_cast<std::uint64_t>(g.extent.z);
}

// Vertex shaders that cost no more than reading their result: they run once per corner instead of once per vertex.
template <class VertexShader>
inline constexpr bool is_cheap = std::is_same_v<VertexShader, passthrough> || std::is_same_v<VertexShader, transform>;

} // namespace voxelpipe::device
