// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Rasters that set the bits of touched voxels.
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe::device {
VOXELPIPE_MASK_RASTERS(template)
} // namespace voxelpipe::device
