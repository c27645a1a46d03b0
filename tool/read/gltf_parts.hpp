// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A glTF scene that can be read in parts, for models that do not fit into memory: where its triangles lie in its files,
// and its textures.

#include "gltf_scene.hpp"
#include "vertex_cache.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace voxelize {

// A scene that can be read in parts: instances of primitives of triangles whose indices, positions (as floats), colours
// and texture coordinates lie in files as they stand.
struct gltf_parts {
    struct part {
        std::string name;
        affine to_world;
        std::uint32_t material = 0;
        position_layout vertices;
        std::optional<color_layout> colors;
        std::optional<texcoord_layout> texcoords;         // of the material's textures; none: it shows none
        std::uint64_t first_index = 0, num_triangles = 0; // byte, triangles
        std::size_t index_bytes = 0;                      // of one; 0: vertices count up
        std::size_t vertex_file = 0, color_file = 0, texcoord_file = 0, index_file = 0; // of files
    };
    struct vertex_list {
        position_layout layout;
        std::size_t file = 0; // of files
    };
    std::vector<part> parts; // those with triangles, in the order in which load_gltf() gives their instances
    std::vector<std::filesystem::path> files; // the file itself, then those that it names
    std::vector<vertex_list> vertices;        // of each primitive once, those without triangles too
    std::vector<material> materials;          // as in the scene, without their textures
    std::vector<std::string> warnings;
};

// The file's scene as such parts, without reading their bytes. None if it is not made of them: with lines, strips,
// skins, morph targets, compression, sparse accessors, positions that are no floats, texture coordinates that are
// neither floats nor unsigned fractions, buffers in data URIs, or an animation. None, too, for a file that load_gltf()
// refuses.
[[nodiscard]] std::optional<gltf_parts> find_parts(const std::filesystem::path& file, const gltf_limits& limits = {},
                                                   const gltf_options& options = {});

// The textures that the options ask for of a file with parts, in the order of load_gltf().
struct gltf_textures {
    std::vector<material> materials; // those of the parts, with their textures
    std::vector<texture> textures;
    std::vector<picture> images;
    std::vector<std::string> warnings; // of these alone
};

// Decodes them one at a time; hooks.picture is called with a scene of materials alone. Throws gltf_error, and
// picture_memory_error where a picture does not fit.
[[nodiscard]] gltf_textures read_textures(const std::filesystem::path& file, const gltf_limits& limits,
                                          const gltf_options& options, const load_hooks& hooks);

} // namespace voxelize
