// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Indexed triangle meshes: mesh_view names memory that someone else owns, mesh<Backend> owns it on that backend.
// Positions are float32 in world (or object) space; a triangle is three vertex indices, counter-clockwise seen from its
// front; attributes are any number of per-vertex arrays of trivially copyable types, for the vertex shader.

#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/status.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace voxelpipe {

// What is known of the indices of some triangles, so that calls need not read them all once more. Holds as long as
// nobody writes to them.
struct checked_indices {
    const glm::uvec3* triangles = nullptr; // the first `count` from here; null: nothing is known
    std::size_t count = 0;
    std::uint64_t bound = 0; // above every index
};

template <class... Attributes>
struct mesh_view {
    static_assert((std::is_trivially_copyable_v<Attributes> && ...),
                  "voxelpipe: vertex attributes must be trivially copyable");
    static constexpr std::size_t num_attributes = sizeof...(Attributes);

    backend_view<const glm::vec3> positions;                     // one per vertex
    backend_view<const glm::uvec3> triangles;                    // vertex indices
    core::pack<array_view<const Attributes>...> attributes = {}; // each as long as positions
    // By check_indices, or by mesh. Ignored if it describes a different triangle array.
    checked_indices checked = {};

    // Whether all indices are known to name vertices. Otherwise calls look at each of them, and say where one does not.
    [[nodiscard]] bool has_checked_indices() const {
        return checked.triangles == triangles.data() && checked.count >= triangles.size() &&
               checked.bound <= positions.size();
    }
};

// Reads the indices of triangles on the backend, waiting for what its stream has before, for mesh_view::checked: worth
// it for triangles that are drawn more than once, since a cuda_backend's calls read them all once more before they
// write to anything. Throws std::bad_alloc, or the backend's error.
template <class Backend>
[[nodiscard]] checked_indices check_indices(Backend& backend, array_view<const glm::uvec3> triangles) {
    return {triangles.data(), triangles.size(),
            triangles.size() == 0 ? 0 : std::uint64_t{backend.max_index(triangles)} + 1};
}

namespace core {

// Of triangles in host memory; 0 where there are none.
[[nodiscard]] inline std::uint32_t max_index(array_view<const glm::uvec3> triangles) {
    std::uint32_t most = 0;
    for (const glm::uvec3& t : triangles) most = std::max({most, t.x, t.y, t.z});
    return most;
}

} // namespace core

// Backend::buffer<T> holds the arrays; they are copied in by the constructor, which throws std::bad_alloc (or the
// backend's error) where there is no memory. The constructor looks at the indices too, once for all calls, for nobody
// can write to them afterwards; one that names no vertex is the calls' error all the same.
template <class Backend, class... Attributes>
class mesh {
public:
    mesh(Backend& backend, array_view<const glm::vec3> positions, array_view<const glm::uvec3> triangles,
         array_view<const Attributes>... attributes)
        : positions_(backend, positions),
          triangles_(backend, triangles), attributes_{core::make_pack(buffer<Attributes>(backend, attributes)...)},
          index_bound_(triangles.size() == 0 ? 0 : std::uint64_t{core::max_index(triangles)} + 1) {}

    [[nodiscard]] mesh_view<Attributes...> view() const {
        return [this]<std::size_t... I>(std::index_sequence<I...>) {
            return mesh_view<Attributes...>{
                positions_.view(),
                triangles_.view(),
                core::make_pack(array_view<const Attributes>(voxelpipe::get<I>(attributes_).view())...),
                {triangles_.data(), triangles_.size(), index_bound_}};
        }
        (std::index_sequence_for<Attributes...>{});
    }
    operator mesh_view<Attributes...>() const { return view(); } // NOLINT(*-explicit-*)

private:
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    buffer<glm::vec3> positions_;
    buffer<glm::uvec3> triangles_;
    core::pack<buffer<Attributes>...> attributes_;
    std::uint64_t index_bound_;
};

template <class Backend, class Positions, class Triangles>
mesh(Backend&, const Positions&, const Triangles&) -> mesh<Backend>;
template <class Backend, class Positions, class Triangles, class... Ranges>
mesh(Backend&, const Positions&, const Triangles&, const Ranges&...)
    -> mesh<Backend, std::remove_cvref_t<decltype(*std::data(std::declval<const Ranges&>()))>...>;

} // namespace voxelpipe
