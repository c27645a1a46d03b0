# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Grids larger than memory, and sets of models, by Dask: pip install "dask[array,distributed]".

    import voxelpipe as vp
    import voxelpipe.dask
    inside = vp.dask.solid("part.stl", vp.fit("part.stl", 4096), chunks=512)
    inside.to_zarr("part.zarr")  # a block at a time, on every core or on a cluster

An array is lazy: nothing is drawn before it is computed. A block is drawn into the crop of the grid where it lies, and
what is drawn into a crop is, bit for bit, that part of the whole; so neither chunks nor workers change a value.
"""

from __future__ import annotations

import os
from functools import lru_cache
from typing import Any, Callable, NamedTuple, Sequence

import dask
import dask.array as da
import numpy as np

from . import _distance, _fractions, _solid, _surface
from ._arrays import is_on_device, to_numpy
from ._core import Grid
from ._mesh import _parts_of
from ._model import Model, load_model
from ._types import Bodies, Coverage, Extent, Fill, HoleRepair, MeshLike, Repair, Sign

__all__ = ["Outcome", "distance", "fractions", "map_models", "solid", "voxelize"]


@lru_cache(maxsize=1)
def _model_as_it_is(path: str, size: int, changed: int) -> Model:
    return load_model(path)


def _opened(mesh: Any) -> Any:
    """A worker's mesh. Blocks of one model follow each other, so a process keeps the last one that it read."""
    if not isinstance(mesh, str):
        return mesh
    about = os.stat(mesh)
    return _model_as_it_is(mesh, about.st_size, about.st_mtime_ns)


def _portable(mesh: Any) -> Any:
    """What can be sent to a worker: an absolute path, a pair of arrays, or a list of those."""
    if isinstance(mesh, list):
        return [_portable(part) for part in mesh]
    if isinstance(mesh, (str, os.PathLike)):
        return os.path.abspath(os.fspath(mesh))
    if isinstance(mesh, Model):
        if not os.path.isfile(mesh.path):
            raise ValueError(f"{mesh!r} is of no file that workers could open: give vertices and triangles")
        return os.path.abspath(mesh.path)
    vertices, triangles = _parts_of(mesh)
    if is_on_device(vertices) or is_on_device(triangles):
        raise TypeError("blocks are drawn on CPUs: copy the mesh to the host, as with .cpu() or .get()")
    return to_numpy(vertices, "the array of vertices"), to_numpy(triangles, "the array of triangles")


def _block(
    mesh: Any, grid: Grid, draw: Callable[..., Any], options: dict[str, Any], block_info: Any = None
) -> np.ndarray:
    where = block_info[None]["array-location"]
    crop = grid.crop([begin for begin, _ in where], [end - begin for begin, end in where])
    result: np.ndarray = draw(_opened(mesh), crop, **options)
    return result


def _array(mesh: Any, grid: Grid, chunks: Any, dtype: Any, draw: Callable[..., Any], **options: Any) -> Any:
    if not isinstance(grid, Grid):
        raise TypeError(f"grid is a Grid, as fit() makes one, not {type(grid).__name__}")
    # A mesh that lies on the workers already (client.scatter, dask.delayed) stays there.
    is_there = dask.is_dask_collection(mesh) or type(mesh).__name__ == "Future"
    sent = dask.delayed(mesh if is_there else _portable(mesh), traverse=False)
    return da.map_blocks(
        _block,
        mesh=sent,
        grid=grid,
        draw=draw,
        options=options,
        chunks=da.core.normalize_chunks(chunks, grid.shape, dtype=dtype),
        dtype=dtype,
        meta=np.empty((0, 0, 0), dtype),
        name=f"voxelpipe-{draw.__name__}-{dask.base.tokenize(sent.key, grid.__getstate__(), options)}",
    )


def voxelize(
    mesh: MeshLike, grid: Grid, chunks: Any = "auto", coverage: Coverage = "conservative", *, threads: int = 1
) -> Any:
    """voxelpipe.voxelize() as a lazy array of bool, (nz, ny, nx).

    Args:
        mesh: what voxelize() takes, in host memory; or one that Dask has: dask.delayed(mesh), or the Future of
            client.scatter([mesh]). Every worker must be able to open a path.
        grid: the Grid of the whole.
        chunks: as everywhere in Dask: a number, (z, y, x), or "auto".
        coverage: as in voxelpipe.voxelize().
        threads: of one block; Dask computes several blocks at once.

    Returns:
        A dask.array.Array, whose blocks raise what voxelpipe.voxelize() raises.

    Example:
        >>> surface = vp.dask.voxelize(mesh, vp.fit(mesh, 2048), chunks=256)
        >>> surface.sum().compute()
    """
    return _array(mesh, grid, chunks, np.bool_, _surface.voxelize, coverage=coverage, threads=threads)


def solid(
    mesh: MeshLike,
    grid: Grid,
    chunks: Any = "auto",
    fill: Fill = "nonzero",
    *,
    extent: Extent = "outer",
    repair: Repair = "none",
    bodies: Bodies = "all",
    max_hole_edges: int | None = None,
    threads: int = 1,
) -> Any:
    """voxelpipe.solid() as a lazy array of bool, (nz, ny, nx).

    Args:
        mesh, grid, chunks, threads: as in voxelize() here.
        fill, extent, repair, bodies, max_hole_edges: as in voxelpipe.solid().

    Raises:
        ValueError: for repair="exterior", which floods the whole grid: that of a crop is not the crop of the whole.

    Example:
        >>> inside = vp.dask.solid("part.stl", vp.fit("part.stl", 4096), chunks=512)
        >>> inside.to_zarr("part.zarr")
    """
    if repair == "exterior":
        raise ValueError('repair="exterior" floods the whole grid, which no block sees: take voxelpipe.solid()')
    return _array(
        mesh,
        grid,
        chunks,
        np.bool_,
        _solid.solid,
        fill=fill,
        extent=extent,
        repair=repair,
        bodies=bodies,
        max_hole_edges=max_hole_edges,
        threads=threads,
        diagnose=False,
    )


def distance(
    mesh: MeshLike,
    grid: Grid,
    chunks: Any = "auto",
    band: Any = 3,
    sign: Sign = "nonzero",
    *,
    bodies: Bodies = "all",
    threads: int = 1,
) -> Any:
    """voxelpipe.distance() as a lazy array of float32, (nz, ny, nx), in the mesh's units.

    Args:
        mesh, grid, chunks, threads: as in voxelize() here.
        band, sign, bodies: as in voxelpipe.distance(), band="whole" too.

    Example:
        >>> field = vp.dask.distance("part.stl", vp.fit("part.stl", 2048), chunks=256)
        >>> (field < 0).sum().compute()
    """
    return _array(
        mesh, grid, chunks, np.float32, _distance.distance, band=band, sign=sign, bodies=bodies, threads=threads
    )


def fractions(
    mesh: MeshLike,
    grid: Grid,
    chunks: Any = "auto",
    *,
    bodies: Bodies = "all",
    repair: HoleRepair = "none",
    max_hole_edges: int | None = None,
    threads: int = 1,
) -> Any:
    """voxelpipe.fractions() as a lazy array of float32, (nz, ny, nx): how much of every voxel is inside.

    Args:
        mesh, grid, chunks, threads: as in voxelize() here.
        bodies: "all". "each" has an axis more, and is voxelpipe.fractions()'s.
        repair, max_hole_edges: as in voxelpipe.fractions(); each block closes the holes of the whole mesh.

    Raises:
        ValueError: for bodies="each".

    Example:
        >>> density = vp.dask.fractions("part.stl", vp.fit("part.stl", 2048), chunks=256)
        >>> density.map_blocks(np.sqrt).to_zarr("density.zarr")
    """
    if bodies != "all":
        raise ValueError(f'bodies is "all" for blocks (nz, ny, nx), not {bodies!r}: take voxelpipe.fractions()')
    options = {"bodies": bodies, "repair": repair, "max_hole_edges": max_hole_edges, "threads": threads}
    return _array(mesh, grid, chunks, np.float32, _fractions.fractions, **options)


class Outcome(NamedTuple):
    """What became of one model."""

    path: str
    """as it was given"""
    result: Any
    """what the function returned; None where it failed"""
    error: str | None
    """the last exception's type and text; None where the function returned"""
    attempts: int
    """how often the model was tried; 0 where its worker died, for then nobody counted"""


def _attempt(path: str, function: Callable[..., Any], options: dict[str, Any], retries: int) -> Outcome:
    for attempt in range(1, retries + 2):
        try:
            return Outcome(path, function(load_model(path), **options), None, attempt)
        except Exception as e:
            error = f"{type(e).__name__}: {e}"
    return Outcome(path, None, error, retries + 1)


def _cluster() -> Any:
    """The client that Dask uses by default, if there is one."""
    try:
        from distributed import default_client
    except ImportError:
        return None
    try:
        return default_client()
    except ValueError:
        return None


def map_models(
    paths: Sequence[Any], function: Callable[..., Any], *, retries: int = 0, **options: Any
) -> list[Outcome]:
    """Calls ``function(model, **options)`` for every file, on the cluster of Dask's client where there is one, and
    else on threads of this process.

    A model that cannot be read, a function that raises, and on a cluster a worker that dies, are outcomes with an error;
    the others go on.

    Args:
        paths: the models' files. Every worker must be able to open them.
        function: takes a Model, which every function here takes for a mesh. Its result should be small: it comes back.
        retries: how often a model that failed is tried again.
        options: given to the function.

    Returns:
        A list of Outcome, in the order of the paths.

    Example:
        >>> def volume(model, resolution):
        ...     grid = vp.fit(model, resolution)
        ...     return float(vp.fractions(model, grid).sum() * np.prod(grid.voxel_size))
        >>> for o in vp.dask.map_models(sorted(glob.glob("parts/*.stl")), volume, resolution=128):
        ...     print(o.path, o.result if o.error is None else o.error)
    """
    if retries < 0:
        raise ValueError(f"retries is 0 or more, not {retries}")
    names = [os.fspath(path) for path in paths]
    client = _cluster()
    if client is None:
        task = dask.delayed(_attempt, pure=False)
        return list(dask.compute(*(task(name, function, options, retries) for name in names)))
    absolute = [os.path.abspath(name) for name in names] # a worker may have another folder
    futures = [client.submit(_attempt, path, function, options, retries, pure=False) for path in absolute]
    outcomes = []
    for name, future in zip(names, futures):
        failure = future.exception()  # waits
        if failure is None:
            outcomes.append(future.result()._replace(path=name))
        else:
            outcomes.append(Outcome(name, None, f"{type(failure).__name__}: {failure}", 0))
        future.release()
    return outcomes
