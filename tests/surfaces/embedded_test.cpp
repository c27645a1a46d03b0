// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Embedded surfaces: intersecting triangles by another method, all pairs of a surface, and what the rounds leave.

#include "pair_oracle.hpp"
#include "surface_support.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/surfaces/core/triangle_pair.hpp>

#include <gtest/gtest.h>

#include <algorithm>

using namespace surface_tests;

namespace {

vp::core::lattice_vertex small_vertex(std::mt19937& random, unsigned side) {
    const auto x = static_cast<std::int64_t>(random() % side), y = static_cast<std::int64_t>(random() % side),
               z = static_cast<std::int64_t>(random() % side);
    return {x, y, z};
}

} // namespace

TEST(TrianglePairs, AreThoseOfAnotherMethod) {
    std::mt19937 random(1);
    std::uint64_t meet = 0, apart = 0, in_one_plane = 0;
    for (int k = 0; k < 200000; ++k) {
        const auto side = static_cast<unsigned>(2 + random() % 5);
        vp::core::lattice_vertex a[3], b[3];
        for (auto& v : a) v = small_vertex(random, side);
        for (auto& v : b) v = small_vertex(random, side);
        if (k % 4 == 0) b[0] = a[k / 4 % 3];       // a vertex in common
        if (k % 8 == 0) b[1] = a[(k / 4 + 1) % 3]; // an edge
        if (k % 5 == 0)
            for (int i = 0; i < 3; ++i) a[i].z = b[i].z = 1;
        const bool expected = oracle_intersects(a, b);
        ASSERT_EQ(vp::core::triangle_pair(a, b).intersects(), expected) << k;
        ASSERT_EQ(vp::core::triangle_pair(b, a).intersects(), expected) << k;
        ++(expected ? meet : apart);
        if (k % 5 == 0 && expected) ++in_one_plane;
    }
    EXPECT_GT(meet, 20000u);
    EXPECT_GT(apart, 20000u);
    EXPECT_GT(in_one_plane, 2000u);
}

TEST(TrianglePairs, AreExactAtTheLargestCoordinates) {
    // A vertex one unit above, in and below the plane of a triangle as large as those of surfaces.
    for (const int above : {-1, 0, 1}) {
        const vp::core::lattice_vertex a[3]{{1, 1, 1}, {131071, 65535, 1}, {1, 131071, 131071}};
        vp::core::lattice_vertex b[3]{{65536, 65533, 1}, {131071, 131071, -65535}, {65536, 131071, -65535}};
        // Through the middle of a's first edge, which is (65536, 32768, 1): b's first vertex is beside it.
        b[0] = {65536, 32768 + above, 1};
        EXPECT_EQ(vp::core::triangle_pair(a, b).intersects(), oracle_intersects(a, b)) << above;
    }
}

TEST(Embedded, SharpSurfacesThatIntersectDoNoMore) {
    vp::cpu_backend backend;
    std::uint64_t before = 0, moved = 0;
    for (std::uint32_t seed = 0; seed < 6; ++seed) {
        const host_mesh m = needles(seed);
        const vp::grid g = vp::fit(vp::bounding_box{glm::dvec3(0.0), glm::dvec3(1.0)}, glm::ivec3(13, 12, 14));
        const host_surface plain = remesh(backend, m, g), embedded = remesh(backend, m, g, {.embedded = true});
        ASSERT_TRUE(plain.is_closed_manifold());
        ASSERT_TRUE(embedded.is_closed_manifold());
        const std::uint64_t pairs = count_pairs(plain.vertices, plain.triangles);
        before += pairs;
        moved += embedded.status.surface.moved_vertices;
        EXPECT_EQ(count_pairs(embedded.vertices, embedded.triangles), embedded.status.surface.intersecting_pairs);
        EXPECT_EQ(embedded.status.surface.intersecting_pairs, 0u);
        EXPECT_EQ(embedded.status.surface.embed_rounds != 0, pairs != 0) << seed;
        // Vertices are either where they were, or at the mean.
        const host_surface mean = remesh(backend, m, g, {.place = vp::place::mean});
        ASSERT_EQ(plain.vertices.size(), mean.vertices.size());
        std::uint64_t changed = 0;
        for (std::size_t v = 0; v < plain.vertices.size(); ++v) {
            EXPECT_TRUE(embedded.vertices[v] == plain.vertices[v] || embedded.vertices[v] == mean.vertices[v]);
            if (embedded.vertices[v] != plain.vertices[v]) ++changed;
        }
        EXPECT_LE(changed, embedded.status.surface.moved_vertices);
    }
    EXPECT_GT(before, 20u);
    EXPECT_GT(moved, 20u);
}

TEST(Embedded, RoundsMoveTheVerticesOfAllPairs) {
    // The first round by hand: all pairs at once, and their six vertices.
    vp::cpu_backend backend;
    const host_mesh m = needles(3);
    const vp::grid g = vp::fit(vp::bounding_box{glm::dvec3(0.0), glm::dvec3(1.0)}, glm::ivec3(13, 12, 14));
    const host_surface plain = remesh(backend, m, g), mean = remesh(backend, m, g, {.place = vp::place::mean}),
                       embedded = remesh(backend, m, g, {.embedded = true});
    std::vector<vp::surface_vertex> vertices = plain.vertices;
    std::vector<bool> is_moved(vertices.size());
    std::uint64_t rounds = 0, moved = 0;
    const host_surface quads = remesh(backend, m, g, {.quads = true});
    for (;;) {
        std::vector<glm::uvec3> triangles;
        for (const glm::uvec4& q : quads.quads) {
            const auto at = [&](std::uint32_t v) { return lattice_of(vertices[v]); };
            if (vp::core::is_cut_from_first(at(q.x), at(q.y), at(q.z), at(q.w), true)) {
                triangles.emplace_back(q.x, q.y, q.z);
                triangles.emplace_back(q.x, q.z, q.w);
            } else {
                triangles.emplace_back(q.x, q.y, q.w);
                triangles.emplace_back(q.y, q.z, q.w);
            }
        }
        std::vector<bool> next = is_moved;
        (void)count_pairs(vertices, triangles, [&](const glm::uvec3& t, const glm::uvec3& u) {
            for (const std::uint32_t v : {t.x, t.y, t.z, u.x, u.y, u.z}) next[v] = true;
        });
        if (next == is_moved) break;
        ++rounds;
        for (std::size_t v = 0; v < next.size(); ++v)
            if (next[v] && !is_moved[v]) {
                vertices[v] = mean.vertices[v];
                ++moved;
            }
        is_moved = next;
    }
    EXPECT_GT(rounds, 0u);
    EXPECT_EQ(embedded.vertices, vertices);
    EXPECT_EQ(embedded.status.surface.embed_rounds, rounds);
    EXPECT_EQ(embedded.status.surface.moved_vertices, moved);
    // Quads lie as the triangles do.
    EXPECT_EQ(remesh(backend, m, g, {.quads = true, .embedded = true}).vertices, vertices);
}

TEST(Embedded, MeansStayAndPairsAreCounted) {
    vp::cpu_backend backend;
    std::mt19937 random(5);
    for (int k = 0; k < 8; ++k) {
        const bit_volume v = random_volume(random, glm::ivec3(9, 8, 7), 0.3 + 0.05 * k);
        const host_surface plain = extract_bits(backend, v), embedded = extract_bits(backend, v, {.embedded = true});
        EXPECT_TRUE(plain.vertices == embedded.vertices && plain.triangles == embedded.triangles);
        EXPECT_EQ(embedded.status.surface.embed_rounds, 0u);
        EXPECT_EQ(embedded.status.surface.intersecting_pairs, count_pairs(plain.vertices, plain.triangles));
        const host_surface corners = extract_bits(backend, v, {.place = vp::place::corner, .embedded = true});
        EXPECT_TRUE(corners.is_closed_manifold());
        EXPECT_EQ(corners.status.surface.intersecting_pairs, count_pairs(corners.vertices, corners.triangles));
    }
}
