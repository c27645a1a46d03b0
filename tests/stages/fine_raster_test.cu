// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Fine raster and tile resolve, from the work items of the CPU's stages and after a coarse pass that several fine
// passes share: every voxel is the fold of its fragments.

#include "stage_scene.hpp"

using namespace stage_test;

namespace {

// Every voxel of target K is the fold of its fragments.
template <std::size_t K, class Target>
void expect_folded(const std::vector<reference::covered_voxel>& fragments, const vp::host_target<Target>& actual) {
    std::size_t i = 0;
    std::uint64_t id = 0;
    for (int z = 0; z < actual.extent.z; ++z)
        for (int y = 0; y < actual.extent.y; ++y)
            for (int x = 0; x < actual.extent.x; ++x, ++id) {
                auto a = Target::traits::begin(Target::traits::identity());
                for (; i < fragments.size() && fragments[i].voxel == id; ++i)
                    Target::traits::apply(a, vp::get<K>(marked::of(fragments[i].primitive).values));
                const auto expected = Target::traits::end(a), found = actual(x, y, z);
                ASSERT_EQ(std::memcmp(&expected, &found, sizeof(found)), 0)
                    << "target " << K << ", voxel " << x << ", " << y << ", " << z << ": " << expected << ", " << found;
            }
    EXPECT_EQ(i, fragments.size());
}

// Starts from the work items of the CPU's stages.
template <vp::coverage Rule>
void compare_fine_raster(stages<marked>& s) {
    const auto pairs =
        reference::sorted_tile_pairs(reference::tile_pairs(s.on_host(), s.g, Rule, policy.log2_tile_size).pairs);
    const auto ranges = reference::work_items(reference::tile_ranges(pairs), 8);
    const auto fragments = fragments_of(s, Rule, policy.log2_tile_size, pairs, ranges);

    std::vector<std::uint32_t> primitives;
    for (const reference::tile_pair& p : pairs) primitives.push_back(p.primitive);
    std::vector<device::work_item> items;
    std::vector<device::split_tile> splits;
    device::pipeline_state start{};
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        const auto tile = static_cast<std::uint32_t>(ranges[i].tile);
        const bool begins = i == 0 || ranges[i - 1].tile != tile;
        const bool split = !begins || (i + 1 < ranges.size() && ranges[i + 1].tile == tile);
        if (split && begins) splits.push_back({tile, start.num_images, 0});
        if (split) ++splits.back().num_images;
        items.push_back({tile, static_cast<std::uint32_t>(ranges[i].first),
                         static_cast<std::uint32_t>(ranges[i].last - ranges[i].first),
                         split ? start.num_images++ : device::no_image});
    }
    ASSERT_GT(splits.size(), 10u);
    ASSERT_GT(items.size(), start.num_images);
    start.tile_pairs = pairs.size();
    start.num_items = static_cast<std::uint32_t>(items.size());
    start.num_splits = static_cast<std::uint32_t>(splits.size());

    using framebuffer = marked_targets<vp::cuda_backend>;
    framebuffer fb{s.gpu, s.g.extent};
    const device::capacities limits{pairs.size(), 0, 0, 0};
    stage_memory m(s.gpu, start);
    const stages<marked>::scene_memory buffers(m.memory, s.on_device());
    const auto d_primitives = to_device(s.gpu, primitives);
    const auto d_items = to_device(s.gpu, items);
    const auto d_splits = to_device(s.gpu, splits);
    auto* const images = m.memory.take<device::word>(
        std::size_t{start.num_images} *
        static_cast<std::size_t>(device::max_image_words<policy.log2_tile_size, framebuffer::view_type>()));
    const auto scene = buffers.shade(s.on_device(), s.g, s.gpu.stream);
    clear_targets(fb.view(), m.state, limits, s.gpu.stream);
    device::tile_work work;
    work.in.primitives = d_primitives.data();
    work.in.items = d_items.data();
    work.in.images = images;
    work.in.tiles = vp::core::tile_grid(s.g.extent, policy.log2_tile_size);
    work.splits = d_splits.data();
    device::fine_pass<Rule, policy>(scene, fb.view(), work, {}, m.state, limits, s.gpu.stream);
    const device::pipeline_state end = m.end(s.gpu);

    EXPECT_EQ(end.fragments, fragments.size());
    EXPECT_GT(end.discarded, 0u);
    std::size_t voxels = 0;
    for (std::size_t i = 0; i < fragments.size(); ++i) voxels += i == 0 || fragments[i].voxel != fragments[i - 1].voxel;
    EXPECT_EQ(end.voxels, voxels);
    expect_folded<0>(fragments, vp::get<0>(fb).to_host_target(s.gpu));
    expect_folded<1>(fragments, vp::get<1>(fb).to_host_target(s.gpu));
    expect_folded<2>(fragments, vp::get<2>(fb).to_host_target(s.gpu));
    expect_folded<3>(fragments, vp::get<3>(fb).to_host_target(s.gpu));
}

TEST(FineRaster, FoldsTheCpusFragments) {
    stages s(mixed_triangles(1500, 45.0f, 72), box_grid({45, 37, 50}), marked{});
    compare_fine_raster<vp::coverage::thin>(s);
    compare_fine_raster<vp::coverage::conservative>(s);
}

// ---- one coarse pass, several fine passes ---------------------------------------------------------------------------

using extremes = vp::framebuffer<vp::cuda_backend, vp::target<double, blend::max>, vp::target<glm::u8vec4, blend::min>>;
using extreme_values = any_values<vp::target<double, blend::max>, vp::target<glm::u8vec4, blend::min>>;

// are_full: work items have many fragments; otherwise tiles have many work items.
template <vp::coverage Rule>
void compare_passes(stages<marked>& s, bool are_full = false) {
    // As separate calls: marks, other targets by another shader, and the marks once more onto the stored values.
    marked_targets<vp::cuda_backend> marks{s.gpu, s.g.extent}, d_marks{s.gpu, s.g.extent};
    extremes bounds{s.gpu, s.g.extent}, d_bounds{s.gpu, s.g.extent};
    const auto call = [&](const auto& shader, auto& fb) {
        const vp::status status = vp::voxelize(s.gpu, s.d_mesh, s.g, vp::passthrough{}, shader, fb, Rule);
        EXPECT_TRUE(status.ok()) << status.message();
        return status.counts;
    };
    const auto load = [](auto& fb) {
        vp::get<0>(fb).load();
        vp::get<1>(fb).load();
        vp::get<2>(fb).load();
        vp::get<3>(fb).load();
    };
    const vp::counters counted = call(marked{}, marks);
    call(extreme_values{}, bounds);
    load(marks);
    call(marked{}, marks);

    // The same passes after one coarse pass.
    using view_type = marked_targets<vp::cuda_backend>::view_type;
    const device::capacities limits{are_full ? 60000u : 20000u, 20000, 0, 0};
    stage_memory m(s.gpu, {});
    const stages<marked>::scene_memory buffers(m.memory, s.on_device());
    const device::tile_memory tiles(m.memory, vp::core::tile_grid(s.g.extent, policy.log2_tile_size), limits,
                                    std::max(device::max_image_words<policy.log2_tile_size, view_type>(),
                                             device::max_image_words<policy.log2_tile_size, extremes::view_type>()),
                                    are_full ? 512 : 16);
    ASSERT_LT(m.memory.used(), m.block.size());
    cudaStream_t const stream = s.gpu.stream;
    // snippet: two passes
    const auto scene = buffers.shade(s.on_device(), s.g, stream);
    const device::scene<extreme_values, vp::no_varyings> other{
        scene.geo, {extreme_values{}, nullptr, {}}, nullptr, scene.normal_factors, scene.offset};
    const device::tile_work work = device::coarse_pass<Rule>(scene.geo, tiles, m.state, limits, stream);
    clear_targets(d_marks.view(), m.state, limits, stream);
    device::fine_pass<Rule, policy>(scene, d_marks.view(), work, {}, m.state, limits, stream);
    const device::pass_counters none{false, false};
    device::clear_target(vp::get<0>(d_bounds.view().targets), m.state, limits, stream);
    device::clear_target(vp::get<1>(d_bounds.view().targets), m.state, limits, stream);
    device::fine_pass<Rule, policy>(other, d_bounds.view(), work, none, m.state, limits, stream);
    // end snippet
    load(d_marks);
    device::fine_pass<Rule, policy>(scene, d_marks.view(), work, none, m.state, limits, stream);
    const device::pipeline_state end = m.end(s.gpu);

    ASSERT_FALSE(device::has_failed(end, limits));
    if (are_full)
        EXPECT_GT(end.fragments, std::uint64_t{end.num_items} * vp::tuning::queue_capacity);
    else
        EXPECT_GT(end.num_splits, 10u);
    expect_same_counts(counted, device::to_status(end).counts);
    expect_same_bytes(vp::get<0>(marks).to_host(s.gpu), vp::get<0>(d_marks).to_host(s.gpu), "sums");
    expect_same_bytes(vp::get<1>(marks).to_host(s.gpu), vp::get<1>(d_marks).to_host(s.gpu), "bits");
    expect_same_bytes(vp::get<2>(marks).to_host(s.gpu), vp::get<2>(d_marks).to_host(s.gpu), "counts");
    expect_same_bytes(vp::get<3>(marks).to_host(s.gpu), vp::get<3>(d_marks).to_host(s.gpu), "last");
    expect_same_bytes(vp::get<0>(bounds).to_host(s.gpu), vp::get<0>(d_bounds).to_host(s.gpu), "maxima");
    expect_same_bytes(vp::get<1>(bounds).to_host(s.gpu), vp::get<1>(d_bounds).to_host(s.gpu), "minima");
}

TEST(FineRaster, SeveralPassesMayShareOneCoarsePass) {
    stages s(mixed_triangles(6000, 60.0f, 74), box_grid({60, 47, 71}), marked{});
    compare_passes<vp::coverage::thin>(s);
    compare_passes<vp::coverage::conservative>(s);
}

// Work items of more fragments than a block's queue holds.
TEST(FineRaster, DrawsFullTilesInRounds) {
    stages s(long_triangles(glm::ivec3(16), 2000, 76), box_grid({16, 16, 16}), marked{});
    compare_passes<vp::coverage::conservative>(s, true);
}

} // namespace
