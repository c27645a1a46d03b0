// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A loaded model that is drawn slab by slab into bricks. The model is held once, and what the slabs need of each other
// is found before the first of them, by slab_passes.hpp.

#include "draw/voxelizer.hpp"
#include "model/scene.hpp"
#include "model/sparse_volume.hpp"
#include "slab_passes.hpp"
#include "sparse_voxelizer.hpp"

#include <voxelpipe/slabs/plan.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

namespace voxelize {

class loaded_slabs {
public:
    // all, drawn, folder, kept: as slab_passes has them. Adds the times of the passes. Throws as they do.
    loaded_slabs(scene&& model, const voxelize_request& request, std::span<const voxelpipe::slabs::layer_range> all,
                 std::span<const std::size_t> drawn, const std::filesystem::path& folder, const pass_files* kept,
                 voxelize_stats& stats);

    // One of the slabs that are drawn, in their order. Adds its counts, and warnings about the model.
    [[nodiscard]] sparse_volume draw(const voxelpipe::slabs::layer_range& layers, voxelize_stats& stats);

private:
    // The part of the grid in some layers; none if that is padding alone.
    [[nodiscard]] std::optional<voxelpipe::grid> without_padding(const voxelpipe::slabs::layer_range& layers) const;
    // The request of a part, whose progress is the next of all steps.
    [[nodiscard]] voxelize_request next_step(const voxelpipe::grid& grid);

    voxelize_request request_;
    bool with_means_; // before the model is moved on
    sparse_drawer model_;
    slab_passes passes_;
    std::size_t done_ = 0, steps_;
    bool is_first_ = true;
};

} // namespace voxelize
