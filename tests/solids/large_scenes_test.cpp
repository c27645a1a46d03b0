// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "scenes.hpp"

#include <utility>

namespace solids {
namespace {

TEST(SolidScenes, DragonIsClosedAndTheSameUnderEveryRule) {
    std::string why;
    const auto dragon = load_scene("dragon", why);
    if (!dragon) GTEST_SKIP() << why;
    EXPECT_EQ(status_of_bits(*dragon, 512, {}).counts.voxels, 7458944u);
    const vp::status nonzero = status_of_bits(*dragon, 1024, {});
    EXPECT_EQ(nonzero.counts.voxels, status_of_bits(*dragon, 1024, {.rule = vp::fill_rule::even_odd}).counts.voxels);
    EXPECT_EQ(nonzero.solid.open_rows, 0u);
}

TEST(SolidScenes, BladeAndAsianDragonAreClosed) {
    for (const char* name : {"blade", "asiandragon"}) {
        std::string why;
        const auto m = load_scene(name, why);
        if (!m) GTEST_SKIP() << why;
        for (const int n : {128, 1024}) EXPECT_EQ(status_of_bits(*m, n, {}).solid.open_rows, 0u) << name << ' ' << n;
    }
}

TEST(SolidScenes, ConferenceIsOpen) {
    std::string why;
    const auto conference = load_scene("conference", why);
    if (!conference) GTEST_SKIP() << why;
    EXPECT_EQ(status_of_bits(*conference, 1024, {.rule = vp::fill_rule::even_odd}).solid.open_rows, 73303u);
    EXPECT_EQ(status_of_bits(*conference, 1024, {}).solid.open_rows, 74566u);
}

TEST(SolidScenes, DragonsSurfaceHasTheKnownNumbersOfVoxels) {
    std::string why;
    const auto dragon = load_scene("dragon", why);
    if (!dragon) GTEST_SKIP() << why;
    vp::cpu_backend backend{2};
    const vp::grid g = vp::fit(dragon->positions, glm::ivec3(1024));
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{backend, g.extent};
    for (const auto& [rule, voxels] : {std::pair{vp::coverage::thin, 1599388u}, {vp::coverage::crosshair, 1528449u}})
        EXPECT_EQ(vp::voxelize(backend, dragon->view(), g, vp::passthrough{}, vp::constant(true), fb, rule)
                      .or_throw()
                      .counts.voxels,
                  voxels);
}

} // namespace
} // namespace solids
