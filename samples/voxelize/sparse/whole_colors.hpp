// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Colours that follow from the whole grid, for slabs that are drawn one by one: what the sides of the grid see along z,
// for color-outer, and the mean colours that fill a solid. Each takes a pass over all slabs before the first is drawn;
// the means come last, since that of color-outer needs what is seen. Sums are of integers, so no order shows.

#include "../outside.hpp"
#include "../solid.hpp"
#include "../voxelizer.hpp"
#include "sparse_voxelizer.hpp"

#include <array>
#include <vector>

namespace voxelize {

class whole_colors {
public:
    // The request is that of the whole grid, with its padding. Throws memory_error.
    explicit whole_colors(const voxelize_request& request);

    // 0 if the request needs none.
    [[nodiscard]] int num_passes() const { return (sees_ ? 1 : 0) + (fills_ ? 1 : 0); }
    // Adds a slab to a pass; each slab once. Passes come one after the other.
    void add(int pass, sparse_drawer& model, voxelize_request slab);
    // Once all passes are done: for the request of a slab, which refers to this.
    void give_to(voxelize_request& slab);

private:
    bool sees_, fills_;
    column_table seen_; // along z alone
    color_mean mean_;
    std::array<color_mean::sums, target_table.size()> sums_{};
    fill_means means_{};
};

} // namespace voxelize
