// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Builds a scene out of meshes of the demo model's shapes.

#include "scene.hpp"

#include "demo_model/geometry.hpp"
#include "demo_model/textures.hpp"

#include <array>
#include <vector>

namespace gi {

using demo_model::mesh;
using demo_model::vec3;

enum class part_kind { closed, sheet, moving }; // moving parts are closed

class scene_builder {
public:
    int add_texture(demo_model::texture t); // returns its number
    void add(mesh triangles, const material& m, part_kind kind = part_kind::closed);
    // The scene with these parts; bounds are those of all vertices at rest. Empty bounds are the caller's fault.
    [[nodiscard]] scene finish();

private:
    struct part {
        mesh triangles;
        material look;
        part_kind kind;
    };
    std::vector<part> parts_;
    scene made_;
};

// The mesh turned by `degrees` about the y axis, counter-clockwise from above, then moved.
[[nodiscard]] mesh placed(mesh m, double degrees, vec3 by);
// A box with eight corners of any place: those of the low y, counter-clockwise from above, then those above them.
void add_hexahedron(mesh& m, const std::array<vec3, 8>& corners);
// Lights the scene by a sun in that direction, whose disc at distance 1 has that radius.
void set_sun(scene& s, const glm::vec3& direction, float radius, const glm::vec3& irradiance);
[[nodiscard]] mesh make_ball(double radius, int segments = 32);

} // namespace gi
