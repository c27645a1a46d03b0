// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "assimp_scene.hpp"

#include "assimp/file_name.hpp"
#include "assimp/import.hpp"
#include "gltf/budget.hpp"
#include "gltf/picture_file.hpp"
#include "gltf/resources.hpp"
#include "gltf/text.hpp"
#include "isolated.hpp"

#include <algorithm>
#include <map>
#include <new>
#include <utility>

namespace voxelize {

namespace {

isolation_limits limits_for(std::uint64_t bytes, const gltf_limits& limits) {
    constexpr std::uint64_t most = std::uint64_t{1} << 46;
    isolation_limits result;
    const std::uint64_t each = std::max<std::uint64_t>(limits.memory_per_input_byte, 1);
    const std::uint64_t of_size = 2 * limits.base_memory + (bytes > most / each ? most : bytes * each);
    result.memory = std::min(of_size, limits.room);
    result.result = of_size;
    result.seconds = limits.import_seconds + 2 * (bytes >> 20); // two a MiB: twenty times what text takes
    return result;
}

class picture_loader {
public:
    picture_loader(const assimp::model& source, const gltf_file_reader& read_file, gltf::budget& memory, scene& result,
                   const load_hooks& hooks)
        : source_{source}, read_file_{read_file}, memory_{memory}, scene_{result}, hooks_{hooks} {}

    // Material INDEX will show its texture. All that do are named before the first is loaded.
    void will_show(std::size_t index) {
        users_[key_of(source_.textures[index])].push_back(static_cast<std::uint32_t>(index));
    }

    // The texture of material INDEX in the scene, or none and a warning.
    std::int32_t load(std::size_t index) {
        const assimp::texture_source& wanted = source_.textures[index];
        const std::string key = key_of(wanted);
        auto found = images_.find(key);
        if (found == images_.end()) {
            std::int32_t image = material::no_texture;
            try {
                picture decoded = decode(wanted);
                decoded.name = gltf::printable(key);
                if (hooks_.picture) hooks_.picture(scene_, decoded, users_[key]);
                image = static_cast<std::int32_t>(scene_.images.size());
                scene_.images.push_back(std::move(decoded));
            } catch (const model_error& error) {
                scene_.warnings.push_back("the texture " + gltf::in_quotes(key) + " cannot be used: " + error.what() +
                                          "; the material's colour is used alone");
            } catch (const std::bad_alloc&) {
                throw picture_memory_error("the picture " + gltf::in_quotes(key));
            }
            found = images_.emplace(key, image).first;
        }
        if (found->second == material::no_texture) return material::no_texture;
        texture entry;
        entry.image = static_cast<std::uint32_t>(found->second);
        entry.wrap_s = wanted.wrap_s;
        entry.wrap_t = wanted.wrap_t;
        scene_.textures.push_back(entry);
        return static_cast<std::int32_t>(scene_.textures.size() - 1);
    }

private:
    static std::string key_of(const assimp::texture_source& wanted) {
        return wanted.path.empty() ? '*' + std::to_string(wanted.embedded) : wanted.path;
    }

    picture decode(const assimp::texture_source& wanted) const {
        if (wanted.path.empty()) {
            const assimp::embedded_picture& embedded = source_.embedded[static_cast<std::size_t>(wanted.embedded)];
            if (embedded.width == 0) return gltf::decode_picture(embedded.bytes, memory_.limits());
            if (embedded.height == 0) throw model_error("it has no pixels");
            memory_.charge(embedded.bytes.size(), 1, "an embedded texture");
            picture result;
            result.width = embedded.width;
            result.height = embedded.height;
            for (const std::byte byte : embedded.bytes) result.rgba.push_back(std::to_integer<std::uint8_t>(byte));
            return result;
        }
        const std::optional<std::filesystem::path> path = assimp::local_file(wanted.path);
        if (!path) throw model_error("it is no file's name");
        if (!read_file_) throw model_error("other files are not read");
        // At the path that the model names, else beside the model.
        std::vector<std::byte> bytes;
        try {
            bytes = read_file_(*path, memory_.limits().max_file_bytes);
        } catch (const model_error&) {
            if (path->filename() == *path) throw;
            bytes = read_file_(path->filename(), memory_.limits().max_file_bytes);
        }
        memory_.grant_input(bytes.size());
        return gltf::decode_picture(bytes, memory_.limits());
    }

    const assimp::model& source_;
    const gltf_file_reader& read_file_;
    gltf::budget& memory_;
    scene& scene_;
    const load_hooks& hooks_;
    std::map<std::string, std::int32_t> images_;
    std::map<std::string, std::vector<std::uint32_t>> users_; // the materials that show each picture
};

scene to_scene(assimp::model source, const gltf_file_reader& read_file, gltf::budget& memory, const load_hooks& hooks) {
    scene result;
    result.warnings = std::move(source.warnings);
    result.primitives = std::move(source.primitives);
    result.instances = std::move(source.instances);
    result.materials = std::move(source.materials);
    if (hooks.geometry) hooks.geometry(result);
    picture_loader pictures{source, read_file, memory, result, hooks};
    std::vector<bool> shown(result.materials.size());
    for (const instance& one : result.instances) {
        const std::uint32_t index = result.primitives[one.primitive].material;
        if (!shown[index] && source.textures[index].is_there()) pictures.will_show(index);
        shown[index] = true;
    }
    for (std::size_t i = 0; i < result.materials.size(); ++i)
        if (shown[i] && source.textures[i].is_there()) result.materials[i].texture = pictures.load(i);
    for (primitive& part : result.primitives)
        if (result.materials[part.material].texture == material::no_texture) part.texcoords.clear();
    return result;
}

} // namespace

bool is_for_assimp(const std::string& extension) {
    return extension != ".gltf" && extension != ".glb" && assimp::reads(extension);
}

scene load_by_assimp(std::span<const std::byte> bytes, const std::string& name, const gltf_file_reader& read_file,
                     const gltf_limits& limits, const load_hooks& hooks) {
    if (bytes.empty()) throw model_error("the file is empty");
    gltf::budget memory{limits};
    memory.grant_input(bytes.size());
    const isolation_limits bounds = limits_for(bytes.size(), limits);
    std::vector<std::byte> reply;
    try {
        reply = run_isolated([&] { return assimp::to_bytes(assimp::read_model(bytes, name, read_file)); }, bounds,
                             "assimp");
    } catch (const isolation_memory_error&) {
        if (bounds.memory == limits.room) throw std::bad_alloc(); // the run's limit, not the file's
        throw;
    }
    memory.charge(reply.size(), 1, "the model");
    return to_scene(assimp::from_bytes(reply), read_file, memory, hooks);
}

scene load_by_assimp(const std::filesystem::path& file, const gltf_limits& limits, const load_hooks& hooks) {
    const std::vector<std::byte> bytes = gltf::read_whole_file(file, limits.max_file_bytes);
    return load_by_assimp(bytes, file.filename().string(), gltf::folder_reader(file.parent_path()), limits, hooks);
}

} // namespace voxelize
