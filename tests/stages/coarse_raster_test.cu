// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coarse raster, tile sort and tile split: the sorted (tile, primitive) pairs equal the CPU's, and work items divide
// them.

#include "stage_scene.hpp"

#include <voxelpipe/device/scene/count_and_emit.cuh>
#include <voxelpipe/device/tiles/coarse_raster.cuh>

using namespace stage_test;

namespace {

template <vp::coverage Rule>
void compare_tiles(stages<vp::constant_output<bool>>& s, int log2_size) {
    const vp::core::tile_grid tiles(s.g.extent, log2_size);
    const auto h_scene = vp::cpu::make_scene(s.how, s.on_host(), s.g);
    auto coarse = vp::cpu::coarse_raster<Rule, std::uint32_t>(s.how, h_scene, tiles);
    const auto ranges = vp::cpu::tile_sort(s.how, coarse.pairs, tiles.count());

    // Runs the stages one by one in the test's memory.
    const std::uint32_t n = s.num_triangles();
    const device::capacities limits{coarse.pairs.size() + 100, 100000, 0, 0};
    const std::uint32_t per_item = 64;
    stage_memory m(s.gpu, {});
    const stages<vp::constant_output<bool>>::scene_memory buffers(m.memory, s.on_device());
    const auto scene = buffers.shade(s.on_device(), s.g, s.gpu.stream);
    device::cell_buffers share = device::take_cell_buffers(m.memory, n, limits.tile_records);
    share.num_records = &m.state->tile_records;
    share.num_cells = &m.state->tile_pairs;
    const int bits = device::key_bits(tiles.count());
    std::uint32_t *keys[2], *primitives[2];
    for (int i = 0; i < 2; ++i) {
        keys[i] = m.memory.take<std::uint32_t>(limits.tile_pairs);
        primitives[i] = m.memory.take<std::uint32_t>(limits.tile_pairs);
    }
    const std::size_t bytes =
        std::max(device::sort_bytes<std::uint32_t>(limits.tile_pairs, bits), device::cell_scan_bytes(n));
    void* const storage = m.memory.take<std::byte>(bytes);
    device::split_buffers split{};
    split.pairs_per_item = per_item;
    split.items = m.memory.take<device::work_item>(device::max_items(limits.tile_pairs, tiles.count(), per_item));
    split.splits = m.memory.take<device::split_tile>(device::max_images(limits.tile_pairs, per_item));
    ASSERT_LT(m.memory.used(), m.block.size());

    const device::tile_cells<Rule> op{tiles, keys[0], primitives[0]};
    device::count_cells(scene.geo, op, share, m.state, storage, bytes, vp::stage::coarse_raster, s.gpu.stream);
    device::emit_cells(scene.geo, op, share, m.state, limits, vp::stage::coarse_raster, s.gpu.stream);
    device::fill_end(keys[0], primitives[0], share.num_cells, limits.tile_pairs, m.state, limits, s.gpu.stream);
    const int sorted = device::sort_by_cell(keys, primitives, limits.tile_pairs, bits, storage, bytes,
                                            vp::stage::tile_sort, s.gpu.stream);
    device::tile_split(keys[sorted], split, m.state, limits, s.gpu.stream);
    const device::pipeline_state end = m.end(s.gpu);
    ASSERT_EQ(end.tile_pairs, coarse.pairs.size());
    EXPECT_EQ(end.drawn, coarse.counts.triangles_drawn);
    EXPECT_EQ(end.zero_area, coarse.counts.triangles_zero_area);
    std::vector<std::uint32_t> tile_of, primitive_of;
    for (const auto& p : coarse.pairs) {
        tile_of.push_back(p.key);
        primitive_of.push_back(p.primitive);
    }
    expect_same_bytes(tile_of, copy_back(keys[sorted], tile_of.size()), "tiles of the sorted pairs");
    expect_same_bytes(primitive_of, copy_back(primitives[sorted], tile_of.size()), "primitives of the sorted pairs");

    // Each range is split into work items of at most 64 pairs, none is lost, and images are numbered without gaps.
    auto items = copy_back(split.items, end.num_items);
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
