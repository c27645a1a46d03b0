// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Options as they are written, before it is understood what they mean together.

#include "run/command_line.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/surfaces/surface.hpp>

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace voxelize {

struct raw_options {
    std::string resolution, origin, voxel_size, extent, image_size, background, fill;
    std::optional<solid_rule> solid;
    std::optional<solid_extent> extent_of_solid;
    std::optional<voxelpipe::coverage> coverage;
    std::string close_holes; // "all", or how many edges
    std::optional<int> closing;
    bool vote = false;
    bool winding = false;
    bool distance = false;
    std::string band; // a number or "whole"
    bool is_unsigned = false;
    bool corners = false;
    bool half = false;
    std::optional<double> iso;
    bool remesh = false;
    std::optional<voxelpipe::place> place;
    bool quads = false;
    bool embedded = false;
    bool report = false;
    std::optional<double> threshold;
    std::optional<int> neighbours;
    std::optional<patient_axes> space;
    std::vector<std::string> targets;
    bool no_edges = false;
    bool no_ground = false;
    bool no_color = false;
};

// Adds every option to APP: those that mean something alone fill OPTIONS, the others RAW. Both must outlive the
// parsing.
void describe(CLI::App& app, command_line& options, raw_options& raw);

// Sets the options of lists and of ranks. HAS_WORLD: --world-size was given; otherwise mpiexec or srun may say it.
// HAS_RANK: --rank was given.
void understand_batch(command_line& options, bool has_world, bool has_rank);
// Fills OPTIONS from RAW, in this order. They throw usage_error.
void understand_solid(command_line& options, const raw_options& raw);
void understand_distance(command_line& options, const raw_options& raw);
void understand_remesh(command_line& options, const raw_options& raw);
void understand_grid(command_line& options, const raw_options& raw);
void understand_outputs(command_line& options, const raw_options& raw);
void understand_fractions(command_line& options, const raw_options& raw);
void understand_picture(command_line& options, const raw_options& raw);

} // namespace voxelize
