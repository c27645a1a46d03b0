// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The tool's shading, piece by piece: sRGB tables, texture sampling, the nearest point of a triangle.
#include <draw/surface.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace {

namespace vp = voxelpipe;
using voxelize::color_tables;
using voxelize::filter_mode;
using voxelize::sampled_texture;
using voxelize::wrap_mode;

const color_tables tables = voxelize::make_color_tables();

TEST(Srgb, BytesSurviveTheRoundTrip) {
    for (int byte = 0; byte < 256; ++byte) {
        EXPECT_EQ(byte, voxelize::encode_srgb(tables, tables.linear[byte]));
        EXPECT_EQ(byte, voxelize::encode_fraction(tables.fraction[byte]));
    }
}

// Against the formula of IEC 61966-2-1, in double.
TEST(Srgb, EncodingIsTheNearestByte) {
    for (int i = 0; i <= 100000; ++i) {
        const double linear = i / 100000.0;
        const double encoded = 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
        const int byte = voxelize::encode_srgb(tables, static_cast<float>(linear));
        EXPECT_LE(std::abs(byte - encoded), 0.5 + 1e-3) << linear;
    }
}

TEST(Srgb, ValuesOutsideGetTheNearestByte) {
    EXPECT_EQ(0, voxelize::encode_srgb(tables, -1));
    EXPECT_EQ(255, voxelize::encode_srgb(tables, 7));
    EXPECT_EQ(0, voxelize::encode_srgb(tables, std::numeric_limits<float>::quiet_NaN()));
}

// Alpha of 0, 51, 102, ... 255 in six texels of one row, or column.
const glm::u8vec4 ramp[6]{{0, 0, 0, 0}, {0, 0, 0, 51}, {0, 0, 0, 102}, {0, 0, 0, 153}, {0, 0, 0, 204}, {0, 0, 0, 255}};

float alpha(filter_mode filter, wrap_mode wrap, float u) {
    const sampled_texture row{ramp, 6, 1, wrap, wrap_mode::repeat, filter};
    const sampled_texture column{ramp, 1, 6, wrap_mode::repeat, wrap, filter};
    const float a = voxelize::sample(row, tables, {u, 0.3F}).a;
    EXPECT_EQ(a, voxelize::sample(column, tables, {0.7F, u}).a);
    return a;
}

TEST(Sample, NearestTakesTheTexelUnderTheSample) {
    for (int i = 0; i < 6; ++i)
        for (const float inside : {0.01F, 0.5F, 0.99F})
            EXPECT_FLOAT_EQ(0.2F * static_cast<float>(i),
                            alpha(filter_mode::nearest, wrap_mode::repeat, (static_cast<float>(i) + inside) / 6));
}

TEST(Sample, LinearMeetsTexelsAtTheirCentres) {
    for (int i = 0; i < 6; ++i)
        EXPECT_NEAR(0.2F * static_cast<float>(i),
                    alpha(filter_mode::linear, wrap_mode::clamp_to_edge, (static_cast<float>(i) + 0.5F) / 6), 1e-6F);
    EXPECT_NEAR(0.3F, alpha(filter_mode::linear, wrap_mode::clamp_to_edge, 2.0F / 6), 1e-6F); // between two
}

TEST(Sample, WrapModes) {
    using enum wrap_mode;
    const auto nearest = [](wrap_mode wrap, float u) { return std::lround(5 * alpha(filter_mode::nearest, wrap, u)); };
    const float texel = 1.0F / 6;
    EXPECT_EQ(0, nearest(clamp_to_edge, -3.2F));
    EXPECT_EQ(5, nearest(clamp_to_edge, 9));
    EXPECT_EQ(5, nearest(clamp_to_edge, 1));
    EXPECT_EQ(1, nearest(repeat, 3 + 1.5F * texel));
    EXPECT_EQ(5, nearest(repeat, -0.5F * texel));
    EXPECT_EQ(0, nearest(repeat, 1));
    EXPECT_EQ(0, nearest(mirrored_repeat, -0.5F * texel));
    EXPECT_EQ(2, nearest(mirrored_repeat, -2.5F * texel));
    EXPECT_EQ(5, nearest(mirrored_repeat, 1 + 0.5F * texel));
    EXPECT_EQ(1, nearest(mirrored_repeat, 2 + 1.5F * texel));
    // Across the seam: the two ends of the row, or the edge texel twice.
    EXPECT_NEAR(0.5F, alpha(filter_mode::linear, repeat, 0), 1e-6F);
    EXPECT_NEAR(0.5F, alpha(filter_mode::linear, repeat, 1), 1e-6F);
    EXPECT_EQ(0, alpha(filter_mode::linear, mirrored_repeat, 0));
    EXPECT_EQ(1, alpha(filter_mode::linear, mirrored_repeat, 1));
}

// No coordinate leads outside the picture; a sanitizer watches the reads.
TEST(Sample, AnyCoordinateIsSafe) {
    for (const wrap_mode wrap : {wrap_mode::repeat, wrap_mode::clamp_to_edge, wrap_mode::mirrored_repeat})
        for (const filter_mode filter : {filter_mode::nearest, filter_mode::linear})
            for (const float u : {0.0F, -0.0F, 1.0F, -1e-9F, -1e-38F, 0.99999994F, 1e9F, -1e9F, 3.4e38F, -3.4e38F,
                                  std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                                  std::numeric_limits<float>::quiet_NaN()}) {
                const float a = alpha(filter, wrap, u);
                EXPECT_TRUE(a >= 0 && a <= 1) << u;
            }
}

TEST(Sample, ColoursAreMixedInLinearLight) {
    const glm::u8vec4 two[2]{{0, 0, 0, 255}, {255, 255, 255, 255}};
    const sampled_texture texture{two, 2, 1, wrap_mode::clamp_to_edge, wrap_mode::clamp_to_edge, filter_mode::linear};
    EXPECT_EQ(188, voxelize::encode(tables, voxelize::sample(texture, tables, {0.5F, 0.5F})).r);
}

// A triangle seen along z whose vertices carry their position as texture coordinates too.
struct sliver {
    voxelize::surface_varyings vertices[3];
    explicit sliver(glm::vec2 a, glm::vec2 b, glm::vec2 c) {
        const glm::vec2 corners[3]{a, b, c};
        for (int i = 0; i < 3; ++i) vertices[i] = {corners[i], glm::vec4(1), glm::vec3(corners[i], 0)};
    }
    // The texture coordinate that the voxel (x, y, 0) of a unit grid gets.
    [[nodiscard]] glm::vec2 at(int x, int y) const {
        vp::fragment<voxelize::surface_varyings> f{};
        f.axis = 2;
        f.voxel = {x, y, 0};
        const glm::dvec2 p(x + 0.5, y + 0.5);
        const glm::dvec2 a(vertices[0].position), b(vertices[1].position), c(vertices[2].position);
        const auto cross = [](glm::dvec2 u, glm::dvec2 v) { return u.x * v.y - u.y * v.x; };
        const double area = cross(b - a, c - a);
        f.barycentric = glm::vec3(cross(b - p, c - p) / area, cross(c - p, a - p) / area, cross(a - p, b - p) / area);
        f.varyings.texcoord = {-1, -1}; // recognisable
        for (int i = 0; i < 3; ++i) f.vertex_varyings[i] = &vertices[i];
        return voxelize::nearest_on_triangle(f, {}).texcoord;
    }
};

TEST(NearestOnTriangle, InsideItIsThePointItself) {
    EXPECT_EQ(glm::vec2(-1, -1), sliver({0, 0}, {9, 0}, {0, 9}).at(1, 1)); // the interpolated varyings
}

TEST(NearestOnTriangle, BesideAnEdgeItIsTheFootOnIt) {
    const sliver t({0, 0}, {9, 0}, {0, 9});
    EXPECT_LT(glm::length(t.at(3, -1) - glm::vec2(3.5F, 0)), 1e-6F);
    EXPECT_LT(glm::length(t.at(-1, 6) - glm::vec2(0, 6.5F)), 1e-6F);
    EXPECT_LT(glm::length(t.at(5, 5) - glm::vec2(4.5F, 4.5F)), 1e-6F);
}

TEST(NearestOnTriangle, BeyondACornerItIsTheCorner) {
    const sliver t({0, 0}, {9, 0}, {0, 9});
    EXPECT_EQ(glm::vec2(0, 0), t.at(-2, -3));
    EXPECT_EQ(glm::vec2(9, 0), t.at(12, -1));
}

TEST(NearestOnTriangle, ASliverKeepsItsLength) {
    // 100 long and a hundredth high: cut-off weights would give one of its ends.
    const sliver t({0, 0.9F}, {100, 0.9F}, {50, 0.91F});
    for (int x = 5; x < 95; x += 10) EXPECT_NEAR(static_cast<float>(x) + 0.5F, t.at(x, 0).x, 1e-2F) << x;
}

} // namespace
