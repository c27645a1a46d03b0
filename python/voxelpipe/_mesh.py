# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes of other libraries as two arrays, without a copy where the array fits already."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Callable, Sequence

import numpy as np

from ._core import Grid
from ._device import DeviceMesh, as_device_mesh, is_on_device
from ._inputs import load

# Types that functions take as a mesh; see as_mesh.
MeshLike = Any


@dataclass(frozen=True)
class Mesh:
    """A mesh in host memory."""

    vertices: np.ndarray  # (v, 3), float32, or float64 where that holds positions that float32 does not
    triangles: np.ndarray  # (f, 3) uint32, C order
    first_triangles: tuple[int, ...]  # of each part
    to_caller: Callable[[np.ndarray], Any]  # a result as the caller's kind of array

    # The same four for arrays on a GPU: _device.DeviceMesh.
    def take(self, a: Any, what: str) -> np.ndarray:
        return to_numpy(a, what)

    def dtype_of(self, a: np.ndarray) -> np.dtype:
        return a.dtype

    def convert(self, a: np.ndarray, dtype: Any) -> np.ndarray:
        return np.ascontiguousarray(a, dtype)

    def rounded(self, a: np.ndarray, dtype: Any) -> np.ndarray:
        return np.rint(a).astype(dtype)

    def bounds(self) -> tuple[list[float], list[float]] | None:
        """The lowest and highest corner of the vertices that are finite, if there are any."""
        finite = np.isfinite(self.vertices).all(axis=1)
        vertices = self.vertices if finite.all() else self.vertices[finite]
        if not len(vertices):
            return None
        return vertices.min(axis=0).astype(np.float64).tolist(), vertices.max(axis=0).astype(np.float64).tolist()

    def positions(self, grid: Grid) -> tuple[np.ndarray, Grid]:
        """Positions in float32, and the grid in which they are to be drawn.

        Positions in double lose nothing but what lies beyond float32 after the grid's origin has been taken away.
        """
        if self.vertices.dtype == np.float32:
            return self.vertices, grid
        with np.errstate(over="ignore", invalid="ignore"):
            relative = (self.vertices - np.asarray(grid._whole_origin)).astype(np.float32)
        return np.ascontiguousarray(relative), grid._relative_to_origin()


def to_numpy(a: Any, what: str) -> np.ndarray:
    """An array of any library in host memory; shares its memory where it can."""
    if isinstance(a, np.ndarray):
        return a
    if is_on_device(a):
        raise TypeError(f"{what} is in a GPU's memory, the mesh is not: copy it to the host, as with .cpu() or .get()")
    if hasattr(a, "detach"):  # a tensor of torch that records gradients
        a = a.detach()
    if hasattr(a, "__dlpack__") and not hasattr(a, "__array__"):
        return np.from_dlpack(a)
    return np.asarray(a)


def _is_torch(a: Any) -> bool:
    return type(a).__module__.split(".")[0] == "torch"


def _converter(a: Any) -> Callable[[np.ndarray], Any]:
    if _is_torch(a):
        import torch

        return torch.from_numpy
    return lambda array: array


def _vertices(a: Any) -> np.ndarray:
    v = to_numpy(a, "the array of vertices")
    if v.ndim != 2 or v.shape[1] != 3:
        raise ValueError(f"vertices are an array (v, 3), not {v.shape}")
    if v.dtype.kind not in "fiu":
        raise ValueError(f"vertices are numbers, not {v.dtype}")
    if v.dtype == np.float32:
        return np.ascontiguousarray(v)
    v = v.astype(np.float64, copy=False)
    with np.errstate(over="ignore"):
        single = v.astype(np.float32)
    if np.array_equal(single.astype(np.float64), v, equal_nan=True):
        return np.ascontiguousarray(single)
    return np.ascontiguousarray(v)


def _triangles(a: Any) -> np.ndarray:
    t = to_numpy(a, "the array of triangles")
    if t.ndim != 2 or t.shape[1] != 3:
        raise ValueError(f"triangles are an array (f, 3) of vertex numbers, not {t.shape}")
    if t.dtype.kind not in "iu":
        raise ValueError(f"triangles are integers, not {t.dtype}")
    if t.dtype in (np.uint32, np.int32):  # a negative number becomes one that no mesh has
        return np.ascontiguousarray(t).view(np.uint32)
    bad = (t < 0) | (t > np.iinfo(np.uint32).max)
    if bad.any():
        row = int(np.argmax(bad.any(axis=1)))
        raise IndexError(f"triangle {row} names a vertex that does not exist: {tuple(int(i) for i in t[row])}")
    return np.ascontiguousarray(t, dtype=np.uint32)


def _pyvista(mesh: Any) -> tuple[Any, Any]:
    surface = mesh if mesh.is_all_triangles else mesh.triangulate()
    return surface.points, np.asarray(surface.faces).reshape(-1, 4)[:, 1:]


def _parts_of(mesh: MeshLike) -> tuple[Any, Any]:
    """(vertices, triangles) of one mesh, as the caller's arrays."""
    if isinstance(mesh, (str, os.PathLike)):
        return _parts_of(load(os.fspath(mesh)))
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return mesh
    if hasattr(mesh, "geometry") and hasattr(mesh, "graph"):  # a scene of trimesh
        mesh = mesh.to_mesh() if hasattr(mesh, "to_mesh") else mesh.dump(concatenate=True)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return mesh.vertices, mesh.faces
    if hasattr(mesh, "vertices") and hasattr(mesh, "triangles"):  # Open3D
        return mesh.vertices, mesh.triangles
    if hasattr(mesh, "vertex") and hasattr(mesh, "triangle"):  # Open3D, tensors
        return mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy()
    if hasattr(mesh, "points") and hasattr(mesh, "is_all_triangles"):
        return _pyvista(mesh)
    raise TypeError(
        f"{type(mesh).__name__} is no mesh: give (vertices, triangles), a mesh of trimesh, Open3D or PyVista, a path, "
        "or a list of those"
    )


def as_mesh(mesh: MeshLike) -> Mesh | DeviceMesh:
    """Converts what the caller has. The parts of a list stay apart as bodies of solids, and are one mesh otherwise. Arrays
    in a GPU's memory stay there."""
    parts: Sequence[MeshLike] = mesh if isinstance(mesh, list) else [mesh]
    pairs = [_parts_of(part) for part in parts]
    if any(is_on_device(a) for pair in pairs for a in pair):
        return as_device_mesh(pairs)
    vertices = [_vertices(v) for v, _ in pairs]
    triangles = [_triangles(t) for _, t in pairs]
    to_caller = _converter(pairs[0][0]) if pairs else lambda array: array
    if len(pairs) == 1:
        return Mesh(vertices[0], triangles[0], (0,), to_caller)
    if not pairs:
        return Mesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32), (0,), to_caller)
    if any(v.dtype == np.float64 for v in vertices):
        vertices = [v.astype(np.float64) for v in vertices]
    for v, t in zip(vertices, triangles):  # joined, a bad number might name a vertex of another part
        bad = (t >= len(v)).any(axis=1)
        if bad.any():
            raise IndexError(f"triangle {int(np.argmax(bad))} of a part names a vertex that does not exist")
    first_vertex = np.cumsum([0] + [len(v) for v in vertices[:-1]])
    joined = np.concatenate([t + np.uint32(first) for t, first in zip(triangles, first_vertex)])
    first_triangle = np.cumsum([0] + [len(t) for t in triangles[:-1]])
    return Mesh(np.concatenate(vertices), joined, tuple(int(i) for i in first_triangle), to_caller)
