# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, Mapping

import numpy as np

from . import _core, _device_fields
from ._arrays import is_on_device, to_numpy
from ._axes import as_voxels
from ._bake import _attributes, _Attribute
from ._core import Grid
from ._device import DeviceMesh
from ._distance import _warn_of_holes, mesh_of_triangles
from ._solid import refuse_grid_within
from ._surface import take_counts
from ._types import (
    Bodies,
    Border,
    Fill,
    MeshLike,
    Per,
    Place,
    Repair,
    check_call,
    check_choice,
    check_solid_numbers,
    real_number,
    whole_number,
)


def _check_numbers(level: float, min_component: int) -> None:
    real_number("level", level)
    whole_number("min_component", min_component, 0, "a number of vertices, 0 or more")


def _faces_for(m: Any, faces: Any) -> Any:
    if isinstance(m, DeviceMesh):
        return faces
    made = m.to_caller(faces)
    return made if isinstance(made, np.ndarray) else m.to_caller(faces.astype(np.int64))


_MOST = (16, 4)  # columns of floats and of integers that one run takes


def _runs(attributes: list[_Attribute]) -> list[list[tuple[int, int]]]:
    """(attribute, column) of the columns of each run."""
    runs: list[list[tuple[int, int]]] = [[]]
    left = list(_MOST)
    for i, a in enumerate(attributes):
        for c in range(a.values.shape[1]):
            if left[a.is_integer] == 0:
                runs.append([])
                left = list(_MOST)
            left[a.is_integer] -= 1
            runs[-1].append((i, c))
    return runs


def _columns(m: Any, attributes: list[_Attribute], run: list[tuple[int, int]]) -> tuple[list[Any], list[tuple[int, int]]]:
    """What _core.remesh takes: floats of vertices and of triangles, integers of both; and the columns in that order."""
    arrays, order = [], []
    for is_integer in (False, True):
        for per_triangle in (False, True):
            chosen = [(i, c) for i, c in run if (attributes[i].is_integer, attributes[i].per_triangle) == (is_integer, per_triangle)]
            rows = len(m.triangles) if per_triangle else len(m.vertices)
            values = m.empty((rows, len(chosen)), np.int64 if is_integer else np.float32)
            for k, (i, c) in enumerate(chosen):
                values[:, k] = attributes[i].values[:, c]
            arrays.append(values)
            order += chosen
    return arrays, order


def remesh(
    mesh: MeshLike,
    grid: Grid,
    sign: Fill = "nonzero",
    *,
    repair: Repair = "none",
    closing: int = 0,
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    place: Place = "sharp",
    level: float = 0.0,
    corners: bool = False,
    border: Border = "closed",
    quads: bool = False,
    min_component: int = 0,
    embedded: bool = False,
    attributes: Mapping[str, Any] | None = None,
    per: Mapping[str, Per] | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """A closed manifold mesh around what lies inside of any triangles: every edge has two faces, every vertex one fan.

    Args:
        mesh, grid: as in voxelize(). Samples are the centres of voxels, unless `corners` is given.
        sign: what is inside, as `fill` of solid(): "nonzero", "even_odd" or "positive".
        repair, closing, bodies, max_hole_edges: as in solid(), for meshes that are not closed.
        place: where vertices lie: "sharp" where the mesh's planes meet, which keeps creases and corners; "mean" at the mean
            of a cell's crossings; "corner" at the corners of voxels.
        level: the signed distance at which the surface lies, in the mesh's units. Above 0 bodies grow, and a sheet becomes
            a closed plate of twice the level.
        corners: samples at the corners of the voxels, one more along each axis, as in distance().
        border: "closed": what lies beyond the grid's samples is outside; "open": faces that reach there are left out.
        quads: (m, 4) in place of (m, 3).
        min_component: components of fewer vertices are left out.
        embedded: triangles that intersect each other are looked for, and their vertices moved to the mean of their cell's
            crossings, until no two intersect or all that do are there; `intersecting_pairs` counts what is left.
        attributes: for each name an array with a row for each vertex, which is interpolated (integers are taken from the
            triangle's first vertex), or for each triangle. A vertex of the result gets the mean of the mesh's floats and
            uint8 where the mesh crosses the edges of its cell, and the integer that most of these places have, of several
            the least; where the mesh crosses none, and at a level, the value of the nearest triangle at its closest point.
            Each 16 columns of floats or 4 of integers beyond the first take another run. Textures of models are none of
            these: `voxelize --remesh` takes them.
        per: by name, "vertex" or "triangle", for a mesh that has as many vertices as triangles.
        threads: 0 takes all cores. The result is the same for any number.
        status: a dict that is filled with the call's counters: those of solid(), components, made_crossings (edges that the
            mesh does not cross, crossed in their middle: 0 for a closed mesh), cone_crossings, nearest_values (vertices with
            the attributes of the nearest triangle), embed_rounds, moved_vertices and intersecting_pairs among them.

    Returns vertices, float64 (n, 3), in world units; faces, uint32 (m, 3), int64 for torch, counter-clockwise seen from
    outside; and a dict with `cell` (n, 3), the index (x, y, z) of the lowest sample of each vertex's cell, `sheet` (n), and
    `source` (n), a triangle that it comes from, -1 for none; and the attributes by name, (n) or (n, columns), of the type
    that bake() gives. A mesh in a GPU's memory is remeshed there, with the same bits. Warns with OpenMeshWarning where rows
    of samples prove that the mesh is not closed. Raises ValueError for a level that is not finite, IndexError for a triangle
    that names a vertex that does not exist.

    Example:
        >>> vertices, faces, more = vp.remesh(mesh, grid, repair="close_holes")
        >>> colored = vp.remesh(mesh, grid, attributes={"rgb": colors})[2]["rgb"]
    """
    check_call("remesh", grid, "conservative", threads, status)
    for what, value, choices in (
        ("sign", sign, Fill),
        ("repair", repair, Repair),
        ("bodies", bodies, Bodies),
        ("place", place, Place),
        ("border", border, Border),
    ):
        check_choice(what, value, choices)
    _check_numbers(level, min_component)
    check_solid_numbers(max_hole_edges, closing)
    m = mesh_of_triangles(mesh, "remeshes")
    taken = [name for name in attributes or {} if name in ("cell", "sheet", "source")]
    if taken:
        raise ValueError(f"{taken[0]!r} is a result of remesh() by itself; give the attribute another name")
    given = _attributes(m, attributes or {}, None, per)
    corners = bool(corners)
    inside = (sign, repair, bodies, max_hole_edges, closing, place, float(level))
    shape = (border == "open", bool(quads), min_component, bool(embedded))
    columns: dict[tuple[int, int], Any] = {}
    made: Any = None
    for run in _runs(given):
        arrays, order = _columns(m, given, run)
        if isinstance(m, DeviceMesh):
            surface, floats, integers = _device_fields.remesh(m, grid, corners, inside + shape, arrays)
        else:
            positions, where = m.positions(grid)
            world = _core.at_corners(grid) if corners else grid
            surface, floats, integers = _core.remesh(
                positions, m.triangles, list(m.first_triangles), where, world, *inside, corners, *shape, *arrays, threads
            )
        made = surface if made is None else made
        num_floats = arrays[0].shape[1] + arrays[1].shape[1]
        for k, column in enumerate(order):
            columns[column] = floats[:, k] if k < num_floats else integers[:, k - num_floats]
    vertices, faces, cell, sheet, source, counts = made
    if not len(faces):
        refuse_grid_within(m, grid, repair, bodies, closing, threads)
    take_counts(counts, status)
    rows = (grid.shape[0] + corners) * (grid.shape[1] + corners)
    _warn_of_holes(counts, f" of {rows} rows of samples", repair)
    if len(source) != len(vertices):
        source = np.full(len(vertices), -1, np.int64)
    more = {"cell": cell, "sheet": sheet, "source": source}
    for i, a in enumerate(given):
        more[a.name] = a.typed(m, m.columns([columns[i, c] for c in range(a.values.shape[1])]))
    return m.to_caller(vertices), _faces_for(m, faces), {k: m.to_caller(v) for k, v in more.items()}


def _as_cubes(cubes: Any) -> np.ndarray:
    """Those of tiles() as int32 (m, 4): the first voxel and the side."""
    a = to_numpy(cubes, "cubes")
    if a.dtype.kind not in "iu":
        raise TypeError(f"cubes are integers (m, 4), as tiles() gives them, not {a.dtype}")
    if a.ndim != 2 or a.shape[1] != 4:
        raise ValueError(f"cubes are an array (m, 4), not {a.shape}")
    wide = (a < -(2**31)) | (a >= 2**31)
    if wide.any():
        raise IndexError(f"cube {int(np.argmax(wide.any(axis=1)))} leaves the grid")
    return np.ascontiguousarray(a, np.int32)


def _as_field(array: np.ndarray, level: float) -> tuple[np.ndarray, float]:
    """The field in float32, and its level. Of doubles the level is taken away first, so that what lies below it stays so."""
    if array.dtype.itemsize <= 4:
        return np.ascontiguousarray(array, np.float32), level
    with np.errstate(over="ignore", invalid="ignore"):
        above = array.astype(np.float64, copy=False) - level
        field = np.ascontiguousarray(above, np.float32)
    lost = (above < 0) & (field == 0)
    if lost.any():
        field[lost] = -np.finfo(np.float32).tiny
    return field, 0.0


def _kind_of(dtype: np.dtype, ndim: int, is_pair: bool, level: float) -> str:
    """"lists of voxels", "bool values" or "floats". Raises ValueError for a level of what has none, TypeError for others."""
    if is_pair or (ndim == 2 and dtype.kind in "iu"):
        kind = "lists of voxels"
    elif dtype == np.bool_:
        kind = "bool values"
    elif dtype.kind == "f":
        return "floats"
    else:
        raise TypeError(f"values are bool, which voxels are inside, floats, or lists of voxels (n, 3), not {dtype}")
    if level != 0:
        raise ValueError(f"{kind} have no level")
    return kind


def extract(
    values: Any,
    grid: Grid,
    *,
    place: Place = "mean",
    level: float = 0.0,
    corners: bool = False,
    border: Border = "closed",
    quads: bool = False,
    min_component: int = 0,
    embedded: bool = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """A closed manifold mesh of voxels, or of a field at a level.

    Args:
        values: bool (nz, ny, nx): the voxels that are inside. Or floats, such as those of distance(): what is below
            `level` is inside; NaN is outside. Or lists of what is inside, whose memory is that of the surface: voxels (n, 3),
            as a VoxelList, the result of sparse() or that of tiles(). Dense arrays in a GPU's memory stay there; lists are of
            the host.
        grid: the grid of the values; a value lies at the centre of its voxel, unless `corners` is given.
        place: where vertices lie in their cells: "mean" at the mean of the cell's crossings, "corner" at the corners of
            voxels. "sharp" has no planes here, and is "mean".
        level: of floats.
        corners: values lie at the corners of the grid's voxels, (nz + 1, ny + 1, nx + 1), as those of distance(corners=True).
        border: "closed": what lies beyond the grid is outside; "open": faces that reach there are left out.
        quads, min_component, embedded, threads, status: as in remesh().

    Returns vertices, faces and a dict as remesh() does, with a `source` of -1. Raises ValueError for values of another
    shape than the grid and for a voxel that is listed twice, IndexError for one outside of the grid, TypeError for values
    that are neither bool, floats nor lists.

    Example:
        >>> vertices, faces, more = vp.extract(vp.solid(mesh, grid), grid, place="corner")
    """
    check_call("extract", grid, "conservative", threads, status)
    check_choice("place", place, Place)
    check_choice("border", border, Border)
    _check_numbers(level, min_component)
    is_pair = isinstance(values, tuple) and len(values) == 2
    first = values[0] if is_pair else values
    options = (border == "open", bool(quads), min_component, bool(embedded))
    if is_on_device(first):
        there, dtype = _device_fields.taken(first, "the array")
        if _kind_of(dtype, there.ndim, is_pair, level) == "lists of voxels":
            raise TypeError("lists of voxels are extracted on the CPU: copy them to the host, as with .cpu() or .get()")
        made = _device_fields.extract(there, grid, bool(corners), place, float(level), options)
    else:
        if corners:
            grid = _core.at_corners(grid)
        array = np.asarray(first)
        kind = _kind_of(array.dtype, array.ndim, is_pair, level)
        if kind == "lists of voxels":
            cubes = np.empty((0, 4), np.int32)
            if is_pair and not isinstance(values[1], Mapping):
                cubes = _as_cubes(values[1])
            made = _core.extract_list(as_voxels(array), cubes, grid, place, *options, threads)
        elif kind == "bool values":
            inside = np.ascontiguousarray(array).view(np.uint8)
            made = _core.extract_bits(inside, grid, place, *options, threads)
        else:
            field, level = _as_field(array, float(level))
            made = _core.extract_field(field, grid, place, level, *options, threads)
    vertices, faces, cell, sheet, source, counts = made
    take_counts(counts, status)
    if len(source) != len(vertices):
        source = np.full(len(vertices), -1, np.int64)
    return vertices, faces, {"cell": cell, "sheet": sheet, "source": source}
