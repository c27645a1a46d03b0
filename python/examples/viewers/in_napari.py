# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""napari opens a .zarr with levels: it reads the level that the screen needs, and of that the chunks. Code of docs/tool.md.

Where there is no display: QT_QPA_PLATFORM=offscreen.
"""

import pathlib
import sys
import tempfile

import dask.array as da
import napari
import numpy as np
import voxelpipe as vp
import zarr

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())


def ball(centre, radius, rings=40):
    """A sphere of quads, cut into triangles."""
    polar, around = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    points = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    here = np.arange(points.size // 3).reshape(rings + 1, 2 * rings)
    right = np.roll(here, -1, axis=1)
    halves = (here[:-1], here[1:], right[1:]), (here[:-1], right[1:], right[:-1])
    return np.array(centre) + radius * points.reshape(-1, 3), np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in halves])


balls = [ball((0, 0, 0), 1.0), ball((1.5, 0.4, 0), 0.7), ball((-1.2, -0.5, 0.3), 0.5)]
grid = vp.Grid(origin=(-1.8, -1.1, -1.1), voxel_size=(0.02, 0.02, 0.04), shape=(55, 120, 205))  # layers twice as thick
material = np.zeros(grid.shape, np.int32)
for number, body in enumerate(balls, 1):
    material[vp.solid(body, grid, extent="centre")] = number
vp.save(folder / "balls.zarr", {"material": material}, grid, levels=True)

# snippet: napari
group = zarr.open_group(folder / "balls.zarr", mode="r")["material"]
scales = group.attrs["ome"]["multiscales"][0]["datasets"]  # OME-Zarr: a level each
levels = [da.from_zarr(group[level["path"]]) for level in scales]
scale, corner = (next(t[t["type"]] for t in scales[0]["coordinateTransformations"] if t["type"] == kind)
                 for kind in ("scale", "translation"))
viewer = napari.Viewer(ndisplay=3, show=False)
viewer.add_labels(levels, multiscale=True, scale=scale, translate=corner, name="material")
# end snippet

layer = viewer.layers["material"]
assert len(levels) > 1 and levels[0].shape == grid.shape
assert np.allclose(layer.scale[-3:], grid.voxel_size[::-1])
# A place has the number of its body, in the model's coordinates (z, y, x); 0 is outside.
viewer.dims.ndisplay = 2
for (x, y, z), number in {(0, 0, 0): 1, (1.9, 0.5, 0): 2, (-1.5, -0.6, 0.3): 3, (1.2, -0.9, 0.9): 0}.items():
    level, value = layer.get_value((z, y, x), world=True)
    assert value == number, (x, y, z, level, value)
print(f"napari {napari.__version__}: {len(levels)} levels of {grid.shape}, four places looked up")
