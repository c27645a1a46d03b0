// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --vote for a model that is read block by block: the crossings of all triangles with the columns along z, for the
// slabs, which are drawn one by one (voxelpipe/slabs/columns.hpp).

#include "draw/surface.hpp"
#include "draw/voxelizer.hpp"
#include "read/triangle_stream.hpp"

#include <voxelpipe/slabs/columns.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace voxelize {

class streamed_vote {
public:
    // Nothing unless the request votes. drawn: the layers of the slabs that will be drawn, ascending; some may be
    // empty. Throws memory_error.
    streamed_vote(const triangle_stream& model, const voxelize_request& request,
                  std::span<const voxelpipe::slabs::layer_range> drawn);

    // All triangles, once each.
    void add(const triangle_stream::block& block);
    // For the request of a slab, which refers to this until the next one's; slabs come in order.
    void give_to(voxelize_request& part);

private:
    int first_layer_;                          // of the grid without the padding
    std::vector<placed_vertex_shader> places_; // by part
    vp::core::snap_transform snap_{};
    std::vector<voxelpipe::slabs::layer_range> slabs_; // from the first layer on, not empty
    std::size_t next_ = 0;
    std::optional<voxelpipe::slabs::column_parities> columns_;
    vp::solid_slab decided_;
};

} // namespace voxelize
