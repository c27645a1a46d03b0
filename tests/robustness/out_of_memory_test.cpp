// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Calls that run out of memory, at every allocation: each returns out_of_memory and the stage, leaves targets and
// earlier lists as they were, and no allocation behind.

#include "breakable_call.hpp"
#include "counted_allocations.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <new>
#include <span>
#include <utility>
#include <vector>

namespace {

using namespace unit;
using vp::status_code;

// Calls attempt() with 0, 1, 2, ... allocations granted until no allocation fails, and look(status) after each. Returns
// the number of attempts that succeeded although an allocation failed.
template <class Attempt, class Look>
int refuse_each_allocation(const Attempt& attempt, const Look& look) {
    int well_in_spite = 0;
    for (std::int64_t granted = 0; granted < 1000; ++granted) {
        const std::int64_t live = live_allocations;
        unit::allocations_left = granted;
        const vp::status s = attempt();
        const bool refused = unit::allocations_left.exchange(unit::no_end_of_allocations) < 0;
        if (!s.ok()) {
            EXPECT_TRUE(refused);
            EXPECT_EQ(live_allocations, live) << granted << ": " << s.message();
            EXPECT_EQ(s.code, status_code::out_of_memory) << s.message();
            EXPECT_NE(s.where, vp::stage::validate);
            EXPECT_EQ(s.counts.triangles_in, 17000u);
            EXPECT_EQ(s.counts.fragments, 0u);
            EXPECT_EQ(s.counts.voxels, 0u);
        }
        look(s);
        if (!refused) {
            EXPECT_TRUE(s.ok()) << s.message();
            EXPECT_GT(granted, 10);
            return well_in_spite;
        }
        well_in_spite += s.ok() ? 1 : 0;
    }
    ADD_FAILURE() << "no end of allocations";
    return well_in_spite;
}

// The stages of failed calls, each once, in the order of their appearance, which may vary with several threads.
struct failed_stages {
    std::vector<vp::stage> list;
    void note(const vp::status& s) {
        if (!s.ok() && (list.empty() || list.back() != s.where)) list.push_back(s.where);
    }
};

// As two draws, of half the triangles each.
template <class Call>
std::array<draw, 2> two_draws(const Call& c) {
    std::array<draw, 2> draws{draw{c.mesh, {}, shader}, draw{c.mesh, {}, shader}};
    draws[0].mesh.triangles = {c.triangles.data(), c.triangles.size() / 2};
    draws[1].mesh.triangles = {c.triangles.data() + c.triangles.size() / 2, c.triangles.size() / 2};
    return draws;
}

// After each refused attempt the targets of C are as they were, after one that succeeds as by a call with all memory.
// note(status) sees each; returns as refuse_each_allocation does.
template <class Call, class Attempt, class Note>
int expect_targets_whole(Call& c, const Attempt& attempt, const Note& note) {
    EXPECT_TRUE(attempt().ok());
    const std::vector<float> depths = c.depths;
    const std::vector<std::uint32_t> words = c.words;
    EXPECT_FALSE(c.untouched());
    c.wipe();
    return refuse_each_allocation(attempt, [&](const vp::status& s) {
        note(s);
        EXPECT_TRUE(s.ok() ? c.depths == depths && c.words == words : c.untouched()) << s.message();
        c.wipe();
    });
}

// The same of lists: those of draw_earlier() are as they were.
template <class Lists, class Attempt, class Earlier, class Note>
void expect_lists_whole(vp::cpu_backend& be, Lists& lists, const Attempt& attempt, const Earlier& draw_earlier,
                        const Note& note) {
    EXPECT_TRUE(attempt().ok());
    const auto expected = lists.to_host(be);
    draw_earlier();
    const auto before = lists.to_host(be);
    EXPECT_NE(expected.extent, before.extent);
    refuse_each_allocation(attempt, [&](const vp::status& s) {
        note(s);
        const auto& same = s.ok() ? expected : before;
        const auto got = lists.to_host(be);
        EXPECT_EQ(got.voxels, same.voxels) << s.message();
        EXPECT_EQ(got.offsets, same.offsets);
        EXPECT_EQ(got.primitives, same.primitives);
        EXPECT_EQ(got.payloads, same.payloads);
        EXPECT_EQ(got.extent, same.extent);
        if (s.ok()) draw_earlier();
    });
}

TEST(OutOfMemory, DuringAFramebufferCallLeavesTheTargetsUnchanged) {
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin})
        for (const unsigned threads : {1u, 3u})
            for (const bool same_values : {true, false}) { // two code paths of cpu_backend
                large_call c;
                vp::cpu_backend be(threads);
                std::array<draw, 2> draws = two_draws(c);
                if (!same_values) draws[1].fragment_shader = vp::constant(2.0f, false, glm::dvec4(2.0));
                const auto attempt = [&] {
                    return vp::voxelize(be, std::span<const draw>(draws), c.grid, c.view, rule);
                };
                failed_stages failed;
                const int well_in_spite =
                    expect_targets_whole(c, attempt, [&](const vp::status& s) { failed.note(s); });
                using vp::stage;
                const std::vector expected{stage::vertex_shade, stage::coarse_raster, stage::tile_sort,
                                           stage::fine_raster};
                if (threads == 1) {
                    EXPECT_EQ(failed.list, expected);
                }
                // A call does without a thread that cannot be started, above all once it writes targets.
                EXPECT_EQ(well_in_spite > 0, threads > 1);
            }
}

TEST(OutOfMemory, DuringAnAbufferCallLeavesEarlierListsUnchanged) {
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin})
        for (const unsigned threads : {1u, 3u}) {
            const call earlier;
            const large_call c;
            vp::cpu_backend be(threads);
            vp::abuffer<vp::cpu_backend, int> lists{be};
            const auto attempt = [&] { return vp::voxelize(be, c.mesh, c.grid, by_weight{}, payload, lists, rule); };
            const auto draw_earlier = [&] {
                vp::voxelize(be, earlier.mesh, earlier.grid, by_weight{}, payload, lists, rule).or_throw();
            };
            failed_stages failed;
            expect_lists_whole(be, lists, attempt, draw_earlier, [&](const vp::status& s) { failed.note(s); });
            using vp::stage;
            const std::vector all{stage::vertex_shade, stage::coarse_raster, stage::tile_sort, stage::fine_raster,
                                  stage::abuffer_emit};
            if (threads == 1) {
                EXPECT_EQ(failed.list, all);
            }
        }
}

// Every option that takes memory of its own.
constexpr vp::solid_options solid_calls[]{
    {.rule = vp::fill_rule::even_odd},   {.bodies = vp::bodies::draw, .extent = vp::solid_extent::outer},
    {.repair = vp::repair::close_holes}, {.repair = vp::repair::exterior, .closing = 1},
    {.repair = vp::repair::vote},
};

// The triangles outside cancel: they are no hole that would need thousands of cones.
struct solid_call : large_call {
    solid_call() {
        for (std::size_t i = 2; i + 1 < triangles.size(); i += 2) std::swap(triangles[i].y, triangles[i].z);
    }
};

TEST(OutOfMemory, DuringASolidCallLeavesTheTargetsUnchanged) {
    unsigned threads = 1; // in turn 1 and 2
    for (const vp::solid_options& options : solid_calls) {
        solid_call c;
        vp::cpu_backend be(threads);
        threads = 3 - threads;
        std::array<draw, 2> draws = two_draws(c);
        draws[1].fragment_shader = vp::constant(2.0f, false, glm::dvec4(2.0));
        const auto attempt = [&] {
            return vp::voxelize_solid(be, std::span<const draw>(draws), c.grid, c.view, options);
        };
        expect_targets_whole(c, attempt, [](const vp::status&) {});
    }
}

TEST(OutOfMemory, DuringASolidCallLeavesEarlierListsUnchanged) {
    for (const vp::solid_options& options : {solid_calls[0], solid_calls[1]}) {
        const call earlier;
        const solid_call c;
        vp::cpu_backend be(2);
        vp::abuffer<vp::cpu_backend, int> lists{be};
        const auto draw_earlier = [&] {
            vp::voxelize(be, earlier.mesh, earlier.grid, by_weight{}, payload, lists).or_throw();
        };
        const auto attempt = [&] {
            return vp::voxelize_solid(be, c.mesh, c.grid, by_weight{}, payload, lists, options);
        };
        expect_lists_whole(be, lists, attempt, draw_earlier, [](const vp::status&) {});
    }
}

TEST(OutOfMemory, InAConstructorIsAnException) {
    call c;
    vp::cpu_backend be(1);
    const std::int64_t live = live_allocations;
    const auto allocate = [&](std::int64_t granted) {
        unit::allocations_left = granted;
        bool thrown = false;
        try {
            const vp::mesh<vp::cpu_backend> m{be, c.positions, c.triangles};
            const vp::framebuffer<vp::cpu_backend, floats> fb{be, {8, 8, 8}};
            vp::get<0>(fb.view().targets).elements[0] = m.view().positions[0].x;
        } catch (const std::bad_alloc&) {
            thrown = true;
        }
        unit::allocations_left = unit::no_end_of_allocations;
        EXPECT_EQ(live_allocations, live);
        return thrown;
    };
    EXPECT_TRUE(allocate(0));
    EXPECT_TRUE(allocate(1));
    EXPECT_TRUE(allocate(2));
    EXPECT_FALSE(allocate(3));
}

} // namespace
