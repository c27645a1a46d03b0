// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces: remesh of closed, open and broken meshes in each place, at a level, as quads, without intersections;
// extract of bits and of a field; values of vertices. In slabs, in bricks and of streams: the arrays of all pieces, one
// after the other.

#include "cases.hpp"

#include <voxelpipe/slabs/stream_surface.hpp>
#include <voxelpipe/surfaces/remesh_slab.hpp>
#include <voxelpipe/surfaces/remesh_sparse.hpp>

#include <algorithm>

namespace golden {

template <class Backend>
void add_surface_arrays(Backend& backend, digest& d, const vp::surface<Backend>& surface) {
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

inline void add_surface_counts(digest& d, const vp::surface_counters& c) {
    d.add(std::vector<std::uint64_t>{c.vertices, c.faces, c.components, c.made_crossings, c.cone_crossings,
                                     c.nan_samples});
}
template <class Backend>
void add_surface(Backend& backend, digest& d, const vp::surface<Backend>& surface, const vp::status& s) {
    add_solid_counts(d, s);
    add_surface_counts(d, s.surface);
    add_surface_arrays(backend, d, surface);
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

// The rounds of `embedded` besides.
template <class Backend>
void embedded(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid) {
    const vp::mesh<Backend> mesh = upload(backend, m);
    vp::surface<Backend> surface(backend);
    vp::remesh_options options;
    options.embedded = true;
    const vp::status s = vp::remesh(backend, mesh, grid, vp::passthrough{}, surface, options);
    add_surface(backend, d, surface, s);
    d.add(std::vector<std::uint64_t>{s.surface.embed_rounds, s.surface.moved_vertices, s.surface.intersecting_pairs});
}

// In slabs of five layers.
template <class Backend>
void remeshed_in_slabs(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid,
                       const vp::remesh_options& options) {
    const vp::mesh<Backend> mesh = upload(backend, m);
    const int layers = grid.extent.z + (options.sample == vp::sample::corner ? 1 : 0);
    for (vp::surface_slab slab; slab.first < layers; slab.first += slab.layers) {
        slab.layers = std::min(5, layers - slab.first);
        vp::surface<Backend> part(backend);
        const vp::status s = vp::remesh_slab(backend, mesh, grid, vp::passthrough{}, slab, part, options);
        s.or_throw();
        add_surface_counts(d, s.surface);
        add_surface_arrays(backend, d, part);
        slab.first_vertex += s.surface.vertices;
    }
}
template <class Backend>
void remeshed_in_bricks(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid,
                        const vp::remesh_options& options) {
    const vp::mesh<Backend> mesh = upload(backend, m);
    vp::surface<Backend> surface(backend);
    add_surface(backend, d, surface, vp::remesh_sparse(backend, mesh, grid, vp::passthrough{}, surface, options));
}

// The mesh in chunks of 100 triangles, its solid or its distances in four slabs.
template <class Backend>
void streamed(Backend& backend, digest& d, const mesh_data& m, const vp::grid& grid, vp::repair repair, double level) {
    vp::slabs::stream_options how;
    how.num_slabs = 4;
    how.repair = repair;
    how.is_solid = level == 0;
    vp::distance_options distances;
    distances.repair = repair;
    if (level != 0) how.band = distances.band;
    vp::slabs::stream<Backend, vp::passthrough> stream(backend, grid, {}, how);
    for (std::size_t i = 0; i < m.triangles.size(); i += 100) {
        vp::mesh_view<> chunk{m.positions, m.triangles};
        const std::size_t count = std::min<std::size_t>(100, m.triangles.size() - i);
        chunk.triangles = vp::array_view<const glm::uvec3>(m.triangles.data() + i, count);
        stream.add(chunk).or_throw();
    }
    const auto sink = [&](const vp::surface_slab&, const vp::surface<Backend>& part) {
        add_surface_arrays(backend, d, part);
    };
    vp::extract_options options;
    options.level = level;
    vp::solid_options solid;
    solid.repair = repair;
    const vp::status s = level == 0 ? vp::slabs::extract_solid(stream, sink, options, solid)
                                    : vp::slabs::extract_distance(stream, sink, options, distances);
    add_solid_counts(d, s);
    add_surface_counts(d, s.surface);
}

template <class Backend>
void add_pieces_of_surfaces(case_table<Backend>& cases) {
    const vp::grid grid = grid_of({19, 17, 22});
    vp::remesh_options level, lids;
    level.level = 0.75;
    level.quads = true;
    lids.repair = vp::repair::close_holes;
    lids.sample = vp::sample::corner;
    const std::pair<const char*, vp::remesh_options> all[] = {{"shells", {}}, {"open", lids}, {"torus", level}};
    for (const auto& [mesh, options] : all) {
        cases.push_back({std::string("surfaces.slabs.") + mesh,
                         [=, o = options, m = hashed_mesh(mesh)](Backend& backend, digest& d) {
                             remeshed_in_slabs(backend, d, m, grid, o);
                         }});
        cases.push_back({std::string("surfaces.bricks.") + mesh,
                         [=, o = options, m = hashed_mesh(mesh)](Backend& backend, digest& d) {
                             remeshed_in_bricks(backend, d, m, grid, o);
                         }});
    }
    cases.push_back({"surfaces.stream.solid.open", [=, m = hashed_mesh("open")](Backend& backend, digest& d) {
                         streamed(backend, d, m, grid, vp::repair::vote, 0);
                     }});
    cases.push_back({"surfaces.stream.level.shells", [=, m = hashed_mesh("shells")](Backend& backend, digest& d) {
                         streamed(backend, d, m, grid, vp::repair::none, 0.5);
                     }});
    cases.push_back({"surfaces.embedded.soup",
                     [=, m = hashed_mesh("soup")](Backend& backend, digest& d) { embedded(backend, d, m, grid); }});
}

template <class Backend>
void add_surfaces(case_table<Backend>& cases) {
    add_pieces_of_surfaces(cases);
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
    vp::remesh_options winding;
    winding.repair = vp::repair::winding;
    remesh("winding", "open", winding);
    vp::remesh_options exterior;
    exterior.repair = vp::repair::exterior;
    exterior.closing = 1;
    remesh("exterior", "open", exterior);
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
