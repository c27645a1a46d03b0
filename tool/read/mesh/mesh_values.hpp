// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What scenes and streams of a mesh_reader have in common.

#include "mesh_reader.hpp"
#include "model/placement.hpp"
#include "read/assimp/pictures.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace voxelize {

// True if floats keep it finite.
[[nodiscard]] inline bool is_float(double value) { return std::abs(value) <= std::numeric_limits<float>::max(); }

// Takes a position that can be drawn.
inline void include_position(bounding_box& box, const glm::dvec3& p) {
    if (is_float(p.x) && is_float(p.y) && is_float(p.z)) box.include({p, p, false});
}

[[nodiscard]] inline affine translation(const glm::dvec3& by) {
    affine result;
    for (std::size_t r = 0; r < 3; ++r) result.m[r][3] = by[static_cast<glm::length_t>(r)];
    return result;
}

// Materials whose textures are wanted.
[[nodiscard]] inline std::vector<bool> asked_for_textures(const mesh_description& of, const gltf_options& options) {
    std::vector<bool> asked(of.materials.size());
    for (const mesh_part& part : of.parts)
        asked[part.material] =
            part.material < of.textures.size() &&
            assimp::asks_for_texture(of.materials[part.material], of.textures[part.material], options);
    return asked;
}

// In place of a face's colour: those of its vertices count.
inline constexpr glm::vec4 no_face_color{-1.0F};

// As triangles have it.
[[nodiscard]] inline glm::vec2 turned(const glm::vec2& texcoord) {
    return transformed(upside_down, static_cast<double>(texcoord.x), static_cast<double>(texcoord.y));
}

} // namespace voxelize
