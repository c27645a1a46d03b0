// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Each device stage by itself, against the CPU's stage: snapped vertices, (tile, primitive) pairs after the sort, work
// items after the split.

#include "device_test.hpp"

#include <algorithm>

using namespace device_test;
namespace device = voxelpipe::device;

namespace {

using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::solid<bool>>;

template <class T>
std::vector<T> copy_back(const T* from, std::size_t count) {
    std::vector<T> host(count);
    cudaMemcpy(host.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost);
    return host;
}

struct stages {
    mesh_data data;
    vp::grid g;
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    vp::mesh<vp::cuda_backend> d_mesh;
    vp::mesh<vp::cpu_backend> h_mesh;
    draw_type d_draw, h_draw;
    vp::cpu::execution how{2, nullptr, nullptr};

    stages(mesh_data m, const vp::grid& g_)
        : data(std::move(m)), g(g_), d_mesh(gpu, data.positions, data.triangles),
          h_mesh(cpu, data.positions, data.triangles), d_draw{d_mesh.view(), {}, vp::constant(true)},
          h_draw{h_mesh.view(), {}, vp::constant(true)} {}
};

TEST(Stages, VertexShade) {
    stages s(mixed_triangles(3000, 50.0f, 70), box_grid({50, 40, 30}));
    const auto snap = vp::core::make_snap_transform(s.g);
    const auto expected = vp::cpu::vertex_shade(s.how, std::span<const draw_type>(&s.h_draw, 1), snap);
    vp::cuda_backend::buffer<vp::core::snapped_position> positions(s.gpu, s.data.positions.size());
    device::vertex_shade<vp::mesh_view<>, vp::passthrough, vp::no_varyings>(s.d_draw.mesh, {}, snap, 0,
                                                                            positions.data(), nullptr, s.gpu.stream);
    const auto actual = positions.to_host(s.gpu);
    const std::vector<vp::core::snapped_position> reference(expected[0].positions.get(),
                                                            expected[0].positions.get() + actual.size());
    expect_same_bytes(reference, actual, "snapped positions");
}

template <vp::coverage Rule>
void compare_tiles(stages& s, int log2_size) {
    const vp::core::tile_grid tiles(s.g.extent, log2_size);
    auto reference = vp::cpu::make_scene(s.how, std::span<const draw_type>(&s.h_draw, 1), s.g);
    auto coarse = vp::cpu::coarse_raster<Rule, std::uint32_t>(s.how, reference, tiles);
    const auto ranges = vp::cpu::tile_sort(s.how, coarse.pairs, tiles.count());

    // The stages one by one, in memory of the test's own.
    const auto n = static_cast<std::uint32_t>(s.data.triangles.size());
    const device::capacities limits{coarse.pairs.size() + 100, 100000, 0, 0};
    const std::uint32_t per_item = 64;
    const int bits = device::key_bits(tiles.count());
    vp::cuda_backend::buffer<std::byte> block(s.gpu, std::size_t{256} << 20);
    device::arena memory(block.data());
    auto* const state = memory.take<device::pipeline_state>(1);
    cudaMemsetAsync(state, 0, sizeof(*state), s.gpu.stream);
    const device::scene_memory<vp::mesh_view<>, vp::passthrough, vp::solid<bool>> buffers(
        memory, std::span<const draw_type>(&s.d_draw, 1));
    const auto scene = buffers.shade(std::span<const draw_type>(&s.d_draw, 1), s.g, s.gpu.stream);
    device::share_buffers share = device::take_share(memory, n, limits.tile_records);
    share.num_records = &state->tile_records;
    share.num_cells = &state->tile_pairs;
    std::uint32_t *keys[2], *primitives[2];
    for (int i = 0; i < 2; ++i) {
        keys[i] = memory.take<std::uint32_t>(limits.tile_pairs);
        primitives[i] = memory.take<std::uint32_t>(limits.tile_pairs);
    }
    const std::size_t bytes =
        std::max(device::sort_bytes<std::uint32_t>(limits.tile_pairs, bits), device::share_scan_bytes(n));
    void* const storage = memory.take<std::byte>(bytes);
    device::split_buffers<> split{};
    split.pairs_per_item = per_item;
    split.items = memory.take<device::work_item>(device::most_items(limits.tile_pairs, tiles.count(), per_item));
    split.splits = memory.take<device::split_tile>(device::most_images(limits.tile_pairs, per_item));
    ASSERT_LT(memory.used(), block.size());

    const device::tile_cells<Rule> op{tiles, keys[0], primitives[0]};
    device::share_count(scene.geo, op, share, state, storage, bytes, vp::stage::coarse_raster, s.gpu.stream);
    device::share_emit(scene.geo, op, share, state, limits, vp::stage::coarse_raster, s.gpu.stream);
    device::fill_end(keys[0], primitives[0], share.num_cells, limits.tile_pairs, state, limits, s.gpu.stream);
    cub::DoubleBuffer<std::uint32_t> k(keys[0], keys[1]), v(primitives[0], primitives[1]);
    device::sort_by_cell(k, v, limits.tile_pairs, bits, storage, bytes, vp::stage::tile_sort, s.gpu.stream);
    device::tile_split(k.Current(), split, state, limits, s.gpu.stream);
    ASSERT_EQ(cudaStreamSynchronize(s.gpu.stream), cudaSuccess);

    const auto end = copy_back(state, 1)[0];
    ASSERT_EQ(end.tile_pairs, coarse.pairs.size());
    EXPECT_EQ(end.drawn, coarse.counts.triangles_drawn);
    EXPECT_EQ(end.zero_area, coarse.counts.triangles_zero_area);
    std::vector<std::uint32_t> tile_of, primitive_of;
    for (const auto& p : coarse.pairs) {
        tile_of.push_back(p.key);
        primitive_of.push_back(p.primitive);
    }
    expect_same_bytes(tile_of, copy_back(k.Current(), tile_of.size()), "tiles of the sorted pairs");
    expect_same_bytes(primitive_of, copy_back(v.Current(), tile_of.size()), "primitives of the sorted pairs");

    // Work items: each range cut into pieces of at most 64 pairs, none lost, images numbered without a gap.
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

TEST(Stages, CoarseRasterSortAndSplit) {
    stages s(mixed_triangles(5000, 90.0f, 71), box_grid({90, 71, 100}));
    for (const int log2_size : {3, 4, 5}) {
        compare_tiles<vp::coverage::thin>(s, log2_size);
        compare_tiles<vp::coverage::conservative>(s, log2_size);
    }
}

} // namespace
