// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "whole_colors.hpp"

#include "../memory.hpp"
#include "sparse_outside.hpp"
#include "sparse_solid.hpp"

#include <cstddef>

namespace voxelize {

whole_colors::whole_colors(const voxelize_request& request)
    : sees_(request.wants(target::color_outer)),
      fills_(request.solid && !request.solid->fill_color && request.wants_colors()) {
    if (!sees_) return;
    seen_.low = glm::ivec3(request.padding);
    seen_.extent = request.grid.extent - 2 * request.padding;
    const std::size_t columns = static_cast<std::size_t>(seen_.extent.x) * static_cast<std::size_t>(seen_.extent.y);
    memory::require(static_cast<double>(columns * sizeof(column_ends)), "the columns of --target color-outer");
    seen_.along[2].resize(columns);
}

void whole_colors::add(int pass, sparse_drawer& model, voxelize_request slab) {
    if (sees_ && pass == 0) {
        add_columns(model.occupied(slab), seen_);
        return;
    }
    give_to(slab);
    const sparse_volume surface = model.surface(slab);
    for (const channel& c : surface.channels)
        if (const target id = *target_named(c.name); is_color(id))
            add_colors(sums_[static_cast<std::size_t>(id)], mean_, c);
}

void whole_colors::give_to(voxelize_request& slab) {
    if (sees_) slab.columns = seen_.along[2].data();
    if (!fills_) return;
    for (std::size_t i = 0; i < means_.size(); ++i) means_[i] = mean_.mean_of(sums_[i]);
    slab.solid->means = &means_;
}

} // namespace voxelize
