// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Checks random voxels of a bit grid with the oracle (tests/oracle), which decides coverage independently and shares
// nothing with voxelpipe/. Set voxels must be covered by a triangle of the mesh, empty neighbours of set voxels by
// none.

#include "mesh_data.hpp"

#include <voxelpipe/core/triangle_setup.hpp>
#include <voxelpipe/grid.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace scenes {

struct sample_result {
    int set = 0, empty = 0;            // voxels that were checked
    std::vector<std::string> mistakes; // one line each, at most 20
};

// `words`: the bits of a linear target, x fastest, rows padded to 32. Picks about `count` set and `count` empty voxels.
sample_result check_with_oracle(const bench::mesh_data& mesh, const voxelpipe::grid& grid, voxelpipe::coverage rule,
                                const std::vector<std::uint32_t>& words, int count, std::uint64_t seed);

} // namespace scenes
