// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Every kernel on small loads, quick enough for compute-sanitizer.

#include "async_lists.hpp"
#include "cells.hpp"

#include <span>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

// Drawn in tiles, and one that is folded in order.
template <template <class...> class Pipeline, class... First>
using with_every_kind = Pipeline<First..., vp::target<vp::bit, blend::bit_or>, vp::target<float, blend::add>,
                                 vp::target<double, blend::max>, vp::target<std::uint32_t, blend::replace>,
                                 vp::target<std::uint32_t, chain>>;
template <class... Targets>
struct on_both {
    static void compare(const mesh_data& m, const vp::grid& g, vp::coverage rule) {
        expect_same<Targets...>(m, g, vp::passthrough{}, any_values<Targets...>{}, rule);
    }
};

TEST(Reduced, EveryKindOfTarget) {
    for (const vp::coverage rule : both_rules) {
        with_every_kind<on_both>::compare(mixed_triangles(300, 30.0f, 60), box_grid({30, 21, 33}), rule);
        // More triangles in a tile than a work item takes.
        with_every_kind<on_both>::compare(mixed_triangles(1200, 4.0f, 66), box_grid({5, 4, 6}), rule);
    }
}

TEST(Reduced, LargeTrianglesWithoutTiles) {
    mesh_data m = mixed_triangles(1500, 4.0f, 61);
    add_triangle(m, {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    for (const vp::coverage rule : both_rules) {
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid({150, 90, 70}), vp::passthrough{},
                                                        vp::constant(true), rule);
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid({150, 90, 70}), shift{0.5f}, vp::constant(true),
                                                        rule);
    }
}

// More fragments than a thread folds alone, by a block for one voxel after the other and by its threads side by side.
TEST(Reduced, LongVoxelsOfBlendsThatAreFolded) {
    const vp::grid g = box_grid({36, 5, 6});
    mesh_data m = mixed_triangles(200, 36.0f, 74);
    append(m, triangles_in_voxel(2000, {3.0f, 2.0f, 4.0f}, 75));
    expect_same<chained, joined>(m, g, vp::passthrough{}, listed_values{}, vp::coverage::conservative);
    for (std::uint32_t x = 0; x < 36; ++x)
        append(m, triangles_in_voxel(1400, {static_cast<float>(x), 0.0f, 0.0f}, 76 + x));
    expect_same<chained, joined>(m, g, vp::passthrough{}, listed_values{}, vp::coverage::conservative);
}

// The identity of these blends is a set bit: rows and bricks that end within a word.
TEST(Reduced, BitsThatAreClearedToOne) {
    expect_same<vp::target<vp::bit, blend::bit_and>, vp::target<vp::bit, blend::min, vp::layout::tiled>>(
        mixed_triangles(200, 30.0f, 67), box_grid({37, 21, 6}), vp::passthrough{}, vp::constant(false, false),
        vp::coverage::conservative);
}

TEST(Reduced, Lists) {
    const mesh_data m = mixed_triangles(300, 30.0f, 62);
    const vp::grid g = box_grid({30, 21, 33});
    for (const vp::coverage rule : both_rules) {
        expect_same_lists<void>(m, g, vp::passthrough{}, vp::constant(true), rule);
        expect_same_lists<float>(m, g, shift{0.5f}, vp::constant(0.5f), rule);
        expect_same_lists<double>(m, g, vp::passthrough{}, any_double{}, rule);
    }
}

// The last voxel of this grid is number 2^33 - 1.
const vp::grid large_grid = box_grid({2048, 2048, 2048});
mesh_data far_triangles(std::uint32_t seed) { return translated(mixed_triangles(80, 25.0f, seed), glm::vec3(2020.0f)); }

TEST(Reduced, ListsOfVoxelNumbersBeyond32Bits) {
    for (const vp::coverage rule : both_rules) {
        expect_same_lists<void>(far_triangles(68), large_grid, vp::passthrough{}, vp::constant(true), rule);
        expect_same_lists<double>(far_triangles(69), large_grid, vp::passthrough{}, any_double{}, rule);
    }
}

template <class Payload, class FragmentShader>
void compare_without_a_wait(std::vector<mesh_data> parts, const vp::grid& g, const FragmentShader& fs,
                            vp::coverage rule) {
    list_call<Payload, FragmentShader> call(std::move(parts), g, fs, rule);
    call.launch();
    call.expect_the_cpus();
}

TEST(Reduced, ListsWithoutAWait) {
    const vp::grid g = box_grid({30, 21, 33});
    for (const vp::coverage rule : both_rules) {
        compare_without_a_wait<void>({mixed_triangles(300, 30.0f, 70)}, g, vp::constant(true), rule);
        compare_without_a_wait<double>({mixed_triangles(200, 30.0f, 71), mixed_triangles(100, 30.0f, 72)}, g,
                                       any_double{}, rule);
        compare_without_a_wait<double>({far_triangles(73)}, large_grid, any_double{}, rule);
    }
}

// Stage times are asked for without a change to what a call gives: they are parts of the call, and a call that is not
// asked for them leaves them alone.
template <class Call>
vp::stage_times time_stages(vp::cuda_backend& be, const Call& call) {
    cudaEvent_t begin = nullptr, end = nullptr;
    EXPECT_EQ(cudaEventCreate(&begin), cudaSuccess);
    EXPECT_EQ(cudaEventCreate(&end), cudaSuccess);
    vp::stage_times times;
    be.times = &times;
    EXPECT_EQ(cudaEventRecord(begin, be.stream), cudaSuccess);
    const vp::status s = call();
    EXPECT_EQ(cudaEventRecord(end, be.stream), cudaSuccess);
    EXPECT_EQ(cudaEventSynchronize(end), cudaSuccess);
    be.times = nullptr;
    EXPECT_TRUE(s.ok()) << s.message();
    float whole = 0;
    EXPECT_EQ(cudaEventElapsedTime(&whole, begin, end), cudaSuccess);
    for (const auto& [name, field] : vp::stage_time_fields) EXPECT_GE(times.*field, 0.0) << name;
    EXPECT_GT(vp::sum_of(times), 0.0);
    EXPECT_LE(vp::sum_of(times), whole + 0.01); // events are good to half a microsecond each
    const vp::stage_times before = times;
    EXPECT_TRUE(call().ok());
    EXPECT_EQ(before, times);
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    return times;
}

TEST(Reduced, StageTimesOfTilesAndOrderedTargets) {
    using fb_type = with_every_kind<vp::framebuffer, vp::cuda_backend>;
    const with_every_kind<any_values> shader;
    const mesh_data m = mixed_triangles(300, 30.0f, 63);
    const vp::grid g = box_grid({30, 21, 33});
    vp::cuda_backend be;
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

TEST(Reduced, StageTimesWithoutTiles) {
    using fb_type = vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_or>>;
    const mesh_data m = mixed_triangles(300, 30.0f, 64);
    const vp::grid g = box_grid({30, 21, 33});
    vp::cuda_backend be;
    fb_type timed{be, g.extent}, plain{be, g.extent};
    const auto draw = [&](fb_type& fb) {
        return draw_framebuffer(be, fb, m, g, vp::passthrough{}, vp::constant(true), {}, start::clear);
    };
    ASSERT_TRUE(draw(plain).ok());
    const vp::stage_times times = time_stages(be, [&] { return draw(timed); });
    EXPECT_GT(times.coarse_raster, 0.0);
    EXPECT_GT(times.clear, 0.0);
    EXPECT_GT(times.fine_raster, 0.0);
    for (const double none : {times.vertex_shade, times.tile_sort, times.tile_split, times.tile_resolve})
        EXPECT_EQ(none, 0.0);
    expect_same_bytes(vp::get<0>(plain).to_host(be), vp::get<0>(timed).to_host(be), "timed");
}

// One draw of a constant shader is listed on the spot; several have their vertices shaded first.
TEST(Reduced, StageTimesOfLists) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::solid<bool>>;
    const mesh_data m = mixed_triangles(300, 30.0f, 65);
    const vp::grid g = box_grid({30, 21, 33});
    vp::cuda_backend be;
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    for (const std::size_t num_draws : {std::size_t{1}, std::size_t{2}}) {
        SCOPED_TRACE(std::to_string(num_draws) + " draws");
        const std::vector<draw_type> draws(num_draws, draw_type{mesh.view(), {}, vp::constant(true)});
        vp::abuffer<vp::cuda_backend, void> timed{be}, plain{be};
        const auto draw = [&](vp::abuffer<vp::cuda_backend, void>& lists) {
            return vp::voxelize(be, std::span<const draw_type>(draws), g, lists);
        };
        ASSERT_TRUE(draw(plain).ok());
        const vp::stage_times times = time_stages(be, [&] { return draw(timed); });
        for (const double some : {times.fine_raster, times.tile_sort, times.abuffer_emit}) EXPECT_GT(some, 0.0);
        EXPECT_EQ(times.vertex_shade > 0.0, num_draws > 1);
        EXPECT_EQ(times.coarse_raster, 0.0);
        expect_same_on_host(plain.to_host(be), timed.to_host(be));
    }
}

} // namespace
