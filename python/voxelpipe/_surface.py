# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np

from . import _core, _device
from ._core import Grid
from ._device import DeviceMesh
from ._mesh import MeshLike, as_mesh


class DroppedTrianglesWarning(UserWarning):
    """Triangles with a position that is not finite, or absurdly far, were left out."""


def take_counts(counts: dict[str, int], status: dict[str, int] | None) -> None:
    """Hands the counters of a call to the caller, and warns of triangles that were left out."""
    if status is not None:
        status.clear()
        status.update(counts)
    dropped = counts["triangles_dropped"]
    if dropped:
        warnings.warn(
            f"{dropped} of {counts['triangles']} triangles have a position that is not finite or too far, and were left out",
            DroppedTrianglesWarning,
            stacklevel=3,
        )


def voxelize(
    mesh: MeshLike,
    grid: Grid,
    coverage: str = "conservative",
    *,
    packed: bool = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """The voxels that a surface covers: bool, (nz, ny, nx).

    coverage: "conservative", every voxel whose closed box a triangle touches; "thin", one voxel in each column along a
        triangle's main axis, which leaves no hole between face neighbours; "crosshair", those of which a triangle meets a
        segment through the centre along an axis: still fewer, without a hole, and the same however a face is cut;
        "diagonal", those of which one meets a segment from corner to corner: a little less than conservative.
    packed: uint32 (nz, ny, ceil(nx / 32)) in place of bool, a bit for each voxel, lowest bit first. An eighth of the
        memory.
    threads: 0 takes all cores. The result is the same for any number.
    status: a dict that is filled with the call's counters.

    A mesh of torch's tensors gives a tensor. A mesh in a GPU's memory (torch, CuPy) is drawn there, with the same bits,
    and threads has no meaning; this needs the package voxelpipe-cuda13. Raises IndexError for a triangle that names a vertex that does not exist.
    """
    m = as_mesh(mesh)
    if isinstance(m, DeviceMesh):
        result, counts = _device.voxelize(m, grid, coverage, packed)
        take_counts(counts, status)
        return result
    positions, where = m.positions(grid)
    nz, ny, nx = grid.shape
    if packed:
        words = np.empty((nz, ny, (nx + 31) // 32), np.uint32)
        take_counts(_core.voxelize_bits(positions, m.triangles, where, coverage, words, threads), status)
        return m.to_caller(words)
    out = np.empty((nz, ny, nx), np.uint8)
    take_counts(_core.voxelize_mask(positions, m.triangles, where, coverage, out, threads), status)
    return m.to_caller(out.view(np.bool_))


class Fragments(NamedTuple):
    """Which triangles lie in which voxel, and where: lists by voxel. Fragments of voxels[i] are
    [offsets[i], offsets[i + 1]) of the other two, by ascending triangle."""

    voxels: Any
    """(n, 3) int32: x, y, z of each voxel with a fragment, z-major order"""
    offsets: Any
    """(n + 1,) int64"""
    triangles: Any
    """(m,) uint32: numbers of the mesh's triangles"""
    barycentrics: Any
    """(m, 3) float32: weights of the triangle's vertices at the point of the triangle next to the voxel's centre along
    the triangle's main axis"""


def fragments(
    mesh: MeshLike,
    grid: Grid,
    coverage: str = "conservative",
    *,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Fragments:
    """Every triangle of every voxel: the lists of a ray-tracing grid, or the input of any shading of one's own."""
    m = as_mesh(mesh)
    if isinstance(m, DeviceMesh):
        on_device, counts = _device.fragments(m, grid, coverage)
        take_counts(counts, status)
        return Fragments(*on_device)
    positions, where = m.positions(grid)
    *arrays, counts = _core.fragments(positions, m.triangles, where, coverage, threads)
    take_counts(counts, status)
    return Fragments(*(m.to_caller(a) for a in arrays))
