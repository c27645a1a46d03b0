// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Every kernel of render targets on small loads, quick enough for compute-sanitizer. Lists: small_lists_test.cu.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

template <class... Targets>
struct on_both {
    static void compare(const mesh_data& m, const vp::grid& g, vp::coverage rule) {
        expect_same<Targets...>(m, g, vp::passthrough{}, any_values<Targets...>{}, rule);
    }
};

TEST(SmallLoads, EveryKindOfTargetHoldsTheCpusBytes) {
    for (const vp::coverage rule : both_rules) {
        small_kinds<on_both>::compare(mixed_triangles(300, 30.0f, 60), box_grid({30, 21, 33}), rule);
        // More triangles in a tile than a work item holds.
        small_kinds<on_both>::compare(mixed_triangles(1200, 4.0f, 66), box_grid({5, 4, 6}), rule);
    }
}

TEST(SmallLoads, LargeTrianglesWithoutTilesGiveTheCpusBytes) {
    mesh_data m = mixed_triangles(1500, 4.0f, 61);
    add_triangle(m, {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    for (const vp::coverage rule : both_rules) {
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid({150, 90, 70}), vp::passthrough{},
                                                        vp::constant(true), rule);
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid({150, 90, 70}), shift{0.5f}, vp::constant(true),
                                                        rule);
    }
}

// Sums that are counted until a last pass, which reads a small grid whole and only the marked chunks of a large one.
TEST(SmallLoads, CountedSumsAreTheCpus) {
    mesh_data m = mixed_triangles(800, 40.0f, 68);
    add_triangle(m, {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    for (const vp::coverage rule : both_rules)
        for (const glm::ivec3 extent : {glm::ivec3(37, 21, 31), glm::ivec3(320, 200, 141)})
            expect_same<vp::target<float, blend::add>>(m, box_grid(extent), vp::passthrough{}, vp::constant(0.1f),
                                                       rule);
}

// The third call and later ones use a graph.
TEST(SmallLoads, RepeatedCallsGiveTheCpusBytes) {
    const mesh_data m = mixed_triangles(300, 30.0f, 69);
    const vp::grid g = box_grid({30, 21, 33});
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const vp::mesh<vp::cuda_backend> gpu_mesh{gpu, m.positions, m.triangles};
    const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, vp::target<float, blend::add>> gpu_fb{gpu, g.extent};
    vp::framebuffer<vp::cpu_backend, vp::target<float, blend::add>> cpu_fb{cpu, g.extent};
    ASSERT_TRUE(vp::voxelize(cpu, cpu_mesh, g, vp::passthrough{}, vp::constant(0.1f), cpu_fb).ok());
    for (int call = 0; call < 5; ++call) {
        ASSERT_TRUE(vp::voxelize(gpu, gpu_mesh, g, vp::passthrough{}, vp::constant(0.1f), gpu_fb).ok());
        expect_same_bytes(vp::get<0>(cpu_fb).to_host(cpu), vp::get<0>(gpu_fb).to_host(gpu), "sums");
    }
}

// More fragments than one thread folds: a block folds one voxel after the other, or its threads fold in parallel.
TEST(SmallLoads, LongVoxelsOfFoldedBlendsGiveTheCpusBytes) {
    const vp::grid g = box_grid({36, 5, 6});
    mesh_data m = mixed_triangles(200, 36.0f, 74);
    append(m, triangles_in_voxel(2000, {3.0f, 2.0f, 4.0f}, 75));
    expect_same(folded_targets{}, m, g, vp::passthrough{}, folded_values{}, vp::coverage::conservative);
    for (std::uint32_t x = 0; x < 36; ++x)
        append(m, triangles_in_voxel(1400, {static_cast<float>(x), 0.0f, 0.0f}, 76 + x));
    expect_same(folded_targets{}, m, g, vp::passthrough{}, folded_values{}, vp::coverage::conservative);
}

// The identity of these blends is a set bit. Rows and bricks end within a word.
TEST(SmallLoads, BitsClearedToOneAreTheCpus) {
    expect_same<vp::target<vp::bit, blend::bit_and>, vp::target<vp::bit, blend::min, vp::layout::tiled>>(
        mixed_triangles(200, 30.0f, 67), box_grid({37, 21, 6}), vp::passthrough{}, vp::constant(false, false),
        vp::coverage::conservative);
}

// Fragments shaded and blended by voxel: voxels that span runs, voxels whose fragments are all discarded, and draws.
TEST(SmallLoads, ListedFragmentsGiveTheCpusBytes) {
    mesh_data m = mixed_triangles(700, 30.0f, 70);
    append(m, triangles_in_voxel(3000, {3.0f, 2.0f, 4.0f}, 71));
    for (std::uint32_t x = 0; x < 20; ++x)
        append(m, triangles_in_voxel(70, {static_cast<float>(x), 9.0f, 9.0f}, 72 + x));
    const vp::grid g = box_grid({30, 21, 33});
    for (const vp::coverage rule : both_rules)
        for (const std::uint32_t discards : {0u, 1u, 2u})
            expect_same(tile_targets{}, m, g, vp::passthrough{}, tile_values{discards}, rule,
                        discards == 2 ? start::load : start::clear);
    vp::cuda_backend be;
    tile_targets::framebuffer<vp::cuda_backend> timed{be, g.extent};
    const vp::stage_times times = time_stages(
        be, [&] { return draw_framebuffer(be, timed, m, g, vp::passthrough{}, tile_values{}, {}, start::clear); });
    EXPECT_GT(times.vertex_shade, 0.0);
    EXPECT_GT(times.fine_raster, 0.0);
    EXPECT_GT(times.tile_sort, 0.0);
    EXPECT_GT(times.clear, 0.0);
    EXPECT_GT(times.tile_resolve, 0.0);
    for (const double none : {times.coarse_raster, times.tile_split, times.abuffer_emit}) EXPECT_EQ(none, 0.0);
}

TEST(SmallLoads, StageTimesOfTilesAndOrderedTargetsAddUpToTheCall) {
    using fb_type = small_kinds<vp::framebuffer, vp::cuda_backend>;
    const small_kinds<any_values> shader;
    const mesh_data m = mixed_triangles(300, 30.0f, 63);
    const vp::grid g = box_grid({30, 21, 33});
    vp::cuda_backend be;
    be.strategy = vp::strategy::tiled;
    fb_type timed{be, g.extent}, plain{be, g.extent};
    const auto draw = [&](fb_type& fb) {
        return draw_framebuffer(be, fb, m, g, vp::passthrough{}, shader, {}, start::clear);
    };
    ASSERT_TRUE(draw(plain).ok());
    const vp::stage_times times = time_stages(be, [&] { return draw(timed); });
    EXPECT_GT(times.vertex_shade, 0.0);
    EXPECT_GT(times.coarse_raster, 0.0);
    EXPECT_GT(times.tile_sort, 0.0);
    EXPECT_GT(times.tile_split, 0.0);
    EXPECT_GT(times.clear, 0.0);
    EXPECT_GT(times.fine_raster, 0.0);
    EXPECT_GT(times.tile_resolve, 0.0);
    EXPECT_GT(times.abuffer_emit, 0.0); // the ordered target's lists
    vp::core::for_each_index<5>([&]<std::size_t I>() {
        expect_same_bytes(vp::get<I>(plain).to_host(be), vp::get<I>(timed).to_host(be), "timed");
    });
}

TEST(SmallLoads, StageTimesWithoutTilesAddUpToTheCall) {
    using fb_type = vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_or>>;
    const mesh_data m = mixed_triangles(300, 30.0f, 64);
    const auto times_of = [&](const vp::grid& g, bool count_voxels, indices known = indices::unknown) {
        vp::cuda_backend be;
        fb_type timed{be, g.extent}, plain{be, g.extent};
        const auto draw = [&](fb_type& fb) {
            return draw_framebuffer(be, fb, m, g, vp::passthrough{}, vp::constant(true),
                                    {vp::coverage::conservative, count_voxels}, start::clear, known);
        };
        EXPECT_TRUE(draw(plain).ok());
        const vp::stage_times times = time_stages(be, [&] { return draw(timed); });
        expect_same_bytes(vp::get<0>(plain).to_host(be), vp::get<0>(timed).to_host(be), "timed");
        EXPECT_GT(times.fine_raster, 0.0);
        for (const double none : {times.vertex_shade, times.tile_sort, times.tile_split, times.abuffer_emit})
            EXPECT_EQ(none, 0.0);
        return times;
    };
    // In place: indices are checked first, and the target is cleared.
    const vp::stage_times direct = times_of(box_grid({256, 200, 256}), false);
    EXPECT_GT(direct.coarse_raster, 0.0);
    EXPECT_GT(direct.clear, 0.0);
    EXPECT_EQ(direct.tile_resolve, 0.0);
    // Known indices are not read.
    const vp::stage_times known = times_of(box_grid({30, 21, 33}), false, indices::checked);
    EXPECT_EQ(known.coarse_raster, 0.0);
    EXPECT_GT(known.clear, 0.0);
    EXPECT_EQ(known.tile_resolve, 0.0);
    // By an occupancy mask, which fills the target at the end.
    const vp::stage_times touched = times_of(box_grid({30, 21, 33}), true);
    EXPECT_EQ(touched.coarse_raster, 0.0);
    EXPECT_EQ(touched.clear, 0.0);
    EXPECT_GT(touched.tile_resolve, 0.0);
}

} // namespace
