// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coarse raster, tile sort and tile split: the (tile, primitive) pairs equal the CPU's, sorted by tile, and work items
// divide them.

#include "stage_scene.hpp"

#include <voxelpipe/device/tiles/tile_passes.cuh>

#include <algorithm>
#include <utility>
#include <vector>

using namespace stage_test;

namespace {

template <vp::coverage Rule>
void compare_tiles(stages<vp::constant_output<bool>>& s, int log2_size) {
    const vp::core::tile_grid tiles(s.g.extent, log2_size);
    const auto h_scene = vp::cpu::make_scene(s.how, s.on_host(), s.g);
    auto coarse = vp::cpu::coarse_raster<Rule, std::uint32_t>(s.how, h_scene, tiles);
    const auto ranges = vp::cpu::tile_sort(s.how, coarse.pairs, tiles.count());

    const device::capacities limits{coarse.pairs.size() + 100, 100000, 0, 0};
    const std::uint32_t per_item = 64;
    stage_memory m(s.gpu, {});
    const stages<vp::constant_output<bool>>::scene_memory buffers(m.memory, s.on_device());
    const auto scene = buffers.shade(s.on_device(), s.g, s.gpu.stream);
    const device::tile_memory memory(m.memory, tiles, limits, 0, per_item);
    ASSERT_LT(m.memory.used(), m.block.size());
    const device::tile_work work = device::coarse_pass<Rule>(scene.geo, memory, m.state, limits, s.gpu.stream);
    const device::pipeline_state end = m.end(s.gpu);
    ASSERT_EQ(end.tile_pairs, coarse.pairs.size());
    EXPECT_EQ(end.drawn, coarse.counts.triangles_drawn);
    EXPECT_EQ(end.zero_area, coarse.counts.triangles_zero_area);
    // The pairs of a tile come in any order.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> expected, found;
    for (const auto& p : coarse.pairs) expected.emplace_back(p.key, p.primitive);
    const auto tile_of = copy_back(work.tile_numbers, expected.size()),
               primitive_of = copy_back(work.in.primitives, expected.size());
    ASSERT_TRUE(std::is_sorted(tile_of.begin(), tile_of.end()));
    for (std::size_t i = 0; i < expected.size(); ++i) found.emplace_back(tile_of[i], primitive_of[i]);
    std::sort(expected.begin(), expected.end());
    std::sort(found.begin(), found.end());
    EXPECT_TRUE(expected == found);

    // Each range is split into work items of at most 64 pairs, none is lost, and images are numbered without gaps.
    auto items = copy_back(memory.split.items, end.num_items);
    std::sort(items.begin(), items.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::size_t at = 0;
    std::uint32_t images = 0, splits = 0;
    for (const auto& range : ranges) {
        const std::size_t count = range.last - range.first, parts = (count + per_item - 1) / per_item;
        splits += parts > 1;
        std::size_t next = range.first;
        for (std::size_t p = 0; p < parts; ++p, ++at) {
            ASSERT_LT(at, items.size());
            EXPECT_EQ(items[at].tile, range.tile);
            EXPECT_EQ(items[at].first, next);
            EXPECT_LE(items[at].count, per_item);
            EXPECT_EQ(items[at].image == device::no_image, parts == 1);
            images += parts > 1;
            next += items[at].count;
        }
        EXPECT_EQ(next, range.last);
    }
    EXPECT_EQ(at, items.size());
    EXPECT_EQ(end.num_images, images);
    EXPECT_EQ(end.num_splits, splits);
}

TEST(CoarseRaster, PairsAndWorkItemsAreTheCpus) {
    stages s(mixed_triangles(5000, 90.0f, 71), box_grid({90, 71, 100}), vp::constant(true));
    for (const int log2_size : {3, 4, 5}) {
        compare_tiles<vp::coverage::thin>(s, log2_size);
        compare_tiles<vp::coverage::conservative>(s, log2_size);
    }
    // Many of these have a part outside the grid, on either side of a line of tiles too.
    stages cut(mixed_triangles(2000, 60.0f, 72), box_grid({33, 60, 21}), vp::constant(true));
    compare_tiles<vp::coverage::conservative>(cut, 3);
    compare_tiles<vp::coverage::thin>(cut, 4);
}

} // namespace
