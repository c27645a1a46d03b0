// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// The sorts of fragments, and the order of those of a voxel.
#include <voxelpipe/device/fragments/counting_sort_kernels.cuh>
#include <voxelpipe/device/fragments/order_voxels_kernels.cuh>
#include <voxelpipe/device/fragments/radix_sort_kernels.cuh>
#include <voxelpipe/voxelpipe.hpp>
