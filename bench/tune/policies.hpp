// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The policies of the fine raster that were compiled into the sweep: policy.cu is compiled once for each.

#include "cells.hpp"

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace bench::gpu {

// Render targets that are swept, by how much shared memory a voxel takes.
enum class tuned_target : std::uint8_t { bits, sums };
inline constexpr std::array<tuned_target, 2> tuned_targets{tuned_target::bits, tuned_target::sums};
[[nodiscard]] inline std::string name_of(tuned_target t) { return t == tuned_target::bits ? "bit" : "float add"; }

struct policy {
    int threads_per_block, log2_tile_size, min_blocks_per_sm;
    // Null where a tile of such voxels cannot fit the shared memory of any GPU so far.
    std::function<std::unique_ptr<prepared_cell>(session&, const resident_mesh&, const vp::grid&, vp::coverage,
                                                 tuned_target)>
        prepare;

    [[nodiscard]] std::string name() const {
        return std::to_string(threads_per_block) + " threads, tile " + std::to_string(1 << log2_tile_size) + "³, " +
               std::to_string(min_blocks_per_sm) + " blocks";
    }
};

// In no particular order.
std::vector<policy>& policies();
// For a static object a source file: adds its policy when the program starts.
struct add_policy {
    explicit add_policy(policy p) { policies().push_back(std::move(p)); }
};

} // namespace bench::gpu
