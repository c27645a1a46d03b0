// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids: every rule, extent and kind of body, repairs, values and lists.

#include "cases.hpp"

#include <utility>

namespace golden {

struct winding_of {
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const {
        return vp::outputs(f.winding, f.draw + mixed(static_cast<std::uint32_t>(f.voxel.x), f.draw) % 3u);
    }
};
struct number_of_body {
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const {
        return vp::outputs(glm::ivec4(f.voxel, static_cast<int>(f.winding) + 1000 * static_cast<int>(f.draw)));
    }
};

// Draws each mesh with a constant: the voxels.
template <class Backend>
void solid_bits(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                const vp::solid_options& options) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    std::vector<vp::mesh<Backend>> meshes;
    for (const mesh_data& m : bodies) meshes.push_back(upload(backend, m));
    std::vector<draw_type> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, vp::constant(true)});
    vp::framebuffer<Backend, vp::target<vp::bit, vp::blend::bit_or>> fb{backend, grid.extent};
    add_solid_counts(d, vp::voxelize_solid(backend, draws, grid, fb, options));
    d.add(vp::get<0>(fb).to_host(backend));
}
// With values of each voxel.
template <class Backend>
void solid_values(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                  const vp::solid_options& options) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, winding_of>;
    std::vector<vp::mesh<Backend>> meshes;
    for (const mesh_data& m : bodies) meshes.push_back(upload(backend, m));
    std::vector<draw_type> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, {}});
    vp::framebuffer<Backend, vp::target<std::int64_t, vp::blend::add>, vp::target<std::uint32_t, vp::blend::replace>>
        fb{backend, grid.extent};
    add_solid_counts(d, vp::voxelize_solid(backend, draws, grid, fb, options));
    d.add(vp::get<0>(fb).to_host(backend));
    d.add(vp::get<1>(fb).to_host(backend));
}
template <class Backend>
void solid_list(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid,
                const vp::solid_options& options) {
    vp::abuffer<Backend, glm::ivec4> lists{backend};
    const auto drawn = upload(backend, m);
    add_solid_counts(d, vp::voxelize_solid(backend, drawn, grid, vp::passthrough{}, number_of_body{}, lists, options));
    add_list(d, lists.to_host(backend));
}

template <class Backend>
void add_solids(case_table<Backend>& cases) {
    const std::vector<std::pair<const char*, vp::fill_rule>> rules{{"nonzero", vp::fill_rule::nonzero},
                                                                   {"even_odd", vp::fill_rule::even_odd},
                                                                   {"positive", vp::fill_rule::positive}};
    const std::vector<std::pair<const char*, vp::solid_extent>> extents{
        {"centre", vp::solid_extent::centre}, {"outer", vp::solid_extent::outer}, {"inner", vp::solid_extent::inner}};
    const std::vector<std::pair<const char*, vp::bodies>> kinds{{"call", vp::bodies::call}, {"draw", vp::bodies::draw}};
    const auto add = [&](const std::string& name, auto run, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                         const vp::solid_options& options) {
        cases.push_back(
            {"solid." + name, [=](Backend& backend, digest& d) { run(backend, d, bodies, grid, options); }});
    };
    const auto bits = solid_bits<Backend>;
    const auto values = solid_values<Backend>;
    const auto of = [](const char* name) { return std::vector<mesh_data>{hashed_mesh(name)}; };
    for (const auto& [rule_name, rule] : rules)
        for (const auto& [extent_name, extent] : extents) {
            for (const auto& [kind_name, kind] : kinds) {
                vp::solid_options o;
                o.rule = rule;
                o.extent = extent;
                o.bodies = kind;
                const std::string name = std::string(rule_name) + '.' + extent_name + '.' + kind_name;
                add(name + ".shells", bits, shells(), odd_grid(), o);
                if (extent == vp::solid_extent::outer)
                    add("values." + name + ".shells", values, shells(), odd_grid(), o);
            }
            vp::solid_options o;
            o.rule = rule;
            o.extent = extent;
            if (extent == vp::solid_extent::inner) continue;
            for (const char* const mesh : {"torus", "soup", "open"})
                add(std::string(rule_name) + '.' + extent_name + '.' + mesh, bits, of(mesh), odd_grid(), o);
        }
    for (const char* const mesh : {"torus", "shells"})
        add(std::string("crop.") + mesh, values, of(mesh), crop_of_odd_grid(), {});
    add("large.torus", bits, of("torus"), grid_of({96, 64, 80}), {});

    for (const char* const mesh : {"open", "soup", "shells"}) {
        const std::string name = std::string(".") + mesh;
        vp::solid_options o;
        o.repair = vp::repair::close_holes;
        add("close_holes.centre" + name, bits, of(mesh), odd_grid(), o);
        o.extent = vp::solid_extent::outer;
        add("close_holes.outer" + name, values, of(mesh), odd_grid(), o);
        o.max_hole_edges = 8;
        add("close_holes.few_edges" + name, bits, of(mesh), odd_grid(), o);
        o = {};
        o.repair = vp::repair::winding;
        add("winding.centre" + name, bits, of(mesh), odd_grid(), o);
        add("winding.crop" + name, bits, of(mesh), crop_of_odd_grid(), o);
        o.rule = vp::fill_rule::positive;
        o.extent = vp::solid_extent::outer;
        add("winding.positive" + name, values, of(mesh), odd_grid(), o);
        o = {};
        o.repair = vp::repair::vote;
        add("vote" + name, bits, of(mesh), odd_grid(), o);
        add("vote.crop" + name, bits, of(mesh), crop_of_odd_grid(), o);
        o.repair = vp::repair::exterior;
        for (const int closing : {0, 1, 4}) {
            o.closing = closing;
            add("exterior." + std::to_string(closing) + name, bits, of(mesh), odd_grid(), o);
        }
    }
    for (const char* const mesh : {"torus", "shells", "open"})
        cases.push_back({std::string("solid.list.") + mesh, [m = hashed_mesh(mesh)](Backend& backend, digest& d) {
                             solid_list(backend, d, m, grid_of({23, 19, 26}), {});
                         }});
}

} // namespace golden
