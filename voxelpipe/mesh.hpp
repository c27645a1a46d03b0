// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Indexed triangle meshes: mesh_view refers to memory that someone else owns, mesh<Backend> owns it on that backend.
// Positions are float32 in world (or object) space. A triangle is three vertex indices, counter-clockwise seen from its
// front. Attributes are any number of per-vertex arrays of trivially copyable types, for the vertex shader.

#include <voxelpipe/core/instances.hpp>
#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/mesh_source.hpp>
#include <voxelpipe/status.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace voxelpipe {

// Facts about the indices of some triangles, so that calls need not read them again. Valid as long as nobody writes to
// them.
struct checked_indices {
    const glm::uvec3* triangles = nullptr; // start of the `count` checked triangles; null: nothing is known
    std::size_t count = 0;                 // triangles
    std::uint64_t bound = 0;               // greater than every index
};

// How often a mesh is drawn. The vertex shader gets the number of the copy, vertex::instance.
struct instances {
    std::uint64_t count = 1; // 0 draws nothing; below 2^32
};

// Which triangles of a larger mesh a mesh_view has. Shaders, A-buffers and blends that need an order then see the
// numbers of the whole: fragment::triangle is numbers[i], and fragment::primitive counts all triangles of each whole
// mesh. Solids have no primitive numbers and ignore it.
struct subset {
    backend_view<const std::uint32_t> numbers = {}; // one per triangle: its number in the whole mesh; ascending
    std::uint64_t whole = 0;                        // triangles of the whole mesh; 0: the mesh_view is the whole
    // Not 0: the numbers are known to ascend below `whole`. Otherwise each call reads them, and one on a GPU waits once
    // more. As wide as the rest, so that a view has no padding: calls are compared by their bytes.
    std::uint64_t checked = 0;
};

// A triangle mesh in memory that somebody else owns: the CPU backend reads host memory, cuda_backend device memory.
template <class... Attributes>
struct mesh_view {
    static_assert((std::is_trivially_copyable_v<Attributes> && ...),
                  "voxelpipe: vertex attributes must be trivially copyable");
    static constexpr std::size_t num_attributes = sizeof...(Attributes); // arrays of attributes

    backend_view<const glm::vec3> positions;                     // one per vertex
    backend_view<const glm::uvec3> triangles;                    // vertex indices
    core::pack<array_view<const Attributes>...> attributes = {}; // each as long as positions
    // From check_indices or mesh. Ignored if it describes a different triangle array.
    checked_indices checked = {};
    // Primitives are numbered by instance, then by triangle. 0 draws nothing.
    instances copies = {};
    // Set if these triangles are some of a larger mesh's, such as those that reach a slab.
    subset part = {};

    // Number of triangles over all instances.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_triangles() const { return triangles.size() * copies.count; }
    // Number of vertices over all instances.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_vertices() const { return positions.size() * copies.count; }
    // Numbers that primitives of this draw take, of all instances: more than num_triangles() of a subset.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_primitives() const {
        return (part.whole != 0 ? part.whole : triangles.size()) * copies.count;
    }

    // True if all indices are known to name vertices. Otherwise calls check each of them.
    [[nodiscard]] bool has_checked_indices() const {
        return checked.triangles == triangles.data() && checked.count >= triangles.size() &&
               checked.bound <= positions.size();
    }
};

// Reads the indices of triangles on the backend, after earlier work of its stream, and waits. Set mesh_view::checked to
// the result if triangles are drawn more than once: otherwise each call of a cuda_backend reads all indices before it
// writes anything. Throws std::bad_alloc, or the backend's error.
template <class Backend>
[[nodiscard]] checked_indices check_indices(Backend& backend, array_view<const glm::uvec3> triangles) {
    return {triangles.data(), triangles.size(),
            triangles.size() == 0 ? 0 : std::uint64_t{backend.max_index(triangles)} + 1};
}

namespace core {

template <class View>
inline constexpr bool is_mesh_view = false;
template <class... Attributes>
inline constexpr bool is_mesh_view<mesh_view<Attributes...>> = true;
template <class View>
concept triangle_mesh = is_mesh_view<View>;

// The triangles of a mesh, of all instances.
template <class... Attributes>
[[nodiscard]] VOXELPIPE_HD inline instanced_triangles triangles_of(const mesh_view<Attributes...>& m) {
    return {m.triangles.data(), static_cast<std::uint32_t>(m.triangles.size()),
            static_cast<std::uint32_t>(m.positions.size())};
}

// The largest index of triangles in host memory; 0 if there are none.
[[nodiscard]] inline std::uint32_t max_index(array_view<const glm::uvec3> triangles) {
    std::uint32_t most = 0;
    for (const glm::uvec3& t : triangles) most = std::max({most, t.x, t.y, t.z});
    return most;
}

} // namespace core

// Owns its arrays, in Backend::buffer<T>. The constructor copies from the sources of mesh_source.hpp: ranges of
// glm::vec3 and glm::uvec3, interleaved vertices, flat or short indices, or none; also from memory of the backend.
// Throws std::bad_alloc (or the backend's error) if there is no memory, and std::invalid_argument if the number of
// indices is no multiple of 3. The indices are checked here, once for all calls; a call reports an index that names no
// vertex.
template <class Backend, class... Attributes>
class mesh {
public:
    // Copies its arguments.
    mesh(Backend& backend, const vertex_source<glm::vec3>& positions, triangle_source&& triangles,
         const vertex_source<Attributes>&... attributes)
        : positions_(backend, positions.view()),
          triangles_(backend, triangles.view(positions.view().size())), attributes_{core::make_pack(buffer<Attributes>(
                                                                            backend, attributes.view())...)},
          index_bound_(find_bound(backend, triangles)) {}

    // copies: how often the view is drawn, as in forest.view(vp::instances{5000}).
    [[nodiscard]] mesh_view<Attributes...> view(instances copies = {}) const {
        return [&]<std::size_t... I>(std::index_sequence<I...>) {
            return mesh_view<Attributes...>{
                positions_.view(),
                triangles_.view(),
                core::make_pack(array_view<const Attributes>(voxelpipe::get<I>(attributes_).view())...),
                {triangles_.data(), triangles_.size(), index_bound_},
                copies};
        }
        (std::index_sequence_for<Attributes...>{});
    }
    // The mesh once.
    operator mesh_view<Attributes...>() const { return view(); } // NOLINT(*-explicit-*)

private:
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    [[nodiscard]] std::uint64_t find_bound(Backend& backend, triangle_source& triangles) const {
        if (triangles_.size() == 0) return 0;
        const std::uint64_t most = triangles.is_in_backend() ? backend.max_index(triangles_.view())
                                                             : core::max_index(triangles.view(positions_.size()));
        return most + 1;
    }

    buffer<glm::vec3> positions_;
    buffer<glm::uvec3> triangles_;
    core::pack<buffer<Attributes>...> attributes_;
    std::uint64_t index_bound_;
};

template <class Backend, class Positions, class Triangles>
mesh(Backend&, const Positions&, const Triangles&) -> mesh<Backend>;
template <class Backend, class Positions, class Triangles, class... Ranges>
mesh(Backend&, const Positions&, const Triangles&, const Ranges&...)
    -> mesh<Backend, typename core::source_value<Ranges>::type...>;

} // namespace voxelpipe
