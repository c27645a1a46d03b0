// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --solid: what is inside by each rule, the values there, the extents, open models, and what does not go together.
#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <map>

using namespace tool_test;

namespace {

// The box from LOW to HIGH, its faces outward or inward; without the last SKIPPED of its 12 triangles, which close it
// at +x.
json& add_box(builder& file, const glm::vec3& low, const glm::vec3& high, bool inward = false, int skipped = 0) {
    std::vector<float> positions;
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) positions.push_back((corner >> axis & 1) != 0 ? high[axis] : low[axis]);
    std::vector<std::uint8_t> indices{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                      2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    if (inward)
        for (std::size_t t = 0; t < indices.size(); t += 3) std::swap(indices[t + 1], indices[t + 2]);
    indices.resize(indices.size() - 3 * static_cast<std::size_t>(skipped));
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    primitive["indices"] = index_accessor;
    return primitive;
}

// The number of voxels that a run covers; ARGUMENTS beside the model, the output and voxels of 1.
std::size_t covered(const scratch_folder& folder, const builder& file, const std::vector<std::string>& arguments,
                    std::string* messages = nullptr) {
    file.write_glb(folder / "m.glb");
    std::vector<std::string> all{folder / "m.glb", "-o", folder / "o.npy", "-s", "1"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const outcome result = run(folder, all);
    EXPECT_EQ(0, result.code) << result.err;
    if (messages != nullptr) *messages = result.err;
    const array voxels = read_npy(folder / "o.npy");
    std::size_t count = 0;
    for (std::size_t i = 0; i < voxels.voxels(); ++i) count += voxels.at<std::uint8_t>(i);
    return count;
}

TEST(Solid, RulesTellCavitiesAndOverlaps) {
    const scratch_folder folder;
    const auto counts = [&folder](const builder& file) {
        std::vector<std::size_t> result;
        for (const char* rule : {"even_odd", "nonzero", "positive", "each_draw"})
            result.push_back(covered(folder, file, {"--solid", rule, "--solid-extent", "centre"}));
        return result;
    };
    // A shell of 10 in which lies one of 4, its faces outward, then inward.
    for (const bool inward : {false, true}) {
        builder file;
        add_box(file, {0, 0, 0}, {10, 10, 10});
        add_box(file, {3, 3, 3}, {7, 7, 7}, inward);
        const std::size_t solid = inward ? 1000 - 64 : 1000;
        EXPECT_EQ((std::vector<std::size_t>{1000 - 64, solid, solid, 1000}), counts(file)) << inward;
    }
    // Two parts of 8 voxels a side that share 4 x 8 x 8; then the second is inside out.
    for (const bool inward : {false, true}) {
        builder file;
        add_box(file, {0, 0, 0}, {8, 8, 8});
        add_box(file, {4, 0, 0}, {12, 8, 8}, inward);
        const std::size_t rest = 512;
        EXPECT_EQ((std::vector<std::size_t>{rest, inward ? rest : 768, inward ? 256u : 768u, 768}), counts(file))
            << inward;
    }
    // A mirrored node is not inside out.
    builder file;
    add_box(file, {1, 1, 1}, {5, 5, 5});
    file.root["nodes"].back()["scale"] = {-1, 1, 1};
    EXPECT_EQ((std::vector<std::size_t>{64, 64, 64, 64}), counts(file));
}

TEST(Solid, ExtentsDifferByTheSurface) {
    const scratch_folder folder;
    builder file;
    add_box(file, {0.25F, 0.25F, 0.25F}, {9.75F, 9.75F, 9.75F}); // through the voxels of a shell, behind their centres
    EXPECT_EQ(1000U, covered(folder, file, {"--solid", "nonzero"}));
    EXPECT_EQ(1000U, covered(folder, file, {"--solid", "nonzero", "--solid-extent", "outer"}));
    EXPECT_EQ(1000U, covered(folder, file, {"--solid", "nonzero", "--solid-extent", "centre"}));
    EXPECT_EQ(512U, covered(folder, file, {"--solid", "nonzero", "--solid-extent", "inner"}));
    builder smaller;
    add_box(smaller, {0.75F, 0.75F, 0.75F}, {9.25F, 9.25F, 9.25F}); // before them
    EXPECT_EQ(1000U, covered(folder, smaller, {"--solid", "nonzero"}));
    EXPECT_EQ(512U, covered(folder, smaller, {"--solid", "nonzero", "--solid-extent", "centre"}));
    EXPECT_EQ(1000U, covered(folder, smaller, {"--solid", "nonzero", "--padding", "3"}));
    EXPECT_EQ(16U, read_npy(folder / "o.npy").shape[0]);
}

// Beside the surface's other coverages: through voxels before their centres, the corners and edges of a box meet no
// axis, but diagonals.
TEST(Solid, CrosshairsAndDiagonalsOfASurface) {
    const scratch_folder folder;
    builder file;
    add_box(file, {0.75F, 0.75F, 0.75F}, {9.25F, 9.25F, 9.25F});
    EXPECT_EQ(1000U - 512U, covered(folder, file, {"--coverage", "conservative"}));
    EXPECT_EQ(6U * 64U, covered(folder, file, {"--coverage", "crosshair"}));
    EXPECT_EQ(1000U - 512U, covered(folder, file, {"--coverage", "diagonal"}));
    builder speck; // between all axes
    add_box(speck, {0.6F, 0.6F, 0.6F}, {0.9F, 0.9F, 0.9F});
    speck.write_glb(folder / "speck.glb");
    const outcome none =
        run(folder, {folder / "speck.glb", "-s", "1", "-o", folder / "o.npy", "--coverage", "crosshair"});
    EXPECT_NE(std::string::npos, none.err.find("no triangle meets an axis")) << none.err;
    builder grain; // between the diagonals of one voxel
    add_box(grain, {0.45F, 0.45F, 0.05F}, {0.55F, 0.55F, 0.15F});
    grain.write_glb(folder / "grain.glb");
    const outcome nothing =
        run(folder, {folder / "grain.glb", "-s", "1", "-o", folder / "o.npy", "--coverage", "diagonal"});
    EXPECT_NE(std::string::npos, nothing.err.find("no triangle meets a diagonal")) << nothing.err;
}

// The mean of the outermost voxels of the halves of a 16 x 8 x 8 grid, in linear light.
glm::u8vec4 mean_of_surface(const array& color) {
    glm::dvec3 sum(0);
    double count = 0;
    for (std::size_t i = 0; i < color.voxels(); ++i) {
        const std::size_t x = i % 8, y = i / 16 % 8, z = i / 128;
        if (x != 0 && x != 7 && y != 0 && y != 7 && z != 0 && z != 7) continue;
        const auto c = color.at<glm::u8vec4>(i);
        for (int a = 0; a < 3; ++a) {
            const double v = c[a] / 255.0;
            sum[a] += v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
        }
        ++count;
    }
    glm::u8vec4 mean(255);
    for (int a = 0; a < 3; ++a) {
        const double v = sum[a] / count;
        mean[a] = static_cast<std::uint8_t>(
            std::lround(255 * (v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055)));
    }
    return mean;
}

// Every target at once, in slabs, for each extent.
TEST(Solid, ValuesInside) {
    const scratch_folder folder;
    builder file;
    const int red = gltf_test::add_material(file, {1, 0, 0, 1});
    const int blue = gltf_test::add_material(file, {0, 0, 1, 1});
    add_box(file, {0, 0, 0}, {8, 8, 8})["material"] = red;
    add_box(file, {8, 0, 0}, {16, 8, 8})["material"] = blue;
    file.write_glb(folder / "m.glb");
    std::map<std::string, glm::u8vec4> fills;
    for (const std::string extent : {"outer", "centre", "inner"}) {
        for (const char* rule : {"nonzero", "each_draw"}) {
            const outcome result =
                run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-s", "1", "--solid", rule, "--solid-extent",
                             extent, "--work-memory", "1", "--fill", "mean", "-t",
                             "occupancy,count,color,color-max,color-outer,normal,material,triangle,depth"});
            ASSERT_EQ(0, result.code) << result.err;
            const auto read = [&folder](const char* name) {
                return read_npy(folder / (std::string("o.") + name + ".npy"));
            };
            const array occupancy = read("occupancy"), count = read("count"), normal = read("normal"),
                        material = read("material"), triangle = read("triangle"), depth = read("depth");
            ASSERT_EQ((std::vector<std::size_t>{8, 8, 16}), occupancy.shape);
            for (std::size_t i = 0; i < occupancy.voxels(); ++i) {
                const std::size_t x = i % 16, y = i / 16 % 8, z = i / 128;
                const bool surface = x % 8 == 0 || x % 8 == 7 || y == 0 || y == 7 || z == 0 || z == 7;
                const bool set = extent != "inner" || !surface;
                ASSERT_EQ(set ? 1 : 0, occupancy.at<std::uint8_t>(i));
                // A body's surface counts in the other's voxels that it touches, too.
                const bool both = surface && extent == "outer" && (x == 7 || x == 8);
                ASSERT_EQ(!set                                       ? 0U
                          : both && std::string(rule) == "each_draw" ? 2U
                                                                     : 1U,
                          count.at<std::uint32_t>(i))
                    << extent << ' ' << rule << ' ' << x;
                const bool shows = set && surface;
                if (x != 7 && x != 8) { // there both have a surface
                    ASSERT_EQ(shows ? (x < 8 ? red : blue) : -1, material.at<std::int32_t>(i));
                }
                ASSERT_EQ(shows, triangle.at<std::int32_t>(i) >= 0);
                ASSERT_EQ(shows, !std::isnan(depth.at<float>(i)));
                if (!shows) {
                    ASSERT_EQ(glm::vec3(0), normal.at<glm::vec3>(i));
                }
            }
            for (const char* name : {"color", "color-max", "color-outer"}) {
                const array color = read(name);
                const auto inside = color.at<glm::u8vec4>(128 * 4 + 16 * 4 + 4);
                EXPECT_EQ(inside, color.at<glm::u8vec4>(128 * 3 + 16 * 5 + 12));
                EXPECT_EQ(extent == "inner" ? glm::u8vec4(0) : glm::u8vec4(255, 0, 0, 255), color.at<glm::u8vec4>(0));
                if (extent == "outer") fills[name] = mean_of_surface(color);
                EXPECT_EQ(fills[name], inside) << name;
            }
        }
    }
    ASSERT_EQ(0, run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-s", "1", "--solid", "nonzero", "--fill-color",
                              "#102030", "-t", "color"})
                     .code);
    EXPECT_EQ(glm::u8vec4(16, 32, 48, 255), read_npy(folder / "o.npy").at<glm::u8vec4>(128 * 4 + 16 * 4 + 4));
}

TEST(Solid, TheFilesAreTheSameForAnyThreadsAndSlabs) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto bytes = [&folder](const std::vector<std::string>& more) {
        std::vector<std::string> all{folder / "m.glb",
                                     "-q",
                                     "-o",
                                     folder / "o.npz",
                                     "-r",
                                     "90",
                                     "--solid",
                                     "nonzero",
                                     "-t",
                                     "occupancy,count,color,normal,material,depth"};
        all.insert(all.end(), more.begin(), more.end());
        EXPECT_EQ(0, run(folder, all).code);
        return tool_test::read_file(folder / "o.npz");
    };
    const std::string one = bytes({"-j", "1"});
    EXPECT_TRUE(one == bytes({"-j", "3", "--work-memory", "1"}));
}

TEST(Solid, EveryFormatHoldsTheInside) {
    const scratch_folder folder;
    builder file;
    add_box(file, {0, 0, 0}, {6, 6, 6});
    file.write_glb(folder / "m.glb");
    std::vector<std::string> all{folder / "m.glb", "-s", "1", "--solid", "nonzero", "--image-size", "64x48"};
    const std::vector<std::string> names{"a.npy", "a.npz", "a.vox", "a.schem", "a.binvox", "a.vti", "a.nrrd",
                                         "a.glb", "a.obj", "a.ply", "a.xyz",   "a.png",    "a.stl"};
    for (const std::string& name : names) all.insert(all.end(), {"-o", folder / name});
    const outcome result = run(folder, all);
    ASSERT_EQ(0, result.code) << result.err;
    EXPECT_NE(std::string::npos, result.out.find("216 of 6 x 6 x 6 voxels are covered")) << result.out;
    // A point for every voxel; a mesh only of the outer sides, 4 corners each.
    const std::string points = tool_test::read_file(folder / "a.xyz");
    EXPECT_EQ(216, std::count(points.begin(), points.end(), '\n'));
    const std::string mesh = tool_test::read_file(folder / "a.obj");
    std::size_t faces = 0;
    for (std::size_t at = mesh.find("\nf "); at != std::string::npos; at = mesh.find("\nf ", at + 1)) ++faces;
    EXPECT_EQ(6U * 36U, faces);
}

TEST(Solid, OpenModelsAreAWarningWithTheShare) {
    const scratch_folder folder;
    builder file;
    add_box(file, {0, 0, 0}, {8, 8, 8});
    std::string messages;
    covered(folder, file, {"--solid", "nonzero"}, &messages);
    EXPECT_EQ("", messages);
    builder open;
    add_box(open, {0, 0, 0}, {8, 8, 8}, false, 2);
    covered(folder, open, {"--solid", "nonzero"}, &messages);
    EXPECT_NE(std::string::npos, messages.find("the model is not closed: 64 of the 64 rows of voxels along x (100 %)"))
        << messages;
    const outcome stats = run(
        folder, {folder / "m.glb", "-q", "--stats", "json", "-s", "1", "--solid", "even_odd", "-o", folder / "o.npy"});
    const json solid = json::parse(stats.out)["solid"];
    EXPECT_EQ("even_odd", solid["rule"]);
    EXPECT_EQ("outer", solid["extent"]);
    EXPECT_EQ(64, solid["open_rows"]);
    EXPECT_EQ(64, solid["rows"]);
    EXPECT_EQ(64, solid["crossings"]);
}

// A box without the two triangles of its side at +x: 4 edges are open, and rows along x meet the surface once.
TEST(Solid, ModelsWithHolesAreRepaired) {
    const scratch_folder folder;
    builder open;
    add_box(open, {0.25F, 0.25F, 0.25F}, {9.75F, 9.75F, 9.75F}, false, 2);
    const std::vector<std::string> grid{"--origin", "-2,0,0", "--extent", "16,10,10"};
    const auto solid = [&](std::vector<std::string> arguments, std::string* messages = nullptr) {
        arguments.insert(arguments.end(), grid.begin(), grid.end());
        return covered(folder, open, arguments, messages);
    };
    std::string messages;
    // The hole's shadow: the rows in the box go on to the grid's end. The outer extent adds the sides.
    EXPECT_LT(1000U, solid({"--solid", "nonzero"}));
    EXPECT_EQ(1000U, solid({"--solid", "nonzero", "--close-holes"}, &messages));
    EXPECT_EQ("", messages);
    EXPECT_EQ(1000U, solid({"--solid", "even_odd", "--close-holes=4"}));
    EXPECT_LT(1000U, solid({"--solid", "nonzero", "--close-holes=3"}, &messages));
    EXPECT_NE(std::string::npos, messages.find("after lids on 0 of its 1 holes")) << messages;
    // Along y and z the box is closed.
    EXPECT_EQ(1000U, solid({"--solid", "even_odd", "--vote"}, &messages));
    EXPECT_EQ("", messages);
    EXPECT_EQ(1000U, solid({"--solid", "nonzero", "--vote", "--work-memory", "1"}));
    // In the plane of a missing side a point sees the box in half of all directions, beyond it in fewer.
    EXPECT_EQ(1000U, solid({"--solid", "nonzero", "--winding"}, &messages));
    EXPECT_EQ("", messages);
    EXPECT_EQ(1000U, solid({"--solid", "positive", "--winding", "--work-memory", "1"}));
    // The flood comes in where the side is missing; what is left are five sides. A gap of 8 voxels needs R = 4.
    const std::size_t sides = 1000 - 9 * 8 * 8;
    EXPECT_EQ(sides, solid({"--solid", "exterior"}, &messages));
    EXPECT_NE(std::string::npos, messages.find("--solid exterior finds nothing enclosed")) << messages;
    EXPECT_EQ(sides, solid({"--solid", "exterior", "--closing", "3"}));
    EXPECT_LT(sides + 300, solid({"--solid", "exterior", "--closing", "4"}, &messages));
    EXPECT_EQ("", messages);
    const json stats = json::parse(run(folder, {folder / "m.glb", "-q", "--stats", "json", "-s", "1", "--solid",
                                                "nonzero", "--close-holes", "-o", folder / "o.npy"})
                                       .out)["solid"];
    EXPECT_EQ(4, stats["hole_edges"]);
    EXPECT_EQ(1, stats["holes"]);
    EXPECT_EQ(1, stats["closed_holes"]);
    EXPECT_EQ(0, stats["open_rows"]);
}

// Cavities are filled, with and without a ring around the grid that takes the flood.
TEST(Solid, ExteriorIsWhatAFloodReaches) {
    const scratch_folder folder;
    builder file;
    add_box(file, {0.5F, 0.5F, 0.5F}, {39.5F, 9.5F, 9.5F});
    add_box(file, {3.5F, 3.5F, 3.5F}, {6.5F, 6.5F, 6.5F}, true);
    EXPECT_EQ(4000U, covered(folder, file, {"--solid", "exterior"}));
    EXPECT_EQ(4000U, covered(folder, file, {"--solid", "exterior", "--padding", "7"}));
    const array ringed = read_npy(folder / "o.npy");
    ASSERT_EQ((std::vector<std::size_t>{24, 24, 54}), ringed.shape);
    for (std::size_t i = 0; i < ringed.voxels(); ++i) {
        const std::size_t x = i % 54, y = i / 54 % 24, z = i / (54 * 24);
        ASSERT_EQ(x >= 7 && x < 47 && y >= 7 && y < 17 && z >= 7 && z < 17 ? 1 : 0, ringed.at<std::uint8_t>(i));
    }
    EXPECT_GT(4000U, covered(folder, file, {"--solid", "nonzero", "--solid-extent", "centre"}));
}

TEST(Solid, WhatDoesNotGoTogetherIsAUsageError) {
    const scratch_folder folder;
    const auto expect = [&folder](const std::vector<std::string>& arguments, const std::string& why) {
        std::vector<std::string> all{folder / "none.glb", "-o", folder / "o.npy"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        const outcome result = run(folder, all);
        EXPECT_EQ(1, result.code);
        EXPECT_NE(std::string::npos, result.err.find(why)) << result.err;
    };
    expect({"--solid", "nonzero", "--coverage", "thin"}, "--solid and --coverage do not go together");
    expect({"--solid", "nonzero", "--coverage", "conservative"}, "--solid and --coverage do not go together");
    expect({"--solid", "full"}, "--solid takes nonzero, even_odd, positive, each_draw or exterior, not \"full\"");
    expect({"--solid-extent", "outer"}, "--solid-extent goes with --solid");
    expect({"--fill-color", "mean"}, "--fill goes with --solid");
    expect({"--fill", "body"}, "--fill goes with --solid");
    expect({"--vote"}, "--vote goes with --solid");
    expect({"--winding"}, "--winding goes with --solid");
    expect({"--solid", "even_odd", "--winding"},
           "--winding does not go with --solid even_odd: a winding number of 1/2");
    expect({"--solid", "each_draw", "--winding"}, "--winding does not go with --solid each_draw");
    expect({"--solid", "exterior", "--winding"}, "--winding does not go with --solid exterior");
    expect({"--solid", "nonzero", "--winding", "--vote"}, "--winding does not go with --vote");
    expect({"--solid", "nonzero", "--winding", "--close-holes"}, "--winding does not go with --close-holes");
    expect({"--close-holes"}, "--close-holes goes with --solid");
    expect({"--closing", "1"}, "--closing goes with --solid");
    expect({"--solid", "nonzero", "--closing", "1"}, "--closing goes with --solid exterior");
    expect({"--solid", "exterior", "--closing", "65"}, "--closing");
    expect({"--solid", "exterior", "--vote"}, "--vote does not go with --solid exterior");
    expect({"--solid", "each_draw", "--vote"}, "--vote does not go with --solid each_draw");
    expect({"--solid", "exterior", "--close-holes"}, "--close-holes does not go with --solid exterior");
    expect({"--solid", "even_odd", "--vote", "--close-holes=9"}, "--close-holes does not go with --vote");
    expect({"--solid", "nonzero", "--close-holes=0"}, "--close-holes takes the number of edges");
    expect({"--solid", "nonzero", "--close-holes=many"}, "--close-holes takes the number of edges");
    expect({"--solid", "exterior", "--solid-extent", "centre"}, "--solid exterior always has --solid-extent outer");
    expect({"--solid", "even_odd", "--vote", "--solid-extent", "inner"}, "--vote always has --solid-extent outer");
    expect({"--solid", "nonzero", "--fill-color", "blue"}, "--fill takes body, nearest, mean or #rrggbb");
}

TEST(Solid, NothingInsideIsSaid) {
    const scratch_folder folder;
    builder file;
    add_box(file, {0, 0, 0}, {8, 8, 8}, true);
    std::string messages;
    EXPECT_EQ(0U, covered(folder, file, {"--solid", "positive", "--solid-extent", "centre"}, &messages));
    EXPECT_NE(std::string::npos, messages.find("no centre of a voxel is inside the model")) << messages;
    EXPECT_EQ(512U, covered(folder, file, {"--solid", "nonzero", "--solid-extent", "centre"}, &messages));
}

} // namespace
