// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// label on cpu_backend: the components of a flood, by labels of both types, for any threads; neighbourhoods one by one;
// bad input.
#include "../test_scale.hpp"
#include "label_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <thread>
#include <vector>

namespace {

using namespace label_tests;
using bits_view = vp::target_view<vp::target<vp::bit, vp::blend::bit_or>>;
using labels_view = vp::target_view<vp::target<std::int32_t, vp::blend::replace>>;

// Builds with sanitizers set it below 1.
std::uint32_t scaled(std::uint32_t count) {
    return tests::is_slow_build() ? static_cast<std::uint32_t>(count * tests::test_scale()) + 100 : count;
}

TEST(Label, RandomGridsAreTheFloods) {
    std::mt19937 random(1);
    const std::uint32_t count = scaled(4000);
    std::size_t components = 0, voxels = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
        const volume v = random_volume(random);
        const int connectivity = connectivities[k % 3];
        const result expected = flood(v, connectivity);
        for (const unsigned threads : {1u, 2u, 8u}) {
            if (threads != 1 && k % 8 != 0) continue;
            vp::cpu_backend backend{threads};
            ASSERT_TRUE(label<std::int32_t>(backend, v, connectivity).is(expected)) << k << ", threads " << threads;
            const result wide = label<std::int64_t>(backend, v, connectivity, false);
            ASSERT_EQ(wide.labels, expected.labels) << k << ", threads " << threads;
            ASSERT_EQ(wide.status.label, expected.status.label) << k;
            ASSERT_TRUE(wide.components.empty());
        }
        components += expected.components.size();
        for (const vp::voxel_component& c : expected.components) voxels += c.voxels;
    }
    EXPECT_GT(components, 8 * count);
    EXPECT_GT(voxels, 50 * count);
}

TEST(Label, ShapesAreTheFloods) {
    for (const int nx : {1, 2, 5, 33, 63, 64, 65, 129})
        for (const named_volume& shape : shapes(nx))
            for (const int connectivity : connectivities) {
                vp::cpu_backend one{1}, several{3};
                const result expected = flood(shape.voxels, connectivity);
                EXPECT_TRUE(label<std::int32_t>(one, shape.voxels, connectivity).is(expected))
                    << shape.name << ", width " << nx << ", connectivity " << connectivity;
                EXPECT_TRUE(label<std::int64_t>(several, shape.voxels, connectivity).is(expected))
                    << shape.name << ", width " << nx << ", connectivity " << connectivity;
            }
}

TEST(Label, SerpentinesAndSpiralsAreOneComponent) {
    vp::cpu_backend backend{2};
    int found = 0;
    for (const named_volume& shape : shapes(65))
        if (shape.name == "serpentine" || shape.name == "spiral" || shape.name == "late bridges" ||
            shape.name == "full") {
            ++found;
            const result r = label<std::int32_t>(backend, shape.voxels, 6);
            ASSERT_EQ(r.components.size(), 1u) << shape.name;
            EXPECT_EQ(r.components[0].name, 0);
            EXPECT_EQ(r.components[0].max.x, 64);
        }
    EXPECT_EQ(found, 4);
}

// Two voxels are connected by 6, 18 or 26 if they differ in one, two or three coordinates by one, and by nothing else.
TEST(Label, TwoVoxelsTouchByFacesEdgesAndCorners) {
    vp::cpu_backend backend{1};
    for (const int x : {1, 31, 62, 63, 64})
        for (int step = 0; step < 125; ++step) {
            const glm::ivec3 d(step % 5 - 2, step / 5 % 5 - 2, step / 25 - 2);
            if (x + d.x < 0 || d == glm::ivec3(0)) continue;
            volume v(glm::ivec3(68, 5, 5));
            v.add(x, 2, 2);
            v.add(x + d.x, 2 + d.y, 2 + d.z);
            const int reach = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}),
                      differ = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
            for (const int connectivity : connectivities) {
                const int most = connectivity == 6 ? 1 : connectivity == 18 ? 2 : 3;
                EXPECT_EQ(label<std::int32_t>(backend, v, connectivity).status.label.components,
                          reach == 1 && differ <= most ? 1u : 2u)
                    << connectivity << ": " << x << " + (" << d.x << ", " << d.y << ", " << d.z << ")";
            }
        }
}

// All sets of 3 x 3 x 2 voxels: what a voxel's joins with the rows before depend on.
TEST(Label, EveryNeighbourhoodIsTheFloods) {
    std::vector<std::uint32_t> all;
    const std::uint32_t step = (1u << 18) / scaled(1u << 18);
    for (std::uint32_t k = 0; k < 1u << 18; k += step) all.push_back(k);
    const volume v = of_patterns(all, 1024, 0, 4, 4 * 1024);
    // At the borders of words of 32 and of 64 bits.
    std::mt19937 random(5);
    std::vector<std::uint32_t> some(scaled(3000));
    for (std::uint32_t& k : some) k = static_cast<std::uint32_t>(random()) >> 7 & 0x3ffffu;
    const volume at_30 = of_patterns(some, 2, 30, 32, 65), at_31 = of_patterns(some, 2, 31, 32, 66);
    vp::cpu_backend backend{1};
    for (const int connectivity : connectivities)
        for (const volume* const patterns : {&v, &at_30, &at_31})
            EXPECT_TRUE(label<std::int32_t>(backend, *patterns, connectivity).is(flood(*patterns, connectivity)));
}

TEST(Label, AnyThreadsGiveTheSameBytes) {
    std::mt19937 random(3);
    for (const unsigned percent : {20u, 33u, 60u}) {
        const volume v = random_volume(random, glm::ivec3(70, 23, 16), percent);
        for (const int connectivity : connectivities) {
            const result expected = flood(v, connectivity);
            for (const unsigned threads : {1u, 2u, 8u}) {
                vp::cpu_backend backend{threads};
                EXPECT_TRUE(label<std::int32_t>(backend, v, connectivity).is(expected)) << threads;
                EXPECT_EQ(label<std::int32_t>(backend, v, connectivity, false).labels, expected.labels) << threads;
            }
        }
    }
}

TEST(Label, TiledBitsAreTheSame) {
    std::mt19937 random(4);
    vp::cpu_backend backend{2};
    for (int k = 0; k < 30; ++k) {
        const volume v = random_volume(random);
        EXPECT_TRUE((label<std::int32_t, vp::layout::tiled>(backend, v, 26).is(flood(v, 26)))) << k;
    }
}

TEST(Label, IsCalledWithTargetsOfFramebuffers) {
    vp::cpu_backend backend{1};
    const glm::ivec3 extent(9, 3, 2);
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> drawn(backend, extent);
    vp::framebuffer<vp::cpu_backend, vp::target<std::int32_t, vp::blend::max>> labels(backend, extent);
    ASSERT_TRUE(vp::clear(backend, drawn).ok());
    for (const int x : {0, 1, 7, 8})
        for (int y = 0; y < 3; ++y) vp::get<0>(drawn).view().store(x, y, 1, true);
    const vp::status s = vp::label(backend, vp::get<0>(drawn).view(), vp::get<0>(labels).view());
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.label.components, 2u);
    const auto host = vp::get<0>(labels).to_host_target(backend);
    EXPECT_EQ(host(0, 0, 1), 27);
    EXPECT_EQ(host(1, 2, 1), 27);
    EXPECT_EQ(host(8, 0, 1), 34);
    EXPECT_EQ(host(4, 0, 1), vp::no_label);
    EXPECT_EQ(host(0, 0, 0), vp::no_label);
}

// Threads that make roots the parents of all numbers leave nothing else, though others follow the same paths meanwhile.
TEST(Label, ThreadsFlattenSets) {
    constexpr std::uint32_t numbers = 3000;
    for (int run = 0; run < (tests::is_slow_build() ? 20 : 200); ++run) {
        std::vector<std::uint32_t> parents(numbers);
        for (std::uint32_t i = 0; i < numbers; ++i) parents[i] = i == 0 ? 0 : i - 1;
        const vp::core::disjoint_sets<std::uint32_t> sets{parents.data()};
        const auto flatten = [&](std::uint32_t part) {
            for (std::uint32_t i = numbers; i-- > 0;)
                if (i % 4 == part) sets.set_root(i, sets.find(i));
        };
        std::vector<std::thread> threads;
        for (std::uint32_t part = 0; part < 4; ++part) threads.emplace_back(flatten, part);
        for (std::thread& t : threads) t.join();
        EXPECT_EQ(std::count(parents.begin(), parents.end(), 0U), std::ptrdiff_t{numbers});
    }
}

TEST(Label, BadInputIsRefused) {
    vp::cpu_backend backend{1};
    std::array<std::uint32_t, 12> bits{1};
    std::array<std::int32_t, 12> labels{};
    labels.fill(7);
    const bits_view from{bits.data(), glm::ivec3(2, 3, 2)};
    const labels_view to{labels.data(), from.extent};
    const std::vector<vp::voxel_component> kept{{3, 4, glm::ivec3(5), glm::ivec3(6)}};
    vp::cpu_backend::buffer<vp::voxel_component> table(backend, vp::array_view<const vp::voxel_component>(kept));
    const auto code_of = [&](const bits_view& b, const labels_view& l, int connectivity = 6) {
        const vp::status s = vp::label(backend, b, l, {.connectivity = connectivity});
        const vp::status with_table = vp::label(backend, b, l, table, {.connectivity = connectivity});
        EXPECT_EQ(s.code, with_table.code);
        EXPECT_EQ(s.label.components, 0u);
        return s.code;
    };
    for (const int connectivity : {0, 4, 7, 8, -6, 27})
        EXPECT_EQ(code_of(from, to, connectivity), vp::status_code::bad_label_options);
    EXPECT_EQ(code_of(from, {labels.data(), glm::ivec3(2, 2, 3)}), vp::status_code::extent_mismatch);
    EXPECT_EQ(code_of({nullptr, from.extent}, to), vp::status_code::null_view);
    EXPECT_EQ(code_of(from, {nullptr, from.extent}), vp::status_code::null_view);
    const auto of_extent = [&](const glm::ivec3& e) { return code_of({nullptr, e}, {nullptr, e}); };
    EXPECT_EQ(of_extent({2, 0, 2}), vp::status_code::bad_extent);
    EXPECT_EQ(of_extent({2, 2, -1}), vp::status_code::bad_extent);
    EXPECT_EQ(of_extent({(1 << 20) + 1, 1, 1}), vp::status_code::extent_too_large);
    // The last voxel has the number 2^31 - 1, and 2^31 + 2^20 - 1.
    EXPECT_EQ(of_extent({1 << 20, 1 << 5, 1 << 6}), vp::status_code::null_view);
    EXPECT_EQ(of_extent({1 << 20, 683, 3}), vp::status_code::too_many_voxels);
    const vp::target_view<vp::target<std::int64_t, vp::blend::replace>> wide{nullptr, glm::ivec3(1 << 20, 683, 3)};
    EXPECT_EQ(vp::label(backend, bits_view{nullptr, wide.extent}, wide).code, vp::status_code::null_view);
    for (const std::int32_t l : labels) EXPECT_EQ(l, 7);
    EXPECT_EQ(table.to_host(backend), kept);
    ASSERT_TRUE(vp::label(backend, from, to, table).ok());
    EXPECT_EQ(table.size(), 1u);
    EXPECT_STREQ(to_string(vp::status_code::bad_label_options),
                 "bad label options: the connectivity must be 6, 18 or 26");
    EXPECT_NE(std::string(to_string(vp::status_code::too_many_voxels)).find("std::int64_t"), std::string::npos);
}

} // namespace
