// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Calls of voxelize and voxelize_async that add a constant up.
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe {
VOXELPIPE_SUM_CALLS(template)
VOXELPIPE_SUM_ASYNC_CALLS(template)
} // namespace voxelpipe
