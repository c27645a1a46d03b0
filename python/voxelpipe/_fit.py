# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Sequence

import numpy as np

from . import _core
from ._core import Grid
from ._mesh import MeshLike, as_mesh


def fit(
    mesh: MeshLike,
    resolution: int | Sequence[int] | None = None,
    *,
    voxel_size: float | Sequence[float] | None = None,
    padding: int = 0,
) -> Grid:
    """A grid of voxels around a mesh; vertices that are not finite do not count.

    resolution: voxels along the longest side, the others get as many as they need; or a shape (nz, ny, nx). The mesh is
        in the middle, with a margin of a ten-thousandth.
    voxel_size: in place of it, the size in world units, of all axes or (x, y, z). The voxels lie on the multiples of
        the size: a side from 0 to 0.6 is 6 voxels of 0.1.
    padding: with voxel_size, empty voxels at either end of each axis.

    Raises ValueError for a size that no grid can have (1 to 2^20 voxels an axis).
    """
    if (resolution is None) == (voxel_size is None):
        raise ValueError("give a resolution or a voxel_size")
    low, high = as_mesh(mesh).bounds() or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    if voxel_size is not None:
        size = (float(voxel_size),) * 3 if np.ndim(voxel_size) == 0 else tuple(float(s) for s in voxel_size)
        return _core.fit_voxel_size(low, high, size, padding)
    if padding != 0:
        raise ValueError("padding goes with voxel_size")
    if np.ndim(resolution) == 0:
        return _core.fit_longest(low, high, int(resolution))
    return _core.fit_shape(low, high, tuple(int(n) for n in resolution))
