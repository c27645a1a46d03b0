# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math
import warnings
from typing import Any, Sequence

import numpy as np

from . import _core
from ._core import Grid
from ._mesh import Mesh, ModelMesh, as_mesh
from ._surface import DroppedTrianglesWarning
from ._types import MeshLike, whole_number


def _sizes(voxel_size: Any) -> tuple[float, float, float]:
    values = [voxel_size] * 3 if np.ndim(voxel_size) == 0 else list(voxel_size)
    if len(values) != 3:
        raise ValueError(f"voxel_size is a number, or three for x, y and z, not {voxel_size!r}")
    x, y, z = (float(v) for v in values)
    for size in (x, y, z):
        if not (math.isfinite(size) and size > 0):
            raise ValueError(f"voxel_size is above 0 and finite, not {size!r}")
    return x, y, z


def fit(
    mesh: MeshLike,
    resolution: int | Sequence[int] | None = None,
    *,
    voxel_size: float | Sequence[float] | None = None,
    padding: int = 0,
) -> Grid:
    """A grid of voxels around a mesh. Of a path or a Model it is the one that the voxelize tool makes (--resolution,
    --voxel-size, --padding).

    Args:
        mesh: what any function takes; vertices that are not finite do not count.
        resolution: voxels along the longest side, the others get as many as they need; or a shape (nz, ny, nx). The mesh
            is in the middle, with a margin of a ten-thousandth.
        voxel_size: in place of it, the size in world units, of all axes or (x, y, z). The voxels lie on the multiples of
            the size: a side from 0 to 0.6 is 6 voxels of 0.1.
        padding: with voxel_size, empty voxels at either end of each axis.

    Raises:
        ValueError: a size that no grid can have (1 to 2^20 voxels an axis), or a mesh without a finite vertex.

    Warns with DroppedTrianglesWarning of vertices that are not finite.

    Example:
        >>> grid = vp.fit(mesh, 256)
        >>> grid = vp.fit(mesh, voxel_size=0.1, padding=2)
    """
    if (resolution is None) == (voxel_size is None):
        raise ValueError("give a resolution or a voxel_size")
    padding = whole_number("padding", padding)
    if padding != 0 and voxel_size is None:
        raise ValueError("padding goes with voxel_size")
    size = None if voxel_size is None else _sizes(voxel_size)
    longest = whole_number("resolution", resolution) if resolution is not None and np.ndim(resolution) == 0 else None
    shape = None
    if resolution is not None and longest is None:
        shape = tuple(whole_number("resolution", n) for n in resolution)  # type: ignore[union-attr]
        if len(shape) != 3:
            raise ValueError(f"resolution is a number, or a shape (nz, ny, nx), not {resolution!r}")
    m = as_mesh(mesh)
    bounds = m.bounds()
    if bounds is None and not (isinstance(m, ModelMesh) and m.scene.is_more_than_triangles):
        raise ValueError("the mesh has no vertex at a finite position to fit a grid to: make a Grid")
    if isinstance(m, Mesh):
        bad = len(m.vertices) - int(np.isfinite(m.vertices).all(axis=1).sum())
        if bad:
            warnings.warn(
                f"{bad} of {len(m.vertices)} vertices are not finite, and the grid is fitted to the others",
                DroppedTrianglesWarning,
                stacklevel=2,
            )
    if isinstance(m, ModelMesh):
        return m.scene.fit(longest, shape, size, padding)
    low, high = bounds  # type: ignore[misc]
    if size is not None:
        return _core.fit_voxel_size(low, high, size, padding)
    if longest is not None:
        return _core.fit_longest(low, high, longest)
    return _core.fit_shape(low, high, shape)
