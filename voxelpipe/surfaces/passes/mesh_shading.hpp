// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fragments of the triangles of a gathered mesh at points of theirs, and the draws' shaders for them. For passes of a
// backend's for_each.

#include <voxelpipe/core/interpolate.hpp>
#include <voxelpipe/core/numbering.hpp>
#include <voxelpipe/distance/core/point_triangle.hpp>
#include <voxelpipe/surfaces/passes/gather_mesh.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe::core {

namespace passes {

// Varyings of vertex i of all instances of a mesh.
template <class Mesh, class VertexShader, class Varyings>
struct shade_vertices {
    Mesh mesh;
    VertexShader shader;
    std::uint32_t draw;
    Varyings* varyings;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto each = static_cast<std::uint64_t>(mesh.positions.size());
        const auto result = shader(
            fetch_vertex(mesh, static_cast<std::uint32_t>(i % each), draw, static_cast<std::uint32_t>(i / each)));
        varyings[i] = vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).varyings;
    }
};
// Names of primitives, to be sorted.
struct list_primitives {
    const std::uint32_t* primitives;
    std::uint64_t* keys;
    std::uint32_t* triangles;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        keys[i] = primitives[i];
        triangles[i] = static_cast<std::uint32_t>(i);
    }
};

// What the fragments of a draw need.
template <class Shader>
struct shaded_draw {
    Shader shader;
    numbering numbers;   // `whole` is set
    std::uint64_t first; // its first triangle of the gathered mesh
    std::uint32_t each;  // triangles of an instance
};

template <class Shader, class Varyings>
struct mesh_shading {
    mesh_triangles mesh;
    const Varyings* varyings; // of the gathered mesh's vertices; null where they are empty
    const shaded_draw<Shader>* draws;
    std::uint32_t num_draws;
    const std::uint64_t* sorted_primitives;   // null: the primitives are the triangles' numbers
    const std::uint32_t* triangles_by_number; // of these
    triple<double> normal_factors;
    int fraction;
    glm::ivec3 offset; // of the computed part in the whole grid of samples

    // Number of a primitive's triangle.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t triangle_of(std::uint32_t primitive) const {
        if (sorted_primitives == nullptr) return primitive;
        return triangles_by_number[count_below(sorted_primitives, mesh.drawn, primitive)];
    }
    // The draw's shader's output for triangle t of a draw, at the point with these weights. turns: the outside is
    // behind the triangle.
    VOXELPIPE_ANY_CALLABLE
    [[nodiscard]] VOXELPIPE_HD auto shade(std::uint32_t t, const glm::vec3& weights, const glm::ivec3& sample,
                                          bool turns) const {
        const std::uint32_t d = bisect_last(0u, num_draws, [&](std::uint32_t i) { return draws[i].first <= t; });
        const shaded_draw<Shader>& of = draws[d];
        const auto at = static_cast<std::uint32_t>(t - of.first);
        const glm::uvec3 corners = mesh.triangles[t];
        const snapped_position a = mesh.positions[corners.x], b = mesh.positions[corners.y],
                               c = mesh.positions[corners.z];
        const Varyings none{};
        fragment<Varyings> f{};
        f.draw = d;
        f.instance = at / of.each;
        const visible_numbers seen = of.numbers.of(at % of.each, f.instance);
        f.triangle = seen.triangle;
        f.primitive = seen.primitive;
        const auto place = [&](const auto& frame) {
            f.axis = frame.axis;
            f.front_facing = frame.normal[2] >= 0;
            f.normal = unit_normal(frame, normal_factors);
        };
        if (fits_narrow(a, b, c, fraction))
            place(make_frame<std::int64_t>(a, b, c, fraction));
        else
            place(make_frame<int128>(a, b, c, fraction));
        if (turns) f.normal = glm::vec3(-f.normal.x, -f.normal.y, -f.normal.z);
        f.voxel = glm::ivec3(sample.x + offset.x, sample.y + offset.y, sample.z + offset.z);
        f.barycentric = weights;
        for (int i = 0; i < 3; ++i) {
            if constexpr (std::is_empty_v<Varyings>)
                f.vertex_varyings[i] = &none;
            else
                f.vertex_varyings[i] = varyings + (i == 0 ? corners.x : i == 1 ? corners.y : corners.z);
        }
        if constexpr (!std::is_empty_v<Varyings>)
            f.varyings = mix(*f.vertex_varyings[0], *f.vertex_varyings[1], *f.vertex_varyings[2], f.barycentric.y,
                             f.barycentric.z);
        return of.shader(f);
    }
};

} // namespace passes

// The varyings and shaders of a gathered mesh's draws, in a backend's memory.
template <class Backend, class Mesh, class VertexShader, class Shader>
class gathered_shading {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using varyings_type = typename shaded<Mesh, VertexShader>::varyings;
    using view_type = passes::mesh_shading<Shader, varyings_type>;
    using draws_type = std::span<const draw<Mesh, VertexShader, Shader>>;

    // mesh: what gathered_mesh::view() has of the same draws on the same grid of samples; its memory outlives the
    // object.
    gathered_shading(Backend& backend, draws_type draws, const grid& samples, const passes::mesh_triangles& mesh)
        : samples_(samples), mesh_(mesh), varyings_(backend, has_varyings ? count_vertices(draws) : 0),
          draws_(backend, 0), sorted_(backend, has_subset(draws) ? mesh.drawn : 0),
          triangles_(backend, sorted_.size()) {
        std::vector<passes::shaded_draw<Shader>> of;
        std::uint64_t vertices = 0, triangles = 0;
        std::uint32_t primitives = 0;
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const Mesh& m = draws[d].mesh;
            const auto& part = m.part;
            const auto each = static_cast<std::uint32_t>(m.triangles.size());
            of.push_back({draws[d].fragment_shader,
                          {part.whole != 0 ? part.numbers.data() : nullptr,
                           part.whole != 0 ? static_cast<std::uint32_t>(part.whole) : each, primitives},
                          triangles,
                          each});
            if constexpr (has_varyings)
                backend.for_each(m.num_vertices(), passes::shade_vertices<Mesh, VertexShader, varyings_type>{
                                                       m, draws[d].vertex_shader, static_cast<std::uint32_t>(d),
                                                       varyings_.data() + vertices});
            vertices += m.num_vertices();
            triangles += m.num_triangles();
            primitives += static_cast<std::uint32_t>(m.num_primitives());
        }
        draws_ = buffer<passes::shaded_draw<Shader>>(backend, array_view<const passes::shaded_draw<Shader>>(of));
        if (sorted_.size() != 0) {
            backend.for_each(sorted_.size(),
                             passes::list_primitives{mesh.primitives, sorted_.data(), triangles_.data()});
            backend.sort_by_key(sorted_, triangles_, 32);
        }
    }

    // Refers to the object.
    [[nodiscard]] view_type view() const {
        return {mesh_,
                varyings_.data(),
                draws_.data(),
                static_cast<std::uint32_t>(draws_.size()),
                sorted_.size() != 0 ? sorted_.data() : nullptr,
                triangles_.data(),
                normal_factors(samples_),
                samples_.fraction(),
                samples_.offset};
    }

private:
    static constexpr bool has_varyings = !std::is_empty_v<varyings_type>;
    static std::size_t count_vertices(draws_type draws) {
        std::size_t n = 0;
        for (const auto& d : draws) n += d.mesh.num_vertices();
        return n;
    }

    grid samples_;
    passes::mesh_triangles mesh_;
    buffer<varyings_type> varyings_;
    buffer<passes::shaded_draw<Shader>> draws_;
    buffer<std::uint64_t> sorted_;
    buffer<std::uint32_t> triangles_;
};

} // namespace voxelpipe::core
