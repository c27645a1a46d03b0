// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A machined part whose creases stay: a flange with a hub, ribs, a bore with a keyway and counterbored holes. Holes are
// prisms turned inside out, which subtract where what counts is winding above 0. On the left of creases.ppm vertices
// lie where the part's planes meet, on the right at the mean of a cell's crossings. Checks that both are closed, and
// measures how far their vertices lie from the part's faces.
#include "mesh_picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

namespace vp = voxelpipe;

constexpr float full_turn = 6.2831853f;

struct solids {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    // A prism from a polygon, counter-clockwise, to the same one further along; its front is outside.
    void add_prism(const std::vector<glm::vec3>& polygon, const glm::vec3& along, bool is_hole) {
        const auto first = static_cast<unsigned>(positions.size()), n = static_cast<unsigned>(polygon.size());
        for (const glm::vec3& p : polygon) positions.push_back(p);
        for (const glm::vec3& p : polygon) positions.push_back(p + along);
        const auto add = [&](unsigned a, unsigned b, unsigned c) {
            triangles.emplace_back(first + a, first + (is_hole ? c : b), first + (is_hole ? b : c));
        };
        for (unsigned i = 0; i < n; ++i) {
            const unsigned j = (i + 1) % n;
            add(i, j, i + n);
            add(j, j + n, i + n);
            if (i > 1) add(0, i, i - 1);
            if (i > 1) add(n, n + i - 1, n + i);
        }
    }
    // A cylinder of n sides that stands on (x, low, z).
    void add_cylinder(unsigned n, float x, float z, float radius, float low, float high, bool is_hole = false) {
        std::vector<glm::vec3> circle;
        for (unsigned i = 0; i < n; ++i) {
            const float turn = -full_turn * (static_cast<float>(i) + 0.5f) / static_cast<float>(n);
            circle.emplace_back(x + radius * std::cos(turn), low, z + radius * std::sin(turn));
        }
        add_prism(circle, glm::vec3(0.0f, high - low, 0.0f), is_hole);
    }
};

int main() {
    constexpr unsigned sides = 96, hole_sides = 48;
    solids body, holes;
    body.add_cylinder(sides, 0, 0, 30.0f, 0.0f, 7.3f);
    body.add_cylinder(sides, 0, 0, 15.2f, 7.3f, 25.1f);
    for (int i = 0; i < 6; ++i) {
        const float turn = full_turn * (static_cast<float>(i) + 0.5f) / 6.0f;
        const glm::vec3 out(std::cos(turn), 0.0f, std::sin(turn)), side(-out.z, 0.0f, out.x), up(0, 1, 0);
        const auto rib = [&](float r, float y) { return r * out + y * up - 1.7f * side; };
        body.add_prism({rib(27.5f, 5.0f), rib(27.5f, 8.5f), rib(15.0f, 21.0f), rib(12.0f, 21.0f), rib(12.0f, 5.0f)},
                       3.4f * side, false);
        const float across = turn + full_turn / 12.0f, x = 22.6f * std::cos(across), z = 22.6f * std::sin(across);
        holes.add_cylinder(hole_sides, x, z, 2.9f, -3.0f, 6.0f, true);
        holes.add_cylinder(hole_sides, x, z, 4.7f, 4.1f, 12.0f, true);
    }
    holes.add_cylinder(sides, 0, 0, 9.1f, -3.0f, 30.0f, true);
    holes.add_prism({{5, -3, 2.3f}, {12.3f, -3, 2.3f}, {12.3f, -3, -2.3f}, {5, -3, -2.3f}}, {0, 33, 0}, true);

    vp::cpu_backend backend;
    const vp::mesh of_body{backend, body.positions, body.triangles},
        of_holes{backend, holes.positions, holes.triangles};
    const vp::grid grid = vp::fit(body.positions, glm::ivec3(picture::is_fine() ? 90 : 60), 0.04);
    // snippet: creases
    using painter = vp::constant_output<glm::vec3>; // any fragment shader
    const std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, painter>> draws{
        {of_body.view(), {}, vp::constant(glm::vec3(0.10f, 0.27f, 0.42f))},   // painted
        {of_holes.view(), {}, vp::constant(glm::vec3(0.62f, 0.60f, 0.56f))}}; // bare metal
    vp::surface<vp::cpu_backend, glm::vec3> sharp(backend), mean(backend);
    vp::remesh(backend, draws, grid, sharp, {.rule = vp::fill_rule::positive}).or_throw();
    vp::remesh(backend, draws, grid, mean, {.place = vp::place::mean, .rule = vp::fill_rule::positive}).or_throw();
    // end snippet

    bool good = true;
    double off[2]{}; // means of the vertices' distances from the part's faces, in voxels
    mesh_picture::mesh both;
    for (const auto* const s : {&sharp, &mean}) {
        mesh_picture::mesh m;
        for (const vp::surface_vertex& v : s->vertices.to_host(backend))
            m.positions.emplace_back(vp::position(s->samples, v));
        m.triangles = s->triangles.to_host(backend);
        m.colors = vp::get<0>(*s).to_host(backend);
        std::vector<float> distances(m.positions.size());
        vp::distance_at(backend, std::span(draws), grid, vp::array_view<const glm::vec3>(m.positions),
                        {.distances = distances.data()}, {.sign = vp::distance_sign::none})
            .or_throw();
        double& sum = off[s == &mean ? 1 : 0];
        for (const float d : distances)
            sum += static_cast<double>(d) / grid.voxel_size.x / static_cast<double>(distances.size());
        good = good && mesh_picture::is_closed(m.triangles);
        both.add(m, glm::vec3(s == &mean ? 32.0f : -32.0f, 0.0f, 0.0f));
    }
    std::printf("%zu vertices; off the part's faces by %.4f voxels on average, by %.4f at means\n",
                sharp.vertices.size(), off[0], off[1]);
    good = good && off[0] < 0.2 * off[1];
    const mesh_picture::scene scene(both, {0.0f, -0.8f, -1.0f}, 1.12f, 2.0f);
    picture::write_pixels("creases.ppm", 2.0f,
                          [&](float x, float y, const glm::vec2& noise) { return scene.look(x, y, noise); });
    return good ? 0 : 1;
}
