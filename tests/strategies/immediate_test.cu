// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Constant shaders are drawn without tiles if every target takes a fragment by one atomic. Sums, several draws, checks
// of indices and calls in a row are compared with cpu_backend byte for byte; immediate_*_test.cu compare other targets.

#include "immediate_cases.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace {

using namespace device_test;

// The size classes between a thread's and a split triangle's. Their limits depend on the grid's fraction bits.
TEST(Immediate, TrianglesOfMediumSizeGiveTheCpusBytes) {
    for (const glm::ivec3 extent : {glm::ivec3(120, 90, 100), glm::ivec3(300, 60, 50), glm::ivec3(40, 60, 1100)})
        for (const vp::coverage rule : both_rules) {
            expect_same<vp::target<vp::bit, blend::bit_or>>(middling_triangles(extent, 84), box_grid(extent),
                                                            vp::passthrough{}, vp::constant(true),
                                                            vp::voxelize_options{rule, false});
            expect_same<vp::target<std::uint32_t, blend::add>>(middling_triangles(extent, 85), box_grid(extent),
                                                               vp::passthrough{}, vp::constant(1u),
                                                               vp::voxelize_options{rule, false});
        }
}

// Many work items of each triangle, more than the device has warps.
TEST(Immediate, LargeTrianglesWithManyWorkItemsGiveTheCpusBytes) {
    const glm::ivec3 extent(420, 390, 400);
    const mesh_data m = long_triangles(extent, 1500, 87);
    for (const vp::coverage rule : both_rules) {
        const vp::voxelize_options options{rule, false};
        expect_same(target_list<vp::target<vp::bit, blend::bit_or>, vp::target<std::uint32_t, blend::add>>{}, m,
                    box_grid(extent), vp::passthrough{}, vp::constant(true, 1u), options);
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid(extent), vp::passthrough{}, vp::constant(true),
                                                        options);
    }
}

// Floors, walls and ceilings, some tilted, at the centres and faces of voxels and in between, also outside the grid:
// rows of one, of few and of many depths, along each axis.
TEST(Immediate, FlatLargeTrianglesGiveTheCpusBytes) {
    const glm::ivec3 extent(130, 100, 110);
    mesh_data m;
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < 8; ++i) {
            const float at = 11.25f * static_cast<float>(i) + 3.0f, slope = i % 4 == 3 ? 0.3f : 0.01f * (i % 4 - 1.0f);
            const auto corner = [&](float a, float b) {
                glm::vec3 p;
                p[(axis + 1) % 3] = a;
                p[(axis + 2) % 3] = b;
                p[axis] = at + slope * (a - 0.5f * b);
                return p;
            };
            const glm::vec3 p = corner(-7.0f, 1.5f), q = corner(119.0f, 4.0f), r = corner(113.5f, 97.0f),
                            s = corner(2.25f, 140.0f);
            add_triangle(m, p, q, r);
            add_triangle(m, r, s, p);
        }
    for (const vp::coverage rule : both_rules) {
        const vp::voxelize_options options{rule, false};
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid(extent), vp::passthrough{}, vp::constant(true),
                                                        options);
        expect_same(target_list<vp::target<vp::bit, blend::bit_or>, vp::target<std::uint32_t, blend::add>>{}, m,
                    box_grid(extent), vp::passthrough{}, vp::constant(true, 1u), options);
        expect_same_lists<void>(m, box_grid(extent), vp::passthrough{}, vp::constant(true), options);
    }
}

TEST(Immediate, SumsAreTheCpus) {
    for (const float value : {1.0f, -0.75f, 0.1f, 3e9f, 1e-20f, std::numeric_limits<float>::infinity()})
        compare_constants(sum_targets{}, same_sums(value, value));
}

TEST(Immediate, SumsAreExactOnlyWhereProven) {
    using vp::device::sums_are_exact;
    constexpr std::uint64_t limit = std::uint64_t{1} << 24;
    EXPECT_TRUE(sums_are_exact(1.0f, 0.0f, limit - 1, -32));
    EXPECT_FALSE(sums_are_exact(1.0f, 0.0f, limit, -32));
    EXPECT_FALSE(sums_are_exact(1.0f, 1.0f, limit - 1, -32)); // the stored value counts too
    EXPECT_TRUE(sums_are_exact(-0.5f, 0.0f, limit - 1, -32));
    EXPECT_TRUE(sums_are_exact(3.0f, 0.25f, 1000, -32));
    EXPECT_FALSE(sums_are_exact(0.1f, 0.0f, 100, -32));                // 24 bits do not suffice
    EXPECT_TRUE(sums_are_exact(0.1f, 0.0f, 1, -32));                   // a single term is exact
    EXPECT_FALSE(sums_are_exact(std::ldexp(1.0f, -33), 0.0f, 1, -32)); // below the quantum
    EXPECT_FALSE(sums_are_exact(std::ldexp(1.0f, 31), 0.0f, 1, -32));  // infinite by definition
    EXPECT_FALSE(sums_are_exact(0.0f, 0.0f, 1, -32));
    EXPECT_FALSE(sums_are_exact(1.0f, -0.0f, 1, -32));
    EXPECT_FALSE(sums_are_exact(std::numeric_limits<float>::quiet_NaN(), 0.0f, 1, -32));
    EXPECT_FALSE(sums_are_exact(1.0f, std::numeric_limits<float>::infinity(), 1, -32));
    EXPECT_TRUE(sums_are_exact(0.1, 0.0, 1, -64));
    EXPECT_FALSE(sums_are_exact(1.0, 0.0, std::uint64_t{1} << 53, -64));
}

// Several draws, each with its transform and constant, with positions made in the raster and before it.
template <class Backend, class VertexShader>
std::vector<std::uint32_t> draw_several(const std::vector<mesh_data>& meshes, const std::vector<VertexShader>& shaders,
                                        const vp::grid& g, vp::counters& counts) {
    Backend be{};
    using target = vp::target<std::uint32_t, blend::add>;
    vp::framebuffer<Backend, target> fb{be, g.extent};
    std::vector<vp::mesh<Backend>> on_backend;
    for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
    using draw = vp::draw<vp::mesh_view<>, VertexShader, vp::constant_output<std::uint32_t>>;
    std::vector<draw> draws;
    for (std::size_t i = 0; i < meshes.size(); ++i)
        draws.push_back({on_backend[i].view(), shaders[i], vp::constant(static_cast<std::uint32_t>(3 * i + 1))});
    const vp::status s =
        vp::voxelize(be, std::span<const draw>(draws), g, fb, vp::voxelize_options{vp::coverage::conservative, false});
    EXPECT_TRUE(s.ok()) << s.message();
    counts = s.counts;
    return vp::get<0>(fb).to_host(be);
}

template <class VertexShader>
void compare_draws(const std::vector<VertexShader>& shaders) {
    std::vector<mesh_data> meshes;
    for (std::uint32_t i = 0; i < shaders.size(); ++i) meshes.push_back(mixed_triangles(400, 60.0f, 90 + i));
    add_triangle(meshes[1], {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    vp::counters a{}, b{};
    const vp::grid g = box_grid({60, 64, 70}).crop({7, 5, 3}, {41, 52, 60});
    const auto on_cpu = draw_several<vp::cpu_backend>(meshes, shaders, g, a);
    const auto on_gpu = draw_several<vp::cuda_backend>(meshes, shaders, g, b);
    expect_same_bytes(on_cpu, on_gpu, "draws");
    expect_same_counts(a, b);
}

// Calls of one backend. Counters are read by a copy first and through pinned memory later, or not at all.
TEST(Immediate, ManyCallsOfOneBackendGiveTheCpusBytes) {
    const vp::grid g = box_grid({60, 47, 71});
    for (const bool locks : {true, false}) {
        vp::cuda_backend gpu;
        gpu.use_pinned_memory = locks;
        vp::cpu_backend cpu;
        for (int call = 0; call < 8; ++call) {
            const mesh_data m = mixed_triangles(call == 5 ? 1 : 500 * (call + 1), 40.0f, static_cast<unsigned>(call));
            const vp::mesh<vp::cuda_backend> gpu_mesh{gpu, m.positions, m.triangles};
            const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
            vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_or>> gpu_fb{gpu, g.extent};
            vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, blend::bit_or>> cpu_fb{cpu, g.extent};
            const vp::status a =
                vp::voxelize(gpu, gpu_mesh, g, vp::passthrough{}, vp::constant(true), gpu_fb, vp::coverage::thin);
            const vp::status b =
                vp::voxelize(cpu, cpu_mesh, g, vp::passthrough{}, vp::constant(true), cpu_fb, vp::coverage::thin);
            ASSERT_TRUE(a.ok() && b.ok()) << a.message() << " in call " << call;
            expect_same_counts(b.counts, a.counts);
            expect_same_bytes(vp::get<0>(cpu_fb).to_host(cpu), vp::get<0>(gpu_fb).to_host(gpu), "bits");
            if (call == 3) gpu.release();
            if (call == 6) {
                vp::cuda_backend other = std::move(gpu);
                gpu = std::move(other);
            }
        }
    }
}

TEST(Immediate, SeveralDrawsGiveTheCpusBytes) {
    glm::mat4 turned(1.0f);
    turned[0] = {0.0f, 1.0f, 0.0f, 0.0f};
    turned[1] = {1.0f, 0.0f, 0.0f, 0.0f};
    compare_draws<vp::transform>({vp::transform{}, vp::transform{turned}, vp::transform{}});
    compare_draws<shift>({shift{0.0f}, shift{2.5f}, shift{-9.0f}});
}

// A bad index leaves the targets unchanged, cleared ones too, even if other meshes' indices are known.
TEST(Immediate, BadIndexWritesNothing) {
    vp::cuda_backend be;
    mesh_data m = mixed_triangles(500, 20.0f, 95);
    using target = vp::target<vp::bit, blend::bit_or>;
    const vp::grid g = box_grid({20, 20, 20});
    vp::framebuffer<vp::cuda_backend, target> fb{be, g.extent};
    const vp::mesh<vp::cuda_backend> good(be, m.positions, m.triangles);
    ASSERT_TRUE(vp::voxelize(be, good, g, vp::passthrough{}, vp::constant(true), fb).ok());
    const auto before = vp::get<0>(fb).to_host(be);
    const auto expect_refused = [&](const vp::mesh_view<>& view, const char* what) {
        for (const bool count : {true, false})
            EXPECT_EQ(vp::voxelize(be, view, g, vp::passthrough{}, vp::constant(true), fb,
                                   {vp::coverage::conservative, count})
                          .code,
                      vp::status_code::index_out_of_range)
                << what;
        EXPECT_EQ(vp::get<0>(fb).to_host(be), before) << what;
    };
    m.triangles[321].y = static_cast<std::uint32_t>(m.positions.size());
    const vp::mesh<vp::cuda_backend> bad(be, m.positions, m.triangles);
    expect_refused(bad.view(), "a mesh");
    vp::mesh_view<> view = good.view();
    view.triangles = bad.view().triangles;
    expect_refused(view, "other triangles");
    view.checked = vp::check_indices(be, view.triangles);
    expect_refused(view, "triangles that were looked at");
    view = good.view();
    view.positions.count -= 1;
    expect_refused(view, "a vertex that has gone");
    vp::mesh_view<> part = bad.view();
    part.triangles.count = 300;
    part.checked = vp::check_indices(be, part.triangles);
    EXPECT_TRUE(part.has_checked_indices());
    part.triangles.count = bad.view().triangles.size();
    expect_refused(part, "more than were looked at");
}

// Finds the greatest index at any position, for any number of triangles.
TEST(Immediate, FindsTheGreatestIndex) {
    vp::cuda_backend be;
    std::mt19937 random(97);
    for (const std::size_t count : {1, 31, 1000, 300000}) {
        std::vector<glm::uvec3> triangles(count);
        for (glm::uvec3& t : triangles) t = {random() % 1000, random() % 1000, random() % 1000};
        for (int at = 0; at < 3; ++at) {
            std::vector<glm::uvec3> changed = triangles;
            changed[random() % count][at] = 3000000000u + static_cast<std::uint32_t>(at);
            const vp::cuda_backend::buffer<glm::uvec3> on_device(be, vp::array_view<const glm::uvec3>(changed));
            const vp::checked_indices found = vp::check_indices(be, on_device.view());
            EXPECT_EQ(found.triangles, on_device.data());
            EXPECT_EQ(found.count, count);
            EXPECT_EQ(found.bound, 3000000001u + static_cast<unsigned>(at));
        }
    }
    EXPECT_EQ(vp::check_indices(be, {}).bound, 0u);
    const vp::cuda_backend::buffer<glm::uvec3> zeros(be, vp::array_view<const glm::uvec3>(std::vector<glm::uvec3>(7)));
    EXPECT_EQ(vp::check_indices(be, zeros.view()).bound, 1u);
}

} // namespace
