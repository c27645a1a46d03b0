// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Points and lines: views of vertices in a backend's memory, like mesh_view. They take the vertex and fragment shaders
// of meshes, or feed a geometry program.

#include <voxelpipe/mesh.hpp>
#include <voxelpipe/shader.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe {

// Each vertex is a point. Members as in mesh_view.
template <class... Attributes>
struct points_view {
    backend_view<const glm::vec3> positions;                     // one per vertex, world or object space
    core::pack<array_view<const Attributes>...> attributes = {}; // each as long as positions
    instances copies = {};                                       // how often all points are drawn
};

// list: indices 2i and 2i + 1 are segment i. strip: i and i + 1. loop: a strip that ends where it began.
enum class line_topology : std::uint8_t { list, strip, loop };

// Line segments between vertices.
template <class... Attributes>
struct lines_view {
    backend_view<const glm::vec3> positions;                     // one per vertex, world or object space
    backend_view<const std::uint32_t> indices = {};              // of vertices; empty: the vertices in order
    line_topology topology = line_topology::list;                // which vertices make a segment
    core::pack<array_view<const Attributes>...> attributes = {}; // each as long as positions
    instances copies = {};                                       // how often all segments are drawn

    // Indices of one instance, given or implied.
    [[nodiscard]] std::uint64_t num_indices() const { return indices.size() != 0 ? indices.size() : positions.size(); }
    // Segments of one instance. A last vertex without a partner, and a strip or loop of one vertex, give none.
    [[nodiscard]] std::uint64_t num_lines() const {
        const std::uint64_t n = num_indices();
        return topology == line_topology::list ? n / 2 : n < 2 ? 0 : topology == line_topology::strip ? n - 1 : n;
    }
};

namespace core {

template <class... Attributes>
struct mesh_vertex<points_view<Attributes...>> {
    using type = vertex<Attributes...>;
};
template <class... Attributes>
struct mesh_vertex<lines_view<Attributes...>> {
    using type = vertex<Attributes...>;
};

// The vertices that an element of any kind names, of all instances.
template <int K>
struct element_indices {
    const std::uint32_t* indices = nullptr; // null: the vertices in order
    std::uint64_t num_indices = 0;
    std::uint32_t step = K; // from one element's first index to the next one's
    std::uint32_t each = 0; // elements of an instance
    std::uint32_t vertices_each = 0;

    struct located {
        std::uint32_t number, instance;
        std::uint32_t index[std::size_t{K}];
        bool ok; // otherwise an index names no vertex
    };
    [[nodiscard]] VOXELPIPE_HD located locate(std::uint32_t i) const {
        located e{};
        e.instance = i < each ? 0 : i / each; // most have one instance
        e.number = i - e.instance * each;
        e.ok = true;
        for (int k = 0; k < K; ++k) {
            std::uint64_t at = std::uint64_t{e.number} * step + static_cast<std::uint32_t>(k);
            if (at >= num_indices) at -= num_indices; // a loop's last segment
            const std::uint32_t v = indices != nullptr ? indices[at] : static_cast<std::uint32_t>(at);
            e.ok = e.ok && v < vertices_each;
            e.index[k] = v + e.instance * vertices_each;
        }
        return e;
    }
};

// Elements of a view: how many vertices each has, its vertices as a mesh without triangles, and its indices.
template <class View>
struct elements_of;
template <class... Attributes>
struct elements_of<mesh_view<Attributes...>> {
    static constexpr int size = 3;
    using vertices_type = mesh_view<Attributes...>;
    [[nodiscard]] static vertices_type vertices(const mesh_view<Attributes...>& m) { return m; }
    [[nodiscard]] static std::uint64_t count(const mesh_view<Attributes...>& m) { return m.triangles.size(); }
    [[nodiscard]] static element_indices<3> indices(const mesh_view<Attributes...>& m) {
        const auto each = static_cast<std::uint32_t>(m.triangles.size());
        static_assert(sizeof(glm::uvec3) == 3 * sizeof(std::uint32_t));
        return {reinterpret_cast<const std::uint32_t*>(m.triangles.data()), std::uint64_t{3} * each, 3, each,
                static_cast<std::uint32_t>(m.positions.size())};
    }
    [[nodiscard]] static bool has_memory(const mesh_view<Attributes...>&) { return true; } // checked with the mesh
};
template <class... Attributes>
struct elements_of<lines_view<Attributes...>> {
    static constexpr int size = 2;
    using vertices_type = mesh_view<Attributes...>;
    [[nodiscard]] static vertices_type vertices(const lines_view<Attributes...>& l) {
        return {l.positions, {}, l.attributes, {}, l.copies};
    }
    [[nodiscard]] static std::uint64_t count(const lines_view<Attributes...>& l) { return l.num_lines(); }
    [[nodiscard]] static element_indices<2> indices(const lines_view<Attributes...>& l) {
        return {l.indices.size() != 0 ? l.indices.data() : nullptr, l.num_indices(),
                l.topology == line_topology::list ? 2u : 1u, static_cast<std::uint32_t>(l.num_lines()),
                static_cast<std::uint32_t>(l.positions.size())};
    }
    [[nodiscard]] static bool has_memory(const lines_view<Attributes...>& l) {
        return l.indices.size() == 0 || l.indices.data() != nullptr;
    }
};
template <class... Attributes>
struct elements_of<points_view<Attributes...>> {
    static constexpr int size = 1;
    using vertices_type = mesh_view<Attributes...>;
    [[nodiscard]] static vertices_type vertices(const points_view<Attributes...>& p) {
        return {p.positions, {}, p.attributes, {}, p.copies};
    }
    [[nodiscard]] static std::uint64_t count(const points_view<Attributes...>& p) { return p.positions.size(); }
    [[nodiscard]] static element_indices<1> indices(const points_view<Attributes...>& p) {
        const auto n = static_cast<std::uint32_t>(p.positions.size());
        return {nullptr, n, 1, n, n};
    }
    [[nodiscard]] static bool has_memory(const points_view<Attributes...>&) { return true; }
};

// Runs the vertex shader, on all instances.
template <class Mesh, class VertexShader, class V>
struct shade_elements {
    Mesh mesh;
    VertexShader shader;
    std::uint32_t draw;
    vertex_output<V>* out;

    VOXELPIPE_ANY_CALLABLE
    template <class Index>
    VOXELPIPE_HD void operator()(Index i) const {
        const std::uint64_t each = mesh.positions.size(), instance = i / each;
        const auto v = fetch_vertex(mesh, static_cast<std::uint32_t>(i - instance * each), draw,
                                    static_cast<std::uint32_t>(instance));
        const auto result = shader(v);
        out[i] = vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result);
    }
};

} // namespace core
} // namespace voxelpipe
