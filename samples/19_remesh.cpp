// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A closed mesh out of triangle soup: a bracket of parts that cross each other, one of them open, becomes
// one closed surface that keeps its creases (remesh.ppm; right of it the same with rounded ones). Checks that
// every edge has two faces, and prints what was made.
#include "mesh_picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cmath>
#include <cstdio>
#include <vector>

namespace vp = voxelpipe;

struct soup {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    // A prism over a polygon of n corners in the plane of two axes, with `caps` of its two ends.
    template <class Place>
    void add_prism(unsigned n, unsigned caps, const Place& place) {
        const auto first = static_cast<unsigned>(positions.size());
        for (unsigned end = 0; end < 2; ++end) {
            for (unsigned i = 0; i < n; ++i)
                positions.push_back(place(6.2831853f * (static_cast<float>(i) + 0.5f) / static_cast<float>(n), end));
            glm::vec3 middle(0.0f);
            for (unsigned i = 0; i < n; ++i) middle += positions[first + end * (n + 1) + i] / static_cast<float>(n);
            positions.push_back(middle);
        }
        const auto add = [&](unsigned a, unsigned b, unsigned c) {
            triangles.emplace_back(first + a, first + b, first + c);
        };
        for (unsigned i = 0; i < n; ++i) {
            const unsigned j = (i + 1) % n, up = n + 1;
            add(i, j, i + up);
            add(j, j + up, i + up);
            if (caps > 0) add(j, i, n);
            if (caps > 1) add(i + up, j + up, n + up);
        }
    }
};

int main() {
    soup part;
    const auto square = [](float angle) { // of the unit square, from a circle
        return glm::vec2(std::cos(angle) > 0 ? 1.0f : -1.0f, std::sin(angle) > 0 ? 1.0f : -1.0f);
    };
    part.add_prism(4, 2, [&](float a, unsigned end) { // the foot
        return glm::vec3(34.0f * square(a).y, end == 0 ? -21.0f : -13.0f, 21.0f * square(a).x);
    });
    part.add_prism(4, 2, [&](float a, unsigned end) { // the wall
        return glm::vec3(end == 0 ? -34.3f : -25.2f, 3.0f + 24.0f * square(a).x, 15.4f * square(a).y);
    });
    part.add_prism(6, 2, [](float a, unsigned end) { // a nut
        return glm::vec3(12.0f + 11.0f * std::sin(a), end == 0 ? -15.0f : 1.5f, 11.0f * std::cos(a));
    });
    part.add_prism(48, 1, [](float a, unsigned end) { // a pin, open at the end that lies in the wall
        return glm::vec3(end == 0 ? 21.0f : -29.0f, 14.0f + 6.5f * std::sin(a), 6.5f * std::cos(a));
    });

    vp::cpu_backend backend;
    const vp::mesh mesh{backend, part.positions, part.triangles};
    const vp::grid grid = vp::fit(part.positions, glm::ivec3(72), 0.05);
    // snippet: remesh
    vp::surface<vp::cpu_backend> sharp(backend), mean(backend);
    const vp::status status =
        vp::remesh(backend, mesh, grid, vp::passthrough{}, sharp, {.repair = vp::repair::close_holes}).or_throw();
    vp::remesh(backend, mesh, grid, vp::passthrough{}, mean,
               {.place = vp::place::mean, .repair = vp::repair::close_holes})
        .or_throw();
    std::printf("%llu vertices, %llu triangles, %llu parts\n", static_cast<unsigned long long>(status.surface.vertices),
                static_cast<unsigned long long>(status.surface.faces),
                static_cast<unsigned long long>(status.surface.components));
    // end snippet
    mesh_picture::mesh both;
    bool closed = true;
    for (const auto* const s : {&sharp, &mean}) {
        mesh_picture::mesh m;
        for (const vp::surface_vertex& v : s->vertices.to_host(backend))
            m.positions.emplace_back(vp::position(s->samples, v));
        m.triangles = s->triangles.to_host(backend);
        m.colors.assign(m.positions.size(), glm::vec3(0.80f, 0.42f, 0.11f));
        closed = closed && mesh_picture::is_closed(m.triangles);
        both.add(m, s == &mean ? glm::vec3(40.0f, 0.0f, -20.0f) : glm::vec3(-40.0f, 0.0f, 20.0f));
    }
    std::printf("closed: %s, crossings on closed holes: %llu, made up: %llu\n", closed ? "yes" : "no",
                static_cast<unsigned long long>(status.surface.cone_crossings),
                static_cast<unsigned long long>(status.surface.made_crossings));
    const mesh_picture::scene scene(both, {-0.5f, -0.6f, -1.0f}, 1.07f, 2.0f);
    picture::write_pixels("remesh.ppm", 2.0f,
                          [&](float x, float y, const glm::vec2& noise) { return scene.look(x, y, noise); });
    return closed && status.surface.components == 1 && status.surface.made_crossings == 0 ? 0 : 1;
}
