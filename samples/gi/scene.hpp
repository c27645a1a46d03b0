// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The scene of gi: triangles with materials, one light, a sky, an object that moves and a camera that turns. In plain
// vectors on the host, in the scene's own units, y up.

#include "model/scene.hpp"

#include <glm/glm.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace gi {

struct material {
    glm::vec3 color{0.8f};      // linear; multiplies the texture and the vertices' colours
    glm::vec3 emission{0.0f};   // radiance
    float roughness = 1.0f;     // 0 to 1; 1 has no reflection but the diffuse one
    float metallic = 0.0f;      // 0 to 1
    int texture = -1;           // index into scene::textures
    int roughness_texture = -1; // G, linear, multiplies the roughness, B the metallic factor
    int emission_texture = -1;  // multiplies the emission
    float cutoff = -1.0f;       // fragments whose alpha is less are cut off
    bool is_light = false;      // shows scene::light: its emission is for the eye, shadow rays bring it to surfaces
    // Opacity of a voxel whose eighths are all filled. 1 for closed parts, whose inside is filled; 2 for sheets, which
    // fill half of a voxel at most.
    float density = 1.0f;
};

// One light: the sun, if position.w is 0, or a rectangle.
struct light {
    glm::vec4 position{0, 1, 0, 0}; // unit vector towards the sun, or the rectangle's centre
    glm::vec3 side_u{0.0f};         // half of its sides; for the sun, of a disc at distance 1
    glm::vec3 side_v{0.0f};
    glm::vec3 color{0.0f}; // irradiance across the sun's rays, or the rectangle's radiance
};

struct camera {
    glm::dvec3 eye{0, 0, 1}, target{0};
    double field_of_view = 60; // degrees, from top to bottom
};

struct scene {
    std::vector<glm::vec3> positions, normals, colors; // of vertices
    std::vector<glm::vec2> texcoords;
    std::vector<glm::uvec3> triangles;             // closed parts first
    std::vector<std::uint32_t> triangle_materials; // one per triangle
    std::size_t num_closed = 0;                    // triangles of closed parts, wound counter-clockwise from outside
    std::size_t first_moving = 0, end_moving = 0;  // vertices that move
    std::vector<material> materials;
    std::vector<voxelize::texture> textures;
    std::vector<voxelize::picture> pictures;
    std::vector<std::string> warnings;

    gi::light light;
    glm::vec3 sky_above{0.0f}, sky_level{0.0f}; // radiance of the sky at the zenith and below the horizon
    float exposure = 1.0f;
    // Half of the width of cones' samples at most, in the scene's units; 0: no limit. Samples wider than 1.4 times a
    // wall let some light through it; narrower ones take less of what is far away, which gives stripes.
    double wall = 0;
    glm::dvec3 low{0.0}, high{1.0}; // bounds of all that is drawn at any time

    // Both for a time of 0 to 1, at which they return to their start.
    std::function<glm::dvec3(double)> motion = [](double) { return glm::dvec3(0.0); }; // of the moving vertices
    std::function<gi::camera(double)> view = [](double) { return camera{}; };
};

// A room with a red and a green wall, two blocks, a gold ball, and a glowing ball that goes round them.
[[nodiscard]] scene make_cornell();
// A colonnade of two storeys around a court, with curtains, in the sun; a lantern floats through it.
[[nodiscard]] scene make_atrium();
// A model's file in front of a camera that turns around it, under a sky, with a glowing ball that goes round it. Throws
// voxelize::model_error, and std::bad_alloc.
[[nodiscard]] scene load_scene(const std::filesystem::path& file);

} // namespace gi
