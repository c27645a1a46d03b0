// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Every strategy, forced, for every kind of target, shader and coverage: the CPU's bytes and counters, or a refusal
// that writes nothing. Which ones serve which program is written out here.

#include "cells.hpp"

#include <utility>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

constexpr vp::strategy every_strategy[] = {vp::strategy::occupancy_mask, vp::strategy::immediate,
                                           vp::strategy::sorted_reduce, vp::strategy::sorted_fold, vp::strategy::tiled};

// Strategies that serve a program, in the order above.
using served = std::array<bool, 5>;
constexpr served by_mask{true, true, true, false, true}, in_place{false, true, true, false, true},
    reduced{false, false, true, false, true}, folded{false, false, false, true, true},
    mask_of_bits{true, true, false, false, true}, bits_in_place{false, true, false, false, true};

// The forced strategy cannot serve the call: the targets stay as another call has left them.
template <class... Targets, class Shader>
void expect_refused(vp::cuda_backend& gpu, vp::framebuffer<vp::cuda_backend, Targets...>& fb, const mesh_data& m,
                    const vp::grid& g, const Shader& shader, const vp::voxelize_options& options, start how,
                    indices known) {
    const vp::strategy forced = std::exchange(gpu.strategy, vp::strategy::tiled);
    const mesh_data few{m.positions, {m.triangles.begin(), m.triangles.begin() + 20}};
    ASSERT_TRUE(draw_framebuffer(gpu, fb, few, g, vp::passthrough{}, shader, options, start::clear).ok());
    gpu.strategy = forced;
    const auto before = vp::get<0>(fb).to_host(gpu);
    if (how == start::load)
        vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
    const vp::status refused = draw_framebuffer(gpu, fb, m, g, vp::passthrough{}, shader, options, start::clear, known);
    EXPECT_EQ(refused.code, vp::status_code::strategy_unavailable) << refused.message();
    expect_same_bytes(before, vp::get<0>(fb).to_host(gpu), "as it was");
}

// A constant shader whose targets tell how many voxels were touched, if that is asked (FragmentCountsPlan tests say
// which do).
template <class Framebuffer, class Shader>
bool can_be_in_place(const Framebuffer& fb, const mesh_data& m, const Shader& shader, bool counts) {
    if constexpr (vp::device::strategies_of<Shader, Framebuffer>.immediate) {
        using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
        const draw_type d{{}, {}, shader};
        vp::device::immediate_plan<vp::device::targets_of<Framebuffer>::count> plan;
        vp::device::plan_immediate(std::span<const draw_type>(&d, 1), fb, m.triangles.size(), counts, plan);
        return plan.possible;
    }
    return false;
}

template <class... Targets, class Shader>
void compare(const Shader& shader, const served& serves, start how) {
    const mesh_data m = mixed_triangles(250, 20.0f, 91);
    const vp::grid g = box_grid({23, 17, 33});
    for (const vp::coverage rule : both_rules)
        for (const bool counts : {true, false}) {
            const vp::voxelize_options options{rule, counts};
            vp::cpu_backend cpu;
            vp::framebuffer<vp::cpu_backend, Targets...> expected{cpu, g.extent};
            const vp::status s = draw_framebuffer(cpu, expected, m, g, vp::passthrough{}, shader, options, how);
            ASSERT_TRUE(s.ok());
            for (std::size_t i = 0; i < std::size(every_strategy); ++i)
                for (const indices known : {indices::checked, indices::unknown}) {
                    SCOPED_TRACE(std::string(to_string(every_strategy[i])) + (counts ? ", voxels counted" : ""));
                    vp::cuda_backend gpu;
                    gpu.strategy = every_strategy[i];
                    vp::framebuffer<vp::cuda_backend, Targets...> fb{gpu, g.extent};
                    auto view = fb.view();
                    if (how == start::load)
                        vp::core::for_each_index<sizeof...(Targets)>(
                            [&]<std::size_t I>() { vp::get<I>(view.targets).load = vp::load_operation::load; });
                    const bool is_served = serves[i] && (every_strategy[i] != vp::strategy::immediate ||
                                                         can_be_in_place(view, m, shader, counts));
                    if (!is_served) {
                        expect_refused(gpu, fb, m, g, shader, options, how, known);
                        continue;
                    }
                    const vp::status done =
                        draw_framebuffer(gpu, fb, m, g, vp::passthrough{}, shader, options, how, known);
                    ASSERT_TRUE(done.ok()) << done.message();
                    EXPECT_EQ(gpu.last_strategy().value, every_strategy[i]);
                    expect_same_counts(s.counts, done.counts);
                    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                        const std::string what = "target " + std::to_string(I);
                        expect_same_bytes(vp::get<I>(expected).to_host(cpu), vp::get<I>(fb).to_host(gpu), what.c_str());
                    });
                }
        }
}

TEST(Strategies, ConstantsGiveTheSameBitsByEach) {
    for (const start how : {start::clear, start::load}) {
        compare<vp::target<vp::bit, blend::bit_or>>(vp::constant(true), mask_of_bits, how);
        compare<vp::target<float, blend::max>>(vp::constant(2.5f), by_mask, how);
        compare<vp::target<std::uint8_t, blend::min>, vp::target<vp::bit, blend::bit_and>>(
            vp::constant(std::uint8_t{7}, false), by_mask, how);
        compare<vp::target<vp::bit, blend::bit_xor>>(vp::constant(true), bits_in_place, how);
        compare<vp::target<std::uint32_t, blend::add>>(vp::constant(3u), in_place, how);
    }
    // A sum of floats is counted in place, which needs a cleared target.
    compare<vp::target<float, blend::add>>(vp::constant(0.1f), in_place, start::clear);
}

// Replace is no blend in place: its last triangle wins.
TEST(Strategies, AReplacedConstantGivesTheSameBitsByEach) {
    for (const start how : {start::clear, start::load})
        compare<vp::target<float, blend::replace>>(vp::constant(-1.0f), {true, false, true, false, true}, how);
}

TEST(Strategies, ComputedValuesGiveTheSameBitsByEach) {
    for (const start how : {start::clear, start::load}) {
        using sums = vp::target<float, blend::add>;
        using ids = vp::target<std::uint32_t, blend::replace>;
        compare<sums, ids>(any_values<sums, ids>{}, reduced, how);
        using occupied = vp::target<vp::bit, blend::bit_or>;
        compare<occupied>(any_values<occupied>{}, reduced, how);
        using ordered = vp::target<std::uint32_t, chain>;
        compare<ordered>(any_values<ordered>{}, folded, how);
        compare<ordered, sums>(any_values<ordered, sums>{}, folded, how);
    }
}

// The rule of the table names the strategy of a call that forces none, and says why.
TEST(Strategies, TheBackendSaysWhichOneItTook) {
    const mesh_data m = mixed_triangles(50, 12.0f, 92);
    const vp::grid g = box_grid({13, 14, 15});
    vp::cuda_backend gpu;
    using bits = vp::target<vp::bit, blend::bit_or>;
    vp::framebuffer<vp::cuda_backend, bits> fb{gpu, g.extent};
    ASSERT_TRUE(
        draw_framebuffer(gpu, fb, m, g, vp::passthrough{}, vp::constant(true), vp::coverage::thin, start::clear).ok());
    EXPECT_EQ(gpu.last_strategy().value, vp::strategy::occupancy_mask);
    EXPECT_NE(std::string(gpu.last_strategy().why).find("mask"), std::string::npos);
    ASSERT_TRUE(
        draw_framebuffer(gpu, fb, m, g, vp::passthrough{}, any_values<bits>{}, vp::coverage::thin, start::clear).ok());
    EXPECT_EQ(gpu.last_strategy().value, vp::strategy::sorted_reduce);
}

// A constant in bits that cannot be blended in place, for its voxels are counted and not all are known to be clear, is
// drawn in tiles and never listed.
TEST(Strategies, AConstantInBitsIsNeverListed) {
    const mesh_data m = mixed_triangles(120, 20.0f, 94);
    const vp::grid g = box_grid({23, 17, 33});
    const vp::voxelize_options options{vp::coverage::conservative, true};
    using flipped = vp::target<vp::bit, blend::bit_xor>;
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, flipped> expected{cpu, g.extent};
    vp::framebuffer<vp::cuda_backend, flipped> fb{gpu, g.extent};
    for (const start how : {start::clear, start::load}) {
        const auto shader = vp::constant(true);
        const vp::status s = draw_framebuffer(cpu, expected, m, g, vp::passthrough{}, shader, options, how);
        const vp::status done = draw_framebuffer(gpu, fb, m, g, vp::passthrough{}, shader, options, how);
        ASSERT_TRUE(s.ok() && done.ok());
        EXPECT_EQ(gpu.last_strategy().value, vp::strategy::tiled);
        expect_same_counts(s.counts, done.counts);
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(gpu), "flipped");
    }
}

// Strategies of voxelize_async, whose limits name them.
TEST(Strategies, AsynchronousCallsAreForcedByTheirLimits) {
    const mesh_data m = mixed_triangles(200, 20.0f, 93);
    const vp::grid g = box_grid({23, 17, 33});
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    using bits = vp::target<vp::bit, blend::bit_or>;
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
    const draw_type d{mesh.view(), {}, vp::constant(true)};
    const std::span<const draw_type> draws(&d, 1);
    const vp::voxelize_options options{vp::coverage::conservative};
    vp::framebuffer<vp::cpu_backend, bits> expected{cpu, g.extent};
    ASSERT_TRUE(
        draw_framebuffer(cpu, expected, m, g, vp::passthrough{}, vp::constant(true), options, start::clear).ok());
    for (std::size_t i = 0; i < std::size(every_strategy); ++i) {
        SCOPED_TRACE(to_string(every_strategy[i]));
        vp::workspace_limits limits = vp::workspace_limits::for_triangles(20 * m.triangles.size());
        limits.lists_fragments = true;
        limits.strategy = every_strategy[i];
        vp::framebuffer<vp::cuda_backend, bits> fb{gpu, g.extent};
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), options, limits);
        EXPECT_EQ(bytes == 0, !mask_of_bits[i]);
        vp::cuda_backend::buffer<std::byte> memory(gpu, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        const vp::status s = vp::voxelize_async(gpu, draws, g, fb.view(), options, workspace);
        if (!mask_of_bits[i]) {
            EXPECT_EQ(s.code, vp::status_code::strategy_unavailable);
            continue;
        }
        ASSERT_TRUE(s.ok()) << s.message();
        ASSERT_TRUE(vp::read_status(gpu, workspace).ok());
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(gpu), "target");
    }
}

} // namespace
