// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Clears, checks of indices, vertices as they are, and what passes between host and device.
#include <voxelpipe/device/base/launch_kernels.cuh>
#include <voxelpipe/device/call/readback_kernels.cuh>
#include <voxelpipe/device/scene/check_indices_kernels.cuh>
#include <voxelpipe/device/scene/subset_kernels.cuh>
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe::device {
VOXELPIPE_VERTEX_SHADES(template)
VOXELPIPE_CLEARS(template)
} // namespace voxelpipe::device
