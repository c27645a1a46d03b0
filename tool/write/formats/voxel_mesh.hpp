// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The surface of the occupied voxels as rectangles: one for each side of a voxel that has no occupied neighbour there
// (voxels at the grid's border have none outside). Shared by the writers of .ply, .obj, .glb, .stl and .3mf.

#include "voxel_shape.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace voxelize {

// A rectangle of voxel sides in one plane of the lattice, all of one colour. Corner `low` is a lattice corner:
// world position origin + low * voxel_size. The rectangle spans size[0] voxels along axis (direction / 2 + 1) % 3 and
// size[1] along axis (direction / 2 + 2) % 3.
struct voxel_face {
    std::array<std::uint32_t, 3> low{};
    std::array<std::uint32_t, 2> size{1, 1};
    std::uint32_t rgb = 0;      // sRGB, red in the low byte
    std::uint8_t direction = 0; // outward normal: 0 -x, 1 +x, 2 -y, 3 +y, 4 -z, 5 +z
    // Four bits for each corner of corners_of(): the number of the sheet of this face there (voxel_sheets.hpp), or 0
    // where the corner has one sheet, or the face is of several sides.
    std::uint16_t sheets = 0;

    [[nodiscard]] unsigned sheet(std::size_t corner) const { return sheets >> 4 * corner & 0xfU; }
    friend bool operator==(const voxel_face&, const voxel_face&) = default;
};

// The corners of the lattice that a face has, counter-clockwise seen from outside, from `low` on.
[[nodiscard]] std::array<std::array<std::uint32_t, 3>, 4> corners_of(const voxel_face& face);

// All faces, by axis, then layer along it, then direction, then position; the same list for any number of threads. With
// `merge`, sides of equal colour in one plane are joined greedily: each rectangle first grows along its first axis,
// then along its second. `progress` gets 0..1 from the calling thread; it may be empty. Without
// `colors` all faces are of colour 0.
[[nodiscard]] std::vector<voxel_face> voxel_faces(const voxel_shape& shape, bool merge, int threads,
                                                  const std::function<void(double)>& progress, bool colors = true);

// Faces as an indexed mesh in which the faces of a sheet share the vertex of a corner, if they are of one colour. Apart
// from that split by colours the mesh of all single sides of voxels is a closed manifold: each edge has two faces,
// which go around it in opposite directions, and the faces of each vertex are a cycle.
struct welded_mesh {
    struct vertex {
        std::array<std::uint32_t, 3> corner; // lattice corner
        std::uint32_t rgb_and_sheet;         // sRGB, red in the low byte, and the sheet in the highest byte
    };
    std::vector<vertex> vertices;                    // by z, then in order of use
    std::vector<std::array<std::uint32_t, 4>> quads; // vertex numbers, counter-clockwise seen from outside; in the
                                                     // order of the faces
};

// Places of a plane of corners up to which weld() has a table of them for each thread.
[[nodiscard]] constexpr std::size_t most_places(std::size_t faces) { return std::max(std::size_t{1} << 20, 4 * faces); }

// At most 2^30 faces, so that vertex numbers fit into 32 bits. `extent` is the volume's. Without `splits_colors` faces
// of several colours share their vertices, which then have no colour.
[[nodiscard]] welded_mesh weld(std::span<const voxel_face> faces, const std::array<std::int64_t, 3>& extent,
                               int threads, bool splits_colors = true);

} // namespace voxelize
