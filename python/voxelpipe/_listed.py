# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The forms in which voxels are given to save(), render() and view()."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np

from ._arrays import to_numpy
from ._axes import as_voxels, zyx
from ._core import Grid


def is_list(values: Any) -> bool:
    """True if these are a result of sparse(): (voxels, attributes)."""
    return isinstance(values, tuple) and len(values) == 2


def named(values: Any) -> dict[str, np.ndarray]:
    """Dense arrays by name."""
    if isinstance(values, Mapping):
        return {name: to_numpy(a, name) for name, a in values.items()}
    a = to_numpy(values, "values")
    return {"occupancy" if a.dtype == np.bool_ else "values": a}


def occupied_of(arrays: dict[str, np.ndarray], occupied: Any) -> np.ndarray:
    """bool (nz, ny, nx): as given, or else a mask among the arrays, or else where any value is not zero."""
    if occupied is not None:
        return to_numpy(occupied, "occupied").astype(np.bool_, copy=False)
    for a in arrays.values():
        if a.dtype == np.bool_:
            return a
    masks = [a != 0 if a.ndim == 3 else (a != 0).any(axis=-1) for a in arrays.values()]
    return np.asarray(np.logical_or.reduce(masks))


def check_shapes(values: Any, arrays: Mapping[str, np.ndarray], occupied: Any, grid: Grid) -> None:
    """Raises ValueError for one of the dense arrays of `values` that does not have the grid's shape."""
    shapes = {name if isinstance(values, Mapping) else "values": a.shape for name, a in arrays.items()}
    if occupied is not None:
        shapes["occupied"] = tuple(occupied.shape)
    for name, shape in shapes.items():
        if shape[:3] != grid.shape or len(shape) > 4 or (name == "occupied" and len(shape) != 3):
            raise ValueError(f"{name} has the shape {shape}, the grid's is {grid.shape} (nz, ny, nx)")


def check_list(values: Any, occupied: Any, grid: Grid) -> None:
    """Raises TypeError, ValueError or IndexError for a list that is none of sparse(), or does not fit the grid."""
    if not isinstance(values[1], Mapping):
        raise TypeError("a list is (voxels, values by name), as sparse() returns it; cubes of tiles() go into extract() alone")
    if occupied is not None:
        raise ValueError("occupied is of dense arrays; the voxels of a list are those that it names")
    voxels = as_voxels(values[0], "voxels")
    zyx(grid, voxels)  # IndexError for one that lies outside
    for name, a in values[1].items():
        if len(a) != len(voxels):
            raise ValueError(f"{name} has {len(a)} rows for {len(voxels)} voxels")


def listed(values: Any, occupied: Any, grid: Grid) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Voxels (n, 3) int32 with columns x, y, z, and a row for each of them by name."""
    if is_list(values):
        voxels = as_voxels(values[0], "voxels")
        rows = {name: to_numpy(a, name) for name, a in values[1].items()}
        for name, a in rows.items():
            if len(a) != len(voxels):
                raise ValueError(f"{name} has {len(a)} rows for {len(voxels)} voxels")
    else:
        arrays = named(values)
        check_shapes(values, arrays, occupied, grid)
        at = np.nonzero(occupied_of(arrays, occupied))
        voxels = np.ascontiguousarray(np.stack(at[::-1], axis=1), np.int32)
        rows = {name: a[at] for name, a in arrays.items()}
    return voxels, rows or {"occupancy": np.ones(len(voxels), np.bool_)}
