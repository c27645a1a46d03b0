// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Bits of constant shaders without tiles, against cpu_backend byte for byte: every blend, and meshes of every size
// class.

#include "immediate_cases.hpp"

#include <gtest/gtest.h>

#include <random>

namespace {

using namespace device_test;

TEST(Immediate, BitsAreTheCpus) {
    for (const bool value : {false, true}) compare_constants(bit_targets{}, same_bits(value));
}

// From one triangle, whose work items are spread over the device, to more than it runs at once.
TEST(Immediate, FewAndManyLargeTrianglesGiveTheCpusBytes) {
    const glm::ivec3 extent(150, 130, 140);
    std::mt19937 random(86);
    std::uniform_real_distribution<float> unit(-0.3f, 1.3f);
    for (const int count : {1, 2, 7, 33, 300, 2000}) {
        mesh_data m;
        for (int i = 0; i < count; ++i) {
            const auto point = [&] { return glm::vec3(unit(random), unit(random), unit(random)) * glm::vec3(extent); };
            add_triangle(m, point(), point(), point());
        }
        for (const vp::coverage rule : both_rules)
            expect_same(bit_targets{}, m, box_grid(extent), vp::passthrough{}, same_bits(true), rule);
    }
}

// Enough of each size class that every thread has one, and that warps combine words of thin bits. Some lie outside.
TEST(Immediate, ManyTrianglesOfMediumSizeGiveTheCpusBytes) {
    const glm::ivec3 extent(190, 170, 180);
    const mesh_data m = middling_triangles(extent, 89, 150000, 16.0f);
    for (const vp::coverage rule : both_rules)
        for (const bool count_voxels : {false, true})
            expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid(extent), vp::passthrough{}, vp::constant(true),
                                                            vp::voxelize_options{rule, count_voxels});
    expect_same_lists<void>(m, box_grid(extent), vp::passthrough{}, vp::constant(true),
                            vp::voxelize_options{vp::coverage::thin, true});
}

// Few triangles in a bit grid too large for an occupancy mask: bitwise or and and in place, onto loaded targets.
TEST(Immediate, FewTrianglesInManyBitsGiveTheCpusBytes) {
    const glm::ivec3 extent(250, 200, 256);
    mesh_data m = middling_triangles(extent, 88);
    m.triangles.resize(300);
    for (const vp::coverage rule : both_rules) {
        const vp::voxelize_options options{rule, false};
        const vp::grid g = box_grid(extent);
        expect_same<vp::target<vp::bit, blend::bit_and>>(m, g, vp::passthrough{}, vp::constant(false), options,
                                                         start::load);
        expect_same<vp::target<vp::bit, blend::bit_or>>(m, g, vp::passthrough{}, vp::constant(true), options,
                                                        start::load);
        expect_same(target_list<vp::target<vp::bit, blend::bit_and>, vp::target<vp::bit, blend::bit_or>>{}, m, g,
                    vp::passthrough{}, vp::constant(false, true), options, start::load);
    }
}

// As many as there are kept set-ups, some of which are not split, and more: then no set-up is kept, and each work item
// repeats it.
TEST(Immediate, MoreLargeTrianglesThanKeptSetUpsGiveTheCpusBytes) {
    constexpr auto most = static_cast<int>(vp::tuning::max_setups);
    const glm::ivec3 extent(150, 160, 140);
    for (const int count : {most, most + most / 4}) {
        const mesh_data m = long_triangles(extent, count, 88);
        for (const vp::coverage rule : both_rules)
            expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid(extent), vp::passthrough{}, vp::constant(true),
                                                            vp::voxelize_options{rule, false});
    }
}

// Many triangles for their grid (may_be_close), of which a warp's lie within two, three or five voxels, over a grid
// whose rows are more than a word long, at its faces and beyond them; one in some batches is longer, lies apart or has
// no area.
TEST(Immediate, CloseTrianglesGiveTheCpusBytes) {
    const glm::ivec3 extent(70, 30, 24);
    std::mt19937 random(91);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    const auto vector = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
    mesh_data m;
    for (int batch = 0; batch < 900; ++batch) {
        const float reach = batch % 3 == 0 ? 0.6f : batch % 3 == 1 ? 1.4f : 2.5f;
        const glm::vec3 corner = vector() * glm::vec3(extent + 2) - 1.5f; // most of the grid stays empty
        for (int i = 0; i < 32; ++i) {
            const glm::vec3 a = corner + reach * vector(), b = a + 0.7f * vector();
            const bool is_odd = i == batch % 41;
            const glm::vec3 c = !is_odd          ? a + 0.7f * vector()
                                : batch % 4 == 0 ? a + 4.0f * vector()
                                : batch % 4 == 1 ? a
                                : batch % 4 == 2 ? a + 9.0f * vector()
                                                 : a + 100.0f;
            add_triangle(m, a, b, c);
        }
    }
    ASSERT_TRUE(vp::device::may_be_close(static_cast<std::uint32_t>(m.triangles.size()), extent));
    for (const vp::coverage rule : both_rules)
        for (const bool counts : {false, true})
            for (const start how : {start::clear, start::load})
                expect_same<vp::target<vp::bit, blend::bit_or>>(m, box_grid(extent), vp::passthrough{},
                                                                vp::constant(true), {rule, counts}, how);
}

} // namespace
