// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The voxels as geometry, in world units and on the world's axes (glTF's, for a glTF model; write_options::up changes
// nothing here). Without colours the files have none, .glb a material of clay.
//
//   .obj, .ply, .glb, .stl   the sides between occupied and empty voxels (voxel_mesh.hpp), corners shared by equal
//   colours.
//                      Quads in .obj and .ply, pairs of triangles in .glb and .stl. With merge_faces far fewer of them,
//                      whose edges no longer meet corner to corner.
//   .xyz, .ply with points   the centres of the occupied voxels, in storage order
//
// Coordinates are exact lattice positions: doubles in .ply, shortest decimals in .obj and .xyz. A .glb holds floats
// from the grid's low corner, and that corner as the translation of its node; a .stl floats and no colours. Colours are
// sRGB bytes in .ply and .xyz, sRGB fractions in .obj; linear 16-bit fractions in .glb, as glTF has it.
//
// Above 2^30 faces for .ply, .obj and .stl (32-bit vertex numbers) or 40 million for .glb (4 GiB a file) a mesh is
// split into OUT.1.glb, OUT.2.glb, ..., each whole in itself. Points of .ply are counted in 64 bits.

#include "formats.hpp"
#include "voxel_shape.hpp"

namespace voxelize {

std::vector<std::filesystem::path> write_ply(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);
std::vector<std::filesystem::path> write_obj(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);
std::vector<std::filesystem::path> write_glb(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);
// Without colours: merge_faces joins faces of all colours. Warns where floats are too coarse for the grid.
std::vector<std::filesystem::path> write_stl(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);
// The names of the files of the four functions above. A mesh is split only if the voxels of the grid can have more
// faces than a file holds.
[[nodiscard]] written_names mesh_names(const volume& shape, const std::filesystem::path& path,
                                       const write_options& options, held_as held);
std::vector<std::filesystem::path> write_xyz(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
