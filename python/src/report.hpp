// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the modules for CPU and GPU: names of options, and a failed status as a Python exception.

#include <bindings/parts.hpp>
#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <nanobind/nanobind.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelpipe::python {

namespace nb = nanobind;
using namespace bindings; // what all bindings share

// "conservative", "thin", "crosshair" or "diagonal". Throws ValueError.
[[nodiscard]] inline coverage coverage_named(std::string_view name) {
    if (name == "conservative") return coverage::conservative;
    if (name == "thin") return coverage::thin;
    if (name == "crosshair") return coverage::crosshair;
    if (name == "diagonal") return coverage::diagonal;
    throw nb::value_error(
        ("coverage is 'conservative', 'thin', 'crosshair' or 'diagonal', not '" + std::string(name) + "'").c_str());
}

// The counters of a call as a dict; raises what a failed call means in Python: IndexError with the triangle of an index
// out of range, MemoryError, ValueError; RuntimeError for what a device says.
[[nodiscard]] inline nb::dict report(const status& s) {
    if (!s.ok()) {
        if (s.code == status_code::index_out_of_range) throw nb::index_error(s.message().c_str());
        if (s.code == status_code::out_of_memory) throw std::bad_alloc();
        if (s.code == status_code::no_device || s.code == status_code::device_error)
            throw std::runtime_error(s.message());
        throw nb::value_error(s.message().c_str());
    }
    nb::dict d;
    d["triangles"] = s.counts.triangles_in;
    d["triangles_dropped"] = s.counts.triangles_dropped();
    d["triangles_zero_area"] = s.counts.triangles_zero_area;
    d["triangles_outside"] = s.counts.triangles_outside;
    d["triangles_drawn"] = s.counts.triangles_drawn;
    d["fragments"] = s.counts.fragments;
    d["voxels"] = s.counts.voxels;
    return d;
}

// The value that stands beside the name. Throws ValueError that lists the names.
template <class T>
[[nodiscard]] T named(std::string_view what, std::string_view name,
                      std::initializer_list<std::pair<std::string_view, T>> choices) {
    std::string text;
    for (const auto& [choice, value] : choices) {
        if (choice == name) return value;
        text += (text.empty() ? "'" : ", '") + std::string(choice) + "'";
    }
    throw nb::value_error((std::string(what) + " is one of " + text + ", not '" + std::string(name) + "'").c_str());
}

// Throws ValueError unless an array has the shape that is wanted, which is a grid's. `what` names the argument.
inline void expect_shape(const std::vector<std::size_t>& found, const std::vector<std::size_t>& wanted,
                         const char* what) {
    if (found == wanted) return;
    const auto text = [](const std::vector<std::size_t>& shape) {
        std::string t;
        for (const std::size_t n : shape) t += (t.empty() ? "(" : ", ") + std::to_string(n);
        return t + ')';
    };
    throw nb::value_error(
        (std::string(what) + " has the shape " + text(found) + ", the grid's is " + text(wanted) + " (nz, ny, nx)")
            .c_str());
}

// The options of a solid from their names, as voxelpipe/_solid.py has them. Throws ValueError.
[[nodiscard]] inline solid_options solid_options_named(const std::string& fill, const std::string& extent,
                                                       const std::string& repair_name, const std::string& bodies_name,
                                                       std::optional<std::uint64_t> max_hole_edges, int closing) {
    solid_options options;
    options.rule = named<fill_rule>(
        "fill", fill,
        {{"nonzero", fill_rule::nonzero}, {"even_odd", fill_rule::even_odd}, {"positive", fill_rule::positive}});
    const auto extent_named = named<solid_extent>("extent", extent,
                                                  {{"outer", solid_extent::outer},
                                                   {"centre", solid_extent::centre},
                                                   {"center", solid_extent::centre},
                                                   {"inner", solid_extent::inner}});
    options.repair = named<repair>("repair", repair_name,
                                   {{"none", repair::none},
                                    {"close_holes", repair::close_holes},
                                    {"exterior", repair::exterior},
                                    {"vote", repair::vote},
                                    {"winding", repair::winding}});
    if (options.repair == repair::exterior || options.repair == repair::vote) {
        // They have an inside of their own, so the module's defaults are the library's.
        if (options.rule != fill_rule::nonzero)
            throw nb::value_error(("repair='" + repair_name + "' knows no fill rule: leave fill out").c_str());
        if (extent_named != solid_extent::outer)
            throw nb::value_error(
                ("repair='" + repair_name + "' always has the extent 'outer': leave extent out").c_str());
    } else {
        options.extent = extent_named;
    }
    if (options.repair == repair::winding && options.rule == fill_rule::even_odd)
        throw nb::value_error("repair='winding' takes a generalized winding number of 1/2 or more for inside, which is "
                              "neither even nor odd: take 'nonzero' or 'positive'");
    options.bodies = named<bodies>("bodies", bodies_name, {{"all", bodies::call}, {"each", bodies::draw}});
    if (max_hole_edges) options.max_hole_edges = *max_hole_edges;
    options.closing = closing;
    return options;
}

// Adds what closing holes has counted.
template <class Counters>
void report_holes(nb::dict& d, const Counters& counters) {
    d["hole_edges"] = counters.hole_edges;
    d["holes"] = counters.holes;
    d["cones"] = counters.cones;
}

// report(), and the counters of solids.
[[nodiscard]] inline nb::dict report_solid(const status& s) {
    nb::dict d = report(s);
    d["open_rows"] = s.solid.open_rows;
    d["crossings"] = s.solid.crossings;
    d["max_winding"] = s.solid.max_winding;
    report_holes(d, s.solid);
    return d;
}

// The options of a distance from their names, as voxelpipe/_distance.py has them; band: 0 is "whole". Throws
// ValueError.
[[nodiscard]] inline distance_options distance_options_named(double band, const std::string& sign,
                                                             const std::string& repair_name,
                                                             const std::string& bodies_name,
                                                             std::optional<std::uint64_t> max_hole_edges, int closing,
                                                             bool corners) {
    distance_options options;
    options.band = band == 0.0 ? voxelpipe::band::whole : voxelpipe::band(band);
    options.sample = corners ? sample::corner : sample::centre;
    if (sign == "unsigned") {
        if (repair_name != "none" || bodies_name != "all" || max_hole_edges || closing != 0)
            throw nb::value_error("sign='unsigned' has no sign that a repair, bodies or closing could decide: leave "
                                  "them out");
        options.sign = distance_sign::none;
        return options;
    }
    // The extent is that of the module's solids without one; distances have none.
    const solid_options solid = solid_options_named(sign, "outer", repair_name, bodies_name, max_hole_edges, closing);
    options.rule = solid.rule;
    options.bodies = solid.bodies;
    options.repair = solid.repair;
    options.closing = solid.closing;
    options.max_hole_edges = solid.max_hole_edges;
    return options;
}

// report_solid(), and the counters of distances.
[[nodiscard]] inline nb::dict report_distance(const status& s) {
    nb::dict d = report_solid(s);
    d["band_samples"] = s.distance.band_samples;
    d["bad_points"] = s.distance.bad_points;
    return d;
}

// report(), and the counters of cut cells.
[[nodiscard]] inline nb::dict report_cells(const status& s) {
    nb::dict d = report(s);
    d["cut_voxels"] = s.cells.cut_voxels;
    d["below_zero"] = s.cells.below_zero;
    d["above_one"] = s.cells.above_one;
    d["open_rows"] = s.cells.open_rows;
    d["open_edges"] = s.cells.open_edges;
    d["lost_centroids"] = s.cells.lost_centroids;
    report_holes(d, s.cells);
    return d;
}

// What diagnose_repair found.
[[nodiscard]] inline nb::dict report_flood(const status& s) {
    (void)report(s); // throws where the call failed
    nb::dict d;
    d["lost_voxels"] = s.solid.flood.lost_voxels;
    d["enclosed_voxels"] = s.solid.flood.enclosed_voxels;
    d["face_voxels"] = s.solid.flood.face_voxels;
    d["entered_holes"] = s.solid.flood.entered_holes;
    d["hole_width"] = s.solid.flood.hole_width;
    d["tried_closing"] = s.solid.flood.closing;
    d["tried_close_holes"] = s.solid.flood.close_holes;
    return d;
}

} // namespace voxelpipe::python
