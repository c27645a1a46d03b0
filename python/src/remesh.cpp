// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "report.hpp"

#include <bindings/parts.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <nanobind/stl/optional.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelpipe::python {
namespace {

place place_named(const std::string& name) {
    return name == "corner" ? place::corner : name == "mean" ? place::mean : place::sharp;
}

nb::dict report_surface(const status& s) {
    nb::dict d = report_solid(s);
    d["components"] = s.surface.components;
    d["components_left_out"] = s.surface.components_left_out;
    d["cone_crossings"] = s.surface.cone_crossings;
    d["made_crossings"] = s.surface.made_crossings;
    d["nan_samples"] = s.surface.nan_samples;
    return d;
}

// (vertices, faces, cell, sheet, source, counters); source is empty where the surface has none. `world`: the grid of
// the samples, as vertices are to be placed.
nb::tuple arrays_of(cpu_backend& backend, const surface<cpu_backend>& made, const grid& world, const status& s) {
    std::vector<double> vertices;
    std::vector<std::int32_t> cells;
    std::vector<std::uint8_t> sheets;
    std::vector<std::uint32_t> faces;
    std::vector<std::int64_t> sources;
    const std::size_t n = made.vertices.size();
    const std::size_t corners = made.quads.size() != 0 ? 4 : 3,
                      m = made.quads.size() != 0 ? made.quads.size() : made.triangles.size();
    {
        const nb::gil_scoped_release released;
        vertices.reserve(3 * n);
        for (const surface_vertex& v : made.vertices.to_host(backend)) {
            const glm::dvec3 p = position(world, v);
            vertices.insert(vertices.end(), {p.x, p.y, p.z});
            cells.insert(cells.end(), {v.cell.x, v.cell.y, v.cell.z});
            sheets.push_back(static_cast<std::uint8_t>(v.sheet));
        }
        for (const glm::uvec3& t : made.triangles.to_host(backend)) faces.insert(faces.end(), {t.x, t.y, t.z});
        for (const glm::uvec4& q : made.quads.to_host(backend)) faces.insert(faces.end(), {q.x, q.y, q.z, q.w});
        for (const std::uint32_t from : made.sources.to_host(backend))
            sources.push_back(from == UINT32_MAX ? std::int64_t{-1} : std::int64_t{from});
    }
    const std::size_t with_source = sources.size();
    return nb::make_tuple(to_numpy(std::move(vertices), {n, 3}), to_numpy(std::move(faces), {m, corners}),
                          to_numpy(std::move(cells), {n, 3}), to_numpy(std::move(sheets), {n}),
                          to_numpy(std::move(sources), {with_source}), report_surface(s));
}

// make(backend, surface) makes the surface, without Python's lock.
template <class Make>
nb::tuple made_surface(const grid& world, unsigned threads, const Make& make) {
    cpu_backend backend{threads};
    surface<cpu_backend> made(backend);
    status s;
    {
        const nb::gil_scoped_release released;
        s = make(backend, made);
    }
    return arrays_of(backend, made, world, s);
}

// As voxelpipe/_remesh.py has them. Throws ValueError.
nb::tuple remesh_parts(const position_array& positions, const triangle_array& triangles,
                       const std::vector<std::uint64_t>& first_triangles, const grid& g, const grid& world,
                       const std::string& sign, const std::string& repair_name, const std::string& bodies_name,
                       std::optional<std::uint64_t> max_hole_edges, int closing, const std::string& place_name,
                       double level, bool quads, std::uint32_t min_component, unsigned threads) {
    const solid_options solid = solid_options_named(sign, "outer", repair_name, bodies_name, max_hole_edges, closing);
    remesh_options options;
    options.place = place_named(place_name);
    options.rule = solid.rule;
    options.bodies = solid.bodies;
    options.repair = solid.repair;
    options.closing = solid.closing;
    options.max_hole_edges = solid.max_hole_edges;
    options.level = level;
    options.quads = quads;
    options.min_component = min_component;
    const mesh_view<> mesh = view_of(positions, triangles);
    return made_surface(world, threads, [&](cpu_backend& backend, surface<cpu_backend>& made) {
        const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, none>>(mesh, first_triangles, none{});
        return remesh(backend, draws, g, made, options);
    });
}

extract_options extract_options_named(const std::string& place_name, double level, bool open, bool quads,
                                      std::uint32_t min_component) {
    return {place_named(place_name), level, open ? border::open : border::closed, quads, min_component};
}

// (nz, ny, nx) bytes that are 0 or not.
nb::tuple extract_bits(const array<const std::uint8_t, 3>& values, const grid& g, const std::string& place_name,
                       bool open, bool quads, std::uint32_t min_component, unsigned threads) {
    expect_shape(values, g, "the array");
    using bits = target<bit, blend::replace>;
    const extract_options options = extract_options_named(place_name, 0.0, open, quads, min_component);
    return made_surface(g, threads, [&](cpu_backend& backend, surface<cpu_backend>& made) {
        framebuffer<cpu_backend, bits> inside(backend, g.extent);
        const target_view<bits>& view = get<0>(inside.view().targets);
        const std::uint8_t* const from = values.data();
        std::size_t i = 0;
        for (int z = 0; z < g.extent.z; ++z)
            for (int y = 0; y < g.extent.y; ++y)
                for (int x = 0; x < g.extent.x; ++x) view.store(x, y, z, from[i++] != 0);
        return extract(backend, view, g, made, options);
    });
}

nb::tuple extract_field(const array<const float, 3>& values, const grid& g, const std::string& place_name, double level,
                        bool open, bool quads, std::uint32_t min_component, unsigned threads) {
    expect_shape(values, g, "the array");
    using field = target<float, blend::replace>;
    const extract_options options = extract_options_named(place_name, level, open, quads, min_component);
    return made_surface(g, threads, [&](cpu_backend& backend, surface<cpu_backend>& made) {
        // The view is of a target that could be written; extract reads it.
        const target_view<field> view{const_cast<float*>(values.data()), g.extent}; // NOLINT(*-const-cast)
        return extract(backend, view, g, made, options);
    });
}

} // namespace

void bind_remesh(nb::module_& m) {
    m.def("remesh", &remesh_parts, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("world"), nb::arg("sign"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("closing"), nb::arg("place"), nb::arg("level"), nb::arg("quads"),
          nb::arg("min_component"), nb::arg("threads"));
    m.def("extract_bits", &extract_bits, nb::arg("values"), nb::arg("grid"), nb::arg("place"), nb::arg("open"),
          nb::arg("quads"), nb::arg("min_component"), nb::arg("threads"));
    m.def("extract_field", &extract_field, nb::arg("values"), nb::arg("grid"), nb::arg("place"), nb::arg("level"),
          nb::arg("open"), nb::arg("quads"), nb::arg("min_component"), nb::arg("threads"));
}

} // namespace voxelpipe::python
