// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A build without assimp says what to do.
#include <read/assimp_scene.hpp>

#include <gtest/gtest.h>

namespace {

TEST(NoAssimp, SaysHowToConvert) {
    for (const char* extension : {".3mf", ".fbx", ".dae"}) EXPECT_TRUE(voxelize::is_for_assimp(extension)) << extension;
    for (const char* extension : {".glb", ".obj", ".off", ".ply", ".stl"})
        EXPECT_FALSE(voxelize::is_for_assimp(extension)) << extension;
    try {
        (void)voxelize::load_by_assimp("chair.fbx");
        ADD_FAILURE() << "no error";
    } catch (const voxelize::model_error& error) {
        EXPECT_STREQ(
            "this build reads glTF, OBJ, OFF, PLY and STL only, since it has no assimp: convert the file (`assimp "
            "export IN OUT.glb`, or "
            "Blender), or install libassimp-dev and build again",
            error.what());
    }
}

} // namespace
