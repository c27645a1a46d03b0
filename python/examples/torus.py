# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""A torus in colours, its volume, and a picture."""

# snippet: torus
import numpy as np
import voxelpipe as vp

u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 96, endpoint=False), np.linspace(0, 2 * np.pi, 48, endpoint=False))
ring = 1 + 0.4 * np.cos(v)
vertices = np.stack([ring * np.cos(u), 0.4 * np.sin(v), ring * np.sin(u)], axis=-1).reshape(-1, 3)
n = np.arange(u.size).reshape(u.shape)
right, up = np.roll(n, -1, axis=1), np.roll(n, -1, axis=0)
corner = np.roll(right, -1, axis=0)
triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((n, up, right), (right, up, corner))])
rgb = np.uint8(127 + 127 * np.stack([np.cos(u), np.cos(u - 2), np.cos(u + 2)], axis=-1).reshape(-1, 3))

mesh = (vertices, triangles)  # or a mesh of trimesh, Open3D or PyVista, or a path
grid = vp.fit(mesh, 128)  # 128 voxels along the longest side
surface = vp.voxelize(mesh, grid)  # bool, (nz, ny, nx): every voxel that a triangle touches
inside = vp.solid(mesh, grid, extent="centre")  # the voxels whose centre is inside
color = vp.bake(mesh, grid, {"rgb": rgb})["rgb"]  # the mean colour of each voxel's triangles
print("volume", inside.sum() * np.prod(grid.voxel_size), "of", 2 * np.pi**2 * 0.4**2)
vp.save("torus.png", color, grid, occupied=surface)
# end snippet
