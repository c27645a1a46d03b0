// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Material libraries (MTL) of an OBJ file -> materials. A statement that is not known or cannot be read never costs
// more than itself: the material, and the geometry that it is on, stay.

#include "model/scene.hpp"
#include "read/assimp/wire.hpp"
#include "read/gltf_scene.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::obj {

// Returns the libraries that REST, what follows "mtllib" in a line, names: the whole, where is_there(name) says that
// this is a file, else what ends with ".mtl" before a blank or the end, else the words. A name may have blanks and
// quotes.
[[nodiscard]] std::vector<std::string> library_names(std::string_view rest,
                                                     const std::function<bool(const std::string&)>& is_there);

// Returns the path of a file that an OBJ in FOLDER or one of its libraries names, relative to FOLDER: where the name
// says, else beside the file that names it (IN, relative to FOLDER), else beside the model. Empty where no such file
// exists, or the name leads out of FOLDER and no such file is beside the model.
[[nodiscard]] std::filesystem::path find_file(const std::filesystem::path& folder, const std::string& name,
                                              const std::filesystem::path& in = {});

// The materials of one OBJ file.
class material_list {
public:
    // The first material is the default one, which is white. FOLDER is the model's.
    material_list(std::filesystem::path folder, const gltf_options& options);

    // A statement "mtllib" with this REST; its libraries are read by read_libraries().
    void add_libraries(std::string_view rest);
    // A statement "usemtl" with this REST, which may name a material of a library to come. Returns a number for it.
    [[nodiscard]] std::uint32_t use(std::string_view rest);
    // Called once, behind the last of both. MODEL.mtl stands in for libraries none of which is there.
    void read_libraries(const std::filesystem::path& model);

    // Index of the material that use() gave this NUMBER to; after read_libraries().
    [[nodiscard]] std::uint32_t material_of(std::uint32_t number) const { return used_[number].material; }

    // The default material, those of the libraries in their order, then those that no library has, which are white.
    std::vector<material> materials;
    std::vector<assimp::texture_source> textures; // of each material
    std::vector<std::string> warnings;
    std::vector<std::string> files; // libraries that were read, relative to the model's folder

private:
    struct used_name {
        std::string name;
        std::uint32_t material = 0;
    };

    [[nodiscard]] bool read_library(const std::filesystem::path& file);
    void statement(std::string_view line, const std::filesystem::path& library, std::uint64_t number);
    void begin_material(std::string_view rest);
    void set_texture(std::string_view rest, const std::filesystem::path& library, bool is_alpha);
    void finish_material();
    void warn(const std::filesystem::path& library, std::uint64_t number, std::string_view line, const char* what);
    std::uint32_t add_material(std::string name);

    std::filesystem::path folder_;
    const gltf_options& options_;
    std::vector<std::string> named_; // as the file names them, each once
    std::vector<used_name> used_;
    std::map<std::string, std::uint32_t, std::less<>> numbers_; // of used_
    std::map<std::string, std::uint32_t, std::less<>> defined_; // by name: index of a material
    bool is_open_ = false;                                      // the last material takes statements
    bool has_opacity_ = false, is_black_ = false;               // it has had d; a Kd of black
};

} // namespace voxelize::obj
