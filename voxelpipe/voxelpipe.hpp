// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The whole library: mesh -> vertex shader -> triangle setup -> coarse raster -> tile sort -> tile split -> fine raster
// -> blend -> framebuffer / A-buffer. Any C++20 compiler gets everything except the GPU, nvcc gets cuda_backend too.
// The CPU backend is <cpu_ref/backend.hpp>.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/blend.hpp>
#include <voxelpipe/config.hpp>
#include <voxelpipe/element_call.hpp>
#include <voxelpipe/elements.hpp>
#include <voxelpipe/field.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/mesh.hpp>
#include <voxelpipe/program.hpp>
#include <voxelpipe/program_call.hpp>
#include <voxelpipe/program_options.hpp>
#include <voxelpipe/shader.hpp>
#include <voxelpipe/solid.hpp>
#include <voxelpipe/sparse.hpp>
#include <voxelpipe/stage_times.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/voxelize.hpp>

#if defined(__CUDACC__)
#include <voxelpipe/device/abuffer_async.cuh>
#include <voxelpipe/device/backend.cuh>
#include <voxelpipe/device/optional/element_async.cuh>
#include <voxelpipe/device/optional/elements.cuh>
#include <voxelpipe/device/optional/patches.cuh>
#include <voxelpipe/device/optional/program_async.cuh>
#include <voxelpipe/device/optional/solid.cuh>
#include <voxelpipe/device/optional/solid_async.cuh>
#include <voxelpipe/device/optional/sparse.cuh>
#include <voxelpipe/device/optional/sparse_async.cuh>
#include <voxelpipe/device/optional/sparse_merge_async.cuh>
#include <voxelpipe/device/optional/sparse_solid.cuh>
#include <voxelpipe/device/optional/sparse_solid_async.cuh>
#include <voxelpipe/device/voxelize_async.cuh>
#endif
