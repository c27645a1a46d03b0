// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Models far from the origin: node transforms lose no digit on their way to the grid, and digits that the file itself
// has not are a warning.
#include "tool_test.hpp"

#include <model/placement.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

using namespace tool_test;

namespace {

// A sphere of radius 2 around CENTER, positions rounded to float there.
void add_sphere(builder& file, const glm::dvec3& center = glm::dvec3(0)) {
    constexpr int rings = 24;
    constexpr int around = 48;
    std::vector<float> positions;
    std::vector<std::uint16_t> indices;
    for (int ring = 0; ring <= rings; ++ring) {
        for (int step = 0; step < around; ++step) {
            const double polar = std::numbers::pi * ring / rings;
            const double turn = 2 * std::numbers::pi * step / around;
            const glm::dvec3 p = center + 2.0 * glm::dvec3(std::sin(polar) * std::cos(turn), std::cos(polar),
                                                           std::sin(polar) * std::sin(turn));
            for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(p[axis]));
            if (ring == rings) continue;
            const int next = (step + 1) % around;
            for (const int corner : {ring * around + step, ring * around + next, (ring + 1) * around + step,
                                     ring * around + next, (ring + 1) * around + next, (ring + 1) * around + step})
                indices.push_back(static_cast<std::uint16_t>(corner));
        }
    }
    const int index_accessor = file.accessor(indices, "SCALAR");
    file.mesh({{"POSITION", file.accessor(positions, "VEC3")}})["indices"] = index_accessor;
}

struct result {
    tool_test::array bits; // a byte for each voxel
    json stats;
    std::string warnings;
};

// Voxels that one of the two covers and the other does not. Positions are rounded to float at two positions of the
// world, so that a vertex may be snapped to the neighbouring of 65536 positions a voxel: a voxel that a triangle just
// touches may come or go.
std::size_t differing(const result& a, const result& b) {
    EXPECT_EQ(a.bits.shape, b.bits.shape);
    EXPECT_LT(2000, a.stats["voxels"]);
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.bits.voxels(); ++i) count += a.bits.at<std::uint8_t>(i) != b.bits.at<std::uint8_t>(i);
    return count;
}

result voxelized(const builder& file, std::vector<std::string> how) {
    const scratch_folder folder;
    file.write_glb(folder / "m.glb");
    how.insert(how.begin(), {folder / "m.glb", "-o", folder / "o.npy", "--stats=json", "--backend", "cpu"});
    const outcome done = run(folder, how);
    EXPECT_EQ(0, done.code) << done.err;
    const json stats = json::parse(done.out);
    return {read_npy(folder / "o.npy"), stats, stats["warnings"].dump()};
}

TEST(Coordinates, ATranslationOfMillionsKeepsEveryVoxel) {
    builder near;
    add_sphere(near);
    for (const glm::dvec3& away :
         {glm::dvec3(4186130.25, 834966.5, 4723771.75), glm::dvec3(-6.4e6, 1e5, 3), glm::dvec3(3e7, 0, 0)}) {
        builder far;
        add_sphere(far);
        far.root["nodes"][0]["translation"] = {away.x, away.y, away.z};
        for (const char* coverage : {"conservative", "thin"}) {
            const result expected = voxelized(near, {"-r", "64", "--coverage", coverage});
            const result found = voxelized(far, {"-r", "64", "--coverage", coverage});
            EXPECT_GE(2U, differing(expected, found)) << away.x << ' ' << coverage;
            EXPECT_EQ("[]", found.warnings);
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_NEAR(expected.stats["grid"]["origin"][static_cast<std::size_t>(axis)].get<double>() + away[axis],
                            found.stats["grid"]["origin"][static_cast<std::size_t>(axis)], 1e-8);
        }
    }
}

// Translations that cancel along a chain, turns and unequal scales between them.
TEST(Coordinates, DeepHierarchiesAndUnequalScalesKeepEveryVoxel) {
    builder plain;
    add_sphere(plain);
    plain.root["nodes"][0]["scale"] = {3, 0.5, 0.25};
    builder deep;
    add_sphere(deep);
    json& nodes = deep.root["nodes"];
    nodes = json::array();
    nodes.push_back({{"translation", {1e7, -2e7, 5e6}}, {"children", {1}}});
    for (int i = 1; i <= 40; ++i)
        nodes.push_back(
            {{"translation", {i % 2 != 0 ? 1e8 : -1e8, 3e7 * (i % 2 != 0 ? 1 : -1), 0}}, {"children", {i + 1}}});
    nodes.push_back({{"scale", {3, 0.5, 0.25}}, {"mesh", 0}});
    const std::vector<std::string> how{"-r", "80"};
    EXPECT_GE(2U, differing(voxelized(plain, how), voxelized(deep, how)));
}

TEST(Coordinates, AnExactGridFarAwayIsFilledAsOneNearby) {
    builder near;
    add_sphere(near);
    builder far;
    add_sphere(far);
    far.root["nodes"][0]["translation"] = {4000000, 0, -8000000};
    const result expected = voxelized(near, {"--origin=-2,-2,-2", "-s", "0.0625", "--extent", "64,64,40"});
    const result found = voxelized(far, {"--origin=3999998,-2,-8000002", "-s", "0.0625", "--extent", "64,64,40"});
    EXPECT_GE(2U, differing(expected, found));
}

// One mesh, shown plain and mirrored: normals look outwards from both.
TEST(Coordinates, MirroringKeepsFrontsInFront) {
    const scratch_folder folder;
    const auto check = [&](const std::vector<std::vector<double>>& scales,
                           const std::vector<std::vector<double>>& translations) {
        builder file;
        gltf_test::add_cube(file, {0, 0, 0}, 1, gltf_test::add_material(file, {1, 1, 1, 1}));
        file.root["nodes"] = json::array();
        for (std::size_t i = 0; i < scales.size(); ++i)
            file.append("nodes", {{"mesh", 0}, {"scale", scales[i]}, {"translation", translations[i]}});
        file.write_glb(folder / "m.glb");
        const outcome done = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", "normal", "--origin=0,0,0",
                                          "-s", "0.25", "--extent", "12,4,4", "--backend", "cpu"});
        ASSERT_EQ(0, done.code) << done.err;
        const tool_test::array normals = read_npy(folder / "o.npy");
        for (const int left : {0, 8}) {
            for (int axis = 0; axis < 3; ++axis) {
                for (const int side : {0, 3}) { // the middle of a face, where no other is near
                    glm::ivec3 at(1);
                    at[axis] = side;
                    const auto i = static_cast<std::size_t>((at.z * 4 + at.y) * 12 + at.x + left);
                    glm::vec3 outwards(0);
                    outwards[axis] = side == 0 ? -1.0F : 1.0F;
                    EXPECT_EQ(outwards, normals.at<glm::vec3>(i)) << left << ' ' << axis << ' ' << side;
                }
            }
        }
    };
    check({{1, 1, 1}, {1, 1, 1}}, {{0, 0, 0}, {2, 0, 0}});
    check({{1, 1, 1}, {-1, 1, 1}}, {{0, 0, 0}, {3, 0, 0}});
    check({{-1, -1, -1}, {1, 1, -1}}, {{1, 1, 1}, {2, 0, 1}});
    check({{-1, -1, 1}, {1, -1, -1}}, {{1, 1, 0}, {2, 1, 1}});
}

TEST(Coordinates, DepthIsAWorldPosition) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_square(file, 0.25F);
    file.root["nodes"][0]["translation"] = {0, 0, 2000000};
    file.write_glb(folder / "m.glb");
    const outcome done = run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-t", "depth", "-r", "4"});
    ASSERT_EQ(0, done.code) << done.err;
    const tool_test::array depth = read_npy(folder / "o.npy");
    for (std::size_t i = 0; i < depth.voxels(); ++i) EXPECT_EQ(2000000.25F, depth.at<float>(i));
}

TEST(Coordinates, FloatsTooCoarseForTheVoxelsAreOneWarningWithTheFigures) {
    builder file;
    add_sphere(file, {4186130, 834966, 4723771});
    file.root["meshes"][0]["name"] = "globe";
    const std::string warnings = voxelized(file, {"-r", "64"}).warnings;
    for (const char* part : {"globe", "floats of up to 4.72377e+06", "lie 0.5 apart", "off by 3.99"})
        EXPECT_NE(std::string::npos, warnings.find(part)) << part << ": " << warnings;
    EXPECT_EQ(1U, json::parse(warnings).size());
    EXPECT_EQ("[]", voxelized(file, {"-s", "2"}).warnings); // a quarter of a voxel
}

TEST(Coordinates, PositionsAreRelativeToTheGridOnlyWhereFloatsAreTooCoarse) {
    voxelpipe::grid grid;
    grid.extent = glm::ivec3(256);
    EXPECT_EQ(glm::dvec3(0), voxelize::reference_point(grid));
    grid.origin = glm::dvec3(0, -256, 0);
    EXPECT_EQ(glm::dvec3(0), voxelize::reference_point(grid));
    grid.origin = glm::dvec3(0, -256.5, 0);
    EXPECT_EQ(grid.origin, voxelize::reference_point(grid));
    grid.extent = glm::ivec3(1024); // a coarser lattice
    EXPECT_EQ(glm::dvec3(0), voxelize::reference_point(grid));
}

} // namespace
