// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The triangles of a call as one array, and their crossings with rows of samples, listed by row. Functors for a
// backend's for_each.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/instances.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/shader.hpp>
#include <voxelpipe/solid/core/crossing.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::core::passes {

// Snaps vertex i of all instances of a mesh.
template <class Mesh, class VertexShader>
struct snap_vertices {
    Mesh mesh;
    VertexShader shader;
    std::uint32_t draw;
    snap_transform transform;
    snapped_position* positions;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto each = static_cast<std::uint64_t>(mesh.positions.size());
        const auto result = shader(
            fetch_vertex(mesh, static_cast<std::uint32_t>(i % each), draw, static_cast<std::uint32_t>(i / each)));
        const glm::vec3 p = vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
        positions[i] = snap(transform, p.x, p.y, p.z);
    }
};
// Triangle i of all instances, its vertices counted from `first`.
struct copy_triangles {
    instanced_triangles from;
    std::uint32_t first;
    glm::uvec3* to;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::uvec3 t = from[static_cast<std::uint32_t>(i)];
        to[i] = glm::uvec3(t.x + first, t.y + first, t.z + first);
    }
};
template <class T>
struct copy_items {
    const T* from;
    T* to;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { to[i] = from[i]; }
};
// Primitive of triangle i of a mesh.
struct name_primitives {
    const std::uint32_t* numbers; // of the triangles of an instance; null: their own
    std::uint32_t each, each_primitives, first;
    std::uint32_t* primitives;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto triangle = static_cast<std::uint32_t>(i) % each, instance = static_cast<std::uint32_t>(i) / each;
        primitives[i] = first + instance * each_primitives + (numbers != nullptr ? numbers[triangle] : triangle);
    }
};

// The triangles of all draws, then the cones that close their holes.
struct mesh_triangles {
    const snapped_position* positions;
    const glm::uvec3* triangles;
    const std::uint32_t* primitives;
    std::uint64_t count;
    std::uint64_t drawn;        // those before the cones
    const std::uint64_t* first; // triangle of each part: draws, then cones
    const std::uint32_t* body;  // of each part
    std::uint32_t parts;

    [[nodiscard]] VOXELPIPE_HD std::uint32_t body_of(std::uint32_t triangle) const {
        return body[bisect_last(0u, parts, [&](std::uint32_t i) { return first[i] <= triangle; })];
    }
};

// The key of a crossing: its row, then the first sample beyond it plus 1, from 0 for all before the grid's lowest edge
// to the number of samples plus 1, then 1 if it leaves the mesh.
template <int Axis>
struct row_keys {
    static constexpr int u = (Axis + 1) % 3, v = (Axis + 2) % 3;
    std::int64_t samples, rows_u, rows_v;
    int bits; // of what follows the row

    row_keys(const glm::ivec3& extent)
        : samples(extent[Axis]), rows_u(extent[u]), rows_v(extent[v]), bits(ceil_log2(2 * (samples + 3))) {
    } // room for what follows the last crossing
    [[nodiscard]] VOXELPIPE_HD std::uint64_t rows() const { return static_cast<std::uint64_t>(rows_u * rows_v); }
    [[nodiscard]] int key_bits() const { return bits + ceil_log2(rows_u * rows_v); }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t row(std::int64_t at_u, std::int64_t at_v) const {
        return static_cast<std::uint64_t>(at_v * rows_u + at_u);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t key(std::uint64_t row, std::int64_t first, bool leaves) const {
        const std::int64_t at = first < 0 ? 0 : first + 1;
        return row << bits | static_cast<std::uint64_t>(2 * at + (leaves ? 1 : 0));
    }
};

// Counts the crossings of triangle i with rows along Axis, or lists them. A crossing beyond the last edge changes
// nothing and is left out.
template <int Axis>
struct list_mesh_crossings {
    mesh_triangles mesh;
    row_keys<Axis> rows;
    voxel_box whole;
    int fraction;
    std::uint32_t* counts;       // null: list
    const std::uint64_t* places; // null: count
    std::uint64_t* keys;
    std::uint32_t* triangles;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint32_t n = 0;
        const std::uint64_t at = places != nullptr ? places[i] : 0;
        if (i < mesh.count)
            each(i, [&](std::uint64_t key) {
                if (places != nullptr) {
                    keys[at + n] = key;
                    triangles[at + n] = static_cast<std::uint32_t>(i);
                }
                ++n;
            });
        if (counts != nullptr) counts[i] = n;
    }
    // Calls f(key) for the crossings of triangle i.
    template <class F>
    VOXELPIPE_HD void each(std::uint64_t i, const F& f) const {
        const glm::uvec3 t = mesh.triangles[i];
        const snapped_position a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
        if (classify_positions(a, b, c) != triangle_class::drawn) return;
        const row_box box = rows_within<Axis>(a, b, c, fraction, whole);
        if (box.empty()) return;
        for_each_crossing<Axis, centre_offset<>>(a, b, c, fraction, box,
                                                 [&](std::int64_t u, std::int64_t v, std::int64_t first, int winding) {
                                                     if (first <= rows.samples)
                                                         f(rows.key(rows.row(u, v), first, winding < 0));
                                                 });
    }
};

// Where the crossings of a row lie in the list; nowhere if begin and end are equal.
struct row_range {
    std::uint64_t begin, end;
};
struct clear_rows {
    row_range* ranges;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { ranges[i] = {}; }
};
// The ranges of rows below num_rows that have crossings, from crossing i.
struct find_rows {
    const std::uint64_t* keys;
    std::uint64_t count, num_rows;
    int bits;
    row_range* ranges;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t row = keys[i] >> bits;
        if (row >= num_rows) return; // behind the crossings
        if (i == 0 || keys[i - 1] >> bits != row) ranges[row].begin = i;
        if (i + 1 == count || keys[i + 1] >> bits != row) ranges[row].end = i + 1;
    }
};

} // namespace voxelpipe::core::passes
