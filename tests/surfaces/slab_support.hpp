// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces of slabs, joined, on any backend.

#include "surface_support.hpp"

#include <voxelpipe/surfaces/extract_slab.hpp>

namespace surface_tests {

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
        joined.status.code = status.ok() ? joined.status.code : status.code;
        joined.vertices.insert(joined.vertices.end(), one.vertices.begin(), one.vertices.end());
        joined.triangles.insert(joined.triangles.end(), one.triangles.begin(), one.triangles.end());
        joined.quads.insert(joined.quads.end(), one.quads.begin(), one.quads.end());
        slab.first_vertex += one.vertices.size();
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
