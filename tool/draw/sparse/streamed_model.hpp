// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A model whose triangles do not fit into the run's memory: they go from the file to the slabs that they reach, through
// temporary files, and one slab at a time is drawn into bricks by sparse_pipeline.hpp. The voxels and values are those
// of a run that holds the model.

#include "draw/pass_files.hpp"
#include "draw/voxelizer.hpp"
#include "model/sparse_volume.hpp"
#include "read/triangle_stream.hpp"

#include <voxelpipe/slabs/plan.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace voxelize {

// The surroundings in which a streamed model is drawn.
struct stream_place {
    std::filesystem::path folder;                // for temporary files
    std::function<void(const std::string&)> say; // is told once in how many slabs the model is drawn
};

// Slabs of the request's grid, as slab_passes has them; `drawn` ascends.
struct streamed_ranges {
    std::span<const voxelpipe::slabs::layer_range> all;
    std::span<const std::size_t> drawn;
    const pass_files* kept = nullptr;
};

// sink(i, bricks) gets the slabs drawn[i] one after the other. Counts are those of all of them. Throws as run_voxelizer
// does, model_error for a file that is damaged, and write_error for a folder that is full.
void draw_streamed(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                   const streamed_ranges& ranges, voxelize_stats& stats,
                   const std::function<void(std::size_t, sparse_volume&&)>& sink);

// The whole grid.
[[nodiscard]] sparse_volume run_streamed_voxelizer(triangle_stream& model, const stream_place& place,
                                                   const voxelize_request& request, voxelize_stats& stats);

// Adds the counts and times of a part, but not its warnings.
void add_part(voxelize_stats& all, const voxelize_stats& part);

// Adds what the sums of all parts give reason to warn of.
void warn_of_parts(voxelize_stats& stats, const voxelize_request& request);

} // namespace voxelize
