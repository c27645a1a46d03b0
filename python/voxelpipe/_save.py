# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Voxels as files and pictures."""

from __future__ import annotations

import os
import struct
import zlib
from typing import Any, Iterable, Mapping

import numpy as np

from . import _core
from ._core import Grid
from ._inputs import refuse_input
from ._listed import is_list, listed, named, occupied_of
from ._mesh import to_numpy
from ._view import view

FORMATS = (".npy", ".npz", ".nvdb", ".png", ".html")


def _as_colors(a: np.ndarray) -> np.ndarray:
    """uint8 colours; floats are from 0 to 1."""
    if a.dtype.kind == "f":
        return np.rint(np.clip(np.nan_to_num(a), 0, 1) * 255).astype(np.uint8)
    return a.astype(np.uint8, copy=False)


def render(
    values: Any,
    grid: Grid,
    *,
    occupied: Any = None,
    size: tuple[int, int] = (1280, 960),
    azimuth: float = 35,
    elevation: float = 25,
    zoom: float = 1,
    up: str = "y",
    background: str = "sky",
    threads: int = 0,
) -> np.ndarray:
    """A picture of voxels: uint8, (height, width, 3), or 4 with background="transparent".

    values: bool (nz, ny, nx), which is shown in one colour; or colours (nz, ny, nx, 3 or 4), uint8 or floats from 0 to
        1; or a dict of those.
    occupied: the voxels to show, bool; by default those whose value is not zero.
    size: width and height in pixels. azimuth, elevation: where the viewer stands, in degrees. up: "y" or "z".
    background: "sky", "white", "dark", "transparent", "#rrggbb", or "#rrggbb,#rrggbb" from top to bottom.
    """
    arrays = named(values)
    shown = np.ascontiguousarray(occupied_of(arrays, occupied)).view(np.uint8)
    colors = next((a for a in arrays.values() if a.ndim == 4 and a.shape[-1] in (3, 4)), None)
    if colors is not None:
        colors = np.ascontiguousarray(_as_colors(colors))
    return _core.render(
        shown, colors, grid, size[0], size[1], azimuth, elevation, zoom, up, background, threads
    )  # fmt: skip


def png_bytes(picture: np.ndarray) -> bytes:
    """A picture (height, width, 3 or 4) of uint8 as a PNG file."""
    height, width, components = picture.shape

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = np.zeros((height, 1 + width * components), np.uint8)  # each row: no filter, then its pixels
    rows[:, 1:] = picture.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[components], 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def _nvdb_values(name: str, a: np.ndarray) -> np.ndarray | None:
    """Rows as .nvdb has them; None for a mask."""
    if a.dtype == np.bool_:
        return None
    rows = a.reshape(len(a), -1)
    if rows.dtype == np.uint8 and rows.shape[1] in (3, 4):
        if rows.shape[1] == 3:
            rows = np.concatenate([rows, np.full((len(rows), 1), 255, np.uint8)], axis=1)
    elif rows.dtype.kind == "f":
        rows = rows.astype(np.float32, copy=False)
    elif rows.dtype.kind in "iu" and rows.shape[1] == 1:
        kind = np.uint32 if rows.dtype.kind == "u" else np.int32
        if rows.size and (rows.min() < np.iinfo(kind).min or rows.max() > np.iinfo(kind).max):
            raise ValueError(f"{name}: .nvdb holds integers of 32 bits")
        rows = rows.astype(kind)
    return np.ascontiguousarray(rows)


def _refuse_mapped(path: str, values: Any) -> None:
    """Raises ValueError if an array of the values lies in this file (numpy.memmap)."""
    parts = values.values() if isinstance(values, Mapping) else values if isinstance(values, tuple) else [values]
    for part in parts:
        if isinstance(part, (Mapping, tuple)):
            _refuse_mapped(path, part)
        while part is not None:
            file = getattr(part, "filename", None)
            if isinstance(part, np.memmap) and file is not None and os.path.exists(file) and os.path.samefile(file, path):
                raise ValueError(f"{path} holds an array that is being saved; give another name")
            part = getattr(part, "base", None)


def _check_names(path: str, arrays: Iterable[str], own: Iterable[str]) -> None:
    """Raises ValueError for an array of a .npz with a name that is taken, so that one would replace the other."""
    for name in arrays:
        if name in own:
            raise ValueError(f"{path}: {name!r} is the name of an array that save() adds; give another name")
        if name in ("file", "allow_pickle"):
            raise ValueError(f"{path}: numpy writes no array with the name {name!r}; give another name")


def save(path: str | os.PathLike[str], values: Any, grid: Grid, *, occupied: Any = None, **options: Any) -> None:
    """Writes voxels to a file, as its name ends. The file appears whole or not at all. A file that a model was read from in
    this process (the path of a mesh, and what that file names), or that holds one of the values (numpy.memmap), is not
    replaced: ValueError.

    .npy: one array, as it is. .npz: the arrays by name, with origin and voxel_size. .nvdb (NanoVDB): the occupied
    voxels with their values, a grid for each name. .png: a picture, with the parameters of render(). .html: a page, with those
    of view().

    values: an array, a dict of arrays, or what sparse() returned. occupied: bool (nz, ny, nx); by default the voxels
    whose value is not zero.
    """
    name = os.fspath(path)
    extension = os.path.splitext(name)[1].lower()
    if extension not in FORMATS:
        raise ValueError(f"{name}: the formats are {', '.join(FORMATS)}; the voxelize tool has more")
    if options and extension not in (".png", ".html"):
        raise TypeError(f"{', '.join(options)}: for .png and .html only")
    refuse_input(name)
    if os.path.exists(name):
        _refuse_mapped(name, values)
    temporary = f"{name}.{os.getpid()}.part"
    try:
        if extension == ".nvdb":
            voxels, rows = listed(values, occupied)
            _core.write_nvdb(temporary, grid, voxels, [(n, _nvdb_values(n, a)) for n, a in rows.items()])
        elif extension == ".html":
            stem = os.path.splitext(os.path.basename(name))[0]
            view(values, grid, occupied=occupied, name=stem, **options).save(temporary)
        elif extension == ".png":
            with open(temporary, "wb") as f:
                f.write(png_bytes(render(values, grid, occupied=occupied, **options)))
        else:
            coords = {"coords": to_numpy(values[0], "voxels")} if is_list(values) else {}
            arrays = named(values[1] if is_list(values) else values)
            if extension == ".npz":
                _check_names(name, arrays, ("origin", "voxel_size", *coords))
            arrays = {**coords, **arrays}
            with open(temporary, "wb") as f:
                if extension == ".npz":
                    np.savez_compressed(f, origin=grid.origin, voxel_size=grid.voxel_size, **arrays)  # type: ignore[arg-type]
                elif len(arrays) != 1:
                    raise ValueError(f"{name}: .npy holds one array; .npz holds several")
                else:
                    np.save(f, next(iter(arrays.values())))
        os.replace(temporary, name)
    except BaseException:
        if os.path.exists(temporary):
            os.remove(temporary)
        raise
