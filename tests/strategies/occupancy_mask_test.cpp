// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Constants and blends for which only the set of covered voxels matters, the occupancy mask. Every such target is
// compared with cpu_backend byte for byte, cleared to either value and loaded. Also calls of one backend that rely on
// each other's zeros, and the limits beyond which targets are drawn in place.

#include "cells.hpp"

#include <gtest/gtest.h>

#include <span>
#include <vector>

namespace {

using namespace device_test;
namespace blend = voxelpipe::blend;
namespace layout = voxelpipe::layout;

template <class Blend, class Layout = layout::linear>
using bits = vp::target<vp::bit, Blend, Layout>;

// One call into targets that are cleared to these values or hold a byte pattern; some are off.
template <class Backend, class... Targets, class Values, class... Clear>
vp::status draw_constants(Backend& be, vp::framebuffer<Backend, Targets...>& fb, const mesh_data& m, const vp::grid& g,
                          const Values& values, const call_options& options, start how, indices known, Clear... clear) {
    const vp::mesh<Backend> mesh{be, m.positions, m.triangles};
    const auto each = [&](auto&& f) {
        const auto clears = vp::core::make_pack(clear...);
        vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { f(vp::get<I>(fb), vp::get<I>(clears)); });
    };
    each([](auto&& target, const auto& value) { target.clear(value); });
    if (how == start::load) {
        const mesh_data other = mixed_triangles(300, 30.0f, 411);
        const vp::mesh<Backend> first{be, other.positions, other.triangles};
        const vp::status s = vp::voxelize(be, first, g, vp::passthrough{}, values, fb, options);
        if (!s.ok()) return s;
        each([](auto&& target, const auto&) { target.load(); });
    }
    return vp::voxelize(be, view_of(mesh, known), g, vp::passthrough{}, values, fb, options);
}

template <class... Targets, class Values, class... Clear>
void compare_constants(target_list<Targets...>, const Values& values, Clear... clear) {
    const mesh_data m = mixed_triangles(1500, 40.0f, 410);
    for (const glm::ivec3 extent :
         {glm::ivec3(60, 47, 31), glm::ivec3(33, 9, 40), glm::ivec3(64, 32, 16), glm::ivec3(1)})
        for (const start how : {start::clear, start::load})
            for (const vp::voxelize_options& options : {vp::voxelize_options{vp::coverage::conservative, true},
                                                        vp::voxelize_options{vp::coverage::thin, false}}) {
                SCOPED_TRACE(testing::Message() << extent.x << " x " << extent.y << " x " << extent.z
                                                << (how == start::load ? ", loaded" : ""));
                const vp::grid g = box_grid(extent);
                vp::cpu_backend cpu;
                vp::framebuffer<vp::cpu_backend, Targets...> a{cpu, extent};
                const vp::status sa = draw_constants(cpu, a, m, g, values, options, how, indices::checked, clear...);
                for (const indices known : {indices::checked, indices::unknown}) {
                    SCOPED_TRACE(known == indices::checked ? "indices checked" : "indices unknown");
                    vp::cuda_backend gpu;
                    vp::framebuffer<vp::cuda_backend, Targets...> b{gpu, extent};
                    const vp::status sb = draw_constants(gpu, b, m, g, values, options, how, known, clear...);
                    ASSERT_TRUE(sa.ok() && sb.ok()) << sb.message();
                    expect_same_counts(sa.counts, sb.counts);
                    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                        expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu),
                                          ("target " + std::to_string(I)).c_str());
                    });
                }
            }
}

TEST(OccupancyMask, BitsAreTheCpus) {
    using targets = target_list<bits<blend::bit_or>, bits<blend::replace>, bits<blend::bit_and>, bits<blend::max>,
                                bits<blend::min, layout::tiled>, bits<blend::replace, layout::tiled>>;
    for (const bool value : {true, false})
        for (const bool clear : {true, false})
            compare_constants(targets{}, vp::constant(value, value, value, value, value, value), clear, clear, clear,
                              clear, clear, clear);
}

TEST(OccupancyMask, ValuesAreTheCpus) {
    using targets = target_list<vp::target<float, blend::replace>, vp::target<float, blend::min>,
                                vp::target<std::uint8_t, blend::max>, vp::target<std::uint64_t, blend::bit_or>,
                                vp::target<std::uint16_t, blend::bit_and, layout::tiled>, bits<blend::bit_or>>;
    compare_constants(
        targets{},
        vp::constant(0.25f, -3.0f, std::uint8_t{200}, std::uint64_t{0x1234567890abcdefu}, std::uint16_t{0x0ff0}, true),
        -1.0f, 7.5f, std::uint8_t{3}, std::uint64_t{1} << 40, std::uint16_t{0x3c3c}, false);
    // Blends that change nothing, and stored values that are NaN.
    compare_constants(
        targets{},
        vp::constant(device_test::nan, infinity, std::uint8_t{2}, std::uint64_t{0}, std::uint16_t{0xffff}, false),
        device_test::nan, -0.0f, std::uint8_t{3}, std::uint64_t{5}, std::uint16_t{1}, false);
}

TEST(OccupancyMask, VectorsAreTheCpus) {
    using targets = target_list<vp::target<glm::vec4, blend::replace>, vp::target<glm::vec3, blend::replace>,
                                vp::target<glm::vec3, blend::max, layout::planar>,
                                vp::target<glm::vec4, blend::replace, layout::tiled>>;
    compare_constants(targets{},
                      vp::constant(glm::vec4(1, 2, 3, 4), glm::vec3(5, 6, 7), glm::vec3(0, device_test::nan, 2),
                                   glm::vec4(8, 9, 10, 11)),
                      glm::vec4(0.5f), glm::vec3(-1), glm::vec3(1), glm::vec4(-2));
}

// Positions that a vertex shader stores in memory, and a part of a grid.
TEST(OccupancyMask, ShadedVerticesGiveTheCpusBytes) {
    for (const vp::coverage rule : both_rules)
        expect_same<bits<blend::bit_or>, vp::target<float, blend::replace>>(
            mixed_triangles(700, 60.0f, 412), box_grid({60, 64, 70}).crop({7, 5, 3}, {41, 52, 60}), shift{0.25f},
            vp::constant(true, 2.5f), rule);
}

// The same call by voxelize, in memory that other calls have used, and by voxelize_async.
TEST(OccupancyMask, AlternatingCallsOfOneBackendGiveTheCpusBytes) {
    using single = target_list<bits<blend::bit_or>>;
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    vp::cpu_backend cpu;
    for (const bool locks : {true, false}) {
        vp::cuda_backend gpu;
        gpu.use_pinned_memory = locks;
        const auto expect_bits = [&](const mesh_data& m, glm::ivec3 extent, const call_options& options) {
            single::framebuffer<vp::cuda_backend> on_gpu{gpu, extent};
            single::framebuffer<vp::cpu_backend> on_cpu{cpu, extent};
            const auto before = vp::get<0>(on_gpu).to_host(gpu);
            const vp::status a = draw_constants(gpu, on_gpu, m, box_grid(extent), vp::constant(true), options,
                                                start::clear, indices::unknown, false);
            const vp::status b = draw_constants(cpu, on_cpu, m, box_grid(extent), vp::constant(true), options,
                                                start::clear, indices::unknown, false);
            ASSERT_EQ(a.code, b.code) << a.message();
            if (b.ok()) expect_same_counts(b.counts, a.counts);
            expect_same_bytes(b.ok() ? vp::get<0>(on_cpu).to_host(cpu) : before, vp::get<0>(on_gpu).to_host(gpu),
                              b.ok() ? "bits" : "what a call that failed has left");
        };
        const glm::ivec3 small(40, 33, 47), large(110, 90, 100);
        mesh_data bad = mixed_triangles(900, 30.0f, 420);
        bad.triangles[500].y = static_cast<std::uint32_t>(bad.positions.size());
        for (int round = 0; round < 3; ++round) {
            SCOPED_TRACE(testing::Message() << "round " << round << (locks ? "" : ", nothing locked"));
            const auto seed = 421 + static_cast<std::uint32_t>(round);
            expect_bits(mixed_triangles(300, 30.0f, seed), small, vp::coverage::conservative);
            expect_bits(mixed_triangles(150, 30.0f, seed), large, vp::coverage::thin);
            // Fragment lists use the memory of the occupancy mask.
            vp::abuffer<vp::cuda_backend, void> lists{gpu};
            const mesh_data m = mixed_triangles(900, 20.0f, seed);
            const vp::mesh<vp::cuda_backend> mesh{gpu, m.positions, m.triangles};
            ASSERT_TRUE(vp::voxelize(gpu, mesh, box_grid(large), vp::passthrough{}, vp::constant(), lists).ok());
            expect_bits(mixed_triangles(200, 40.0f, seed), small, vp::coverage::thin);
            expect_bits(bad, large, vp::coverage::conservative);
            expect_bits(mixed_triangles(100, 60.0f, seed), large, vp::coverage::conservative);
            if (round == 1) gpu.release();
        }
        const mesh_data m = mixed_triangles(800, 40.0f, 430);
        const vp::mesh<vp::cuda_backend> mesh{gpu, m.positions, m.triangles};
        const draw d{mesh.view(), {}, vp::constant(true)};
        single::framebuffer<vp::cuda_backend> fb{gpu, small};
        const std::span<const draw> draws(&d, 1);
        const std::size_t bytes = vp::workspace_bytes(draws, box_grid(small), fb.view(), {}, {});
        ASSERT_GT(bytes, 0u);
        vp::cuda_backend::buffer<std::byte> memory{gpu, bytes};
        ASSERT_EQ(cudaMemsetAsync(memory.data(), 0xa5, bytes, gpu.stream), cudaSuccess);
        const vp::workspace_view workspace{memory.data(), bytes, {}};
        ASSERT_TRUE(vp::voxelize_async(gpu, draws, box_grid(small), fb.view(), {}, workspace).ok());
        const vp::status s = vp::read_status(gpu, workspace);
        single::framebuffer<vp::cpu_backend> expected{cpu, small};
        const vp::status reference = draw_constants(cpu, expected, m, box_grid(small), vp::constant(true), {},
                                                    start::clear, indices::unknown, false);
        ASSERT_TRUE(s.ok()) << s.message();
        expect_same_counts(reference.counts, s.counts);
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(gpu), "bits of voxelize_async");
    }
}

template <class Backend, class... Targets, class Values>
vp::counters draw_parts(Backend& be, vp::framebuffer<Backend, Targets...>& fb, const std::vector<mesh_data>& parts,
                        const std::vector<Values>& values, const vp::grid& g, bool count, indices known) {
    std::vector<vp::mesh<Backend>> meshes;
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, Values>> draws;
    for (const mesh_data& m : parts) meshes.emplace_back(be, m.positions, m.triangles);
    for (std::size_t i = 0; i < parts.size(); ++i) draws.push_back({view_of(meshes[i], known), {}, values[i]});
    const vp::status s = vp::voxelize(be, std::span<const typename decltype(draws)::value_type>(draws), g, fb,
                                      vp::voxelize_options{vp::coverage::conservative, count});
    EXPECT_TRUE(s.ok()) << s.message();
    return s.counts;
}
template <class... Targets, class Values>
void compare_parts(target_list<Targets...>, const std::vector<mesh_data>& parts, const std::vector<Values>& values) {
    const vp::grid g = box_grid({60, 47, 31});
    for (const bool count : {true, false}) {
        vp::cpu_backend cpu;
        vp::framebuffer<vp::cpu_backend, Targets...> a{cpu, g.extent};
        const vp::counters expected = draw_parts(cpu, a, parts, values, g, count, indices::checked);
        for (const indices known : {indices::checked, indices::unknown}) {
            SCOPED_TRACE(known == indices::checked ? "indices checked" : "indices unknown");
            vp::cuda_backend gpu;
            vp::framebuffer<vp::cuda_backend, Targets...> b{gpu, g.extent};
            expect_same_counts(expected, draw_parts(gpu, b, parts, values, g, count, known));
            vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu),
                                  ("target " + std::to_string(I)).c_str());
            });
        }
    }
}

// Three draws of one value, and draws of different values, which are drawn in place.
TEST(OccupancyMask, SeveralDrawsGiveTheCpusBytes) {
    mesh_data large = mixed_triangles(200, 40.0f, 440);
    add_triangle(large, {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 50.0f}, {-300.0f, 500.0f, 20.0f});
    const std::vector<mesh_data> parts{large, mixed_triangles(600, 40.0f, 441), mixed_triangles(300, 40.0f, 442)};
    using values = decltype(vp::constant(true, 0.5f));
    const auto list = [](float third) {
        return std::vector<values>{vp::constant(true, 0.5f), vp::constant(true, 0.5f), vp::constant(true, third)};
    };
    compare_parts(target_list<bits<blend::bit_or>, vp::target<float, blend::replace>>{}, parts, list(0.5f));
    compare_parts(target_list<bits<blend::bit_or>, vp::target<float, blend::replace>>{}, parts, list(-1.5f));
    using bit_value = vp::constant_output<bool>;
    compare_parts(target_list<bits<blend::bit_or>>{}, parts,
                  std::vector<bit_value>{vp::constant(true), vp::constant(false), vp::constant(true)});
}

// Grids of more than 32 MB of bits are drawn in place. Without counters, so are grids of more than 1 MB with few
// triangles or with known indices.
TEST(OccupancyMask, LargeGridsOfBitsAreTheCpus) {
    const mesh_data m = mixed_triangles(60, 40.0f, 450);
    for (const bool count : {false, true})
        expect_same<bits<blend::bit_or>>(m, box_grid({416, 200, 200}), vp::passthrough{}, vp::constant(true),
                                         vp::voxelize_options{vp::coverage::conservative, count});
    expect_same<bits<blend::bit_or>>(m, box_grid({1056, 600, 512}), vp::passthrough{}, vp::constant(true), {});
    // A target that starts with all bits set.
    const glm::ivec3 extent(1056, 600, 512);
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, bits<blend::bit_and, layout::tiled>> a{cpu, extent};
    vp::framebuffer<vp::cuda_backend, bits<blend::bit_and, layout::tiled>> b{gpu, extent};
    const vp::status sa =
        draw_constants(cpu, a, m, box_grid(extent), vp::constant(false), {}, start::clear, indices::unknown, true);
    const vp::status sb =
        draw_constants(gpu, b, m, box_grid(extent), vp::constant(false), {}, start::clear, indices::unknown, true);
    ASSERT_TRUE(sa.ok() && sb.ok()) << sb.message();
    EXPECT_GT(sa.counts.voxels, 0u);
    expect_same_counts(sa.counts, sb.counts);
    expect_same_bytes(vp::get<0>(a).to_host(cpu), vp::get<0>(b).to_host(gpu), "bits that are cleared");
}

} // namespace
