// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "streamed_vote.hpp"

#include "model/memory.hpp"
#include "model/placement.hpp"

namespace voxelize {

namespace slabs = voxelpipe::slabs;

streamed_vote::streamed_vote(const triangle_stream& model, const voxelize_request& request,
                             std::span<const slabs::layer_range> drawn)
    : first_layer_(request.grid.offset.z + request.padding) {
    if (!request.solid || !request.solid->vote) return;
    voxelpipe::grid inner = request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding);
    const glm::dvec3 reference = reference_point(request.grid);
    inner.origin -= reference;
    snap_ = vp::core::make_snap_transform(inner);
    for (const triangle_stream::part& p : model.parts()) places_.emplace_back(p.to_world, reference);
    for (const slabs::layer_range& s : drawn)
        if (s.size() > 0) slabs_.push_back({s.begin - request.padding, s.end - request.padding});
    memory::require(slabs::column_parities::bytes(inner, slabs_.size()), "the columns of --vote");
    columns_.emplace(inner, slabs_);
}

void streamed_vote::add(const triangle_stream::block& block) {
    if (!columns_) return;
    const placed_vertex_shader& place = places_[block.part];
    const auto at = [&](std::size_t i) {
        const glm::vec3 p = place(block.corners[i]);
        return vp::core::snap(snap_, p.x, p.y, p.z);
    };
    for (std::size_t i = 0; i < block.corners.size(); i += 3) columns_->add(at(i), at(i + 1), at(i + 2));
}

void streamed_vote::give_to(voxelize_request& part) {
    if (!columns_) return;
    while (slabs_[next_].begin != part.grid.offset.z - first_layer_) ++next_; // those before were passed over
    decided_ = columns_->of(next_);
    part.solid->slab = &decided_;
}

} // namespace voxelize
