// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cut cells: fractions, apertures and sums of closed, open and broken meshes, by each axis, by draws and in a crop; all
// that a shader can ask for; with holes closed; lists of bodies; bricks and tiles; and links.

#include "cases.hpp"

#include <utility>

namespace golden {

struct parts_of_cell {
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return vp::outputs(f.fraction, f.units, f.aperture, f.next_aperture,
                           mixed(f.draw, f.is_cut ? 1u : 0u) ^ static_cast<std::uint32_t>(f.voxel.y));
    }
};

struct measures_of_cell {
    using fragment = vp::measured_cell<vp::cell_value::centroid, vp::cell_value::area, vp::cell_value::sheets>;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        return vp::outputs(f.centroid.x, f.centroid.y, f.centroid.z, f.area, f.area_centroid.x, f.area_centroid.y,
                           f.area_centroid.z, mixed(f.is_multi_cut ? 3u : 2u, f.is_cut ? 1u : 0u));
    }
};

struct faces_of_cell {
    using fragment = vp::measured_cell<vp::cell_value::faces>;
    VOXELPIPE_HD auto operator()(const fragment& f) const {
        const glm::vec3 &a = f.aperture_centroid, &b = f.next_aperture_centroid;
        return vp::outputs(a.x, a.y, a.z, b.x, b.y, b.z);
    }
};

struct units_of_cell {
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return vp::outputs(f.units).discard_if(f.voxel.x % 7 == 3 && f.draw == 1);
    }
};

template <class Backend, class... Targets, class Shader>
void cell_values_into(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                      const vp::cell_options& options, const Shader& shader,
                      vp::framebuffer<Backend, Targets...>&& fb) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    std::vector<vp::mesh<Backend>> meshes;
    for (const mesh_data& m : bodies) meshes.push_back(upload(backend, m));
    std::vector<draw_type> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, shader});
    const vp::status s = vp::voxelize_cells(backend, draws, grid, fb, options);
    add_counts(d, s);
    const vp::cell_counters& c = s.cells;
    d.add(std::vector<std::uint64_t>{c.volume_low, static_cast<std::uint64_t>(c.volume_high), c.cut_voxels,
                                     c.below_zero, c.above_one, c.open_rows, c.open_edges, c.cell_records});
    if (c.lost_centroids != 0) d.add(std::vector<std::uint64_t>{c.lost_centroids});
    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { d.add(vp::get<I>(fb).to_host(backend)); });
}

template <class Backend>
void cell_values(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                 const vp::cell_options& options) {
    using number = vp::target<std::int64_t, vp::blend::add>;
    cell_values_into(backend, d, bodies, grid, options, parts_of_cell{},
                     vp::framebuffer<Backend, vp::target<float, vp::blend::replace>, number, number, number,
                                     vp::target<std::uint32_t, vp::blend::bit_xor>>{backend, grid.extent});
}
template <class Backend>
void cell_measures(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                   const vp::cell_options& options) {
    using number = vp::target<float, vp::blend::replace>;
    cell_values_into(
        backend, d, bodies, grid, options, measures_of_cell{},
        vp::framebuffer<Backend, number, number, number, vp::target<double, vp::blend::replace>, number, number, number,
                        vp::target<std::uint32_t, vp::blend::bit_xor>>{backend, grid.extent});
}

template <class Backend>
void cell_faces(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                const vp::cell_options& options) {
    using number = vp::target<float, vp::blend::replace>;
    cell_values_into(backend, d, bodies, grid, options, faces_of_cell{},
                     vp::framebuffer<Backend, number, number, number, number, number, number>{backend, grid.extent});
}
template <class Backend>
void cell_lists(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                const vp::cell_options& options) {
    std::vector<vp::mesh<Backend>> meshes;
    for (const mesh_data& m : bodies) meshes.push_back(upload(backend, m));
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, units_of_cell>> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, {}});
    vp::abuffer<Backend, std::int64_t> lists{backend};
    add_counts(d, vp::voxelize_cells(backend, draws, grid, lists, options));
    add_list(d, lists.to_host(backend));
}

// Bricks, with tiles where the shader ignores the voxel.
struct placeless_cell {
    static constexpr bool ignores_voxel = true;
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return vp::outputs(f.fraction, f.next_aperture, f.is_cut);
    }
};
struct placed_cell {
    VOXELPIPE_HD auto operator()(const vp::cell_fragment& f) const {
        return placeless_cell{}(f).discard_if(f.voxel.x % 3 == 1);
    }
};
template <class Backend, class Shader>
void sparse_cell_values(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                        const vp::cell_options& options, const Shader& shader) {
    std::vector<vp::mesh<Backend>> meshes;
    for (const mesh_data& m : bodies) meshes.push_back(upload(backend, m));
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Shader>> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, shader});
    vp::sparse_framebuffer<Backend, vp::target<float, vp::blend::add>, vp::target<std::int64_t, vp::blend::max>,
                           vp::target<vp::bit, vp::blend::bit_or>>
        fb(backend, grid.extent);
    add_counts(d, vp::voxelize_cells(backend, draws, grid, fb, options));
    add_sparse_contents(d, fb.to_host(backend));
}

template <class Backend>
void link_values(Backend& backend, digest& d, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                 int neighbours) {
    std::vector<vp::mesh<Backend>> meshes;
    for (const mesh_data& m : bodies) meshes.push_back(upload(backend, m));
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, vp::none>> draws;
    for (const auto& m : meshes) draws.push_back({m.view(), {}, {}});
    vp::link_list<Backend> links(backend);
    vp::link_options options;
    options.neighbours = neighbours;
    add_counts(d, vp::voxelize_links(backend, draws, grid, links, options));
    std::vector<std::int32_t> voxels;
    for (const glm::ivec3& p : links.voxels.to_host(backend)) voxels.insert(voxels.end(), {p.x, p.y, p.z});
    d.add(voxels);
    d.add(links.q.to_host(backend));
    d.add(links.primitives.to_host(backend));
    d.add(links.draws.to_host(backend));
}

template <class Backend>
void add_cells(case_table<Backend>& cases) {
    const auto add = [&](const std::string& name, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                         const vp::cell_options& options) {
        cases.push_back(
            {"cells." + name, [=](Backend& backend, digest& d) { cell_values(backend, d, bodies, grid, options); }});
    };
    const auto of = [](const char* name) { return std::vector<mesh_data>{hashed_mesh(name)}; };
    for (const char* const mesh : {"torus", "soup", "open"}) add(mesh, of(mesh), odd_grid(), {});
    for (const int axis : {1, 2}) {
        vp::cell_options o;
        o.axis = axis;
        add(std::string("axis.") + "xyz"[axis] + ".soup", of("soup"), odd_grid(), o);
    }
    vp::cell_options by_draws;
    by_draws.bodies = vp::bodies::draw;
    add("draws.shells", shells(), odd_grid(), by_draws);
    add("crop.shells", of("shells"), crop_of_odd_grid(), {});
    const auto measure = [&](const std::string& name, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                             const vp::cell_options& options) {
        cases.push_back({"cells.measures." + name,
                         [=](Backend& backend, digest& d) { cell_measures(backend, d, bodies, grid, options); }});
    };
    for (const char* const mesh : {"torus", "soup", "open"}) measure(mesh, of(mesh), odd_grid(), {});
    vp::cell_options by_y = by_draws;
    by_y.axis = 1;
    measure("draws.axis.y.shells", shells(), odd_grid(), by_y);
    measure("crop.shells", of("shells"), crop_of_odd_grid(), {});
    vp::cell_options closed;
    closed.repair = vp::repair::close_holes;
    add("closed.open", of("open"), odd_grid(), closed);
    vp::cell_options by_z = by_draws;
    by_z.axis = 2;
    const auto list = [&](const std::string& name, const vp::grid& grid, const vp::cell_options& options) {
        cases.push_back({"cells.lists.draws." + name,
                         [=](Backend& backend, digest& d) { cell_lists(backend, d, shells(), grid, options); }});
    };
    list("shells", odd_grid(), by_draws);
    list("axis.z.crop.shells", crop_of_odd_grid(), by_z);
    const auto faces = [&](const std::string& name, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                           const vp::cell_options& options) {
        cases.push_back({"cells.faces." + name,
                         [=](Backend& backend, digest& d) { cell_faces(backend, d, bodies, grid, options); }});
    };
    for (const char* const mesh : {"torus", "soup"}) faces(mesh, of(mesh), odd_grid(), {});
    faces("draws.axis.y.shells", shells(), odd_grid(), by_y);
    cases.push_back({"cells.sparse.shells", [](Backend& backend, digest& d) {
                         sparse_cell_values(backend, d, shells(), odd_grid(), {}, placeless_cell{});
                     }});
    cases.push_back({"cells.sparse.draws.axis.z.crop.shells", [by_z](Backend& backend, digest& d) {
                         sparse_cell_values(backend, d, shells(), crop_of_odd_grid(), by_z, placeless_cell{});
                     }});
    cases.push_back({"cells.sparse.placed.soup", [soup = of("soup")](Backend& backend, digest& d) {
                         sparse_cell_values(backend, d, soup, odd_grid(), {}, placed_cell{});
                     }});
    const auto link = [&](const std::string& name, const std::vector<mesh_data>& bodies, const vp::grid& grid,
                          int neighbours) {
        cases.push_back({"cells.links." + name,
                         [=](Backend& backend, digest& d) { link_values(backend, d, bodies, grid, neighbours); }});
    };
    for (const char* const mesh : {"torus", "soup"}) link(mesh, of(mesh), odd_grid(), 26);
    link("draws.crop.shells", shells(), crop_of_odd_grid(), 18);
}

} // namespace golden
