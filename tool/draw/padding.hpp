// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A ring of empty voxels around a volume.

#include "model/volume.hpp"

namespace voxelize {

// INNER with PADDING more voxels on every side, which hold each channel's empty value (targets.hpp; 0 for a channel
// that is no target). One channel at a time is held twice. PADDING 0 gives INNER itself.
[[nodiscard]] volume padded(volume inner, int padding);

} // namespace voxelize
