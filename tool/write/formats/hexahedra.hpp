// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The occupied voxels of a shape as hexahedra that share their nodes: what .vtu, .inp and .msh hold.
//
// Nodes are the corners of occupied voxels, each once, numbered from 0 by z, then y, then x; cells are numbered in the
// same order of their voxels. The corners of a cell are those of VTK_HEXAHEDRON, C3D8 and Gmsh's type 5: around the
// lower side counter-clockwise as seen from above, then around the upper side, so that its Jacobian is positive.
//
// The mesh is not kept. It is made in parts, some rows of one plane each, whose first numbers are known; a part takes
// memory in proportion to the rows, and any thread may make any part.

#include "voxel_shape.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace voxelize {

// Bits along x, some rows of them.
struct bit_rows {
    std::size_t words = 0; // of a row
    std::vector<std::uint64_t> data;

    bit_rows(std::size_t rows, std::size_t words_of_row) : words(words_of_row), data(rows * words_of_row) {}
    [[nodiscard]] std::uint64_t* row(std::size_t n) { return data.data() + n * words; }
    [[nodiscard]] const std::uint64_t* row(std::size_t n) const { return data.data() + n * words; }
};

// The six outward directions, in the order of their numbers: 0 -x, 1 +x, 2 -y, 3 +y, 4 -z, 5 +z.
inline constexpr std::array<const char*, 6> direction_names{"X_NEGATIVE", "X_POSITIVE", "Y_NEGATIVE",
                                                            "Y_POSITIVE", "Z_NEGATIVE", "Z_POSITIVE"};

// Some of the cells: returns the bits of those that lie in the rows [row, end) of a plane, none outside of the grid.
using cell_choice = std::function<bit_rows(int plane, int row, int end)>;

// Some of the sides: those of the cells `of`, or of all cells, that have a neighbour which is one of the cells `beside`
// or, without `beside`, that have no neighbour.
struct side_choice {
    cell_choice of, beside;
};

// Refers to the shape.
class hexahedra {
public:
    hexahedra(const voxel_shape& shape, int threads);

    [[nodiscard]] const voxel_shape& shape() const { return shape_; }
    [[nodiscard]] std::uint64_t num_nodes() const { return first_node_.back(); }
    [[nodiscard]] std::uint64_t num_cells() const { return first_cell_.back(); }
    [[nodiscard]] std::size_t num_parts() const { return first_cell_.size() - 1; }
    // The number of the first node or cell of a part.
    [[nodiscard]] std::uint64_t first_node(std::size_t part) const { return first_node_[part]; }
    [[nodiscard]] std::uint64_t first_cell(std::size_t part) const { return first_cell_[part]; }
    [[nodiscard]] std::uint64_t nodes_of(std::size_t part) const { return first_node_[part + 1] - first_node_[part]; }
    [[nodiscard]] std::uint64_t cells_of(std::size_t part) const { return first_cell_[part + 1] - first_cell_[part]; }

    // Calls visit(x, y, z) with the lattice corner of each node of a part, by their numbers.
    template <class Visit>
    void for_each_node(std::size_t part, const Visit& visit) const;
    // Calls visit(number, corners) with the eight node numbers of each cell of a part.
    template <class Visit>
    void for_each_cell(std::size_t part, const Visit& visit) const;
    // Calls visit(number, brick, glm::ivec3 voxel) for each cell of a part.
    template <class Visit>
    void for_each_voxel(std::size_t part, const Visit& visit) const;
    // Calls visit(plane, row, end) with the rows [row, end) of a plane that a part's cells lie in.
    template <class Visit>
    void with_rows(std::size_t part, const Visit& visit) const {
        const place p = place_of(part);
        visit(p.plane, p.row, p.end_row);
    }
    // Calls visit(brick, glm::ivec3 voxel) for the voxels in the rows [row, end) of a plane, by y, then x; none lie
    // outside of the grid.
    template <class Visit>
    void for_each_voxel_of_rows(int plane, int row, int end, const Visit& visit) const;
    // Voxels of the rows [row, end) of a plane, none outside of the grid.
    [[nodiscard]] bit_rows voxel_rows(int plane, int row, int end) const;
    [[nodiscard]] std::size_t words_of_row() const { return words_; }
    // The number of the first bit at or after the start of each word, where bits are numbered on from `first`.
    [[nodiscard]] static std::vector<std::uint64_t> ranks(const bit_rows& rows, std::uint64_t first);

    // For each cell of a part the sides that are chosen: bit d is set for that in direction d.
    [[nodiscard]] std::vector<std::uint8_t> sides_of_cells(std::size_t part, const side_choice& sides) const;
    // Numbers of the nodes of a part that chosen sides of any cells have, ascending.
    [[nodiscard]] std::vector<std::uint64_t> nodes_of_sides(std::size_t part, const side_choice& sides) const;
    // Numbers of the nodes of a part that chosen cells have, ascending.
    [[nodiscard]] std::vector<std::uint64_t> nodes_of_cells(std::size_t part, const cell_choice& cells) const;
    // The parts that have the nodes of cells of these parts. Both lists ascend.
    [[nodiscard]] std::vector<std::size_t> parts_of_nodes(std::span<const std::size_t> parts) const;
    // Numbers of the cells of a part without a neighbour in a direction, ascending.
    [[nodiscard]] std::vector<std::uint64_t> cells_at_side(std::size_t part, unsigned direction) const;
    // Numbers of the nodes of a part that such sides of any cells have, ascending.
    [[nodiscard]] std::vector<std::uint64_t> nodes_at_side(std::size_t part, unsigned direction) const;

private:
    struct place {
        int plane, row, end_row; // of voxels; nodes of the last rows have one row more
        int end_node_row;
    };
    [[nodiscard]] place place_of(std::size_t part) const;
    [[nodiscard]] bit_rows node_rows(int plane, int row, int end) const;
    // Nodes between two planes of voxels, whose rows begin one row before those of the nodes and end with them.
    [[nodiscard]] static bit_rows node_rows(const bit_rows& below, const bit_rows& above);
    // Rows of cells that sides may be of, and those of what may lie beside them: the planes below, of and above the
    // cells, each from one row before them to one after them.
    struct rows_around {
        bit_rows of;
        std::array<bit_rows, 3> beside;
        bool is_outer; // sides are where nothing lies beside
    };
    [[nodiscard]] rows_around around(int plane, int row, int end, const side_choice& sides) const;
    // Those of the cells that have a chosen side in a direction.
    [[nodiscard]] static bit_rows side_rows(const rows_around& rows, unsigned direction);
    // Adds the nodes of the chosen sides in some directions, bit d for direction d.
    void mark_nodes(const place& p, const side_choice& sides, unsigned directions, bit_rows& marked) const;
    [[nodiscard]] std::vector<std::uint64_t> marked_nodes(std::size_t part, const bit_rows& marked) const;

    const voxel_shape& shape_;
    brick_order order_;
    std::size_t words_;        // of a row of nodes, and so of voxels
    int rows_of_part_ = 8;     // a multiple of 8
    int first_row_ = 0;        // of any part
    std::size_t in_plane_ = 1; // parts of a plane
    std::vector<int> planes_;  // that have nodes, ascending
    std::vector<std::uint64_t> first_node_, first_cell_;
};

template <class Visit>
void hexahedra::for_each_node(std::size_t part, const Visit& visit) const {
    if (nodes_of(part) == 0) return;
    const place p = place_of(part);
    const bit_rows nodes = node_rows(p.plane, p.row, p.end_node_row);
    for (int y = p.row; y < p.end_node_row; ++y)
        for (std::size_t w = 0; w < words_; ++w)
            for (std::uint64_t bits = nodes.row(static_cast<std::size_t>(y - p.row))[w]; bits != 0; bits &= bits - 1)
                visit(64 * w + static_cast<std::size_t>(std::countr_zero(bits)), static_cast<std::size_t>(y),
                      static_cast<std::size_t>(p.plane));
}

template <class Visit>
void hexahedra::for_each_cell(std::size_t part, const Visit& visit) const {
    if (cells_of(part) == 0) return;
    const place p = place_of(part);
    const bit_rows voxels = voxel_rows(p.plane, p.row - 1, p.end_row + 1);
    // Rows of nodes on both sides of the plane. The one after the last belongs to the next part, whose numbers follow.
    const std::array<bit_rows, 2> nodes{node_rows(voxel_rows(p.plane - 1, p.row - 1, p.end_row + 1), voxels),
                                        node_rows(voxels, voxel_rows(p.plane + 1, p.row - 1, p.end_row + 1))};
    const std::array<std::vector<std::uint64_t>, 2> first{ranks(nodes[0], first_node_[part]),
                                                          ranks(nodes[1], first_node_[part + in_plane_])};
    std::uint64_t number = first_cell_[part];
    for (std::size_t y = 0; y < static_cast<std::size_t>(p.end_row - p.row); ++y)
        for (std::size_t w = 0; w < words_; ++w) {
            std::uint64_t bits = voxels.row(y + 1)[w];
            while (bits != 0) { // voxels in a row have nodes in a row
                const int begin = std::countr_zero(bits);
                const int count = std::countr_one(bits >> begin);
                const std::uint64_t before = (std::uint64_t{1} << begin) - 1;
                std::array<std::uint64_t, 4> n{};
                for (std::size_t corner = 0; corner < 4; ++corner) {
                    const std::size_t at = (y + corner % 2) * words_ + w;
                    n[corner] = first[corner / 2][at] +
                                static_cast<std::uint64_t>(std::popcount(nodes[corner / 2].data[at] & before));
                }
                for (int i = 0; i < count; ++i) {
                    visit(number++,
                          std::array<std::uint64_t, 8>{n[0], n[0] + 1, n[1] + 1, n[1], n[2], n[2] + 1, n[3] + 1, n[3]});
                    for (std::uint64_t& each : n) ++each;
                }
                const int end = begin + count;
                bits = end == 64 ? 0 : bits >> end << end;
            }
        }
}

template <class Visit>
void hexahedra::for_each_voxel_of_rows(int plane, int row, int end, const Visit& visit) const {
    if (plane < 0 || plane >= shape_.extent[2]) return;
    const auto layer = order_.layer_at(plane / 8);
    const auto n = static_cast<unsigned>(plane % 8);
    for (int r = std::max(row, 0) / 8; 8 * r < end; ++r) {
        const auto bricks = brick_order::row_of(layer, r);
        for (int y = std::max(8 * r, row); y < std::min(8 * r + 8, end); ++y) {
            const auto b = static_cast<unsigned>(y - 8 * r);
            for (const brick_order::placed& brick : bricks)
                for (unsigned bits = brick_row(shape_.mask(brick.brick), 2, n, b); bits != 0; bits &= bits - 1)
                    visit(brick.brick, order_.voxel_at(brick, n, static_cast<unsigned>(std::countr_zero(bits)), b));
        }
    }
}

template <class Visit>
void hexahedra::for_each_voxel(std::size_t part, const Visit& visit) const {
    if (cells_of(part) == 0) return;
    const place p = place_of(part);
    std::uint64_t number = first_cell_[part];
    for_each_voxel_of_rows(p.plane, p.row, p.end_row,
                           [&](std::size_t brick, const glm::ivec3& voxel) { visit(number++, brick, voxel); });
}

} // namespace voxelize
