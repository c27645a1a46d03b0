// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Which voxels a triangle covers.

#include <cstdint>

namespace voxelpipe {

// Which voxels a triangle covers. thin: one voxel per touched column of the dominant axis, 6-separating.
// conservative: every voxel whose closed box meets the closed triangle, 26-separating. crosshair: every voxel of which
// the triangle meets an arm, a segment through the centre from face to face along an axis, that is not parallel to it;
// 6-separating. diagonal: the same with four arms, from corner to corner; 26-separating (core/arms.hpp). Points and
// lines have no arms to meet: both are conservative coverage there.
enum class coverage : std::uint8_t { thin, conservative, crosshair, diagonal };

} // namespace voxelpipe
