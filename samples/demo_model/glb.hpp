// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Writes a scene as one binary glTF 2.0 file (.glb): meshes, materials, embedded PNG textures, a node hierarchy.
// The same scene gives the same bytes.

#include "geometry.hpp"
#include "textures.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace demo_model {

struct material {
    std::string name;
    std::array<double, 4> base_color{1, 1, 1, 1}; // linear
    std::optional<std::size_t> texture;           // index into scene::textures
    bool repeat = true;                           // how the texture continues outside 0..1
    bool cut_out = false;                         // alpha mode MASK at 0.5, seen from both sides
    double roughness = 0.9;
};

struct part { // a mesh with the material of its triangles
    mesh triangles;
    std::size_t material = 0;
};

struct node {
    std::string name;
    vec3 translation;
    double turn = 0; // degrees about y, counter-clockwise from above
    double scale = 1;
    std::optional<std::size_t> mesh; // index into scene::meshes
    std::vector<std::size_t> children;
};

struct scene {
    std::vector<texture> textures;
    std::vector<material> materials;
    struct named_mesh {
        std::string name;
        std::vector<part> parts;
    };
    std::vector<named_mesh> meshes; // may be used by several nodes
    std::vector<node> nodes;        // node 0 is the root
};

// Triangles of all nodes, a mesh counted as often as it is used.
[[nodiscard]] std::size_t num_triangles(const scene& s);

// Throws std::runtime_error with one line when the file cannot be written; it leaves no partial file then.
void write_glb(const scene& s, const std::filesystem::path& path);

} // namespace demo_model
