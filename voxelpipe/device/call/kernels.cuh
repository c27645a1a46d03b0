// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Includes the kernels that depend on no type of the program, unless voxelpipe::cuda_kernels holds them
// (base/kernel_library.cuh).

#if !defined(VOXELPIPE_LINKS_CUDA_KERNELS)
#include <voxelpipe/device/base/launch_kernels.cuh>
#include <voxelpipe/device/call/readback_kernels.cuh>
#include <voxelpipe/device/fragments/counting_sort_kernels.cuh>
#include <voxelpipe/device/fragments/fragment_lists_kernels.cuh>
#include <voxelpipe/device/fragments/order_voxels_kernels.cuh>
#include <voxelpipe/device/fragments/radix_sort_kernels.cuh>
#include <voxelpipe/device/scene/check_indices_kernels.cuh>
#include <voxelpipe/device/scene/key_sort_kernels.cuh>
#include <voxelpipe/device/scene/prefix_sum_kernels.cuh>
#include <voxelpipe/device/scene/subset_kernels.cuh>
#include <voxelpipe/device/tiles/tile_passes_kernels.cuh>
#endif
