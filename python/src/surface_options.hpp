// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the modules for CPU and GPU: options of surfaces from what voxelpipe/_remesh.py gives, and their counters.

#include "report.hpp"

#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace voxelpipe::python {

// "corner", "mean" or "sharp".
[[nodiscard]] inline place place_named(const std::string& name) {
    return name == "corner" ? place::corner : name == "mean" ? place::mean : place::sharp;
}

// Throws ValueError for the name of a rule, repair or body that there is not.
[[nodiscard]] inline remesh_options
remesh_options_named(const std::string& sign, const std::string& repair_name, const std::string& bodies_name,
                     std::optional<std::uint64_t> max_hole_edges, int closing, const std::string& place_name,
                     double level, bool corners, bool open, bool quads, std::uint32_t min_component, bool embedded) {
    const solid_options solid = solid_options_named(sign, "outer", repair_name, bodies_name, max_hole_edges, closing);
    remesh_options options;
    options.place = place_named(place_name);
    options.rule = solid.rule;
    options.bodies = solid.bodies;
    options.repair = solid.repair;
    options.closing = solid.closing;
    options.max_hole_edges = solid.max_hole_edges;
    options.level = level;
    options.sample = corners ? sample::corner : sample::centre;
    options.border = open ? border::open : border::closed;
    options.quads = quads;
    options.min_component = min_component;
    options.embedded = embedded;
    return options;
}

[[nodiscard]] inline extract_options extract_options_named(const std::string& place_name, double level, bool open,
                                                           bool quads, std::uint32_t min_component, bool embedded) {
    return {place_named(place_name), level, open ? border::open : border::closed, quads, min_component, embedded};
}

// report_solid(), and the counters of surfaces.
[[nodiscard]] inline nb::dict report_surface(const status& s) {
    nb::dict d = report_solid(s);
    d["components"] = s.surface.components;
    d["components_left_out"] = s.surface.components_left_out;
    d["cone_crossings"] = s.surface.cone_crossings;
    d["made_crossings"] = s.surface.made_crossings;
    d["nan_samples"] = s.surface.nan_samples;
    d["nearest_values"] = s.surface.nearest_values;
    d["embed_rounds"] = s.surface.embed_rounds;
    d["moved_vertices"] = s.surface.moved_vertices;
    d["intersecting_pairs"] = s.surface.intersecting_pairs;
    return d;
}

} // namespace voxelpipe::python
