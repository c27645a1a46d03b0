# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Attributes of vertices and triangles in the voxels of a surface."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from numbers import Real
from typing import Any, Mapping, Sequence, overload

import numpy as np
import numpy.typing as npt

from . import _core, _device
from ._arrays import is_torch
from ._axes import VoxelList, scattered
from ._core import Grid
from ._device import DeviceMesh
from ._mesh import Mesh, ModelMesh, as_mesh
from ._model import Model, read_scene
from ._solid import solid_voxels
from ._surface import listed_for, take_counts
from ._types import (
    Blend,
    BlendLike,
    Bodies,
    Coverage,
    Extent,
    Fill,
    MeshLike,
    OwnValue,
    OwnValues,
    Per,
    Repair,
    TensorMesh,
    check_call,
    check_choice,
)
from ._visuals import own_scene


@dataclass(frozen=True)
class _Attribute:
    name: str
    values: Any  # (rows, columns): float32, or int64 where exact integers are asked for
    per_triangle: bool
    blend: str
    is_flat: bool  # given without columns
    dtype: np.dtype  # of the result
    is_integer: bool


    def typed(self, mesh: Mesh | DeviceMesh, values: Any) -> Any:
        """From (..., columns) as drawn to the type and shape that the caller gets."""
        drawn = mesh.dtype_of(values)
        if drawn != self.dtype:
            is_rounded = self.dtype.kind in "iu" and drawn.kind == "f"
            values = mesh.rounded(values, self.dtype) if is_rounded else mesh.convert(values, self.dtype)
        return values[..., 0] if self.is_flat else values


def _blend_of(name: str, dtype: np.dtype, blend: Any) -> str:
    chosen = blend.get(name) if isinstance(blend, Mapping) else blend
    if chosen is None:
        return "mean" if dtype.kind == "f" or dtype == np.uint8 else "last"
    check_choice("blend", chosen, Blend)
    return str(chosen)


def _per_triangle(name: str, rows: int, mesh: Mesh | DeviceMesh, per: Mapping[str, str] | None) -> bool:
    vertices, triangles = len(mesh.vertices), len(mesh.triangles)
    said = (per or {}).get(name)
    if said is not None:
        check_choice("per", said, Per)
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


def _attributes(m: Mesh | DeviceMesh, values: Mapping[str, Any], blend: Any, per: Any) -> list[_Attribute]:
    if values and isinstance(m, ModelMesh) and not len(m.triangles) and len(m.scene.lines):
        raise ValueError("a model of points or lines has no triangles that values could be of; it has values by itself alone")
    for what, given in (("blend", blend), ("per", per)):
        if given is None or (what == "blend" and isinstance(given, str)):
            continue
        if not isinstance(given, Mapping):
            raise TypeError(f"{what} is a mapping by name, such as {{'rgb': ...}}, not {type(given).__name__}")
        unknown = [name for name in given if name not in values]
        if unknown:
            raise ValueError(f"{what} names no value: {', '.join(map(repr, unknown))}; there are {', '.join(map(repr, values))}")
    return [_attribute(name, given, m, blend, per) for name, given in values.items()]


def _passes(a: _Attribute) -> list[tuple[int, int]]:
    """(first column, number of columns) of each pass: 1 to 3 floats, or an integer."""
    columns, step = a.values.shape[1], 1 if a.is_integer else 3
    return [(c, min(step, columns - c)) for c in range(0, columns, step)]


def _drawn(m: Mesh, grid: Grid, attributes: list[_Attribute], coverage: str,
           threads: int) -> tuple[np.ndarray, list[np.ndarray], dict[str, int]]:  # fmt: skip
    """The voxels of the surface, and each attribute in them, typed."""
    if not attributes and isinstance(m, ModelMesh) and m.scene.is_more_than_triangles:
        voxels, _, report, _ = m.scene.draw(grid, coverage, [], threads)
        return voxels, [], report
    positions, where = m.positions(grid)
    if not attributes:
        voxels, report = _core.sparse_voxels(positions, m.triangles, where, coverage, threads)
        return voxels, [], report
    voxels = None
    result = []
    for a in attributes:
        parts = []
        for first, n in _passes(a):
            what = (positions, m.triangles, where, coverage, a.values, first)
            how = (a.per_triangle, a.blend, voxels is None, threads)
            if a.is_integer:
                part, listed, report = _core.sparse_integer(*what, *how)
                part = part[:, np.newaxis]
            else:
                part, listed, report = _core.sparse_float(*what, n, *how)
            voxels = listed if voxels is None else voxels
            parts.append(part)
        result.append(a.typed(m, parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)))
    assert voxels is not None
    return voxels, result, report


def _names(values: OwnValues) -> list[str]:
    names = ["color"] if values is None else [values] if isinstance(values, str) else list(values)
    for name in names:
        check_choice("a value that the mesh has by itself", name, OwnValue)
    return [str(n) for n in names]


def _own(mesh: Any, grid: Grid, values: OwnValues, coverage: str,
         threads: int) -> tuple[np.ndarray, dict[str, tuple[np.ndarray, Any]], dict[str, int]]:  # fmt: skip
    """The voxels of the surface, (rows, value of an empty voxel) by name, and the counters."""
    names = _names(values)
    if isinstance(mesh, tuple) or isinstance(mesh, list):
        if isinstance(as_mesh(mesh), DeviceMesh):  # or bad triangles
            raise TypeError("own values are drawn on the CPU: copy the mesh to the host, as with .cpu() or .get()")
    scene = own_scene(mesh, any(name.startswith("color") for name in names), 4)
    voxels, drawn, counts, _ = scene.draw(grid, coverage, names, threads)
    rows = [np.ones(len(voxels), np.bool_) if a is None else a for a, _ in drawn]
    return voxels, {n: (a, empty) for n, a, (_, empty) in zip(names, rows, drawn)}, counts


def _to_caller(mesh: Any) -> Any:
    """Results as the caller's kind of array."""
    from ._mesh import _converter

    first = mesh[0] if isinstance(mesh, list) and mesh else mesh
    return _converter(first[0] if isinstance(first, tuple) and first else None)


def _check_own(blend: Any, per: Any, fill: Any = 0) -> None:
    given = [] if blend is None else [f"blend={blend!r}"]
    given += [] if per is None else [f"per={per!r}"]
    given += [] if fill == 0 else [f"fill={fill!r}"]
    if given:
        raise ValueError(
            f"{' and '.join(given)} without arrays of values, such as values={{'rgb': colors}}: a mesh's own values are blended "
            "as the voxelize tool does"
        )


def _is_own(values: Any) -> bool:
    if values is None or isinstance(values, str):
        return True
    if isinstance(values, Mapping):
        return False
    if isinstance(values, Sequence):
        return True
    raise TypeError(
        f"values is a mapping of arrays by name, such as {{'rgb': colors}}, or names of what the mesh has by itself, such as "
        f"'color', not {type(values).__name__}"
    )


@overload
def bake(
    mesh: TensorMesh,
    grid: Grid,
    values: Mapping[str, Any] | OwnValues = None,
    *,
    blend: BlendLike = None,
    per: Mapping[str, Per] | None = None,
    fill: float = 0,
    coverage: Coverage = "conservative",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> dict[str, Any]: ...


@overload
def bake(
    mesh: MeshLike,
    grid: Grid,
    values: Mapping[str, Any] | OwnValues = None,
    *,
    blend: BlendLike = None,
    per: Mapping[str, Per] | None = None,
    fill: float = 0,
    coverage: Coverage = "conservative",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> dict[str, npt.NDArray[Any]]: ...


def bake(
    mesh: MeshLike,
    grid: Grid,
    values: Mapping[str, Any] | OwnValues = None,
    *,
    blend: BlendLike = None,
    per: Mapping[str, Per] | None = None,
    fill: float = 0,
    coverage: Coverage = "conservative",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> dict[str, Any]:
    """Attributes in a dense grid: for each name an array (nz, ny, nx) or (nz, ny, nx, columns).

    Take sparse() where the grid is large and little of it is surface: it has the same values as a list, in memory and time
    in proportion to the surface. At 512^3 the three floats of a dense array alone are 1.5 GiB.

    Args:
        mesh: what voxelize() takes.
        grid: the Grid.
        values: for each name an array with a row for each vertex, which is interpolated (integers are taken from the
            triangle's first vertex), or for each triangle. Or names of what the mesh has by itself, by default "color":
            the mean colour, of textures, materials and vertices, of a path, a Model, or a mesh of trimesh, PyVista or
            Open3D, uint8 (nz, ny, nx, 4), sRGB and alpha. All of them are those of the voxelize tool, byte for byte
            (voxelize --target): "color", "color-max", "color-replace", "color-outer"; "normal", "material", "triangle",
            "depth", "count", "occupancy".
        blend: what becomes of the fragments of one voxel, for all names or by name: "mean", "sum", "min", "max", or "last",
            that of the highest triangle number. By default floats and uint8 are averaged, other integers "last". Sums of
            floats do not depend on any order: terms are multiples of 2^-32, and one of 2^31 or more is infinite.
        per: by name, "vertex" or "triangle", for a mesh that has as many vertices as triangles.
        fill: the value of voxels without a fragment.
        coverage, threads, status: as in voxelize().

    Returns:
        Arrays by name. Floats give float32; integers keep their type, but for sums (int64) and means (float32; uint8 stays
        uint8, rounded). For torch, which can do next to nothing with unsigned types, uint16 becomes int32, uint32 and uint64
        int64.

    Raises:
        ValueError: values that do not fit the mesh, or a mesh without colours of its own.

    Example:
        >>> color = vp.bake("lighthouse.glb", grid)["color"]
        >>> baked = vp.bake((vertices, triangles), grid, {"rgb": colors, "id": ids}, blend={"id": "max"})
    """
    check_call("bake", grid, coverage, threads, status)
    if _is_own(values):
        _check_own(blend, per, fill)
        _expect_room(grid)
        voxels, own, counts = _own(mesh, grid, values, coverage, threads)  # type: ignore[arg-type]
        take_counts(counts, status)
        to_caller = _to_caller(mesh)
        return {name: to_caller(scattered(voxels, a, grid, empty, threads)) for name, (a, empty) in own.items()}
    assert isinstance(values, Mapping)
    m = as_mesh(mesh)
    attributes = _attributes(m, values, blend, per)
    if isinstance(m, DeviceMesh):
        on_device = {}
        for a in attributes:
            drawn, report = _device.bake(m, grid, coverage, a, fill)
            take_counts(report, status)
            on_device[a.name] = a.typed(m, drawn)
        return on_device
    if not attributes:
        return {}
    fills = [_fill_of(a, fill) for a in attributes]
    _expect_room(grid)
    voxels, rows, report = _drawn(m, grid, attributes, coverage, threads)
    take_counts(report, status)
    return {
        a.name: m.to_caller(scattered(voxels, row, grid, of_type, threads)) for a, row, of_type in zip(attributes, rows, fills)
    }


def _expect_room(grid: Grid) -> None:
    """Raises MemoryError, which names the size, for a grid that cannot be held, before anything is drawn."""
    np.empty(grid.shape, np.uint8)


def _fill_of(a: _Attribute, fill: Any) -> Any:
    """The fill as it becomes the attribute's type. Raises TypeError or ValueError for one that the type does not hold."""
    if isinstance(fill, bool) or not isinstance(fill, Real):
        raise TypeError(f"fill is a number, not {type(fill).__name__}")
    if a.dtype.kind not in "iu":
        return np.float32(fill)
    holds = np.iinfo(a.dtype)
    whole = math.isfinite(fill) and int(fill) == fill
    if not whole or not holds.min <= int(fill) <= holds.max:
        raise ValueError(f"fill is a whole number from {holds.min} to {holds.max} for {a.name!r}, which is {a.dtype}, not {fill!r}")
    return a.dtype.type(int(fill))


@overload
def sparse(
    mesh: TensorMesh,
    grid: Grid,
    values: Mapping[str, Any] | OwnValues = None,
    *,
    blend: BlendLike = None,
    per: Mapping[str, Per] | None = None,
    fill: float = 0,
    coverage: Coverage = "conservative",
    solid: Fill | None = None,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> tuple[Any, dict[str, Any]]: ...


@overload
def sparse(
    mesh: MeshLike,
    grid: Grid,
    values: Mapping[str, Any] | OwnValues = None,
    *,
    blend: BlendLike = None,
    per: Mapping[str, Per] | None = None,
    fill: float = 0,
    coverage: Coverage = "conservative",
    solid: Fill | None = None,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> tuple[VoxelList, dict[str, npt.NDArray[Any]]]: ...


def sparse(
    mesh: MeshLike,
    grid: Grid,
    values: Mapping[str, Any] | OwnValues = None,
    *,
    blend: BlendLike = None,
    per: Mapping[str, Per] | None = None,
    fill: float = 0,
    coverage: Coverage = "conservative",
    solid: Fill | None = None,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> tuple[Any, dict[str, Any]]:
    """The voxels of a surface or of a solid as a list, and their attributes: memory in proportion to them, for grids of up
    to 2^20 voxels an axis.

    Args:
        mesh, grid, values, blend, per, coverage, threads, status: as in bake(), but that without values there are the
            voxels alone: the mesh's own colours are "color".
        solid: a fill rule, as `fill` of solid(): the voxels of the solid in place of those of the surface.
        extent, repair, bodies: of the solid, as in solid(). The default extent is "outer", as there.
        fill: the value of voxels of a solid that no triangle touches.

    Returns:
        Voxels and attributes. The voxels are a VoxelList (n, 3) int32 with columns x, y, z, in Morton order. The
        attributes are, for each name, n values or (n, columns), as bake() has them in these voxels. Arrays are indexed
        [z, y, x] by `array[grid.zyx(voxels)]`; dense() makes an array of the list.

    Example:
        >>> voxels, attributes = vp.sparse(mesh, grid, {"rgb": colors})
        >>> centres = grid.to_xyz(voxels)
        >>> inside, _ = vp.sparse(mesh, grid, solid="nonzero")
    """
    check_call("sparse", grid, coverage, threads, status)
    if solid is not None:
        check_choice("solid", solid, Fill)
    if values is not None and _is_own(values):
        _check_own(blend, per, fill)
        only = mesh[0] if isinstance(mesh, list) and len(mesh) == 1 else mesh
        if solid is not None and isinstance(only, (str, os.PathLike)):  # its colours and its solid by one reading
            mesh = Model(os.fspath(only), read_scene(os.fspath(only), False, 2))
        listed, own, counts = _own(mesh, grid, values, coverage, threads)  # type: ignore[arg-type]
        to_caller = _to_caller(mesh)
        rows = {n: a for n, (a, _) in own.items()}
        background = {n: empty for n, (_, empty) in own.items()}
        if solid is None:
            take_counts(counts, status)
            voxels = to_caller(listed) if is_torch(to_caller(listed[:0])) else listed.view(VoxelList)
            return voxels, {n: to_caller(a) for n, a in rows.items()}
        m = as_mesh(mesh)
        assert isinstance(m, Mesh)
    else:
        m = as_mesh(mesh)
        attributes = _attributes(m, values or {}, blend, per)  # type: ignore[arg-type]
        if isinstance(m, DeviceMesh):
            if solid is not None:
                raise TypeError("solids as lists are drawn on the CPU: copy the mesh to the host, as with .cpu() or .get()")
            on_device, report = _device.sparse_voxels(m, grid, coverage)
            take_counts(report, status)
            return on_device, {a.name: a.typed(m, _device.sparse(m, grid, coverage, a)) for a in attributes}
        if solid is None or attributes:
            listed, typed, counts = _drawn(m, grid, attributes, coverage, threads)
            rows = {a.name: row for a, row in zip(attributes, typed)}
            background = {a.name: _fill_of(a, fill) for a in attributes}
        else:
            rows, background, listed = {}, {}, np.zeros((0, 3), np.int32)
        if solid is None:
            take_counts(counts, status)
            return listed_for(m, listed), {n: m.to_caller(a) for n, a in rows.items()}
    inside, _, counts = solid_voxels(m, grid, (solid, extent, repair, bodies, None, 0), False, threads)
    take_counts(counts, status)
    filled = {n: _placed(grid, listed, a, inside, background[n]) for n, a in rows.items()}
    return listed_for(m, inside), {n: m.to_caller(a) for n, a in filled.items()}


def _placed(grid: Grid, from_voxels: np.ndarray, rows: np.ndarray, to_voxels: np.ndarray, fill: Any) -> np.ndarray:
    """Values of voxels in another list, `fill` where that has others."""
    keys, wanted = grid.index(from_voxels), grid.index(to_voxels)
    order = np.argsort(keys)
    at = np.searchsorted(keys, wanted, sorter=order)
    at[at == len(keys)] = 0
    result = np.full((len(wanted), *rows.shape[1:]), fill, rows.dtype)
    if len(keys):
        found = keys[order[at]] == wanted
        result[found] = rows[order[at[found]]]
    return result
