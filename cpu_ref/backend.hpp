// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// cpu_backend with all modules: what a program includes to voxelize on CPU threads.

#include <cpu_ref/cells/sparse_cells.hpp>
#include <cpu_ref/cells/voxelize_cells.hpp>
#include <cpu_ref/cpu_backend.hpp>
#include <cpu_ref/distance/distance_at.hpp>
#include <cpu_ref/distance/sparse_distance.hpp>
#include <cpu_ref/distance/voxelize_distance.hpp>
#include <cpu_ref/label/label.hpp>
#include <cpu_ref/solid/voxelize_solid.hpp>
#include <cpu_ref/sparse/voxelize_sparse.hpp>
#include <voxelpipe/voxelpipe.hpp>
