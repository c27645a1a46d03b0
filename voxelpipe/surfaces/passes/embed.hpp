// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Pairs of triangles that intersect, and their vertices moved to the mean: functors for a backend's for_each.

#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/surfaces/core/triangle_pair.hpp>
#include <voxelpipe/surfaces/passes/vertices.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// What a round counts.
enum class embed_count : int { pairs, moved, count };

// Marks of a vertex.
constexpr std::uint32_t is_of_a_pair = 1, is_at_the_mean = 2;

// Vertices without marks; those of place::mean are where they would be moved to.
struct start_marks {
    std::uint32_t* marks;
    bool at_the_mean;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { marks[i] = at_the_mean ? is_at_the_mean : 0; }
};

// The pairs of triangles that intersect properly, of two quads that have a vertex in cell i. Vertices lie inside of
// their cells, so a quad lies in its four cells, and quads without a cell in common are apart. A pair of quads with
// several belongs to the lowest one. All threads write the same value to a mark.
template <class Cells>
struct find_pairs {
    Cells cells;
    const surface_vertex* vertices;
    const glm::uvec3* triangles; // 2 q and 2 q + 1 are quad q
    std::uint32_t* marks;
    std::uint64_t* pairs; // a count

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto cell = static_cast<std::uint32_t>(i);
        const cell_key at{cells.keys[cell]};
        const int corners = cells.states[cell] & 255;
        std::uint64_t quads[12];
        int edges[12], count = 0;
        for (int e = 0; e < 12; ++e) {
            if (!is_crossed(corners, e)) continue;
            edges[count] = e;
            quads[count++] = cells.crossing(at, e);
        }
        std::uint64_t found = 0;
        for (int a = 0; a < count; ++a) {
            if (reaches_below(edges[a]) == 0) found += test(2 * quads[a], 2 * quads[a] + 1);
            for (int b = 0; b < a; ++b) {
                if ((reaches_below(edges[a]) & reaches_below(edges[b])) != 0) continue;
                for (std::uint64_t k = 0; k < 4; ++k) found += test(2 * quads[a] + (k & 1), 2 * quads[b] + (k >> 1));
            }
        }
        if (found != 0) add_shared(*pairs, found);
    }

private:
    // The axes, as bits, along which an edge of a cell also belongs to the cell below.
    [[nodiscard]] VOXELPIPE_HD static int reaches_below(int e) { return ~(edge_corner(e) | 1 << (e >> 2)) & 7; }

    [[nodiscard]] VOXELPIPE_HD std::uint64_t test(std::uint64_t t, std::uint64_t u) const {
        lattice_vertex a[3], b[3];
        read(t, a);
        read(u, b);
        if (!triangle_pair(a, b).intersects()) return 0;
        for (int k = 0; k < 3; ++k) {
            store_shared(marks[triangles[t][k]], is_of_a_pair, true);
            store_shared(marks[triangles[u][k]], is_of_a_pair, true);
        }
        return 1;
    }
    VOXELPIPE_HD void read(std::uint64_t triangle, lattice_vertex (&to)[3]) const {
        for (int k = 0; k < 3; ++k) to[k] = lattice_place(vertices[triangles[triangle][k]]);
    }
};

// Moves the marked vertices of cell i to the mean, once.
template <class Cells>
struct move_to_mean {
    place_vertices<Cells> means; // by place::mean
    std::uint32_t* marks;
    std::uint64_t* moved; // a count

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto cell = static_cast<std::uint32_t>(i);
        const cell_key at{means.cells.keys[cell]};
        const cell_sheets sheets = means.cells.sheets(cell);
        std::uint64_t count = 0;
        for (int s = 0; s < sheets.count(); ++s) {
            const std::uint64_t v = means.cells.first_vertices[cell] + static_cast<std::uint64_t>(s);
            if (marks[v] != is_of_a_pair) continue;
            std::uint32_t source = 0;
            means.store(v, means.points_of(at, sheets, s, source));
            marks[v] = is_at_the_mean;
            ++count;
        }
        if (count != 0) add_shared(*moved, count);
    }
};

} // namespace voxelpipe::core::passes
