// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What --remesh asks for.

#include "draw/solid.hpp"

#include <voxelpipe/surfaces/surface.hpp>

namespace voxelize {

struct remesh_request {
    voxelpipe::place place = voxelpipe::place::sharp; // where vertices lie
    double level = 0;                                 // of the distance, world units; 0: the surface itself
    bool quads = false;                               // in place of triangles
    bool embedded = false;                            // triangles that intersect each other are undone
    bool reports = false;                             // components, Euler characteristic and made crossings are printed
    solid_request sign;                               // the rule and the repair; its extent says nothing
};

} // namespace voxelize
