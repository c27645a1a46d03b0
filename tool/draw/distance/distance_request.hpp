// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What --distance asks for.

#include "draw/solid.hpp"

#include <optional>

namespace voxelize {

struct distance_request {
    double band = 3.0;         // of the largest voxel size; above 0
    bool is_whole = false;     // every sample holds its distance, and `band` says nothing
    bool at_corners = false;   // samples lie at the corners of voxels: the request's grid is that of the samples
    std::optional<double> iso; // of the level that pictures show, world units; none: 0
    bool is_signed = true;     // negative inside, by `sign`
    solid_request sign;        // the rule and the repair; its extent says nothing
    // All outputs take the field piece by piece, from slabs of a multiple of this many layers; 0: one needs it whole.
    int slab_layers = 0;
};

} // namespace voxelize
