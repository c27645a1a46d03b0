// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Calls of voxelize and voxelize_async that set bits to a constant.
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe {
VOXELPIPE_BIT_CALLS(template)
VOXELPIPE_BIT_ASYNC_CALLS(template)
} // namespace voxelpipe
