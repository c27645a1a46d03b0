// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// VTK's XML unstructured grid (.vtu) for ParaView, VTK and meshio: the occupied voxels as hexahedra (hexahedra.hpp),
// and every channel as cell data with the names and types that a .vti has. Positions are Float64, numbers Int32, or
// Int64 where there are too many. Arrays follow the XML as appended raw binary, in zlib blocks unless compression is 0.

#include "formats.hpp"
#include "voxel_shape.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_vtu(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
