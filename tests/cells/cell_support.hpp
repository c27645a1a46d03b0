// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the tests of cut cells: the library's cells with all that a fragment has, and the oracle's view of a mesh.

#include "../oracle/test_support.hpp"
#include "../solids/solid_support.hpp"
#include "cell_oracle.hpp"

#include <cpu_ref/backend.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace cells {

namespace vp = voxelpipe;
using oracle::splitmix64;
using solids::mesh;

struct all_shader {
    VOXELPIPE_HD vp::output<float, std::int64_t, std::int64_t, std::int64_t, std::uint32_t>
    operator()(const vp::cell_fragment& f) const {
        return vp::outputs(f.fraction, f.units, f.aperture, f.next_aperture, f.is_cut ? 1u : 0u);
    }
};

struct cell_values {
    glm::ivec3 extent;
    std::vector<float> fractions; // x fastest
    std::vector<std::int64_t> units, apertures, next;
    std::vector<std::uint32_t> cut;
    vp::status status;

    [[nodiscard]] std::size_t index(int x, int y, int z) const { return solids::index(extent, x, y, z); }
};

// Each mesh is a draw; their fragments add up.
inline cell_values library_cells(const std::vector<mesh>& draws, const vp::grid& g,
                                 const vp::cell_options& options = {}, unsigned threads = 2) {
    vp::cpu_backend backend(threads);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, all_shader>> all;
    for (const mesh& m : draws) all.push_back({m.view(), {}, {}});
    using number = vp::target<std::int64_t, vp::blend::replace>;
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::add>, number, number, number,
                    vp::target<std::uint32_t, vp::blend::max>>
        fb(backend, g.extent);
    const vp::status s = vp::voxelize_cells(backend, all, g, fb, options);
    EXPECT_TRUE(s.ok()) << s.message();
    return {g.extent,
            vp::get<0>(fb).to_host(backend),
            vp::get<1>(fb).to_host(backend),
            vp::get<2>(fb).to_host(backend),
            vp::get<3>(fb).to_host(backend),
            vp::get<4>(fb).to_host(backend),
            s};
}
inline cell_values library_cells(const mesh& m, const vp::grid& g, const vp::cell_options& options = {},
                                 unsigned threads = 2) {
    return library_cells(std::vector<mesh>{m}, g, options, threads);
}

inline constexpr std::int64_t whole_cell = std::int64_t{1} << vp::core::cell_unit_bits;
inline constexpr double bound = 2.5 * 1.125;      // of errors, in u, a triangle of the voxel
inline constexpr double face_bound = 2.0 * 1.125; // a triangle of a face
inline constexpr double slack = 0.001;            // of the oracle, whose sums are long doubles

// Snapped triangles of a unit grid.
inline std::vector<oracle::lattice_triangle> snapped(const mesh& m, int fraction_bits) {
    std::vector<oracle::lattice_triangle> all;
    for (const glm::uvec3& t : m.triangles) {
        oracle::lattice_triangle l{};
        for (int i = 0; i < 3; ++i)
            for (int a = 0; a < 3; ++a)
                l[static_cast<std::size_t>(i)][static_cast<std::size_t>(a)] =
                    std::llrint(std::ldexp(static_cast<double>(m.positions[t[i]][a]), fraction_bits));
        all.push_back(l);
    }
    return all;
}

} // namespace cells
