// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Shared by the cases: meshes, grids, and functions that add results to a digest.

#include "golden.hpp"
#include "meshes.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <vector>

namespace golden {

namespace vp = voxelpipe;

inline vp::grid unit_grid(glm::ivec3 extent) {
    vp::grid g;
    g.extent = extent;
    return g;
}

// Odd extents, three different voxel sizes, an origin that is no power of two.
inline vp::grid odd_grid() {
    vp::grid g;
    g.extent = {97, 61, 83};
    g.origin = {-7.3, 1.0 / 3.0, -11.0 / 7.0};
    g.voxel_size = {1.1, 0.7, 1.0 / 0.9};
    return g;
}

inline const mesh_data& small_soup() {
    static const mesh_data m = soup(1, 4000, 12, -16, 112);
    return m;
}
inline const mesh_data& large_soup() {
    static const mesh_data m = soup(2, 60, 300, -120, 120);
    return m;
}
inline const mesh_data& box() {
    static const mesh_data m = bumpy_box(3, 48, 3);
    return m;
}

// The counters of a status are part of the contract too.
inline void add_counts(digest& digest, const vp::status& s) {
    s.or_throw();
    const vp::counters& c = s.counts;
    digest.add(std::vector<std::uint64_t>{c.triangles_in, c.triangles_nonfinite, c.triangles_too_far,
                                          c.triangles_zero_area, c.triangles_outside, c.triangles_drawn, c.fragments,
                                          c.fragments_discarded, c.voxels});
}

template <class Framebuffer>
void add_targets(digest& digest, vp::cpu_backend& backend, Framebuffer& fb) {
    vp::core::for_each_index<Framebuffer::view_type::num_targets>(
        [&]<std::size_t I>() { digest.add(vp::get<I>(fb).to_host(backend)); });
}

template <class... Targets, class... Attributes, class VertexShader, class FragmentShader>
void draw(digest& digest, unsigned threads, const vp::mesh_view<Attributes...>& mesh, const vp::grid& grid,
          const VertexShader& vertex_shader, const FragmentShader& fragment_shader, vp::coverage rule) {
    vp::cpu_backend backend{threads};
    vp::framebuffer<vp::cpu_backend, Targets...> fb{backend, grid.extent};
    add_counts(digest, vp::voxelize(backend, mesh, grid, vertex_shader, fragment_shader, fb, rule));
    add_targets(digest, backend, fb);
}

inline constexpr vp::coverage conservative = vp::coverage::conservative;
inline constexpr vp::coverage thin = vp::coverage::thin;

} // namespace golden
