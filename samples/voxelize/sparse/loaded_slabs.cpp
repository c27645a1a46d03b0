// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "loaded_slabs.hpp"

#include "../memory.hpp"
#include "../parallel.hpp"
#include "streamed_model.hpp"

#include <voxelpipe/solid.hpp>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

loaded_slabs::loaded_slabs(scene&& model, const voxelize_request& request, std::span<const slabs::layer_range> all,
                           std::size_t num_drawn, const std::filesystem::path& folder)
    : request_(request), colors_(request), model_(std::move(model), request) {
    const bool floods = request.solid && request.solid->rule == solid_rule::exterior;
    const auto passes = static_cast<std::size_t>(colors_.num_passes());
    steps_ = all.size() * (passes + (floods ? 1 : 0)) + num_drawn;
    if (floods) {
        const glm::ivec3 extent = request.grid.extent;
        memory::require(voxelpipe::slabs::slab_exterior::least_bytes(extent, request.solid->closing),
                        "the flood of --solid exterior");
        exterior_.emplace(extent, request.solid->closing, static_cast<std::uint64_t>(memory::room() / 8),
                          folder.string(), static_cast<unsigned>(thread_count(request.threads)));
        for (const slabs::layer_range& layers : all) // those in the padding are walls, too
            exterior_->add_walls(
                model_.walls(next_step(request.grid.crop({0, 0, layers.begin}, {extent.x, extent.y, layers.size()})))
                    .table());
        exterior_->flood();
    }
    for (int pass = 0; pass < colors_.num_passes(); ++pass)
        for (const slabs::layer_range& layers : all)
            if (const auto part = without_padding(layers)) colors_.add(pass, model_, next_step(*part));
}

std::optional<voxelpipe::grid> loaded_slabs::without_padding(const slabs::layer_range& layers) const {
    const int padding = request_.padding;
    const glm::ivec3 extent = request_.grid.extent;
    const int begin = std::max(layers.begin, padding), end = std::min(layers.end, extent.z - padding);
    if (begin >= end) return std::nullopt;
    return request_.grid.crop({padding, padding, begin}, {extent.x - 2 * padding, extent.y - 2 * padding, end - begin});
}

voxelize_request loaded_slabs::next_step(const voxelpipe::grid& grid) {
    const auto step = static_cast<double>(done_++);
    voxelize_request part = request_;
    part.grid = grid;
    if (request_.progress)
        part.progress = [this, step](double done) {
            request_.progress(std::min(1.0, (step + done) / static_cast<double>(steps_)));
        };
    return part;
}

sparse_volume loaded_slabs::draw(const slabs::layer_range& layers, voxelize_stats& stats) {
    const std::optional<voxelpipe::grid> grid = without_padding(layers);
    if (!grid) return empty_bricks(request_);
    voxelize_request part = next_step(*grid);
    colors_.give_to(part);
    std::optional<voxelpipe::core::bit_grid> inside;
    voxelpipe::solid_slab decided;
    if (exterior_) {
        inside = exterior_->inside(grid->offset, grid->extent);
        decided.inside = inside->data();
        part.solid->slab = &decided;
    }
    voxelize_stats of_part;
    sparse_volume bricks = model_.draw(part, of_part);
    add_part(stats, of_part);
    if (std::exchange(is_first_, false))
        stats.warnings.insert(stats.warnings.end(), model_.warnings().begin(), model_.warnings().end());
    stats.backend = of_part.backend;
    stats.threads = of_part.threads;
    stats.triangles = of_part.triangles;
    stats.triangles_dropped = of_part.triangles_dropped;
    ++stats.slabs;
    return bricks;
}

} // namespace voxelize
