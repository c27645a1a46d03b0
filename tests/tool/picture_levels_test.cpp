// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Pictures are kept at the resolution that the voxels need, and the voxels have the colours of the whole pictures.
#include <draw/mip_levels.hpp>
#include <draw/picture_levels.hpp>

#include <gtest/gtest.h>

#include <glm/gtc/type_precision.hpp>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

namespace {

using namespace voxelize;

constexpr std::uint32_t side = 1024; // texels of the picture

// Triangles of every direction, each with a corner of the picture a thirtieth of its side or more, at two places, one
// of which mirrors.
scene textured_triangles(alpha_mode alpha) {
    scene model;
    model.materials.resize(1);
    model.materials[0].texture = 0;
    model.materials[0].alpha = alpha;
    model.textures.resize(1);
    model.images.resize(1);
    model.images[0].width = model.images[0].height = side;
    std::mt19937 random(11);
    for (std::size_t i = 0; i < std::size_t{4} * side * side; ++i)
        model.images[0].rgba.push_back(static_cast<std::uint8_t>(random() & 255U));
    std::uniform_real_distribution<float> anywhere(0.0F, 1.0F);
    primitive part;
    for (std::uint32_t t = 0; t < 40; ++t) {
        const glm::vec3 first(anywhere(random), anywhere(random), anywhere(random));
        const glm::vec2 corner(anywhere(random), anywhere(random));
        const float texels = 0.03F + 0.3F * anywhere(random);
        for (int i = 0; i < 3; ++i) {
            part.positions.push_back(first + 0.3F * glm::vec3(anywhere(random), anywhere(random), anywhere(random)));
            part.texcoords.push_back(corner + texels * glm::vec2(i == 1 ? 1 : 0, i == 2 ? 1 : 0));
        }
        part.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    model.primitives.push_back(part);
    affine mirrored;
    mirrored.m[0][0] = -1;
    model.instances = {{0, affine{}}, {0, mirrored}};
    return model;
}

struct drawn {
    std::vector<channel_bytes> colors;
    int first_level = 0;

    drawn(scene model, int resolution, blend_alpha alpha, bool reduces) {
        grid_request wanted;
        wanted.resolution = resolution;
        voxelize_request request;
        request.targets = {target::color, target::color_max, target::color_replace, target::color_outer};
        request.alpha = alpha;
        request.backend = backend_choice::cpu;
        request.threads = 2;
        request.grid = place_grid(wanted, bounds_of(model));
        if (reduces) picture_reducer{wanted, request}(model, model.images[0], {0});
        EXPECT_EQ(reduces, model.images[0].rgba.empty());
        first_level = model.images[0].first_level;
        voxelize_stats stats;
        for (channel& c : run_voxelizer(std::move(model), request, stats).channels) colors.push_back(std::move(c.data));
        EXPECT_NE(0U, stats.voxels);
    }
};

TEST(PictureLevels, ReducedPicturesGiveTheBytesOfWholeOnes) {
    int greatest = 0;
    for (const alpha_mode alpha : {alpha_mode::opaque, alpha_mode::blend}) {
        const scene model = textured_triangles(alpha);
        int before = mip_level_count(side, side);
        for (const int resolution : {2, 5, 16, 64}) {
            const drawn whole(model, resolution, blend_alpha::weight, false);
            const drawn reduced(model, resolution, blend_alpha::weight, true);
            EXPECT_TRUE(whole.colors == reduced.colors) << resolution;
            EXPECT_LE(reduced.first_level, before) << resolution;
            before = reduced.first_level;
            greatest = std::max(greatest, reduced.first_level);
        }
    }
    EXPECT_LE(3, greatest);
}

// A mask is sampled in level 0 whatever the voxel's size.
TEST(PictureLevels, MasksKeepTheWholePicture) {
    EXPECT_EQ(0, drawn(textured_triangles(alpha_mode::mask), 2, blend_alpha::weight, true).first_level);
    const scene blended = textured_triangles(alpha_mode::blend);
    const drawn reduced(blended, 2, blend_alpha::cutoff, true);
    EXPECT_EQ(0, reduced.first_level);
    EXPECT_TRUE(drawn(blended, 2, blend_alpha::cutoff, false).colors == reduced.colors);
}

// The finest triangle of the materials asked about decides, others do not.
TEST(PictureLevels, TheFinestTriangleDecides) {
    scene model;
    model.materials.resize(2);
    const auto add_square = [&](float size, std::uint32_t material) {
        primitive part;
        part.positions = {{0, 0, 0}, {size, 0, 0}, {size, size, 0}};
        part.texcoords = {{0, 0}, {1, 0}, {1, 1}};
        part.triangles = {{0, 1, 2}};
        part.material = material;
        model.instances.push_back({static_cast<std::uint32_t>(model.primitives.size()), affine{}});
        model.primitives.push_back(part);
    };
    add_square(8, 0);
    voxelpipe::grid grid;
    grid.extent = {64, 64, 1};
    grid.voxel_size = glm::dvec3(1);
    EXPECT_EQ(7, first_sampled_level(model, 1024, 1024, {0}, grid, 1)); // 128 texels a voxel
    add_square(64, 1);
    EXPECT_EQ(7, first_sampled_level(model, 1024, 1024, {0}, grid, 1));
    EXPECT_EQ(4, first_sampled_level(model, 1024, 1024, {0, 1}, grid, 1)); // 16
    model.instances[1].to_world = affine::scaling(1000);
    EXPECT_EQ(0, first_sampled_level(model, 1024, 1024, {0, 1}, grid, 1));
}

} // namespace
