# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""PyVista opens a .vti: the cells that are at least half inside, a cut through the fractions, a picture without a window. Code of docs/tool.md."""

import pathlib
import sys
import tempfile

import numpy as np
import pyvista as pv
import voxelpipe as vp

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
doughnut = pv.ParametricTorus(ringradius=1.0, crosssectionradius=0.4, u_res=97, v_res=49).triangulate().clean()
grid = vp.fit(doughnut, 56)
fractions = vp.fractions(doughnut, grid, of=("fraction",))
vp.save(folder / "doughnut.vti", fractions, grid)
vp.save(folder / "pieces.pvti", fractions, grid, pieces=3)

# snippet: pyvista
image = pv.read(folder / "doughnut.vti")  # cell data; a voxel is a cell, in the mesh's coordinates
body = image.threshold(0.5, scalars="fraction")  # the voxels that are at least half inside
behind = np.subtract(image.center, image.spacing)  # a voxel behind the cut
plotter = pv.Plotter(off_screen=True, window_size=(900, 600))
plotter.add_mesh(body.clip(normal="x", origin=behind), show_edges=True, color="tan")
plotter.add_mesh(image.slice(normal="x", origin=image.center), scalars="fraction", cmap="gray", lighting=False)
plotter.camera_position = "yz"
plotter.camera.azimuth, plotter.camera.elevation = 35, 25
plotter.screenshot(folder / "in_pyvista.png")
# end snippet

assert image.n_cells == np.prod(grid.shape)
assert np.allclose(image.spacing, grid.voxel_size) and np.allclose(image.origin, grid.origin)
assert np.array_equal(image["fraction"], fractions["fraction"].ravel())
assert body.n_cells == (fractions["fraction"] >= 0.5).sum() > 10_000
# The fractions are the volume of the mesh, which VTK adds up by itself.
volume = image["fraction"].sum(dtype=float) * np.prod(grid.voxel_size)
assert abs(volume - doughnut.volume) < 1e-3 * doughnut.volume, (volume, doughnut.volume)
print(f"in_pyvista.png: {body.n_cells} cells, volume {volume:.4f}, of the mesh {doughnut.volume:.4f}, PyVista {pv.__version__}")
