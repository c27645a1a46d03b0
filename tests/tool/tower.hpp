// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A tall model whose result is drawn and written slab by slab.

#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace tool_test {

// A closed tower that turns as it rises, with a colour: with 60 floors, three slabs of 256 layers at 12 x 12 x 600
// voxels.
inline void write_tower(const std::filesystem::path& path, int floors) {
    constexpr int sides = 8;
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (int f = 0; f <= floors; ++f)
        for (int s = 0; s < sides; ++s) {
            const double a = 6.283185307179586 * s / sides + 0.05 * f;
            positions.insert(positions.end(), {static_cast<float>(5 + 5 * std::cos(a)),
                                               static_cast<float>(5 + 5 * std::sin(a)), static_cast<float>(10 * f)});
        }
    const auto at = [](int f, int s) { return static_cast<std::uint32_t>(f * sides + s % sides); };
    for (int s = 0; s < sides; ++s)
        for (int f = 0; f < floors; ++f)
            indices.insert(indices.end(),
                           {at(f, s), at(f, s + 1), at(f + 1, s), at(f, s + 1), at(f + 1, s + 1), at(f + 1, s)});
    for (int s = 1; s + 1 < sides; ++s) {
        indices.insert(indices.end(), {at(0, 0), at(0, s + 1), at(0, s)});
        indices.insert(indices.end(), {at(floors, 0), at(floors, s), at(floors, s + 1)});
    }
    builder file;
    const int index_accessor = file.accessor(indices, "SCALAR");
    json& primitive = file.mesh({{"POSITION", file.accessor(positions, "VEC3")}});
    primitive["indices"] = index_accessor;
    primitive["material"] = 0;
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.3, 0.1, 1}}}}}};
    file.write_glb(path);
}

// Every file below a folder, by its path in it.
inline std::map<std::string, std::string> files_of(const std::filesystem::path& folder) {
    std::map<std::string, std::string> files;
    for (const std::filesystem::directory_entry& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
            files[std::filesystem::relative(entry.path(), folder).string()] = read_file(entry.path());
    return files;
}

struct tower {
    scratch_folder folder;
    std::vector<std::string> how;
    int floors;

    explicit tower(std::vector<std::string> how_, int floors_ = 60) : how(std::move(how_)), floors(floors_) {
        write_tower(folder / "m.glb", floors);
    }
    [[nodiscard]] pid_t begin(const std::string& out, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{
            folder / "m.glb", "-o", folder / out, "-r", std::to_string(10 * floors), "-j", "2"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        arguments.insert(arguments.end(), more.begin(), more.end());
        return start(folder, arguments);
    }
    [[nodiscard]] outcome draw(const std::string& out, const std::vector<std::string>& more) const {
        return wait_for(folder, begin(out, more));
    }
    // The folders of slabs that are there.
    [[nodiscard]] std::vector<std::filesystem::path> unfinished() const {
        std::vector<std::filesystem::path> found;
        for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder.path()))
            if (entry.path().extension() == ".slabs") found.push_back(entry.path());
        return found;
    }
};

inline void expect_same_group(const tower& t, const std::string& a, const std::string& b) {
    const auto x = files_of(t.folder / a), y = files_of(t.folder / b);
    EXPECT_GT(x.size(), 4u);
    EXPECT_TRUE(x == y) << x.size() << " and " << y.size() << " files";
}

} // namespace tool_test
