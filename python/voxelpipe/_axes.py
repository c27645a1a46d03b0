# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The one convention of axes: arrays of voxels are indexed [z, y, x]; lists of voxels, and positions, have columns x, y, z.
`grid.zyx(voxels)` goes from the second to the first."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _core
from ._arrays import is_torch, to_numpy, torch_of
from ._core import Grid
from ._types import check_grid, check_threads


class VoxelList(np.ndarray):
    """Voxels as rows: (n, 3) int32, columns x, y, z. An array of NumPy, but that the tuple of its columns, by which an
    array of the grid would be indexed [x, y, z], cannot be made: `array[tuple(voxels.T)]` raises TypeError. Arrays are
    indexed by `array[grid.zyx(voxels)]`.

    Rows of it are a VoxelList again (`voxels[mask]`); columns, and results of arithmetic, are plain arrays.

        x, y, z = voxels[:, 0], voxels[:, 1], voxels[:, 2]
    """

    def _plain(self) -> np.ndarray:
        return self.view(np.ndarray)

    def __getitem__(self, key: Any) -> Any:
        part = self._plain()[key]
        has_columns = not isinstance(key, tuple) or len(key) == 1 or (len(key) == 2 and _is_whole(key[1]))
        if has_columns and isinstance(part, np.ndarray) and part.ndim == 2:
            return part.view(VoxelList)
        return part

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        plain = np.asarray(array)
        return plain[()] if return_scalar or plain.ndim == 0 else plain

    @property
    def T(self) -> Any:  # type: ignore[override]
        return self.transpose()

    def transpose(self, *axes: Any) -> Any:
        turned = self._plain().transpose(*axes)
        is_turned = self.ndim == 2 and turned.strides == self.strides[::-1] and turned.shape == self.shape[::-1]
        is_same = axes in ((0, 1), ((0, 1),), ([0, 1],))
        return turned.view(_Columns) if is_turned and not is_same else turned

    def swapaxes(self, axis1: Any, axis2: Any) -> Any:
        return self.transpose() if self.ndim == 2 and axis1 % 2 != axis2 % 2 else self._plain().swapaxes(axis1, axis2)


def _is_whole(key: Any) -> bool:
    return key is Ellipsis or (isinstance(key, slice) and key == slice(None))


class _Columns(np.ndarray):
    """The columns x, y, z of a VoxelList, as rows. It is not taken apart, and what is made of it is a plain array."""

    def __iter__(self) -> Any:
        raise TypeError(
            "the columns of a list of voxels are x, y, z, and arrays are indexed [z, y, x]: use array[grid.zyx(voxels)], "
            "or voxels[:, 0] for a column"
        )

    def __getitem__(self, key: Any) -> Any:
        return self.view(np.ndarray)[key]

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        plain = np.asarray(array)
        return plain[()] if return_scalar or plain.ndim == 0 else plain

    @property
    def T(self) -> Any:  # type: ignore[override]
        return self.view(np.ndarray).T.view(VoxelList)


def as_voxels(ijk: Any, what: str = "ijk") -> np.ndarray:
    """Voxels as a plain array (n, 3) int32, C order. Raises ValueError."""
    a = np.asarray(to_numpy(ijk, what))
    if a.ndim != 2 or a.shape[1] != 3:
        raise ValueError(f"{what}: an array (n, 3) with the columns x, y, z of voxels, not {a.shape}")
    if a.dtype.kind not in "iu":
        raise ValueError(f"{what} are whole numbers, not {a.dtype}; to_ijk() gives the voxels of positions")
    if a.dtype != np.int32:
        if a.size and (int(a.max()) > np.iinfo(np.int32).max or int(a.min()) < np.iinfo(np.int32).min):
            raise IndexError(f"{what}: a number of more than 31 bits is no voxel of any grid")
        a = a.astype(np.int32)
    return np.ascontiguousarray(a)


def _columns(grid: Grid, ijk: Any) -> tuple[Any, Any, Any]:
    """x, y, z of voxels of the grid, 64 bits each. Raises IndexError for one that lies outside."""
    if is_torch(ijk):
        if ijk.ndim != 2 or ijk.shape[1] != 3 or ijk.is_floating_point():
            raise ValueError(f"ijk are voxels (n, 3) with columns x, y, z, not {tuple(ijk.shape)} of {ijk.dtype}")
        wide = ijk.long()
    else:
        wide = as_voxels(ijk).astype(np.int64)
    columns = (wide[:, 0], wide[:, 1], wide[:, 2])
    for column, n in zip(columns, grid.shape[::-1]):
        outside = (column < 0) | (column >= n)
        if bool(outside.any()):
            row = int(outside.nonzero()[0].reshape(-1)[0]) if is_torch(ijk) else int(np.argmax(outside))
            voxel = tuple(int(i) for i in wide[row])
            nz, ny, nx = grid.shape
            raise IndexError(f"voxel {row} is {voxel} (x, y, z), which lies outside the grid of {nx} x {ny} x {nz}")
    return columns


def zyx(grid: Grid, ijk: Any) -> tuple[Any, Any, Any]:
    x, y, z = _columns(grid, ijk)
    return z, y, x


def index(grid: Grid, ijk: Any) -> Any:
    x, y, z = _columns(grid, ijk)
    _, ny, nx = grid.shape
    return (z * ny + y) * nx + x


def _vectors(grid: Grid, like: Any) -> tuple[Any, Any, Any]:
    """Origin of the whole grid, voxel size and offset (x, y, z), in double."""
    values = (grid._whole_origin, grid.voxel_size, grid.offset[::-1])
    if is_torch(like):
        torch = torch_of(like)
        x, y, z = (torch.tensor(v, dtype=torch.float64, device=like.device) for v in values)
        return x, y, z
    x, y, z = (np.array(v, np.float64) for v in values)
    return x, y, z


def to_xyz(grid: Grid, ijk: Any) -> Any:
    origin, size, offset = _vectors(grid, ijk)
    voxels = ijk if is_torch(ijk) else as_voxels(ijk)
    return origin + (offset + voxels + 0.5) * size


def to_ijk(grid: Grid, xyz: Any) -> Any:
    points = xyz.double() if is_torch(xyz) else np.asarray(to_numpy(xyz, "xyz"), np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"xyz are positions (n, 3), not an array {tuple(points.shape)}")
    origin, size, offset = _vectors(grid, xyz)
    voxels = (points - origin) / size - offset
    voxels = voxels.floor() if is_torch(xyz) else np.floor(voxels)
    if not bool((abs(voxels) < 2.0**31).all()):
        raise ValueError("xyz has a position that is not finite, or more than 2^31 voxels from the grid")
    return voxels.int() if is_torch(xyz) else voxels.astype(np.int32).view(VoxelList)


def ijk(grid: Grid, dense: Any) -> Any:
    if tuple(dense.shape) != grid.shape:
        raise ValueError(f"dense has the shape {tuple(dense.shape)}, the grid's is {grid.shape} (nz, ny, nx)")
    if is_torch(dense):
        return dense.nonzero().flip(1).int()
    at = np.nonzero(to_numpy(dense, "dense"))
    return np.ascontiguousarray(np.stack(at[::-1], axis=1), np.int32).view(VoxelList)


def scattered(voxels: np.ndarray, rows: np.ndarray, grid: Grid, fill: Any, threads: int) -> np.ndarray:
    """A row for each voxel (n, 3) in an array of the grid; `fill` elsewhere."""
    shape = (*grid.shape, *rows.shape[1:])
    # Memory of zeros is the system's: pages without a voxel are not even touched.
    is_zero = rows.dtype.type(fill).tobytes().count(0) == rows.dtype.itemsize
    out = np.zeros(shape, rows.dtype) if is_zero else np.full(shape, fill, rows.dtype)
    kind = np.dtype(f"u{rows.dtype.itemsize}") if rows.dtype.itemsize in (1, 2, 4, 8) else rows.dtype
    _core.scatter(voxels, np.ascontiguousarray(rows).view(kind), grid, out.view(kind), threads)
    return out


def dense(ijk: Any, values: Any, grid: Grid, *, fill: Any = 0, threads: int = 0) -> Any:
    """A list of voxels as an array of the grid: (nz, ny, nx), or (nz, ny, nx, columns).

    Args:
        ijk: voxels (n, 3), columns x, y, z, as sparse() lists them.
        values: a row for each voxel, (n,) or (n, columns); or one value for all, such as True.
        grid: the Grid.
        fill: the value of all other voxels.
        threads: 0 takes all cores.

    Returns:
        An array of the values' type, a tensor where the values are one. Of a voxel that is listed twice either value stays.

    Raises:
        IndexError: a voxel lies outside of the grid.
        ValueError: there is not one row for each voxel.

    Example:
        >>> voxels, attributes = vp.sparse(mesh, grid, {"rgb": colors})
        >>> rgb = vp.dense(voxels, attributes["rgb"], grid)
        >>> occupied = vp.dense(voxels, True, grid)
    """
    check_grid(grid, "dense")
    check_threads(threads)
    voxels = as_voxels(ijk)
    wanted = is_torch(values) or (is_torch(ijk) and np.ndim(values) == 0)
    rows = np.asarray(to_numpy(values, "values"))
    if rows.ndim == 0:
        rows = np.full(len(voxels), rows)
    if len(rows) != len(voxels):
        raise ValueError(f"values have {len(rows)} rows, ijk has {len(voxels)} voxels")
    out = scattered(voxels, rows, grid, fill, threads)
    return torch_of(values if is_torch(values) else ijk).from_numpy(out) if wanted else out
