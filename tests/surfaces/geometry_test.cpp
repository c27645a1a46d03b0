// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Where surfaces lie: voxelized again they give their bits back, turned volumes have turned surfaces, tori lie within
// the sagitta of a cell.
#include "surface_support.hpp"

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

namespace {

using namespace surface_tests;

// Voxels whose centres lie inside of one of two surfaces and not of the other one: a volume's bits, and the triangles.
std::size_t count_differences(vp::cpu_backend& backend, const bit_volume& v, const host_surface& s) {
    host_mesh m;
    for (const vp::surface_vertex& p : s.vertices) m.positions.emplace_back(vp::position(s.samples, p));
    m.triangles = s.triangles;
    const vp::mesh<vp::cpu_backend> mesh{backend, m.positions, m.triangles};
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::replace>> bits(backend, v.extent);
    const vp::status status =
        vp::voxelize_solid(backend, mesh, grid_of(v.extent), vp::passthrough{}, vp::constant(true), bits).or_throw();
    EXPECT_EQ(status.solid.open_rows, 0u);
    const auto drawn = vp::get<0>(bits).to_host_target(backend);
    std::size_t differences = 0;
    for (int z = 0; z < v.extent.z; ++z)
        for (int y = 0; y < v.extent.y; ++y)
            for (int x = 0; x < v.extent.x; ++x) differences += drawn(x, y, z) != v.at(x, y, z) ? 1 : 0;
    return differences;
}

// Corners always do. A mean lies on its sample's side of every crossing, but quads that bend may pass a sample.
TEST(SurfaceGeometry, SurfacesVoxelizedAgainGiveTheirBits) {
    vp::cpu_backend backend{2};
    std::mt19937 random(8);
    std::size_t voxels = 0, of_means = 0;
    for (int k = 0; k < 9; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(17, 15, 16), 0.1 + 0.1 * k);
        voxels += v.inside.size();
        EXPECT_EQ(count_differences(backend, v, extract_bits(backend, v, {.place = vp::place::corner})), 0u) << k;
        of_means += count_differences(backend, v, extract_bits(backend, v));
    }
    RecordProperty("differences_of_means", static_cast<int>(of_means));
    EXPECT_EQ(of_means, 0u) << "of " << voxels;
}

// x becomes y, y becomes z, z becomes x.
glm::ivec3 turned(const glm::ivec3& p) { return {p.z, p.x, p.y}; }
bit_volume turned(const bit_volume& v) {
    bit_volume t(turned(v.extent));
    for (int z = 0; z < v.extent.z; ++z)
        for (int y = 0; y < v.extent.y; ++y)
            for (int x = 0; x < v.extent.x; ++x)
                if (v.at(x, y, z)) {
                    const glm::ivec3 p = turned(glm::ivec3(x, y, z));
                    t.set(p.x, p.y, p.z);
                }
    return t;
}
// Quads by the cells and places of their vertices, the least first, sorted.
using place_of_vertex = std::array<int, 6>;
std::vector<std::array<place_of_vertex, 4>> quads_of(const host_surface& s, bool turns) {
    std::vector<std::array<place_of_vertex, 4>> all;
    for (const glm::uvec4& q : s.quads) {
        std::array<place_of_vertex, 4> quad{};
        for (int k = 0; k < 4; ++k) {
            const vp::surface_vertex& v = s.vertices[q[k]];
            glm::ivec3 cell = v.cell, at(v.q[0], v.q[1], v.q[2]);
            if (turns) {
                cell = turned(cell);
                at = turned(at);
            }
            quad[static_cast<std::size_t>(k)] = {cell.x, cell.y, cell.z, at.x, at.y, at.z};
        }
        std::rotate(quad.begin(), std::min_element(quad.begin(), quad.end()), quad.end());
        all.push_back(quad);
    }
    std::sort(all.begin(), all.end());
    return all;
}

TEST(SurfaceGeometry, TurnedVolumesHaveTurnedSurfaces) {
    vp::cpu_backend backend{2};
    std::mt19937 random(9);
    for (int k = 0; k < 4; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(12, 9, 14), 0.2 + 0.2 * k);
        for (const vp::place place : {vp::place::corner, vp::place::mean}) {
            const vp::extract_options o{.place = place, .quads = true};
            const host_surface s = extract_bits(backend, v, o), t = extract_bits(backend, turned(v), o);
            EXPECT_GT(s.quads.size(), 500u);
            EXPECT_EQ(quads_of(s, true), quads_of(t, false));
        }
    }
}

// Sums of normals come in another order: within a rounding.
TEST(SurfaceGeometry, TurnedMeshesHaveTurnedSurfacesWithinARounding) {
    vp::cpu_backend backend{2};
    host_mesh m = ball(glm::vec3(0.45f, 0.5f, 0.55f), 0.36f, 3), t;
    m.add(box(glm::vec3(0.1f, 0.22f, 0.33f), glm::vec3(0.9f, 0.41f, 0.64f)));
    t = m;
    for (glm::vec3& p : t.positions) p = glm::vec3(p.z, p.x, p.y);
    const vp::grid g = grid_around_models(glm::ivec3(24));
    const host_surface a = remesh(backend, m, g), b = remesh(backend, t, g);
    ASSERT_EQ(a.vertices.size(), b.vertices.size());
    std::map<std::array<int, 3>, std::vector<glm::ivec3>> places;
    for (const vp::surface_vertex& v : b.vertices)
        places[{v.cell.x, v.cell.y, v.cell.z}].emplace_back(v.q[0], v.q[1], v.q[2]);
    int most = 0;
    for (const vp::surface_vertex& v : a.vertices) {
        const glm::ivec3 cell = turned(v.cell), at = turned(glm::ivec3(v.q[0], v.q[1], v.q[2]));
        const auto& there = places[{cell.x, cell.y, cell.z}];
        ASSERT_FALSE(there.empty());
        int least = 65536; // sheets of a cell may have other numbers
        for (const glm::ivec3& q : there)
            least = std::min(least, std::max({std::abs(q.x - at.x), std::abs(q.y - at.y), std::abs(q.z - at.z)}));
        most = std::max(most, least);
    }
    EXPECT_LE(most, 1);
}

TEST(SurfaceGeometry, ToriLieWithinTheSagittaOfACell) {
    vp::cpu_backend backend{2};
    constexpr double large = 0.3, small = 0.12, full = 6.283185307179586;
    constexpr std::uint32_t around = 360, across = 180;
    host_mesh m;
    for (std::uint32_t i = 0; i < around; ++i)
        for (std::uint32_t k = 0; k < across; ++k) {
            const double u = full * i / around, v = full * k / across, r = large + small * std::cos(v);
            m.positions.emplace_back(0.5 + r * std::cos(u), 0.5 + r * std::sin(u), 0.5 + small * std::sin(v));
            const std::uint32_t a = i * across + k, b = (i + 1) % around * across + k,
                                c = (i + 1) % around * across + (k + 1) % across, d = i * across + (k + 1) % across;
            m.triangles.insert(m.triangles.end(), {{a, b, c}, {a, c, d}});
        }
    // The mesh lies that far within and, on the inside of the ring, beside the torus.
    const double of_mesh =
        (large + small) * (1 - std::cos(full / 2 / around)) + small * (1 - std::cos(full / 2 / across));
    for (const int n : {24, 48})
        for (const vp::place place : {vp::place::mean, vp::place::sharp}) {
            const vp::grid g = grid_around_models(glm::ivec3(n));
            const host_surface s = remesh(backend, m, g, {.place = place});
            ASSERT_TRUE(s.is_closed_manifold());
            EXPECT_EQ(s.judge_triangles().euler, 0);
            EXPECT_EQ(s.status.surface.made_crossings, 0u);
            const double h = g.voxel_size.x;
            double worst = 0;
            for (const vp::surface_vertex& v : s.vertices) {
                const glm::dvec3 p = vp::position(g, v);
                const double ring = std::hypot(p.x - 0.5, p.y - 0.5) - large;
                worst = std::max(worst, std::abs(std::hypot(ring, p.z - 0.5) - small));
            }
            EXPECT_LE(worst, h * h / (2 * small) + of_mesh) << n;
        }
}

} // namespace
