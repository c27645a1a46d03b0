// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces: remesh of closed, open and broken meshes in each place, at a level, as quads; extract of bits and of a
// field; values of vertices.

#include "cases.hpp"

namespace golden {

template <class Backend>
void add_surface(Backend& backend, digest& d, const vp::surface<Backend>& surface, const vp::status& s) {
    add_solid_counts(d, s);
    const vp::surface_counters& c = s.surface;
    d.add(std::vector<std::uint64_t>{c.vertices, c.faces, c.components, c.made_crossings, c.cone_crossings,
                                     c.nan_samples});
    std::vector<std::int32_t> cells;
    std::vector<std::uint16_t> places;
    for (const vp::surface_vertex& v : surface.vertices.to_host(backend)) {
        cells.insert(cells.end(), {v.cell.x, v.cell.y, v.cell.z});
        places.insert(places.end(), {v.q[0], v.q[1], v.q[2], v.sheet});
    }
    d.add(cells);
    d.add(places);
    d.add(surface.triangles.to_host(backend));
    d.add(surface.quads.to_host(backend));
    d.add(surface.sources.to_host(backend));
}

template <class Backend>
void remeshed(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid,
              const vp::remesh_options& options) {
    const vp::mesh<Backend> mesh = upload(backend, m);
    vp::surface<Backend> surface(backend);
    add_surface(backend, d, surface, vp::remesh(backend, mesh, grid, vp::passthrough{}, surface, options));
}

struct surface_place {
    glm::vec3 at;
};
struct hand_place_on {
    VOXELPIPE_HD vp::vertex_output<surface_place> operator()(const vp::vertex<>& v) const {
        return {v.position, {v.position}};
    }
};
// Where, on which triangle, and the normal; a seventh of the triangles has no values.
struct surface_values {
    VOXELPIPE_HD auto operator()(const vp::fragment<surface_place>& f) const {
        return vp::outputs(f.varyings.at, f.normal, f.primitive % 5).discard_if(f.triangle % 7 == 0);
    }
};

template <class Backend>
void remeshed_with_values(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid,
                          const vp::remesh_options& options) {
    const vp::mesh<Backend> mesh = upload(backend, m);
    vp::surface<Backend, glm::vec3, glm::vec3, std::uint32_t> surface(backend);
    const vp::status s = vp::remesh(backend, mesh, grid, hand_place_on{}, surface_values{}, surface, options);
    add_surface(backend, d, surface, s);
    d.add(std::vector<std::uint64_t>{s.surface.nearest_values});
    d.add(vp::get<0>(surface).to_host(backend));
    d.add(vp::get<1>(surface).to_host(backend));
    d.add(vp::get<2>(surface).to_host(backend));
}

// Of the bits of a solid, and of a field of distances.
template <class Backend>
void extracted(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid, bool from_field,
               const vp::extract_options& options) {
    const vp::mesh<Backend> mesh = upload(backend, m);
    vp::surface<Backend> surface(backend);
    if (from_field) {
        vp::framebuffer<Backend, vp::target<float, vp::blend::replace>> field(backend, grid.extent);
        vp::voxelize_distance(backend, mesh, grid, vp::passthrough{}, vp::distance{}, field).or_throw();
        add_surface(backend, d, surface, vp::extract(backend, field, grid, surface, options));
    } else {
        vp::framebuffer<Backend, vp::target<vp::bit, vp::blend::replace>> bits(backend, grid.extent);
        vp::voxelize_solid(backend, mesh, grid, vp::passthrough{}, vp::constant(true), bits).or_throw();
        add_surface(backend, d, surface, vp::extract(backend, bits, grid, surface, options));
    }
}

template <class Backend>
void add_surfaces(case_table<Backend>& cases) {
    const auto remesh = [&](const std::string& name, const char* mesh, const vp::remesh_options& options) {
        const vp::grid grid = grid_of({19, 17, 22});
        cases.push_back({"surfaces." + name + "." + mesh, [=, m = hashed_mesh(mesh)](Backend& backend, digest& d) {
                             remeshed(backend, d, m, grid, options);
                         }});
    };
    for (const auto& [name, place] :
         {std::pair{"corner", vp::place::corner}, {"mean", vp::place::mean}, {"sharp", vp::place::sharp}}) {
        vp::remesh_options o;
        o.place = place;
        remesh(name, "shells", o);
    }
    vp::remesh_options lids;
    lids.repair = vp::repair::close_holes;
    remesh("close_holes", "open", lids);
    remesh("sharp", "soup", {});
    vp::remesh_options level;
    level.level = 0.75;
    level.quads = true;
    remesh("level.quads", "torus", level);
    const auto values = [&](const char* mesh, const vp::remesh_options& options) {
        const vp::grid grid = grid_of({19, 17, 22});
        cases.push_back(
            {std::string("surfaces.values.") + mesh, [=, m = hashed_mesh(mesh)](Backend& backend, digest& d) {
                 remeshed_with_values(backend, d, m, grid, options);
             }});
    };
    values("shells", {});
    values("open", lids);
    values("torus", level);
    const auto extract = [&](const std::string& name, const char* mesh, bool from_field,
                             const vp::extract_options& options) {
        const vp::grid grid = grid_of({19, 17, 22}).crop({3, 2, 1}, {14, 13, 17});
        cases.push_back({"surfaces." + name + "." + mesh, [=, m = hashed_mesh(mesh)](Backend& backend, digest& d) {
                             extracted(backend, d, m, grid, from_field, options);
                         }});
    };
    vp::extract_options open;
    open.border = vp::border::open;
    open.min_component = 20;
    extract("bits.open", "soup", false, open);
    extract("field", "shells", true, {});
}

} // namespace golden
