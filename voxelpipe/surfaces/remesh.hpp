// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// remesh: any triangles -> what is inside of them -> a closed manifold mesh around it, whose vertices lie where the
// triangles are (docs/design.md, "Surfaces"). On any backend, with the same bytes.

#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/passes/gather_mesh.hpp>
#include <voxelpipe/surfaces/passes/vertex_values.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

// Written {.repair = repair::close_holes, .place = place::mean}.
struct remesh_options {
    voxelpipe::place place = voxelpipe::place::sharp;     // where vertices lie
    voxelpipe::sample sample = voxelpipe::sample::centre; // where samples lie
    // What is inside, as in solid_options.
    fill_rule rule = fill_rule::nonzero;                // which windings are inside
    voxelpipe::bodies bodies = voxelpipe::bodies::call; // of what: all draws together, or each by itself
    voxelpipe::repair repair = voxelpipe::repair::none; // of meshes that are not closed
    int closing = 0;                                    // of repair::exterior, in voxels
    std::uint64_t max_hole_edges = std::numeric_limits<std::uint64_t>::max(); // of holes that close_holes closes
    // World units. Not 0: the surface lies where the signed distance is `level`; above 0 bodies grow by it, and a sheet
    // becomes a closed plate twice as thick. Vertices with place::sharp then lie as with place::mean.
    double level = 0.0;
    voxelpipe::border border = voxelpipe::border::closed; // at the faces of the grid
    bool quads = false;                                   // quads in place of triangles
    std::uint32_t min_component = 0;                      // components of fewer vertices are left out
    bool embedded = false; // triangles that intersect each other are undone, as with extract_options::embedded
};

namespace core {

[[nodiscard]] inline extract_options extract_options_of(const remesh_options& o) {
    return {o.place, o.level, o.border, o.quads, o.min_component, o.embedded};
}
[[nodiscard]] inline solid_options sign_options(const remesh_options& o) {
    solid_options s;
    s.rule = o.rule;
    s.bodies = o.bodies;
    s.repair = o.repair;
    s.closing = o.closing;
    s.max_hole_edges = o.max_hole_edges;
    s.with_cover = !may_have_cover(o.repair);
    s.count_voxels = false;
    return s;
}
// The fields that reach the level's cells.
[[nodiscard]] inline distance_options level_options(const remesh_options& o, const grid& g) {
    distance_options d;
    const double largest = std::max({g.voxel_size.x, g.voxel_size.y, g.voxel_size.z});
    d.band = band(std::abs(o.level) / largest + 2.0);
    d.sample = o.sample;
    d.rule = o.rule;
    d.bodies = o.bodies;
    d.repair = o.repair;
    d.closing = o.closing;
    d.max_hole_edges = o.max_hole_edges;
    d.count_voxels = false;
    return d;
}

[[nodiscard]] inline status validate(const remesh_options& o, const grid& g) {
    if (const status s = validate(extract_options_of(o)); !s.ok()) return s;
    if (o.sample > sample::corner) return failure(status_code::bad_surface_options);
    if (o.level != 0.0) return validate(level_options(o, g), g);
    return validate(sign_options(o), sample_grid(g, o.sample));
}

// The rule by which crossings of a row change the verdict.
[[nodiscard]] inline fill_rule crossing_rule(const remesh_options& o) {
    return o.repair == repair::vote ? fill_rule::even_odd : o.rule;
}

// The crossings of the mesh with the edges that its surface crosses; those of the layers of cells `counted` count.
template <int Axis, class Backend, class Cells>
void find_mesh_crossings(Backend& backend, const Cells& cells, const gathered_mesh<Backend>& mesh, const grid& samples,
                         const remesh_options& options, edge_crossing* crossings, std::uint64_t* counts,
                         const passes::counted_layers& counted) {
    using numbers = typename Backend::template buffer<std::uint64_t>;
    using words = typename Backend::template buffer<std::uint32_t>;
    const passes::row_keys<Axis> rows(samples.extent);
    const passes::mesh_triangles triangles = mesh.view();
    voxel_box whole{};
    for (int a = 0; a < 3; ++a) whole.hi[a] = samples.extent[a] - 1;
    passes::list_mesh_crossings<Axis> list{triangles, rows,    whole,   samples.fraction(),
                                           nullptr,   nullptr, nullptr, nullptr};
    numbers places(backend, triangles.count + 1);
    std::uint64_t total = 0;
    {
        words of_triangles(backend, triangles.count + 1);
        list.counts = of_triangles.data();
        backend.for_each(triangles.count + 1, list);
        total = backend.sum(of_triangles, places);
    }
    numbers keys(backend, total);
    words found(backend, total);
    list.counts = nullptr;
    list.places = places.data();
    list.keys = keys.data();
    list.triangles = found.data();
    backend.for_each(triangles.count, list);
    backend.sort_by_key(keys, found, rows.key_bits());
    typename Backend::template buffer<passes::row_range> ranges(
        backend, Cells::is_sparse ? 0 : rows.rows()); // in bricks nothing has the grid's size
    if constexpr (!Cells::is_sparse) {
        backend.for_each(rows.rows(), passes::clear_rows{ranges.data()});
        backend.for_each(total, passes::find_rows{keys.data(), total, rows.rows(), rows.bits, ranges.data()});
    }
    for_each_edge<Axis>(backend, cells,
                        passes::cross_mesh<Axis>{triangles, rows, Cells::is_sparse ? nullptr : ranges.data(),
                                                 keys.data(), total, found.data(), crossing_rule(options),
                                                 options.bodies == bodies::draw, samples.fraction(), crossings, counts,
                                                 counted});
}

// Along all axes. A backend may have an overload for its cells.
template <class Backend, class Cells>
void find_all_mesh_crossings(Backend& backend, const Cells& cells, const gathered_mesh<Backend>& mesh,
                             const grid& samples, const remesh_options& options, edge_crossing* crossings,
                             std::uint64_t* counts, const passes::counted_layers& counted) {
    find_mesh_crossings<0>(backend, cells, mesh, samples, options, crossings, counts, counted);
    find_mesh_crossings<1>(backend, cells, mesh, samples, options, crossings, counts, counted);
    find_mesh_crossings<2>(backend, cells, mesh, samples, options, crossings, counts, counted);
}

// What makes the surface of all cells: finish_surface.
struct finish_whole {
    template <class Backend, class Cells>
    [[nodiscard]] status operator()(Backend& backend, const Cells& cells, const grid& samples,
                                    const edge_crossing* crossings, const std::uint32_t* primitives,
                                    const extract_options& options, surface<Backend>& out, const status& result) const {
        return finish_surface(backend, cells, samples, crossings, primitives, options, out, result);
    }
};

// The surface of cells between samples whose sign is known: the crossings of the mesh itself, then shade(mesh, cells,
// crossings, counters), whose status counts where it is not ok. `result` is that of the sign, `counted` are the layers
// of cells whose crossings count, and `finish` is called as finish_whole.
template <class Backend, class Mesh, class VertexShader, class Cells, class Shade, class Finish = finish_whole>
[[nodiscard]] status
remesh_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, constant_output<bool>>> draws,
             const grid& samples, const remesh_options& options, const Cells& cells, surface<Backend>& out,
             const Shade& shade, status result, const passes::counted_layers& counted = {}, const Finish& finish = {}) {
    if (cells.are_too_many()) return too_many_vertices(cells.num_vertices());
    if (cells.count() == 0) {
        out = surface<Backend>(backend);
        out.samples = samples;
        return result;
    }
    std::vector<hole_cones> cones;
    if (has_cones(options.repair))
        cones = run_module(find_holes_tag{}, backend, draws, samples, options.bodies, options.max_hole_edges);
    typename Backend::template buffer<edge_crossing> crossings(backend, cells.num_edges());
    typename Backend::template buffer<std::uint64_t> counts(backend,
                                                            static_cast<std::size_t>(passes::edge_count::count));
    backend.for_each(counts.size(), passes::clear_counts{counts.data()});
    const gathered_mesh<Backend> mesh(backend, draws, samples, cones, options.bodies);
    find_all_mesh_crossings(backend, cells, mesh, samples, options, crossings.data(), counts.data(), counted);
    result = finish(backend, cells, samples, crossings.data(), mesh.view().primitives, extract_options_of(options), out,
                    result);
    if (!result.ok()) return result;
    const std::vector<std::uint64_t> host = counts.to_host(backend);
    result.surface.cone_crossings = host[static_cast<std::size_t>(passes::edge_count::on_cones)];
    result.surface.made_crossings = host[static_cast<std::size_t>(passes::edge_count::made)];
    const status shaded = shade(mesh.view(), &cells, crossings.data(), result.surface);
    return shaded.ok() ? result : shaded;
}

// The surface of a level, whose field `drawn` counted, of extract(grid of samples, out, options).
template <class Backend, class Mesh, class VertexShader, class Extract, class Shade>
[[nodiscard]] status remesh_field(Backend& backend, std::span<const draw<Mesh, VertexShader, distance>> draws,
                                  const grid& samples, const remesh_options& options, surface<Backend>& out,
                                  const Shade& shade, const status& drawn, const Extract& extract) {
    if (!drawn.ok()) return drawn;
    if (drawn.counts.triangles_in == 0) { // the field is clear, not far away
        out = surface<Backend>(backend);
        out.samples = samples;
        return drawn;
    }
    status result = extract(samples, out, extract_options_of(options));
    if (!result.ok()) return result;
    result.counts = drawn.counts;
    result.solid = drawn.solid;
    result.distance = drawn.distance;
    if constexpr (Shade::has_values) {
        const gathered_mesh<Backend> mesh(backend, draws, samples, {}, options.bodies);
        constexpr const surface_cells<Backend>* no_cells = nullptr;
        const status shaded = shade(mesh.view(), no_cells, nullptr, result.surface);
        if (!shaded.ok()) return shaded;
    }
    return result;
}

// Samples are those of the whole grid.
struct remesh_in_grid {
    // Level 0: the sign of the samples, then the rest.
    template <class Backend, class Mesh, class VertexShader, class Shade>
    [[nodiscard]] static status
    run(Backend& backend, std::span<const draw<Mesh, VertexShader, constant_output<bool>>> draws, const grid& g,
        const remesh_options& options, surface<Backend>& out, const Shade& shade) {
        const grid samples = sample_grid(g, options.sample);
        framebuffer<Backend, target<bit, blend::replace>> inside(backend, samples.extent);
        const status result = voxelize_solid(backend, draws, samples, inside, sign_options(options));
        if (!result.ok()) return result;
        const surface_cells<Backend> cells(backend, get<0>(inside.view().targets).elements, samples.extent);
        return remesh_cells(backend, draws, samples, options, cells, out, shade, result);
    }
    // Another level: of the distance.
    template <class Backend, class Mesh, class VertexShader, class Shade>
    [[nodiscard]] static status run(Backend& backend, std::span<const draw<Mesh, VertexShader, distance>> draws,
                                    const grid& g, const remesh_options& options, surface<Backend>& out,
                                    const Shade& shade) {
        const grid samples = sample_grid(g, options.sample);
        framebuffer<Backend, target<float, blend::replace>> field(backend, samples.extent);
        const status drawn = voxelize_distance(backend, draws, g, field, level_options(options, g));
        const auto extract_field = [&](const grid& of, surface<Backend>& to, const extract_options& how) {
            return extract(backend, field, of, to, how);
        };
        return remesh_field(backend, draws, samples, options, out, shade, drawn, extract_field);
    }
};

// Makes the values of a surface; without any it does nothing.
template <class Backend, class Mesh, class VertexShader, class Shader, class... Values>
struct surface_shading {
    static constexpr bool has_values = sizeof...(Values) != 0;
    Backend& backend;
    std::span<const draw<Mesh, VertexShader, Shader>> draws;
    const grid& where;
    double level;
    surface<Backend, Values...>& made;

    template <class Cells>
    status operator()(const passes::mesh_triangles& triangles, const Cells* cells, const edge_crossing* crossings,
                      surface_counters& counts) const {
        if constexpr (has_values)
            return shade_surface(backend, draws, where, triangles, cells, crossings, level, made, counts);
        else
            return {};
    }
};

// True where the shaders go with the mesh, and make values of these types.
template <class Mesh, class VertexShader, class Shader, class... Values>
[[nodiscard]] constexpr bool makes_values() {
    if constexpr (sizeof...(Values) == 0) {
        return check_vertex_shader<Mesh, VertexShader>();
    } else {
        constexpr bool allowed = (vertex_value<Values>::allowed && ...);
        static_assert(allowed, "voxelpipe: values of a surface's vertices are float, glm::vec2 to vec4, or integers");
        if constexpr (allowed && check_shaders<Mesh, VertexShader, Shader>()) {
            constexpr bool fits = std::is_same_v<shader_output<Mesh, VertexShader, Shader>, output<Values...>>;
            static_assert(fits, "voxelpipe: the fragment shader must return vp::outputs(...) of the types of the "
                                "surface's values, in their order");
            return fits;
        } else {
            return false;
        }
    }
}

// Runs a remesh; way.run takes the draws with constant(true) for the surface itself, with distance for a level.
template <class Way, class Backend, class Mesh, class VertexShader, class Shader, class... Values>
[[nodiscard]] status run_remesh(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws,
                                const grid& g, surface<Backend, Values...>& out, const remesh_options& options,
                                const Way& way = {}) {
    if constexpr (makes_values<Mesh, VertexShader, Shader, Values...>()) {
        if (const status s = voxelpipe::validate(g); !s.ok()) return s;
        if (const status s = validate(options, g); !s.ok()) return s;
        if (const status s = validate_draws(draws); !s.ok()) return s;
        return backend.guard([&]() -> status {
            surface<Backend, Values...> made(backend);
            const surface_shading<Backend, Mesh, VertexShader, Shader, Values...> shade{backend, draws, g,
                                                                                        options.level, made};
            const auto run = [&]<class Drawn>(const Drawn& shader) {
                std::vector<draw<Mesh, VertexShader, Drawn>> drawn;
                for (const auto& d : draws) drawn.push_back({d.mesh, d.vertex_shader, shader});
                return way.run(backend, std::span<const draw<Mesh, VertexShader, Drawn>>(drawn), g, options, made,
                               shade);
            };
            const status result = options.level != 0.0 ? run(distance{}) : run(constant(true));
            if (result.ok()) out = std::move(made);
            return result;
        });
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

} // namespace core

// Makes a closed manifold mesh around what lies inside of the draws' triangles: sign, then crossings, then sheets, then
// mesh. The triangles may be open, cross each other, face any way; options say what is inside and what repairs holes.
// Draws share one type of mesh, vertex shader and fragment shader. The surface replaces what `out` holds; out.samples
// is the grid of the samples, with which vp::position places vertices. Fills status::surface, and counts and solid as
// voxelize_solid. Nothing inside gives an empty surface, which is ok. Closed meshes within the grid have no
// made_crossings. Returns after the work is done. A call that fails leaves `out` as it is.
//
// With values in the surface, draw::fragment_shader makes them; without, it is ignored. Its fragment is that of a
// crossing: `barycentric` is exact there, `voxel` the lower sample of the crossed edge, and `normal` looks outward.
// Each crossing is shaded once, and a vertex has the mean of its crossings' floats, and the integer that most of them
// have, of several the least. Crossings without a triangle, or that the shader discards, do not count. A vertex without
// any that counts, and at a level every vertex, has the values of the nearest triangle of all draws at its closest
// point, with the vertex's cell as `voxel` (surface_counters::nearest_values); zeros where the shader discards that.
template <class Backend, class Mesh, class VertexShader, class Shader, class... Values>
[[nodiscard]] status remesh(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws, const grid& g,
                            surface<Backend, Values...>& out, const remesh_options& options = {}) {
    return core::run_remesh<core::remesh_in_grid>(backend, draws, g, out, options);
}

// One mesh.
template <class Backend, class... Attributes, class VertexShader, class... Values>
[[nodiscard]] status remesh(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                            const VertexShader& vertex_shader, surface<Backend, Values...>& out,
                            const remesh_options& options = {}) {
    static_assert(sizeof...(Values) == 0, "voxelpipe: a surface with values needs a fragment shader");
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, none>;
    const draw_type d{mesh, vertex_shader, {}};
    return remesh(backend, std::span<const draw_type>(&d, 1), g, out, options);
}
template <class Backend, class... Attributes, class VertexShader, class... Values>
[[nodiscard]] status remesh(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                            const VertexShader& vertex_shader, surface<Backend, Values...>& out,
                            const remesh_options& options = {}) {
    return remesh(backend, m.view(), g, vertex_shader, out, options);
}

// One mesh, with values of the vertices.
template <class Backend, class... Attributes, class VertexShader, class FragmentShader, class... Values>
[[nodiscard]] status remesh(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                            const VertexShader& vertex_shader, const FragmentShader& fragment_shader,
                            surface<Backend, Values...>& out, const remesh_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, FragmentShader>;
    const draw_type d{mesh, vertex_shader, fragment_shader};
    return remesh(backend, std::span<const draw_type>(&d, 1), g, out, options);
}
template <class Backend, class... Attributes, class VertexShader, class FragmentShader, class... Values>
[[nodiscard]] status remesh(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                            const VertexShader& vertex_shader, const FragmentShader& fragment_shader,
                            surface<Backend, Values...>& out, const remesh_options& options = {}) {
    return remesh(backend, m.view(), g, vertex_shader, fragment_shader, out, options);
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws, class... Values>
[[nodiscard]] status remesh(Backend& backend, const Draws& draws, const grid& g, surface<Backend, Values...>& out,
                            const remesh_options& options = {}) {
    return remesh(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g, out, options);
}

} // namespace voxelpipe
