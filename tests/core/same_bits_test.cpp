// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Values are compared by their bits.

#include <voxelpipe/core/same_bits.hpp>
#include <voxelpipe/shader.hpp>

#include <glm/vec3.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <new>
#include <vector>

namespace {

namespace vp = voxelpipe;
using vp::core::has_same_bits;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

TEST(SameBits, ZerosDifferAndNansAreThemselves) {
    EXPECT_TRUE(has_same_bits(1.0f, 1.0f));
    EXPECT_FALSE(has_same_bits(0.0f, -0.0f));
    EXPECT_TRUE(has_same_bits(nan, nan));
    EXPECT_FALSE(has_same_bits(nan, -nan));
    EXPECT_TRUE(has_same_bits(true, true));
    EXPECT_FALSE(has_same_bits(std::int64_t{1} << 40, std::int64_t{0}));
    EXPECT_TRUE(has_same_bits(glm::vec3(1, nan, 3), glm::vec3(1, nan, 3)));
    EXPECT_FALSE(has_same_bits(glm::vec3(1, 2, 0.0f), glm::vec3(1, 2, -0.0f)));
}

// There are three bytes of padding behind the bool, which no constructor writes.
TEST(SameBits, PaddingBetweenValuesDoesNotMatter) {
    using values = vp::core::pack<bool, std::uint32_t>;
    static_assert(sizeof(values) == 8);
    alignas(values) unsigned char ones[sizeof(values)], zeros[sizeof(values)];
    for (unsigned char& byte : ones) byte = 0xff;
    for (unsigned char& byte : zeros) byte = 0;
    auto* const a = new (ones) values;
    auto* const b = new (zeros) values;
    a->first = b->first = true;
    vp::get<1>(*a) = vp::get<1>(*b) = 7u;
    EXPECT_TRUE(has_same_bits(*a, *b));
    vp::get<1>(*b) = 8u;
    EXPECT_FALSE(has_same_bits(*a, *b));
}

TEST(SameBits, OfAllDraws) {
    struct draw {
        vp::constant_output<bool, float> fragment_shader;
    };
    std::vector<draw> draws;
    EXPECT_TRUE(vp::core::have_same_values(draws));
    for (int i = 0; i < 3; ++i) draws.push_back({vp::constant(true, 0.0f)});
    EXPECT_TRUE(vp::core::have_same_values(draws));
    draws[2].fragment_shader = vp::constant(true, -0.0f);
    EXPECT_FALSE(vp::core::have_same_values(draws));
}

} // namespace
