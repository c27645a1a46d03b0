// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The start of framebuffers and A-buffers: coarse raster and tile sort; and the sums of the workers' counts.

#include <cpu_ref/pipeline.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

// The triangles of a call by tile. If `result` is not ok, the call has failed and there is nothing else.
template <class Key>
struct binned_triangles {
    core::tile_grid tiles;
    raw_array<tile_pair<Key>> pairs; // by tile, in primitive order
    std::vector<tile_range> ranges;  // tiles that have pairs
    status result;

    // Threads that have a tile to work on, at least one.
    [[nodiscard]] unsigned workers(unsigned threads) const {
        return static_cast<unsigned>(std::max<std::size_t>(1, std::min<std::size_t>(threads, ranges.size())));
    }
};

template <coverage Rule, class Key, class Scene>
[[nodiscard]] binned_triangles<Key> bin_triangles(const execution& how, const Scene& s) {
    binned_triangles<Key> binned{core::tile_grid(s.where.extent, log2_tile_size), {}, {}, {}};
    auto coarse = coarse_raster<Rule, Key>(how, s, binned.tiles);
    if (coarse.code != status_code::ok) {
        binned.result = core::failure(coarse.code, stage::coarse_raster);
        binned.result.counts.triangles_in = s.first_primitive.back();
        return binned;
    }
    binned.result.counts = coarse.counts;
    binned.ranges = tile_sort(how, coarse.pairs, binned.tiles.count());
    binned.pairs = std::move(coarse.pairs);
    return binned;
}

// Adds what each worker's fine raster counted.
template <class Scratch>
void add_counts(counters& sum, const std::vector<std::unique_ptr<Scratch>>& scratch) {
    for (const auto& worker : scratch) {
        sum.fragments += worker->counts.fragments;
        sum.fragments_discarded += worker->counts.fragments_discarded;
        sum.voxels += worker->counts.voxels;
    }
}

} // namespace voxelpipe::cpu
