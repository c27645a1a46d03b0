// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The meshes of the golden hashes: within [-8, 8]^3, coordinates in steps of 1/1024, made with integers alone, as
// those of ../meshes.hpp. Never change one: its hashes would lose their reference.

#include "../meshes.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace golden {

// The greatest integer whose square is at most n.
inline std::int64_t floor_root(std::int64_t n) {
    std::int64_t root = 0;
    for (std::int64_t bit = std::int64_t{1} << 31; bit != 0; bit >>= 1)
        if ((root | bit) <= n / (root | bit)) root |= bit;
    return root;
}

// A direction scaled to the length `radius`, in steps, rounded towards zero. Components of at most 64, a radius of at
// most 2^14.
inline std::array<std::int64_t, 3> scaled(const std::array<std::int64_t, 3>& direction, std::int64_t radius) {
    const auto [x, y, z] = direction;
    const std::int64_t length = floor_root((x * x + y * y + z * z) << 40);
    return {(x * radius << 20) / length, (y * radius << 20) / length, (z * radius << 20) / length};
}

inline glm::vec3 from_steps(const std::array<std::int64_t, 3>& p) {
    return {static_cast<float>(p[0]) / 1024.0f, static_cast<float>(p[1]) / 1024.0f, static_cast<float>(p[2]) / 1024.0f};
}

// A cube of n * n squares a face, blown up to a sphere around the origin; closed, vertices along the cube's edges are
// there two or three times. radius in steps. Squares (i + 2 j + face) % leave_out == 0 of each face are left out, none
// with 0.
inline mesh_data sphere(int n, std::int64_t radius, bool inside_out, int leave_out = 0) {
    generator random(5);
    mesh_data m;
    for (int face = 0; face < 6; ++face) {
        const auto axis = static_cast<std::size_t>(face % 3);
        const bool far = face >= 3;
        const auto first = static_cast<std::uint32_t>(m.positions.size()), row = static_cast<std::uint32_t>(n) + 1;
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) {
                std::array<std::int64_t, 3> d{};
                d[axis] = far ? n : -n;
                d[(axis + 1) % 3] = 2 * i - n;
                d[(axis + 2) % 3] = 2 * j - n;
                push_vertex(m, from_steps(scaled(d, radius)), random);
            }
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                if (leave_out != 0 && (i + 2 * j + face) % leave_out == 0) continue;
                const std::uint32_t a = first + static_cast<std::uint32_t>(j) * row + static_cast<std::uint32_t>(i);
                const bool turned = far == inside_out;
                m.triangles.push_back(turned ? glm::uvec3(a, a + row + 1, a + 1) : glm::uvec3(a, a + 1, a + row + 1));
                m.triangles.push_back(turned ? glm::uvec3(a, a + row, a + row + 1)
                                             : glm::uvec3(a, a + row + 1, a + row));
            }
    }
    return m;
}

// Around the z axis, moved off the grid's symmetries; radii in steps. 4 n_ring times 4 n_tube squares.
inline mesh_data torus(int n_ring, int n_tube, std::int64_t ring, std::int64_t tube) {
    generator random(6);
    // Point i of 4 n on a circle: of a square's outline, moved onto the circle.
    const auto on_circle = [](int n, int i, std::int64_t radius) {
        const int side = i / n % 4, t = 2 * (i % n) - n;
        constexpr std::array<std::array<int, 4>, 4> turns{{{1, 0, 0, 1}, {0, -1, 1, 0}, {-1, 0, 0, -1}, {0, 1, -1, 0}}};
        const auto& r = turns[static_cast<std::size_t>(side)];
        return scaled({r[0] * n + r[1] * t, r[2] * n + r[3] * t, 0}, radius);
    };
    mesh_data m;
    const int rings = 4 * n_ring, tubes = 4 * n_tube;
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < tubes; ++j) {
            const auto a = on_circle(n_ring, i, 4096), b = on_circle(n_tube, j, tube);
            const std::int64_t reach = ring + b[0];
            push_vertex(m, from_steps({a[0] * reach / 4096 + 131, a[1] * reach / 4096 - 77, b[1] + 389}), random);
        }
    const auto vertex = [&](int i, int j) { return static_cast<std::uint32_t>(i % rings * tubes + j % tubes); };
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < tubes; ++j) {
            m.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
            m.triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
        }
    return m;
}

// Triangles of every size; among them slivers, segments, points, equal ones, far ones, and vertices that are no
// numbers.
inline mesh_data broken_soup() {
    mesh_data m = soup(11, 240, 6, -8, 4);
    constexpr float step = 1.0f / 1024.0f;
    for (std::uint32_t t = 0; t < 240; ++t) {
        glm::vec3* const p = m.positions.data() + 3 * t;
        if (t % 5 == 1) p[2] = p[1] + glm::vec3(step, 0, -step);             // a sliver
        if (t % 9 == 2) p[2] = p[1];                                         // a segment
        if (t % 31 == 3) p[1] = p[2] = p[0];                                 // a point
        if (t % 17 == 4) m.triangles[t] = {3 * t - 3, 3 * t - 1, 3 * t - 2}; // the one before, turned over
        if (t % 61 == 5) p[1].y = std::numeric_limits<float>::quiet_NaN();
        if (t % 67 == 6) p[0].x = 1e30f;
        if (t % 59 == 7) p[2] = glm::vec3(4000, -3000, 2000); // far larger than the grid
    }
    return m;
}

inline void append(mesh_data& to, const mesh_data& from) {
    const auto first = static_cast<std::uint32_t>(to.positions.size());
    to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
    to.colors.insert(to.colors.end(), from.colors.begin(), from.colors.end());
    to.texcoords.insert(to.texcoords.end(), from.texcoords.begin(), from.texcoords.end());
    for (const glm::uvec3& t : from.triangles) to.triangles.push_back(t + first);
}

// Three spheres in each other, the inner two inside out: winding numbers 1, 0 and -1 from outside to inside.
inline std::vector<mesh_data> shells() {
    return {sphere(6, 7900, false), sphere(5, 5300, true), sphere(3, 2600, true)};
}
inline mesh_data all_shells() {
    mesh_data m;
    for (const mesh_data& s : shells()) append(m, s);
    return m;
}

struct named_mesh {
    std::string name;
    mesh_data data;
};
// In an order that stays.
inline const std::vector<named_mesh>& hashed_meshes() {
    static const std::vector<named_mesh> all{{"sphere", sphere(7, 7800, false)},
                                             {"torus", torus(6, 3, 5200, 2100)},
                                             {"soup", broken_soup()},
                                             {"shells", all_shells()},
                                             {"open", sphere(6, 7700, false, 7)}};
    return all;
}
inline const mesh_data& hashed_mesh(const std::string& name) {
    for (const named_mesh& m : hashed_meshes())
        if (m.name == name) return m.data;
    static const mesh_data none;
    return none;
}

} // namespace golden
