# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Voxels as a page for the browser; page.html, which the voxelize tool writes too, says what data it takes."""

from __future__ import annotations

import base64
import html
import json
import pathlib
import zlib
from typing import Any

import numpy as np

from ._core import Grid
from ._types import Up, check_choice, check_grid
from ._inputs import refuse_input
from ._listed import listed


class View:
    """A page that shows voxels: of itself in a notebook, or as a file by save()."""

    def __init__(self, page: str) -> None:
        self.html = page

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.html)}" width="100%" height="480" style="border:0"></iframe>'

    def save(self, path: str) -> None:
        refuse_input(str(path))
        pathlib.Path(path).write_text(self.html, encoding="utf-8")


def _spread(n: np.ndarray) -> np.ndarray:
    """Bit i to bit 3 i."""
    result = np.zeros_like(n)
    for i in range(21):
        result |= ((n >> i) & 1) << (3 * i)
    return result


def _page_values(a: np.ndarray) -> tuple[str, np.ndarray]:
    kinds = {"uint8": "u8", "uint32": "u32", "int32": "i32", "float32": "f32"}
    if a.dtype.name not in kinds:
        a = a.astype(np.float32)
    return kinds[a.dtype.name], a


def view(values: Any, grid: Grid, *, occupied: Any = None, up: Up = "y", name: str = "voxels") -> View:
    """A page that shows voxels in a browser and in a notebook, without a network: turned by mouse, fingers and keys, cut along
    an axis, with a list of the values.

    Args:
        values: an array (nz, ny, nx) or (nz, ny, nx, columns), a dict of arrays, or what sparse() returned. Three or four
            columns of uint8 are colours, three of floats directions; other numbers are shown by a colour map.
        grid: the Grid of the values.
        occupied: the voxels to show, bool; by default those whose value is not zero.
        up: the axis that stands upright.
        name: the page's title.

    Returns:
        A View, which a notebook shows; save(path) writes it.

    Example:
        >>> vp.view(vp.bake("lighthouse.glb", grid), grid)
    """
    check_choice("up", up, Up)
    check_grid(grid, "view")
    voxels, rows = listed(values, occupied, grid)
    key = sum(_spread(voxels[:, axis].astype(np.int64)) << axis for axis in range(3))
    order = np.argsort(key, kind="stable")
    key = np.asarray(key)[order]
    bricks, first = np.unique(key >> 9, return_index=True)
    positions = (voxels[order][first] >> 3).astype("<u4")
    bits = np.zeros((len(bricks), 512), np.uint8)
    bits[np.searchsorted(bricks, key >> 9), key & 511] = 1
    data = [np.ascontiguousarray(positions.T).tobytes(), np.packbits(bits, axis=1, bitorder="little").tobytes()]
    channels = []
    for label, a in rows.items():
        if a.dtype == np.bool_:
            continue
        kind, a = _page_values(a[order])
        channels.append({"name": label, "type": kind, "components": 1 if a.ndim == 1 else a.shape[1]})
        data.append(np.ascontiguousarray(a).tobytes())
    shape = {
        "name": name,
        "extent": list(grid.shape[::-1]),
        "voxel_size": list(grid.voxel_size),
        "up": up,
        "bricks": len(bricks),
        "voxels": len(key),
        "channels": channels,
    }
    packer = zlib.compressobj(6, zlib.DEFLATED, -15)
    packed = b"".join([packer.compress(part) for part in data] + [packer.flush()])
    page = (pathlib.Path(__file__).parent / "page.html").read_text(encoding="utf-8")
    page = page.replace("/*shape*/", json.dumps(shape).replace("<", "\\u003c"))
    return View(page.replace("/*data*/", base64.b64encode(packed).decode("ascii")))
