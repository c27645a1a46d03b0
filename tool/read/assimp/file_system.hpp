// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files that assimp sees: the model itself from memory, others through the reader, none outside the model's folder.

#include "file_name.hpp"
#include "read/gltf_scene.hpp"

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>

#include <cstddef>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
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

    // Material libraries that the model names and that cannot be read, in its order, each once.
    [[nodiscard]] const std::vector<std::string>& missing_libraries() const { return missing_; }
    // The library that assimp took in place of a missing one: that beside the model, with its name.
    [[nodiscard]] const std::optional<std::string>& stand_in() const { return stand_in_; }
    // True if a library that was read has a material of this name.
    [[nodiscard]] bool has_material(const std::string& name) const { return materials_.contains(name); }

private:
    // True for what an OBJ names as its material libraries. A name without an extension is one, too.
    [[nodiscard]] bool is_library(const std::string& file) const {
        return file != name_ && lower_extension(name_) == ".obj";
    }

    // One or more libraries, one behind the other. assimp asks for MODEL.mtl where it gets nothing for the names in the
    // file.
    std::optional<std::span<const std::byte>> find_libraries(const std::string& names);
    // True if a line "mtllib" of the model has these names.
    [[nodiscard]] bool model_names(const std::string& libraries) const;
    // Remembers the names behind "newmtl".
    void add_materials(std::span<const std::byte> library);
    // The bytes of FILE, nothing where it cannot be had.
    std::optional<std::span<const std::byte>> find(const std::string& file) const;

    std::string name_;
    std::span<const std::byte> bytes_;
    const gltf_file_reader& read_file_;
    mutable std::map<std::filesystem::path, std::optional<std::vector<std::byte>>> others_; // nothing: not there
    std::deque<std::vector<std::byte>> libraries_;                                          // those that assimp reads
    std::set<std::string> materials_;                                                       // of these
    std::vector<std::string> missing_;
    std::optional<std::string> stand_in_;
};

} // namespace voxelize::assimp
