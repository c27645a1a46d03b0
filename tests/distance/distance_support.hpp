// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of distances: the library's fields, and the oracle's view of a mesh.

#include "../oracle/test_support.hpp"
#include "../solids/solid_support.hpp"
#include "distance_oracle.hpp"

#include <cpu_ref/backend.hpp>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace distances {

namespace vp = voxelpipe;
using oracle::splitmix64;
using solids::mesh;

// Distance and primitive; -1 beyond the band.
struct nearest_shader {
    template <class Varyings>
    VOXELPIPE_HD vp::output<float, std::int64_t> operator()(const vp::distance_fragment<Varyings>& f) const {
        return vp::outputs(f.distance, f.in_band ? std::int64_t{f.primitive} : std::int64_t{-1});
    }
};

struct field {
    glm::ivec3 extent;
    std::vector<float> distances; // x fastest
    std::vector<std::int64_t> nearest;
    vp::status status;

    [[nodiscard]] std::size_t index(int x, int y, int z) const { return solids::index(extent, x, y, z); }
};

// Each mesh is a draw.
inline field library_field(const std::vector<mesh>& draws, const vp::grid& g, const vp::distance_options& options = {},
                           unsigned threads = 2) {
    vp::cpu_backend backend(threads);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, nearest_shader>> all;
    for (const mesh& m : draws) all.push_back({m.view(), {}, {}});
    const glm::ivec3 extent = vp::core::sample_grid(g, options.sample).extent;
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>,
                    vp::target<std::int64_t, vp::blend::replace>>
        fb(backend, extent);
    const vp::status s = vp::voxelize_distance(backend, all, g, fb, options);
    return {extent, vp::get<0>(fb).to_host(backend), vp::get<1>(fb).to_host(backend), s};
}
inline field library_field(const mesh& m, const vp::grid& g, const vp::distance_options& options = {},
                           unsigned threads = 2) {
    return library_field(std::vector<mesh>{m}, g, options, threads);
}

} // namespace distances
