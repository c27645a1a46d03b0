# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes of other libraries as two arrays, without a copy where the array fits already."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Callable, Sequence

import numpy as np

from ._arrays import is_on_device, is_torch, to_numpy, to_torch
from ._core import Grid
from ._device import DeviceMesh, as_device_mesh
from ._model import Model, narrowed, read_scene
from ._types import MeshLike


@dataclass(frozen=True)
class Mesh:
    """A mesh in host memory."""

    vertices: np.ndarray  # (v, 3), float32, or float64 where that holds positions that float32 does not
    triangles: np.ndarray  # (f, 3) uint32, C order
    first_triangles: tuple[int, ...]  # of each part
    to_caller: Callable[[np.ndarray], Any]  # a result as the caller's kind of array

    # The same for arrays on a GPU: _device.DeviceMesh.
    def take(self, a: Any, what: str) -> np.ndarray:
        return to_numpy(a, what)

    def dtype_of(self, a: np.ndarray) -> np.dtype:
        return a.dtype

    def convert(self, a: np.ndarray, dtype: Any) -> np.ndarray:
        return np.ascontiguousarray(a, dtype)

    def rounded(self, a: np.ndarray, dtype: Any) -> np.ndarray:
        return np.rint(a).astype(dtype)

    def empty(self, shape: Sequence[int], dtype: Any) -> np.ndarray:
        return np.empty(shape, dtype)

    def zeros(self, shape: Sequence[int], dtype: Any) -> np.ndarray:
        return np.zeros(shape, dtype)

    def columns(self, arrays: Sequence[np.ndarray]) -> np.ndarray:
        return np.stack(arrays, axis=1)

    def bounds(self) -> tuple[list[float], list[float]] | None:
        """The lowest and highest corner of the vertices that are finite, if there are any."""
        finite = np.isfinite(self.vertices).all(axis=1)
        vertices = self.vertices if finite.all() else self.vertices[finite]
        if not len(vertices):
            return None
        return vertices.min(axis=0).astype(np.float64).tolist(), vertices.max(axis=0).astype(np.float64).tolist()

    def positions(self, grid: Grid) -> tuple[np.ndarray, Grid]:
        """Positions in float32, and the grid in which they are to be drawn."""
        positions, where, _ = self.placed(grid)
        return positions, where

    def placed(self, grid: Grid) -> tuple[np.ndarray, Grid, Sequence[float]]:
        """The same, and the point that was taken away from both.

        Positions in double lose nothing but what lies beyond float32 after the grid's origin has been taken away.
        """
        if self.vertices.dtype == np.float32:
            return self.vertices, grid, (0.0, 0.0, 0.0)
        return self.relative(grid)

    def relative(self, grid: Grid) -> tuple[np.ndarray, Grid, Sequence[float]]:
        """As placed(), with the origin taken away from single precision too: for points that it does not hold."""
        with np.errstate(over="ignore", invalid="ignore"):
            relative = (self.vertices.astype(np.float64, copy=False) - np.asarray(grid._whole_origin)).astype(np.float32)
        return np.ascontiguousarray(relative), grid._relative_to_origin(), grid._whole_origin


@dataclass(frozen=True)
class ModelMesh(Mesh):
    """A model, drawn by the positions that the tool draws."""

    scene: Any  # _core.Scene

    def placed(self, grid: Grid) -> tuple[np.ndarray, Grid, Sequence[float]]:
        positions, where, reference = self.scene.positions(grid)
        return positions, where, reference

    def relative(self, grid: Grid) -> tuple[np.ndarray, Grid, Sequence[float]]:
        return self.placed(grid)  # relative where the model lies far from 0


def _as_it_is(a: np.ndarray) -> np.ndarray:
    return a


def _converter(a: Any) -> Callable[[np.ndarray], Any]:
    return to_torch if is_torch(a) else _as_it_is


def _vertices(a: Any) -> np.ndarray:
    v = to_numpy(a, "the array of vertices")
    if v.ndim != 2 or v.shape[1] != 3:
        raise ValueError(f"vertices are an array (v, 3), not {v.shape}")
    if v.dtype.kind not in "fiu":
        raise ValueError(f"vertices are numbers, not {v.dtype}")
    if v.dtype == np.float32:
        return np.ascontiguousarray(v)
    return narrowed(v.astype(np.float64, copy=False))


def _triangles(a: Any, num_vertices: int, part: str) -> np.ndarray:
    """Raises IndexError that names the first triangle with a vertex that does not exist. `part`: of a list, or empty."""
    t = to_numpy(a, "the array of triangles")
    if t.ndim != 2 or t.shape[1] != 3:
        raise ValueError(f"triangles are an array (f, 3) of vertex numbers, not {t.shape}")
    if t.dtype.kind not in "iu":
        raise ValueError(f"triangles are integers, not {t.dtype}")
    if t.size and (int(t.max()) >= num_vertices or int(t.min()) < 0):
        row = int(np.argmax(((t < 0) | (t >= num_vertices)).any(axis=1)))
        numbers = ", ".join(str(int(i)) for i in t[row])
        raise IndexError(f"triangle {row}{part} is ({numbers}), the mesh has {num_vertices} vertices")
    if t.dtype in (np.uint32, np.int32):
        return np.ascontiguousarray(t).view(np.uint32)
    return np.ascontiguousarray(t, dtype=np.uint32)


def _pyvista(mesh: Any) -> tuple[Any, Any]:
    surface = mesh if mesh.is_all_triangles else mesh.triangulate()
    return surface.points, np.asarray(surface.faces).reshape(-1, 4)[:, 1:]


def _parts_of(mesh: MeshLike) -> tuple[Any, Any]:
    """(vertices, triangles) of one mesh, as the caller's arrays."""
    if isinstance(mesh, (str, os.PathLike)):
        return _parts_of(Model(os.fspath(mesh), read_scene(os.fspath(mesh), False, 4)))
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


def _model_mesh(model: Model) -> ModelMesh:
    triangles = model._scene.triangles
    firsts = tuple(p.first_triangle for p in model.parts if p.num_triangles) or (0,)
    return ModelMesh(model.vertices, triangles, firsts, _as_it_is, model._scene)


def as_mesh(mesh: MeshLike) -> Mesh | DeviceMesh:
    """Converts what the caller has. The parts of a list, or of a model, stay apart as bodies of solids, and are one mesh
    otherwise. Arrays in a GPU's memory stay there."""
    parts: Sequence[Any] = mesh if isinstance(mesh, list) else [mesh]
    if len(parts) == 1:
        only = parts[0]
        if isinstance(only, (str, os.PathLike)):
            only = Model(os.fspath(only), read_scene(os.fspath(only), False, 3))
        if isinstance(only, Model):
            return _model_mesh(only)
    for i, part in enumerate(parts):
        if isinstance(part, Model) and not len(part.faces) and len(part.lines):
            raise ValueError(f"part {i} of the list is a model of points or lines, which is drawn by itself alone")
    pairs = [_parts_of(part) for part in parts]
    if any(is_on_device(a) for pair in pairs for a in pair):
        return as_device_mesh(pairs)
    if not pairs:
        return Mesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32), (0,), _as_it_is)
    vertices = [_vertices(v) for v, _ in pairs]
    triangles = [
        _triangles(t, len(v), f" of part {i}" if len(pairs) > 1 else "")
        for i, ((_, t), v) in enumerate(zip(pairs, vertices))
    ]
    to_caller = _converter(pairs[0][0])
    if len(pairs) == 1:
        return Mesh(vertices[0], triangles[0], (0,), to_caller)
    if any(v.dtype == np.float64 for v in vertices):
        vertices = [v.astype(np.float64) for v in vertices]
    first_vertex = np.cumsum([0] + [len(v) for v in vertices[:-1]])
    joined = np.concatenate([t + np.uint32(first) for t, first in zip(triangles, first_vertex)])
    first_triangle = np.cumsum([0] + [len(t) for t in triangles[:-1]])
    return Mesh(np.concatenate(vertices), joined, tuple(int(i) for i in first_triangle), to_caller)
