// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Crossings, covers and repairs of solids.
#include <voxelpipe/voxelpipe.hpp>

namespace voxelpipe::device {
VOXELPIPE_SOLIDS(template)
} // namespace voxelpipe::device
