// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Rasters that list fragments.
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe::device {
VOXELPIPE_LIST_RASTERS(template)
} // namespace voxelpipe::device
