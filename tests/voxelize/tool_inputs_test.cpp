// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The voxelize program and what it is given: warnings beside errors, --lenient.
#include "tool_runner.hpp"
#include "tool_scenes.hpp"

#include <gtest/gtest.h>

using gltf_test::builder;
using gltf_test::json;
using tool_test::outcome;
using tool_test::run;
using tool_test::scratch_folder;

namespace {

TEST(ToolInputs, WarningsAreShownWhenNothingIsLeftToDraw) {
    const scratch_folder folder;
    builder file;
    file.triangle()["mode"] = 1; // lines
    const std::string model = folder / "lines.glb";
    file.write_glb(model);
    const std::string warning =
        "voxelize: warning: 1 primitive(s) of points or lines have no surface and are left out\n";
    const std::string error = "voxelize: " + model + ": there are no triangles to voxelize\n";
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

} // namespace
