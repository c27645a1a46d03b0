# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Distances and fractions of meshes in a GPU's memory, as _device has what draws."""

from __future__ import annotations

from typing import Any, Sequence

import numpy as np

from ._core import Grid
from ._device import DeviceMesh, _module


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
