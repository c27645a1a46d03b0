// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "assimp_scene.hpp"

#include "isolated.hpp"
#include "read/assimp/import.hpp"
#include "read/assimp/pictures.hpp"
#include "read/gltf/budget.hpp"
#include "read/gltf/resources.hpp"

#include <algorithm>
#include <array>
#include <new>
#include <string_view>
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

scene to_scene(assimp::model source, const gltf_file_reader& read_file, gltf::budget& memory,
               const gltf_options& options, const load_hooks& hooks) {
    scene result;
    result.warnings = std::move(source.warnings);
    result.primitives = std::move(source.primitives);
    result.instances = std::move(source.instances);
    result.materials = std::move(source.materials);
    if (hooks.geometry) hooks.geometry(result);
    std::vector<bool> asked_for(result.materials.size());
    for (const instance& one : result.instances) {
        const std::uint32_t index = result.primitives[one.primitive].material;
        asked_for[index] = assimp::asks_for_texture(result.materials[index], source.textures[index], options);
    }
    assimp::load_pictures(source, asked_for, read_file, memory, result, hooks);
    for (primitive& part : result.primitives)
        if (result.materials[part.material].texture == material::no_texture) part.texcoords = {};
    return result;
}

} // namespace

bool is_for_assimp(const std::string& extension) {
    constexpr std::array<std::string_view, 6> by_others{".gltf", ".glb", ".obj", ".off", ".ply", ".stl"};
    return std::find(by_others.begin(), by_others.end(), extension) == by_others.end() && assimp::reads(extension);
}

scene load_by_assimp(std::span<const std::byte> bytes, const std::string& name, const gltf_file_reader& read_file,
                     const gltf_limits& limits, const gltf_options& options, const load_hooks& hooks) {
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
    assimp::model source = assimp::from_bytes(reply);
    assimp::name_files(source, options);
    return to_scene(std::move(source), read_file, memory, options, hooks);
}

scene load_by_assimp(const std::filesystem::path& file, const gltf_limits& limits, const gltf_options& options,
                     const load_hooks& hooks) {
    const std::vector<std::byte> bytes = gltf::read_whole_file(file, limits.max_file_bytes);
    return load_by_assimp(bytes, file.filename().string(), gltf::folder_reader(file.parent_path()), limits, options,
                          hooks);
}

} // namespace voxelize
