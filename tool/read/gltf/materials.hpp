// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// glTF materials -> the base colour part of them, and where it is asked for what lights need, with their textures. A
// texture that cannot be had is a warning, not an error: no geometry is lost, the colour factor stands alone.

#include "accessor.hpp"

#include "model/scene.hpp"
#include "model/texture_transform.hpp"

#include <tiny_gltf.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace voxelize::gltf {

// The way from a primitive's attributes to the textures of its material.
struct texture_coordinates {
    int set = 0; // TEXCOORD_<set>
    texture_transform m = no_texture_transform;
    friend bool operator==(const texture_coordinates&, const texture_coordinates&) = default;
};

class material_reader {
public:
    material_reader(const tinygltf::Model& model, const accessor_reader& accessors, const resources& bytes,
                    const gltf_options& options, scene& result)
        : model_{model}, accessors_{accessors}, bytes_{bytes}, options_{options}, scene_{result},
          wanted_(model.materials.size()), users_(bytes.image_count()), texture_of_(model.textures.size()),
          image_of_(bytes.image_count()) {}

    // Fills scene.materials with the file's, all without their textures.
    void read_factors();

    // Called for each primitive that is read: the coordinates of its material's textures, or nothing if it has none.
    // Decodes nothing yet.
    [[nodiscard]] std::optional<texture_coordinates> want_texture(std::size_t material);

    // Called when all primitives are read: decodes the textures that they want, in the order in which they were asked
    // for, and sets the material's numbers of them. Primitives whose texture cannot be had lose their coordinates.
    void read_textures(const load_hooks& hooks);

private:
    struct wanted_texture {
        const tinygltf::TextureInfo* info;
        std::int32_t material::*field;
        const char* name; // in the file
    };
    // Those of a material that the options ask for, the base colour's first.
    [[nodiscard]] std::vector<wanted_texture> textures_of(std::size_t material) const;
    void leave_out(std::size_t material, const wanted_texture& wanted);
    [[nodiscard]] std::int32_t scene_texture(std::size_t texture, const load_hooks& hooks);
    // INSTEAD says in the warning what is done without the picture.
    [[nodiscard]] std::int32_t scene_image(std::size_t image, const char* instead, const load_hooks& hooks);

    const tinygltf::Model& model_;
    const accessor_reader& accessors_;
    const resources& bytes_;
    const gltf_options& options_;
    scene& scene_;
    std::vector<bool> wanted_;                      // by material: its texture is asked for
    std::vector<std::size_t> queue_;                // materials whose texture is asked for, in that order
    std::vector<std::vector<std::uint32_t>> users_; // by picture: the materials that may show it
    // glTF index -> scene index once it has been tried; material::no_texture where it cannot be had.
    std::vector<std::optional<std::int32_t>> texture_of_;
    std::vector<std::optional<std::int32_t>> image_of_;
};

} // namespace voxelize::gltf
