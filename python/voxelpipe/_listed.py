# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The forms in which voxels are given to save(), render() and view()."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np

from ._mesh import to_numpy


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


def listed(values: Any, occupied: Any) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Voxels (n, 3) int32 with columns x, y, z, and a row for each of them by name."""
    if is_list(values):
        voxels = np.ascontiguousarray(to_numpy(values[0], "voxels"), np.int32)
        rows = {name: to_numpy(a, name) for name, a in values[1].items()}
    else:
        arrays = named(values)
        at = np.nonzero(occupied_of(arrays, occupied))
        voxels = np.ascontiguousarray(np.stack(at[::-1], axis=1), np.int32)
        rows = {name: a[at] for name, a in arrays.items()}
    return voxels, rows or {"occupancy": np.ones(len(voxels), np.bool_)}
