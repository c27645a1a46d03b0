// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "voxel_mesh.hpp"

#include "model/parallel.hpp"
#include "voxel_sheets.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <unordered_map>

namespace voxelize {
namespace {

// Joins single sides of one plane, which come by second axis, then first.
class rectangle_merger {
public:
    void merge(std::span<const voxel_face> sides, std::vector<voxel_face>& out) {
        if (sides.empty()) return;
        const std::size_t u = (sides[0].direction / 2U + 1U) % 3U;
        const std::size_t v = (sides[0].direction / 2U + 2U) % 3U;
        begin(sides, u, v);
        for (const voxel_face& side : sides) cell(side.low[u], side.low[v]) = present | side.rgb;
        for (const voxel_face& side : sides) {
            const std::uint32_t from = side.low[u];
            std::uint32_t row = side.low[v];
            const std::uint32_t color = cell(from, row);
            if (color == 0) continue; // joined to an earlier one
            std::uint32_t to = from + 1;
            while (to < end_[0] && cell(to, row) == color) ++to;
            do {
                for (std::uint32_t i = from; i < to; ++i) cell(i, row) = 0;
                ++row;
            } while (row < end_[1] && is_row_of(color, from, to, row));
            voxel_face face = side;
            face.size = {to - from, row - side.low[v]};
            out.push_back(face);
        }
    }

private:
    static constexpr std::uint32_t present = std::uint32_t{1} << 24;

    // Makes room for the box around the sides.
    void begin(std::span<const voxel_face> sides, std::size_t u, std::size_t v) {
        low_ = {sides[0].low[u], sides[0].low[v]};
        end_ = low_;
        for (const voxel_face& side : sides) {
            low_ = {std::min(low_[0], side.low[u]), std::min(low_[1], side.low[v])};
            end_ = {std::max(end_[0], side.low[u] + 1), std::max(end_[1], side.low[v] + 1)};
        }
        const std::size_t cells = std::size_t{end_[0] - low_[0]} * (end_[1] - low_[1]);
        if (cells_.size() < cells) cells_.resize(cells);
    }
    std::uint32_t& cell(std::uint32_t u, std::uint32_t v) {
        return cells_[std::size_t{v - low_[1]} * (end_[0] - low_[0]) + (u - low_[0])];
    }
    bool is_row_of(std::uint32_t color, std::uint32_t from, std::uint32_t to, std::uint32_t row) {
        for (std::uint32_t i = from; i < to; ++i)
            if (cell(i, row) != color) return false;
        return true;
    }

    std::array<std::uint32_t, 2> low_{}, end_{}; // of the plane's sides, along u and v
    std::vector<std::uint32_t> cells_;           // `present` and the colour, or 0; all 0 between calls
};

// The voxels of a brick and the two beyond it on every side: bit a + 2 of row [n + 2][b + 2] is the voxel at n along an
// axis, at a along axis + 1 and at b along axis + 2, each from -2 to 9.
struct brick_window {
    std::array<std::array<std::uint16_t, 12>, 12> rows{};

    [[nodiscard]] unsigned row(unsigned n, unsigned b) const { return rows[n][b]; }
    // The eight voxels of the brick itself at n and b, each from -1 to 8.
    [[nodiscard]] unsigned inner(unsigned n_after_2, unsigned b_after_2) const {
        return rows[n_after_2][b_after_2] >> 2U & 0xffU;
    }
};

// Makes the windows of a row of bricks, column by column.
class window_row {
public:
    // `near`: the bricks of the row and of the eight rows around it: layer below, layer and layer above, each with the
    // row before, the row and the row after.
    window_row(const voxel_shape& shape, int axis, std::array<std::span<const brick_order::placed>, 9> near)
        : shape_(shape), axis_(axis), near_(near) {}

    // Columns ascend from call to call.
    brick_window at(int column) {
        for (const int c : {column - 1, column, column + 1}) {
            column_rows& rows = columns_[static_cast<std::size_t>(c + 3) % 3];
            if (rows.column != c) read(rows, c);
        }
        const column_rows &before = columns_[static_cast<std::size_t>(column + 2) % 3],
                          &here = columns_[static_cast<std::size_t>(column + 3) % 3],
                          &after = columns_[static_cast<std::size_t>(column + 4) % 3];
        brick_window window;
        for (std::size_t n = 0; n < 12; ++n)
            for (std::size_t b = 0; b < 12; ++b)
                window.rows[n][b] = static_cast<std::uint16_t>(before.eight[n][b] >> 6U | here.eight[n][b] * 4U |
                                                               (after.eight[n][b] & 3U) << 10U);
        return window;
    }

private:
    // The voxels of a column of bricks: eight along axis + 1 in each row of a window.
    struct column_rows {
        int column = -2; // no column
        std::array<std::array<std::uint8_t, 12>, 12> eight{};
    };

    void read(column_rows& rows, int column) {
        rows.column = column;
        rows.eight = {};
        for (std::size_t k = 0; k < 9; ++k) {
            std::span<const brick_order::placed>& bricks = near_[k];
            while (!bricks.empty() && bricks.front().column() < column) bricks = bricks.subspan(1);
            if (bricks.empty() || bricks.front().column() != column) continue;
            const voxelpipe::brick_mask& mask = shape_.mask(bricks.front().brick);
            const range ns = range_of(k / 3), bs = range_of(k % 3);
            for (unsigned n = ns.begin; n < ns.end; ++n)
                for (unsigned b = bs.begin; b < bs.end; ++b)
                    rows.eight[ns.to + n][bs.to + b] = static_cast<std::uint8_t>(brick_row(mask, axis_, n, b));
        }
    }
    // The planes of the brick before this one, of this one, or of the one after, that a window has, and where.
    struct range {
        unsigned begin, end, to;
    };
    static range range_of(std::size_t which) {
        constexpr std::array<range, 3> all{range{6, 8, ~0U - 5}, range{0, 8, 2}, range{0, 2, 10}}; // 6 to 0
        return all[which];
    }

    const voxel_shape& shape_;
    int axis_;
    std::array<std::span<const brick_order::placed>, 9> near_;
    std::array<column_rows, 3> columns_; // of a column modulo 3
};

// The sheets of the four corners of the side of the voxel at (n, a, b) of a window's brick: a nibble for each, in the
// order of corners_of(). `upper`: the side is the one above the voxel.
std::uint16_t sheets_of_side(const brick_window& window, const voxel_sheets& table, unsigned n, unsigned a, unsigned b,
                             unsigned upper) {
    // The voxels around the corner of the lattice at (pn, pa, pb), each from -1 to 9.
    const auto mask_at = [&](unsigned pn, unsigned pa, unsigned pb) {
        const auto two = [&](unsigned rn, unsigned rb) { return window.row(rn, rb) >> (pa + 1) & 3U; };
        return two(pn + 1, pb + 1) | two(pn + 2, pb + 1) << 2U | two(pn + 1, pb + 2) << 4U | two(pn + 2, pb + 2) << 6U;
    };
    unsigned sheets = 0;
    for (unsigned corner = 0; corner < 4; ++corner) {
        const unsigned db = corner >> 1U, da = (corner & 1U) ^ db; // counter-clockwise
        std::array<unsigned, 3> at{a + da, n + upper, b + db};
        const unsigned mask = mask_at(at[1], at[0], at[2]);
        if (!table.is_special(mask)) continue;
        bool changes = false;
        if (const unsigned edge = table.edge_to_change(mask); edge != voxel_sheets::no_edge) {
            at[edge / 2] += edge % 2 != 0 ? 1U : ~0U;
            changes = table.edge_to_change(mask_at(at[1], at[0], at[2])) == (edge ^ 1U);
        }
        const unsigned place = upper == 0 && corner % 2 == 1 ? 4 - corner : corner; // as seen from outside
        sheets |= table.sheet(mask, changes, 1 - da, 1 - db) << 4 * place;
    }
    return static_cast<std::uint16_t>(sheets);
}

// The sides across an axis of one layer of bricks, which a thread finds at a time.
class layer_sides {
public:
    layer_sides(const voxel_shape& shape, const brick_order& order, int axis,
                std::span<const brick_order::placed> layer, bool colors, bool sheets)
        : shape_(shape), order_(order), axis_(axis), colors_(colors), sheets_(sheets),
          layer_(layer), layers_{order.layer_at(layer.front().at() - 1), layer,
                                 order.layer_at(layer.front().at() + 1)} {}

    void append(std::vector<voxel_face>& out, bool merge) {
        brick_order::for_each_row(layer_, [&](std::span<const brick_order::placed> row) { add_row(row); });
        if (!merge) {
            for (const std::vector<voxel_face>& plane : planes_) out.insert(out.end(), plane.begin(), plane.end());
            return;
        }
        rectangle_merger merger;
        for (const std::vector<voxel_face>& plane : planes_) merger.merge(plane, out);
    }

private:
    void add_row(std::span<const brick_order::placed> row) {
        std::array<std::span<const brick_order::placed>, 9> near;
        for (std::size_t k = 0; k < 9; ++k)
            near[k] = brick_order::row_of(layers_[k / 3], row.front().row() + static_cast<int>(k % 3) - 1);
        window_row windows(shape_, axis_, near);
        windows_.clear();
        for (const brick_order::placed& p : row) windows_.push_back(windows.at(p.column()));
        for (unsigned b = 0; b < 8; ++b)
            for (std::size_t i = 0; i < row.size(); ++i)
                for (unsigned n = 0; n < 8; ++n) {
                    const brick_window& w = windows_[i];
                    const unsigned here = w.inner(n + 2, b + 2);
                    add_sides(row[i], w, n, b, 0, here & ~w.inner(n + 1, b + 2));
                    add_sides(row[i], w, n, b, 1, here & ~w.inner(n + 3, b + 2));
                }
    }
    // The sides of the voxels of a row, below (0) or above (1) them.
    void add_sides(const brick_order::placed& p, const brick_window& window, unsigned n, unsigned b, unsigned upper,
                   unsigned bits) {
        for (; bits != 0; bits &= bits - 1) {
            const auto a = static_cast<unsigned>(std::countr_zero(bits));
            const glm::ivec3 voxel = order_.voxel_at(p, n, a, b);
            voxel_face face;
            for (int i = 0; i < 3; ++i) face.low[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(voxel[i]);
            face.low[static_cast<std::size_t>(axis_)] += upper; // the plane beyond the voxel
            if (colors_) face.rgb = shape_.rgb(p.brick, voxel);
            face.direction = static_cast<std::uint8_t>(2 * static_cast<unsigned>(axis_) + upper);
            if (sheets_) face.sheets = sheets_of_side(window, voxel_sheets::along(axis_), n, a, b, upper);
            planes_[2 * n + upper].push_back(face);
        }
    }

    const voxel_shape& shape_;
    const brick_order& order_;
    int axis_;
    bool colors_, sheets_;
    std::span<const brick_order::placed> layer_;
    std::array<std::span<const brick_order::placed>, 3> layers_; // below, this, above
    std::vector<brick_window> windows_;                          // of the bricks of a row
    std::array<std::vector<voxel_face>, 16> planes_;             // two directions each
};

// Numbers the corners of one plane of constant z: for each corner the list of its sheets and colours. Corners are found
// in a table with an entry for each place of the plane. Of a plane that is too large for that (most_places), a hash map
// holds the corners that the mesh has.
class plane_welder {
public:
    plane_welder(std::int64_t nx, std::int64_t ny, std::size_t faces) : width_(static_cast<std::size_t>(nx) + 1) {
        const std::size_t places = width_ * (static_cast<std::size_t>(ny) + 1);
        if (places <= most_places(faces)) table_.resize(places, none);
    }

    std::uint32_t number_of(const std::array<std::uint32_t, 3>& corner, std::uint32_t rgb_and_sheet) {
        std::uint32_t& first = first_of(corner);
        for (std::uint32_t n = first; n != none; n = next_[n])
            if (vertices[n].rgb_and_sheet == rgb_and_sheet) return n;
        const auto number = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back({corner, rgb_and_sheet});
        next_.push_back(first);
        first = number;
        return number;
    }
    // Ready for another plane; the vertices of this one are given away.
    std::vector<welded_mesh::vertex> take() {
        if (!table_.empty())
            for (const welded_mesh::vertex& v : vertices) table_[place_of(v.corner)] = none;
        found_.clear();
        next_.clear();
        return std::exchange(vertices, {});
    }

    std::vector<welded_mesh::vertex> vertices;

private:
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

    [[nodiscard]] std::size_t place_of(const std::array<std::uint32_t, 3>& corner) const {
        return static_cast<std::size_t>(corner[1]) * width_ + corner[0];
    }
    // The last vertex of a corner, from which next_ leads to the others.
    std::uint32_t& first_of(const std::array<std::uint32_t, 3>& corner) {
        const std::size_t place = place_of(corner);
        return table_.empty() ? found_.try_emplace(place, none).first->second : table_[place];
    }

    std::size_t width_;
    std::vector<std::uint32_t> table_;
    std::unordered_map<std::size_t, std::uint32_t> found_; // in place of the table
    std::vector<std::uint32_t> next_;
};

} // namespace

std::array<std::array<std::uint32_t, 3>, 4> corners_of(const voxel_face& face) {
    const std::size_t u = (face.direction / 2U + 1U) % 3U;
    const std::size_t v = (face.direction / 2U + 2U) % 3U;
    std::array<std::array<std::uint32_t, 3>, 4> corners{face.low, face.low, face.low, face.low};
    corners[1][u] += face.size[0];
    corners[2][u] += face.size[0];
    corners[2][v] += face.size[1];
    corners[3][v] += face.size[1];
    if (face.direction % 2 == 0) std::swap(corners[1], corners[3]); // seen from the low side
    return corners;
}

std::vector<voxel_face> voxel_faces(const voxel_shape& shape, bool merge, int threads,
                                    const std::function<void(double)>& progress, bool colors) {
    struct layer_of_axis {
        int axis;
        std::size_t layer;
    };
    std::vector<brick_order> orders;
    std::vector<layer_of_axis> work;
    for (int axis = 0; axis < 3; ++axis) {
        orders.emplace_back(shape, axis);
        for (std::size_t n = 0; n < orders.back().num_layers(); ++n) work.push_back({axis, n});
    }
    std::vector<std::vector<voxel_face>> parts(work.size());
    parallel_for(
        work.size(), thread_count(threads),
        [&](std::size_t n) {
            const auto [axis, layer] = work[n];
            const brick_order& order = orders[static_cast<std::size_t>(axis)];
            layer_sides(shape, order, axis, order.layer(layer), colors, !merge).append(parts[n], merge);
        },
        [&](std::size_t finished) {
            if (progress) progress(static_cast<double>(finished) / static_cast<double>(work.size()));
        });
    std::size_t count = 0;
    for (const std::vector<voxel_face>& part : parts) count += part.size();
    std::vector<voxel_face> faces;
    faces.reserve(count);
    for (std::vector<voxel_face>& part : parts) {
        faces.insert(faces.end(), part.begin(), part.end());
        part = {};
    }
    return faces;
}

welded_mesh weld(std::span<const voxel_face> faces, const std::array<std::int64_t, 3>& extent, int threads,
                 bool splits_colors) {
    // Corners by their z, each as 4 * face + corner.
    const auto planes = static_cast<std::size_t>(extent[2]) + 1;
    std::vector<std::size_t> begin(planes + 1);
    for (const voxel_face& face : faces)
        for (const auto& corner : corners_of(face)) ++begin[corner[2] + 1];
    for (std::size_t z = 0; z < planes; ++z) begin[z + 1] += begin[z];
    std::vector<std::uint32_t> by_plane(4 * faces.size());
    {
        std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
        for (std::size_t f = 0; f < faces.size(); ++f) {
            const auto corners = corners_of(faces[f]);
            for (std::size_t c = 0; c < 4; ++c) by_plane[next[corners[c][2]]++] = static_cast<std::uint32_t>(4 * f + c);
        }
    }
    welded_mesh mesh;
    mesh.quads.resize(faces.size());
    std::vector<std::vector<welded_mesh::vertex>> vertices(planes);
    const int workers = thread_count(threads);
    // A few runs of planes for each thread: the table of corners is made once a run.
    const std::size_t runs = std::min(planes, static_cast<std::size_t>(4 * workers));
    parallel_for(runs, workers, [&](std::size_t run) {
        plane_welder welder(extent[0], extent[1], faces.size());
        for (std::size_t z = planes * run / runs; z < planes * (run + 1) / runs; ++z) {
            for (std::size_t n = begin[z]; n < begin[z + 1]; ++n) {
                const std::uint32_t id = by_plane[n];
                const voxel_face& face = faces[id / 4];
                mesh.quads[id / 4][id % 4] = welder.number_of(corners_of(face)[id % 4], (splits_colors ? face.rgb : 0) |
                                                                                            face.sheet(id % 4) << 24U);
            }
            vertices[z] = welder.take();
        }
    });
    std::vector<std::uint32_t> first(planes);
    std::size_t count = 0;
    for (std::size_t z = 0; z < planes; ++z) {
        first[z] = static_cast<std::uint32_t>(count);
        count += vertices[z].size();
    }
    mesh.vertices.reserve(count);
    for (const auto& plane : vertices) mesh.vertices.insert(mesh.vertices.end(), plane.begin(), plane.end());
    constexpr std::size_t block = std::size_t{1} << 16;
    parallel_for((faces.size() + block - 1) / block, workers, [&](std::size_t b) {
        for (std::size_t f = b * block; f < std::min(faces.size(), (b + 1) * block); ++f) {
            const auto corners = corners_of(faces[f]);
            for (std::size_t c = 0; c < 4; ++c) mesh.quads[f][c] += first[corners[c][2]];
        }
    });
    return mesh;
}

} // namespace voxelize
