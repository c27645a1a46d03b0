// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Each device stage by itself against the CPU's stage: snapped vertices, (tile, primitive) pairs after the sort, work
// items after the split, fine raster and tile resolve from the CPU's work items, sorted fragment lists. Also several
// fine passes after one coarse pass.

#include "cells.hpp"

#include <cpu_ref/stages.hpp>

#include <algorithm>
#include <span>

using namespace device_test;
namespace blend = voxelpipe::blend;
namespace device = voxelpipe::device;
namespace reference = voxelpipe::cpu_stages;

namespace {

template <class T>
std::vector<T> copy_back(const T* from, std::size_t count) {
    std::vector<T> host(count);
    cudaMemcpy(host.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost);
    return host;
}

// One draw on both backends.
template <class FragmentShader>
struct stages {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    using scene_memory = device::scene_memory<vp::mesh_view<>, vp::passthrough, FragmentShader>;

    mesh_data data;
    vp::grid g;
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    vp::mesh<vp::cuda_backend> d_mesh;
    vp::mesh<vp::cpu_backend> h_mesh;
    draw_type d_draw, h_draw;
    vp::cpu::execution how{2, nullptr, nullptr};

    stages(mesh_data m, const vp::grid& g_, const FragmentShader& fs)
        : data(std::move(m)), g(g_), d_mesh(gpu, data.positions, data.triangles),
          h_mesh(cpu, data.positions, data.triangles), d_draw{d_mesh.view(), {}, fs}, h_draw{h_mesh.view(), {}, fs} {}
    stages(const stages&) = delete; // the backends must not move
    stages& operator=(const stages&) = delete;

    [[nodiscard]] std::span<const draw_type> on_device() const { return {&d_draw, 1}; }
    [[nodiscard]] std::span<const draw_type> on_host() const { return {&h_draw, 1}; }
    [[nodiscard]] std::uint32_t num_triangles() const { return static_cast<std::uint32_t>(data.triangles.size()); }
};

// Device memory for the stages' arrays.
struct stage_memory {
    vp::cuda_backend::buffer<std::byte> block;
    device::arena memory{block.data()};
    device::pipeline_state* state = memory.take<device::pipeline_state>(1);

    stage_memory(vp::cuda_backend& gpu, const device::pipeline_state& start) : block(gpu, std::size_t{256} << 20) {
        EXPECT_EQ(cudaMemcpyAsync(state, &start, sizeof(start), cudaMemcpyHostToDevice, gpu.stream), cudaSuccess);
    }
    // After the stages.
    [[nodiscard]] device::pipeline_state end(const vp::cuda_backend& gpu) const {
        EXPECT_LT(memory.used(), block.size());
        EXPECT_EQ(cudaStreamSynchronize(gpu.stream), cudaSuccess);
        return copy_back(state, 1)[0];
    }
};

TEST(Stages, VertexShadeSnapsAsTheCpuDoes) {
    stages s(mixed_triangles(3000, 50.0f, 70), box_grid({50, 40, 30}), vp::constant(true));
    const auto snap = vp::core::make_snap_transform(s.g);
    const auto expected = vp::cpu::vertex_shade(s.how, s.on_host(), snap);
    vp::cuda_backend::buffer<vp::core::snapped_position> positions(s.gpu, s.data.positions.size());
    vp::cuda_backend::buffer<device::int32_position> near(s.gpu, s.data.positions.size());
    device::vertex_shade<vp::mesh_view<>, vp::passthrough, vp::no_varyings>(
        s.d_draw.mesh, {}, snap, 0, device::vertex_positions{positions.data(), near.data()}, nullptr, s.gpu.stream);
    const auto actual = positions.to_host(s.gpu);
    const std::vector<vp::core::snapped_position> reference(expected[0].positions.get(),
                                                            expected[0].positions.get() + actual.size());
    expect_same_bytes(reference, actual, "snapped positions");
    std::size_t num_far = 0;
    const auto in_32_bits = near.to_host(s.gpu);
    for (std::size_t i = 0; i < actual.size(); ++i) {
        const vp::core::snapped_position& p = actual[i];
        bool is_near = true;
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        for (const std::int64_t q : {p.x, p.y, p.z}) is_near = is_near && q >= -limit && q <= limit; // and not a mark
        ASSERT_EQ(in_32_bits[i].is_near != 0, is_near) << i;
        num_far += !is_near;
        if (!is_near) continue;
        EXPECT_EQ(in_32_bits[i].q[0], p.x);
        EXPECT_EQ(in_32_bits[i].q[1], p.y);
        EXPECT_EQ(in_32_bits[i].q[2], p.z);
    }
    EXPECT_GT(num_far, 0u);
}

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
    device::share_buffers share = device::take_share(m.memory, n, limits.tile_records);
    share.num_records = &m.state->tile_records;
    share.num_cells = &m.state->tile_pairs;
    const int bits = device::key_bits(tiles.count());
    std::uint32_t *keys[2], *primitives[2];
    for (int i = 0; i < 2; ++i) {
        keys[i] = m.memory.take<std::uint32_t>(limits.tile_pairs);
        primitives[i] = m.memory.take<std::uint32_t>(limits.tile_pairs);
    }
    const std::size_t bytes =
        std::max(device::sort_bytes<std::uint32_t>(limits.tile_pairs, bits), device::share_scan_bytes(n));
    void* const storage = m.memory.take<std::byte>(bytes);
    device::split_buffers<> split{};
    split.pairs_per_item = per_item;
    split.items = m.memory.take<device::work_item>(device::max_items(limits.tile_pairs, tiles.count(), per_item));
    split.splits = m.memory.take<device::split_tile>(device::max_images(limits.tile_pairs, per_item));
    ASSERT_LT(m.memory.used(), m.block.size());

    const device::tile_cells<Rule> op{tiles, keys[0], primitives[0]};
    device::share_count(scene.geo, op, share, m.state, storage, bytes, vp::stage::coarse_raster, s.gpu.stream);
    device::share_emit(scene.geo, op, share, m.state, limits, vp::stage::coarse_raster, s.gpu.stream);
    device::fill_end(keys[0], primitives[0], share.num_cells, limits.tile_pairs, m.state, limits, s.gpu.stream);
    cub::DoubleBuffer<std::uint32_t> k(keys[0], keys[1]), v(primitives[0], primitives[1]);
    device::sort_by_cell(k, v, limits.tile_pairs, bits, storage, bytes, vp::stage::tile_sort, s.gpu.stream);
    device::tile_split(k.Current(), split, m.state, limits, s.gpu.stream);
    const device::pipeline_state end = m.end(s.gpu);
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

TEST(Stages, CoarseRasterSortAndSplitGiveTheCpusWorkItems) {
    stages s(mixed_triangles(5000, 90.0f, 71), box_grid({90, 71, 100}), vp::constant(true));
    for (const int log2_size : {3, 4, 5}) {
        compare_tiles<vp::coverage::thin>(s, log2_size);
        compare_tiles<vp::coverage::conservative>(s, log2_size);
    }
}

// ---- fine raster and tile resolve -----------------------------------------------------------------------------------

// A fragment's values depend on its primitive; whether it is kept depends on its voxel too.
struct marked {
    VOXELPIPE_HD static auto of(std::uint32_t primitive) {
        return vp::outputs(vp::exact::mul(0.1f, static_cast<float>(primitive % 13u)), true, 0u, primitive);
    }
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h =
            mix_bits(f.primitive * 31u + static_cast<std::uint32_t>(f.voxel.x + 1009 * f.voxel.y + 20011 * f.voxel.z));
        return of(f.primitive).discard_if(h % 5 == 4);
    }
};

using sum = vp::target<float, blend::add>;
using bits = vp::target<vp::bit, blend::bit_or>;
using counts = vp::target<std::uint32_t, blend::count>;
using last = vp::target<std::uint32_t, blend::replace>;
template <class Backend>
using marked_targets = vp::framebuffer<Backend, sum, bits, counts, last>;

// The fragments of all work items, sorted by voxel and primitive.
template <class FragmentShader>
std::vector<reference::covered_voxel> fragments_of(const stages<FragmentShader>& s, vp::coverage rule, int log2_size,
                                                   const std::vector<reference::tile_pair>& pairs,
                                                   const std::vector<reference::tile_range>& items) {
    std::vector<reference::covered_voxel> all;
    for (const reference::tile_range& item : items) {
        const auto part = reference::fragments(s.on_host(), s.g, rule, log2_size, pairs, item);
        all.insert(all.end(), part.begin(), part.end());
    }
    std::sort(all.begin(), all.end());
    return all;
}

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

void clear_targets(const marked_targets<vp::cuda_backend>::view_type& fb, const device::pipeline_state* state,
                   const device::capacities& limits, cudaStream_t stream) {
    device::clear_target(vp::get<0>(fb.targets), state, limits, stream);
    device::clear_target(vp::get<1>(fb.targets), state, limits, stream);
    device::clear_target(vp::get<2>(fb.targets), state, limits, stream);
    device::clear_target(vp::get<3>(fb.targets), state, limits, stream);
}

constexpr vp::tuning::fine_raster_policy policy{128, 3, 2, 0};

template <class T>
vp::cuda_backend::buffer<T> to_device(vp::cuda_backend& gpu, const std::vector<T>& host) {
    return {gpu, vp::array_view<const T>(host.data(), host.size())};
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

TEST(Stages, FineRasterAndTileResolveFoldTheCpusFragments) {
    stages s(mixed_triangles(1500, 45.0f, 72), box_grid({45, 37, 50}), marked{});
    compare_fine_raster<vp::coverage::thin>(s);
    compare_fine_raster<vp::coverage::conservative>(s);
}

// ---- A-buffer -------------------------------------------------------------------------------------------------------

template <vp::coverage Rule>
void compare_lists(stages<marked>& s) {
    // One tile for all.
    constexpr int log2_size = 8;
    const auto pairs = reference::sorted_tile_pairs(reference::tile_pairs(s.on_host(), s.g, Rule, log2_size).pairs);
    const auto fragments = fragments_of(s, Rule, log2_size, pairs, reference::tile_ranges(pairs));
    ASSERT_GT(fragments.size(), 1000u);

    const device::capacities limits{0, 0, fragments.size() + 100, 100000};
    stage_memory m(s.gpu, {});
    const stages<marked>::scene_memory buffers(m.memory, s.on_device());
    const auto lists = device::take_lists<std::uint32_t, float>(m.memory, device::num_voxels(s.g), limits.fragments);
    const device::list_memory share(m.memory, s.num_triangles(), limits.fragment_records);
    const auto scene = buffers.shade(s.on_device(), s.g, s.gpu.stream);
    const auto sorted = device::build_lists<Rule, device::first_value>(scene, lists, share.with(m.state), m.state,
                                                                       limits, true, s.gpu.stream, nullptr);
    const device::pipeline_state end = m.end(s.gpu);

    const std::size_t n = fragments.size();
    ASSERT_EQ(end.list_fragments, n);
    EXPECT_GT(end.discarded, 0u);
    std::vector<std::uint32_t> voxels, primitives;
    std::vector<float> payloads;
    std::vector<std::uint64_t> first_of_voxel;
    for (std::size_t i = 0; i < n; ++i) {
        voxels.push_back(static_cast<std::uint32_t>(fragments[i].voxel));
        primitives.push_back(fragments[i].primitive);
        payloads.push_back(vp::get<0>(marked::of(fragments[i].primitive).values));
        if (i == 0 || fragments[i].voxel != fragments[i - 1].voxel) first_of_voxel.push_back(i);
    }
    ASSERT_EQ(end.list_voxels, first_of_voxel.size());
    expect_same_bytes(voxels, copy_back(sorted.keys, n), "voxels of the sorted fragments");
    expect_same_bytes(first_of_voxel, copy_back(sorted.first_of_voxel, first_of_voxel.size()), "first of each voxel");
    const auto places = copy_back(sorted.values, n);
    const auto primitive_at = copy_back(sorted.primitives, n);
    const auto payload_at = copy_back(sorted.payloads, n);
    std::vector<std::uint32_t> found_primitives;
    std::vector<float> found_payloads;
    for (const std::uint32_t place : places) {
        ASSERT_LT(place, n);
        found_primitives.push_back(primitive_at[place]);
        found_payloads.push_back(payload_at[place]);
    }
    expect_same_bytes(primitives, found_primitives, "primitives of the sorted fragments");
    expect_same_bytes(payloads, found_payloads, "payloads of the sorted fragments");
}

TEST(Stages, FragmentListsAreTheCpusFragments) {
    stages s(mixed_triangles(1500, 45.0f, 73), box_grid({45, 37, 50}), marked{});
    compare_lists<vp::coverage::thin>(s);
    compare_lists<vp::coverage::conservative>(s);
}

// ---- one coarse pass, several fine passes ---------------------------------------------------------------------------

using extremes = vp::framebuffer<vp::cuda_backend, vp::target<double, blend::max>, vp::target<glm::u8vec4, blend::min>>;
using extreme_values = any_values<vp::target<double, blend::max>, vp::target<glm::u8vec4, blend::min>>;

template <vp::coverage Rule>
void compare_passes(stages<marked>& s) {
    // As separate calls: marks, other targets by another shader, and the marks once more onto the stored values.
    marked_targets<vp::cuda_backend> marks{s.gpu, s.g.extent}, d_marks{s.gpu, s.g.extent};
    extremes most{s.gpu, s.g.extent}, d_most{s.gpu, s.g.extent};
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
    call(extreme_values{}, most);
    load(marks);
    call(marked{}, marks);

    // The same passes after one coarse pass.
    using view_type = marked_targets<vp::cuda_backend>::view_type;
    const device::capacities limits{20000, 20000, 0, 0};
    stage_memory m(s.gpu, {});
    const stages<marked>::scene_memory buffers(m.memory, s.on_device());
    const device::tile_memory tiles(m.memory, vp::core::tile_grid(s.g.extent, policy.log2_tile_size), s.num_triangles(),
                                    limits,
                                    std::max(device::max_image_words<policy.log2_tile_size, view_type>(),
                                             device::max_image_words<policy.log2_tile_size, extremes::view_type>()),
                                    16);
    ASSERT_LT(m.memory.used(), m.block.size());
    cudaStream_t const stream = s.gpu.stream;
    // snippet: two passes
    const auto scene = buffers.shade(s.on_device(), s.g, stream);
    const device::scene<extreme_values, vp::no_varyings> other{
        scene.geo, {extreme_values{}, nullptr}, nullptr, scene.normal_factors, scene.offset};
    const device::tile_work work = device::coarse_pass<Rule>(scene.geo, tiles, m.state, limits, stream);
    clear_targets(d_marks.view(), m.state, limits, stream);
    device::fine_pass<Rule, policy>(scene, d_marks.view(), work, {}, m.state, limits, stream);
    const device::pass_counters none{false, false};
    device::clear_target(vp::get<0>(d_most.view().targets), m.state, limits, stream);
    device::clear_target(vp::get<1>(d_most.view().targets), m.state, limits, stream);
    device::fine_pass<Rule, policy>(other, d_most.view(), work, none, m.state, limits, stream);
    // end snippet
    load(d_marks);
    device::fine_pass<Rule, policy>(scene, d_marks.view(), work, none, m.state, limits, stream);
    const device::pipeline_state end = m.end(s.gpu);

    ASSERT_FALSE(device::has_failed(end, limits));
    EXPECT_GT(end.num_splits, 10u);
    expect_same_counts(counted, device::to_status(end).counts);
    expect_same_bytes(vp::get<0>(marks).to_host(s.gpu), vp::get<0>(d_marks).to_host(s.gpu), "sums");
    expect_same_bytes(vp::get<1>(marks).to_host(s.gpu), vp::get<1>(d_marks).to_host(s.gpu), "bits");
    expect_same_bytes(vp::get<2>(marks).to_host(s.gpu), vp::get<2>(d_marks).to_host(s.gpu), "counts");
    expect_same_bytes(vp::get<3>(marks).to_host(s.gpu), vp::get<3>(d_marks).to_host(s.gpu), "last");
    expect_same_bytes(vp::get<0>(most).to_host(s.gpu), vp::get<0>(d_most).to_host(s.gpu), "maxima");
    expect_same_bytes(vp::get<1>(most).to_host(s.gpu), vp::get<1>(d_most).to_host(s.gpu), "minima");
}

TEST(Stages, OneCoarsePassServesSeveralFinePasses) {
    stages s(mixed_triangles(6000, 60.0f, 74), box_grid({60, 47, 71}), marked{});
    compare_passes<vp::coverage::thin>(s);
    compare_passes<vp::coverage::conservative>(s);
}

} // namespace
