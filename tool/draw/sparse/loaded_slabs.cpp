// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "loaded_slabs.hpp"

#include "draw/body_fill.hpp"
#include "model/memory.hpp"
#include "streamed_model.hpp"

#include <algorithm>
#include <utility>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

loaded_slabs::loaded_slabs(scene&& model, const voxelize_request& request, std::span<const slabs::layer_range> all,
                           std::span<const std::size_t> drawn, const std::filesystem::path& folder,
                           const pass_files* kept, voxelize_stats& stats)
    : request_(request), with_means_(needs_mean(request, model.materials)), model_(std::move(model), request),
      passes_(request_, with_means_, all, drawn, static_cast<double>(memory::room()), folder, kept),
      steps_(drawn.size()) {
    for (std::size_t s = 0; s < all.size(); ++s) steps_ += static_cast<std::size_t>(passes_.left_of(s));
    const glm::ivec3 extent = request.grid.extent;
    passes_.run(
        [&](slab_pass pass, std::size_t slab) {
            const auto [begin, end] = all[slab];
            const std::optional<voxelpipe::grid> grid =
                pass == slab_pass::walls ? request.grid.crop({0, 0, begin}, {extent.x, extent.y, end - begin})
                                         : without_padding(all[slab]);
            if (grid) passes_.add(pass, passes_.draw(pass, model_, next_step(*grid)));
        },
        stats);
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
    passes_.give_to(part);
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
