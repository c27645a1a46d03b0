// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Indexed triangle meshes: mesh_view names memory that someone else owns, mesh<Backend> owns it on that backend.
// Positions are float32 in world (or object) space; a triangle is three vertex indices, counter-clockwise seen from its
// front; attributes are any number of per-vertex arrays of trivially copyable types, for the vertex shader.

#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/status.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace voxelpipe {

template <class... Attributes>
struct mesh_view {
    static_assert((std::is_trivially_copyable_v<Attributes> && ...),
                  "voxelpipe: vertex attributes must be trivially copyable");
    static constexpr std::size_t num_attributes = sizeof...(Attributes);

    array_view<const glm::vec3> positions;                       // one per vertex
    array_view<const glm::uvec3> triangles;                      // vertex indices
    core::pack<array_view<const Attributes>...> attributes = {}; // each as long as positions
};

// Backend::buffer<T> holds the arrays; they are copied in by the constructor, which throws std::bad_alloc (or the
// backend's error) where there is no memory.
template <class Backend, class... Attributes>
class mesh {
public:
    mesh(Backend& backend, array_view<const glm::vec3> positions, array_view<const glm::uvec3> triangles,
         array_view<const Attributes>... attributes)
        : positions_(backend, positions),
          triangles_(backend, triangles), attributes_{core::make_pack(buffer<Attributes>(backend, attributes)...)} {}

    [[nodiscard]] mesh_view<Attributes...> view() const {
        return [this]<std::size_t... I>(std::index_sequence<I...>) {
            return mesh_view<Attributes...>{positions_.view(), triangles_.view(),
                                            core::make_pack(voxelpipe::get<I>(attributes_).view()...)};
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
};

template <class Backend, class Positions, class Triangles>
mesh(Backend&, const Positions&, const Triangles&) -> mesh<Backend>;
template <class Backend, class Positions, class Triangles, class... Ranges>
mesh(Backend&, const Positions&, const Triangles&, const Ranges&...)
    -> mesh<Backend, std::remove_cvref_t<decltype(*std::data(std::declval<const Ranges&>()))>...>;

} // namespace voxelpipe
