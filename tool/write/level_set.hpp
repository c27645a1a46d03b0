// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A distance field as the bricks of its band, which is what .nvdb and .vdb hold; its levels, and its half floats.

#include "formats/formats.hpp"
#include "model/sparse_volume.hpp"
#include "model/volume.hpp"

#include <voxelpipe/core/brick_table.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace voxelize {

// Samples of the band, those nearer than its width (all of a whole field), are voxels of the bricks. The others read as
// plus the background, and those inside as minus the background.
struct band_bricks {
    sparse_volume band;                           // with all channels; its bricks may be empty, and it has no tiles
    std::vector<voxelpipe::brick_mask> inside;    // for each brick: samples inside that are not in the band
    std::vector<voxelpipe::brick_tile> in_inside; // bricks of such samples alone, as the largest cubes, ascending
    float background = 0;                         // the band's width; of a whole field its greatest distance
    // A narrow band of signed distances in cubic voxels: what OpenVDB calls a level set. Otherwise nothing is inside.
    bool is_level_set = false;
    bool is_cut = false; // of signed distances in a band: samples at the grid's sides are nearer than its width
};

// V has `distances` and their channel. Of a field that is read piece by piece (channel::read) eight layers are held at
// a time, and the band twice at the end. THREADS <= 0 takes one for each core.
[[nodiscard]] band_bricks find_band(const volume& v, int threads);

// True if a format that shows voxels shows those of a level of distances: all of these but .nvdb and .vdb.
[[nodiscard]] bool shows_level(const std::filesystem::path& output);
// Appends the channel "occupancy": the samples of V whose distance is at most `level`.
void add_level(volume& v, double level);

// write() of a volume with distances: in half floats where the options and the format have them, which takes no memory.
// Warns where distances are beyond those. V holds its floats again once it returns.
std::vector<std::filesystem::path> write_distances(volume& v, const std::filesystem::path& output,
                                                   const write_options& options);

// One line if the band of a level set is cut off by the grid, so that surfaces there are not closed; else empty.
[[nodiscard]] std::string cut_band_warning(const band_bricks& field);

} // namespace voxelize
