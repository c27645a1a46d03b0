// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids in bricks: what fill_inside does for dense volumes.

#include "draw/body_fill.hpp"
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
// values, and INSIDE for voxels that no triangle touches. Takes the channel from the surface. A tile has one value.
void add_filled(sparse_volume& solid, sparse_volume& surface, std::string_view name, const fill_values& inside);

// What INSIDE of a channel is. BODIES may be null.
[[nodiscard]] fill_values fill_of(const sparse_volume& surface, target id, const solid_request& request,
                                  const body_map* bodies);

} // namespace voxelize
