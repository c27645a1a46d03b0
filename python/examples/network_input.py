# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""A batch of meshes as the input of a network: dense channels, sparse coordinates. Code of tutorials/network.md."""

# snippet: shapes
import numpy as np
import voxelpipe as vp


def box(low, high):
    """A box as a mesh: float32 (8, 3) and (12, 3)."""
    ends = np.stack([low, high])
    corners = [ends[[i & 1, i >> 1 & 1, i >> 2], [0, 1, 2]] for i in range(8)]
    corners = np.array(corners, np.float32)
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    sides = np.array(sides)
    return corners, np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])


rng = np.random.default_rng(1)
shapes = [box(-rng.uniform(0.2, 1, 3), rng.uniform(0.2, 1, 3)) for _ in range(8)]
# end snippet

# snippet: grid
N = 32
grid = vp.Grid(origin=(-1, -1, -1), voxel_size=(2 / N,) * 3, shape=(N, N, N))
# end snippet

# snippet: dense
def channels(mesh):
    """float32 (3, N, N, N): inside or not, surface or not, and the distance in voxels."""
    inside = vp.solid(mesh, grid, extent="centre")
    surface = vp.voxelize(mesh, grid)
    distance = vp.distance(mesh, grid, band="whole") / grid.voxel_size[0]
    return np.stack([inside, surface, np.clip(distance, -4, 4)]).astype(np.float32)


batch = np.stack([channels(mesh) for mesh in shapes])
print(batch.shape, batch.dtype)  # torch.from_numpy(batch) takes it without a copy
# end snippet

# snippet: sparse
coordinates, features = [], []
for number, (vertices, triangles) in enumerate(shapes):
    voxels, values = vp.sparse((vertices, triangles), grid, {"position": vertices})
    coordinates.append(np.column_stack([np.full(len(voxels), number), voxels]))  # n, x, y, z
    features.append(values["position"])
coordinates = np.concatenate(coordinates).astype(np.int32)
features = np.concatenate(features)
print(coordinates.shape, features.shape)
# end snippet

assert batch.shape == (8, 3, N, N, N)
assert ((batch[:, 0] > 0) == (batch[:, 2] < 0)).mean() > 0.999
n, x, y, z = coordinates.T
assert (batch[n, 1, z, y, x] == 1).all() and len(n) == batch[:, 1].sum()
centres = np.array(grid.origin) + (coordinates[:, 1:] + 0.5) * grid.voxel_size[0]
assert np.abs(features - centres).max() < grid.voxel_size[0]
