// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Which sides of voxels share a vertex at a corner of the lattice, so that the mesh of the sides is a closed manifold.
//
// A corner has eight voxels around it. Sides that meet in it hang together across the lattice edges that leave it; a
// *sheet* is a cycle of such sides, and each sheet has a vertex of its own. Where an edge has four sides, because two
// of its voxels are occupied that touch in the edge alone, the sides of one voxel hang together, and the two voxels
// come apart. If both pairs then were in one sheet at either end of the edge, two edges of the mesh would have the same
// vertices: there the sides around an empty voxel hang together instead, and the two voxels are joined along the edge.
// docs/tool.md says so to users; the proof is that of dual marching cubes with faces flipped: of the 256 corners 36
// have an edge with both pairs in one sheet, each of them one such edge, so that the changes do not meet.

#include <array>
#include <cstddef>
#include <cstdint>

namespace voxelize {

// The sheets of all corners, as seen along an axis. A mask has a bit for each voxel: a + 2 n + 4 b for the one at
// (a, n, b), each 0 or 1, along axis + 1, axis and axis + 2.
class voxel_sheets {
public:
    // Table for axis 0, 1 or 2.
    [[nodiscard]] static const voxel_sheets& along(int axis);

    // True if the corner has more than one sheet, or an edge that may have to change.
    [[nodiscard]] bool is_special(unsigned mask) const { return special_[mask]; }
    // The edge that changes if the corner at its other end names it too: 2 * d + s leaves the corner towards lower (s =
    // 0) or higher (1) places along axis + 1, axis or axis + 2 (d = 0, 1, 2); 6: none.
    static constexpr unsigned no_edge = 6;
    [[nodiscard]] unsigned edge_to_change(unsigned mask) const { return edge_[mask]; }
    // The sheet, from 1, of the side across `axis` between the voxels (a, 0, b) and (a, 1, b) of the corner; 0 where
    // the corner has one sheet only. The numbers are the same along every axis.
    [[nodiscard]] unsigned sheet(unsigned mask, bool changes, unsigned a, unsigned b) const {
        return sheets_[changes ? 1 : 0][mask] >> 4 * (a + 2 * b) & 0xfU;
    }

private:
    explicit voxel_sheets(std::size_t axis);

    std::array<bool, 256> special_{};
    std::array<std::uint8_t, 256> edge_{};
    std::array<std::array<std::uint16_t, 256>, 2> sheets_{};
};

} // namespace voxelize
