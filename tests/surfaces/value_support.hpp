// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces with values of their vertices, on any backend.

#include "surface_support.hpp"

namespace surface_tests {

struct placed {
    glm::vec3 at;
};
// Hands positions on.
struct place_shader {
    template <class Vertex>
    VOXELPIPE_HD vp::vertex_output<placed> operator()(const Vertex& v) const {
        return {v.position, {v.position}};
    }
};
// Where the crossing is, the triangle, the triangle's material of three, and the same as shares of three.
struct value_shader {
    std::uint32_t discarded = ~std::uint32_t{0}; // a material
    VOXELPIPE_HD auto operator()(const vp::fragment<placed>& f) const {
        const std::uint32_t material = f.triangle % 3;
        const glm::vec3 shares(material == 0 ? 1.0f : 0.0f, material == 1 ? 1.0f : 0.0f, material == 2 ? 1.0f : 0.0f);
        return vp::outputs(f.varyings.at, f.primitive, material, shares).discard_if(material == discarded);
    }
};

struct host_values {
    host_surface mesh;
    std::vector<glm::vec3> at;
    std::vector<std::uint32_t> primitive, material;
    std::vector<glm::vec3> shares;

    [[nodiscard]] bool has_same_arrays(const host_values& o) const {
        return mesh.has_same_arrays(o.mesh) && at == o.at && primitive == o.primitive && material == o.material &&
               shares == o.shares;
    }
    [[nodiscard]] glm::dvec3 position(std::size_t v) const { return vp::position(mesh.samples, mesh.vertices[v]); }
};

template <class Backend>
[[nodiscard]] host_values remesh_with_values(Backend& backend, const host_mesh& mesh, const vp::grid& g,
                                             const vp::remesh_options& options = {}, const value_shader& shader = {}) {
    const vp::mesh<Backend> m{backend, mesh.positions, mesh.triangles};
    vp::surface<Backend, glm::vec3, std::uint32_t, std::uint32_t, glm::vec3> s(backend);
    const vp::status status = vp::remesh(backend, m, g, place_shader{}, shader, s, options);
    return {to_host(backend, s, status), vp::get<0>(s).to_host(backend), vp::get<1>(s).to_host(backend),
            vp::get<2>(s).to_host(backend), vp::get<3>(s).to_host(backend)};
}

} // namespace surface_tests
