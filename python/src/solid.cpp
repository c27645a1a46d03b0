// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <voxelpipe/solid.hpp>

#include <optional>

#include <nanobind/stl/optional.h>

namespace voxelpipe::python {
namespace {

using mask = target<std::uint8_t, blend::replace>;

// The value that stands beside the name. Throws ValueError that lists the names.
template <class T>
T named(std::string_view what, std::string_view name, std::initializer_list<std::pair<std::string_view, T>> choices) {
    std::string text;
    for (const auto& [choice, value] : choices) {
        if (choice == name) return value;
        text += (text.empty() ? "'" : ", '") + std::string(choice) + "'";
    }
    throw nb::value_error((std::string(what) + " is one of " + text + ", not '" + std::string(name) + "'").c_str());
}

// One draw for each part of the triangles: part i ends where part i + 1 begins.
nb::dict solid_mask(const position_array& positions, const triangle_array& triangles,
                    const std::vector<std::uint64_t>& first_triangles, const grid& g, const std::string& fill,
                    const std::string& extent, const std::string& repair_name, const std::string& bodies_name,
                    std::optional<std::uint64_t> max_hole_edges, int closing, const array<std::uint8_t, 3>& out,
                    unsigned threads) {
    expect_shape(out, g);
    solid_options options;
    options.rule = named<fill_rule>(
        "fill", fill,
        {{"nonzero", fill_rule::nonzero}, {"even_odd", fill_rule::even_odd}, {"positive", fill_rule::positive}});
    options.extent = named<solid_extent>(
        "extent", extent,
        {{"outer", solid_extent::outer}, {"centre", solid_extent::centre}, {"inner", solid_extent::inner}});
    options.repair = named<repair>("repair", repair_name,
                                   {{"none", repair::none},
                                    {"close_holes", repair::close_holes},
                                    {"exterior", repair::exterior},
                                    {"vote", repair::vote}});
    options.bodies = named<bodies>("bodies", bodies_name, {{"all", bodies::call}, {"each", bodies::draw}});
    if (max_hole_edges) options.max_hole_edges = *max_hole_edges;
    options.closing = closing;

    using shader = decltype(constant(std::uint8_t{1}));
    const mesh_view<> all = view_of(positions, triangles);
    std::vector<draw<mesh_view<>, passthrough, shader>> draws;
    for (std::size_t i = 0; i < first_triangles.size(); ++i) {
        const std::uint64_t first = first_triangles[i],
                            end = i + 1 < first_triangles.size() ? first_triangles[i + 1] : all.triangles.size();
        if (first > end || end > all.triangles.size()) throw nb::value_error("the parts' triangles are out of order");
        draws.push_back({{all.positions, array_view<const glm::uvec3>(all.triangles.data() + first, end - first)},
                         {},
                         constant(std::uint8_t{1})});
    }
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        s = voxelize_solid(backend, draws, g, framebuffer_view<mask>::on(g.extent, out.data()), options);
    }
    nb::dict d = report(s);
    d["open_rows"] = s.solid.open_rows;
    d["crossings"] = s.solid.crossings;
    d["max_winding"] = s.solid.max_winding;
    d["hole_edges"] = s.solid.hole_edges;
    d["holes"] = s.solid.holes;
    d["cones"] = s.solid.cones;
    return d;
}

} // namespace

void bind_solid(nb::module_& m) {
    m.def("solid_mask", &solid_mask, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("fill"), nb::arg("extent"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("closing"), nb::arg("out"), nb::arg("threads"));
}

} // namespace voxelpipe::python
