// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A bowl of a given thickness from a surface without any: a geometry program makes a closed prism of each triangle,
// from the surface to its offset along the vertices' normals. The prisms are solid together: voxelize_solid fills them
// (shell.ppm, cut open).
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct surface {
    glm::vec3 normal;
};
using vertex = vp::vertex_output<surface>;

struct with_normal {
    VOXELPIPE_HD vertex operator()(const vp::vertex<glm::vec3>& v) const {
        return {v.position, surface{vp::get<0>(v)}};
    }
};

struct prism { // a geometry program: the triangle, its offset, and three walls; closed and outward
    float thickness;
    VOXELPIPE_HD auto operator()(const vp::triangle<surface>& t) const {
        vp::triangles<8, surface> out;
        vertex lifted[3];
        for (int i = 0; i < 3; ++i)
            lifted[i] = {vp::exact::along(t.vertices[i].position, t.vertices[i].varyings.normal, thickness),
                         t.vertices[i].varyings};
        out.add(t.vertices[2], t.vertices[1], t.vertices[0]);
        out.add(lifted[0], lifted[1], lifted[2]);
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            out.add(t.vertices[i], t.vertices[j], lifted[j]);
            out.add(t.vertices[i], lifted[j], lifted[i]);
        }
        return out;
    }
};

int main() {
    // A wavy bowl: a disc of rings, bent upward.
    constexpr unsigned rings = 48, sides = 96;
    const auto place = [](float r, float a) {
        const float wave = 1.0f + 0.06f * std::sin(8.0f * a) * r;
        return glm::vec3(64.0f + 52.0f * r * wave * std::cos(a), 22.0f + 62.0f * r * r * wave,
                         64.0f + 52.0f * r * wave * std::sin(a));
    };
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::uvec3> triangles;
    for (unsigned i = 0; i <= rings; ++i)
        for (unsigned s = 0; s < sides; ++s) {
            const float r = 0.02f + 0.98f * static_cast<float>(i) / rings,
                        a = 6.28318531f * static_cast<float>(s) / sides;
            positions.push_back(place(r, a));
            normals.push_back(glm::normalize(
                glm::cross(place(r, a + 1e-2f) - place(r, a - 1e-2f), place(r + 1e-2f, a) - place(r - 1e-2f, a))));
            if (i == rings) continue;
            const unsigned p = i * sides + s, q = i * sides + (s + 1) % sides;
            triangles.emplace_back(p, q, p + sides);
            triangles.emplace_back(q, q + sides, p + sides);
        }

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, positions, triangles, normals};
    vp::grid grid;
    grid.extent = {128, 112, 128};
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{backend, grid.extent};
    vp::solid_options options;
    options.rule = vp::fill_rule::nonzero; // prisms overlap where the surface bends
    std::uint64_t voxels[2]{};
    for (const float thickness : {2.0f, 5.0f}) {
        const vp::status s = vp::voxelize_solid(backend, mesh, grid, with_normal{}, vp::geometry{prism{thickness}},
                                                vp::constant(true), fb, options)
                                 .or_throw();
        voxels[thickness > 3.0f] = s.counts.voxels;
        std::printf("thickness %.0f: %llu triangles, %llu voxels, %llu open rows\n", static_cast<double>(thickness),
                    static_cast<unsigned long long>(s.counts.triangles_in),
                    static_cast<unsigned long long>(s.counts.voxels),
                    static_cast<unsigned long long>(s.solid.open_rows));
        if (s.solid.open_rows != 0 || s.counts.triangles_in != 8 * triangles.size()) return 1;
    }
    const auto inside = vp::get<0>(fb).to_host_target(backend);
    picture::write("shell.ppm", grid.extent, [&](int x, int y, int z) {
        const bool is_cut = x > 64 && z > 64;
        if (is_cut || !inside(x, y, z)) return glm::vec3(-1.0f);
        const bool is_face = (x == 64 && z >= 64) || (z == 64 && x >= 64); // where it is cut
        return is_face ? glm::vec3(0.9f, 0.45f, 0.3f) : glm::vec3(0.45f, 0.66f, 0.72f);
    });
    return voxels[1] > 2 * voxels[0] && voxels[1] < 3 * voxels[0] ? 0 : 1;
}
