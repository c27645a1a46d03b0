// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace voxelize::assimp {

// Colours of the formats that assimp reads are what a screen shows; ours are linear light. Below 0 and NaN: 0; from 1
// on: 1.
[[nodiscard]] inline float linear_of(float encoded) {
    if (!(encoded > 0)) return 0;
    if (encoded >= 1) return 1;
    return encoded <= 0.04045F ? encoded / 12.92F
                               : static_cast<float>(std::pow((static_cast<double>(encoded) + 0.055) / 1.055, 2.4));
}

} // namespace voxelize::assimp
