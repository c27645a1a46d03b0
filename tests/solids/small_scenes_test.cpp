// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "scenes.hpp"

namespace solids {
namespace {

TEST(SolidScenes, DragonHasTheKnownNumberOfVoxels) {
    std::string why;
    const auto dragon = load_scene("dragon", why);
    if (!dragon) GTEST_SKIP() << why;
    for (const vp::fill_rule rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive}) {
        const vp::status s = status_of_bits(*dragon, 128, {.rule = rule});
        EXPECT_EQ(s.counts.voxels, 116606u);
        EXPECT_EQ(s.solid.open_rows, 0u);
    }
}

TEST(SolidScenes, BladeHasTheKnownNumberOfVoxels) {
    std::string why;
    const auto blade = load_scene("blade", why);
    if (!blade) GTEST_SKIP() << why;
    const vp::status s = status_of_bits(*blade, 128, {});
    EXPECT_EQ(s.counts.voxels, 98727u);
    EXPECT_EQ(s.solid.open_rows, 0u);
}

} // namespace
} // namespace solids
