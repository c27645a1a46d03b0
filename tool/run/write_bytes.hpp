// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the writers of formats/ take beside the result that they write.

#include "model/targets.hpp"
#include "write/formats/formats.hpp"

#include <glm/vec3.hpp>

#include <filesystem>
#include <span>

namespace voxelize {

// A result that is not there yet.
struct expected_result {
    glm::ivec3 extent;
    std::span<const target> targets;
    bool is_sparse;
    double bricks, voxels; // occupied ones
    double in_tiles;       // voxels of a solid in tiles, which most writers open
    bool is_thin = false;  // drawn with a coverage by which voxels meet in edges and corners alone
};

// Bytes that writing it takes beside the result, about.
[[nodiscard]] double bytes_to_write(const std::filesystem::path& output, const expected_result& result,
                                    const write_options& options);

} // namespace voxelize
