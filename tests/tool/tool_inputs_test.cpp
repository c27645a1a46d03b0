// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The voxelize program and what it is given: warnings beside errors, --lenient.
#include "tool_test.hpp"

#include <gtest/gtest.h>

using namespace tool_test;

namespace {

TEST(ToolInputs, WarningsAreShownWhenNothingIsLeftToDraw) {
    const scratch_folder folder;
    builder file;
    file.triangle()["attributes"].erase("POSITION");
    const std::string model = folder / "nowhere.glb";
    file.write_glb(model);
    const std::string warning = "voxelize: warning: 1 primitive(s) without POSITION are left out\n";
    const std::string error = "voxelize: " + model + ": there are no triangles, lines or points to voxelize\n";
    const outcome loud = run(folder, {model, "-o", folder / "o.npy"});
    EXPECT_EQ(2, loud.code);
    EXPECT_EQ(warning + error, loud.err);
    EXPECT_EQ("", loud.out);
    EXPECT_EQ(error, run(folder, {model, "-o", folder / "o.npy", "--quiet"}).err);
}

TEST(ToolInputs, WarningsAreShownWhenTheFileIsRefused) {
    const scratch_folder folder;
    builder file;
    file.triangle()["indices"] = file.accessor(std::vector<std::uint16_t>{0, 1, 3}, "SCALAR");
    file.root["extensionsUsed"] = {"ACME_secret"};
    const std::string model = folder / "m.glb";
    file.write_glb(model);
    const outcome result = run(folder, {model, "-o", folder / "o.npy"});
    EXPECT_EQ(2, result.code);
    EXPECT_EQ("voxelize: warning: extension ACME_secret is not known and ignored\nvoxelize: " + model +
                  ": meshes[0].primitives[0]: index 3 at place 2 is out of range, there are 3 vertices\n",
              result.err);
}

TEST(ToolInputs, LenientIsOfferedWhereItHelps) {
    const scratch_folder folder;
    builder file;
    file.triangle();
    file.root["scenes"] = {{{"nodes", {0, 0}}}};
    const std::string model = folder / "m.glb";
    file.write_glb(model);
    const outcome strict = run(folder, {model, "-o", folder / "o.npy", "-r", "4"});
    EXPECT_EQ(2, strict.code);
    EXPECT_EQ("voxelize: " + model + ": nodes[0]: is in the scene twice (--lenient goes on all the same)\n",
              strict.err);
    const outcome lenient = run(folder, {model, "-o", folder / "o.npy", "-r", "4", "--lenient"});
    EXPECT_EQ(0, lenient.code);
    EXPECT_EQ("voxelize: warning: nodes[0]: is in the scene twice; it is shown once\n", lenient.err);
}

// A box of 2 x 1 x 3 with its lowest corner at (10, 20, 30), as text.
std::string box_obj() {
    std::string text;
    for (int corner = 0; corner < 8; ++corner)
        text += "v " + std::to_string(10 + 2 * (corner & 1)) + ' ' + std::to_string(20 + (corner >> 1 & 1)) + ' ' +
                std::to_string(30 + 3 * (corner >> 2)) + '\n';
    return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

TEST(ToolInputs, OtherFormatsAreReadOrSayHow) {
    const scratch_folder folder;
    std::ofstream(folder / "box.OBJ") << box_obj();
    const outcome result = run(folder, {folder / "box.OBJ", "-o", folder / "o.npy", "-s", "1"});
    EXPECT_EQ(0, result.code) << result.err;
    EXPECT_EQ("", result.err);
    const tool_test::array voxels = tool_test::read_npy(folder / "o.npy");
    EXPECT_EQ((std::vector<std::size_t>{3, 1, 2}), voxels.shape); // nothing is rescaled
    const outcome scaled =
        run(folder, {folder / "box.OBJ", "-o", folder / "o.npy", "-s", "1", "--scale", "4", "--stats", "json"});
    EXPECT_EQ(0, scaled.code) << scaled.err;
    EXPECT_EQ((std::vector<std::size_t>{12, 4, 8}), tool_test::read_npy(folder / "o.npy").shape);
    const json stats = json::parse(scaled.out);
    EXPECT_EQ((json{40, 80, 120}), stats["grid"]["origin"]); // about the origin
}

TEST(ToolInputs, ScaleIsOfAllFormats) {
    const scratch_folder folder;
    gltf_test::small_world().write_glb(folder / "m.glb");
    const auto shape = [&](const std::string& scale) {
        EXPECT_EQ(0, run(folder, {folder / "m.glb", "-o", folder / "o.npy", "-s", "0.1", "--scale", scale}).code);
        return tool_test::read_npy(folder / "o.npy").shape;
    };
    const std::vector<std::size_t> once = shape("1");
    const std::vector<std::size_t> twice = shape("2");
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_GE(twice[axis], 2 * once[axis] - 2);
        EXPECT_LE(twice[axis], 2 * once[axis]);
    }
    for (const char* wrong : {"0", "-1", "nan", "inf", "x"})
        EXPECT_EQ(1, run(folder, {folder / "m.glb", "-o", folder / "o.npy", "--scale", wrong}).code) << wrong;
}

TEST(ToolInputs, VariantsChooseMaterials) {
    const scratch_folder folder;
    builder file;
    for (const double red : {0.0, 1.0}) (void)gltf_test::add_material(file, {red, 0, 0, 1});
    file.root["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "red"}}};
    json& square = gltf_test::add_square(file, 0);
    square["material"] = 0;
    square["extensions"]["KHR_materials_variants"]["mappings"] = {{{"variants", {0}}, {"material", 1}}};
    const std::string model = folder / "m.glb";
    file.write_glb(model);
    const outcome red = run(folder, {model, "-o", folder / "o.npy", "-s", "1", "-t", "material", "--variant", "red"});
    EXPECT_EQ("", red.err);
    EXPECT_EQ(1, tool_test::read_npy(folder / "o.npy").at<std::int32_t>(0));
    const outcome away = run(folder, {model, "-o", folder / "o.npy", "--variant", "blue"});
    EXPECT_EQ(2, away.code);
    EXPECT_EQ("voxelize: " + model + ": there is no material variant \"blue\"; the file has \"red\"\n", away.err);
    std::ofstream(folder / "box.obj") << box_obj();
    const outcome other = run(folder, {folder / "box.obj", "-o", folder / "o.npy", "--variant", "red"});
    EXPECT_EQ(2, other.code);
    EXPECT_NE(std::string::npos, other.err.find("--variant is for glTF models")) << other.err;
}

TEST(ToolInputs, AnimationsPoseTheModel) {
    const scratch_folder folder;
    builder file;
    gltf_test::add_cube(file, {0, 0, 0}, 1, gltf_test::add_material(file, {1, 1, 1, 1}));
    gltf_test::add_cube(file, {0, 0, 0}, 1, 0);
    const int times = file.accessor(std::vector<float>{0, 2}, "SCALAR");
    const int places = file.accessor(std::vector<float>{1, 0, 0, 9, 0, 0}, "VEC3");
    file.root["animations"] = {{{"name", "go"},
                                {"samplers", {{{"input", times}, {"output", places}}}},
                                {"channels", {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "translation"}}}}}}}};
    const std::string model = folder / "m.glb";
    file.write_glb(model);
    const auto width = [&](const std::string& time) {
        const outcome result =
            run(folder, {model, "-o", folder / "o.npy", "-s", "1", "--animation", "go", "--time", time});
        EXPECT_EQ("", result.err);
        return tool_test::read_npy(folder / "o.npy").shape.at(2);
    };
    EXPECT_EQ(2U, width("0"));
    EXPECT_EQ(6U, width("1"));
    EXPECT_EQ(10U, width("7"));
    const outcome away = run(folder, {model, "-o", folder / "o.npy", "--animation", "run"});
    EXPECT_EQ(2, away.code);
    EXPECT_EQ("voxelize: " + model + ": there is no animation \"run\"; the file has \"go\"\n", away.err);
    EXPECT_EQ(1, run(folder, {model, "-o", folder / "o.npy", "--time", "1"}).code); // of which animation?
}

} // namespace
