// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tessellation and geometry programs on a draw: count, prefix sum, emit (programs/passes/patch_passes.hpp,
// programs/passes/geometry_passes.hpp). What they emit are ordinary meshes in the backend's memory, any range of a
// draw's primitives at a time, so every strategy, list and solid draws them.

#include <voxelpipe/programs/passes/geometry_passes.hpp>
#include <voxelpipe/programs/passes/patch_passes.hpp>

#include <cstdint>
#include <type_traits>
#include <vector>

namespace voxelpipe::core {

// ---- emitted meshes -------------------------------------------------------------------------------------------------

// Triangles of a program, as a mesh. Stored: their varyings, or no_varyings if the shader reads none.
template <class Backend, class Stored>
struct emitted_mesh {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    buffer<glm::vec3> positions;
    buffer<Stored> varyings;
    buffer<glm::uvec3> triangles;
    buffer<std::uint32_t> origins; // input primitive of each triangle, through all instances; empty if not wanted

    emitted_mesh(Backend& backend, std::uint64_t num_vertices, std::uint64_t num_triangles, bool has_origins)
        : positions(backend, num_vertices), varyings(backend, std::is_empty_v<Stored> ? 0 : num_vertices),
          triangles(backend, num_triangles), origins(backend, has_origins ? num_triangles : 0) {}

    [[nodiscard]] passes::mesh_vertices<Stored> sink() { return {positions.data(), varyings.data()}; }
    [[nodiscard]] auto view() const {
        const checked_indices checked{triangles.data(), triangles.size(), positions.size()};
        if constexpr (std::is_empty_v<Stored>) {
            return mesh_view<>{positions.view(), triangles.view(), {}, checked};
        } else {
            const array_view<const Stored> of_vertices = varyings.view();
            return mesh_view<Stored>{positions.view(), triangles.view(), make_pack(of_vertices), checked};
        }
    }
};

// The vertex shader for them.
template <class V>
struct emitted_vertex {
    VOXELPIPE_HD vertex_output<V> operator()(const vertex<V>& v) const { return {v.position, get<0>(v)}; }
};
template <class V>
using emitted_vertex_shader = std::conditional_t<std::is_empty_v<V>, passthrough, emitted_vertex<V>>;

// ---- tessellation of a draw's patches -------------------------------------------------------------------------------

template <class Backend, class Program, class V>
class tessellation_pass {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using W = tessellated<Program, V>;

public:
    // `vertices` and `counts` outlive the pass. Waits.
    tessellation_pass(Backend& backend, const Program& program, const vertex_output<V>* vertices,
                      const element_indices<3>& in, std::uint64_t num_patches, std::uint64_t* counts)
        : backend_(backend), program_(program), vertices_(vertices), in_(in), num_patches_(num_patches),
          levels_(backend, num_patches), first_triangle_(backend, num_patches + 1),
          first_point_(backend, num_patches + 1) {
        buffer<std::uint32_t> num_triangles(backend, num_patches + 1), num_points(backend, num_patches + 1);
        backend.for_each(num_patches + 1,
                         passes::find_levels<Program, V>{program, vertices, in, num_patches, levels_.data(),
                                                         num_triangles.data(), num_points.data(), counts});
        total_ = backend.sum(num_triangles, first_triangle_);
        backend.sum(num_points, first_point_);
    }
    [[nodiscard]] std::uint64_t total() const { return total_; }

    // Triangles [begin, end) as a mesh.
    template <class Stored>
    [[nodiscard]] emitted_mesh<Backend, Stored> emit(std::uint64_t begin, std::uint64_t end, bool has_origins,
                                                     const glm::vec3& outside) const {
        if (begin == end) return {backend_, 0, 0, has_origins};
        const points_range points = points_of(begin, end);
        emitted_mesh<Backend, Stored> m(backend_, points.count + 1, end - begin, has_origins);
        emit_into(points, outside, m.sink(), begin, end, static_cast<std::uint32_t>(points.count), m.triangles.data(),
                  has_origins ? m.origins.data() : nullptr);
        return m;
    }
    // The mesh that a geometry program makes. Triangles that are left out have indices beyond all vertices.
    struct joined {
        buffer<vertex_output<W>> vertices;
        buffer<glm::uvec3> triangles;
        buffer<std::uint32_t> origins;
        std::uint32_t num_vertices;
    };
    [[nodiscard]] joined emit_joined(std::uint64_t begin, std::uint64_t end) const {
        if (begin == end) return {{backend_, 0}, {backend_, 0}, {backend_, 0}, 0};
        const points_range points = points_of(begin, end);
        joined j{{backend_, points.count + 1},
                 {backend_, end - begin},
                 {backend_, end - begin},
                 static_cast<std::uint32_t>(points.count)};
        emit_into(points, glm::vec3(0.0f), passes::joined_vertices<W>{j.vertices.data()}, begin, end, ~std::uint32_t{0},
                  j.triangles.data(), j.origins.data());
        return j;
    }

private:
    struct points_range {
        std::uint64_t first, count;
    };
    [[nodiscard]] passes::patches<V> all() const {
        return {
            vertices_,          in_, static_cast<std::uint32_t>(num_patches_), levels_.data(), first_triangle_.data(),
            first_point_.data()};
    }
    [[nodiscard]] points_range points_of(std::uint64_t begin, std::uint64_t end) const {
        buffer<std::uint64_t> range(backend_, 2);
        backend_.for_each(1, passes::find_points<V>{all(), begin, end, range.data()});
        const std::vector<std::uint64_t> host = range.to_host(backend_);
        return {host[0], host[1] - host[0]};
    }
    template <class Sink>
    void emit_into(const points_range& points, const glm::vec3& outside, const Sink& sink, std::uint64_t begin,
                   std::uint64_t end, std::uint32_t left_out, glm::uvec3* triangles, std::uint32_t* origins) const {
        backend_.for_each(points.count + 1, passes::emit_points<Program, V, W, Sink>{program_, all(), points.first,
                                                                                     points.count, outside, sink});
        backend_.for_each(end - begin,
                          passes::emit_triangles<V>{all(), begin, points.first, left_out, triangles, origins});
    }

    Backend& backend_;
    Program program_;
    const vertex_output<V>* vertices_;
    element_indices<3> in_;
    std::uint64_t num_patches_, total_ = 0;
    buffer<std::uint32_t> levels_;
    buffer<std::uint64_t> first_triangle_, first_point_;
};

// ---- a geometry program on a draw's elements ------------------------------------------------------------------------

template <class Backend, class Program, int K, template <class> class Input, class V, class Stored>
class geometry_pass {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using inputs_type = passes::geometry_inputs<K, Input, V>;
    using run_type = passes::run_geometry<Program, K, Input, V, passes::mesh_vertices<Stored>>;

public:
    // What `inputs` and `counts` refer to outlives the pass. Waits.
    geometry_pass(Backend& backend, const Program& program, const inputs_type& inputs, std::uint64_t* counts)
        : backend_(backend), program_(program), inputs_(inputs), counts_(counts),
          first_triangle_(backend, inputs.count + 1) {
        buffer<std::uint32_t> num_triangles(backend, inputs.count + 1);
        backend.for_each(
            inputs.count + 1,
            run_type{
                program, inputs, num_triangles.data(), nullptr, 0, 0, 0, {nullptr, nullptr}, nullptr, nullptr, counts});
        total_ = backend.sum(num_triangles, first_triangle_);
    }
    [[nodiscard]] std::uint64_t total() const { return total_; }

    // Triangles [begin, end) as a mesh.
    [[nodiscard]] emitted_mesh<Backend, Stored> emit(std::uint64_t begin, std::uint64_t end, bool has_origins) const {
        emitted_mesh<Backend, Stored> m(backend_, 3 * (end - begin), end - begin, has_origins);
        if (begin == end) return m;
        buffer<std::uint64_t> range(backend_, 2);
        backend_.for_each(1, passes::find_inputs{first_triangle_.data(), inputs_.count, begin, end, range.data()});
        const std::vector<std::uint64_t> host = range.to_host(backend_);
        backend_.for_each(host[1] - host[0],
                          run_type{program_, inputs_, nullptr, first_triangle_.data(), begin, end, host[0], m.sink(),
                                   m.triangles.data(), has_origins ? m.origins.data() : nullptr, counts_});
        return m;
    }

private:
    Backend& backend_;
    Program program_;
    inputs_type inputs_;
    std::uint64_t* counts_;
    std::uint64_t total_ = 0;
    buffer<std::uint64_t> first_triangle_;
};

} // namespace voxelpipe::core
