// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "named_files.hpp"

#include "assimp_scene.hpp"
#include "model/model_error.hpp"
#include "read/assimp/file_name.hpp"
#include "read/gltf/resources.hpp"
#include "read/mesh/mesh_formats.hpp"
#include "read/obj/lines.hpp"
#include "read/obj/materials.hpp"
#include "read/obj/reader.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
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

void add_obj_files(const fs::path& model, std::vector<fs::path>& files) {
    const fs::path folder = model.parent_path();
    const auto is_there = [&](const std::string& name) { return !obj::find_file(folder, name).empty(); };
    obj::for_each_library_line(model, [&](std::string_view rest) {
        for (const std::string& library : obj::library_names(rest, is_there)) {
            const fs::path found = obj::find_file(folder, library);
            const std::optional<fs::path> named = assimp::local_file(library);
            if (!found.empty())
                files.push_back(folder / found);
            else if (named)
                files.push_back(folder / *named);
        }
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
    std::error_code unreadable;
    if (!fs::is_regular_file(library, unreadable)) return files;
    // A picture's name follows options, and may have blanks; it lies where it says, beside the library, or beside the
    // model.
    const auto add_picture = [&](std::string_view rest) {
        while (!obj::trimmed(rest).empty()) {
            for (const std::string_view text : {rest, obj::before_comment(rest)}) {
                const std::optional<fs::path> path = assimp::local_file(obj::name_of(text));
                std::error_code error;
                if (!path) continue;
                for (const fs::path& place : {folder / *path, library.parent_path() / *path, folder / path->filename()})
                    if (fs::is_regular_file(place, error) &&
                        std::find(files.begin(), files.end(), place) == files.end())
                        files.push_back(place);
            }
            (void)obj::next_word(rest);
        }
    };
    try {
        obj::line_reader lines(library);
        for (std::string_view line; lines.next(line);) {
            const std::string key = obj::lower(obj::next_word(line));
            for (const char* const picture : {"map_", "bump", "disp", "decal", "refl", "norm"})
                if (key.starts_with(picture)) add_picture(line);
        }
    } catch (const model_error&) { // no text: the loader says so
    }
    return files;
}

std::vector<fs::path> named_files(const fs::path& model) {
    std::vector<fs::path> files;
    std::error_code error;
    if (!fs::is_regular_file(model, error)) return files; // a folder, a pipe: the loader says so
    const std::string extension = assimp::lower_extension(model);
    if (extension == ".obj") {
        try {
            add_obj_files(model, files);
        } catch (const model_error&) { // it cannot be read: the loader says so
        }
    } else if (!is_mesh_format(extension) && !is_for_assimp(extension)) {
        add_gltf_files(model, files);
    }
    return files;
}

} // namespace voxelize
