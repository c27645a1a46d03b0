// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "voxel_sheets.hpp"

#include <algorithm>
#include <numeric>

namespace voxelize {
namespace {

// Voxel (x, y, z) of a corner, each 0 or 1, is bit x + 2 y + 4 z of its mask. A side is the pair of voxels that it lies
// between: number 4 d + (place along the lower other axis) + 2 (place along the higher one), across axis d.
std::size_t side_across(std::size_t d, unsigned voxel) {
    const std::size_t lower = d == 0 ? 1 : 0, higher = d == 2 ? 1 : 2;
    return 4 * d + (voxel >> lower & 1U) + (voxel >> higher & 1U) * std::size_t{2};
}

// The sheets of a corner.
struct corner {
    std::array<unsigned, 12> sheet{}; // of each side, from 1 in the order of their lowest sides; 0: no side is there
    unsigned count = 0;
};

// The voxel at places p and q of the four around an edge, which leaves the corner along `axis` to its low (0) or high
// (1) end.
unsigned voxel_around(std::size_t axis, unsigned end, unsigned p, unsigned q) {
    return end << axis | p << (axis + 1) % 3 | q << (axis + 2) % 3;
}

bool is_set(unsigned mask, unsigned voxel) { return (mask >> voxel & 1U) != 0; }

// True if the edge has four sides.
bool is_ambiguous(unsigned mask, std::size_t axis, unsigned end) {
    const auto set = [&](unsigned p, unsigned q) { return is_set(mask, voxel_around(axis, end, p, q)); };
    return set(0, 0) == set(1, 1) && set(0, 1) == set(1, 0) && set(0, 0) != set(0, 1);
}

// The two sides at the edge of one of its voxels.
std::array<std::size_t, 2> sides_of(std::size_t axis, unsigned end, unsigned p, unsigned q) {
    const unsigned voxel = voxel_around(axis, end, p, q);
    return {side_across((axis + 1) % 3, voxel), side_across((axis + 2) % 3, voxel)};
}

// `changed`: 2 * axis + end of the edge whose sides hang together around its empty voxels; 6: none.
corner sheets_of(unsigned mask, unsigned changed) {
    std::array<std::size_t, 12> group{};
    std::iota(group.begin(), group.end(), std::size_t{0});
    const auto join = [&](std::size_t a, std::size_t b) {
        const std::size_t from = std::max(group[a], group[b]), to = std::min(group[a], group[b]);
        std::replace(group.begin(), group.end(), from, to);
    };
    std::array<bool, 12> is_there{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (unsigned voxel = 0; voxel < 8; ++voxel)
            if (is_set(mask, voxel) != is_set(mask, voxel ^ 1U << axis)) is_there[side_across(axis, voxel)] = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (unsigned end = 0; end < 2; ++end) {
            if (!is_ambiguous(mask, axis, end)) {
                std::size_t first = 12; // none or two of the edge's sides are there
                for (unsigned n = 0; n < 4; ++n)
                    for (const std::size_t side : sides_of(axis, end, n & 1U, n >> 1U)) {
                        if (!is_there[side]) continue;
                        if (first == 12) first = side;
                        join(first, side);
                    }
                continue;
            }
            for (unsigned n = 0; n < 4; ++n) {
                const bool is_full = is_set(mask, voxel_around(axis, end, n & 1U, n >> 1U));
                if (is_full == (changed == 2 * axis + end)) continue;
                const auto [a, b] = sides_of(axis, end, n & 1U, n >> 1U);
                join(a, b);
            }
        }
    corner result;
    for (std::size_t side = 0; side < 12; ++side) {
        if (!is_there[side]) continue;
        if (group[side] == side)
            result.sheet[side] = ++result.count;
        else
            result.sheet[side] = result.sheet[group[side]];
    }
    return result;
}

// The edge with four sides in one sheet, which no corner has twice; 6: none.
unsigned edge_in_one_sheet(unsigned mask, const corner& c) {
    for (unsigned edge = 0; edge < 6; ++edge) {
        const std::size_t axis = edge / 2;
        if (!is_ambiguous(mask, axis, edge % 2)) continue;
        const auto [a, b] = sides_of(axis, edge % 2, 0, 0);
        const auto [e, f] = sides_of(axis, edge % 2, 1, 1);
        if (c.sheet[a] == c.sheet[e] && c.sheet[a] == c.sheet[b] && c.sheet[a] == c.sheet[f]) return edge;
    }
    return voxel_sheets::no_edge;
}

} // namespace

voxel_sheets::voxel_sheets(std::size_t axis) {
    const std::array<std::size_t, 3> axes{(axis + 1) % 3, axis, (axis + 2) % 3}; // of a mask's bits, in their order
    const auto in_order = [&](unsigned local) {
        return (local & 1U) << axes[0] | (local >> 1U & 1U) << axes[1] | (local >> 2U & 1U) << axes[2];
    };
    for (unsigned local = 0; local < 256; ++local) {
        unsigned mask = 0;
        for (unsigned voxel = 0; voxel < 8; ++voxel)
            if (is_set(local, voxel)) mask |= 1U << in_order(voxel);
        const corner plain = sheets_of(mask, no_edge);
        const unsigned edge = edge_in_one_sheet(mask, plain);
        for (std::size_t changes = 0; changes < 2; ++changes) {
            const corner c = changes == 1 && edge != no_edge ? sheets_of(mask, edge) : plain;
            if (c.count < 2) continue;
            for (unsigned place = 0; place < 4; ++place) { // a + 2 b
                const std::size_t side = side_across(axis, in_order((place & 1U) | (place >> 1U) << 2U));
                sheets_[changes][local] =
                    static_cast<std::uint16_t>(sheets_[changes][local] | c.sheet[side] << 4 * place);
            }
        }
        special_[local] = plain.count > 1 || edge != no_edge;
        edge_[local] = no_edge;
        for (unsigned d = 0; d < 3; ++d)
            if (edge != no_edge && axes[d] == edge / 2) edge_[local] = static_cast<std::uint8_t>(2 * d + edge % 2);
    }
}

const voxel_sheets& voxel_sheets::along(int axis) {
    static const std::array<voxel_sheets, 3> all{voxel_sheets(0), voxel_sheets(1), voxel_sheets(2)};
    return all[static_cast<std::size_t>(axis)];
}

} // namespace voxelize
