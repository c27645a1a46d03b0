// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// field2d and field3d: their definition in rationals, wrap modes, levels, and values that stand for all machines.

#include "field_cases.hpp"

#include "test_support.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace {

namespace vp = voxelpipe;

std::vector<float> ramp(int n) {
    std::vector<float> t(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) t[static_cast<std::size_t>(i)] = static_cast<float>(i * i % 17) - 5.0f;
    return t;
}

TEST(Field, HasTexelsAtTheirCentres) {
    const std::vector<float> texels = ramp(7 * 5);
    vp::field2d<float> f{texels.data(), 7, 5};
    for (const vp::filter_mode filter : {vp::filter_mode::nearest, vp::filter_mode::linear}) {
        f.filter = filter;
        for (int y = 0; y < 5; ++y)
            for (int x = 0; x < 7; ++x)
                EXPECT_NEAR(f({(static_cast<float>(x) + 0.5f) / 7.0f, (static_cast<float>(y) + 0.5f) / 5.0f}),
                            texels[static_cast<std::size_t>(7 * y + x)], filter == vp::filter_mode::nearest ? 0 : 1e-4);
    }
    // A size that is a power of two has exact centres.
    const std::vector<float> eight = ramp(8);
    vp::field2d<float> g{eight.data(), 8, 1};
    for (int x = 0; x < 8; ++x)
        EXPECT_EQ(g({(static_cast<float>(x) + 0.5f) * 0.125f, 0.3f}), eight[static_cast<std::size_t>(x)]);
    EXPECT_EQ(g({0.5f, 0.5f}), (eight[3] + eight[4]) * 0.5f);
}

TEST(Field, Wraps) {
    const std::vector<float> texels{1, 2, 4, 8};
    vp::field2d<float> f{texels.data(), 4, 1};
    f.filter = vp::filter_mode::nearest;
    const auto at = [&](vp::wrap_mode mode, float x) {
        f.wrap_x = mode;
        return f({x, 0.0f});
    };
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    EXPECT_EQ(at(vp::wrap_mode::repeat, -0.1f), 8.0f);
    EXPECT_EQ(at(vp::wrap_mode::repeat, 2.3f), 2.0f);
    EXPECT_EQ(at(vp::wrap_mode::repeat, 1.0f), 1.0f);
    EXPECT_EQ(at(vp::wrap_mode::mirror, -0.1f), 1.0f);
    EXPECT_EQ(at(vp::wrap_mode::mirror, 1.1f), 8.0f);
    EXPECT_EQ(at(vp::wrap_mode::mirror, 2.3f), 2.0f);
    EXPECT_EQ(at(vp::wrap_mode::clamp, -7.0f), 1.0f);
    EXPECT_EQ(at(vp::wrap_mode::clamp, infinity), 8.0f);
    for (const auto mode : {vp::wrap_mode::repeat, vp::wrap_mode::mirror, vp::wrap_mode::clamp})
        EXPECT_EQ(at(mode, nan), 1.0f);
    // Linear: the border mixes with the texel across, or with itself.
    f.filter = vp::filter_mode::linear;
    EXPECT_EQ(at(vp::wrap_mode::repeat, 0.0f), 4.5f);
    EXPECT_EQ(at(vp::wrap_mode::clamp, 0.0f), 1.0f);
    EXPECT_EQ(at(vp::wrap_mode::mirror, 1.0f), 8.0f);
}

TEST(Field, LevelsAreMeansOfBoxes) {
    // The last level of a constant is the constant, that of any texels their mean, to float.
    const std::vector<float> same(std::size_t{90}, 0.1f), texels = ramp(6 * 5 * 3);
    for (const float v : vp::with_levels<float>(same, 6, 5, 3)) EXPECT_EQ(v, 0.1f);
    const std::vector<float> all = vp::with_levels<float>(texels, 6, 5, 3);
    EXPECT_EQ(vp::num_levels(6, 5, 3), 3);
    ASSERT_EQ(all.size(), 6u * 5 * 3 + 3 * 2 * 1 + 1);
    double sum = 0;
    for (const float v : texels) sum += v;
    EXPECT_NEAR(all.back(), sum / 90.0, 1e-6);
    // 5 rows onto 2: rows 0, 1 and half of 2.
    const std::vector<float> rows{1, 2, 3, 4, 5};
    const std::vector<float> halves = vp::with_levels<float>(rows, 1, 5);
    EXPECT_EQ(halves[5], (1.0f + 2.0f + 1.5f) / 2.5f);
    EXPECT_EQ(halves[6], (1.5f + 4.0f + 5.0f) / 2.5f);
    vp::field3d<float> f{all.data(), 6, 5, 3, 3};
    EXPECT_EQ(f({0.2f, 0.7f, 0.4f}, 2), all.back());
    EXPECT_EQ(f.on_level(1).width, 3);
    EXPECT_THROW((void)vp::with_levels<float>(rows, 2, 2), std::invalid_argument);
}

// The weight is x - floor(x): exact from x = 0 on, rounded once before the first texel's centre.
TEST(Field, WeightsAreExact) {
    unit::splitmix64 random(1);
    for (int i = 0; i < 20000; ++i) {
        const int size = static_cast<int>(random.between(1, 1 << random.between(1, 22)));
        const auto c = static_cast<float>(random.uniform(-3.0, 3.0));
        for (const auto mode : {vp::wrap_mode::repeat, vp::wrap_mode::mirror, vp::wrap_mode::clamp}) {
            const auto t = vp::core::find_texels(mode, vp::filter_mode::linear, c, size);
            const float x = std::fma(vp::core::wrap_coordinate(mode, c), static_cast<float>(size), -0.5f);
            const double weight = static_cast<double>(x) - std::floor(static_cast<double>(x));
            ASSERT_EQ(t.weight, static_cast<float>(weight));
            if (x >= 0.0f) {
                ASSERT_EQ(static_cast<double>(t.weight), weight);
            }
            ASSERT_GE(t.first, 0);
            ASSERT_LT(t.first, size);
            ASSERT_GE(t.second, 0);
            ASSERT_LT(t.second, size);
        }
    }
}

TEST(Field, GivesItsGoldenValues) { EXPECT_EQ(fields::digest(fields::sample_on_host()), fields::golden); }

} // namespace
