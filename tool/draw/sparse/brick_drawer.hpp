// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A model that is drawn into bricks on some backend, with its request and its counts where they lie:
// sparse_pipeline.hpp without its template.

#include "model/sparse_volume.hpp"

#include <voxelpipe/grid.hpp>

namespace voxelize {

class brick_drawer {
public:
    brick_drawer() = default;
    brick_drawer(const brick_drawer&) = delete;
    brick_drawer& operator=(const brick_drawer&) = delete;
    virtual ~brick_drawer() = default;

    // All of these draw the request's part of `whole`, whose shape the volumes have. They throw as run_voxelizer does.

    // All that is asked for. Layers of padding hold nothing.
    [[nodiscard]] virtual sparse_volume run(const voxelpipe::grid& whole) = 0;
    // The surface alone, where a solid is asked for.
    [[nodiscard]] virtual sparse_volume surface(const voxelpipe::grid& whole) = 0;
    // The voxels that the surface occupies, without channels.
    [[nodiscard]] virtual sparse_volume occupied(const voxelpipe::grid& whole) = 0;
    // The voxels that triangles touch, whatever masks cut off, without channels.
    [[nodiscard]] virtual sparse_volume walls(const voxelpipe::grid& whole) = 0;
};

} // namespace voxelize
