# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The volume, mass and centre of mass of a part: a washer, whose exact values are known. Code of tutorials/volume.md."""

# snippet: part
import numpy as np
import voxelpipe as vp


def washer(outer=20.0, inner=9.0, height=5.0, sides=720):
    """A ring, in millimetres: four circles of vertices, joined by rectangles."""
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    section = [(outer, 0), (outer, height), (inner, height), (inner, 0)]
    x, z = np.cos(angle), np.sin(angle)
    vertices = np.concatenate([np.stack([r * x, 0 * x + y, r * z], axis=1) for r, y in section])
    here = np.arange(4 * sides).reshape(4, sides)
    up, right = np.roll(here, -1, axis=0), np.roll(here, -1, axis=1)
    across = np.roll(up, -1, axis=1)
    halves = (here, up, across), (here, across, right)
    return vertices, np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in halves])


mesh = washer()  # or a path: mesh = "washer.stl"
# end snippet

# snippet: volume
grid = vp.fit(mesh, 256)
inside = vp.solid(mesh, grid, extent="centre")
volume = inside.sum() * np.prod(grid.voxel_size)
print(f"volume {volume:.1f} mm³, mass in steel {volume * 7.85e-3:.2f} g")
# end snippet

# snippet: centre
z, y, x = np.nonzero(inside)  # arrays are indexed [z, y, x]
voxels = np.stack([x, y, z], axis=1)
points = np.array(grid.origin) + (voxels + 0.5) * np.array(grid.voxel_size)
print("centre of mass", points.mean(axis=0).round(3))
# end snippet

# snippet: refine
exact = np.pi * (20**2 - 9**2) * 5
errors = []
for resolution in (64, 128, 256, 512):
    fine = vp.fit(mesh, resolution)
    found = vp.solid(mesh, fine, extent="centre").sum() * np.prod(fine.voxel_size)
    errors.append(f"{100 * (found / exact - 1):+.3f}")
    print(f"{resolution:4} voxels: {errors[-1]} %")
# end snippet

assert f"{volume:.1f}" == "5009.4" and errors == ["+0.624", "+0.273", "-0.030", "+0.034"], errors  # as volume.md says
assert np.abs(points.mean(axis=0) - [0, 2.5, 0]).max() < 0.02
vp.save("part.png", inside, grid)
