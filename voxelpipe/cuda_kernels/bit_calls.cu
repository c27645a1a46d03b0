// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Calls of voxelize that set bits to a constant.
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe {
VOXELPIPE_BIT_CALLS(template)
} // namespace voxelpipe
