# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Distances, fractions, surfaces and labels of meshes and arrays in a GPU's memory, as _device has what draws."""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np

from ._core import Grid
from ._device import DeviceMesh, _library_of, _module


def distance(m: DeviceMesh, grid: Grid, options: Sequence[Any], out: Any, nearest: Any) -> dict[str, int]:
    """options: band (0 is "whole"), sign, repair, bodies, max_hole_edges, closing, corners. nearest: an array, or None."""
    stream, positions, triangles, state, _positions = m.call(grid)
    counts: dict[str, int] = _module().distance_field(
        stream, positions, triangles, list(m.first_triangles), state, *options, *m.addresses(out, nearest)
    )
    return counts


def distance_at(
    m: DeviceMesh, points: Any, grid: Grid, options: Sequence[Any], out: Any, nearest: Any
) -> dict[str, int]:
    """points (n, 3), of any numbers. options: sign, repair, bodies, max_hole_edges."""
    lib = m.library
    wide = lib.convert(points, np.float64)
    single = lib.convert(wide, np.float32)
    same = lib.convert(single, np.float64) == wide
    relative = lib.dtype_of(m.vertices) != np.float32 or not bool((same | ~lib.finite(wide)).all())
    if relative:
        single = lib.convert(wide - lib.vector(grid._whole_origin), np.float32)
    stream, positions, triangles, state, _positions = m.call(grid, relative)
    at = (lib.pointer(single), len(single))
    counts: dict[str, int] = _module().distance_at(
        stream, positions, triangles, list(m.first_triangles), state, at, *options, *m.addresses(out, nearest)
    )
    return counts


def fractions(
    m: DeviceMesh, part: tuple[int, int], grid: Grid, axis: int, arrays: Sequence[Any], options: Sequence[Any]
) -> dict[str, int]:
    """`part`: first triangle and the one after the last. arrays: fractions, then None where nobody asked: apertures, area
    vectors, centroids of faces, centroids, areas, their centroids, marks. options: close_holes, max_hole_edges."""
    stream, positions, (first, _), state, _positions = m.call(grid)
    triangles = (first + 12 * part[0], part[1] - part[0])
    out, *others = m.addresses(*arrays)
    counts: dict[str, int] = _module().fractions(
        stream, positions, triangles, state, axis, *options, out, tuple(others[:3]), tuple(others[3:])
    )
    return counts


def _arrays_of(lib: Any, kept: Any, floats: int, integers: int) -> tuple[Any, Any, Any]:
    """What _core.remesh gives, of a surface that is kept on the device, with so many columns of values."""
    counts = kept.counts  # raises what went wrong
    n = kept.num_vertices
    arrays = [
        lib.empty((n, 3), np.float64),
        lib.empty((kept.num_faces, kept.num_corners), lib.face),
        lib.empty((n, 3), np.int32),
        lib.empty((n,), np.uint8),
        lib.empty((n,), np.int64),
    ]
    rows, whole = lib.empty((n, floats), np.float32), lib.empty((n, integers), np.int64)
    kept.copy(
        tuple(lib.pointer(a) for a in arrays),
        lib.face == np.int64,
        (lib.pointer(rows), floats),
        (lib.pointer(whole), integers),
    )
    return (*arrays, counts), rows, whole


def remesh(m: DeviceMesh, grid: Grid, corners: bool, options: Sequence[Any], arrays: Sequence[Any]) -> tuple[Any, Any, Any]:
    """As _core.remesh. options: its arguments from `sign` on without `corners`. arrays: floats of vertices and of triangles,
    integers of both."""
    stream, positions, triangles, state, _positions = m.call(grid)
    columns = [(m.library.pointer(a), a.shape[1]) for a in arrays]
    kept = _module().remesh(
        stream,
        positions,
        triangles,
        list(m.first_triangles),
        state,
        grid.__getstate__(),
        corners,
        *options,
        tuple(columns[:2]),
        tuple(columns[2:]),
    )
    return _arrays_of(m.library, kept, columns[0][1] + columns[1][1], columns[2][1] + columns[3][1])


def extract(values: Any, grid: Grid, corners: bool, place: str, level: float, options: Sequence[Any]) -> Any:
    """The arrays of _core.extract_bits or extract_field. values: bool or floats of a library's own; options: whether the
    border is open, quads, min_component, embedded."""
    module = _module("the array is")
    lib = _library_of(values)
    a = lib.take(values, "the array")
    how = (lib.stream(),)
    where = (tuple(a.shape), grid.__getstate__(), corners, place)
    if lib.dtype_of(a) == np.bool_:
        held = lib.convert(a, np.bool_)
        kept = module.extract_bits(*how, lib.pointer(held), *where, *options)
    else:
        held = lib.convert(a, np.float32)
        if lib.dtype_of(a).itemsize > 4:  # as _remesh._as_field
            above = a - level
            held = lib.convert(above, np.float32)
            held[(above < 0) & (held == 0)] = -float(np.finfo(np.float32).tiny)
            level = 0.0
        kept = module.extract_field(*how, lib.pointer(held), *where, level, *options)
    return _arrays_of(lib, kept, 0, 0)[0]


def label(values: Any, connectivity: int, components: bool) -> tuple[Any, int, dict[str, Any]]:
    """Labels, the number of components, and their list where it is asked for. values: bool (nz, ny, nx)."""
    module = _module("the array is")
    lib = _library_of(values)
    held = lib.convert(values, np.bool_)
    shape = tuple(held.shape)
    is_wide = math.prod(shape) > 2**31
    labels = lib.empty(shape, np.int64 if is_wide else np.int32)
    kept = module.label(lib.stream(), lib.pointer(held), shape, connectivity, components, lib.pointer(labels), is_wide)
    n = kept.count
    if not components:
        return labels, n, {}
    listed = {
        "name": lib.empty((n,), np.int64),
        "voxels": lib.empty((n,), np.int64),
        "min": lib.empty((n, 3), np.int32),
        "max": lib.empty((n, 3), np.int32),
    }
    kept.copy(*(lib.pointer(a) for a in listed.values()))
    return labels, n, listed


def taken(a: Any, what: str) -> tuple[Any, np.dtype]:
    """An array in a GPU's memory as its library's own, and its type."""
    lib = _library_of(a)
    own = lib.take(a, what)
    return own, lib.dtype_of(own)
