// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The voxels as geometry, in world units and on the world's axes (glTF's, for a glTF model; write_options::up changes
// nothing here). Without colours the files have none, .glb a material of clay.
//
//   .glb, .obj, .ply, .stl, .3mf   the sides between occupied and empty voxels, as a closed manifold (voxel_mesh.hpp):
//                      quads in .obj and .ply, pairs of triangles in the others. In .obj and .glb, whose colours are
//                      those of vertices, a corner of faces of several colours has a vertex for each; in .ply and .3mf
//                      colours are those of faces. With merge_faces there are far fewer faces, whose edges no longer
//                      meet corner to corner.
//   .xyz, .ply with points   the centres of the occupied voxels, in storage order
//
// Coordinates are exact lattice positions: doubles in .ply, shortest decimals in .obj, .3mf and .xyz. A .glb holds
// floats from the grid's low corner, and that corner as the translation of its node; a .stl floats and no colours, and
// its vertices stand off by up to 2^-6 of a voxel where several sheets of the surface meet. The unit of a .3mf is the
// millimetre: that of the world. Colours are sRGB bytes in .ply, .3mf and .xyz, sRGB fractions in .obj; linear 16-bit
// fractions in .glb, as glTF has it.
//
// Above 2^30 faces for .ply, .obj and .stl (32-bit vertex numbers), 2^28 for .3mf or 40 million for .glb (4 GiB a file)
// a mesh is split into OUT.1.glb, OUT.2.glb, ..., which together are the surface. Points of .ply are counted in 64
// bits.

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
std::vector<std::filesystem::path> write_3mf(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);
// The names of the files of the five functions above. A mesh is split only if the voxels of the grid can have more
// faces than a file holds.
[[nodiscard]] written_names mesh_names(const volume& shape, const std::filesystem::path& path,
                                       const write_options& options, held_as held);
std::vector<std::filesystem::path> write_xyz(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options);

} // namespace voxelize
