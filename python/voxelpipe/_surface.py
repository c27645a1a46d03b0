# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import warnings
from typing import Any, Literal, NamedTuple, overload

import numpy as np
import numpy.typing as npt

from . import _core, _device
from ._arrays import to_torch
from ._axes import VoxelList, dense
from ._core import Grid
from ._device import DeviceMesh
from ._mesh import ModelMesh, as_mesh
from ._types import Coverage, MeshLike, TensorMesh, check_call


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


def listed_for(m: Any, voxels: np.ndarray) -> Any:
    """A list of voxels as the caller gets it."""
    return to_torch(voxels) if m.to_caller is to_torch else voxels.view(VoxelList)


def words_for(m: Any, words: np.ndarray) -> Any:
    """Packed bits as the caller gets them: int32 for torch, the same 32 bits."""
    return to_torch(words.view(np.int32)) if m.to_caller is to_torch else words


def packed(mask: np.ndarray) -> np.ndarray:
    """bool (nz, ny, nx) as words of 32 voxels along x, lowest bit first."""
    nz, ny, nx = mask.shape
    wide = np.zeros((nz, ny, (nx + 31) // 32 * 4), np.uint8)
    bits = np.packbits(mask, axis=2, bitorder="little")
    wide[..., : bits.shape[2]] = bits
    return wide.view("<u4").astype(np.uint32, copy=False)


@overload
def voxelize(
    mesh: TensorMesh,
    grid: Grid,
    coverage: Coverage = "conservative",
    *,
    packed: bool = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any: ...


@overload
def voxelize(
    mesh: MeshLike,
    grid: Grid,
    coverage: Coverage = "conservative",
    *,
    packed: Literal[False] = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> npt.NDArray[np.bool_]: ...


@overload
def voxelize(
    mesh: MeshLike,
    grid: Grid,
    coverage: Coverage = "conservative",
    *,
    packed: Literal[True],
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> npt.NDArray[np.uint32]: ...


def voxelize(
    mesh: MeshLike,
    grid: Grid,
    coverage: Coverage = "conservative",
    *,
    packed: bool = False,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Any:
    """The voxels that a surface covers: bool, (nz, ny, nx). Of a model, which may have lines, points, and materials that cut
    off by alpha, those that the voxelize tool covers.

    Args:
        mesh: (vertices, triangles), a mesh of trimesh, Open3D or PyVista, a path, a Model, or a list of those.
        grid: the Grid, as fit() makes one.
        coverage: "conservative", every voxel whose closed box a triangle touches; "thin", one voxel in each column along a
            triangle's main axis, which leaves no hole between face neighbours; "crosshair", those of which a triangle
            meets a segment through the centre along an axis: still fewer, without a hole, and the same however a face is
            cut; "diagonal", those of which one meets a segment from corner to corner: a little less than conservative.
        packed: uint32 (nz, ny, ceil(nx / 32)) in place of bool, a bit for each voxel, lowest bit first: an eighth of the
            memory. int32 for torch, the same bits.
        threads: 0 takes all cores. The result is the same for any number.
        status: a dict that is filled with the call's counters.

    Returns:
        An array, indexed [z, y, x]; of a mesh of torch's tensors a tensor. A mesh in a GPU's memory (torch, CuPy) is
        drawn there, with the same bits, and threads has no meaning; this needs the package voxelpipe-cuda13.

    Raises:
        IndexError: a triangle names a vertex that does not exist.

    Example:
        >>> grid = vp.fit(mesh, 128)
        >>> surface = vp.voxelize(mesh, grid)
        >>> surface[z, y, x]
    """
    check_call("voxelize", grid, coverage, threads, status)
    m = as_mesh(mesh)
    if isinstance(m, DeviceMesh):
        result, counts = _device.voxelize(m, grid, coverage, packed)
        take_counts(counts, status)
        return result
    if isinstance(m, ModelMesh) and m.scene.is_more_than_triangles:
        voxels, _, counts, _ = m.scene.draw(grid, coverage, [], threads)
        take_counts(counts, status)
        mask: np.ndarray = dense(voxels, True, grid, threads=threads)
        return _pack(mask) if packed else mask
    positions, where = m.positions(grid)
    nz, ny, nx = grid.shape
    if packed:
        words = np.empty((nz, ny, (nx + 31) // 32), np.uint32)
        take_counts(_core.voxelize_bits(positions, m.triangles, where, coverage, words, threads), status)
        return words_for(m, words)
    out = np.empty((nz, ny, nx), np.uint8)
    take_counts(_core.voxelize_mask(positions, m.triangles, where, coverage, out, threads), status)
    return m.to_caller(out.view(np.bool_))


_pack = packed


class Fragments(NamedTuple):
    """Which triangles lie in which voxel, and where: lists by voxel. Fragments of voxels[i] are
    [offsets[i], offsets[i + 1]) of the others, by ascending triangle."""

    voxels: Any
    """(n, 3) int32, a VoxelList: x, y, z of each voxel with a fragment, z-major order"""
    offsets: Any
    """(n + 1,) int64"""
    triangles: Any
    """(m,) int32: numbers of the mesh's triangles; int64 for torch, not all of which index by int32, and for a mesh of 2^31
    triangles or more"""
    barycentrics: Any
    """(m, 3) float32: weights of the triangle's vertices at the point of the triangle next to the voxel's centre along
    the triangle's main axis"""

    def interpolate(self, values: Any, triangles: Any) -> Any:
        """An attribute of each fragment: (m,) or (m, columns).

        Args:
            values: a row for each vertex, (v,) or (v, columns).
            triangles: the mesh's triangles (f, 3), which name the vertices.

        Example:
            >>> lists = vp.fragments((vertices, triangles), grid)
            >>> normals = lists.interpolate(vertex_normals, triangles)
        """
        corners = values[triangles[self.triangles]]
        weights = self.barycentrics if corners.ndim == 2 else self.barycentrics[..., None]
        return (corners * weights).sum(1)


def fragments(
    mesh: MeshLike,
    grid: Grid,
    coverage: Coverage = "conservative",
    *,
    threads: int = 0,
    status: dict[str, int] | None = None,
) -> Fragments:
    """Every triangle of every voxel: the lists of a ray-tracing grid, or the input of any shading of one's own.

    Args:
        mesh, grid, coverage, threads, status: as in voxelize().

    Returns:
        Fragments, whose arrays are tensors for a mesh of tensors.

    Example:
        >>> lists = vp.fragments((vertices, triangles), grid)
        >>> first = lists.triangles[lists.offsets[:-1]]  # the first triangle of each voxel
    """
    check_call("fragments", grid, coverage, threads, status)
    m = as_mesh(mesh)
    if isinstance(m, DeviceMesh):
        on_device, counts = _device.fragments(m, grid, coverage)
        take_counts(counts, status)
        return Fragments(*on_device)
    positions, where = m.positions(grid)
    voxels, offsets, numbers, weights, counts = _core.fragments(positions, m.triangles, where, coverage, threads)
    take_counts(counts, status)
    is_wide = m.to_caller is to_torch or len(m.triangles) >= 2**31
    numbers = numbers.astype(np.int64) if is_wide else numbers.view(np.int32)
    return Fragments(listed_for(m, voxels), *(m.to_caller(a) for a in (offsets, numbers, weights)))
