// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --remesh: scene + options -> a closed manifold mesh around what lies inside, on the CPU.

#include "draw/voxelizer.hpp"
#include "model/scene.hpp"
#include "model/surface_mesh.hpp"

#include <filesystem>

namespace voxelize {

// What remeshing a model takes, about.
struct remesh_memory {
    double bytes = 0;      // beyond those that are held before it
    bool in_bricks = true; // samples lie in bricks, not in a grid: the same mesh
};
[[nodiscard]] remesh_memory remesh_need(const scene& model, const voxelize_request& request);

// request.remesh is set; request.grid is not cropped. Lines and points enclose nothing: a warning counts them. Nothing
// inside gives an empty mesh, which a warning says. What does not fit is made in slabs on the CPU, the same mesh, whose
// arrays then are temporary files in `folder`; not with an embedded mesh, --solid exterior and --vote, which look at
// the whole grid. Throws memory_error with need and limit before anything is drawn where that does not fit either,
// write_error for the files, backend_error for a GPU.
[[nodiscard]] surface_mesh run_remesher(scene&& model, const voxelize_request& request,
                                        const std::filesystem::path& folder, voxelize_stats& stats);

} // namespace voxelize
