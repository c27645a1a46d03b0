// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Where the triangles of a solid come from: one mesh that is shaded on the spot, or the positions that vertex_shade
// left of any number of draws; and which rows each of them may cross.

#include <voxelpipe/core/crossing.hpp>
#include <voxelpipe/device/scene/triangle_source.cuh>

#include <cstdint>

namespace voxelpipe::device {

// One draw whose vertices are shaded where they are read.
template <class Mesh, class VertexShader>
struct shaded_triangles {
    shading_source<Mesh, VertexShader> source;
    std::uint32_t num_triangles, num_vertices;

    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool is_counted(std::uint64_t) { return true; }

    struct located {
        glm::uvec3 index;
        bool index_ok;
        static constexpr std::uint32_t draw = 0;
    };
    [[nodiscard]] __device__ VOXELPIPE_INLINE located locate(std::uint32_t i) const {
        const glm::uvec3 index = source.triangle(i);
        return {index, index.x < num_vertices && index.y < num_vertices && index.z < num_vertices};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE bool load_int32(const located&, std::uint32_t vertex,
                                                              std::int32_t (&q)[3]) const {
        return source.int32_position(source.load(vertex), q);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE core::snapped_position exact(const located&, std::uint32_t vertex) const {
        return source.position(vertex);
    }
};

// All draws, after vertex_shade.
struct stored_triangles {
    geometry geo;
    std::uint32_t num_triangles;
    std::uint32_t num_counted; // the draws' triangles; those behind them close holes

    [[nodiscard]] __device__ VOXELPIPE_INLINE bool is_counted(std::uint64_t i) const { return i < num_counted; }

    struct located {
        glm::uvec3 index;
        bool index_ok;
        std::uint32_t draw;
        vertex_positions positions;
    };
    [[nodiscard]] __device__ VOXELPIPE_INLINE located locate(std::uint32_t i) const {
        located t;
        t.draw = geo.find_draw(i);
        const draw_geometry& d = geo.draw(t.draw);
        t.index = d.triangles[i - d.first_primitive];
        t.index_ok = t.index.x < d.num_vertices && t.index.y < d.num_vertices && t.index.z < d.num_vertices;
        t.positions = d.positions;
        return t;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static bool load_int32(const located& t, std::uint32_t vertex,
                                                                     std::int32_t (&q)[3]) {
        const int32_position p = t.positions.int32[vertex];
        for (int k = 0; k < 3; ++k) q[k] = p.q[k];
        return p.fits_int32 != 0;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static core::snapped_position exact(const located& t,
                                                                                  std::uint32_t vertex) {
        return t.positions.exact[vertex];
    }
};

// The rows of the computed part of a grid: they run along x, so u is y and v is z.
struct row_grid {
    glm::ivec3 extent;
    int fraction;

    [[nodiscard]] VOXELPIPE_HD std::uint64_t row(std::int64_t y, std::int64_t z) const {
        return static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(extent.y) + static_cast<std::uint64_t>(y);
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_rows() const { return row(0, extent.z); }
    // The voxel from which on a crossing counts: the first one, if it lies before the part, extent.x, if behind.
    [[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::uint32_t position(std::int64_t first) const {
        return first <= 0         ? 0
               : first < extent.x ? static_cast<std::uint32_t>(first)
                                  : static_cast<std::uint32_t>(extent.x);
    }
    [[nodiscard]] VOXELPIPE_HD core::voxel_box whole_box() const {
        return {{{0, 0, 0}}, {{extent.x - 1, extent.y - 1, extent.z - 1}}};
    }
};

// A triangle on its way to its crossings.
struct solid_triangle {
    core::triangle_class kind = core::triangle_class::drawn;
    bool index_ok = true;
    std::uint32_t draw = 0;
    core::row_box rows{{0, -1}, {0, -1}}; // those that it may cross
    core::snapped_position p[3];          // unless `rows` is empty
};

// An interval of an axis in 32 bits: whether the closed voxels from `low` to `high` meet 0 .. extent - 1, and the
// centres between them, cut to that.
[[nodiscard]] __device__ VOXELPIPE_INLINE bool cut_int32(std::int32_t low, std::int32_t high, int fraction, int extent,
                                                         core::index_span& centres) {
    const std::int32_t up = (1 << fraction) - 1 - (1 << (fraction - 1)); // of a ceiling, less half a voxel
    const std::int32_t first = (low + up) >> fraction, last = ((high + up) >> fraction) - 1;
    centres = {first > 0 ? first : 0, last < extent - 1 ? last : extent - 1};
    return (low - 1) >> fraction < extent && high >> fraction >= 0;
}

// Most small triangles have no row; of one that has 32-bit positions that is found out without wider numbers.
template <class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE solid_triangle load_solid_triangle(const Source& source, const row_grid& grid,
                                                                             std::uint32_t i) {
    using core::triangle_class;
    solid_triangle t;
    const auto at = source.locate(i);
    t.index_ok = at.index_ok;
    t.draw = at.draw;
    if (!t.index_ok) return t;
    std::int32_t q[3][3];
    const bool a = source.load_int32(at, at.index.x, q[0]), b = source.load_int32(at, at.index.y, q[1]),
               c = source.load_int32(at, at.index.z, q[2]);
    if (a && b && c) {
        const bool meets_y = cut_int32(core::min3(q[0][1], q[1][1], q[2][1]), core::max3(q[0][1], q[1][1], q[2][1]),
                                       grid.fraction, grid.extent.y, t.rows.u);
        const bool meets_z = cut_int32(core::min3(q[0][2], q[1][2], q[2][2]), core::max3(q[0][2], q[1][2], q[2][2]),
                                       grid.fraction, grid.extent.z, t.rows.v);
        if (!meets_y || !meets_z) t.kind = triangle_class::outside;
        if (!t.rows.empty())
            for (int v = 0; v < 3; ++v) t.p[v] = {q[v][0], q[v][1], q[v][2]};
        return t;
    }
    t.p[0] = source.exact(at, at.index.x);
    t.p[1] = source.exact(at, at.index.y);
    t.p[2] = source.exact(at, at.index.z);
    if (!core::is_drawable(t.p[0]) || !core::is_drawable(t.p[1]) || !core::is_drawable(t.p[2])) {
        const bool nonfinite =
            t.p[0].x == core::nonfinite_mark || t.p[1].x == core::nonfinite_mark || t.p[2].x == core::nonfinite_mark;
        t.kind = nonfinite ? triangle_class::nonfinite : triangle_class::too_far;
        return t;
    }
    const core::voxel_box whole = grid.whole_box();
    if (!core::meets_rows(t.p[0], t.p[1], t.p[2], grid.fraction, whole)) t.kind = triangle_class::outside;
    t.rows = core::rows_within<0>(t.p[0], t.p[1], t.p[2], grid.fraction, whole);
    return t;
}

} // namespace voxelpipe::device
