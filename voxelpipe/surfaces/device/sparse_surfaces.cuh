// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// extract and remesh_sparse of sparse framebuffers on a GPU: their passes are those of every backend, and what they
// call besides is included here: bricks, solids and distances in bricks.

#include <voxelpipe/distance/device/sparse_distance.cuh>
#include <voxelpipe/sparse/device/sparse_solid.cuh>
#include <voxelpipe/surfaces/device/surfaces.cuh>
#include <voxelpipe/surfaces/remesh_sparse.hpp>
