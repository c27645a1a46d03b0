// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace gi {

int scene_builder::add_texture(demo_model::texture t) {
    voxelize::picture p;
    p.name = t.name;
    p.width = static_cast<std::uint32_t>(t.width);
    p.height = static_cast<std::uint32_t>(t.height);
    p.rgba.resize(t.pixels.size() * 4);
    std::memcpy(p.rgba.data(), t.pixels.data(), p.rgba.size());
    made_.pictures.push_back(std::move(p));
    voxelize::texture entry;
    entry.image = static_cast<std::uint32_t>(made_.pictures.size() - 1);
    made_.textures.push_back(entry);
    return static_cast<int>(made_.textures.size() - 1);
}

void scene_builder::add(mesh triangles, const material& m, part_kind kind) {
    parts_.push_back({std::move(triangles), m, kind});
    if (kind == part_kind::sheet) parts_.back().look.density = 2.0f;
}

scene scene_builder::finish() {
    scene s = std::move(made_);
    s.low = glm::dvec3(1e30);
    s.high = glm::dvec3(-1e30);
    for (const part_kind kind : {part_kind::closed, part_kind::moving, part_kind::sheet}) {
        if (kind == part_kind::moving) s.first_moving = s.positions.size();
        for (const part& p : parts_) {
            if (p.kind != kind) continue;
            const auto first = static_cast<std::uint32_t>(s.positions.size());
            const auto number = static_cast<std::uint32_t>(s.materials.size());
            s.materials.push_back(p.look);
            const mesh& m = p.triangles;
            for (std::size_t i = 0; i < m.positions.size(); ++i) {
                const auto& at = m.positions[i];
                s.positions.emplace_back(at[0], at[1], at[2]);
                s.normals.emplace_back(m.normals[i][0], m.normals[i][1], m.normals[i][2]);
                s.texcoords.emplace_back(m.uvs[i][0], m.uvs[i][1]);
                s.colors.emplace_back(glm::vec3(m.colors[i][0], m.colors[i][1], m.colors[i][2]) / 255.0f);
                s.low = glm::min(s.low, glm::dvec3(s.positions.back()));
                s.high = glm::max(s.high, glm::dvec3(s.positions.back()));
            }
            for (std::size_t i = 0; i < m.indices.size(); i += 3) {
                s.triangles.emplace_back(first + m.indices[i], first + m.indices[i + 1], first + m.indices[i + 2]);
                s.triangle_materials.push_back(number);
            }
        }
        if (kind == part_kind::moving) {
            s.end_moving = s.positions.size();
            s.num_closed = s.triangles.size();
        }
    }
    return s;
}

mesh placed(mesh m, double degrees, vec3 by) {
    const double angle = degrees * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
    const auto turn = [&](std::array<float, 3>& p, const vec3& shift) {
        const double x = static_cast<double>(p[0]), z = static_cast<double>(p[2]);
        const auto on_lattice = [](double v) { return static_cast<float>(std::round(v * 65536) / 65536); };
        p = {on_lattice(c * x + s * z + shift.x), on_lattice(static_cast<double>(p[1]) + shift.y),
             on_lattice(c * z - s * x + shift.z)};
    };
    for (auto& p : m.positions) turn(p, by);
    for (auto& n : m.normals) turn(n, {});
    return m;
}

void add_hexahedron(mesh& m, const std::array<vec3, 8>& c) {
    m.add_quad(c[3], c[2], c[1], c[0]);
    m.add_quad(c[4], c[5], c[6], c[7]);
    for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t next = (i + 1) % 4;
        m.add_quad(c[i], c[next], c[next + 4], c[i + 4]);
    }
}

void set_sun(scene& s, const glm::vec3& direction, float radius, const glm::vec3& irradiance) {
    const glm::vec3 sun = glm::normalize(direction);
    s.light.position = glm::vec4(sun, 0.0f);
    s.light.side_u = radius * glm::normalize(glm::cross(sun, glm::vec3(0, 0, 1)));
    s.light.side_v = radius * glm::normalize(glm::cross(sun, s.light.side_u));
    s.light.color = irradiance;
}

mesh make_ball(double radius, int segments) {
    mesh m;
    m.add_patch(2 * segments, segments, [&](double u, double v) {
        const double around = 2 * std::numbers::pi * u, up = std::numbers::pi * (v - 0.5);
        const double r = v == 0 || v == 1 ? 0 : radius * std::cos(up);
        return demo_model::vertex{{r * std::sin(around), radius * std::sin(up), r * std::cos(around)}, {u, 1 - v}};
    });
    return m;
}

} // namespace gi
