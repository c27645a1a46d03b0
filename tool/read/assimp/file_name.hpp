// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Names of files as models of many programs write them.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::assimp {

// The path of FILE, named by a model, relative to that model's folder and never outside it. An absolute path, one with
// a drive and one that leaves the folder give their last part. Backslashes separate, too. Nothing for a name without a
// last part.
[[nodiscard]] inline std::optional<std::filesystem::path> local_file(std::string file) {
    if (file.find('\0') != std::string::npos) return std::nullopt;
    std::replace(file.begin(), file.end(), '\\', '/');
    std::filesystem::path path = std::filesystem::path(file).lexically_normal();
    const bool has_drive = file.size() > 1 && file[1] == ':';
    if (path.is_absolute() || has_drive || (!path.empty() && *path.begin() == "..")) path = path.filename();
    if (path.empty() || !path.has_filename() || path == "." || path == "..") return std::nullopt;
    return path;
}

// The material libraries that NAMES, the rest of a line "mtllib" of an OBJ, may name: the whole, where that is a file
// by is_there(name), else what ends with ".mtl" before a blank or the end. A name may have blanks itself.
template <class IsThere>
[[nodiscard]] std::vector<std::string> material_libraries(const std::string& names, const IsThere& is_there) {
    constexpr std::string_view blank = " \t", extension = ".mtl";
    if (is_there(names)) return {names};
    std::string lower = names;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    std::vector<std::string> list;
    for (std::size_t start = 0; start < names.size();) {
        std::size_t end = lower.find(extension, start);
        if (end != std::string::npos) end += extension.size();
        while (end < names.size() && blank.find(names[end]) == std::string_view::npos) {
            end = lower.find(extension, end);
            if (end != std::string::npos) end += extension.size();
        }
        end = std::min(end, names.size());
        list.push_back(names.substr(start, end - start));
        start = std::min(names.find_first_not_of(blank, end), names.size());
    }
    return list;
}

// ".obj" of "Chair.OBJ"; empty where there is none.
[[nodiscard]] inline std::string lower_extension(const std::filesystem::path& file) {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

} // namespace voxelize::assimp
