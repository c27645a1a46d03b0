// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Vertices and faces of a surface from its cells: functors for a backend's for_each.

#include <voxelpipe/surfaces/core/place_vertex.hpp>
#include <voxelpipe/surfaces/passes/cells.hpp>
#include <voxelpipe/surfaces/surface.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// The vertices of cell i, one a sheet.
template <class Cells>
struct place_vertices {
    Cells cells;
    voxelpipe::place where;
    const edge_crossing* crossings; // null: all in the middle of their edges
    surface_vertex* vertices;
    const std::uint32_t* primitives; // of the triangles of crossings; null: sources are not wanted
    std::uint32_t* sources;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto cell = static_cast<std::uint32_t>(i);
        const cell_key at{cells.keys[cell]};
        const cell_sheets sheets = cells.sheets(cell);
        for (int s = 0; s < sheets.count(); ++s) {
            const std::uint64_t v = cells.first_vertices[cell] + static_cast<std::uint64_t>(s);
            std::uint32_t source = ~std::uint32_t{0};
            const sheet_points points = points_of(at, sheets, s, source);
            vertices[v] = {glm::ivec3(at.x() - 1, at.y() - 1, at.z() - 1), {0, 0, 0}, static_cast<std::uint16_t>(s)};
            store(v, points);
            if (primitives != nullptr) sources[v] = source;
        }
    }
    // The crossings of sheet s; `source` becomes the lowest primitive of theirs, if that is lower.
    [[nodiscard]] VOXELPIPE_HD sheet_points points_of(const cell_key& at, const cell_sheets& sheets, int s,
                                                      std::uint32_t& source) const {
        sheet_points points;
        for (int e = 0; e < 12; ++e) {
            if (sheets.of_edge(e) != s) continue;
            const edge_crossing c = crossing(at, e);
            points.add(e >> 2, edge_corner(e), c);
            if (primitives != nullptr && c.triangle != edge_crossing::no_triangle && source > primitives[c.triangle])
                source = primitives[c.triangle];
        }
        return points;
    }
    // The place of vertex v.
    VOXELPIPE_HD void store(std::uint64_t v, const sheet_points& points) const {
        const cell_place q = place_of(where, points);
        for (int a = 0; a < 3; ++a) vertices[v].q[a] = q.q[a];
    }
    [[nodiscard]] VOXELPIPE_HD static cell_place place_of(voxelpipe::place where, const sheet_points& points) {
        return where == voxelpipe::place::corner ? cell_place{{{32768, 32768, 32768}}}
               : where == voxelpipe::place::mean ? points.mean()
                                                 : points.sharp();
    }
    // The crossing of an edge of a cell.
    [[nodiscard]] VOXELPIPE_HD edge_crossing crossing(const cell_key& at, int e) const {
        if (crossings == nullptr) return {};
        return crossings[cells.crossing(at, e)];
    }
};

// The quads of the crossed edges that begin at the lowest sample of cell i: one an edge, through the sheets that hold
// it in its four cells, the lowest cell first, counter-clockwise seen from outside.
template <class Cells>
struct list_quads {
    Cells cells;
    glm::uvec4* quads;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto cell = static_cast<std::uint32_t>(i);
        const cell_key at{cells.keys[cell]};
        const int corners = cells.states[cell] & 255;
        std::uint64_t next = cells.first_edges[cell];
        for (int axis = 0; axis < 3; ++axis) {
            if (!is_crossed(corners, 4 * axis)) continue;
            // The axes b and d that make a right-handed frame with this one.
            const int b = axis == 2 ? 0 : axis + 1, d = axis == 0 ? 2 : axis - 1;
            const bool goes_out = (corners & 1) != 0; // the lower sample is inside
            std::uint32_t v[4];
            for (int k = 0; k < 4; ++k) {
                // Around the edge, from the cell below it in b and d: (1, 1) (0, 1) (0, 0) (1, 0) as the edge lies in
                // the cell; the other way round if the surface looks down.
                const int turn = goes_out ? k : (4 - k) & 3;
                const int along_b = turn == 0 || turn == 3 ? 1 : 0, along_d = turn < 2 ? 1 : 0;
                v[k] = vertex(at, axis, b, along_b, d, along_d);
            }
            quads[next++] = glm::uvec4(v[0], v[1], v[2], v[3]);
        }
    }

private:
    // The vertex in the cell that has the edge at these coordinates.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t vertex(const cell_key& at, int axis, int b, int along_b, int d,
                                                    int along_d) const {
        const auto moved = [&](int a, int from) { return from - (a == b ? along_b : a == d ? along_d : 0); };
        const std::uint32_t cell = cells.find(moved(0, at.x()), moved(1, at.y()), moved(2, at.z()));
        const int e = b < d ? cell_edge(axis, along_b, along_d) : cell_edge(axis, along_d, along_b);
        return static_cast<std::uint32_t>(cells.first_vertices[cell]) +
               static_cast<std::uint32_t>(cells.sheets(cell).of_edge(e));
    }
};

// The place of a vertex on the whole lattice.
[[nodiscard]] VOXELPIPE_HD inline lattice_vertex lattice_place(const surface_vertex& v) {
    return {std::int64_t{v.cell.x} * 65536 + v.q[0], std::int64_t{v.cell.y} * 65536 + v.q[1],
            std::int64_t{v.cell.z} * 65536 + v.q[2]};
}

// The two triangles of quad i.
struct cut_quads {
    const surface_vertex* vertices;
    const glm::uvec4* quads;
    bool folds; // as is_cut_from_first
    glm::uvec3* triangles;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::uvec4 q = quads[i];
        if (is_cut_from_first(at(q.x), at(q.y), at(q.z), at(q.w), folds)) {
            triangles[2 * i] = glm::uvec3(q.x, q.y, q.z);
            triangles[2 * i + 1] = glm::uvec3(q.x, q.z, q.w);
        } else {
            triangles[2 * i] = glm::uvec3(q.x, q.y, q.w);
            triangles[2 * i + 1] = glm::uvec3(q.y, q.z, q.w);
        }
    }

private:
    [[nodiscard]] VOXELPIPE_HD lattice_vertex at(std::uint32_t v) const { return lattice_place(vertices[v]); }
};

} // namespace voxelpipe::core::passes
