# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any

import numpy as np

from . import _core, _device_fields
from ._arrays import is_on_device
from ._surface import packed
from ._types import check_status, check_threads, whole_number


def label(
    values: Any,
    connectivity: int = 6,
    *,
    components: bool = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """The connected components of voxels: (nz, ny, nx) labels, each the lowest number of the voxels in its component.

    Voxel (x, y, z) has the number x + nx * (y + ny * z), its index in `labels.ravel()`. Voxels that are not set have the
    label -1. The partition is that of scipy.ndimage.label; the names do not depend on it, on threads or on the machine.

    Args:
        values: bool (nz, ny, nx), such as those of voxelize() and solid(), or integers: what is not 0 is set. An array in
            a GPU's memory is labelled there, with the same bits.
        connectivity: voxels are neighbours across faces (6), faces and edges (18), or corners as well (26).
        components: also list the components.
        threads: 0 takes all cores. The result is the same for any number.
        status: a dict that is filled with the number of `components`.

    Returns the labels: int32, or int64 for more than 2^31 voxels. With `components` also a dict of arrays with a row for
    each component, ascending by names: `name` (n), `voxels` (n), the number of them, and `min` and `max` (n, 3), the lowest
    and the highest voxel (x, y, z) of its bounding box, both within. Raises TypeError for values that are neither bool nor
    integers, ValueError for another number of axes or another connectivity.

    Example:
        >>> labels, parts = vp.label(vp.solid(mesh, grid), components=True)
        >>> largest = labels == parts["name"][parts["voxels"].argmax()]
    """
    check_threads(threads)
    check_status(status)
    if whole_number("connectivity", connectivity) not in (6, 18, 26):
        raise ValueError(f"connectivity is 6, 18 or 26, not {connectivity}")
    is_there = is_on_device(values)
    array, dtype = _device_fields.taken(values, "the array") if is_there else (np.asarray(values), None)
    dtype = array.dtype if dtype is None else dtype
    if dtype != np.bool_:
        if dtype.kind not in "iu":
            raise TypeError(f"values are bool or integers, which are set where they are not 0, not {dtype}")
        array = array != 0
    if array.ndim != 3 or 0 in array.shape:
        raise ValueError(f"values have the shape (nz, ny, nx), each at least 1, not {tuple(array.shape)}")
    if is_there:
        labels, count, listed = _device_fields.label(array, connectivity, components)
    else:
        labels = np.empty(array.shape, np.int32 if array.size <= 2**31 else np.int64)
        count, name, voxels, low, high = _core.label(packed(array), labels, connectivity, components, threads)
        listed = {"name": name, "voxels": voxels, "min": low, "max": high}
    if status is not None:
        status.clear()
        status["components"] = count
    return (labels, listed) if components else labels
