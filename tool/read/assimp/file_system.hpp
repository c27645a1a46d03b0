// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files that assimp sees: the model itself from memory, others through the reader, none outside the model's folder.

#include "file_name.hpp"
#include "read/gltf_scene.hpp"

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace voxelize::assimp {

class file_system : public Assimp::IOSystem {
public:
    file_system(std::span<const std::byte> bytes, std::string name, const gltf_file_reader& read_file)
        : name_{std::move(name)}, bytes_{bytes}, read_file_{read_file} {}

    bool Exists(const char* file) const override { return find(file).has_value(); }
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* file, const char* mode) override;
    void Close(Assimp::IOStream* stream) override { delete stream; }

    // The files that were read beside the model.
    [[nodiscard]] std::vector<std::string> others() const {
        std::vector<std::string> names;
        for (const auto& [path, bytes] : others_)
            if (bytes) names.push_back(path.string());
        return names;
    }

private:
    // The bytes of FILE, nothing where it cannot be had.
    std::optional<std::span<const std::byte>> find(const std::string& file) const;

    std::string name_;
    std::span<const std::byte> bytes_;
    const gltf_file_reader& read_file_;
    mutable std::map<std::filesystem::path, std::optional<std::vector<std::byte>>> others_; // nothing: not there
};

} // namespace voxelize::assimp
