# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Attributes of vertices and triangles in the voxels of a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping

import numpy as np

from . import _core, _device
from ._core import Grid
from ._device import DeviceMesh
from ._mesh import Mesh, MeshLike, as_mesh
from ._surface import take_counts


@dataclass(frozen=True)
class _Attribute:
    name: str
    values: Any  # (rows, columns): float32, or int64 where exact integers are asked for
    per_triangle: bool
    blend: str
    is_flat: bool  # given without columns
    dtype: np.dtype  # of the result
    is_integer: bool


    def result(self, mesh: Mesh | DeviceMesh, values: Any) -> Any:
        """From (..., columns) as drawn to what the caller gets."""
        drawn = mesh.dtype_of(values)
        if drawn != self.dtype:
            is_rounded = self.dtype.kind in "iu" and drawn.kind == "f"
            values = mesh.rounded(values, self.dtype) if is_rounded else mesh.convert(values, self.dtype)
        return mesh.to_caller(values[..., 0] if self.is_flat else values)


def _blend_of(name: str, dtype: np.dtype, blend: Any) -> str:
    chosen = blend if isinstance(blend, str) else (blend or {}).get(name)
    if chosen is None:
        return "mean" if dtype.kind == "f" or dtype == np.uint8 else "last"
    if chosen not in ("mean", "sum", "min", "max", "last"):
        raise ValueError(f"blend is 'mean', 'sum', 'min', 'max' or 'last', not {chosen!r}")
    return chosen


def _per_triangle(name: str, rows: int, mesh: Mesh | DeviceMesh, per: Mapping[str, str] | None) -> bool:
    vertices, triangles = len(mesh.vertices), len(mesh.triangles)
    said = (per or {}).get(name)
    if said not in (None, "vertex", "triangle"):
        raise ValueError(f"per is 'vertex' or 'triangle', not {said!r}")
    if said is None and vertices == triangles == rows:
        raise ValueError(f"{name}: the mesh has as many vertices as triangles; say per={{{name!r}: 'vertex'}} or 'triangle'")
    expected = {"vertex": (vertices,), "triangle": (triangles,), None: (vertices, triangles)}[said]
    if rows not in expected:
        raise ValueError(f"{name}: {rows} rows of values for {vertices} vertices and {triangles} triangles")
    return said == "triangle" or (said is None and rows == triangles)


def _attribute(name: str, given: Any, mesh: Mesh | DeviceMesh, blend: Any, per: Mapping[str, str] | None) -> _Attribute:
    values = mesh.take(given, name)
    given_type = mesh.dtype_of(values)
    if values.ndim not in (1, 2) or given_type.kind not in "fiub":
        raise ValueError(
            f"{name}: an array (rows,) or (rows, columns) of numbers, not {tuple(values.shape)} of {given_type}"
        )
    is_flat = values.ndim == 1
    rows = values[:, None] if is_flat else values
    if rows.shape[1] == 0:
        raise ValueError(f"{name}: no columns")
    per_triangle = _per_triangle(name, len(rows), mesh, per)
    chosen = _blend_of(name, given_type, blend)
    if given_type.kind == "f" or chosen == "mean":
        keeps_type = given_type == np.uint8  # colours
        dtype = np.dtype(np.uint8 if keeps_type else np.float32)
        return _Attribute(name, mesh.convert(rows, np.float32), per_triangle, chosen, is_flat, dtype, False)
    if given_type == np.uint64 and len(rows) and int(rows.max()) > np.iinfo(np.int64).max:
        raise ValueError(f"{name}: integers above 2^63 - 1")
    dtype = np.dtype(np.int64) if chosen == "sum" else given_type
    return _Attribute(name, mesh.convert(rows, np.int64), per_triangle, chosen, is_flat, dtype, True)


def _passes(a: _Attribute) -> list[tuple[int, int]]:
    """(first column, number of columns) of each pass: 3 at a time, or 1."""
    columns = a.values.shape[1]
    threes = 0 if a.is_integer else columns // 3 * 3
    return [(c, 3) for c in range(0, threes, 3)] + [(c, 1) for c in range(threes, columns)]


def bake(
    mesh: MeshLike,
    grid: Grid,
    values: Mapping[str, Any],
    *,
    blend: Any = None,
    per: Mapping[str, str] | None = None,
    fill: float = 0,
    coverage: str = "conservative",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> dict[str, Any]:
    """Attributes in a dense grid: for each name an array (nz, ny, nx) or (nz, ny, nx, columns).

    values: for each name an array with a row for each vertex, which is interpolated (integers are taken from the
        triangle's first vertex), or for each triangle.
    blend: what becomes of the fragments of one voxel, for all names or by name: "mean", "sum", "min", "max", or "last",
        that of the highest triangle number. By default floats and uint8 are averaged, other integers "last". Sums of
        floats do not depend on any order: terms are multiples of 2^-32, and one of 2^31 or more is infinite.
    per: by name, "vertex" or "triangle", for a mesh that has as many vertices as triangles.
    fill: the value of voxels without a fragment.

    Floats give float32; integers keep their type, but for sums (int64) and means (float32; uint8 stays uint8, rounded).
    """
    m = as_mesh(mesh)
    attributes = [_attribute(name, given, m, blend, per) for name, given in values.items()]
    if isinstance(m, DeviceMesh):
        on_device = {}
        for a in attributes:
            drawn, report = _device.bake(m, grid, coverage, a, fill)
            take_counts(report, status)
            on_device[a.name] = a.result(m, drawn)
        return on_device
    positions, where = m.positions(grid)
    counts = np.empty(grid.shape, np.uint32)
    result = {}
    for a in attributes:
        columns = a.values.shape[1]
        out = np.empty((*grid.shape, columns), a.values.dtype)
        for first, n in _passes(a):
            part = out if n == columns else np.empty((*grid.shape, n), a.values.dtype)
            what = (positions, m.triangles, where, coverage, a.values, first, a.per_triangle, a.blend)
            if a.is_integer:
                report = _core.bake_integer(*what, int(fill), part[..., 0], counts, threads)
            else:
                report = _core.bake_float(*what, float(fill), part, counts, threads)
            if n != columns:
                out[..., first : first + n] = part
        take_counts(report, status)
        result[a.name] = a.result(m, out)
    return result


def sparse(
    mesh: MeshLike,
    grid: Grid,
    values: Mapping[str, Any] | None = None,
    *,
    blend: Any = None,
    per: Mapping[str, str] | None = None,
    coverage: str = "conservative",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> tuple[Any, dict[str, Any]]:
    """The voxels of a surface as a list, and their attributes: memory in proportion to the surface, for grids of up to
    2^20 voxels an axis.

    Returns (voxels, attributes): (n, 3) int32 with columns x, y, z, in Morton order, and for each name n values or
    (n, columns), as bake() has them in these voxels. The other parameters are those of bake().
    """
    m = as_mesh(mesh)
    attributes = [_attribute(name, given, m, blend, per) for name, given in (values or {}).items()]
    if isinstance(m, DeviceMesh):
        on_device, report = _device.sparse_voxels(m, grid, coverage)
        take_counts(report, status)
        return on_device, {a.name: a.result(m, _device.sparse(m, grid, coverage, a)) for a in attributes}
    positions, where = m.positions(grid)
    voxels, report = _core.sparse_voxels(positions, m.triangles, where, coverage, threads)
    take_counts(report, status)
    result = {}
    for a in attributes:
        parts = []
        for first, n in _passes(a):
            what = (positions, m.triangles, where, coverage, a.values, first)
            if a.is_integer:
                part, _ = _core.sparse_integer(*what, a.per_triangle, a.blend, threads)
                part = part[:, np.newaxis]
            else:
                part, _ = _core.sparse_float(*what, n, a.per_triangle, a.blend, threads)
            parts.append(part)
        result[a.name] = a.result(m, parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1))
    return m.to_caller(voxels), result
