// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The meshes of --remesh as files, in world units and on the world's axes: one object, indexed, closed.
//
// Coordinates are doubles in .ply and .npz, shortest decimals of these in .obj and .3mf. A .glb and a .stl hold floats.
// The place of a vertex in its cell is first rounded to 16 bits, or to fewer where vertices of different cells stay
// apart as floats from the grid's low corner: that corner is the translation of a .glb's node. A .stl has no
// translation: a warning where its floats merge vertices. It has no indices either, and readers join its vertices by
// position: where vertices of one cell coincide, each moves by 2^-6 towards the mean of its faces' vertices.
//
// Vertices have normals (not in .stl and .3mf), and colours where the mesh has any (not in .stl): linear in .glb, sRGB
// bytes elsewhere, fractions of 255 in .obj. A .3mf has a colour of the colour group at each corner of a triangle.
//
// .npz has the arrays vertices (n, 3), triangles (m, 3) or quads (m, 4), cell (n, 3), sheet (n) and source (n), which
// is -1 where no triangle of the model made the vertex; normal (n, 3), float32, and color (n, 3), uint8.

#include "formats/formats.hpp"
#include "model/surface_mesh.hpp"

#include <filesystem>
#include <vector>

namespace voxelize {

// True for a path whose extension is one of these.
[[nodiscard]] bool writes_surface(const std::filesystem::path& path);

// Writes the file and returns its path. Throws write_error where the disk refuses or the format cannot hold so much; no
// file is left behind then.
std::vector<std::filesystem::path> write_surface(const surface_mesh& mesh, const std::filesystem::path& path,
                                                 const write_options& options);

} // namespace voxelize
