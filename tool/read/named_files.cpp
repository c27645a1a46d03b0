// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "named_files.hpp"

#include "assimp_scene.hpp"
#include "model/model_error.hpp"
#include "read/assimp/file_name.hpp"
#include "read/gltf/resources.hpp"
#include "read/mesh/mesh_formats.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <system_error>

namespace voxelize {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

// The JSON of a .gltf or .glb.
std::string document_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    char head[20]{};
    if (!in.read(head, sizeof(head)) || std::memcmp(head, "glTF", 4) != 0) {
        in.clear();
        in.seekg(0);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::uint32_t length = 0;
    std::memcpy(&length, head + 12, sizeof(length));
    std::error_code error;
    if (length > fs::file_size(file, error) || error) return {};
    std::string text(length, ' ');
    in.read(text.data(), length);
    return text;
}

void add_gltf_files(const fs::path& model, std::vector<fs::path>& files) {
    const json document = json::parse(document_of(model), nullptr, false);
    if (!document.is_object()) return;
    for (const char* const list : {"buffers", "images"}) {
        const auto found = document.find(list);
        if (found == document.end() || !found->is_array()) continue;
        for (const json& entry : *found) {
            const auto uri = entry.is_object() ? entry.find("uri") : entry.end();
            if (uri == entry.end() || !uri->is_string()) continue;
            const auto text = uri->get<std::string>();
            if (text.starts_with("data:")) continue;
            try {
                files.push_back(model.parent_path() / gltf::local_path(text));
            } catch (const model_error&) { // no file of this model's; the loader says so
            }
        }
    }
}

// Calls visit(rest) with what follows the first word of each line whose first word is KEY, or begins with it.
template <class Visit>
void for_each_line(const fs::path& file, const std::string& key, const Visit& visit) {
    constexpr const char* blank = " \t\r";
    std::ifstream in(file, std::ios::binary);
    for (std::string line; std::getline(in, line);) {
        const std::size_t first = line.find_first_not_of(blank);
        if (first == std::string::npos || line.compare(first, key.size(), key) != 0) continue;
        const std::size_t rest = line.find_first_not_of(blank, line.find_first_of(blank, first));
        if (rest != std::string::npos) visit(line.substr(rest, line.find_last_not_of(blank) + 1 - rest));
    }
}

void add_obj_files(const fs::path& model, std::vector<fs::path>& files) {
    const fs::path folder = model.parent_path();
    for_each_line(model, "mtllib", [&](const std::string& name) {
        const auto is_there = [&](const std::string& file) {
            std::error_code error;
            const auto path = assimp::local_file(file);
            return path && fs::is_regular_file(folder / *path, error);
        };
        for (const std::string& library : assimp::material_libraries(name, is_there))
            if (const auto path = assimp::local_file(library)) files.push_back(folder / *path);
    });
    const std::size_t libraries = files.size();
    for (std::size_t i = 0; i < libraries; ++i) {
        const std::vector<fs::path> pictures = named_pictures(fs::path(files[i]), folder);
        files.insert(files.end(), pictures.begin(), pictures.end());
    }
}

} // namespace

std::vector<fs::path> named_pictures(const fs::path& library, const fs::path& folder) {
    std::vector<fs::path> files;
    // A picture's name follows options, and may have blanks; it lies where it says, or beside the model.
    const auto add_picture = [&](const std::string& text) {
        for (std::size_t at = 0; at != std::string::npos; at = text.find_first_not_of(" \t", text.find(' ', at))) {
            const std::optional<fs::path> path = assimp::local_file(text.substr(at));
            std::error_code error;
            if (path)
                for (const fs::path& place : {folder / *path, folder / path->filename()})
                    if (fs::is_regular_file(place, error)) files.push_back(place);
            if (text.find(' ', at) == std::string::npos) break;
        }
    };
    for (const char* const key : {"map_", "bump", "disp", "decal", "refl", "norm"})
        for_each_line(library, key, add_picture);
    return files;
}

std::vector<fs::path> named_files(const fs::path& model) {
    std::vector<fs::path> files;
    const std::string extension = assimp::lower_extension(model);
    if (extension == ".obj")
        add_obj_files(model, files);
    else if (!is_mesh_format(extension) && !is_for_assimp(extension))
        add_gltf_files(model, files);
    return files;
}

} // namespace voxelize
