// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Abaqus' input file (.inp), which CalculiX and others read: the occupied voxels as elements C3D8 (hexahedra.hpp),
// numbered from 1, as text. Coordinates are decimals that read back to the same doubles, or, where these have more than
// the 20 characters that Abaqus reads, 13 digits.
//
// Sets: NODES and VOXELS have everything. For the sides that no other voxel covers, NODES_X_NEGATIVE to
// NODES_Z_POSITIVE are node sets and SIDES_X_NEGATIVE to SIDES_Z_POSITIVE surfaces, by the direction in which they
// face.
//
// Where there are numbers of materials, MATERIAL_n is both the set of the elements of each and that of their nodes, and
// NO_MATERIAL those of elements without. Of its elements' sides the surface SIDES_MATERIAL_n has those without a
// neighbour, and SIDES_MATERIAL_n_MATERIAL_m those at elements of another material: a side is in one of these surfaces
// and, seen from the other material's elements, in SIDES_MATERIAL_m_MATERIAL_n. NODES_ in place of SIDES_ are their
// nodes, once for two materials, the lower number first. No set is empty.

#include "formats.hpp"
#include "voxel_shape.hpp"

namespace voxelize {

// Throws write_error above 999,999,999 nodes or elements, which is the highest number that Abaqus takes.
std::vector<std::filesystem::path> write_inp(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
