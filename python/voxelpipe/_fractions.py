# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from . import _core
from ._core import Grid
from ._distance import _host_mesh
from ._solid import OpenMeshWarning
from ._surface import take_counts
from ._types import Bodies, MeshLike, check_call, check_choice


def fractions(
    mesh: MeshLike,
    grid: Grid,
    *,
    bodies: Bodies = "all",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """How much of every voxel is inside: float32, (nz, ny, nx), the mean of the winding number over the voxel.

    For a closed mesh whose triangles face outward and whose parts do not overlap this is the volume inside, 0 to 1. Parts
    that overlap add up, and parts that are inside out count negative: the values are neither clamped nor snapped. A voxel
    that no triangle touches has its whole number exactly; a cut one is off by 2.9 * 2^-44 at most for each triangle in it,
    before it is rounded to float32.

    Args:
        mesh, grid: as in voxelize(). The meshes of a list, and the parts of a model, are bodies.
        bodies: "all", the sum over all bodies; "each", an array (n, nz, ny, nx) with the fractions of every body by itself,
            for materials that share a voxel.
        threads: 0 takes all cores. The result is the same for any number.
        status: a dict that is filled with the call's counters, with "each" their sums over the bodies: cut_voxels that a
            triangle's inside reaches; below_zero and above_one, voxels that are below 0 or above 1 by more than 2^-24;
            open_rows, rows of voxels along x whose triangles do not balance; open_edges without an opposite edge.

    Returns the fractions; a mesh of torch's tensors gives tensors. Warns with OpenMeshWarning where rows prove that the mesh
    is not closed. Raises IndexError for a triangle that names a vertex that does not exist, TypeError for a mesh in a GPU's
    memory.

    Example:
        >>> part = vp.fractions(mesh, grid)
        >>> volume = part.sum(dtype=np.float64) * np.prod(grid.voxel_size)
    """
    check_call("fractions", grid, "conservative", threads, status)
    check_choice("bodies", bodies, Bodies)
    m = _host_mesh(mesh, "fractions")
    positions, where = m.positions(grid)
    firsts = list(m.first_triangles) if bodies == "each" else [0]
    ends = firsts[1:] + [len(m.triangles)]
    out = np.empty((len(firsts), *grid.shape), np.float32)
    counts: dict[str, int] = {}
    for values, first, end in zip(out, firsts, ends):
        of_body = _core.fractions(positions, m.triangles[first:end], where, values, threads)
        counts = {name: counts.get(name, 0) + count for name, count in of_body.items()}
    take_counts(counts, status)
    if counts["open_rows"]:
        rows = len(firsts) * grid.shape[0] * grid.shape[1]
        warnings.warn(
            f"the mesh is not closed: {counts['open_rows']} of {rows} rows of voxels do not balance, and the fractions behind a "
            f"hole are in doubt ({counts['open_edges']} open edges)",
            OpenMeshWarning,
            stacklevel=2,
        )
    return m.to_caller(out if bodies == "each" else out[0])
