// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Calls of voxelize that list the primitives of each voxel.
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe {
VOXELPIPE_LIST_CALLS(template)
} // namespace voxelpipe
