// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// From which of the grid's six sides each voxel is seen: what --target color-outer goes by.

#include "volume.hpp"

#include <cstdint>
#include <vector>

namespace voxelize {

inline constexpr std::uint8_t all_sides = 63;

// For every voxel, in storage order, a bit for each side that sees it: bit 2 a for the low and bit 2 a + 1 for the high
// side of axis a. A side sees an occupied voxel if no occupied voxel lies between the two along the axis. 0 for voxels
// that no side sees and for empty ones. `bits` is a bit channel of `v`.
[[nodiscard]] std::vector<std::uint8_t> sides_that_see(const volume& v, const channel& bits, int threads);

} // namespace voxelize
