# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The example of the README: a pyramid's surface, inside and colours in ten lines."""

# snippet: ten_lines
import numpy as np
import voxelpipe as vp

vertices = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1], [0, 1, 0]], np.float32)
triangles = np.array([[3, 2, 4], [2, 1, 4], [1, 0, 4], [0, 3, 4], [0, 1, 2], [0, 2, 3]])
mesh = (vertices, triangles)  # or a mesh of trimesh, Open3D or PyVista, or a path
grid = vp.fit(mesh, 128)  # 128 voxels along the longest side
surface = vp.voxelize(mesh, grid)  # bool, (nz, ny, nx): every voxel that a triangle touches
inside = vp.solid(mesh, grid, extent="centre")  # the voxels whose centre is inside
color = vp.bake(mesh, grid, {"rgb": np.uint8(127 + 127 * vertices)})["rgb"]  # the mean colour of each voxel's triangles
print("volume", inside.sum() * np.prod(grid.voxel_size), "of", 4 / 3)
vp.save("pyramid.png", color, grid, occupied=surface)
# end snippet
