// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Gmsh's mesh file (.msh), version 4.1, binary: the occupied voxels as hexahedra (hexahedra.hpp). Tags of nodes and
// elements are their numbers from 1.
//
// There is a volume for each number of a material, and for the voxels without, each a physical group of dimension 3
// with the name MATERIAL_n, NO_MATERIAL, or, without numbers of materials, VOXELS. The tag of volume and group is one
// above the material's number; that of NO_MATERIAL is one above the others. Hexahedra come by volume. All nodes are
// said to be of the first volume. Tags have 64 bits.
//
// The sides of cells where volumes end are quadrangles, each once: those that no other voxel covers are a surface and a
// physical group of dimension 2 for each volume, with its tag and its name after SIDES_; those between two volumes are
// one for each two, SIDES_MATERIAL_n_MATERIAL_m with n < m, with the next tags. Quadrangles go around counter-clockwise
// as seen from outside of their volume, or from that of the larger number. Their tags follow those of the hexahedra.
// Volumes name the surfaces that bound them, those that look into them with a minus.

#include "formats.hpp"
#include "voxel_shape.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_msh(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
