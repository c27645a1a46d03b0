// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids in bricks: what fill_inside does for dense volumes.

#include "draw/solid.hpp"
#include "model/sparse_volume.hpp"

#include <glm/vec3.hpp>

#include <string_view>

namespace voxelize {

// Drops the voxels outside of a box of the grid. V has no channels with data yet.
void keep_part(sparse_volume& v, const glm::ivec3& offset, const glm::ivec3& extent);

// Adds the colours of a channel.
void add_colors(color_mean::sums& to, const color_mean& mean, const channel& colors);

// Adds the surface's channel of that name to a solid, none of whose tiles has a brick of the surface: the surface's
// values, and for voxels that no triangle touches the colour of the fill, opaque, or the target's empty value. Takes
// the channel from the surface.
void add_filled(sparse_volume& solid, sparse_volume& surface, std::string_view name, const solid_request& request);

} // namespace voxelize
