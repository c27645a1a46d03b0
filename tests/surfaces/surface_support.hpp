// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Volumes and meshes for the tests of surfaces, on any backend.

#include "../test_scale.hpp"
#include "mesh_judge.hpp"

#include <voxelpipe/surfaces/extract.hpp>
#include <voxelpipe/surfaces/remesh.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace surface_tests {

namespace vp = voxelpipe;

// Bits of a grid, x fastest.
struct bit_volume {
    glm::ivec3 extent{0};
    std::vector<bool> inside;

    explicit bit_volume(const glm::ivec3& e)
        : extent(e),
          inside(static_cast<std::size_t>(e.x) * static_cast<std::size_t>(e.y) * static_cast<std::size_t>(e.z)) {}
    [[nodiscard]] std::size_t index(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(extent.y) + static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(extent.x) +
               static_cast<std::size_t>(x);
    }
    [[nodiscard]] bool at(int x, int y, int z) const {
        return x >= 0 && y >= 0 && z >= 0 && x < extent.x && y < extent.y && z < extent.z && inside[index(x, y, z)];
    }
    void set(int x, int y, int z) { inside[index(x, y, z)] = true; }
    // As words of vp::bit.
    [[nodiscard]] std::vector<std::uint32_t> words() const {
        using map = vp::core::storage_map<vp::bit, vp::layout::linear>;
        std::vector<std::uint32_t> w(map::elements(extent));
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) map::store(w.data(), extent, x, y, z, at(x, y, z));
        return w;
    }
};

[[nodiscard]] inline bit_volume random_volume(std::mt19937& random, const glm::ivec3& extent, double density) {
    bit_volume v(extent);
    for (std::size_t i = 0; i < v.inside.size(); ++i)
        v.inside[i] = static_cast<double>(random() % 1000) < 1000 * density;
    return v;
}

[[nodiscard]] inline vp::grid grid_of(const glm::ivec3& extent) {
    vp::grid g;
    g.extent = extent;
    return g;
}

// A surface in host memory.
struct host_surface {
    vp::status status;
    vp::grid samples;
    std::vector<vp::surface_vertex> vertices;
    std::vector<glm::uvec3> triangles;
    std::vector<glm::uvec4> quads;
    std::vector<std::uint32_t> sources;

    [[nodiscard]] verdict judge_triangles() const {
        std::vector<std::array<std::uint32_t, 3>> faces;
        for (const glm::uvec3& t : triangles) faces.push_back({t.x, t.y, t.z});
        return judge(faces, vertices.size());
    }
    [[nodiscard]] verdict judge_quads() const {
        std::vector<std::array<std::uint32_t, 4>> faces;
        for (const glm::uvec4& q : quads) faces.push_back({q.x, q.y, q.z, q.w});
        return judge(faces, vertices.size());
    }
    [[nodiscard]] bool is_closed_manifold() const {
        const verdict v = quads.empty() ? judge_triangles() : judge_quads();
        return status.ok() && v.is_closed_manifold() && v.components == status.surface.components &&
               status.surface.vertices == vertices.size() && status.surface.faces == triangles.size() + quads.size();
    }
    [[nodiscard]] bool has_same_arrays(const host_surface& o) const {
        return vertices == o.vertices && triangles == o.triangles && quads == o.quads && sources == o.sources &&
               status.surface == o.status.surface && status.code == o.status.code;
    }
};

template <class Backend>
[[nodiscard]] host_surface to_host(Backend& backend, const vp::surface<Backend>& s, const vp::status& status) {
    return {status,
            s.samples,
            s.vertices.to_host(backend),
            s.triangles.to_host(backend),
            s.quads.to_host(backend),
            s.sources.to_host(backend)};
}

template <class Backend>
[[nodiscard]] host_surface extract_bits(Backend& backend, const bit_volume& volume,
                                        const vp::extract_options& options = {}) {
    using bits = vp::target<vp::bit, vp::blend::replace>;
    const std::vector<std::uint32_t> words = volume.words();
    typename Backend::template buffer<std::uint32_t> memory(backend, vp::array_view<const std::uint32_t>(words));
    const vp::target_view<bits> view{memory.data(), volume.extent};
    vp::surface<Backend> s(backend);
    const vp::status status = vp::extract(backend, view, grid_of(volume.extent), s, options);
    return to_host(backend, s, status);
}

template <class Backend>
[[nodiscard]] host_surface extract_field(Backend& backend, const std::vector<float>& values, const vp::grid& g,
                                         const vp::extract_options& options = {}) {
    using field = vp::target<float, vp::blend::replace>;
    typename Backend::template buffer<float> memory(backend, vp::array_view<const float>(values));
    const vp::target_view<field> view{memory.data(), g.extent};
    vp::surface<Backend> s(backend);
    const vp::status status = vp::extract(backend, view, g, s, options);
    return to_host(backend, s, status);
}

// Triangles in host memory.
struct host_mesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    void add(const host_mesh& o) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.insert(positions.end(), o.positions.begin(), o.positions.end());
        for (const glm::uvec3& t : o.triangles) triangles.emplace_back(t.x + first, t.y + first, t.z + first);
    }
};

template <class Backend>
[[nodiscard]] host_surface remesh(Backend& backend, const host_mesh& mesh, const vp::grid& g,
                                  const vp::remesh_options& options = {}) {
    const vp::mesh<Backend> m{backend, mesh.positions, mesh.triangles};
    vp::surface<Backend> s(backend);
    const vp::status status = vp::remesh(backend, m, g, vp::passthrough{}, s, options);
    return to_host(backend, s, status);
}

// A box, fronts outward.
[[nodiscard]] inline host_mesh box(const glm::vec3& low, const glm::vec3& high) {
    host_mesh m;
    for (unsigned i = 0; i < 8; ++i)
        m.positions.emplace_back((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                                 (i & 4) != 0 ? high.z : low.z);
    m.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return m;
}
[[nodiscard]] inline host_mesh octahedron(const glm::vec3& centre, float radius) {
    host_mesh m;
    for (int i = 0; i < 6; ++i) {
        glm::vec3 p = centre;
        p[i / 2] += i % 2 == 0 ? radius : -radius;
        m.positions.push_back(p);
    }
    for (unsigned i = 0; i < 8; ++i) {
        const unsigned x = i & 1, y = 2 + (i >> 1 & 1), z = 4 + (i >> 2);
        const bool turns = ((i & 1) + (i >> 1 & 1) + (i >> 2)) % 2 != 0;
        m.triangles.emplace_back(x, turns ? z : y, turns ? y : z);
    }
    return m;
}
// A sphere of 8 * 4^levels triangles.
[[nodiscard]] inline host_mesh ball(const glm::vec3& centre, float radius, int levels) {
    host_mesh m = octahedron(glm::vec3(0.0f), 1.0f);
    for (int l = 0; l < levels; ++l) {
        host_mesh finer;
        for (const glm::uvec3& t : m.triangles) {
            const glm::vec3 a = m.positions[t.x], b = m.positions[t.y], c = m.positions[t.z];
            const auto between = [](const glm::vec3& p, const glm::vec3& q) {
                const glm::vec3 s(p.x + q.x, p.y + q.y, p.z + q.z);
                const float length = std::sqrt(s.x * s.x + s.y * s.y + s.z * s.z);
                return glm::vec3(s.x / length, s.y / length, s.z / length);
            };
            const glm::vec3 ab = between(a, b), bc = between(b, c), ca = between(c, a);
            const auto first = static_cast<std::uint32_t>(finer.positions.size());
            finer.positions.insert(finer.positions.end(), {a, b, c, ab, bc, ca});
            for (const glm::uvec3& u :
                 {glm::uvec3(0, 3, 5), glm::uvec3(3, 1, 4), glm::uvec3(5, 4, 2), glm::uvec3(3, 4, 5)})
                finer.triangles.emplace_back(u.x + first, u.y + first, u.z + first);
        }
        m = finer;
    }
    for (glm::vec3& p : m.positions)
        p = glm::vec3(centre.x + radius * p.x, centre.y + radius * p.y, centre.z + radius * p.z);
    return m;
}

// Thin parts that cross and share cells: sharp vertices of theirs lie on the wrong sides of each other.
[[nodiscard]] inline host_mesh needles(std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto real = [&](float low, float high) {
        return low + (high - low) * static_cast<float>(random() % 4096) / 4096.0f;
    };
    host_mesh m;
    for (int i = 0; i < 12; ++i) {
        host_mesh part = octahedron(glm::vec3(0.0f), 1.0f);
        const float x = real(0.2f, 0.8f), y = real(0.2f, 0.8f), z = real(0.2f, 0.8f);
        const float rx = real(0.02f, 0.3f), ry = real(0.02f, 0.3f), rz = real(0.02f, 0.3f), shear = real(-1.0f, 1.0f);
        for (glm::vec3& p : part.positions)
            p = glm::vec3(x + rx * p.x + shear * ry * p.y, y + ry * p.y, z + rz * p.z + shear * rx * p.x);
        m.add(part);
    }
    return m;
}

// A mesh with the faults that people bring: triangles deleted, flipped, doubled, cut beside their edges; parts that
// cross; sheets; plates of no thickness; nested shells; slivers; NaN; far coordinates. In a cube of side 1.
[[nodiscard]] inline host_mesh bad_model(std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto real = [&](float low, float high) {
        return low + (high - low) * static_cast<float>(random() % 4096) / 4096.0f;
    };
    const auto point = [&](float low, float high) {
        const float x = real(low, high), y = real(low, high), z = real(low, high);
        return glm::vec3(x, y, z);
    };
    host_mesh m;
    const unsigned parts = 1 + random() % 4;
    for (unsigned i = 0; i < parts; ++i) {
        const glm::vec3 c = point(0.3f, 0.7f);
        const float r = real(0.1f, 0.3f);
        switch (random() % 5) {
        case 0:
            m.add(ball(c, r, 2));
            break;
        case 1:
            m.add(octahedron(c, r));
            break;
        case 2: // a plate, now and then of no thickness
            m.add(box(glm::vec3(c.x - r, c.y - r, c.z),
                      glm::vec3(c.x + r, c.y + r, c.z + (random() % 2 == 0 ? 0.0f : 0.02f))));
            break;
        case 3: // a shell
            m.add(ball(c, r, 2));
            m.add(ball(c, 0.7f * r, 2));
            break;
        default:
            m.add(box(glm::vec3(c.x - r, c.y - r, c.z - r), glm::vec3(c.x + r, c.y + 0.5f * r, c.z + r)));
        }
    }
    const unsigned faults = random() % 64;
    for (unsigned i = 0; i < random() % 20; ++i)
        if (m.triangles.size() > 4)
            m.triangles.erase(m.triangles.begin() + static_cast<std::ptrdiff_t>(random() % m.triangles.size()));
    const auto any = [&]() -> glm::uvec3& { return m.triangles[random() % m.triangles.size()]; };
    if ((faults & 1) != 0)
        for (int i = 0; i < 5; ++i) {
            glm::uvec3& t = any();
            t = glm::uvec3(t.x, t.z, t.y);
        }
    if ((faults & 2) != 0)
        for (int i = 0; i < 5; ++i) m.triangles.push_back(glm::uvec3(any()));
    if ((faults & 4) != 0)
        for (int i = 0; i < 5; ++i) { // a vertex beside an edge
            glm::uvec3& t = any();
            const glm::vec3 a = m.positions[t.x], b = m.positions[t.y];
            const auto v = static_cast<std::uint32_t>(m.positions.size());
            m.positions.emplace_back((a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2 + 0.003f);
            const glm::uvec3 old = t;
            t = glm::uvec3(old.x, v, old.z);
            m.triangles.emplace_back(v, old.y, old.z);
        }
    if ((faults & 8) != 0)
        for (int i = 0; i < 6; ++i) { // slivers and loose triangles
            const auto v = static_cast<std::uint32_t>(m.positions.size());
            const glm::vec3 p = point(0.1f, 0.9f), q = point(0.1f, 0.9f);
            m.positions.insert(m.positions.end(), {p, q, glm::vec3(q.x, q.y, q.z + 1e-4f)});
            m.triangles.emplace_back(v, v + 1, v + 2);
        }
    if ((faults & 16) != 0) m.positions[random() % m.positions.size()].y = std::nanf("");
    if ((faults & 32) != 0) m.positions[random() % m.positions.size()] = glm::vec3(1e6f, -1e9f, 3.0f);
    return m;
}

// Around bad_model and needles.
[[nodiscard]] inline vp::grid grid_around_models(const glm::ivec3& extent) {
    return vp::fit(vp::bounding_box{glm::dvec3(0.0), glm::dvec3(1.0)}, extent);
}

} // namespace surface_tests
