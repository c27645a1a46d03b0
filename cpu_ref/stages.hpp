// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Expected output of every device stage, one function per stage, on one thread and for any tile size: a failing device
// test compares with these and names the stage. The data flow is the pipeline's own:
//
//   vertex_shade -> tile_pairs -> sorted_tile_pairs -> tile_ranges -> work_items -> fragments
//
// Pairs and fragments are compared as sorted lists, because a device may emit them in any order.

#include <cpu_ref/pipeline.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace voxelpipe::cpu_stages {

// Snapped positions of each draw's vertices after its vertex shader, relative to the computed part of the grid. g must
// be valid (voxelpipe::validate).
template <class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] std::vector<std::vector<core::snapped_position>>
vertex_shade(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g) {
    const auto shaded = cpu::vertex_shade(cpu::execution{}, draws, core::make_snap_transform(g));
    std::vector<std::vector<core::snapped_position>> out;
    for (std::size_t d = 0; d < draws.size(); ++d)
        out.emplace_back(shaded[d].positions.get(), shaded[d].positions.get() + draws[d].mesh.num_vertices());
    return out;
}

// (tile, primitive): the primitive has work in that tile.
struct tile_pair {
    std::uint64_t tile;
    std::uint32_t primitive;
    friend auto operator<=>(const tile_pair&, const tile_pair&) = default;
};

struct coarse_output {
    status_code code = status_code::ok; // no pairs if index_out_of_range
    counters counts{};                  // triangles_* are set
    std::vector<tile_pair> pairs;       // by ascending primitive
};

// Coarse raster with tiles of 2^log2_tile_size voxels. A triangle whose reach (its bounding box, one voxel wider for
// thin coverage, clipped to the grid) lies in one tile is paired with that tile. Otherwise it is paired with the tiles
// of its reach whose closed box it meets (conservative), or that its plane passes within its columns of tiles (thin).
// Zero-area triangles have no thin pairs.
template <class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] coarse_output tile_pairs(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws, const grid& g,
                                       coverage rule, int log2_tile_size) {
    const cpu::execution how{};
    const auto s = cpu::make_scene(how, draws, g);
    const core::tile_grid tiles(g.extent, log2_tile_size);
    const auto coarse = rule == coverage::thin
                            ? cpu::coarse_raster<coverage::thin, std::uint64_t>(how, s, tiles)
                            : cpu::coarse_raster<coverage::conservative, std::uint64_t>(how, s, tiles);
    coarse_output out;
    out.code = coarse.code;
    out.counts = coarse.counts;
    for (const auto& p : coarse.pairs) out.pairs.push_back({p.key, p.primitive});
    return out;
}

// Tile sort: by tile, then by primitive.
[[nodiscard]] inline std::vector<tile_pair> sorted_tile_pairs(std::vector<tile_pair> pairs) {
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

// The run of one tile in the sorted pairs: [first, last).
struct tile_range {
    std::uint64_t tile;
    std::uint64_t first, last;
    friend bool operator==(const tile_range&, const tile_range&) = default;
};

[[nodiscard]] inline std::vector<tile_range> tile_ranges(std::span<const tile_pair> sorted) {
    std::vector<tile_range> out;
    for (std::uint64_t i = 0; i < sorted.size(); ++i) {
        if (out.empty() || out.back().tile != sorted[i].tile) out.push_back({sorted[i].tile, i, i});
        out.back().last = i + 1;
    }
    return out;
}

// Tile split: work items have at most max_pairs >= 1 pairs; a tile with more becomes several virtual tiles, in order.
[[nodiscard]] inline std::vector<tile_range> work_items(std::span<const tile_range> ranges, std::uint64_t max_pairs) {
    std::vector<tile_range> out;
    for (const tile_range& r : ranges)
        for (std::uint64_t first = r.first; first < r.last; first += max_pairs)
            out.push_back({r.tile, first, std::min(r.last, first + max_pairs)});
    return out;
}

// A fragment that was not discarded, with its linear voxel id within the computed part of the grid, (z * ny + y) * nx +
// x.
struct covered_voxel {
    std::uint64_t voxel;
    std::uint32_t primitive;
    friend auto operator<=>(const covered_voxel&, const covered_voxel&) = default;
};

// Fine raster of one work item: the fragments of its primitives within its tile, sorted by voxel and primitive.
template <class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] std::vector<covered_voxel> fragments(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                                                   const grid& g, coverage rule, int log2_tile_size,
                                                   std::span<const tile_pair> sorted, const tile_range& item) {
    const auto s = cpu::make_scene(cpu::execution{}, draws, g);
    const core::voxel_box box = core::tile_box(core::tile_grid(g.extent, log2_tile_size), item.tile, g.extent);
    std::vector<covered_voxel> out;
    for (std::uint64_t i = item.first; i < item.last; ++i) {
        const std::uint32_t id = sorted[i].primitive;
        const auto visit = [&](int x, int y, int z, const auto& value) {
            const auto nx = static_cast<std::uint64_t>(g.extent.x), ny = static_cast<std::uint64_t>(g.extent.y);
            const std::uint64_t voxel = (static_cast<std::uint64_t>(z) * ny + static_cast<std::uint64_t>(y)) * nx +
                                        static_cast<std::uint64_t>(x);
            if (value.keep) out.push_back({voxel, id});
        };
        if (rule == coverage::thin)
            cpu::shade_fragments<coverage::thin>(s, id, box, visit);
        else
            cpu::shade_fragments<coverage::conservative>(s, id, box, visit);
    }
    std::sort(out.begin(), out.end());
    return out;
}

} // namespace voxelpipe::cpu_stages
