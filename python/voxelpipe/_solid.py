# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from . import _core, _device
from ._core import Grid
from ._device import DeviceMesh
from ._mesh import MeshLike, as_mesh
from ._surface import take_counts


class OpenMeshWarning(UserWarning):
    """The mesh is not closed: part of what lies behind its holes is in doubt."""


def solid(
    mesh: MeshLike,
    grid: Grid,
    fill: str = "nonzero",
    *,
    extent: str = "outer",
    repair: str = "none",
    bodies: str = "all",
    max_hole_edges: int | None = None,
    closing: int = 0,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """The inside of closed meshes, exactly: bool, (nz, ny, nx).

    fill: what the winding number w of a point says. "nonzero": inside where w != 0, so overlapping parts stay solid and
        inverted shells are cavities. "even_odd": inside where w is odd. "positive": inside where w > 0.
    extent: "outer", the voxels whose centre is inside, and those that a triangle touches; "centre", the former alone;
        "inner", those whose centre is inside and that no triangle touches.
    repair: "none"; "close_holes" puts a cone over each hole's boundary; "exterior" takes for inside what a flood from
        outside does not reach (fills cavities, no crops); "vote" takes the majority of rows along x, y and z. The last
        two know no fill and no extent.
    bodies: "all", the meshes of a list together; "each", every mesh of a list by itself.
    max_hole_edges: for close_holes, holes with more edges stay open.
    closing: for exterior, gaps of up to about twice as many voxels are closed, 0 to 64.
    status: a dict that is filled with the call's counters, among them open_rows, crossings and holes.

    Warns with OpenMeshWarning where rows of voxels prove that the mesh is not closed.
    """
    m = as_mesh(mesh)
    options = (fill, extent, repair, bodies, max_hole_edges, closing)
    if isinstance(m, DeviceMesh):
        result, counts = _device.solid(m, grid, options)
    else:
        positions, where = m.positions(grid)
        out = np.empty(grid.shape, np.uint8)
        counts = _core.solid_mask(
            positions, m.triangles, list(m.first_triangles), where, *options, out, threads
        )
        result = m.to_caller(out.view(np.bool_))
    take_counts(counts, status)
    if counts["open_rows"] and repair in ("none", "close_holes"):
        rows = grid.shape[0] * grid.shape[1]
        warnings.warn(
            f"the mesh is not closed: {counts['open_rows']} of {rows} rows of voxels do not balance, and what lies "
            'behind a hole is in doubt; repair="close_holes", "vote" or "exterior" helps',
            OpenMeshWarning,
            stacklevel=2,
        )
    return result
