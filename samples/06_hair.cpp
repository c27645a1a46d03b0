// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A ball of curls: strips of line segments, which a geometry program turns into tubes of six sides (hair.ppm). The same
// curls as bare segments, one voxel thick, need no program.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdio>

namespace vp = voxelpipe;

struct hair {
    glm::vec3 color;
    float radius;
};
using vertex = vp::vertex_output<hair>;

struct comb { // positions, colours and radii of the curls' vertices
    VOXELPIPE_HD vertex operator()(const vp::vertex<glm::vec3, float>& v) const {
        return {v.position, hair{vp::get<0>(v), vp::get<1>(v)}};
    }
};

// snippet: geometry
struct tube { // a geometry program: a segment becomes a prism of six sides
    VOXELPIPE_HD vp::triangles<12, hair> operator()(const vp::line<hair>& l) const {
        const vertex &a = l.vertices[0], &b = l.vertices[1];
        const glm::vec3 along = b.position - a.position;
        const glm::vec3 other = glm::abs(along.x) < glm::abs(along.y) ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
        const glm::vec3 u = glm::normalize(glm::cross(along, other)), v = glm::normalize(glm::cross(along, u));
        vp::triangles<12, hair> out;
        const auto corner = [&](const vertex& end, int i) {
            const float x[] = {1.0f, 0.5f, -0.5f, -1.0f, -0.5f, 0.5f},
                        y[] = {0.0f, 0.866f, 0.866f, 0.0f, -0.866f, -0.866f};
            const float r = end.varyings.radius;
            return vertex{vp::exact::along(vp::exact::along(end.position, u, r * x[i % 6]), v, r * y[i % 6]),
                          end.varyings};
        };
        for (int i = 0; i < 6; ++i) {
            out.add(corner(a, i), corner(b, i), corner(b, i + 1));
            out.add(corner(a, i), corner(b, i + 1), corner(a, i + 1));
        }
        return out;
    }
};
// end snippet

struct paint {
    VOXELPIPE_HD auto operator()(const vp::fragment<hair>& f) const {
        const float light = 0.8f + 0.2f * glm::abs(f.normal.y);
        return vp::outputs(f.triangle + 1, light * f.clamped_varyings().color);
    }
};

int main() {
    constexpr int curls = 1600, points = 20;
    const glm::vec3 center(80, 78, 80);
    std::vector<glm::vec3> positions, colors;
    std::vector<float> radii;
    std::vector<std::uint32_t> segments;
    for (int c = 0; c < curls; ++c) {
        const float y = 1.0f - 2.0f * (static_cast<float>(c) + 0.5f) / curls,
                    turn = 2.39996323f * static_cast<float>(c);
        const float r = std::sqrt(1.0f - y * y), shade = 0.75f + 0.25f * std::sin(5.1f * turn);
        const glm::vec3 out(r * std::cos(turn), y, r * std::sin(turn));
        const glm::vec3 side = glm::normalize(glm::cross(out, glm::vec3(0.3f, 1.0f, 0.2f))), up = glm::cross(out, side);
        for (int p = 0; p < points; ++p) { // it grows outward, then hangs
            const float t = static_cast<float>(p) / (points - 1), w = 6.0f * t + 3.0f * turn;
            const glm::vec3 curl = 2.6f * t * (std::cos(w) * side + std::sin(w) * up);
            positions.push_back(center + (34.0f + 38.0f * t - 9.0f * t * t) * out + curl - glm::vec3(0, 30 * t * t, 0));
            colors.push_back(shade * glm::mix(glm::vec3(0.26f, 0.20f, 0.52f), glm::vec3(0.98f, 0.66f, 0.55f), t * t));
            radii.push_back(1.3f - 0.9f * t);
            const auto at = static_cast<std::uint32_t>(positions.size() - 1);
            if (p + 1 < points) segments.insert(segments.end(), {at, at + 1});
        }
    }

    vp::cpu_backend backend;
    const vp::lines_view<glm::vec3, float> lines{
        .positions = positions,
        .indices = segments,
        .attributes = vp::core::make_pack(vp::array_view<const glm::vec3>(colors), vp::array_view<const float>(radii))};
    vp::grid grid;
    grid.extent = {160, 150, 160};
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint32_t, vp::blend::max>, vp::target<glm::vec3, vp::blend::max>>
        fb{backend, grid.extent};
    vp::get<1>(fb).clear(glm::vec3(-1.0f));
    const vp::status tubes =
        vp::voxelize(backend, lines, grid, comb{}, vp::geometry{tube{}}, paint{}, fb, vp::coverage::conservative)
            .or_throw();
    const auto fur = vp::get<1>(fb).to_host_target(backend);
    picture::write("hair.ppm", grid.extent,
                   [&](int x, int y, int z) {
                       const glm::vec3 at(x, y, z);
                       for (const float eye : {-15.0f, 15.0f}) { // it looks at the camera
                           const glm::vec3 ball = center + glm::vec3(20.0f + eye, 18.0f, 52.0f - 0.55f * eye);
                           if (glm::length(at - ball - glm::vec3(4, 2, 9)) < 6.0f) return glm::vec3(0.05f);
                           if (glm::length(at - ball) < 12.0f) return glm::vec3(0.97f);
                       }
                       return fur(x, y, z);
                   },
                   {.zoom = 1.3f});

    const vp::status bare =
        vp::voxelize(backend, lines, grid, comb{}, vp::constant(1u, glm::vec3(1.0f)), fb, vp::coverage::thin)
            .or_throw();
    const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
    std::printf("%zu segments: %llu triangles in %llu voxels as tubes, %llu voxels as bare segments\n",
                segments.size() / 2, count(tubes.counts.triangles_in), count(tubes.counts.voxels),
                count(bare.counts.voxels));
    return tubes.counts.triangles_in == 12 * (segments.size() / 2) && bare.counts.voxels < tubes.counts.voxels ? 0 : 1;
}
