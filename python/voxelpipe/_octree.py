# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Octrees over lists of voxels, and rays through them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import to_numpy
from ._axes import VoxelList, as_voxels
from ._core import Grid
from ._types import check_grid, check_threads, whole_number


class Hits(NamedTuple):
    """The first voxel that each ray meets."""

    rows: npt.NDArray[np.int64]
    """(r,): the voxel's row in the list of the octree; -1 where the ray meets none"""
    distances: npt.NDArray[np.float64]
    """(r,): where, in lengths of the ray's direction; infinity where it meets none"""
    normals: npt.NDArray[np.int8]
    """(r, 3): outward normal of the voxel's side through which the ray comes in; zeros where it meets none"""


class Octree:
    """An octree over a list of voxels of a grid: nodes of 2, 4, 8 ... voxels a side, which exist where a voxel in them does.

    Args:
        voxels: (n, 3), columns x, y, z, as sparse() lists them, each once.
        grid: their Grid.

    Raises:
        IndexError: a voxel lies outside of the grid. ValueError: one is listed twice.

    Example:
        >>> voxels, attributes = vp.sparse(mesh, grid, {"rgb": colors})
        >>> hits = vp.Octree(voxels, grid).first_hits(origins, directions)
        >>> rgb = attributes["rgb"][hits.rows[hits.rows >= 0]]
    """

    def __init__(self, voxels: Any, grid: Grid) -> None:
        self.grid: Grid = check_grid(grid, "Octree")
        self._tree = _core.Octree.of(as_voxels(voxels, "voxels"), grid)

    @property
    def num_levels(self) -> int:
        """Levels above the voxels; the last one is the root. 0 where there is no voxel."""
        return int(self._tree.num_levels)

    @property
    def nbytes(self) -> int:
        """Bytes that the nodes take."""
        return int(self._tree.num_bytes)

    def level(self, level: int) -> VoxelList:
        """The nodes of a level, 1 to num_levels: (n, 3), columns x, y, z, in Morton order. Node p has the voxels
        from p * 2**level on, counted in the whole grid of a crop."""
        nodes: np.ndarray = self._tree.nodes(whole_number("level", level))
        return nodes.view(VoxelList)

    def first_hits(self, origins: Any, directions: Any, *, limit: float = np.inf, threads: int = 0) -> Hits:
        """The first voxel that each ray meets, from its origin on: a ray that starts in a voxel meets it at 0.

        Args:
            origins: (r, 3) world positions, or one for all rays.
            directions: (r, 3), or one for all; of any length above 0.
            limit: the end of the rays, in lengths of their directions.
            threads: 0 takes all cores.

        Returns:
            Hits.

        Example:
            >>> hits = octree.first_hits(camera, directions)
            >>> points = camera + hits.distances[:, None] * directions
        """
        check_threads(threads)
        rays = []
        for what, given in (("origins", origins), ("directions", directions)):
            a = np.atleast_2d(np.asarray(to_numpy(given, what), np.float64))
            if a.ndim != 2 or a.shape[1] != 3:
                raise ValueError(f"{what} are an array (r, 3), not {a.shape}")
            if not np.isfinite(a).all():
                raise ValueError(f"{what} are finite")
            rays.append(a)
        if not (limit >= 0):
            raise ValueError(f"limit is 0 or more, not {limit!r}")
        if not np.abs(rays[1]).max(axis=1).all():
            raise ValueError("directions have a length above 0")
        n = max(len(a) for a in rays)
        if any(len(a) not in (1, n) for a in rays):
            raise ValueError(f"there are {len(rays[0])} origins and {len(rays[1])} directions")
        start, along = (np.ascontiguousarray(np.broadcast_to(a, (n, 3))) for a in rays)
        rows, distances, sides = np.empty(n, np.int64), np.empty(n), np.empty(n, np.int8)
        self._tree.first_hits(start, along, min(float(limit), 1e300), rows, distances, sides, threads)
        normals = np.zeros((n, 3), np.int8)
        hit = np.nonzero(rows >= 0)[0]
        normals[hit, np.abs(sides[hit]) - 1] = np.sign(sides[hit])
        return Hits(rows, distances, normals)
