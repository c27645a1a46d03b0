// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The options of --solid, as the library takes them.

#include "solid.hpp"
#include "surface.hpp"

#include <voxelpipe/voxelpipe.hpp>

namespace voxelize {

[[nodiscard]] inline vp::solid_options solid_options_of(const solid_request& request) {
    vp::solid_options options;
    switch (request.rule) {
    case solid_rule::nonzero:
        options.rule = vp::fill_rule::nonzero;
        break;
    case solid_rule::even_odd:
        options.rule = vp::fill_rule::even_odd;
        break;
    case solid_rule::positive:
        options.rule = vp::fill_rule::positive;
        break;
    case solid_rule::each_draw:
        options = vp::each_draw;
        break;
    case solid_rule::exterior:
        options.repair = vp::repair::exterior;
        options.closing = request.closing;
        break;
    }
    if (request.vote) options.repair = vp::repair::vote;
    if (request.close_holes != 0) {
        options.repair = request.winding ? vp::repair::winding : vp::repair::close_holes;
        options.max_hole_edges = request.close_holes;
        options.cones = request.cones;
    }
    options.slab = request.slab;
    if (options.repair == vp::repair::exterior || options.repair == vp::repair::vote) {
        options.rule = vp::solid_options{}.rule; // their inside is their own
        return options;
    }
    switch (request.extent) {
    case solid_extent::centre:
        options.extent = vp::solid_extent::centre;
        break;
    case solid_extent::outer:
        options.extent = vp::solid_extent::outer;
        break;
    case solid_extent::inner:
        options.extent = vp::solid_extent::inner;
        break;
    }
    return options;
}

} // namespace voxelize
