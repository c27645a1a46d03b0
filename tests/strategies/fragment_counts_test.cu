// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Targets that hold fragment counts while a constant shader is drawn, until a last pass turns them into values:
// compared with cpu_backend byte for byte, padding included. Also when a call uses counts.

#include "cells.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace {

using namespace device_test;
namespace blend = voxelpipe::blend;
using vp::device::immediate_mode;

template <class... Ts>
using constant_draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<Ts...>>;

// Triangles of all sizes; voxels of 1 to 40 fragments, and of more than the table of the last pass holds.
mesh_data crowded(float size, std::uint32_t seed) {
    mesh_data m = mixed_triangles(600, size, seed);
    const auto speck = [&](float x, float y, float z, float step) {
        const glm::vec3 corner(x + 0.1f, y + 0.1f, z + 0.2f);
        add_triangle(m, corner + glm::vec3(step, 0.0f, 0.1f), corner + glm::vec3(0.3f, 0.5f, step),
                     corner + glm::vec3(0.1f, 0.2f + step, 0.3f));
    };
    for (int run = 1; run <= 40; ++run)
        for (int i = 0; i < run; ++i)
            speck(static_cast<float>(run % 20), static_cast<float>(run / 20), 2.0f, 0.01f * static_cast<float>(i));
    for (int i = 0; i < 900; ++i) speck(5.0f, 4.0f, static_cast<float>(i % 3), 0.0005f * static_cast<float>(i));
    return m;
}

// One call onto cleared targets: a mesh for each shader.
template <class Backend, class... Targets, class... Ts>
vp::status draw_constant(Backend& be, vp::framebuffer<Backend, Targets...>& fb, const vp::grid& g,
                         const std::vector<mesh_data>& meshes, const std::vector<vp::constant_output<Ts...>>& shaders,
                         const vp::core::pack<typename Targets::value_type...>& clear, const call_options& options) {
    std::vector<vp::mesh<Backend>> on_backend;
    std::vector<constant_draw<Ts...>> draws;
    for (const mesh_data& m : meshes) on_backend.emplace_back(be, m.positions, m.triangles);
    for (std::size_t i = 0; i < meshes.size(); ++i)
        draws.push_back({on_backend[i].view(), vp::passthrough{}, shaders[i]});
    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { vp::get<I>(fb).clear(vp::get<I>(clear)); });
    return vp::voxelize(be, std::span<const constant_draw<Ts...>>(draws), g, fb, options);
}

template <class... Targets, class... Ts>
void compare(const std::vector<mesh_data>& meshes, glm::ivec3 extent,
             const std::vector<vp::constant_output<Ts...>>& shaders,
             const vp::core::pack<typename Targets::value_type...>& clear) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    for (const vp::coverage rule : both_rules)
        for (const bool count_voxels : {false, true}) {
            vp::framebuffer<vp::cpu_backend, Targets...> a{cpu, extent};
            vp::framebuffer<vp::cuda_backend, Targets...> b{gpu, extent};
            const vp::voxelize_options options{rule, count_voxels};
            const vp::status sa = draw_constant(cpu, a, box_grid(extent), meshes, shaders, clear, options);
            const vp::status sb = draw_constant(gpu, b, box_grid(extent), meshes, shaders, clear, options);
            ASSERT_TRUE(sa.ok() && sb.ok()) << sa.message() << sb.message();
            EXPECT_EQ(sa.counts.voxels != 0, count_voxels);
            expect_same_counts(sa.counts, sb.counts);
            vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                const std::string what = "target " + std::to_string(I);
                expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), what.c_str());
            });
        }
}

// Sums of float and double, in both layouts.
void compare_sums(const mesh_data& m, glm::ivec3 extent, float value, double wide, float clear, double wide_clear) {
    [&]<class... Targets>(target_list<Targets...>) {
        compare<Targets...>({m}, extent, std::vector{same_sums(value, wide)},
                            vp::core::make_pack(clear, wide_clear, clear, wide_clear));
    }(sum_targets{});
}

// The plan of a call, which needs no device.
template <class... Targets, class... Ts>
auto plan(const std::vector<vp::constant_output<Ts...>>& shaders, const vp::framebuffer_view<Targets...>& fb,
          std::uint64_t num_primitives, bool count_voxels) {
    std::vector<constant_draw<Ts...>> draws;
    for (const auto& s : shaders) draws.push_back({{}, vp::passthrough{}, s});
    vp::device::immediate_plan<sizeof...(Targets)> p;
    vp::device::plan_immediate(std::span<const constant_draw<Ts...>>(draws), fb, num_primitives, count_voxels, p);
    return p;
}

using float_sum = vp::target<float, blend::add>;
using bits = vp::target<vp::bit, blend::bit_or>;

const glm::ivec3 odd_extent{37, 21, 31}; // one element remains after whole 16-byte words

template <class T>
std::vector<T> constants() {
    using limits = std::numeric_limits<T>;
    const T quantum = std::ldexp(T{1}, vp::core::sum_format<T>::log2_quantum);
    return {T(0.1),
            T{1},
            T(-0.0),
            T(-1e-3),
            quantum / 2,
            -quantum * T(1.5),
            limits::denorm_min(),
            std::ldexp(T{1}, 30) / 3,
            limits::max(),
            limits::infinity(),
            -limits::infinity(),
            -limits::quiet_NaN()};
}

TEST(FragmentCounts, SumsOfAnyConstantAreTheCpus) {
    const mesh_data m = crowded(36.0f, 200);
    const std::vector<float> values = constants<float>();
    const std::vector<double> wide_values = constants<double>();
    for (std::size_t i = 0; i < values.size(); ++i) {
        SCOPED_TRACE(values[i]);
        compare_sums(m, odd_extent, values[i], wide_values[i], 0.0f, 0.0);
        compare_sums(m, odd_extent, values[i], wide_values[i], -0.0f, 1e-30);
    }
}

TEST(FragmentCounts, SumsOntoAnyClearValueAreTheCpus) {
    const mesh_data m = crowded(36.0f, 201);
    const std::vector<float> values = constants<float>();
    const std::vector<double> wide_values = constants<double>();
    for (std::size_t i = 0; i < values.size(); ++i) {
        SCOPED_TRACE(values[i]);
        compare_sums(m, odd_extent, 0.1f, 0.1, values[i], wide_values[i]);
    }
}

// Bricks, whose padding holds the clear value; extents from 1 voxel on.
TEST(FragmentCounts, EveryLayoutAndExtentHoldsTheCpusBytes) {
    for (const glm::ivec3 extent : {odd_extent, glm::ivec3(1), glm::ivec3(3, 1, 2), glm::ivec3(40, 16, 24)})
        for (const float clear : {0.0f, 0.3f}) {
            const mesh_data m = crowded(static_cast<float>(extent.x), 202);
            compare_sums(m, extent, 0.1f, -0.1, clear, static_cast<double>(clear));
        }
}

// Grids large enough for marks, whose last pass reads only marked chunks: rows with and without 16-byte access, extents
// that end within a chunk, more chunks along x than a word has bits. Then a clear value for which everything is read.
TEST(FragmentCounts, LargeGridsWithMarksHoldTheCpusBytes) {
    for (const glm::ivec3 extent : {glm::ivec3(320, 200, 140), glm::ivec3(333, 191, 141), glm::ivec3(1100, 92, 91)}) {
        ASSERT_GE(static_cast<std::size_t>(extent.x) * static_cast<std::size_t>(extent.y * extent.z) * sizeof(float),
                  vp::tuning::marked_bytes);
        const glm::vec3 size(extent);
        mesh_data m = mixed_triangles(1500, size.x, 210); // many outside the grid, and some across its faces
        append(m, crowded(36.0f, 211));
        append(m, mixed_triangles(1500, size.z, 212));
        for (const float x : {0.01f, 0.4f, 0.99f}) { // across the whole grid, also slivers
            add_triangle(m, size * glm::vec3(x, 0.0f, 0.0f), size * glm::vec3(x, 1.0f, 0.1f), size);
            add_triangle(m, size * glm::vec3(0.0f, x, 1.0f), size * glm::vec3(1.0f, x, 0.9f),
                         size * glm::vec3(1.0f, x, 0.901f));
        }
        compare_sums(m, extent, 0.1f, 0.1, 0.0f, 0.0);
        compare_sums(m, extent, 0.1f, 0.1, -0.0f, 0.3);
    }
}

// As few as the tiles took before there were marks.
TEST(FragmentCounts, FewLargeTrianglesWithMarksGiveTheCpusBytes) {
    const glm::ivec3 extent(260, 210, 170);
    const glm::vec3 size(extent);
    mesh_data m;
    add_triangle(m, size * glm::vec3(0.1f, 0.0f, 0.2f), size * glm::vec3(0.9f, 0.8f, 0.3f), size * 1.2f);
    add_triangle(m, {40.0f, 30.5f, 20.0f}, {90.0f, 30.5f, 25.0f}, {70.0f, 30.5f, 80.0f});
    add_triangle(m, {40.0f, 30.5f, 20.0f}, {43.0f, 32.5f, 25.0f}, {41.0f, 31.5f, 22.0f});
    for (const float value : {1.0f, 0.1f})
        compare<float_sum>({m}, extent, std::vector{vp::constant(value)}, vp::core::make_pack(0.0f));
}

TEST(FragmentCounts, SeveralDrawsGiveTheCpusBytes) {
    const std::vector<mesh_data> meshes{crowded(36.0f, 203), mixed_triangles(300, 30.0f, 204), crowded(30.0f, 205)};
    const auto draw = [&](float a, float b, float c) {
        compare<float_sum>(meshes, odd_extent, std::vector{vp::constant(a), vp::constant(b), vp::constant(c)},
                           vp::core::make_pack(0.25f));
    };
    draw(0.1f, 0.1f, 0.1f);
    draw(0.1f, 0.1f, 0.2f);
    draw(0.0f, -0.0f, 0.0f);
    draw(0.5f, 2.0f, -1.0f);
}

TEST(FragmentCounts, TargetsBesideBitsHoldTheCpusBytes) {
    const mesh_data m = crowded(36.0f, 206);
    for (const float value : {1.0f, 0.1f})
        for (const bool set : {false, true})
            compare<bits, float_sum>({m}, odd_extent, std::vector{vp::constant(true, value)},
                                     vp::core::make_pack(set, 0.0f));
}

// Blends that are counted only if the number of voxels is asked for, and another quantum of the sum.
TEST(FragmentCounts, IntegersAndOtherQuantaAreTheCpus) {
    const mesh_data m = crowded(36.0f, 207);
    const std::int64_t pattern = 0x123456789abcdef, clear = -77;
    for (const float value : {0.3f, 1.0f, 1e-4f, 1e20f})
        compare<vp::target<std::int64_t, blend::bit_xor>, vp::target<float, blend::add_quantum<-10>>>(
            {m}, odd_extent, std::vector{vp::constant(pattern, value)}, vp::core::make_pack(clear, -0.5f));
    for (const std::uint32_t value : {3u, 0xfffffff1u})
        compare<vp::target<std::uint32_t, blend::add>>({m}, odd_extent, std::vector{vp::constant(value)},
                                                       vp::core::make_pack(0x80000000u));
}

// Terms whose sums are exact in any order.
TEST(FragmentCounts, UnorderedSumsOfExactTermsAreTheCpus) {
    const mesh_data m = crowded(36.0f, 208);
    const float infinity = std::numeric_limits<float>::infinity();
    for (const float value : {0.125f, -0.0f, infinity})
        for (const float clear : {0.0f, -0.0f, 3.5f})
            compare<vp::target<float, blend::add_unordered>>({m}, odd_extent, std::vector{vp::constant(value)},
                                                             vp::core::make_pack(clear));
}

TEST(FragmentCounts, LoadedTargetsAreNotCounted) {
    const mesh_data m = crowded(36.0f, 209);
    for (const bool count_voxels : {false, true})
        expect_same<float_sum>(m, box_grid(odd_extent), vp::passthrough{}, vp::constant(0.1f),
                               vp::voxelize_options{vp::coverage::conservative, count_voxels}, start::load);
}

// More fragments than a float can count. The expected sum is exact in a double, because a fold on the host is slow.
TEST(FragmentCounts, SixteenMillionFragmentsInAVoxelAreCountedExactly) {
    constexpr std::uint32_t n = (1u << 24) + 3;
    const glm::ivec3 extent(5, 4, 3);
    mesh_data m;
    add_triangle(m, {2.2f, 1.3f, 1.4f}, {2.7f, 1.5f, 1.3f}, {2.4f, 1.8f, 1.6f});
    m.triangles.resize(n, m.triangles[0]);
    vp::cuda_backend be;
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    vp::framebuffer<vp::cuda_backend, float_sum> fb{be, extent};
    for (const float value : {1.0f, 0.1f}) {
        const vp::status s = vp::voxelize(be, mesh, box_grid(extent), vp::passthrough{}, vp::constant(value), fb);
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts.fragments, n);
        EXPECT_EQ(s.counts.voxels, 1u);
        const auto sums = vp::get<0>(fb).to_host_target(be);
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    const bool hit = glm::ivec3(x, y, z) == glm::ivec3(2, 1, 1);
                    const double exact = hit ? static_cast<double>(n) * static_cast<double>(value) : 0.0;
                    EXPECT_EQ(std::bit_cast<std::uint32_t>(sums(x, y, z)),
                              std::bit_cast<std::uint32_t>(static_cast<float>(exact)));
                }
    }
}

TEST(FragmentCounts, BadIndexWritesNothing) {
    vp::cuda_backend be;
    mesh_data m = crowded(36.0f, 210);
    vp::framebuffer<vp::cuda_backend, float_sum> fb{be, odd_extent};
    const vp::mesh<vp::cuda_backend> good(be, m.positions, m.triangles);
    ASSERT_TRUE(vp::voxelize(be, good, box_grid(odd_extent), vp::passthrough{}, vp::constant(0.1f), fb).ok());
    const auto before = vp::get<0>(fb).to_host(be);
    m.triangles[321].y = static_cast<std::uint32_t>(m.positions.size());
    const vp::mesh<vp::cuda_backend> bad(be, m.positions, m.triangles);
    vp::get<0>(fb).clear(0.3f);
    EXPECT_EQ(vp::voxelize(be, bad, box_grid(odd_extent), vp::passthrough{}, vp::constant(0.7f), fb).code,
              vp::status_code::index_out_of_range);
    expect_same_bytes(before, vp::get<0>(fb).to_host(be), "after a bad index");
}

// ---- when a call uses counts
// -----------------------------------------------------------------------------------------------------------

template <class... Targets>
vp::framebuffer_view<Targets...> view_of(glm::ivec3 extent) {
    vp::framebuffer_view<Targets...> fb;
    fb.extent = extent;
    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { vp::get<I>(fb.targets).extent = extent; });
    return fb;
}

TEST(FragmentCountsPlan, CountsOnlyIfNeeded) {
    const auto of_sum = [](std::vector<float> values, std::uint64_t n, bool count_voxels) {
        std::vector<vp::constant_output<float>> shaders;
        for (const float v : values) shaders.push_back(vp::constant(v));
        return plan(shaders, view_of<float_sum>({32, 32, 32}), n, count_voxels);
    };
    const auto exact = of_sum({1.0f}, 1000, false);
    EXPECT_TRUE(exact.possible);
    EXPECT_EQ(exact.modes.of[0], immediate_mode::blend);
    for (const auto& counted : {of_sum({1.0f}, 1000, true), of_sum({1.0f}, std::uint64_t{1} << 24, false),
                                of_sum({0.1f}, 1000, false), of_sum({0.1f, 0.1f}, 1000, true)}) {
        EXPECT_TRUE(counted.possible);
        EXPECT_EQ(counted.modes.of[0], immediate_mode::count);
        EXPECT_FALSE(counted.modes.counts_first);
    }
    EXPECT_EQ(of_sum({0.1f}, 1000, false).voxels_of, -1);
    EXPECT_EQ(of_sum({0.1f}, 1000, true).voxels_of, 0);
    EXPECT_TRUE(of_sum({0.5f, 1.0f}, 1000, false).possible); // exact: blended in place
    EXPECT_FALSE(of_sum({0.5f, 1.0f}, 1000, true).possible);
    EXPECT_FALSE(of_sum({0.1f, 0.2f}, 1000, false).possible);
    EXPECT_FALSE(of_sum({0.0f, -0.0f}, 1000, false).possible);
}

TEST(FragmentCountsPlan, LetsAnotherTargetGiveTheNumberOfVoxels) {
    auto fb = view_of<bits, float_sum>({32, 32, 32});
    const auto beside = [&](float value) { return plan(std::vector{vp::constant(true, value)}, fb, 1000, true); };
    // A target of bits gives the number of voxels after drawing,
    EXPECT_TRUE(beside(1.0f).possible);
    EXPECT_EQ(beside(1.0f).modes.of[0], immediate_mode::blend);
    EXPECT_EQ(beside(1.0f).modes.of[1], immediate_mode::blend);
    EXPECT_FALSE(beside(1.0f).modes.counts_first);
    EXPECT_EQ(beside(1.0f).bits_of, 0);
    EXPECT_EQ(beside(1.0f).voxels_of, -1);
    // or, if there are many, during drawing.
    fb = view_of<bits, float_sum>({2048, 2048, 1024});
    EXPECT_TRUE(beside(1.0f).possible);
    EXPECT_EQ(beside(1.0f).modes.of[0], immediate_mode::count_first);
    EXPECT_EQ(beside(1.0f).modes.of[1], immediate_mode::blend);
    EXPECT_TRUE(beside(1.0f).modes.counts_first);
    EXPECT_EQ(beside(1.0f).bits_of, -1);
    EXPECT_EQ(beside(1.0f).voxels_of, -1);
    // More than 2^30 words need wider offsets: in bytes they exceed 2^32.
    fb = view_of<bits, float_sum>({32, 1 << 15, (1 << 15) - 1});
    EXPECT_EQ(plan(std::vector{vp::constant(true, 1.0f)}, fb, 1000, false).modes.of[0], immediate_mode::blend);
    fb = view_of<bits, float_sum>({32, 1 << 15, 1 << 15});
    EXPECT_EQ(plan(std::vector{vp::constant(true, 1.0f)}, fb, 1000, false).modes.of[0], immediate_mode::blend_far);
    fb = view_of<bits, float_sum>({32, 32, 32});
    // A target that is counted anyway gives the number of voxels too.
    EXPECT_EQ(beside(0.1f).modes.of[0], immediate_mode::blend);
    EXPECT_EQ(beside(0.1f).modes.of[1], immediate_mode::count);
    EXPECT_FALSE(beside(0.1f).modes.counts_first);
    EXPECT_EQ(beside(0.1f).voxels_of, 1);
    vp::get<1>(fb.targets).load = vp::load_operation::load;
    EXPECT_FALSE(beside(1.0f).possible);
    vp::get<1>(fb.targets).load = vp::load_operation::off;
    EXPECT_TRUE(beside(0.1f).possible);
    EXPECT_EQ(beside(0.1f).modes.of[1], immediate_mode::off);
}

// A few triangles in a large grid are not counted if the last pass would read the whole grid, which takes longer.
TEST(FragmentCountsPlan, DoesNotCountAFewTrianglesIfTheWholeGridWouldBeRead) {
    const std::vector shaders{vp::constant(0.1f)};
    auto fb = view_of<float_sum>({1024, 1024, 1024});
    EXPECT_TRUE(plan(shaders, fb, 12, true).is_cheap);
    vp::get<0>(fb.targets).clear_value = 0.5f;
    EXPECT_FALSE(plan(shaders, fb, 12, true).is_cheap);
    EXPECT_TRUE(plan(shaders, fb, 1000000, true).is_cheap);
    EXPECT_TRUE(plan(shaders, view_of<float_sum>({64, 64, 64}), 12, true).is_cheap);
    EXPECT_TRUE(plan(std::vector{vp::constant(1.0f)}, fb, 12, false).is_cheap);
}

} // namespace
