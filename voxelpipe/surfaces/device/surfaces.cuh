// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// extract and remesh on a GPU: cells, vertices and faces by words of 32 cells (word_cells.cuh); their other passes are
// those of every backend (surfaces/passes), for which cuda_backend has loops, CUB's sums and sorts. What they call
// besides is included here: solids for the sign, distances for a level, and nearest triangles for values.

#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/distance/device/distance_at.cuh>
#include <voxelpipe/solid/device/solid.cuh>
#include <voxelpipe/surfaces/device/mesh_crossings.cuh>
#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/remesh.hpp>
