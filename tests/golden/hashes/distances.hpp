// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distance fields: bands and whole fields, centres and corners, signs of several rules and without one, of closed, open
// and broken meshes, by draws and in a crop; and what a fragment has.

#include "cases.hpp"

namespace golden {

struct parts_of_distance {
    template <class Varyings>
    VOXELPIPE_HD auto operator()(const vp::distance_fragment<Varyings>& f) const {
        return vp::outputs(f.distance, f.barycentric, f.to_closest,
                           mixed(f.primitive, f.draw * 4u + (f.in_band ? 2u : 0u) + (f.inside ? 1u : 0u)) ^
                               static_cast<std::uint32_t>(f.side));
    }
};

template <class Backend>
void distance_values(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                     const vp::distance_options& options) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, parts_of_distance>;
    std::vector<vp::mesh<Backend>> meshes;
    for (const mesh_data& m : bodies) meshes.push_back(upload(backend, m));
    std::vector<draw_type> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, {}});
    const vp::grid samples = options.sample == vp::sample::corner ? grid.at_corners() : grid;
    vp::framebuffer<Backend, vp::target<float, vp::blend::replace>, vp::target<glm::vec3, vp::blend::replace>,
                    vp::target<glm::vec3, vp::blend::replace>, vp::target<std::uint32_t, vp::blend::replace>>
        fb{backend, samples.extent};
    add_solid_counts(d, vp::voxelize_distance(backend, draws, grid, fb, options));
    vp::core::for_each_index<4>([&]<std::size_t I>() { d.add(vp::get<I>(fb).to_host(backend)); });
}

template <class Backend>
void add_distances(case_table<Backend>& cases) {
    const auto add = [&](const std::string& name, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                         const vp::distance_options& options) {
        cases.push_back({"distance." + name,
                         [=](Backend& backend, digest& d) { distance_values(backend, d, bodies, grid, options); }});
    };
    const auto of = [](const char* name) { return std::vector<mesh_data>{hashed_mesh(name)}; };
    const vp::grid small = grid_of({19, 17, 22});
    vp::distance_options band;
    band.band = 2;
    for (const char* const mesh : {"torus", "soup"}) add(mesh, of(mesh), small, band);
    vp::distance_options even = band;
    even.rule = vp::fill_rule::even_odd;
    even.sample = vp::sample::corner;
    add("corners.even_odd.shells", of("shells"), small, even);
    vp::distance_options lids = band;
    lids.repair = vp::repair::close_holes;
    add("close_holes.open", of("open"), small, lids);
    lids.repair = vp::repair::winding;
    add("winding.open", of("open"), small, lids);
    vp::distance_options plain = band;
    plain.sign = vp::distance_sign::none;
    plain.band = vp::band::whole;
    add("whole.unsigned.torus", of("torus"), grid_of({9, 8, 10}), plain);
    vp::distance_options by_draws = band;
    by_draws.bodies = vp::bodies::draw;
    add("draws.shells", shells(), small.crop({2, 3, 4}, {13, 11, 12}), by_draws);
}

} // namespace golden
