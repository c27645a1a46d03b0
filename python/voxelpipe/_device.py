# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes whose arrays lie in a GPU's memory: tensors of torch, or arrays of CuPy. They are drawn there by the package
voxelpipe-cuda13, on the caller's current stream, and results are arrays of the same library on the same device.

Calls wait for the stream at their end. Arrays of other libraries come as tensors of torch or arrays of CuPy, by DLPack or
__cuda_array_interface__.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from ._arrays import is_on_device
from ._core import Grid


def _module(what: str = "the mesh is") -> Any:
    try:
        import voxelpipe_cuda
    except ImportError as e:
        raise TypeError(
            f"{what} in a GPU's memory: install voxelpipe-cuda13 to work on it there, or copy it to the host, as with "
            f".cpu() or .get() ({e})"
        ) from None
    return voxelpipe_cuda._cuda


class _Torch:
    """Tensors of torch on one device."""

    word = np.int32  # of packed bits: torch can do next to nothing with uint32
    index = np.int64  # of numbers of triangles, by which all versions index
    face = np.int64  # of the vertices' numbers in a surface

    def __init__(self, like: Any) -> None:
        import torch

        self.torch = torch
        self.device = like.device

    def take(self, a: Any, what: str) -> Any:
        if not isinstance(a, self.torch.Tensor):
            raise TypeError(f"{what} is a {type(a).__name__}, and the mesh has tensors on {self.device}")
        if a.device != self.device:
            raise TypeError(f"{what} is on {a.device}, the mesh on {self.device}")
        return a.detach()

    def dtype_of(self, a: Any) -> np.dtype:
        return np.dtype(str(a.dtype).split(".")[-1])

    def convert(self, a: Any, dtype: Any) -> Any:
        return a.to(getattr(self.torch, np.dtype(dtype).name)).contiguous()

    def rounded(self, a: Any, dtype: Any) -> Any:
        return self.convert(self.torch.round(a), dtype)

    def empty(self, shape: Sequence[int], dtype: Any) -> Any:
        return self.torch.empty(tuple(shape), dtype=getattr(self.torch, np.dtype(dtype).name), device=self.device)

    def zeros(self, shape: Sequence[int], dtype: Any) -> Any:
        return self.torch.zeros(tuple(shape), dtype=getattr(self.torch, np.dtype(dtype).name), device=self.device)

    def as_bool(self, a: Any) -> Any:
        return a.view(self.torch.bool)

    def vector(self, values: Sequence[float]) -> Any:
        return self.torch.tensor(values, dtype=self.torch.float64, device=self.device)

    def finite(self, a: Any) -> Any:
        return self.torch.isfinite(a)

    def finite_rows(self, a: Any) -> Any:
        return a[self.torch.isfinite(a).all(dim=1)]

    def bounds(self, a: Any) -> tuple[list[float], list[float]]:
        return a.amin(dim=0).double().tolist(), a.amax(dim=0).double().tolist()

    def concatenate(self, arrays: Sequence[Any]) -> Any:
        return self.torch.cat(list(arrays))

    def columns(self, arrays: Sequence[Any]) -> Any:
        return self.torch.stack(list(arrays), dim=1)

    def pointer(self, a: Any) -> int:
        return int(a.data_ptr())

    def stream(self) -> tuple[int, int]:
        current = self.torch.cuda.current_stream(self.device)
        return int(current.device.index), int(current.cuda_stream)


class _Cupy:
    """Arrays of CuPy on one device."""

    word = np.uint32
    index = np.int32
    face = np.uint32

    def __init__(self, like: Any) -> None:
        import cupy

        self.cupy = cupy
        self.device = cupy.asarray(like).device

    def take(self, a: Any, what: str) -> Any:
        if not is_on_device(a):
            raise TypeError(f"{what} is in the host's memory, and the mesh on GPU {self.device.id}")
        taken = self.cupy.asarray(a)
        if taken.device != self.device:
            raise TypeError(f"{what} is on GPU {taken.device.id}, the mesh on GPU {self.device.id}")
        return taken

    def dtype_of(self, a: Any) -> np.dtype:
        return np.dtype(a.dtype)

    def convert(self, a: Any, dtype: Any) -> Any:
        with self.device:
            return self.cupy.ascontiguousarray(a, dtype=dtype)

    def rounded(self, a: Any, dtype: Any) -> Any:
        with self.device:
            return self.convert(self.cupy.rint(a), dtype)

    def empty(self, shape: Sequence[int], dtype: Any) -> Any:
        with self.device:
            return self.cupy.empty(tuple(shape), dtype)

    def zeros(self, shape: Sequence[int], dtype: Any) -> Any:
        with self.device:
            return self.cupy.zeros(tuple(shape), dtype)

    def as_bool(self, a: Any) -> Any:
        return a.view(np.bool_)

    def vector(self, values: Sequence[float]) -> Any:
        with self.device:
            return self.cupy.asarray(values, dtype=np.float64)

    def finite(self, a: Any) -> Any:
        with self.device:
            return self.cupy.isfinite(a)

    def finite_rows(self, a: Any) -> Any:
        with self.device:
            return a[self.cupy.isfinite(a).all(axis=1)]

    def bounds(self, a: Any) -> tuple[list[float], list[float]]:
        with self.device:
            return a.min(axis=0).astype(np.float64).tolist(), a.max(axis=0).astype(np.float64).tolist()

    def concatenate(self, arrays: Sequence[Any]) -> Any:
        with self.device:
            return self.cupy.concatenate(list(arrays))

    def columns(self, arrays: Sequence[Any]) -> Any:
        with self.device:
            return self.cupy.stack(list(arrays), axis=1)

    def pointer(self, a: Any) -> int:
        return int(a.data.ptr)

    def stream(self) -> tuple[int, int]:
        with self.device:
            return int(self.device.id), int(self.cupy.cuda.get_current_stream().ptr)


def _library_of(a: Any) -> Any:
    if type(a).__module__.split(".")[0] == "torch":
        return _Torch(a)
    try:
        return _Cupy(a)
    except ImportError:
        raise TypeError(
            f"{type(a).__module__}.{type(a).__name__} is in a GPU's memory: give tensors of torch, or install CuPy"
        ) from None


@dataclass(frozen=True)
class DeviceMesh:
    """A mesh in a GPU's memory; the counterpart of _mesh.Mesh."""

    library: Any
    vertices: Any  # (v, 3), float32, or float64 where that holds positions that float32 does not
    triangles: Any  # (f, 3) int32: the 32 bits of each number
    first_triangles: tuple[int, ...]

    def to_caller(self, a: Any) -> Any:
        return a

    def take(self, a: Any, what: str) -> Any:
        return self.library.take(a, what)

    def dtype_of(self, a: Any) -> np.dtype:
        return self.library.dtype_of(a)

    def convert(self, a: Any, dtype: Any) -> Any:
        return self.library.convert(a, dtype)

    def rounded(self, a: Any, dtype: Any) -> Any:
        return self.library.rounded(a, dtype)

    def empty(self, shape: Sequence[int], dtype: Any) -> Any:
        return self.library.empty(shape, dtype)

    def zeros(self, shape: Sequence[int], dtype: Any) -> Any:
        return self.library.zeros(shape, dtype)

    def bounds(self) -> tuple[list[float], list[float]] | None:
        finite = self.library.finite_rows(self.vertices)
        return self.library.bounds(finite) if len(finite) else None

    def columns(self, arrays: Sequence[Any]) -> Any:
        return self.library.columns(arrays)

    def addresses(self, *arrays: Any) -> list[int]:
        """Where arrays begin; 0 for None."""
        return [0 if a is None else self.library.pointer(a) for a in arrays]

    def call(
        self, grid: Grid, relative: bool = False
    ) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int], Any, Any]:
        """Stream, positions, triangles and grid as the module takes them; last the array that has to live on. `relative`:
        the grid's origin is taken away in any case, as by _mesh.Mesh.relative()."""
        lib = self.library
        if not relative and lib.dtype_of(self.vertices) == np.float32:
            positions, where = self.vertices, grid
        else:  # as _mesh.Mesh.positions
            wide = lib.convert(self.vertices, np.float64)
            positions = lib.convert(wide - lib.vector(grid._whole_origin), np.float32)
            where = grid._relative_to_origin()
        return (
            lib.stream(),
            (lib.pointer(positions), len(positions)),
            (lib.pointer(self.triangles), len(self.triangles)),
            where.__getstate__(),
            positions,
        )


def _vertices(lib: Any, a: Any) -> Any:
    v = lib.take(a, "the array of vertices")
    if v.ndim != 2 or v.shape[1] != 3:
        raise ValueError(f"vertices are an array (v, 3), not {tuple(v.shape)}")
    dtype = lib.dtype_of(v)
    if dtype.kind not in "fiu":
        raise ValueError(f"vertices are numbers, not {dtype}")
    single = lib.convert(v, np.float32)
    if dtype == np.float32:
        return single
    double = lib.convert(v, np.float64)
    same = lib.convert(single, np.float64)
    equal = (same == double) | ((same != same) & (double != double))
    return single if bool(equal.all()) else double


def _triangles(lib: Any, a: Any) -> Any:
    t = lib.take(a, "the array of triangles")
    if t.ndim != 2 or t.shape[1] != 3:
        raise ValueError(f"triangles are an array (f, 3) of vertex numbers, not {tuple(t.shape)}")
    dtype = lib.dtype_of(t)
    if dtype.kind not in "iu":
        raise ValueError(f"triangles are integers, not {dtype}")
    if dtype.itemsize > 4:
        bad = ((t < 0) | (t > np.iinfo(np.int32).max)).any(1)
        if bool(bad.any()):
            row = int(bad.nonzero()[0][0])
            raise IndexError(
                f"triangle {row} names a vertex that does not exist: {tuple(int(i) for i in t[row])}"
            )
    # A negative number becomes one that no mesh has.
    return lib.convert(t, np.uint32 if dtype == np.uint32 else np.int32)


def as_device_mesh(pairs: Sequence[tuple[Any, Any]]) -> DeviceMesh:
    """(vertices, triangles) of each part, all of one library and on one device."""
    _module()
    lib = _library_of(next(a for pair in pairs for a in pair if is_on_device(a)))
    vertices = [_vertices(lib, v) for v, _ in pairs]
    triangles = [_triangles(lib, t) for _, t in pairs]
    if len(pairs) == 1:
        return DeviceMesh(lib, vertices[0], triangles[0], (0,))
    if any(lib.dtype_of(v) == np.float64 for v in vertices):
        vertices = [lib.convert(v, np.float64) for v in vertices]
    joined = []
    first_vertex = 0
    for v, t in zip(vertices, triangles):  # joined, a bad number might name a vertex of another part
        wide = lib.convert(t, np.int64)
        bad = ((wide < 0) | (wide >= len(v))).any(1)
        if bool(bad.any()):
            raise IndexError(f"triangle {int(bad.nonzero()[0][0])} of a part names a vertex that does not exist")
        joined.append(lib.convert(wide + first_vertex, np.int32))
        first_vertex += len(v)
    first_triangle = np.cumsum([0] + [len(t) for t in triangles[:-1]])
    return DeviceMesh(lib, lib.concatenate(vertices), lib.concatenate(joined), tuple(int(i) for i in first_triangle))


def voxelize(m: DeviceMesh, grid: Grid, coverage: str, packed: bool) -> tuple[Any, dict[str, int]]:
    *what, _positions = m.call(grid)
    nz, ny, nx = grid.shape
    if packed:
        words = m.library.empty((nz, ny, (nx + 31) // 32), m.library.word)
        return words, _module().voxelize_bits(*what, coverage, m.library.pointer(words))
    out = m.library.empty((nz, ny, nx), np.uint8)
    counts = _module().voxelize_mask(*what, coverage, m.library.pointer(out))
    return m.library.as_bool(out), counts


def solid(m: DeviceMesh, grid: Grid, options: Sequence[Any]) -> tuple[Any, dict[str, int]]:
    """options: fill, extent, repair, bodies, max_hole_edges, closing."""
    stream, positions, triangles, state, _positions = m.call(grid)
    out = m.library.empty(grid.shape, np.uint8)
    counts = _module().solid_mask(
        stream, positions, triangles, list(m.first_triangles), state, *options, m.library.pointer(out)
    )
    return m.library.as_bool(out), counts


def diagnose_repair(m: DeviceMesh, grid: Grid, bodies: str, closing: int) -> dict[str, int]:
    stream, positions, triangles, state, _positions = m.call(grid)
    counts: dict[str, int] = _module().diagnose_repair(
        stream, positions, triangles, list(m.first_triangles), state, bodies, closing
    )
    return counts


def _passes(columns: int, is_integer: bool) -> list[tuple[int, int]]:
    """(first column, number of columns) of each pass: up to 3 floats, or one integer."""
    step = 1 if is_integer else 3
    return [(c, min(step, columns - c)) for c in range(0, columns, step)]


def bake(m: DeviceMesh, grid: Grid, coverage: str, a: Any, fill: float) -> tuple[Any, dict[str, int]]:
    """One attribute (_bake._Attribute), with columns."""
    *what, _positions = m.call(grid)
    columns = a.values.shape[1]
    out = m.library.empty((*grid.shape, columns), np.int64 if a.is_integer else np.float32)
    draw = _module().bake_integer if a.is_integer else _module().bake_float
    counts: dict[str, int] = {}
    for first, n in _passes(columns, a.is_integer):
        values = ((m.library.pointer(a.values), len(a.values)), columns, first, n)
        background = int(fill) if a.is_integer else float(fill)
        counts = draw(*what, coverage, values, a.per_triangle, a.blend, background, m.library.pointer(out))
    return out, counts


def sparse_voxels(m: DeviceMesh, grid: Grid, coverage: str) -> tuple[Any, dict[str, int]]:
    *what, _positions = m.call(grid)
    kept = _module().sparse_voxels(*what, coverage)
    counts = kept.counts
    voxels = m.library.empty((kept.num_voxels, 3), np.int32)
    kept.copy(m.library.pointer(voxels), 0)
    return voxels, counts


def sparse(m: DeviceMesh, grid: Grid, coverage: str, a: Any) -> Any:
    """One attribute in the voxels of sparse_voxels(), with columns."""
    *what, _positions = m.call(grid)
    columns = a.values.shape[1]
    draw = _module().sparse_integer if a.is_integer else _module().sparse_float
    out = None
    for first, n in _passes(columns, a.is_integer):
        values = ((m.library.pointer(a.values), len(a.values)), columns, first, n)
        kept = draw(*what, coverage, values, a.per_triangle, a.blend)
        _ = kept.counts  # raises what went wrong
        if out is None:
            out = m.library.empty((kept.num_voxels, columns), np.int64 if a.is_integer else np.float32)
        if math.prod(out.shape):
            kept.copy(0, m.library.pointer(out))
    return out


def fragments(m: DeviceMesh, grid: Grid, coverage: str) -> tuple[list[Any], dict[str, int]]:
    *what, _positions = m.call(grid)
    kept = _module().fragments(*what, coverage)
    counts = kept.counts
    n, f = kept.num_voxels, kept.num_fragments
    lib = m.library
    arrays = [
        lib.empty((n, 3), np.int32),
        lib.empty((n + 1,), np.int64),
        lib.empty((f,), np.int32),  # the 32 bits of each number
        lib.empty((f, 3), np.float32),
    ]
    kept.copy(*(lib.pointer(a) for a in arrays))
    arrays[2] = lib.convert(arrays[2], lib.index)
    return arrays, counts
