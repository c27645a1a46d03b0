// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --remesh: scene + options -> a closed manifold mesh around what lies inside, on the CPU.

#include "draw/voxelizer.hpp"
#include "model/scene.hpp"
#include "model/surface_mesh.hpp"

namespace voxelize {

// Bytes that remeshing this model comes to, beyond those that are held before it, about.
[[nodiscard]] double remesh_need(const scene& model, const voxelize_request& request);

// request.remesh is set; request.grid is not cropped. Lines and points enclose nothing: a warning counts them. Nothing
// inside gives an empty mesh, which a warning says. Throws memory_error with need and limit before anything is drawn,
// backend_error for a GPU.
[[nodiscard]] surface_mesh run_remesher(scene&& model, const voxelize_request& request, voxelize_stats& stats);

} // namespace voxelize
