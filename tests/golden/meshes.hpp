// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes for the golden hashes. They are made with integers only (a coordinate is an integer times a power of two), so
// that no compiler flag and no library changes the input. Never change one: its hashes would lose their reference.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <vector>

namespace golden {

struct mesh_data {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<glm::vec4> colors; // per vertex, in [0, 1]
    std::vector<glm::vec2> texcoords;
};

// SplitMix64: one 64-bit state, the same numbers everywhere.
class generator {
public:
    explicit generator(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() {
        std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    // In [lo, hi], in steps of 1/1024: exact in float for |value| < 2^13.
    float coordinate(int lo, int hi) {
        const auto steps = static_cast<std::uint64_t>(hi - lo) * 1024 + 1;
        const auto n = static_cast<std::int64_t>(next() % steps) + std::int64_t{lo} * 1024;
        return static_cast<float>(n) / 1024.0f;
    }

private:
    std::uint64_t state_;
};

inline void push_vertex(mesh_data& m, const glm::vec3& position, generator& random) {
    m.positions.push_back(position);
    m.colors.push_back({random.coordinate(0, 1), random.coordinate(0, 1), random.coordinate(0, 1), 1.0f});
    m.texcoords.push_back({random.coordinate(0, 4), random.coordinate(-4, 4)});
}

// `count` unconnected triangles, each within a box of `size`, somewhere in [lo, hi]^3.
inline mesh_data soup(std::uint64_t seed, int count, int size, int lo, int hi) {
    generator random(seed);
    mesh_data m;
    for (int t = 0; t < count; ++t) {
        const glm::vec3 corner{random.coordinate(lo, hi), random.coordinate(lo, hi), random.coordinate(lo, hi)};
        const auto first = static_cast<std::uint32_t>(m.positions.size());
        for (int v = 0; v < 3; ++v) {
            const glm::vec3 offset{random.coordinate(0, size), random.coordinate(0, size), random.coordinate(0, size)};
            push_vertex(m, corner + offset, random);
        }
        m.triangles.push_back({first, first + 1, first + 2});
    }
    return m;
}

// A closed box of side * side squares a face with bumps of up to `bump`, from (0,0,0) to about (side, side, side):
// shared vertices, every orientation, every dominant axis.
inline mesh_data bumpy_box(std::uint64_t seed, int side, int bump) {
    generator random(seed);
    mesh_data m;
    const auto n = static_cast<std::uint32_t>(side) + 1;
    for (int face = 0; face < 6; ++face) {
        const int axis = face % 3;
        const bool far = face >= 3;
        const auto first = static_cast<std::uint32_t>(m.positions.size());
        for (std::uint32_t j = 0; j < n; ++j)
            for (std::uint32_t i = 0; i < n; ++i) {
                const bool border = i == 0 || j == 0 || i + 1 == n || j + 1 == n;
                const float height = border ? 0.0f : random.coordinate(0, bump);
                glm::vec3 p;
                p[axis] = far ? static_cast<float>(side) + height : -height;
                p[(axis + 1) % 3] = static_cast<float>(far ? i : j);
                p[(axis + 2) % 3] = static_cast<float>(far ? j : i);
                push_vertex(m, p, random);
            }
        for (std::uint32_t j = 0; j + 1 < n; ++j)
            for (std::uint32_t i = 0; i + 1 < n; ++i) {
                const std::uint32_t a = first + j * n + i;
                m.triangles.push_back({a, a + 1, a + n + 1});
                m.triangles.push_back({a, a + n + 1, a + n});
            }
    }
    return m;
}

// Points, segments, slivers, triangles on voxel faces or far away, NaN: the output of a careless exporter.
inline mesh_data odd_shapes() {
    generator random(99);
    mesh_data m;
    const auto add = [&](glm::vec3 a, glm::vec3 b, glm::vec3 c) {
        const auto first = static_cast<std::uint32_t>(m.positions.size());
        for (const glm::vec3& p : {a, b, c}) push_vertex(m, p, random);
        m.triangles.push_back({first, first + 1, first + 2});
    };
    add({3, 3, 3}, {3, 3, 3}, {3, 3, 3});                                       // a point on a voxel corner
    add({3.5f, 4.25f, 5.5f}, {3.5f, 4.25f, 5.5f}, {3.5f, 4.25f, 5.5f});         // a point inside a voxel
    add({0, 0, 0}, {16, 16, 16}, {8, 8, 8});                                    // a diagonal segment through corners
    add({1, 2, 2.5f}, {15, 2, 2.5f}, {7, 2, 2.5f});                             // a segment on a voxel face
    add({0, 0, 6}, {16, 0, 6}, {0, 16, 6});                                     // lies on voxel faces
    add({0.5f, 0.5f, 0.5f}, {15.5f, 0.5f, 0.5f}, {15.5f, 0.5009765625f, 0.5f}); // a sliver
    add({-4000, -4000, -4000}, {4000, 4000, 4000}, {4000, -4000, 100});         // far larger than the grid
    add({-1e30f, 0, 0}, {1e30f, 1, 1}, {0, 1e30f, 5});                          // too far away
    add({2, 2, 2}, {4, 4, 4}, {__builtin_nanf(""), 1, 1});                      // not a number
    add({20, 20, 20}, {21, 20, 20}, {20, 21, 20});                              // outside
    add({15.5f, 15.5f, 0}, {16.5f, 15.5f, 8}, {15.5f, 16.5f, 16});              // through an edge of the grid
    return m;
}

} // namespace golden
