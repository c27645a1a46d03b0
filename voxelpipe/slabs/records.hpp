// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A record is a triangle by itself, on its way to the slabs that it reaches: positions and varyings as the vertex
// shader gave them, and its number in the whole mesh. Records are made of meshes in host memory, and become the mesh of
// a slab.

#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe::slabs {

// 40 bytes, and the varyings.
template <class Varyings>
struct record {
    glm::vec3 positions[3]; // world space
    std::uint32_t number;   // of the triangle in the whole mesh
    Varyings varyings[3];   // of its vertices
};
template <class Varyings>
requires(std::is_empty_v<Varyings>) struct record<Varyings> {
    glm::vec3 positions[3];
    std::uint32_t number;
};

namespace detail {

// The vertex shader of a slab: gives back what the stream's vertex shader gave.
template <class Varyings>
struct stored_vertices {
    template <class Vertex>
    VOXELPIPE_HD vertex_output<Varyings> operator()(const Vertex& v) const {
        return {v.position, voxelpipe::get<0>(v)};
    }
};

// The fragment shader of a slab: the user's, with the numbers of the whole mesh. Constants need none.
template <class Shader>
struct numbered_shader {
    Shader shader;
    const std::uint32_t* numbers; // by triangle of the slab, in the backend's memory

    VOXELPIPE_ANY_CALLABLE
    template <class V>
    VOXELPIPE_HD auto operator()(const fragment<V>& drawn) const {
        fragment<V> f = drawn;
        f.triangle = f.primitive = numbers[drawn.triangle];
        return shader(f);
    }
};
// The same for the lists that a slab gave. Triangles keep their order, so that lists stay sorted.
struct renumber_list {
    std::uint32_t* primitives;
    const std::uint32_t* numbers;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { primitives[i] = numbers[primitives[i]]; }
};

template <class Varyings>
struct slab_mesh {
    using view = mesh_view<Varyings>;
    using vertex_shader = stored_vertices<Varyings>;
};
template <class Varyings>
requires(std::is_empty_v<Varyings>) struct slab_mesh<Varyings> {
    using view = mesh_view<>;
    using vertex_shader = passthrough;
};

} // namespace detail

// Shades the vertices of a chunk and calls visit(record, reach) for each triangle that may touch the grid, in order.
// Adds all triangles to `counts`. Triangle i has the number first_number + i, or + part.numbers[i] of a subset.
template <class Varyings, class... Attributes, class VertexShader, class Visit>
[[nodiscard]] status for_each_record(const mesh_view<Attributes...>& chunk, const VertexShader& shader, const grid& g,
                                     coverage rule, bool is_solid, std::uint64_t first_number, counters& counts,
                                     Visit&& visit) {
    using plain = voxelpipe::draw<mesh_view<Attributes...>, VertexShader, constant_output<bool>>;
    const plain d{chunk, shader, {}};
    if (const status s = core::validate_draws(std::span<const plain>(&d, 1)); !s.ok()) return s;
    if (chunk.copies.count != 1) return core::failure(status_code::bad_subset);
    const auto num_vertices = static_cast<std::uint32_t>(chunk.positions.size());
    std::vector<vertex_output<Varyings>> vertices(num_vertices);
    for (std::uint32_t i = 0; i < num_vertices; ++i) {
        const auto result = shader(core::fetch_vertex(chunk, i, 0, 0));
        vertices[i] = core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result);
    }
    const core::snap_transform snap = core::make_snap_transform(g);
    for (std::size_t i = 0; i < chunk.triangles.size(); ++i) {
        const glm::uvec3 t = chunk.triangles[i];
        if (t.x >= num_vertices || t.y >= num_vertices || t.z >= num_vertices) {
            status s = core::failure(status_code::index_out_of_range);
            s.draw = 0;
            s.triangle = static_cast<std::uint32_t>(i);
            return s;
        }
        const std::uint64_t number = first_number + (chunk.part.whole != 0 ? chunk.part.numbers[i] : i);
        if (number >= std::numeric_limits<std::uint32_t>::max()) return core::failure(status_code::too_many_triangles);
        record<Varyings> r;
        for (int k = 0; k < 3; ++k) {
            r.positions[k] = vertices[t[k]].position;
            if constexpr (!std::is_empty_v<Varyings>) r.varyings[k] = vertices[t[k]].varyings;
        }
        r.number = static_cast<std::uint32_t>(number);
        const classified c = classify(snap, g.extent, rule, r.positions[0], r.positions[1], r.positions[2], is_solid);
        core::count_class(counts, c.kind);
        if (c.kind == core::triangle_class::drawn) visit(r, c.reach);
    }
    return {};
}

} // namespace voxelpipe::slabs
