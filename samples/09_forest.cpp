// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A forest: one tree of a few hundred triangles, drawn 4000 times by one draw, each at its place, turned and as tall as
// its number says (forest.ppm). The positions are nowhere in memory but in the vertex shader.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct tree {
    glm::vec3 color;
};

VOXELPIPE_HD inline float random(std::uint32_t n) { // 0 to 1
    n = (n + 1) * 0x9e3779b9u;
    n = (n ^ n >> 16) * 0x85ebca6bu;
    n = (n ^ n >> 13) * 0xc2b2ae35u;
    return static_cast<float>((n ^ n >> 16) >> 8) * 0x1p-24f;
}
VOXELPIPE_HD inline float ground(float x, float z) {
    return 14.0f + 7.0f * std::sin(0.035f * x) + 6.0f * std::cos(0.041f * z + 0.6f);
}

// snippet: instances
struct plant {
    VOXELPIPE_HD auto operator()(const vp::vertex<glm::vec3>& v) const {
        const std::uint32_t n = 4 * v.instance;
        const float x = 252.0f * random(n) + 2.0f, z = 252.0f * random(n + 1) + 2.0f, turn = 6.28f * random(n + 2);
        const float size = 3.5f + 7.0f * random(n + 3), c = std::cos(turn), s = std::sin(turn);
        const glm::vec3 p = v.position;
        return vp::vertex_output{glm::vec3(x + size * 0.45f * (c * p.x - s * p.z), ground(x, z) + size * p.y,
                                           z + size * 0.45f * (s * p.x + c * p.z)),
                                 tree{(0.75f + 0.5f * random(n + 5)) *
                                      (random(n + 6) < 0.16f ? glm::vec3(3.4f, 1.25f, 0.55f) : glm::vec3(1.0f)) *
                                      vp::get<0>(v)}};
    }
};
// end snippet
struct hills {
    VOXELPIPE_HD auto operator()(const vp::vertex<glm::vec3>& v) const {
        return vp::vertex_output{glm::vec3(v.position.x, ground(v.position.x, v.position.z), v.position.z),
                                 tree{vp::get<0>(v)}};
    }
};
struct paint {
    VOXELPIPE_HD auto operator()(const vp::fragment<tree>& f) const { return vp::outputs(f.clamped_varyings().color); }
};

int main() {
    // A trunk and four cones with dented rims.
    std::vector<glm::vec3> positions, colors;
    std::vector<glm::uvec3> triangles;
    const auto cone = [&](float y0, float y1, float r0, float r1, const glm::vec3& color) {
        constexpr unsigned sides = 18;
        const auto first = static_cast<unsigned>(positions.size());
        for (unsigned s = 0; s < sides; ++s) {
            const float a = 6.28318531f * static_cast<float>(s) / sides, dent = s % 3 == 0 ? 0.8f : 1.0f;
            positions.emplace_back(r0 * dent * std::cos(a), y0, r0 * dent * std::sin(a));
            positions.emplace_back(r1 * std::cos(a), y1, r1 * std::sin(a));
            colors.insert(colors.end(), {0.75f * color, color});
            const unsigned p = first + 2 * s, q = first + 2 * ((s + 1) % sides);
            triangles.emplace_back(p, p + 1, q);
            triangles.emplace_back(q, p + 1, q + 1);
        }
    };
    cone(-0.1f, 0.5f, 0.16f, 0.1f, {0.36f, 0.25f, 0.16f});
    for (int i = 0; i < 4; ++i) {
        const float y = 0.3f + 0.4f * static_cast<float>(i);
        cone(y, y + 0.75f, 0.95f - 0.2f * static_cast<float>(i), 0.0f, {0.16f, 0.40f, 0.20f});
    }
    std::vector<glm::vec3> flat, grass;
    std::vector<glm::uvec3> squares;
    for (unsigned i = 0; i <= 64 * 65 + 64; ++i) {
        const unsigned column = i % 65, row = i / 65;
        flat.emplace_back(4.0f * static_cast<float>(column), 0.0f, 4.0f * static_cast<float>(row));
        grass.emplace_back(0.45f, 0.52f + 0.1f * random(i), 0.28f);
        if (column == 64 || row == 64) continue;
        squares.emplace_back(i, i + 65, i + 1);
        squares.emplace_back(i + 1, i + 65, i + 66);
    }

    vp::cpu_backend backend;
    const vp::mesh one{backend, positions, triangles, colors}, land{backend, flat, squares, grass};
    vp::grid grid;
    grid.extent = {256, 64, 256};
    vp::framebuffer<vp::cpu_backend, vp::target<glm::vec3, vp::blend::replace>> fb{backend, grid.extent};
    vp::get<0>(fb).clear(glm::vec3(-1.0f));
    vp::voxelize(backend, land, grid, hills{}, paint{}, fb).or_throw();
    vp::get<0>(fb).load();
    constexpr std::uint64_t trees = 4000;
    const vp::status s = vp::voxelize(backend, one.view(vp::instances{trees}), grid, plant{}, paint{}, fb).or_throw();
    picture::write("forest.ppm", grid.extent, vp::get<0>(fb).to_host_target(backend),
                   {.along = {-0.62f, -0.38f, -1.0f}, .zoom = 1.5f, .aspect = 1.6f});
    std::printf("%zu triangles, %llu instances of them in %llu voxels\n", triangles.size(),
                static_cast<unsigned long long>(trees), static_cast<unsigned long long>(s.counts.voxels));
    return s.counts.triangles_in == trees * triangles.size() && s.counts.voxels > 100000 ? 0 : 1;
}
