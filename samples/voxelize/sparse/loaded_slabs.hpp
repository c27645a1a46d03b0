// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A loaded model that is drawn slab by slab into bricks. The model is held once, and what the slabs need of each other
// is found before the first of them: the flood of --solid exterior and the colours of whole_colors.hpp.

#include "../scene.hpp"
#include "../voxelizer.hpp"
#include "sparse_volume.hpp"
#include "sparse_voxelizer.hpp"
#include "whole_colors.hpp"

#include <voxelpipe/slabs/exterior.hpp>
#include <voxelpipe/slabs/plan.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

namespace voxelize {

class loaded_slabs {
public:
    // all: layers that ascend and make up the request's grid. num_drawn: how many draw() will be called for, for the
    // progress. folder: for temporary files. Throws memory_error, std::bad_alloc, and std::system_error of files.
    loaded_slabs(scene&& model, const voxelize_request& request, std::span<const voxelpipe::slabs::layer_range> all,
                 std::size_t num_drawn, const std::filesystem::path& folder);

    // Some layers of the grid; cheapest in ascending order. Adds their counts, and warnings
    // about the model.
    [[nodiscard]] sparse_volume draw(const voxelpipe::slabs::layer_range& layers, voxelize_stats& stats);

private:
    // The part of the grid in some layers; none if that is padding alone.
    [[nodiscard]] std::optional<voxelpipe::grid> without_padding(const voxelpipe::slabs::layer_range& layers) const;
    // The request of a part, whose progress is the next of all steps.
    [[nodiscard]] voxelize_request next_step(const voxelpipe::grid& grid);

    voxelize_request request_;
    whole_colors colors_;
    sparse_drawer model_;
    std::optional<voxelpipe::slabs::slab_exterior> exterior_;
    std::size_t done_ = 0, steps_;
    bool is_first_ = true;
};

} // namespace voxelize
