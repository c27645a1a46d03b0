// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "hexahedra.hpp"

#include "model/parallel.hpp"

#include <algorithm>

namespace voxelize {
namespace {

// Corners of a part where every voxel is there, and the most parts, whose first numbers are kept.
constexpr std::size_t least_part_nodes = std::size_t{1} << 12, most_mesh_parts = std::size_t{1} << 22;

// to |= from, and the same one further along x.
void add_both_ends(const std::uint64_t* from, std::uint64_t* to, std::size_t words) {
    std::uint64_t carry = 0;
    for (std::size_t w = 0; w < words; ++w) {
        to[w] |= from[w] | from[w] << 1U | carry;
        carry = from[w] >> 63U;
    }
}

std::uint64_t bits_in(const bit_rows& rows, std::size_t first, std::size_t end) {
    std::uint64_t sum = 0;
    for (std::size_t n = first * rows.words; n < end * rows.words; ++n)
        sum += static_cast<std::uint64_t>(std::popcount(rows.data[n]));
    return sum;
}

} // namespace

hexahedra::hexahedra(const voxel_shape& shape, int threads)
    : shape_(shape), order_(shape, 2), words_(static_cast<std::size_t>(shape.extent[0]) / 64 + 1) {
    int low = static_cast<int>(shape.extent[1]), high = 0;
    for (std::size_t layer = 0; layer < order_.num_layers(); ++layer) {
        const auto bricks = order_.layer(layer);
        for (const brick_order::placed& brick : bricks) {
            low = std::min(low, 8 * brick.row());
            high = std::max(high, std::min(8 * brick.row() + 8, static_cast<int>(shape.extent[1])));
        }
        if (bricks.empty()) continue;
        const int first = 8 * bricks.front().at();
        for (int z = first; z <= std::min<std::int64_t>(first + 8, shape.extent[2]); ++z)
            if (planes_.empty() || planes_.back() < z) planes_.push_back(z);
    }
    first_row_ = low;
    const int rows = std::max(high - low, 1);
    const auto parts = [&] { return static_cast<std::size_t>((rows + rows_of_part_ - 1) / rows_of_part_); };
    while (rows_of_part_ < rows && (static_cast<std::size_t>(2 * rows_of_part_) * 64 * words_ <= least_part_nodes ||
                                    parts() * planes_.size() > most_mesh_parts))
        rows_of_part_ *= 2;
    in_plane_ = parts();
    const std::size_t count = planes_.size() * in_plane_;
    first_node_.resize(count + 1);
    first_cell_.resize(count + 1);
    parallel_for(count, thread_count(threads), [&](std::size_t part) {
        const place p = place_of(part);
        const bit_rows voxels = voxel_rows(p.plane, p.row, p.end_row);
        const bit_rows nodes = node_rows(p.plane, p.row, p.end_node_row);
        first_cell_[part + 1] = bits_in(voxels, 0, static_cast<std::size_t>(p.end_row - p.row));
        first_node_[part + 1] = bits_in(nodes, 0, static_cast<std::size_t>(p.end_node_row - p.row));
    });
    for (std::size_t part = 0; part < count; ++part) {
        first_node_[part + 1] += first_node_[part];
        first_cell_[part + 1] += first_cell_[part];
    }
}

hexahedra::place hexahedra::place_of(std::size_t part) const {
    place p{};
    p.plane = planes_[part / in_plane_];
    const std::size_t n = part % in_plane_;
    p.row = first_row_ + static_cast<int>(n) * rows_of_part_;
    p.end_row = std::min(p.row + rows_of_part_, static_cast<int>(shape_.extent[1]));
    p.end_node_row = n + 1 == in_plane_ ? p.end_row + 1 : p.end_row;
    return p;
}

bit_rows hexahedra::voxel_rows(int plane, int row, int end) const {
    bit_rows rows(static_cast<std::size_t>(end - row), words_);
    if (plane < 0 || plane >= shape_.extent[2]) return rows;
    const auto layer = order_.layer_at(plane / 8);
    const auto n = static_cast<unsigned>(plane % 8);
    for (int r = std::max(row, 0) / 8; 8 * r < end; ++r)
        for (const brick_order::placed& brick : brick_order::row_of(layer, r)) {
            const auto column = static_cast<std::size_t>(brick.column());
            for (int y = std::max(8 * r, row); y < std::min(8 * r + 8, end); ++y)
                rows.row(static_cast<std::size_t>(y - row))[column / 8] |=
                    std::uint64_t{brick_row(shape_.mask(brick.brick), 2, n, static_cast<unsigned>(y - 8 * r))}
                    << 8 * (column % 8);
        }
    return rows;
}

bit_rows hexahedra::node_rows(int plane, int row, int end) const {
    return node_rows(voxel_rows(plane - 1, row - 1, end), voxel_rows(plane, row - 1, end));
}

bit_rows hexahedra::node_rows(const bit_rows& below, const bit_rows& above) {
    bit_rows nodes(below.data.size() / below.words - 1, below.words);
    for (std::size_t y = 0; y < nodes.data.size() / nodes.words; ++y)
        for (const std::size_t of : {y, y + 1}) {
            add_both_ends(below.row(of), nodes.row(y), nodes.words);
            add_both_ends(above.row(of), nodes.row(y), nodes.words);
        }
    return nodes;
}

hexahedra::rows_around hexahedra::around(int plane, int row, int end, const side_choice& sides) const {
    const auto chosen = [&](const cell_choice& cells, int at, int first, int last) {
        return cells ? cells(at, first, last) : voxel_rows(at, first, last);
    };
    const auto beside = [&](int at) { return chosen(sides.beside, at, row - 1, end + 1); };
    return {chosen(sides.of, plane, row, end),
            {beside(plane - 1), beside(plane), beside(plane + 1)},
            sides.beside == nullptr};
}

bit_rows hexahedra::side_rows(const rows_around& rows, unsigned direction) {
    const unsigned axis = direction / 2;
    const bool is_upper = direction % 2 != 0;
    const bit_rows& beside = rows.beside[axis == 2 ? 2 * (direction % 2) : 1];
    bit_rows sides = rows.of;
    for (std::size_t y = 0; y < sides.data.size() / sides.words; ++y) {
        const std::uint64_t* const from = beside.row(axis != 1 ? y + 1 : is_upper ? y + 2 : y);
        for (std::size_t w = 0; w < sides.words; ++w) {
            std::uint64_t neighbours = from[w];
            if (axis == 0 && !is_upper) neighbours = from[w] << 1U | (w == 0 ? 0 : from[w - 1] >> 63U);
            if (axis == 0 && is_upper) neighbours = from[w] >> 1U | (w + 1 == sides.words ? 0 : from[w + 1] << 63U);
            sides.row(y)[w] &= rows.is_outer ? ~neighbours : neighbours;
        }
    }
    return sides;
}

std::vector<std::uint64_t> hexahedra::ranks(const bit_rows& rows, std::uint64_t first) {
    std::vector<std::uint64_t> result(rows.data.size());
    for (std::size_t n = 0; n < result.size(); ++n) {
        result[n] = first;
        first += static_cast<std::uint64_t>(std::popcount(rows.data[n]));
    }
    return result;
}

std::vector<std::uint64_t> hexahedra::cells_at_side(std::size_t part, unsigned direction) const {
    std::vector<std::uint64_t> numbers;
    if (cells_of(part) == 0) return numbers;
    const place p = place_of(part);
    const bit_rows sides = side_rows(around(p.plane, p.row, p.end_row, {}), direction);
    const bit_rows voxels = voxel_rows(p.plane, p.row, p.end_row);
    std::uint64_t number = first_cell_[part];
    for (std::size_t n = 0; n < voxels.data.size(); ++n)
        for (std::uint64_t bits = voxels.data[n]; bits != 0; bits &= bits - 1, ++number)
            if ((sides.data[n] & bits & (~bits + 1)) != 0) numbers.push_back(number);
    return numbers;
}

std::vector<std::uint8_t> hexahedra::sides_of_cells(std::size_t part, const side_choice& sides) const {
    std::vector<std::uint8_t> result(cells_of(part));
    if (result.empty()) return result;
    const place p = place_of(part);
    const rows_around rows = around(p.plane, p.row, p.end_row, sides);
    const bit_rows voxels = voxel_rows(p.plane, p.row, p.end_row);
    const std::vector<std::uint64_t> first = ranks(voxels, 0);
    for (unsigned direction = 0; direction < 6; ++direction) {
        const bit_rows chosen = side_rows(rows, direction);
        for (std::size_t n = 0; n < chosen.data.size(); ++n)
            for (std::uint64_t bits = chosen.data[n]; bits != 0; bits &= bits - 1) {
                const std::uint64_t before = voxels.data[n] & ((bits & (~bits + 1)) - 1);
                result[first[n] + static_cast<std::uint64_t>(std::popcount(before))] |=
                    static_cast<std::uint8_t>(1U << direction);
            }
    }
    return result;
}

void hexahedra::mark_nodes(const place& p, const side_choice& sides, unsigned directions, bit_rows& marked) const {
    // A node of a row has a voxel before it and one after it along each axis; along the sides' axis one of them counts.
    for (const int dz : {-1, 0}) {
        const rows_around rows = around(p.plane + dz, p.row - 1, p.end_node_row, sides);
        for (unsigned direction = 0; direction < 6; ++direction) {
            const unsigned axis = direction / 2;
            const bool is_upper = direction % 2 != 0;
            if ((directions >> direction & 1U) == 0 || (axis == 2 && is_upper != (dz == -1))) continue;
            const bit_rows chosen = side_rows(rows, direction);
            for (std::size_t y = 0; y < marked.data.size() / words_; ++y)
                for (const std::size_t dy : {std::size_t{0}, std::size_t{1}}) {
                    if (axis == 1 && is_upper != (dy == 0)) continue;
                    const std::uint64_t* const from = chosen.row(y + dy);
                    if (axis != 0) add_both_ends(from, marked.row(y), words_);
                    std::uint64_t carry = 0;
                    for (std::size_t w = 0; axis == 0 && w < words_; ++w) {
                        marked.row(y)[w] |= is_upper ? from[w] << 1U | carry : from[w];
                        carry = from[w] >> 63U;
                    }
                }
        }
    }
}

std::vector<std::uint64_t> hexahedra::marked_nodes(std::size_t part, const bit_rows& marked) const {
    const place p = place_of(part);
    const bit_rows nodes = node_rows(p.plane, p.row, p.end_node_row);
    std::vector<std::uint64_t> numbers;
    std::uint64_t number = first_node_[part];
    for (std::size_t n = 0; n < nodes.data.size(); ++n)
        for (std::uint64_t bits = nodes.data[n]; bits != 0; bits &= bits - 1, ++number)
            if ((marked.data[n] & bits & (~bits + 1)) != 0) numbers.push_back(number);
    return numbers;
}

std::vector<std::uint64_t> hexahedra::nodes_at_side(std::size_t part, unsigned direction) const {
    if (nodes_of(part) == 0) return {};
    const place p = place_of(part);
    bit_rows marked(static_cast<std::size_t>(p.end_node_row - p.row), words_);
    mark_nodes(p, {}, 1U << direction, marked);
    return marked_nodes(part, marked);
}

std::vector<std::uint64_t> hexahedra::nodes_of_sides(std::size_t part, const side_choice& sides) const {
    constexpr unsigned all_directions = 63;
    if (nodes_of(part) == 0) return {};
    const place p = place_of(part);
    bit_rows marked(static_cast<std::size_t>(p.end_node_row - p.row), words_);
    mark_nodes(p, sides, all_directions, marked);
    return marked_nodes(part, marked);
}

std::vector<std::uint64_t> hexahedra::nodes_of_cells(std::size_t part, const cell_choice& cells) const {
    if (nodes_of(part) == 0) return {};
    const place p = place_of(part);
    return marked_nodes(
        part, node_rows(cells(p.plane - 1, p.row - 1, p.end_node_row), cells(p.plane, p.row - 1, p.end_node_row)));
}

std::vector<std::size_t> hexahedra::parts_of_nodes(std::span<const std::size_t> parts) const {
    std::vector<bool> has_nodes(num_parts());
    for (const std::size_t part : parts)
        for (const std::size_t above : {part, part + in_plane_}) {
            has_nodes[above] = true;
            if (above % in_plane_ + 1 != in_plane_) has_nodes[above + 1] = true;
        }
    std::vector<std::size_t> result;
    result.reserve(static_cast<std::size_t>(std::count(has_nodes.begin(), has_nodes.end(), true)));
    for (std::size_t part = 0; part < has_nodes.size(); ++part)
        if (has_nodes[part]) result.push_back(part);
    return result;
}

} // namespace voxelize
