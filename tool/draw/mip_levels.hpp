// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Smaller versions of a picture, for voxels that are larger than its texels. Made on the host in integers, once, for
// every backend: the same bytes everywhere.

#include "model/scene.hpp"

#include <glm/gtc/type_precision.hpp>

#include <vector>

namespace voxelize {

// Levels of a picture of that size: each has half the side of the one before, rounded down but at least 1, and the last
// is 1 x 1.
[[nodiscard]] int mip_level_count(std::uint32_t width, std::uint32_t height);

// The levels of a picture from `first` on, one after the other, each by rows from the top; level 0 is the picture. A
// texel is the mean of the area of level 0 that it covers, in linear light, rounded to sRGB bytes. With `by_alpha`
// colours count by their alpha, as they do where a material shows it; where no texel has any, alike. At most 2^14
// texels a side; `first` is less than mip_level_count.
[[nodiscard]] std::vector<glm::u8vec4> with_mip_levels(const picture& source, bool by_alpha, int threads,
                                                       int first = 0);

} // namespace voxelize
