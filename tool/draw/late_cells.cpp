// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// Cut cells whose result does not fit into the run's memory: a slab of layers is drawn when an output reads it. A crop
// of the grid has the values of the whole, so the files are those of a run that holds the result.
#include "distance/distance_voxelizer.hpp"
#include "pipeline_solid.hpp"
#include "pipeline_surface.hpp"

#include "model/memory.hpp"
#include "model/parallel.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

namespace {

// True if each layer along z has its values by itself: rows lie along x.
bool is_of_layers(target id) { return id == target::fraction || id == target::area || id == target::centroid; }

// The counts of two slabs as those of one.
fraction_counts joined(const fraction_counts& a, const fraction_counts& b) {
    fraction_counts sum = b; // what is counted of the model is the same in all of them
    sum.volume_low += a.volume_low;
    sum.volume_high += a.volume_high + (sum.volume_low < a.volume_low ? 1 : 0); // with the carry
    sum.cut_voxels += a.cut_voxels;
    sum.below_zero += a.below_zero;
    sum.above_one += a.above_one;
    sum.rows += a.rows;
    sum.open_rows += a.open_rows;
    return sum;
}

// What draws slabs of a model that is held.
class slab_drawer {
public:
    // stats: as of cells_in_slabs.
    slab_drawer(scene&& model, const voxelize_request& all, voxelize_stats& stats)
        : model_(std::move(model)), padding_(all.padding), whole_(all.grid), request_(all),
          stats_(stats), on_{static_cast<unsigned>(thread_count(all.threads))} {
        request_.grid = whole_.crop(glm::ivec3(padding_), whole_.extent - 2 * padding_);
        request_.progress = nullptr; // that of the outputs goes on
        drawer_.emplace(on_, model_, request_, stats_);
    }

    // Layers [begin, end) of the whole grid. Adds the counts; the warnings follow from those of all slabs, and the time
    // is that of writing.
    [[nodiscard]] volume draw(int begin, int end) {
        const int first = std::max(begin, padding_), last = std::min(end, whole_.extent.z - padding_);
        volume inside;
        if (first < last) {
            const glm::ivec3 n = whole_.extent - 2 * padding_;
            request_.grid = whole_.crop({padding_, padding_, first}, {n.x, n.y, last - first});
            const voxelize_stats known = stats_;
            inside = drawer_->run();
            stats_.warnings = known.warnings;
            stats_.milliseconds = known.milliseconds;
            stats_.slabs = known.slabs;
            if (known.fractions) stats_.fractions = joined(*known.fractions, *stats_.fractions);
        }
        volume slab = padding_ == 0 ? std::move(inside) : with_ring(inside, first - begin, end - begin);
        if (request_.outside) take_outside(slab, request_.threads);
        return slab;
    }

private:
    // The layers with the empty voxels around them; `first`: where those of `inside` begin.
    [[nodiscard]] volume with_ring(const volume& inside, int first, int layers) const {
        volume slab;
        slab.extent = {whole_.extent.x, whole_.extent.y, layers};
        for (const target id : request_.targets) {
            const target_info& info = info_of(id);
            channel& to = slab.add(std::string(info.name), info.type, info.components);
            const channel* const from = inside.find(info.name);
            const std::size_t voxel = size_of(info.type) * static_cast<std::size_t>(info.components);
            for (std::int64_t k = 0; from != nullptr && k < inside.extent[2]; ++k)
                for (std::int64_t j = 0; j < inside.extent[1]; ++j)
                    std::memcpy(to.data.data() +
                                    static_cast<std::size_t>(slab.index(padding_, j + padding_, k + first)) * voxel,
                                from->data.data() + static_cast<std::size_t>(inside.index(0, j, k)) * voxel,
                                static_cast<std::size_t>(inside.extent[0]) * voxel);
        }
        return slab;
    }

    scene model_;
    int padding_;
    voxelpipe::grid whole_;
    voxelize_request request_; // for the slab that is drawn, without its padding
    voxelize_stats& stats_;
    vp::cpu_backend on_;
    std::optional<pipeline<vp::cpu_backend>> drawer_; // refers to the four members above
};

} // namespace

std::optional<volume> cells_in_slabs(scene& model, const voxelize_request& request, voxelize_stats& stats) {
    const int step = request.slab_layers;
    const glm::ivec3 extent = request.grid.extent;
    const auto room = static_cast<double>(memory::room());
    if (step == 0 || extent.z <= step || request.solid || dense_need(model, request) <= room ||
        !std::all_of(request.targets.begin(), request.targets.end(), is_of_layers))
        return std::nullopt;
    const double written = request.write_bytes ? request.write_bytes(0, 0, 0) : 0;
    const auto need_of = [&](int layers) {
        voxelize_request part = request;
        part.padding = 0;
        part.grid = request.grid.crop({0, 0, 0}, {extent.x, extent.y, std::min(extent.z, layers)});
        // Two slabs are kept, and of one that is drawn also what lies within the padding.
        const double beside = volume_bytes(part) * (request.padding == 0 ? 1 : 2);
        return dense_need(model, part) + beside + written;
    };
    const int layers = most_layers(extent.z, step, room, need_of);
    const double need = need_of(layers);
    memory::expect(need);
    memory::require(need,
                    "a result of " + std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " +
                        std::to_string(extent.z) + " voxels, in slabs of " + std::to_string(layers) + " layers",
                    memory::fewer_voxels_hint, need);
    std::vector<int> ends;
    for (int end = 0; end < extent.z;) ends.push_back(end = std::min(end + layers, extent.z));
    stats.backend = "cpu";
    stats.threads = thread_count(request.threads);
    const auto drawer = std::make_shared<slab_drawer>(std::move(model), request, stats);
    stats.slabs = static_cast<int>(ends.size());
    return make_late_volume(
        request, ends, [drawer, ends](std::size_t i) { return drawer->draw(i == 0 ? 0 : ends[i - 1], ends[i]); },
        stats);
}

} // namespace voxelize
