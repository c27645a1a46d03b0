# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""A scan with holes as a solid. Code of tutorials/scan.md."""

# snippet: scan
import warnings

import numpy as np
import voxelpipe as vp

turns = np.linspace(0, 2 * np.pi, 120, endpoint=False)
angle, height = np.meshgrid(turns, np.linspace(0.02, np.pi - 0.02, 60))
radius = np.sin(height) * (1 + 0.15 * np.cos(3 * angle) * np.sin(height) ** 2)
x, y, z = radius * np.cos(angle), 1.4 * np.cos(height), radius * np.sin(angle)
points = np.stack([x, y, z], axis=-1)
vertices = points.reshape(-1, 3)
here = np.arange(angle.size).reshape(angle.shape)
right = np.roll(here, -1, axis=1)
a, b, c, d = here[:-1], right[:-1], right[1:], here[1:]
halves = (a, b, c), (a, c, d)
triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in halves])

rng = np.random.default_rng(3)
for _ in range(25):  # what the scanner did not see; the two poles are open too
    middle = vertices[rng.integers(len(vertices))]
    near = np.linalg.norm(vertices[triangles].mean(axis=1) - middle, axis=1) < 0.06
    triangles = triangles[~near]
mesh = (vertices, triangles)
grid = vp.fit(mesh, 128)
# end snippet

# snippet: warning
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    leaking = vp.solid(mesh, grid, extent="centre")
print(caught[0].message)
# end snippet

# snippet: repairs
size = np.prod(grid.voxel_size)
outer = {"repair": "exterior", "closing": 4}
closed = vp.solid(mesh, grid, repair="close_holes", extent="centre")
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    found = {
        "none": leaking.sum() * size,
        "close_holes": closed.sum() * size,
        "vote": vp.solid(mesh, grid, repair="vote").sum() * size,
        "exterior, closing=4": vp.solid(mesh, grid, **outer).sum() * size,
    }
for name, volume in found.items():
    print(f"{name:20} {volume:.3f}")
# end snippet

# snippet: status
status = {}
inside = vp.solid(mesh, grid, repair="close_holes", extent="centre", status=status)
print({name: status[name] for name in ("holes", "open_rows")})
vp.save("scan.png", inside, grid)
# end snippet

assert len(caught) == 1 and issubclass(caught[0].category, vp.OpenMeshWarning)
assert status["holes"] > 2 and status["open_rows"] == 0
printed = [f"{volume:.3f}" for volume in found.values()]
assert printed == ["5.924", "5.902", "6.165", "6.169"], printed  # as scan.md says
repaired = [found[name] for name in ("close_holes", "vote", "exterior, closing=4")]
assert max(repaired) < 1.1 * min(repaired), found
