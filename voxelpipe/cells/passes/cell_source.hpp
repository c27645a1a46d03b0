// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The triangles of a call's draws as one list in the backend's memory: vertex shaders, snapping, indices; and the
// directed edges that no opposite edge cancels. Functors for Backend::for_each, the same on every backend.

#include <voxelpipe/cells/cells.hpp>
#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/programs/elements.hpp>
#include <voxelpipe/solid/passes/edge_passes.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

// What the passes count, in 64-bit words. A volume comes in parts of 32, 32 and 64 bits, so that sums of 2^32 rows fit.
enum class cell_count : std::uint8_t {
    bad_index,
    nonfinite,
    too_far,
    outside,
    too_large,
    open_rows,
    open_edges,
    cut_voxels,
    below_zero,
    above_one,
    fragments,
    discarded,
    voxels,
    volume_low,
    volume_middle,
    volume_high,
    lost_centroids,
    size
};
[[nodiscard]] VOXELPIPE_HD constexpr std::size_t index_of(cell_count c) { return static_cast<std::size_t>(c); }
VOXELPIPE_HD inline void add_count(std::uint64_t* counts, cell_count c, std::uint64_t n) {
    if (n != 0) add_shared(counts[index_of(c)], n);
}

namespace passes {

// Triangles of all draws, whose positions have been turned so that rows run along x.
struct cell_mesh {
    const snapped_position* positions;
    const glm::uvec3* triangles;         // of bad indices: all of them vertex 0, which counts
    const std::uint64_t* first_triangle; // of each draw, then of the cones of each draw, or of all, if there are any
    std::uint32_t num_parts;             // of them
    std::uint32_t num_draws;
    std::uint32_t num_drawn;     // triangles of the draws
    std::uint32_t num_triangles; // and of cones, which come behind
    int fraction;
    glm::ivec3 extent; // turned, too
    cell_areas areas;  // of the turned voxel

    // Which draw, or whose holes: of several bodies the body.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t draw_of(std::uint64_t triangle) const {
        const std::uint32_t part = find_owner(first_triangle, num_parts, triangle);
        return part < num_draws ? part : part - num_draws;
    }
    [[nodiscard]] VOXELPIPE_HD snapped_position corner(std::uint64_t triangle, int i) const {
        const glm::uvec3& t = triangles[triangle];
        return positions[i == 0 ? t.x : i == 1 ? t.y : t.z];
    }
};

// Shades and snaps the vertices of a draw.
template <class Mesh, class VertexShader>
struct snap_vertices_of_cells {
    Mesh mesh;
    VertexShader shader;
    std::uint32_t draw;
    snap_transform snap;
    int axis;
    snapped_position* out;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t each = mesh.positions.size(), instance = i / each;
        const auto v = fetch_vertex(mesh, static_cast<std::uint32_t>(i - instance * each), draw,
                                    static_cast<std::uint32_t>(instance));
        const auto result = shader(v);
        const glm::vec3 at = vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
        const snapped_position p = core::snap(snap, at.x, at.y, at.z);
        // A vertex that cannot be drawn has its mark in x.
        if (axis == 0 || !is_drawable(p))
            out[i] = p;
        else
            out[i] = axis == 1 ? snapped_position{p.y, p.z, p.x} : snapped_position{p.z, p.x, p.y};
    }
};

// Numbers the vertices of a draw's triangles through all draws.
struct join_triangles {
    element_indices<3> in;
    std::uint32_t first_vertex;
    glm::uvec3* out;
    std::uint64_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto e = in.locate(static_cast<std::uint32_t>(i));
        out[i] = glm::uvec3(0u, 0u, 0u);
        if (e.ok)
            out[i] = glm::uvec3(e.index[0] + first_vertex, e.index[1] + first_vertex, e.index[2] + first_vertex);
        else
            add_count(counts, cell_count::bad_index, 1);
    }
};

// ---- open edges -----------------------------------------------------------------------------------------------------

// Counts the edges that are left, at the first of each run of equal ones.
struct count_unmatched_edges {
    sorted_edges in;
    std::uint64_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::int64_t sum = in.sum_from(i);
        add_count(counts, cell_count::open_edges, static_cast<std::uint64_t>(sum < 0 ? -sum : sum));
    }
};

} // namespace passes
} // namespace voxelpipe::core
