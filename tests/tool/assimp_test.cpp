// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Files that are wrong, read by assimp in a process of its own.
#include "gltf_builder.hpp"

#include <read/assimp_scene.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

using voxelize::scene;

namespace {

using files = std::map<std::string, std::vector<std::byte>>;

std::vector<std::byte> bytes_of(std::string_view text) { return gltf_test::bytes_of(text); }

scene load(const std::string& name, const std::vector<std::byte>& bytes, const files& others = {},
           const voxelize::gltf_limits& limits = {}) {
    const auto reader = [&](const std::filesystem::path& path, std::uint64_t) {
        const auto found = others.find(path.generic_string());
        if (found == others.end()) throw voxelize::gltf_error("no such file");
        return found->second;
    };
    return voxelize::load_by_assimp(bytes, name, reader, limits);
}

std::string error_of(const std::string& name, const std::vector<std::byte>& bytes,
                     const voxelize::gltf_limits& limits = {}) {
    try {
        (void)load(name, bytes, {}, limits);
    } catch (const voxelize::model_error& error) {
        const std::string line = error.what();
        for (const char c : line) EXPECT_TRUE(c >= ' ' && c <= '~') << line;
        EXPECT_FALSE(line.empty());
        return line;
    }
    return "no error";
}

constexpr const char* square_obj = "v 0 0 5\nv 2 0 5\nv 2 2 5\nv 0 2 5\nf 1 2 3 4\n";

// ---- Files that are wrong ------------------------------------------------------------------------------------------

struct sample {
    const char* name;
    std::vector<std::byte> bytes;
};

std::vector<sample> samples() { return {{"square.obj", bytes_of(square_obj)}}; }

// Any outcome but an end of this process, and errors are one line (error_of).
TEST(AssimpMalformed, FilesMayEndAnywhere) {
    voxelize::gltf_limits limits;
    limits.import_seconds = 1;
    for (const sample& file : samples()) {
        for (std::size_t size = 0; size < file.bytes.size(); size += gltf_test::is_slow_build() ? 29 : 7)
            (void)error_of(file.name, {file.bytes.begin(), file.bytes.begin() + static_cast<std::ptrdiff_t>(size)},
                           limits);
        EXPECT_EQ("no error", error_of(file.name, file.bytes));
        EXPECT_EQ("the file is empty", error_of(file.name, {}));
    }
}

TEST(AssimpMalformed, BytesMayBeWrong) {
    voxelize::gltf_limits limits;
    limits.import_seconds = 1;
    for (const sample& file : samples()) {
        for (std::size_t at = 0; at < file.bytes.size(); at += gltf_test::is_slow_build() ? 31 : 5) {
            for (const int value : {0x00, 0x2D, 0xFF}) {
                std::vector<std::byte> bytes = file.bytes;
                bytes[at] = static_cast<std::byte>(value);
                (void)error_of(file.name, bytes, limits);
            }
        }
    }
}

TEST(AssimpMalformed, IndicesThatPointNowhereAreRefused) {
    EXPECT_NE("no error", error_of("m.obj", bytes_of("v 0 0 0\nv 1 0 0\nf 1 2 9\n")));
}

TEST(AssimpMalformed, MemoryIsBoundedByTheFilesSize) {
    voxelize::gltf_limits limits;
    limits.base_memory = std::uint64_t{1} << 20;
    limits.memory_per_input_byte = 1;
    std::string text;
    for (int i = 0; i < 20000; ++i) text += "v 1 2 3\nf 1 1 1\n";
    if (gltf_test::is_slow_build()) GTEST_SKIP() << "sanitizers reserve memory: there is no bound on it";
    const std::string line = error_of("m.obj", bytes_of(text), limits);
    EXPECT_NE(std::string::npos, line.find("MiB")) << line;
    // The run's own limit is another matter: the file is not to blame.
    voxelize::gltf_limits narrow;
    narrow.room = std::uint64_t{1} << 20;
    EXPECT_THROW((void)load("m.obj", bytes_of(text), {}, narrow), std::bad_alloc);
}

TEST(AssimpMalformed, TheExtensionChoosesTheReader) {
    EXPECT_FALSE(voxelize::is_for_assimp(".obj"));
    for (const char* own : {".stl", ".ply", ".off"}) EXPECT_FALSE(voxelize::is_for_assimp(own)) << own;
    EXPECT_FALSE(voxelize::is_for_assimp(".glb"));
    EXPECT_FALSE(voxelize::is_for_assimp(".gltf"));
    EXPECT_FALSE(voxelize::is_for_assimp(".txt"));
    EXPECT_FALSE(voxelize::is_for_assimp(""));
}

} // namespace
