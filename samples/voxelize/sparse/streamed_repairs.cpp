// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "streamed_repairs.hpp"

#include "../memory.hpp"
#include "../parallel.hpp"
#include "../placement.hpp"
#include "sparse_voxelizer.hpp"

#include <utility>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

streamed_repairs::streamed_repairs(const triangle_stream& model, const voxelize_request& request, double room,
                                   const std::filesystem::path& folder)
    : request_(request), floods_(request.solid && request.solid->rule == solid_rule::exterior),
      votes_(request.solid && request.solid->vote), room_(room),
      inner_(request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding)) {
    const glm::dvec3 reference = reference_point(request.grid);
    inner_.origin -= reference;
    snap_ = vp::core::make_snap_transform(inner_);
    for (const triangle_stream::part& p : model.parts()) places_.emplace_back(p.to_world, reference);
    if (!floods_) return;
    const glm::ivec3 extent = request.grid.extent;
    memory::require(vp::slabs::slab_exterior::least_bytes(extent, request.solid->closing),
                    "the flood of --solid exterior");
    exterior_.emplace(extent, request.solid->closing, static_cast<std::uint64_t>(room / 8), folder.string(),
                      static_cast<unsigned>(thread_count(request.threads)));
}

double streamed_repairs::layer_bytes() const { return is_any() ? decided_layer_bytes(inner_.extent) : 0; }

void streamed_repairs::begin(std::span<const slabs::layer_range> drawn) {
    if (!votes_) return;
    for (const slabs::layer_range& s : drawn)
        if (s.size() > 0) slabs_.push_back({s.begin - request_.padding, s.end - request_.padding});
    memory::require(slabs::column_parities::bytes(inner_, slabs_.size()), "the columns of --vote");
    columns_.emplace(inner_, slabs_);
}

void streamed_repairs::add(const triangle_stream::block& block) {
    if (!votes_) return;
    const placed_vertex_shader& place = places_[block.part];
    const auto at = [&](std::size_t i) {
        const glm::vec3 p = place(block.corners[i]);
        return vp::core::snap(snap_, p.x, p.y, p.z);
    };
    for (std::size_t i = 0; i < block.corners.size(); i += 3) columns_->add(at(i), at(i + 1), at(i + 2));
}

void streamed_repairs::add_walls(scene&& of_slab, const slabs::layer_range& layers,
                                 const std::function<void(double)>& progress) {
    voxelize_request how = request_;
    how.work_memory = request_.work_memory != 0 ? request_.work_memory : static_cast<std::uint64_t>(room_ / 8);
    how.progress = progress;
    exterior_->add_walls(draw_walls(std::move(of_slab), how, layers).table());
}

void streamed_repairs::flood() { exterior_->flood(); }

vp::solid_slab streamed_repairs::of(const voxelpipe::grid& part) {
    vp::solid_slab slab;
    if (votes_) {
        const int begin = part.offset.z - request_.grid.offset.z - request_.padding;
        while (slabs_[next_].begin != begin) ++next_; // those before were passed over
        slab = columns_->of(next_);
    }
    if (floods_) {
        inside_.reset();
        inside_ = exterior_->inside(part.offset, part.extent);
        slab.inside = inside_->data();
    }
    return slab;
}

} // namespace voxelize
