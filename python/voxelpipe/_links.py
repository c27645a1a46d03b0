# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._core import Grid
from ._distance import host_mesh
from ._arrays import to_torch
from ._surface import listed_for, take_counts
from ._types import MeshLike, check_call, whole_number


class Links(NamedTuple):
    """Where a mesh crosses the segments between voxels' centres: a row for each voxel of which a link is crossed, a column
    for each of k neighbours. Link j of a row leads to the voxel at voxels + directions[j]; links j and j ^ 1 are opposite
    each other."""

    voxels: Any
    """(n, 3) int32, a VoxelList: x, y, z of each voxel with a crossed link, z-major order"""
    q: Any
    """(n, k) float32: the part of the link before its first crossing, above 0 to 1; -1 without a crossing"""
    triangles: Any
    """(n, k) int32: number of the mesh's triangle that is crossed first, -1 without; int64 for torch, and for a mesh of 2^31
    triangles or more"""
    bodies: Any
    """(n, k) int32: which mesh of a list, or part of a model, that triangle belongs to; -1 without a crossing"""
    directions: np.ndarray
    """(k, 3) int32: steps x, y, z to the neighbours: 6 through faces, 12 through edges, 8 through corners"""


def links(
    mesh: MeshLike,
    grid: Grid,
    neighbours: int = 18,
    *,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Links:
    """The links of every voxel that the mesh crosses: what lattice Boltzmann solvers read of walls between their nodes.

    A link goes from a voxel's centre to that of a neighbour, which may lie beyond the grid. The position of its first
    crossing is an exact fraction, rounded once to float32. Centres on a triangle are moved by an offset of no length, as
    those of solid() are, so that a closed mesh separates the nodes that solid(..., extent="centre") parts; a crossing that
    only the offset moves away from the centre has q = 2^-126.

    Args:
        mesh, grid: as in voxelize(). The mesh may be open, and its triangles may face any way.
        neighbours: 18, through faces and edges, as for D3Q19; or 26, corners too, as for D3Q27.
        threads: 0 takes all cores. The result is the same for any number.
        status: a dict that is filled with the call's counters: voxels are the rows, fragments the links that are crossed.

    Returns Links, whose arrays are tensors for a mesh of tensors. Raises IndexError for a triangle that names a vertex that
    does not exist, TypeError for a mesh in a GPU's memory, ValueError for another number of neighbours.

    Example:
        >>> walls = vp.links(mesh, grid, 18)
        >>> row, link = (walls.q > 0).nonzero()  # every crossed link
        >>> beyond = walls.voxels[row] + walls.directions[link]
    """
    check_call("links", grid, "conservative", threads, status)
    if whole_number("neighbours", neighbours) not in (18, 26):
        raise ValueError(f"neighbours is 18 or 26, not {neighbours}")
    m = host_mesh(mesh, "links")
    positions, where = m.positions(grid)
    voxels, q, triangles, bodies, directions, counts = _core.links(
        positions, m.triangles, list(m.first_triangles), where, neighbours, threads
    )
    take_counts(counts, status)
    is_wide = m.to_caller is to_torch or len(m.triangles) >= 2**31
    triangles = np.where(q < 0, -1, triangles.astype(np.int64)) if is_wide else triangles.view(np.int32)
    return Links(listed_for(m, voxels), *(m.to_caller(a) for a in (q, triangles, bodies.view(np.int32))), directions)
