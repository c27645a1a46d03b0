// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces of slabs, joined, on any backend.

#include "surface_support.hpp"
#include "value_support.hpp"

#include <voxelpipe/surfaces/extract_slab.hpp>
#include <voxelpipe/surfaces/remesh_slab.hpp>

#include <gtest/gtest.h>

#include <span>

namespace surface_tests {

// Adds a slab's arrays, and what it counts.
inline void append(host_surface& joined, const host_surface& one) {
    const auto add = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    add(joined.vertices, one.vertices);
    add(joined.triangles, one.triangles);
    add(joined.quads, one.quads);
    add(joined.sources, one.sources);
    if (!one.status.ok()) joined.status.code = one.status.code;
    vp::surface_counters& sum = joined.status.surface;
    const vp::surface_counters& part = one.status.surface;
    sum.vertices += part.vertices;
    sum.faces += part.faces;
    sum.nan_samples += part.nan_samples;
    sum.made_crossings += part.made_crossings;
    sum.cone_crossings += part.cone_crossings;
    sum.nearest_values += part.nearest_values;
}

// The whole as slabs give it, which count no components.
[[nodiscard]] inline host_surface without_components(host_surface whole) {
    whole.status.surface.components = 0;
    return whole;
}

// The arrays of all slabs, one after the other. values: of the grid g, bits as 0 and 1. A slab has heights[i] layers.
template <class T, class Backend>
[[nodiscard]] host_surface join_slabs(Backend& backend, const std::vector<float>& values, const vp::grid& g,
                                      const std::vector<int>& heights, const vp::extract_options& options) {
    using drawn = vp::target<T, vp::blend::replace>;
    using map = typename drawn::map;
    using element = typename drawn::element_type;
    host_surface joined;
    joined.samples = g;
    vp::surface_slab slab;
    const auto layer = static_cast<std::size_t>(g.extent.x) * static_cast<std::size_t>(g.extent.y);
    for (const int height : heights) {
        slab.layers = height;
        const glm::ivec3 extent(g.extent.x, g.extent.y, slab.needed(g.extent.z));
        std::vector<element> part(map::elements(extent));
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    const float v = values[static_cast<std::size_t>(slab.lowest() + z) * layer +
                                           static_cast<std::size_t>(y) * static_cast<std::size_t>(extent.x) +
                                           static_cast<std::size_t>(x)];
                    map::store(part.data(), extent, x, y, z, static_cast<typename drawn::value_type>(v));
                }
        const typename Backend::template buffer<element> memory(backend, vp::array_view<const element>(part));
        const vp::target_view<drawn> view{const_cast<element*>(memory.data()), extent};
        vp::surface<Backend> s(backend);
        const vp::status status = vp::extract_slab(backend, view, g, slab, s, options);
        const host_surface one = to_host(backend, s, status);
        append(joined, one);
        slab.first_vertex += one.vertices.size();
        slab.first += height;
    }
    return joined;
}

// A remesh slab by slab, with values of the vertices.
template <class Backend>
[[nodiscard]] host_values join_remeshed(Backend& backend, const host_mesh& mesh, const vp::grid& g,
                                        const std::vector<int>& heights, const vp::remesh_options& options,
                                        const value_shader& shader = {}) {
    const vp::mesh<Backend> m{backend, mesh.positions, mesh.triangles};
    using draw_type = vp::draw<vp::mesh_view<>, place_shader, value_shader>;
    const draw_type d{m.view(), {}, shader};
    host_values joined;
    joined.mesh.samples = vp::core::sample_grid(g, options.sample);
    vp::surface_slab slab;
    for (const int height : heights) {
        slab.layers = height;
        vp::surface<Backend, glm::vec3, std::uint32_t, std::uint32_t, glm::vec3> s(backend);
        const vp::status status = vp::remesh_slab(backend, std::span<const draw_type>(&d, 1), g, slab, s, options);
        EXPECT_TRUE(status.ok()) << status.message();
        EXPECT_EQ(s.samples, joined.mesh.samples);
        append(joined.mesh, to_host(backend, s, status));
        const auto add = [&](auto& to, const auto& from) {
            const auto values = from.to_host(backend);
            to.insert(to.end(), values.begin(), values.end());
        };
        add(joined.at, vp::get<0>(s));
        add(joined.primitive, vp::get<1>(s));
        add(joined.material, vp::get<2>(s));
        add(joined.shares, vp::get<3>(s));
        slab.first_vertex = joined.mesh.vertices.size();
        slab.first += height;
    }
    return joined;
}

// Values of noise; bits where T is vp::bit.
template <class T>
[[nodiscard]] std::vector<float> slab_values(std::mt19937& random, const glm::ivec3& extent, double density) {
    std::vector<float> values(static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y) *
                              static_cast<std::size_t>(extent.z));
    for (float& f : values) {
        const double v = static_cast<double>(random() % 1000) / 1000;
        f = std::is_same_v<T, vp::bit> ? (v < density ? 1.0f : 0.0f) : static_cast<float>(v - density);
    }
    return values;
}

} // namespace surface_tests
