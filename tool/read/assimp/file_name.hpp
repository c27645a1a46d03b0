// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Names of files as models of many programs write them.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <string>

namespace voxelize::assimp {

// The path of FILE, named by a model, relative to that model's folder and never outside it. An absolute path, one with
// a drive and one that leaves the folder give their last part. Backslashes separate, too. Nothing for a name without a
// last part.
[[nodiscard]] inline std::optional<std::filesystem::path> local_file(std::string file) {
    if (file.find('\0') != std::string::npos) return std::nullopt;
    std::replace(file.begin(), file.end(), '\\', '/');
    std::filesystem::path path = std::filesystem::path(file).lexically_normal();
    const bool has_drive = file.size() > 1 && file[1] == ':';
    if (path.has_root_path() || has_drive || (!path.empty() && *path.begin() == "..")) path = path.filename();
    if (path.empty() || !path.has_filename() || path == "." || path == "..") return std::nullopt;
    return path;
}

// ".obj" of "Chair.OBJ"; empty for a name without an extension.
[[nodiscard]] inline std::string lower_extension(const std::filesystem::path& file) {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

} // namespace voxelize::assimp
