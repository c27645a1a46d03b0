// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Textures at the size of voxels: the levels, the footprint that chooses among them, and what a side of the grid sees.
#include <draw/mip_levels.hpp>
#include <draw/outside.hpp>
#include <draw/surface.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

namespace vp = voxelpipe;
using voxelize::color_tables;
using voxelize::picture;
using voxelize::sampled_texture;

const color_tables tables = voxelize::make_color_tables();

picture random_picture(std::uint32_t width, std::uint32_t height) {
    picture result{"", width, height, {}, 0, {}};
    std::mt19937 random(width * 7919 + height);
    for (std::size_t i = 0; i < std::size_t{4} * width * height; ++i)
        result.rgba.push_back(static_cast<std::uint8_t>(random() & 255U));
    return result;
}

// Mean of the picture in linear light, in double; by alpha or alike.
glm::dvec4 mean_of(const picture& p, bool by_alpha) {
    glm::dvec4 sum(0);
    double weights = 0;
    for (std::size_t i = 0; i < p.rgba.size(); i += 4) {
        const double weight = by_alpha ? p.rgba[i + 3] / 255.0 : 1.0;
        weights += weight;
        for (int c = 0; c < 3; ++c)
            sum[c] += weight * static_cast<double>(tables.linear[p.rgba[i + static_cast<std::size_t>(c)]]);
        sum.a += p.rgba[i + 3] / 255.0;
    }
    return {glm::dvec3(sum) / weights, sum.a / (static_cast<double>(p.rgba.size()) / 4)};
}

TEST(MipLevels, TheLastTexelIsTheMeanOfThePicture) {
    for (const auto& [width, height] :
         {std::pair{1U, 1U}, {2U, 2U}, {64U, 64U}, {5U, 3U}, {37U, 100U}, {1U, 77U}, {255U, 2U}})
        for (const bool by_alpha : {false, true}) {
            const picture source = random_picture(width, height);
            const auto texels = voxelize::with_mip_levels(source, by_alpha, 2);
            const glm::u8vec4 last = texels.back();
            const glm::dvec4 mean = mean_of(source, by_alpha);
            const glm::u8vec4 expected = voxelize::encode(tables, glm::vec4(mean));
            for (int c = 0; c < 4; ++c)
                EXPECT_NEAR(expected[c], last[c], 1) << width << ' ' << height << ' ' << by_alpha;
        }
}

TEST(MipLevels, LevelsLieOneAfterTheOther) {
    const picture source = random_picture(13, 4);
    const auto texels = voxelize::with_mip_levels(source, false, 1);
    EXPECT_EQ(4, voxelize::mip_level_count(13, 4));
    EXPECT_EQ(13U * 4 + 6 * 2 + 3 * 1 + 1 * 1, texels.size());
    for (std::size_t i = 0; i < source.rgba.size(); ++i)
        EXPECT_EQ(source.rgba[i], texels[i / 4][static_cast<int>(i % 4)]);
    sampled_texture t{texels.data(), 13, 4};
    t.levels = 4;
    const sampled_texture third = voxelize::level_of(t, 2);
    EXPECT_EQ(3, third.width);
    EXPECT_EQ(1, third.height);
    EXPECT_EQ(texels.data() + 13 * 4 + 6 * 2, third.texels);
}

TEST(MipLevels, ALaterFirstLevelLeavesOutTheLevelsBefore) {
    for (const auto& [width, height] : {std::pair{64, 64}, {13, 4}, {1, 9}}) {
        const picture source = random_picture(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
        for (const bool by_alpha : {false, true}) {
            const auto all = voxelize::with_mip_levels(source, by_alpha, 1);
            std::size_t offset = 0;
            for (int first = 0, w = width, h = height; first < voxelize::mip_level_count(source.width, source.height);
                 ++first, w = std::max(w / 2, 1), h = std::max(h / 2, 1)) {
                const auto some = voxelize::with_mip_levels(source, by_alpha, 1, first);
                ASSERT_EQ(all.size() - offset, some.size());
                EXPECT_TRUE(std::equal(some.begin(), some.end(), all.begin() + static_cast<std::ptrdiff_t>(offset)));
                sampled_texture whole{all.data(), width, height}, cut{some.data(), width, height};
                cut.first_level = first;
                EXPECT_EQ(voxelize::level_of(whole, first).texels - all.data() - static_cast<std::ptrdiff_t>(offset),
                          voxelize::level_of(cut, first).texels - some.data());
                offset += static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
            }
        }
    }
}

TEST(MipLevels, InvisibleTexelsDoNotColourVisibleOnes) {
    const picture source{"", 2, 1, {255, 0, 0, 255, 0, 255, 0, 0}, 0, {}};
    EXPECT_EQ(glm::u8vec4(255, 0, 0, 128), voxelize::with_mip_levels(source, true, 1).back());
    EXPECT_EQ(glm::u8vec4(188, 188, 0, 128), voxelize::with_mip_levels(source, false, 1).back());
    const picture none{"", 2, 1, {255, 0, 0, 0, 0, 255, 0, 0}, 0, {}};
    EXPECT_EQ(glm::u8vec4(188, 188, 0, 0), voxelize::with_mip_levels(none, true, 1).back());
}

TEST(MipLevels, ThreadsChangeNothing) {
    const picture source = random_picture(300, 211);
    for (const bool by_alpha : {false, true})
        EXPECT_TRUE(voxelize::with_mip_levels(source, by_alpha, 1) == voxelize::with_mip_levels(source, by_alpha, 7));
}

// Between two levels the colour moves evenly, and it never jumps.
TEST(Footprint, SamplesBetweenLevels) {
    std::vector<glm::u8vec4> texels; // alpha is the level: 0, 85, 170, 255
    for (int level = 0, side = 8; level < 4; ++level, side /= 2)
        texels.insert(texels.end(), static_cast<std::size_t>(side) * static_cast<std::size_t>(side),
                      glm::u8vec4(0, 0, 0, 85 * level));
    sampled_texture t{texels.data(), 8, 8};
    t.levels = 4;
    const auto level_at = [&](float footprint) {
        return 3 * voxelize::sample_footprint(t, tables, {0.3F, 0.6F}, footprint).a;
    };
    for (const float footprint : {0.0F, 0.5F, 1.0F, -1.0F, std::nanf("")})
        EXPECT_EQ(0, level_at(footprint)) << footprint;
    EXPECT_NEAR(0.5F, level_at(1.5F), 1e-6F);
    EXPECT_NEAR(1.0F, level_at(2.0F), 1e-6F);
    EXPECT_NEAR(1.25F, level_at(2.5F), 1e-6F);
    EXPECT_NEAR(2.75F, level_at(7.0F), 1e-6F);
    for (const float footprint : {8.0F, 9.0F, 1e9F, INFINITY}) EXPECT_EQ(3, level_at(footprint)) << footprint;
    float before = 0;
    for (float footprint = 1; footprint < 20; footprint += 0.01F) {
        EXPECT_GE(level_at(footprint), before - 1e-6F);
        EXPECT_LE(level_at(footprint), before + 0.02F);
        before = level_at(footprint);
    }
}

// A triangle seen along AXIS with its legs along the other two.
float footprint_of(int axis, glm::vec2 legs, glm::vec2 texels, const glm::dvec3& voxel) {
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    voxelize::surface_varyings vertices[3]{};
    vertices[1].position[u] = legs.x;
    vertices[2].position[v] = legs.y;
    vertices[1].texcoord = {texels.x / 256, 0};
    vertices[2].texcoord = {0, texels.y / 512};
    vp::fragment<voxelize::surface_varyings> f{};
    f.axis = axis;
    for (int i = 0; i < 3; ++i) f.vertex_varyings[i] = &vertices[i];
    const sampled_texture t{nullptr, 256, 512};
    return voxelize::texture_footprint(f, {glm::dvec3(0), voxel}, t);
}

TEST(Footprint, IsTheVoxelInTexels) {
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 voxel(0.5);
        EXPECT_FLOAT_EQ(4, footprint_of(axis, {10, 10}, {80, 80}, voxel)) << axis;
        EXPECT_FLOAT_EQ(4, footprint_of(axis, {10, -20}, {80, 80}, voxel)) << axis;
        EXPECT_FLOAT_EQ(8, footprint_of(axis, {10, 5}, {80, 80}, voxel)) << axis;
        voxel[axis == 0 ? 1 : 0] = 2; // along u
        EXPECT_FLOAT_EQ(16, footprint_of(axis, {10, 10}, {80, 80}, voxel)) << axis;
        voxel[axis] = 1e6; // along the line of sight: nothing to do with it
        EXPECT_FLOAT_EQ(16, footprint_of(axis, {10, 10}, {80, 80}, voxel)) << axis;
    }
}

TEST(Footprint, EndsAtTheTriangle) {
    EXPECT_FLOAT_EQ(5, footprint_of(2, {0.1F, 0.1F}, {3, 4}, glm::dvec3(100)));
    EXPECT_GE(1, footprint_of(2, {1, 1}, {0.3F, 0.4F}, glm::dvec3(100)));
    EXPECT_FLOAT_EQ(1, footprint_of(2, {0, 1}, {80, 80}, glm::dvec3(1))); // no area
}

TEST(Outside, ASideSeesTheFirstVoxelOfEveryLine) {
    voxelize::volume v;
    v.extent = {70, 9, 7};
    voxelize::channel& bits = v.add("occupancy", voxelize::scalar::bit);
    std::mt19937 random(5);
    for (std::int64_t k = 0; k < 7; ++k)
        for (std::int64_t j = 0; j < 9; ++j)
            for (std::int64_t i = 0; i < 70; ++i) v.set_bit(bits, i, j, k, random() % 5 == 0);
    const glm::ivec3 low(3, 0, 100);
    const voxelize::column_table columns = voxelize::columns_of(v, bits, low, 3),
                                 alone = voxelize::columns_of(v, bits, low, 1);
    for (std::int64_t k = 0; k < 7; ++k)
        for (std::int64_t j = 0; j < 9; ++j)
            for (std::int64_t i = 0; i < 70; ++i) {
                int expected = 0;
                for (int side = 0; v.bit(bits, i, j, k) && side < 6; ++side) {
                    std::array<std::int64_t, 3> at{i, j, k};
                    const auto a = static_cast<std::size_t>(side / 2);
                    bool free = true;
                    for (at[a] += side % 2 != 0 ? 1 : -1; at[a] >= 0 && at[a] < v.extent[a];
                         at[a] += side % 2 != 0 ? 1 : -1)
                        free = free && !v.bit(bits, at[0], at[1], at[2]);
                    expected |= free ? 1 << side : 0;
                }
                if (!v.bit(bits, i, j, k)) continue;
                const glm::ivec3 voxel = low + glm::ivec3(i, j, k);
                ASSERT_EQ(expected, columns.view().sides_that_see(voxel)) << i << ' ' << j << ' ' << k;
                ASSERT_EQ(expected, alone.view().sides_that_see(voxel)) << i << ' ' << j << ' ' << k;
            }
}

} // namespace
