// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Every .gltf and .glb below VOXELPIPE_GLTF_DIR either loads with the outcome that gltf_files.txt records or gives the
// error that it records; a file that the table does not know, or knows and is not there, fails. The folder lies beside
// the project, not in it: without it the same machinery runs on two files that the test writes.
//
// VOXELPIPE_WRITE_GLTF_TABLE=FILE in the environment writes the table of what happens now to FILE, to be reviewed.
#include <read/gltf_scene.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace {

namespace fs = std::filesystem;

// The result of loading FILE, one line, and one for each warning.
std::string outcome(const fs::path& file) {
    try {
        const voxelize::scene scene = voxelize::load_gltf(file);
        std::ostringstream text;
        text << "ok: " << scene.instances.size() << " primitives, " << scene.triangle_count() << " triangles, ";
        if (scene.line_count() != 0) text << scene.line_count() << " lines and points, ";
        text << scene.vertex_count() << " vertices, " << scene.images.size() << " images\n";
        for (const std::string& warning : scene.warnings) text << "  warning: " << warning << '\n';
        return text.str();
    } catch (const voxelize::gltf_error& error) {
        return std::string("error: ") + error.what() + '\n';
    }
}

// Relative name -> outcome, for every glTF file below FOLDER.
std::map<std::string, std::string> outcomes(const fs::path& folder) {
    std::map<std::string, std::string> table;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        const fs::path extension = entry.path().extension();
        if (!entry.is_regular_file() || (extension != ".gltf" && extension != ".glb")) continue;
        table[entry.path().lexically_relative(folder).generic_string()] = outcome(entry.path());
    }
    return table;
}

// "[name]" lines head the outcome of a file; '#' lines are comments.
std::map<std::string, std::string> read_table(std::istream& stream) {
    std::map<std::string, std::string> table;
    std::string line;
    std::string name;
    while (std::getline(stream, line)) {
        if (line.empty() || line.front() == '#') continue;
        if (line.front() == '[') {
            name = line.substr(1, line.size() - 2);
        } else {
            table[name] += line + '\n';
        }
    }
    return table;
}

void write_table(std::ostream& stream, const std::map<std::string, std::string>& table) {
    stream << "# SPDX-FileCopyrightText: 2026 The VoxelPipe authors\n# SPDX-License-Identifier: Apache-2.0\n"
              "# What loading each glTF test file comes to; checked by gltf_files_test.cpp, which can also write it.\n";
    for (const auto& [name, text] : table) stream << '[' << name << "]\n" << text;
}

void expect_same(const std::map<std::string, std::string>& expected, const std::map<std::string, std::string>& found) {
    for (const auto& [name, text] : expected) {
        if (!VOXELPIPE_TOOL_HAS_MESHOPT && name == "gltf-transform/BoxMeshopt.glb") continue; // cannot be had there
        const auto match = found.find(name);
        if (match == found.end())
            ADD_FAILURE() << name << " is in the table, but there is no such file";
        else
            EXPECT_EQ(text, match->second) << name;
    }
    for (const auto& [name, text] : found)
        if (!expected.contains(name)) ADD_FAILURE() << name << " is not in the table; it gives\n" << text;
}

TEST(GltfFiles, EveryFileLoadsOrSaysWhyNot) {
    const fs::path folder = VOXELPIPE_GLTF_DIR;
    if (folder.empty()) {
        std::puts("VOXELPIPE_GLTF_DIR is not set: the test writes two files of its own");
        const fs::path own = fs::path(testing::TempDir()) / "voxelpipe_gltf_files";
        fs::create_directories(own / "below");
        std::ofstream(own / "empty.gltf") << R"({"asset": {"version": "2.0"}})";
        std::ofstream(own / "below" / "broken.glb") << "glTF";
        expect_same({{"empty.gltf", "ok: 0 primitives, 0 triangles, 0 vertices, 0 images\n"},
                     {"below/broken.glb", "error: the GLB header is cut short\n"}},
                    outcomes(own));
        fs::remove_all(own);
        return;
    }
    const std::map<std::string, std::string> found = outcomes(folder);
    EXPECT_GE(found.size(), 200U);
    if (const char* file = std::getenv("VOXELPIPE_WRITE_GLTF_TABLE")) {
        std::ofstream stream(file);
        write_table(stream, found);
    }
    std::ifstream stream(VOXELPIPE_GLTF_TABLE);
    ASSERT_TRUE(stream) << VOXELPIPE_GLTF_TABLE;
    expect_same(read_table(stream), found);
}

// An error is one line for a person: no control characters, not empty, no name of an internal exception.
TEST(GltfFiles, ErrorsAreOneReadableLine) {
    std::ifstream stream(VOXELPIPE_GLTF_TABLE);
    ASSERT_TRUE(stream) << VOXELPIPE_GLTF_TABLE;
    const std::map<std::string, std::string> table = read_table(stream);
    EXPECT_GE(table.size(), 200U);
    for (const auto& [name, text] : table) {
        if (!text.starts_with("error: ")) continue;
        EXPECT_EQ(1, std::count(text.begin(), text.end(), '\n')) << name;
        EXPECT_LT(8U, text.size()) << name;
        EXPECT_EQ(std::string::npos, text.find("exception")) << name;
    }
}

} // namespace
