# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Voxels as files and pictures."""

from __future__ import annotations

import os
import re
import struct
import warnings
import zlib
from typing import Any, Iterable, Mapping

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import to_numpy
from ._axes import as_voxels, dense
from ._core import Grid
from ._inputs import refuse_input
from ._listed import check_list, check_shapes, is_list, listed, named, occupied_of
from ._types import Up, check_choice, check_grid, check_picture, check_threads, whole_number
from ._view import view


class WriteError(OSError, ValueError):
    """A file could not be written: the disk refuses, or the format does not hold these voxels."""


class _Format:
    """A row of the tool's table of formats."""

    def __init__(self, row: tuple[str, str, bool, bool, bool, bool, bool, bool]) -> None:
        (
            self.extension,
            self.description,
            self.needs_occupancy,
            self.all_channels,
            self.shows_colors,
            self.needs_cubes,
            self.only_sparse,
            self.has_materials,
        ) = row


_formats = {row[0]: _Format(row) for row in _core.formats()}


def formats() -> dict[str, str]:
    """The formats that save() writes, by extension: those of the voxelize tool.

    Example:
        >>> vp.formats()[".vox"]
    """
    return {f.extension: f.description for f in _formats.values()}


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
    up: Up = "y",
    background: str = "sky",
    threads: int = 0,
) -> npt.NDArray[np.uint8]:
    """A picture of voxels: uint8, (height, width, 3), or 4 with background="transparent".

    Args:
        values: bool (nz, ny, nx), which is shown in one colour; or colours (nz, ny, nx, 3 or 4), uint8 or floats from 0
            to 1; or a dict of those.
        grid: the Grid of the values.
        occupied: the voxels to show, bool; by default those whose value is not zero.
        size: width and height in pixels.
        azimuth, elevation: where the viewer stands, in degrees.
        zoom: 1 fits the voxels into the picture.
        up: "y" or "z".
        background: "sky", "white", "dark", "transparent", "#rrggbb", or "#rrggbb,#rrggbb" from top to bottom.
        threads: 0 takes all cores.

    Example:
        >>> picture = vp.render(vp.bake("lighthouse.glb", grid), grid, size=(640, 480))
    """
    check_grid(grid, "render")
    check_picture(size, azimuth, elevation, zoom)
    check_choice("up", up, Up)
    check_threads(threads)
    arrays = named(values)
    check_shapes(values, arrays, occupied, grid)
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


def _held(extension: str, name: str, a: np.ndarray) -> np.ndarray:
    """Rows as files of the tool hold them."""
    if extension == ".nvdb" or extension == ".vdb":
        if a.dtype == np.uint8 and a.ndim > 1 and a.shape[-1] == 3:
            return np.concatenate([a, np.full((*a.shape[:-1], 1), 255, np.uint8)], axis=-1)
        if a.dtype.kind == "f":
            return np.ascontiguousarray(a, np.float32)
        if a.dtype.kind in "iu" and a.dtype.itemsize < 4 and not (a.ndim > 1 and a.shape[-1] == 4):
            return a.astype(np.int32 if a.dtype.kind == "i" else np.uint32)
        if a.dtype == np.uint64:
            return a.astype(np.int64)
    if a.dtype == np.bool_:
        return a.astype(np.uint8)
    if a.dtype == np.float16:
        return a.astype(np.float32)
    if a.dtype in (np.int8, np.int16):
        return a.astype(np.int32)
    if a.dtype.kind not in "fiu":
        raise ValueError(f"{name}: files hold numbers, not {a.dtype}")
    return np.ascontiguousarray(a)


def _channels(f: _Format, arrays: Mapping[str, np.ndarray], axes: int) -> list[tuple[str, np.ndarray]]:
    """The channels beside the occupancy. axes: of values with one number a voxel."""
    rest = {name: a for name, a in arrays.items() if not (name == "occupancy" and a.dtype == np.bool_)}
    if f.all_channels:
        return [(name, _held(f.extension, name, a)) for name, a in rest.items()]
    if f.has_materials:
        return [(name, np.ascontiguousarray(a, np.int32)) for name, a in rest.items() if name == "material" and a.ndim == axes]
    colors = next((a for a in rest.values() if a.ndim == axes + 1 and a.shape[-1] in (3, 4)), None)
    return [("color", np.ascontiguousarray(_as_colors(colors)))] if f.shows_colors and colors is not None else []


def _write_by_tool(path: str, f: _Format, values: Any, grid: Grid, occupied: Any, how: tuple[Any, ...]) -> list[str]:
    sizes = grid.voxel_size
    if f.needs_cubes and max(sizes) - min(sizes) > 1e-9 * min(sizes):
        raise ValueError(f"{path}: {f.extension} has one voxel size for all axes, the grid's are {sizes}")
    if is_list(values) or f.only_sparse:
        voxels, rows = listed(values, occupied, grid)
        channels = _channels(f, rows, 1)
        _refuse_inputs(path, grid, [n for n, _ in channels])
        return _told(*_core.write_list(WriteError, path, grid, voxels, channels, *how))
    arrays = named(values)
    check_shapes(values, arrays, occupied, grid)
    mask = None
    if f.needs_occupancy or any(n == "occupancy" and a.dtype == np.bool_ for n, a in arrays.items()):
        mask = np.ascontiguousarray(occupied_of(arrays, occupied)).view(np.uint8)
    channels = _channels(f, arrays, 3)
    _refuse_inputs(path, grid, [n for n, _ in channels] + ["occupancy"] * (mask is not None))
    return _told(*_core.write_dense(WriteError, path, grid, mask, channels, *how))


def _told(files: Iterable[str], texts: Iterable[str]) -> list[str]:
    """The files of save(), which warns of what readers of their format do not show."""
    for text in texts:
        warnings.warn(text, stacklevel=4)
    return list(files)


def _refuse_inputs(path: str, grid: Grid, channels: list[str]) -> None:
    """Raises ValueError if a file that the output becomes is one that a model was read from."""
    files, numbered = _core.names_of(path, grid, channels)
    for file in files:
        refuse_input(file)
    for folder, prefix, suffix in numbered:
        pattern = re.compile(re.escape(prefix) + "[0-9]+" + re.escape(suffix))
        for name in os.listdir(folder or "."):
            if pattern.fullmatch(name):
                refuse_input(os.path.join(folder, name))


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


def _write_npy(path: str, values: Any, grid: Grid, extension: str) -> None:
    """.npy and .npz: arrays as they are."""
    coords = {"coords": to_numpy(values[0], "voxels")} if is_list(values) else {}
    arrays = named(values[1] if is_list(values) else values)
    if not coords:
        check_shapes(values, arrays, None, grid)
    if extension == ".npz":
        _check_names(path, arrays, ("origin", "voxel_size", *coords))
    arrays = {**coords, **arrays}
    if extension == ".npy" and len(arrays) != 1:
        raise ValueError(f"{path}: .npy holds one array; .npz holds several")
    with _replacing(path) as temporary, open(temporary, "wb") as f:
        if extension == ".npz":
            np.savez_compressed(f, origin=grid.origin, voxel_size=grid.voxel_size, **arrays)  # type: ignore[arg-type]
        else:
            np.save(f, np.asarray(next(iter(arrays.values()))))


class _replacing:
    """The name of a file beside `path` that takes its place at the end, or goes. Errors name `path`."""

    def __init__(self, path: str) -> None:
        self.path, self.temporary = path, f"{path}.{os.getpid()}.part"

    def __enter__(self) -> str:
        folder = os.path.dirname(self.path) or "."
        if not os.path.isdir(folder):
            raise FileNotFoundError(2, "there is no such folder", self.path)
        return self.temporary

    def __exit__(self, kind: Any, error: Any, traceback: Any) -> None:
        if kind is None:
            os.replace(self.temporary, self.path)
            return
        if os.path.exists(self.temporary):
            os.remove(self.temporary)
        if isinstance(error, OSError) and error.filename == self.temporary:
            error.filename = self.path


def save(
    path: str | os.PathLike[str],
    values: Any,
    grid: Grid,
    *,
    occupied: Any = None,
    compression: int = 1,
    merge: bool = False,
    points: bool = False,
    levels: bool = False,
    pieces: int = 0,
    up: Up | None = None,
    threads: int = 0,
    name: str | None = None,
    size: tuple[int, int] | None = None,
    azimuth: float | None = None,
    elevation: float | None = None,
    zoom: float | None = None,
    background: str | None = None,
) -> list[str]:
    """Writes voxels to a file, in any format of the voxelize tool, as its name ends (formats() lists them). The file
    appears whole or not at all. A file that a model was read from in this process (the path of a mesh, and what that file
    names), or that holds one of the values (numpy.memmap), is not replaced: ValueError.

    "FOLDER/{z}.png": a grey picture of each layer, 0000.png and so on, y upwards: of bools 0 and 255, of floats from 0 to 1 in
    16 bits, uint8 and uint16 as they are. .npy: one array, as it is. .npz: the arrays by name, with origin and voxel_size.
    .nvdb (NanoVDB): the occupied voxels with their values, a grid for each name. .png: a picture, see render(). .html: a page,
    see view(). .vti, .pvti, .nrrd, .nii, .nii.gz and .zarr: all arrays; .nii takes x, y and z for LPS, as the tool does. .vox,
    .schem, .litematic, .binvox, .glb, .obj, .ply, .stl, .3mf, .xyz: the occupied voxels, with the first array of colours where
    the format has any. .vtu, .inp, .msh: a hexahedron for each occupied voxel, with all arrays (.vtu) or with sets by the
    numbers of the array "material"; occupied=fractions >= 0.5 makes them of fractions.

    Args:
        path: the file. Formats with one array a file write "a.NAME.nrrd" and so on for several.
        values: an array, a dict of arrays, or what sparse() returned.
        grid: the Grid of the values.
        occupied: bool (nz, ny, nx); by default the voxels whose value is not zero.
        compression: zlib level of .vti, .vtu, .nrrd, .nii.gz, .zarr, .3mf, .schem and .litematic, 0 to 9.
        merge: .ply, .obj, .glb, .stl, .3mf: coplanar faces of equal colour become one rectangle.
        points: .ply holds the voxels' centres.
        levels: .zarr holds mip levels, too.
        pieces: .pvti, .nvdb: slabs along z.
        up: the axis that stands upright in .vox, .schem, .litematic, .png and .html: "y" or "z".
        threads: 0 takes all cores.
        name: the title of .html.
        size, azimuth, elevation, zoom, background: of .png, as in render().

    Returns:
        The names of the files.

    Raises:
        ValueError: the format is not known, or the values do not fit it.
        OSError: the file cannot be written. WriteError, of the tool's writers, is both.

    Warns where the file is written, but readers of its format do not show all of it.

    Example:
        >>> vp.save("lighthouse.vox", vp.bake("lighthouse.glb", grid), grid)
        >>> vp.save("surface.png", color, grid, occupied=surface, size=(640, 480))
    """
    check_grid(grid, "save")
    check_threads(threads)
    whole_number("compression", compression, 0, "0 to 9", 9)
    whole_number("pieces", pieces)
    if up is not None:
        check_choice("up", up, Up)
    if is_list(values):
        check_list(values, occupied, grid)
    target = os.fspath(path)
    extension = ".nii.gz" if target.lower().endswith(".nii.gz") else os.path.splitext(target)[1].lower()
    if "{z}" in os.path.basename(target):
        extension = "{z}" + extension
    if extension not in _formats:
        raise ValueError(f"{target}: the formats are {', '.join(_formats)}")
    view_of = {"size": size, "azimuth": azimuth, "elevation": elevation, "zoom": zoom, "background": background}
    looks = {key: value for key, value in view_of.items() if value is not None}
    if looks and extension != ".png":
        raise TypeError(f"{', '.join(looks)}: for .png only")
    if name is not None and extension != ".html":
        raise TypeError("name: for .html only")
    folder = os.path.dirname(target) or "."
    if not os.path.isdir(folder):
        raise FileNotFoundError(2, "there is no such folder", target)
    refuse_input(target)
    if os.path.exists(target):
        _refuse_mapped(target, values)
    if extension in (".npy", ".npz"):
        _write_npy(target, values, grid, extension)
    elif extension == ".html":
        stem = os.path.splitext(os.path.basename(target))[0] if name is None else name
        with _replacing(target) as temporary:
            view(values, grid, occupied=occupied, name=stem, up=up or "y").save(temporary)
    elif extension == ".png":
        if is_list(values):
            values, occupied = _dense_of(values, grid)
        picture = render(values, grid, occupied=occupied, up=up or "y", threads=threads, **looks)  # type: ignore[arg-type]
        with _replacing(target) as temporary, open(temporary, "wb") as f:
            f.write(png_bytes(picture))
    else:
        how = (compression, merge, points, levels, pieces, up or "y", threads)
        return _write_by_tool(target, _formats[extension], values, grid, occupied, how)
    return [target]


def _dense_of(values: Any, grid: Grid) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The arrays of a list, and its voxels."""
    voxels = as_voxels(values[0], "voxels")
    mask: np.ndarray = dense(voxels, True, grid)
    return {"occupancy": mask, **{n: dense(voxels, to_numpy(a, n), grid) for n, a in values[1].items()}}, mask
