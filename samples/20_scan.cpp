// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A scan becomes a mesh that one can print: a duck's surface with noise, without its underside, with holes and with
// crumbs beside it, on the left of scan_remesh.ppm, is closed, and keeps its colours as values of the vertices. Checks
// that every edge has two faces, and prints what was repaired.
#include "mesh_picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cmath>
#include <cstdio>
#include <string>

namespace vp = voxelpipe;

// The duck: how far a point is from it, about, and what it is painted with.
struct shape {
    float distance;
    glm::vec3 color;
};
shape duck(const glm::vec3& p) {
    const auto ellipsoid = [&](const glm::vec3& middle, const glm::vec3& radii, float turn) {
        const glm::vec3 q = p - middle;
        const glm::vec3 r(std::cos(turn) * q.x + std::sin(turn) * q.y, std::cos(turn) * q.y - std::sin(turn) * q.x,
                          q.z);
        const float k = glm::length(r / radii);
        return k < 1e-4f ? -radii.y : k * (k - 1.0f) / glm::length(r / (radii * radii));
    };
    const auto join = [](float a, float b, float soft) { // rounds the crease where the two meet
        const float h = std::max(soft - std::abs(a - b), 0.0f) / soft;
        return std::min(a, b) - 0.25f * soft * h * h;
    };
    const glm::vec3 yellow(0.95f, 0.62f, 0.06f), orange(0.86f, 0.20f, 0.03f), black(0.012f);
    const glm::vec3 side(p.x, p.y, std::abs(p.z));
    float body = ellipsoid({0.0f, 0.40f, 0.0f}, {0.78f, 0.42f, 0.52f}, 0.10f);
    body = join(body, ellipsoid({-0.66f, 0.66f, 0.0f}, {0.30f, 0.13f, 0.22f}, -0.75f), 0.22f); // the tail
    body = join(body, ellipsoid({0.40f, 1.06f, 0.0f}, {0.35f, 0.34f, 0.34f}, 0.0f), 0.16f);    // the head
    for (const float z : {-0.47f, 0.47f})
        body = join(body, ellipsoid({-0.12f, 0.50f, z}, {0.42f, 0.20f, 0.12f}, -0.25f), 0.05f); // the wings
    const float beak = ellipsoid({0.76f, 1.0f, 0.0f}, {0.20f, 0.065f, 0.17f}, -0.12f);
    const bool is_eye = glm::length(side - glm::vec3(0.60f, 1.17f, 0.24f)) < 0.075f;
    const bool is_glint = glm::length(side - glm::vec3(0.63f, 1.20f, 0.25f)) < 0.03f;
    const glm::vec3 color = is_glint ? glm::vec3(0.9f) : is_eye ? black : beak < body + 0.02f ? orange : yellow;
    return {std::max(join(body, beak, 0.03f), 0.02f - p.y), color}; // it stands on the ground
}

float random_number(std::uint32_t& state) {
    state = state * 1664525u + 1013904223u;
    return static_cast<float>(state >> 8) * 0x1p-24f;
}

// What a scanner has of it.
mesh_picture::mesh scan(vp::cpu_backend& backend, int n) {
    const vp::grid grid = vp::fit(vp::bounding_box{{-1.1, -0.15, -0.75}, {1.1, 1.55, 0.75}}, glm::ivec3(n));
    vp::framebuffer<vp::cpu_backend, vp::target<float, vp::blend::replace>> field(backend, grid.extent);
    const auto& values = vp::get<0>(field.view().targets);
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) values.store(x, y, z, duck(glm::vec3(grid.voxel_center({x, y, z}))).distance);
    vp::surface<vp::cpu_backend> whole(backend);
    vp::extract(backend, field, grid, whole).or_throw();

    mesh_picture::mesh m;
    std::uint32_t random = 7;
    const float noise = 0.35f * static_cast<float>(grid.voxel_size.x);
    for (const vp::surface_vertex& v : whole.vertices.to_host(backend)) {
        const glm::vec3 p(vp::position(grid, v));
        const float x = random_number(random), y = random_number(random), z = random_number(random);
        m.positions.push_back(p + noise * (2.0f * glm::vec3(x, y, z) - 1.0f));
        m.colors.push_back(duck(p).color * (0.9f + 0.2f * random_number(random)));
    }
    const auto is_lost = [](const glm::vec3& p) { // the ground, and where the light did not reach
        const auto wave = [&](float a, float b, float c) { return std::sin(a * p.x + b * p.y + c * p.z); };
        const float ragged = 0.02f * (wave(31, 17, 23) + wave(-19, 41, 29));
        const auto hole = [&](const glm::vec3& middle, float radius) {
            return glm::length(p - middle) < radius + ragged;
        };
        return p.y < 0.04f + ragged || hole({0.16f, 0.62f, 0.46f}, 0.12f) || hole({-0.42f, 0.78f, 0.05f}, 0.17f) ||
               hole({0.30f, 1.36f, 0.10f}, 0.11f) || hole({0.66f, 0.55f, 0.2f}, 0.10f) ||
               hole({-0.62f, 0.30f, 0.38f}, 0.09f);
    };
    for (const glm::uvec3& t : whole.triangles.to_host(backend))
        if (!is_lost((m.positions[t.x] + m.positions[t.y] + m.positions[t.z]) / 3.0f)) m.triangles.push_back(t);
    for (int crumbs = 0; crumbs < 24;) { // closed ones, which a remesh would keep
        const glm::vec3 within(random_number(random), random_number(random), random_number(random));
        const glm::vec3 middle = glm::vec3(-1.0f, 0.05f, -0.7f) + within * glm::vec3(2.0f, 1.3f, 1.4f);
        const float size = 0.012f + 0.012f * random_number(random), far = duck(middle).distance;
        if (far < 0.08f || far > 0.3f) continue;
        ++crumbs;
        const auto first = static_cast<unsigned>(m.positions.size());
        for (const glm::vec3& way :
             {glm::vec3(1, -1, 0), glm::vec3(-1, -1, 1), glm::vec3(-1, -1, -1), glm::vec3(0, 1, 0)}) {
            m.positions.push_back(middle + size * way);
            m.colors.emplace_back(0.3f, 0.28f, 0.24f);
        }
        for (const glm::uvec3& t : {glm::uvec3(0, 1, 2), glm::uvec3(0, 3, 1), glm::uvec3(1, 3, 2), glm::uvec3(2, 3, 0)})
            m.triangles.push_back(t + first);
    }
    return m;
}

// snippet: values
struct painted {
    glm::vec3 color;
};
struct paint { // hands the mesh's colours on
    VOXELPIPE_HD vp::vertex_output<painted> operator()(const vp::vertex<glm::vec3>& v) const {
        return {v.position, {vp::get<0>(v)}};
    }
};
struct color_here {
    VOXELPIPE_HD auto operator()(const vp::fragment<painted>& f) const { return vp::outputs(f.varyings.color); }
};
// end snippet

int main() {
    vp::cpu_backend backend;
    const int n = picture::is_fine() ? 160 : 56;
    mesh_picture::mesh input = scan(backend, n);
    const vp::mesh mesh{backend, input.positions, input.triangles, input.colors};
    const vp::grid grid = vp::fit(vp::bounding_box{{-1.1, -0.15, -1.1}, {1.1, 1.55, 1.1}}, glm::ivec3(n));

    // snippet: call
    vp::surface<vp::cpu_backend, glm::vec3> made(backend);
    const vp::remesh_options options{.place = vp::place::mean, .repair = vp::repair::close_holes, .min_component = 500};
    const vp::status status = vp::remesh(backend, mesh, grid, paint{}, color_here{}, made, options).or_throw();
    const std::vector<glm::vec3> colors = vp::get<0>(made).to_host(backend);
    // end snippet
    const vp::surface_counters& counts = status.surface;
    std::printf(
        "%zu triangles; %llu holes, %llu loose parts; %llu vertices in %llu part, %llu with the nearest colour\n",
        input.triangles.size(), static_cast<unsigned long long>(status.solid.holes),
        static_cast<unsigned long long>(counts.components_left_out), static_cast<unsigned long long>(counts.vertices),
        static_cast<unsigned long long>(counts.components), static_cast<unsigned long long>(counts.nearest_values));

    mesh_picture::mesh output;
    output.triangles = made.triangles.to_host(backend);
    output.colors = colors;
    for (const vp::surface_vertex& v : made.vertices.to_host(backend))
        output.positions.emplace_back(vp::position(made.samples, v));
    const bool closed = mesh_picture::is_closed(output.triangles) && !mesh_picture::is_closed(input.triangles);
    mesh_picture::mesh both;
    both.add(input, glm::vec3(-1.02f, 0.0f, 0.0f));
    both.add(output, glm::vec3(1.02f, 0.0f, 0.0f));
    const mesh_picture::scene scene(both, {-0.05f, -0.42f, -1.0f}, 1.14f, 2.0f);
    picture::write_pixels("scan_remesh.ppm", 2.0f,
                          [&](float x, float y, const glm::vec2& noise) { return scene.look(x, y, noise); });
    return closed && counts.components == 1 && counts.components_left_out > 0 && colors.size() == counts.vertices ? 0
                                                                                                                  : 1;
}
