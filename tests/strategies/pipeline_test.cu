// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Promises of a call other than its bits: status and counters, nothing written on failure, clears, capacities, tile
// policies.

#include "computed_sum.hpp"

#include <algorithm>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

using bits = vp::target<vp::bit, blend::bit_or>;
using sum = vp::target<float, blend::add>;

TEST(Pipeline, AnIndexOutOfRangeWritesNothing) {
    mesh_data m = mixed_triangles(500, 20.0f, 30);
    m.triangles[321].y = static_cast<std::uint32_t>(m.positions.size());
    vp::cuda_backend be;
    const vp::grid g = box_grid({20, 20, 20});
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    cudaMemset(const_cast<float*>(vp::get<0>(fb).view().elements), 0x5a, 8000 * sizeof(float));
    vp::mesh mesh{be, m.positions, m.triangles};
    const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb);
    EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(s.where, vp::stage::coarse_raster);
    EXPECT_EQ(s.triangle, 321u);
    EXPECT_EQ(s.counts.triangles_in, 500u);
    for (const float v : vp::get<0>(fb).to_host(be)) ASSERT_EQ(std::bit_cast<std::uint32_t>(v), 0x5a5a5a5au);
    vp::abuffer<vp::cuda_backend> lists{be};
    EXPECT_EQ(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), lists).code,
              vp::status_code::index_out_of_range);
    EXPECT_EQ(lists.num_voxels(), 0u);
}

TEST(Pipeline, BadArgumentsAreRefused) {
    vp::cuda_backend be;
    const mesh_data m = mixed_triangles(5, 20.0f, 31);
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, bits> fb{be, {20, 20, 20}};
    EXPECT_EQ(vp::voxelize(be, mesh, box_grid({20, 20, 21}), vp::passthrough{}, vp::constant(true), fb).code,
              vp::status_code::extent_mismatch);
}

// Calls without triangles clear, on the stream and in a workspace too; what loads keeps what it holds.
TEST(Pipeline, ACallWithoutTrianglesClears) {
    vp::cuda_backend be;
    const vp::grid g = box_grid({20, 20, 20});
    const mesh_data m = mixed_triangles(50, 20.0f, 31);
    const vp::mesh mesh{be, m.positions, m.triangles}, empty{be, m.positions, std::vector<glm::uvec3>{}};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const auto holds = [&](float value) {
        for (const float v : vp::get<0>(fb).to_host(be)) ASSERT_EQ(v, value);
    };
    const auto fill = [&] {
        vp::get<0>(fb).clear(0.0f);
        ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb).ok());
    };
    for (const bool tracked : {false, true}) {
        if (tracked) fb.track_changes(be);
        fill();
        vp::get<0>(fb).clear(3.0f);
        const vp::status s = vp::voxelize(be, empty, g, vp::passthrough{}, vp::constant(1.0f), fb);
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_TRUE(s.nothing_drawn());
        holds(3.0f);
        fill();
        vp::get<0>(fb).clear(4.0f);
        EXPECT_TRUE(vp::clear(be, fb).ok());
        holds(4.0f);
        vp::get<0>(fb).load();
        EXPECT_TRUE(vp::clear(be, fb).ok());
        holds(4.0f);
    }
    fill();
    vp::get<0>(fb).clear(5.0f);
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<float>>;
    const draw nothing{empty, {}, vp::constant(1.0f)};
    const std::span<const draw> draws(&nothing, 1);
    const vp::workspace_limits limits{};
    const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
    vp::cuda_backend::buffer<std::byte> memory(be, bytes);
    const vp::workspace_view workspace{memory.data(), bytes, limits};
    EXPECT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
    EXPECT_TRUE(vp::read_status(be, workspace).ok());
    holds(5.0f);
    EXPECT_EQ(vp::voxelize_async(be, draws, g, fb.view(), {}, {memory.data(), 8, limits}).code,
              vp::status_code::capacity_exceeded);

    vp::abuffer<vp::cuda_backend> lists{be};
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), lists).ok());
    EXPECT_GT(lists.num_fragments(), 0u);
    EXPECT_TRUE(vp::voxelize(be, empty, g, vp::passthrough{}, vp::constant(true), lists).ok());
    EXPECT_EQ(lists.num_fragments(), 0u);
    EXPECT_EQ(lists.to_host(be).extent, g.extent);
}

// If memory suffices for tiles only, the call uses tiles instead of lists. With less memory it fails.
TEST(Pipeline, FragmentsAreDrawnInTilesIfMemoryDoesNotSufficeForLists) {
    mesh_data m = mixed_triangles(200, 60.0f, 35);
    for (int i = 0; i < 300; ++i) { // many times more fragments than tile pairs
        const float h = 0.2f * static_cast<float>(i);
        add_triangle(m, {-9.0f, -9.0f, h}, {130.0f, -9.0f, h + 3.0f}, {-9.0f, 130.0f, h + 9.0f});
    }
    const vp::grid g = box_grid({60, 50, 70});
    std::size_t bytes[2] = {}; // with lists, with tiles
    std::vector<float> expected;
    const auto draw = [&](vp::cuda_backend& be, vp::framebuffer<vp::cuda_backend, sum>& fb) {
        const vp::mesh mesh{be, m.positions, m.triangles};
        return vp::voxelize(be, mesh, g, vp::passthrough{}, computed{}, fb);
    };
    for (const bool lists : {true, false}) {
        counting_resource resource;
        vp::cuda_backend be{nullptr, resource};
        if (!lists) be.strategy = vp::strategy::tiled;
        vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
        const std::size_t before = resource.live;
        ASSERT_TRUE(draw(be, fb).ok());
        bytes[lists ? 0 : 1] = resource.live - before; // the workspace
        const auto values = vp::get<0>(fb).to_host(be);
        if (lists)
            expected = values;
        else
            expect_same_bytes(expected, values, "in tiles");
    }
    ASSERT_GT(bytes[0], bytes[1]);
    for (const std::size_t bytes_free : {bytes[0], bytes[1], bytes[1] - 1}) {
        counting_resource resource;
        vp::cuda_backend be{nullptr, resource};
        vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
        const std::size_t of_mesh = m.positions.size() * sizeof(glm::vec3) + m.triangles.size() * sizeof(glm::uvec3);
        resource.limit = resource.live + of_mesh + bytes_free;
        const vp::status s = draw(be, fb);
        EXPECT_EQ(s.code, bytes_free < bytes[1] ? vp::status_code::out_of_memory : vp::status_code::ok) << bytes_free;
        if (s.ok()) expect_same_bytes(expected, vp::get<0>(fb).to_host(be), "with less memory");
    }
}

// More pairs, work items and fragments than the first guess of the capacities.
TEST(Pipeline, ACallThatOverflowsIsRunAgain) {
    mesh_data m;
    for (int i = 0; i < 40; ++i) {
        const float h = static_cast<float>(i);
        add_triangle(m, {-100.0f, -100.0f, h}, {700.0f, -100.0f, h + 30.0f}, {-100.0f, 700.0f, 300.0f});
    }
    const vp::grid g = box_grid({300, 300, 300});
    for (const vp::coverage rule : both_rules) {
        expect_same<bits>(m, g, vp::passthrough{}, vp::constant(true), rule);
        expect_same<sum>(m, g, vp::passthrough{}, computed{}, rule);
        expect_same_lists<void>(m, g, vp::passthrough{}, vp::constant(true), rule);
    }
}

TEST(Pipeline, ListsWithPayloadsAreTheCpus) {
    const any_double shader;
    for (const vp::coverage rule : both_rules) {
        expect_same_lists<double>(mixed_triangles(2000, 40.0f, 33), box_grid({40, 33, 47}), vp::passthrough{}, shader,
                                  rule);
        expect_same_lists<void>(mixed_triangles(2000, 40.0f, 34), box_grid({40, 33, 47}), vp::passthrough{}, shader,
                                rule);
    }
}

// A linear id beyond 32 bits.
TEST(Pipeline, ListsOfAGridBeyond32BitsAreTheCpus) {
    const mesh_data m = translated(mixed_triangles(300, 100.0f, 35), {1900.0f, 1950.0f, 1980.0f});
    for (const vp::coverage rule : both_rules)
        expect_same_lists<void>(m, box_grid({2048, 2048, 2048}), vp::passthrough{}, vp::constant(true), rule);
}

struct small_tiles {
    constexpr vp::tuning::fine_raster_policy operator()(int) const { return {64, 3, 4}; }
};
struct large_blocks {
    constexpr vp::tuning::fine_raster_policy operator()(int) const { return {512, 4, 1}; }
};

TEST(Pipeline, ResultsDoNotDependOnThePolicy) {
    const mesh_data m = mixed_triangles(4000, 60.0f, 36);
    const vp::grid g = box_grid({61, 50, 67});
    for (const vp::coverage rule : both_rules) {
        vp::counters a, b, c;
        const auto first = run_policy<vp::tuning::fine_raster_selector>(m, g, rule, a);
        expect_same_bytes(first, run_policy<small_tiles>(m, g, rule, b), "small tiles");
        expect_same_bytes(first, run_policy<large_blocks>(m, g, rule, c), "large blocks");
        expect_same_counts(a, b);
        expect_same_counts(a, c);
    }
}

// add_unordered may differ in bits, but stays within the rounding errors of its additions.
TEST(Pipeline, UnorderedSumsStayWithinABound) {
    const mesh_data m = mixed_triangles(3000, 30.0f, 41);
    const vp::grid g = box_grid({32, 32, 32});
    using unordered = vp::target<float, blend::add_unordered>;
    vp::cuda_backend be;
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, unordered, vp::target<double, blend::add_unordered>,
                    vp::target<double, blend::add>, vp::target<std::uint32_t, blend::count>>
        fb{be, g.extent};
    const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(0.1f, 0.1, 0.1, 0u), fb);
    ASSERT_TRUE(s.ok()) << s.message();
    const auto f = vp::get<0>(fb).to_host(be);
    const auto d = vp::get<1>(fb).to_host(be), exact = vp::get<2>(fb).to_host(be);
    const auto n = vp::get<3>(fb).to_host(be);
    for (std::size_t i = 0; i < f.size(); ++i) {
        ASSERT_NEAR(static_cast<double>(f[i]), 0.1 * n[i], 1.2e-7 * n[i] * (0.1 * n[i] + 1.0));
        ASSERT_NEAR(d[i], exact[i], 2.3e-16 * n[i] * (0.1 * n[i] + 1.0));
    }
}

} // namespace
