# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Colours of a model as voxels: a globe with continents of noise. Code of tutorials/colours.md."""

# snippet: globe
import numpy as np
import voxelpipe as vp

turns, latitudes = np.linspace(0, 2 * np.pi, 361), np.linspace(-np.pi / 2, np.pi / 2, 181)
turn, latitude = np.meshgrid(turns, latitudes)
across = np.cos(latitude)
direction = np.stack([across * np.cos(turn), np.sin(latitude), across * np.sin(turn)], axis=-1)

rng = np.random.default_rng(7)
height = np.zeros(latitude.shape)
for scale in (1.5, 3, 6, 12):  # waves in random directions, the finer ones lower
    for wave, phase in zip(rng.normal(size=(12, 3)) * scale, rng.uniform(0, 6.28, 12)):
        height += np.sin(direction @ wave + phase) / scale
land, snow = height > 1.2, (height > 4) | (np.abs(latitude) > 1.25)
sea, grass, white = [38, 84, 150], [88, 138, 72], [235, 240, 245]
rgb = np.select([snow[..., None], land[..., None]], [white, grass], sea).astype(np.uint8)

vertices = (direction * (1 + 0.03 * np.maximum(height - 1.2, 0))[..., None]).reshape(-1, 3)
here = np.arange(height.size).reshape(height.shape)
a, b, c, d = here[:-1, :-1], here[:-1, 1:], here[1:, 1:], here[1:, :-1]
halves = (a, c, b), (a, d, c)
triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in halves])
mesh = (vertices, triangles)
# end snippet

# snippet: bake
grid = vp.fit(mesh, 192)
color = vp.bake(mesh, grid, {"rgb": rgb.reshape(-1, 3)})["rgb"]  # each voxel's mean
surface = vp.voxelize(mesh, grid)
vp.save("globe.png", color, grid, occupied=surface)
vp.save("globe.html", color, grid, occupied=surface)  # a page for any browser
# end snippet

# snippet: sparse
voxels, values = vp.sparse(mesh, grid, {"rgb": rgb.reshape(-1, 3)})
assert np.array_equal(color[grid.zyx(voxels)], values["rgb"])  # lists have columns x, y, z
listed = voxels.nbytes + values["rgb"].nbytes
print(f"{len(voxels)} voxels in {listed} bytes, dense {color.nbytes}")
# end snippet

assert round(color.nbytes / listed) == 8 and round(len(voxels), -3) == 165000  # as colours.md says
blue = (values["rgb"][:, 2] > values["rgb"][:, 1].astype(int) + 20).mean()
assert 0.2 < blue < 0.9, blue
