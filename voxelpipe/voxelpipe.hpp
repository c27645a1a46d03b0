// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The whole library: mesh -> vertex shader -> triangle setup -> coarse raster -> tile sort -> tile split -> fine raster
// -> blend -> framebuffer / A-buffer. Any C++20 compiler gets everything except the GPU, nvcc gets cuda_backend too.
// The CPU backend is <cpu_ref/backend.hpp>.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/blend.hpp>
#include <voxelpipe/cells/cell_programs.hpp>
#include <voxelpipe/cells/cells.hpp>
#include <voxelpipe/cells/links.hpp>
#include <voxelpipe/cells/sparse_cells.hpp>
#include <voxelpipe/config.hpp>
#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/distance/distance_ray.hpp>
#include <voxelpipe/distance/sparse_distance.hpp>
#include <voxelpipe/formats/formats.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/label/label.hpp>
#include <voxelpipe/mesh.hpp>
#include <voxelpipe/programs/distance_programs.hpp>
#include <voxelpipe/programs/element_call.hpp>
#include <voxelpipe/programs/elements.hpp>
#include <voxelpipe/programs/field.hpp>
#include <voxelpipe/programs/program.hpp>
#include <voxelpipe/programs/program_call.hpp>
#include <voxelpipe/programs/program_options.hpp>
#include <voxelpipe/shader.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/sparse/sparse.hpp>
#include <voxelpipe/stage_times.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/remesh.hpp>
#include <voxelpipe/voxelize.hpp>

#if defined(__CUDACC__)
#include <voxelpipe/device/abuffer_async.cuh>
#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/surface_calls.cuh>
#include <voxelpipe/device/voxelize_async.cuh>
#include <voxelpipe/programs/device/element_async.cuh>
#include <voxelpipe/programs/device/elements.cuh>
#include <voxelpipe/programs/device/patches.cuh>
#include <voxelpipe/programs/device/program_async.cuh>
#include <voxelpipe/solid/device/solid.cuh>
#include <voxelpipe/solid/device/solid_async.cuh>
#include <voxelpipe/sparse/device/sparse.cuh>
#include <voxelpipe/sparse/device/sparse_async.cuh>
#include <voxelpipe/sparse/device/sparse_merge_async.cuh>
#include <voxelpipe/sparse/device/sparse_solid.cuh>
#include <voxelpipe/sparse/device/sparse_solid_async.cuh>
#endif
