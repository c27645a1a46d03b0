# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math
import warnings
from numbers import Real
from typing import Any, Literal

import numpy as np

from . import _core, _device_fields
from ._core import Grid
from ._device import DeviceMesh
from ._fit import fit
from ._mesh import Mesh, ModelMesh, as_mesh
from ._solid import OpenMeshWarning, refuse_grid_within
from ._surface import take_counts
from ._types import (
    Bodies,
    MeshLike,
    Repair,
    Sign,
    check_call,
    check_choice,
    check_grid,
    check_solid_numbers,
    check_status,
    check_threads,
)


def mesh_of_triangles(mesh: MeshLike, what: str) -> Mesh | DeviceMesh:
    """Raises ValueError for a model of points or lines. `what`: the results, for messages."""
    m = as_mesh(mesh)
    if isinstance(m, ModelMesh) and not len(m.triangles) and len(m.scene.lines):
        raise ValueError(f"a model of points or lines has no triangles, which {what} are of")
    return m


def host_mesh(mesh: MeshLike, what: str) -> Mesh:
    """Raises TypeError for a mesh in a GPU's memory besides."""
    m = mesh_of_triangles(mesh, what)
    if isinstance(m, DeviceMesh):
        raise TypeError(f"{what} are computed on the CPU: copy the mesh to the host, as with .cpu() or .get()")
    return m


def _warn_of_holes(counts: dict[str, int], rows: str, repair: str) -> None:
    if counts["open_rows"] and repair in ("none", "close_holes", "winding"):
        warnings.warn(
            f"the mesh is not closed: {counts['open_rows']}{rows} do not balance, and the sign behind a hole is in doubt; "
            'repair="close_holes", "winding", "exterior" or "vote" may help, or sign="unsigned"',
            OpenMeshWarning,
            stacklevel=3,
        )


def distance(
    mesh: MeshLike,
    grid: Grid,
    band: float | Literal["whole"] = 3,
    sign: Sign = "nonzero",
    *,
    repair: Repair = "none",
    closing: int = 0,
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    corners: bool = False,
    nearest: bool = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """The distance of every sample from the nearest triangle: float32, (nz, ny, nx), in the mesh's units.

    It is exact: the float nearest to the distance from the snapped triangles, but for a share of 2^-25 of its last place.
    It is a distance to the mesh: where parts overlap, walls inside their union count.

    Args:
        mesh, grid: as in voxelize().
        band: samples further away than this many voxels (of the largest side) hold that distance, with their sign; "whole":
            every sample holds its own, and a mesh without triangles gives infinity.
        sign: what is inside and negative, as `fill` of solid(): "nonzero", "even_odd" or "positive"; "unsigned": nothing is.
        repair, closing, bodies, max_hole_edges: as in solid(), for the sign; not with "unsigned". Distances are those of the
            mesh as it is. With "vote" and "exterior" a sample has the side on which it lies, also in a voxel that the surface
            touches, which is part of such solids.
        corners: samples at the corners of the voxels, one more along each axis, in place of their centres: sample [k, j, i]
            lies at origin + (i, j, k) * voxel_size.
        nearest: also returns the number of the nearest triangle, int64, of those with the same distance the first; of a list
            of meshes they are numbered through. -1 beyond the band.
        threads: 0 takes all cores. The result is the same for any number.
        status: a dict that is filled with the call's counters, band_samples and those of solid() among them.

    Returns the distances, or (distances, nearest). A mesh of torch's tensors gives tensors; one in a GPU's memory is
    measured there, with the same bits. Warns with OpenMeshWarning where rows of samples prove that the mesh is not closed.
    Raises ValueError for a band that is not above 0 or not finite, IndexError for a triangle that names a vertex that does
    not exist.

    Example:
        >>> field = vp.distance(mesh, grid, band=3)
        >>> field, triangle = vp.distance(mesh, grid, "whole", nearest=True)
    """
    check_call("distance", grid, "conservative", threads, status)
    for what, value, choices in (("sign", sign, Sign), ("repair", repair, Repair), ("bodies", bodies, Bodies)):
        check_choice(what, value, choices)
    if isinstance(band, str):
        if band != "whole":
            raise ValueError(f'band is a number of voxels or "whole", not {band!r}')
        voxels = 0.0
    else:
        if isinstance(band, bool) or not isinstance(band, Real):
            raise TypeError(f"band is a number of voxels or \"whole\", not {type(band).__name__}")
        voxels = float(band)
        if not (math.isfinite(voxels) and 0 < voxels <= 1e9):
            raise ValueError(f"band is a number of voxels above 0, or \"whole\", not {band!r}")
    check_solid_numbers(max_hole_edges, closing)
    corners = bool(corners)
    m = mesh_of_triangles(mesh, "distances")
    shape = tuple(n + corners for n in grid.shape)
    out = m.empty(shape, np.float32)
    numbers = m.empty(shape, np.int64) if nearest else None
    options = (voxels, sign, repair, bodies, max_hole_edges, closing, corners)
    if isinstance(m, DeviceMesh):
        counts = _device_fields.distance(m, grid, options, out, numbers)
    else:
        positions, where = m.positions(grid)
        counts = _core.distance_field(
            positions, m.triangles, list(m.first_triangles), where, *options, out, numbers, threads
        )
    if repair == "exterior" and not (out < 0).any():
        refuse_grid_within(m, grid, repair, bodies, closing, threads)
    take_counts(counts, status)
    _warn_of_holes(counts, f" of {shape[0] * shape[1]} rows of samples", repair)
    if numbers is None:
        return m.to_caller(out)
    return m.to_caller(out), m.to_caller(numbers)


def _placed_points(m: Mesh, at: np.ndarray, grid: Grid) -> tuple[np.ndarray, Grid, np.ndarray]:
    """Positions, the grid in which they are to be snapped, and points in float32. The grid's origin is taken away from all
    of them where float32 does not hold the points as they are."""
    positions, where, reference = m.placed(grid)
    with np.errstate(over="ignore", invalid="ignore"):
        finite = at[np.isfinite(at)]
        if not any(reference) and (finite.astype(np.float32) != finite).any():
            positions, where, reference = m.relative(grid)
        if any(reference):
            at = at.astype(np.float64) - np.asarray(reference)
        return positions, where, np.ascontiguousarray(at, np.float32)


def distance_at(
    mesh: MeshLike,
    points: Any,
    grid: Grid | None = None,
    sign: Sign = "nonzero",
    *,
    repair: Repair = "none",
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    nearest: bool = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """The distances of any points (n, 3) from the mesh: float32, (n,), in the mesh's units.

    Points and triangles are snapped to the lattice of `grid`, wherever they lie; by default a grid of 1024 voxels along the
    mesh's longest side, whose lattice is finer than 2^-23 of that. Otherwise as distance() with band="whole".

    Args:
        mesh, points: what voxelize() takes, and positions (n, 3), in a GPU's memory where the mesh is.
        grid: whose lattice positions are snapped to.
        sign, repair, bodies, max_hole_edges: as in distance(); repair is "none", "close_holes" or "winding".
        threads: 0 takes all cores.
        nearest: also returns the number of each point's nearest triangle, int64.
        status: a dict that is filled with the call's counters; bad_points are those that are not finite or too far from the
            grid. They get NaN and -1.

    Returns the distances, or (distances, nearest). A mesh of torch's tensors gives tensors.

    Example:
        >>> d = vp.distance_at(mesh, points, sign="unsigned")
    """
    check_threads(threads)
    check_status(status)
    for what, value, choices in (("sign", sign, Sign), ("repair", repair, Repair), ("bodies", bodies, Bodies)):
        check_choice(what, value, choices)
    if repair in ("exterior", "vote"):
        raise ValueError(f'repair is one of "none", "close_holes" and "winding" here, not {repair!r}, which looks at a grid')
    check_solid_numbers(max_hole_edges, 0)
    if grid is not None:
        check_grid(grid, "distance_at")
    m = mesh_of_triangles(mesh, "distances")
    at = m.take(points, "the array of points")
    if at.ndim != 2 or at.shape[1] != 3:
        raise ValueError(f"points are an array (n, 3), not {tuple(at.shape)}")
    if m.dtype_of(at).kind not in "fiu":
        raise ValueError(f"points are numbers, not {m.dtype_of(at)}")
    chosen = grid if grid is not None else fit(mesh, 1024)
    out = m.empty((len(at),), np.float32)
    numbers = m.empty((len(at),), np.int64)
    options = (sign, repair, bodies, max_hole_edges)
    if isinstance(m, DeviceMesh):
        counts = _device_fields.distance_at(m, at, chosen, options, out, numbers)
    else:
        positions, where, single = _placed_points(m, at, chosen)
        counts = _core.distance_at(
            positions, m.triangles, list(m.first_triangles), where, single, *options, out, numbers, threads
        )
    take_counts(counts, status)
    _warn_of_holes(counts, " rows through points", repair)
    if not nearest:
        return m.to_caller(out)
    return m.to_caller(out), m.to_caller(numbers)
