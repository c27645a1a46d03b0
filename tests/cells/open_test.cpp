// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cut cells of open meshes: how they are told, and what a vertex in the middle of an edge leaves.
#include "cell_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace {

using namespace cells;

// A vertex in the middle of a neighbour's edge, on the lattice: its two parts are rounded apart from the whole edge,
// and what is left runs along the row. Nothing else is off, by more than 1 u, or where the edge does not pass.
TEST(OpenCells, AVertexInTheMiddleOfAnEdgeLeavesOneUnit) {
    splitmix64 random(47);
    const vp::grid g = solids::unit_grid(glm::ivec3(8));
    std::size_t off = 0, at_vertex = 0;
    for (int round = 0; round < 60; ++round) {
        std::array<glm::vec3, 4> p;
        for (glm::vec3& v : p)
            for (int a = 0; a < 3; ++a) v[a] = static_cast<float>(random.between(0, 7 * 128)) / 128.0f;
        const glm::vec3 middle = 0.5f * (p[0] + p[1]); // a multiple of 2^-8
        mesh m;
        m.positions = {p[0], p[1], p[2], p[3], middle};
        m.triangles = {{0, 2, 1}, {0, 4, 3}, {4, 1, 3}, {0, 3, 2}, {1, 2, 3}};
        const cell_values c = library_cells(m, g);
        EXPECT_EQ(c.status.cells.open_edges, 3u);
        const auto reaches = [](float from, float to, int pixel) {
            return to >= static_cast<float>(pixel) && from <= static_cast<float>(pixel + 1);
        };
        const glm::vec3 low = glm::min(p[0], p[1]), high = glm::max(p[0], p[1]);
        std::size_t rows = 0;
        for (int z = 0; z < 8; ++z)
            for (int y = 0; y < 8; ++y) {
                const std::int64_t left = c.units[c.index(7, y, z)]; // beyond the mesh
                EXPECT_LE(std::abs(left), 1) << round;
                if (left != 0) {
                    ++rows;
                    EXPECT_TRUE(reaches(low.y, high.y, y) && reaches(low.z, high.z, z));
                    at_vertex += reaches(middle.y, middle.y, y) && reaches(middle.z, middle.z, z) ? 1 : 0;
                }
                for (int x = 0; x < 8; ++x) {
                    if (c.cut[c.index(x, y, z)] != 0) continue;
                    const std::int64_t units = std::abs(c.units[c.index(x, y, z)]);
                    EXPECT_LE(std::abs(units - (units + whole_cell / 2) / whole_cell * whole_cell), 1);
                }
            }
        EXPECT_EQ(c.status.cells.open_rows, rows);
        off += rows;
    }
    EXPECT_GT(at_vertex, 10u);
    EXPECT_LE(off, 2 * at_vertex);
}

TEST(OpenCells, OpenMeshesAreToldByRowsAndEdges) {
    mesh m = solids::box({1, 1, 1}, {4, 4, 4});
    m.triangles.erase(m.triangles.begin());
    const vp::grid g = solids::unit_grid(glm::ivec3(6));
    EXPECT_EQ(library_cells(m, g).status.cells.open_edges, 3u);
    EXPECT_EQ(library_cells(m, g, {.count_open_edges = false}).status.cells.open_edges, 0u);
    const auto rows = [&](int axis) { return library_cells(m, g, {.axis = axis}).status.cells.open_rows; };
    EXPECT_EQ(std::max({rows(0), rows(1), rows(2)}), 6u); // half of a face of three by three pixels, and its diagonal
    m.add(mesh(m));                                       // a copy: add() reads what it appends to
    EXPECT_EQ(library_cells(m, g).status.cells.open_edges, 6u);
    m.add(m.inside_out());
    EXPECT_EQ(library_cells(m, g).status.cells.open_edges, 0u);
    EXPECT_EQ(library_cells(m, g).status.cells.volume(), 0.0);
}

// Vertices are the same where their places are: of triangles that share none, too.
TEST(OpenCells, EdgesJoinPlacesAndNotVertices) {
    const vp::grid g = solids::unit_grid(glm::ivec3(12));
    const mesh ball = solids::sphere({6.1f, 5.9f, 6}, 4.3f, 2);
    mesh apart;
    for (auto t = ball.triangles.rbegin(); t != ball.triangles.rend(); ++t) {
        const auto first = static_cast<std::uint32_t>(apart.positions.size());
        for (const std::uint32_t v : {t->y, t->z, t->x}) apart.positions.push_back(ball.positions[v]);
        apart.triangles.push_back({first, first + 1, first + 2});
    }
    const auto open_edges = [&](const mesh& m) { return library_cells(m, g).status.cells.open_edges; };
    EXPECT_EQ(open_edges(ball), 0u);
    EXPECT_EQ(open_edges(apart), 0u);
    apart.triangles.push_back({0, 1, 1}); // there and back, and an edge without length
    apart.triangles.push_back({2, 2, 2});
    EXPECT_EQ(open_edges(apart), 0u);
    apart.positions[30].y = std::numeric_limits<float>::quiet_NaN(); // a triangle that is dropped
    EXPECT_EQ(open_edges(apart), 3u);
    apart.triangles[4] = {12, 14, 13}; // turned
    EXPECT_EQ(open_edges(apart), 3u + 6u);
}

} // namespace
