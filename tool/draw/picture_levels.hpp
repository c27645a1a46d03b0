// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Pictures at the resolution that the voxels need. A triangle samples the mip levels from the one on that its footprint
// in texels gives, so levels before the least of all its triangles are not kept. The result has the same bytes as with
// all levels.

#include "model/placement.hpp"
#include "model/scene.hpp"
#include "read/triangle_stream.hpp"
#include "voxelizer.hpp"

#include <voxelpipe/grid.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace voxelize {

// The first level of a picture of WIDTH x HEIGHT texels that any triangle of MATERIALS samples. Counts every triangle
// of the model, whether or not it lies in the grid.
[[nodiscard]] int first_sampled_level(const scene& model, std::uint32_t width, std::uint32_t height,
                                      const std::vector<std::uint32_t>& materials, const voxelpipe::grid& grid,
                                      int threads);

// Reads the textures of a stream, reduced in the same way; a picture's triangles are read for that. What is kept lasts
// as long as the stream. Throws as triangle_stream::read_textures() does.
void read_textures(triangle_stream& model, const voxelpipe::grid& grid, const voxelize_request& request);

// load_hooks::picture of the tool: replaces the texels of each picture by the levels that its materials sample. The
// texels stay if the request has no target of colour, or names no grid.
class picture_reducer {
public:
    picture_reducer(const grid_request& grid, const voxelize_request& request) : wanted_{grid}, request_{request} {}

    void operator()(const scene& model, picture& decoded, const std::vector<std::uint32_t>& materials);

private:
    [[nodiscard]] const std::optional<voxelpipe::grid>& grid_of(const scene& model);

    grid_request wanted_;
    voxelize_request request_;
    bool placed_ = false;
    std::optional<voxelpipe::grid> grid_;
};

} // namespace voxelize
