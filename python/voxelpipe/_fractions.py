# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import warnings
from typing import Any, Callable, Dict, Literal, NamedTuple, Sequence, Tuple, overload

import numpy as np

from . import _core, _device_fields
from ._core import Grid
from ._device import DeviceMesh
from ._distance import host_mesh, mesh_of_triangles
from ._mesh import Mesh
from ._solid import OpenMeshWarning
from ._surface import listed_for, take_counts
from ._types import (
    Bodies,
    CellValue,
    HoleRepair,
    ListedCellValue,
    MeshLike,
    check_call,
    check_choice,
    whole_number,
)

_APERTURES = ("aperture_x", "aperture_y", "aperture_z")
_FACE_CENTROIDS = ("face_centroid_x", "face_centroid_y", "face_centroid_z")
# What is measured within a voxel, in the order of the call: the type and the shape of a voxel's values.
_WITHIN: dict[str, tuple[Any, tuple[int, ...]]] = {
    "centroid": (np.float32, (3,)),
    "area": (np.float64, ()),
    "area_centroid": (np.float32, (3,)),
    "multi_cut": (np.bool_, ()),
}


def _checked(call: str, grid: Any, of: Any, names: Any, bodies: Any, repair: Any, max_hole_edges: Any,
             threads: Any, status: Any) -> list[Any]:  # fmt: skip
    """The names of `of`, each of which is one of a Literal. Raises ValueError or TypeError that names the argument."""
    check_call(call, grid, "conservative", threads, status)
    check_choice("bodies", bodies, Bodies)
    check_choice("repair", repair, HoleRepair)
    if max_hole_edges is not None:
        whole_number("max_hole_edges", max_hole_edges)
    wanted = [of] if isinstance(of, str) else list(of)
    for name in wanted:
        check_choice("of", name, names)
    if not wanted:
        raise ValueError("of names nothing to measure")
    return wanted


def _parts(m: Any, bodies: str) -> list[tuple[int, int]]:
    """First triangle and the one after the last of every body that has fractions of its own."""
    firsts = list(m.first_triangles) if bodies == "each" else [0]
    return list(zip(firsts, firsts[1:] + [len(m.triangles)]))


def _warn_if_open(counts: dict[str, int], rows: int) -> None:
    if counts["open_rows"]:
        warnings.warn(
            f"the mesh is not closed: {counts['open_rows']} of {rows} rows of voxels do not balance, and the fractions "
            f"behind a hole are in doubt ({counts['open_edges']} open edges)",
            OpenMeshWarning,
            stacklevel=3,
        )


# Fills arrays by rows along an axis, of the triangles of one body; gives the counters. The arrays: fractions, then None where
# nobody asked: apertures along the axis, area vectors, centroids of faces, and what _WITHIN names.
_Measure = Callable[[Tuple[int, int], int, Sequence[Any]], Dict[str, int]]


def _measure(m: Mesh, grid: Grid, options: Sequence[Any], threads: int) -> _Measure:
    positions, where = m.positions(grid)

    def measure(part: tuple[int, int], axis: int, arrays: Sequence[Any]) -> dict[str, int]:
        return _core.fractions(positions, m.triangles[part[0] : part[1]], where, axis, *arrays, *options, threads)

    return measure


def _measure_there(m: DeviceMesh, grid: Grid, options: Sequence[Any]) -> _Measure:
    return lambda part, axis, arrays: _device_fields.fractions(m, part, grid, axis, arrays, options)


@overload
def fractions(
    mesh: MeshLike,
    grid: Grid,
    *,
    of: CellValue = "fraction",
    bodies: Bodies = "all",
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any: ...


@overload
def fractions(
    mesh: MeshLike,
    grid: Grid,
    *,
    of: Sequence[CellValue],
    bodies: Bodies = "all",
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> dict[str, Any]: ...


def fractions(
    mesh: MeshLike,
    grid: Grid,
    *,
    of: CellValue | Sequence[CellValue] = "fraction",
    bodies: Bodies = "all",
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """How much of every voxel is inside: float32, (nz, ny, nx), the mean of the winding number over the voxel.

    For a closed mesh whose triangles face outward and whose parts do not overlap this is the volume inside, 0 to 1. Parts
    that overlap add up, and parts that are inside out count negative: the values are neither clamped nor snapped. A voxel
    that no triangle touches has its whole number exactly; a cut one is off by 2.9 * 2^-44 at most for each triangle in it,
    before it is rounded to float32.

    Args:
        mesh, grid: as in voxelize(). The meshes of a list, and the parts of a model, are bodies.
        of: what is measured, one name for an array or a list of names for a dict of arrays:
            "fraction": float32, (nz, ny, nx).
            "aperture_x", "aperture_y", "aperture_z": float64, how much of every face between two voxels along the axis is
            inside, with the grid's own two faces: (nz, ny, nx + 1), (nz, ny + 1, nx) and (nz + 1, ny, nx).
            "face_centroid_x", "face_centroid_y", "face_centroid_z": float32, the centroids (x, y, z) of these faces' parts
            inside, from the face's centre in voxels, -0.5 to 0.5, and 0 along the axis: the apertures' shapes with 3 more.
            0 where the aperture is less than 2^-20, or overlapping parts put it out of the face.
            "area_vector": float64, (nz, ny, nx, 3), the sum of the vectors (x, y, z) of the mesh's area within the voxel,
            outward, in world units. For voxels of size 1 it is the difference of the voxel's two apertures along each axis,
            to the last bit; area between two voxels is the lower one's.
            "centroid": float32, (nz, ny, nx, 3), the centroid (x, y, z) of the part inside, from the voxel's centre in
            voxels, -0.5 to 0.5. 0 where the fraction is less than 2^-20, or overlapping parts put it out of the voxel.
            "area", "area_centroid": float64, (nz, ny, nx), the area of all triangles' parts in the voxel in squared units
            of the world, and float32, (nz, ny, nx, 3), its centroid, given as that of the part inside.
            "multi_cut": bool, (nz, ny, nx), where more than one sheet of the surface cuts the voxel: triangles are of one
            sheet where edges join them that meet the voxel.
        bodies: "all", the sum over all bodies; "each", arrays with one more axis in front, (n, nz, ny, nx), of every body by
            itself, for materials that share a voxel.
        repair, max_hole_edges: "close_holes" puts a cone over the boundary of each hole of each body, as in solid(); holes
            with more edges stay open. Cones are triangles of the mesh then, which cut voxels and have areas.
        threads: 0 takes all cores. The result is the same for any number.
        status: a dict that is filled with the call's counters, those of rows along x, with "each" their sums over the
            bodies: cut_voxels that a triangle's inside reaches; below_zero and above_one, voxels that are below 0 or above 1
            by more than 2^-24; open_edges without an opposite edge; open_rows, rows of voxels along every axis that was
            asked for whose triangles do not balance; lost_centroids, voxels that have their centre instead; and with
            "close_holes" hole_edges, holes and the cones that close them, after which open_edges are those that are left.

    Returns the values; a mesh of torch's tensors gives tensors, and one in a GPU's memory is measured there, with the same
    bits. Warns with OpenMeshWarning where rows prove that the mesh is not closed. Raises IndexError for a triangle that
    names a vertex that does not exist, ValueError for a name of `of` that there is not.

    Example:
        >>> part = vp.fractions(mesh, grid)
        >>> volume = part.sum(dtype=np.float64) * np.prod(grid.voxel_size)
        >>> cells = vp.fractions(mesh, grid, of=("fraction", "aperture_x", "area_vector"))
        >>> area = np.linalg.norm(cells["area_vector"], axis=-1)  # of one plane a voxel
    """
    wanted = _checked("fractions", grid, of, CellValue, bodies, repair, max_hole_edges, threads, status)
    m = mesh_of_triangles(mesh, "fractions")
    parts = _parts(m, bodies)
    has_areas = "area_vector" in wanted
    # Rows along x come last: the fractions and the counters are theirs.
    axes = [a for a in (2, 1) if has_areas or _APERTURES[a] in wanted or _FACE_CENTROIDS[a] in wanted] + [0]
    out: dict[str, Any] = {"fraction": m.empty((len(parts), *grid.shape), np.float32)}
    if has_areas:
        out["area_vector"] = m.zeros((len(parts), *grid.shape, 3), np.float64)
    for axis, (faces, middles) in enumerate(zip(_APERTURES, _FACE_CENTROIDS)):
        shape = list(grid.shape)
        shape[2 - axis] += 1
        if faces in wanted:
            out[faces] = m.zeros((len(parts), *shape), np.float64)
        if middles in wanted:
            out[middles] = m.zeros((len(parts), *shape, 3), np.float32)
    for part, (scalar, tail) in _WITHIN.items():
        if part in wanted:
            out[part] = m.zeros((len(parts), *grid.shape, *tail), scalar)
    options = (repair == "close_holes", max_hole_edges)
    measure = _measure_there(m, grid, options) if isinstance(m, DeviceMesh) else _measure(m, grid, options, threads)
    counts: dict[str, int] = {}
    open_rows = rows = 0
    for body, triangles in enumerate(parts):
        for axis in axes:
            names = ["fraction", _APERTURES[axis], "area_vector", _FACE_CENTROIDS[axis]]
            names += list(_WITHIN) if axis == 0 else [""] * len(_WITHIN)
            of_body = measure(triangles, axis, [out[name][body] if name in out else None for name in names])
            open_rows += of_body["open_rows"]
            rows += int(np.prod(grid.shape)) // max(grid.shape[2 - axis], 1)
        counts = {name: counts.get(name, 0) + count for name, count in of_body.items()}
    counts["open_rows"] = open_rows
    take_counts(counts, status)
    _warn_if_open(counts, rows)
    results = {name: m.to_caller(out[name] if bodies == "each" else out[name][0]) for name in wanted}
    return results[of] if isinstance(of, str) else results


class SparseFractions(NamedTuple):
    """How much of each voxel is inside, as lists: memory in proportion to the surface. All other voxels are outside."""

    voxels: Any
    """(n, 3) int32, a VoxelList: x, y, z of each voxel that is cut or inside and in no cube, in Morton order"""
    values: dict[str, Any]
    """by name a row for each of them, with the types that fractions() has: "fraction" is float32, (n,)"""
    cubes: Any
    """(m, 4) int32: the first voxel x, y, z of a cube of voxels that have all values in common, and its side in voxels, 8,
    16, 32 and so on: what no triangle touches within closed meshes"""
    cube_values: dict[str, Any]
    """by name a row for each cube"""


@overload
def sparse_fractions(
    mesh: MeshLike,
    grid: Grid,
    *,
    of: ListedCellValue | Sequence[ListedCellValue] = "fraction",
    bodies: Literal["all"] = "all",
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> SparseFractions: ...


@overload
def sparse_fractions(
    mesh: MeshLike,
    grid: Grid,
    *,
    of: ListedCellValue | Sequence[ListedCellValue] = "fraction",
    bodies: Literal["each"],
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> list[SparseFractions]: ...


def sparse_fractions(
    mesh: MeshLike,
    grid: Grid,
    *,
    of: ListedCellValue | Sequence[ListedCellValue] = "fraction",
    bodies: Bodies = "all",
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> SparseFractions | list[SparseFractions]:
    """How much of every voxel is inside, as voxels and cubes of voxels: the values of fractions(), bit for bit, in memory
    and time in proportion to the surface, for grids of up to 2^20 voxels an axis.

    Args:
        mesh, grid: as in voxelize(). The meshes of a list, and the parts of a model, are bodies.
        of: what is listed, one name or a list of names of fractions(): "fraction", "centroid", "area", "area_centroid",
            "multi_cut". Faces and area vectors are those of dense grids alone.
        bodies: "all", the sum over all bodies; "each", a result for every body by itself, in their order.
        repair, max_hole_edges, threads, status: as in fractions().

    Returns:
        SparseFractions(voxels, values, cubes, cube_values), with "each" a list of them. A voxel is listed, or lies in a
        cube, if a triangle cuts it or its fraction is not 0. A mesh of torch's tensors gives tensors.

    Warns and raises as fractions() does. Raises MemoryError where the lists do not fit, TypeError for a mesh in a GPU's
    memory.

    Example:
        >>> grid = vp.fit(mesh, 4096)
        >>> cells = vp.sparse_fractions(mesh, grid, of=("fraction", "area"))
        >>> inside = cells.values["fraction"].sum(dtype=np.float64)  # in voxels
        >>> inside += (cells.cube_values["fraction"] * cells.cubes[:, 3].astype(np.float64) ** 3).sum()
    """
    wanted = _checked(
        "sparse_fractions", grid, of, ListedCellValue, bodies, repair, max_hole_edges, threads, status
    )
    m = host_mesh(mesh, "sparse fractions")
    positions, where = m.positions(grid)
    counts: dict[str, int] = {}
    results = []
    for first, end in _parts(m, bodies):
        voxels, values, cubes, cube_values, of_body = _core.sparse_fractions(
            positions, m.triangles[first:end], where, wanted, repair == "close_holes", max_hole_edges, threads
        )
        for rows in (values, cube_values):
            for name in wanted:
                rows[name] = m.to_caller(rows[name].view(np.bool_) if name == "multi_cut" else rows[name])
        results.append(
            SparseFractions(
                listed_for(m, voxels),
                {name: values[name] for name in wanted},
                m.to_caller(cubes),
                {name: cube_values[name] for name in wanted},
            )
        )
        counts = {name: counts.get(name, 0) + count for name, count in of_body.items()}
    take_counts(counts, status)
    _warn_if_open(counts, len(results) * grid.shape[0] * grid.shape[1])
    return results if bodies == "each" else results[0]


class FractionLists(NamedTuple):
    """How much of each voxel every body has: lists by voxel. Entries of voxels[i] are [offsets[i], offsets[i + 1]) of
    `bodies` and `fractions`, by ascending body."""

    voxels: Any
    """(n, 3) int32, a VoxelList: x, y, z of each voxel that a body cuts or has inside, z-major order"""
    offsets: Any
    """(n + 1,) int64"""
    bodies: Any
    """(m,) int32: numbers of the bodies, in the order of the list of meshes or of the model's parts"""
    fractions: Any
    """(m,) float32: how much of the voxel is inside that body, 0 where a side alone lies in the voxel's upper faces"""


def fraction_lists(
    mesh: MeshLike,
    grid: Grid,
    *,
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> FractionLists:
    """Which bodies share each voxel, and how much of it every one has: the values of fractions(bodies="each"), bit for bit,
    in memory in proportion to what the bodies fill, whatever their number. For materials given by percentages.

    Args:
        mesh, grid: as in voxelize(). The meshes of a list, and the parts of a model, are bodies.
        repair, max_hole_edges, threads: as in fractions(); holes are those of each body.
        status: as in fractions(), of one call for all bodies: `voxels` are those that are listed, `fragments` the entries.

    Returns:
        FractionLists, whose arrays are tensors for a mesh of tensors.

    Warns and raises as fractions() does. Raises MemoryError where the lists do not fit, TypeError for a mesh in a GPU's
    memory.

    Example:
        >>> lists = vp.fraction_lists([hull, engine, cargo], grid)
        >>> mixed = np.diff(lists.offsets) > 1  # voxels that bodies share
        >>> parts = np.split(lists.fractions, lists.offsets[1:-1])  # of every voxel
        >>> volumes = np.bincount(lists.bodies, lists.fractions) * np.prod(grid.voxel_size)
    """
    _checked("fraction_lists", grid, "fraction", CellValue, "each", repair, max_hole_edges, threads, status)
    m = host_mesh(mesh, "fraction lists")
    positions, where = m.positions(grid)
    voxels, offsets, bodies, fractions_of, counts = _core.fraction_lists(
        positions, m.triangles, list(m.first_triangles), where, repair == "close_holes", max_hole_edges, threads
    )
    take_counts(counts, status)
    _warn_if_open(counts, len(m.first_triangles) * grid.shape[0] * grid.shape[1])
    rows = (offsets, bodies.view(np.int32), fractions_of)
    return FractionLists(listed_for(m, voxels), *(m.to_caller(a) for a in rows))
