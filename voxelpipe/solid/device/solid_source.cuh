// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sources of a solid's triangles: one mesh that is shaded on the spot, or the positions that vertex_shade
// left of any number of draws; and which rows each of them may cross.

#include <voxelpipe/device/scene/triangle_source.cuh>
#include <voxelpipe/solid/core/crossing.hpp>

#include <cstdint>

namespace voxelpipe::device {

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

// The result of a first look at a triangle. Most small ones lie between the centres of all rows.
enum class first_look : std::uint8_t { no_rows, outside, unknown };

// A vertex among the centres of rows, in 16 bits an axis: 0 before the part, then 1 and the number of the part's
// centres that lie before it, extent + 2 behind the part. Codes ascend with coordinates, so those of its corners tell
// of a triangle's interval whether it meets the part and whether it holds a centre.
struct row_code {
    static constexpr std::uint32_t none = ~0u; // of a vertex that does not fit 32 bits
    static constexpr int max_extent = 65000;

    [[nodiscard]] VOXELPIPE_HD static bool serves(const row_grid& grid) {
        return grid.extent.y <= max_extent && grid.extent.z <= max_extent;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static std::uint32_t of(std::int32_t q, int fraction, int extent) {
        const std::int32_t up = (1 << fraction) - 1 - (1 << (fraction - 1)); // of a ceiling, less half a voxel
        const std::int32_t before = (q + up) >> fraction;
        return static_cast<std::uint32_t>(q < 0                         ? 0
                                          : q - 1 >= extent << fraction ? extent + 2
                                                                        : 1 + (before < extent ? before : extent));
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static std::uint32_t of(const std::int32_t (&q)[3],
                                                                      const row_grid& grid) {
        return of(q[2], grid.fraction, grid.extent.z) << 16 | of(q[1], grid.fraction, grid.extent.y);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static first_look look(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                                                     const row_grid& grid) {
        const auto ny = static_cast<std::uint32_t>(grid.extent.y), nz = static_cast<std::uint32_t>(grid.extent.z);
        const std::uint32_t y0 = core::min3(a & 0xffffu, b & 0xffffu, c & 0xffffu),
                            y1 = core::max3(a & 0xffffu, b & 0xffffu, c & 0xffffu),
                            z0 = core::min3(a >> 16, b >> 16, c >> 16), z1 = core::max3(a >> 16, b >> 16, c >> 16);
        if (y1 == none >> 16) return first_look::unknown;
        if (y1 == 0 || z1 == 0 || y0 > ny + 1 || z0 > nz + 1) return first_look::outside;
        const bool is_between = y0 == y1 || z0 == z1 || y1 == 1 || z1 == 1 || y0 == ny + 1 || z0 == nz + 1;
        return is_between ? first_look::no_rows : first_look::unknown;
    }
};

// One draw whose vertices are shaded where they are read.
template <class Mesh, class VertexShader>
struct shaded_triangles {
    shading_source<Mesh, VertexShader> source;
    std::uint32_t* codes; // of the vertices: find_row_codes
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
    // Input of the first look.
    struct corners {
        std::uint32_t a, b, c;
    };
    [[nodiscard]] __device__ VOXELPIPE_INLINE corners fetch(const located& at) const {
        if (!at.index_ok) return {row_code::none, row_code::none, row_code::none};
        return {codes[at.index.x], codes[at.index.y], codes[at.index.z]};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static first_look look(const corners& c, const row_grid& grid) {
        return row_code::look(c.a, c.b, c.c, grid);
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
    row_grid grid;
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
    struct corners {
        std::uint32_t a, b, c;
    };
    [[nodiscard]] __device__ VOXELPIPE_INLINE corners fetch(const located& at) const {
        if (!at.index_ok || !row_code::serves(grid)) return {row_code::none, row_code::none, row_code::none};
        const auto code = [&](std::uint32_t vertex) VOXELPIPE_INLINE_LAMBDA {
            std::int32_t q[3];
            return load_int32(at, vertex, q) ? row_code::of(q, grid) : row_code::none;
        };
        return {code(at.index.x), code(at.index.y), code(at.index.z)};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE static first_look look(const corners& c, const row_grid& grid) {
        return row_code::look(c.a, c.b, c.c, grid);
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

// A triangle on its way to its crossings.
struct solid_triangle {
    core::triangle_class kind = core::triangle_class::drawn;
    bool index_ok = true;
    bool fits_int32 = false;
    std::uint32_t draw = 0;
    core::row_box rows{{0, -1}, {0, -1}}; // those that it may cross
    std::int32_t q[3][3];                 // if fits_int32: [vertex][axis]
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
[[nodiscard]] __device__ VOXELPIPE_INLINE bool cut_rows(const std::int32_t (&q)[3][3], const row_grid& grid,
                                                        core::row_box& rows) {
    const bool y = cut_int32(core::min3(q[0][1], q[1][1], q[2][1]), core::max3(q[0][1], q[1][1], q[2][1]),
                             grid.fraction, grid.extent.y, rows.u);
    const bool z = cut_int32(core::min3(q[0][2], q[1][2], q[2][2]), core::max3(q[0][2], q[1][2], q[2][2]),
                             grid.fraction, grid.extent.z, rows.v);
    return y && z;
}

// A triangle of the 64- and 128-bit paths: where it lies. Out of line, because few do.
template <class Source>
__device__ __noinline__ void find_wide_rows(const Source& source, const row_grid& grid,
                                            const typename Source::located& at, solid_triangle& t) {
    using core::triangle_class;
    const core::snapped_position p[3] = {source.exact(at, at.index.x), source.exact(at, at.index.y),
                                         source.exact(at, at.index.z)};
    const core::voxel_box whole = grid.whole_box();
    t.kind = core::classify_for_rows(p[0], p[1], p[2], grid.fraction, whole);
    if (t.kind == triangle_class::nonfinite || t.kind == triangle_class::too_far) return;
    t.rows = core::rows_within<0>(p[0], p[1], p[2], grid.fraction, whole);
}

// Finds the rows that triangle i may cross.
template <class Source>
[[nodiscard]] __device__ VOXELPIPE_INLINE solid_triangle load_solid_triangle(const Source& source, const row_grid& grid,
                                                                             std::uint32_t i) {
    solid_triangle t;
    const auto at = source.locate(i);
    t.index_ok = at.index_ok;
    t.draw = at.draw;
    if (!t.index_ok) return t;
    const bool a = source.load_int32(at, at.index.x, t.q[0]), b = source.load_int32(at, at.index.y, t.q[1]),
               c = source.load_int32(at, at.index.z, t.q[2]);
    t.fits_int32 = a && b && c;
    if (!t.fits_int32) {
        solid_triangle wide;
        find_wide_rows(source, grid, at, wide);
        t.kind = wide.kind;
        t.rows = wide.rows;
    } else if (!cut_rows(t.q, grid, t.rows)) {
        t.kind = core::triangle_class::outside;
    }
    return t;
}

} // namespace voxelpipe::device
