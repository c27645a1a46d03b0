# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Types of arguments, and checks whose messages name the argument and what was expected."""

from __future__ import annotations

import math
import operator
import os
from typing import Any, List, Literal, Mapping, Protocol, Sequence, Tuple, Union, get_args

import numpy as np

from ._core import Grid

Coverage = Literal["conservative", "thin", "crosshair", "diagonal"]
Fill = Literal["nonzero", "even_odd", "positive"]
Sign = Literal["nonzero", "even_odd", "positive", "unsigned"]
Extent = Literal["outer", "centre", "center", "inner"]
Repair = Literal["none", "close_holes", "exterior", "vote", "winding"]
# Those that leave a mesh.
HoleRepair = Literal["none", "close_holes"]
Bodies = Literal["all", "each"]
# What fractions() measures of every voxel.
CellValue = Literal[
    "fraction",
    "area_vector",
    "aperture_x",
    "aperture_y",
    "aperture_z",
    "face_centroid_x",
    "face_centroid_y",
    "face_centroid_z",
    "centroid",
    "area",
    "area_centroid",
    "multi_cut",
]
# What sparse_fractions() lists of voxels.
ListedCellValue = Literal["fraction", "centroid", "area", "area_centroid", "multi_cut"]
Place = Literal["corner", "mean", "sharp"]
Border = Literal["closed", "open"]
Blend = Literal["mean", "sum", "min", "max", "last"]
Per = Literal["vertex", "triangle"]
Up = Literal["y", "z"]
# Values that a model has by itself, as the voxelize tool computes them (--target).
OwnValue = Literal[
    "occupancy",
    "count",
    "color",
    "color-max",
    "color-replace",
    "color-outer",
    "normal",
    "material",
    "triangle",
    "depth",
]


class TensorLike(Protocol):
    """A tensor of torch."""

    def detach(self) -> Any: ...

    def requires_grad_(self, requires_grad: bool = ...) -> Any: ...


class HasFaces(Protocol):
    """A mesh of trimesh, or a Model."""

    @property
    def vertices(self) -> Any: ...

    @property
    def faces(self) -> Any: ...


class HasTriangles(Protocol):
    """A mesh of Open3D."""

    @property
    def vertices(self) -> Any: ...

    @property
    def triangles(self) -> Any: ...


class HasTensors(Protocol):
    """A mesh of Open3D's tensors."""

    @property
    def vertex(self) -> Any: ...

    @property
    def triangle(self) -> Any: ...


class HasPoints(Protocol):
    """A mesh of PyVista."""

    @property
    def points(self) -> Any: ...

    @property
    def is_all_triangles(self) -> Any: ...


class IsScene(Protocol):
    """A scene of trimesh."""

    @property
    def geometry(self) -> Any: ...

    @property
    def graph(self) -> Any: ...


TensorMesh = Tuple[TensorLike, TensorLike]
# Types that functions take as a mesh; see as_mesh.
MeshLike = Union[
    Tuple[Any, Any], str, "os.PathLike[str]", HasFaces, HasTriangles, HasTensors, HasPoints, IsScene, List[Any]
]
BlendLike = Union[Blend, Mapping[str, Blend], None]
OwnValues = Union[OwnValue, Sequence[OwnValue], None]


def check_choice(what: str, value: Any, choices: Any) -> None:
    """Raises ValueError that lists the choices of a Literal."""
    names = get_args(choices)
    if not isinstance(value, str) or value not in names:
        raise ValueError(f"{what} is one of {', '.join(map(repr, names))}, not {value!r}")


def check_grid(grid: Any, call: str) -> Grid:
    """Raises TypeError for what is no Grid. `call`: the function, for a hint."""
    if isinstance(grid, Grid):
        return grid
    hint = f": {call}(mesh, fit(mesh, {grid}))" if isinstance(grid, (int, np.integer)) else ""
    raise TypeError(f"grid is a Grid, as fit() makes it, not {type(grid).__name__}{hint}")


def whole_number(what: str, value: Any, least: int = 0, expected: str = "", most: int = 2**31 - 1) -> int:
    """Raises TypeError for what is no whole number, ValueError for one that is too small or too large."""
    try:
        n = operator.index(value)
    except TypeError:
        if isinstance(value, float):
            raise ValueError(f"{what} is a whole number, not {value!r}") from None
        raise TypeError(f"{what} is a whole number, not {type(value).__name__}") from None
    if n < least or n > most:
        raise ValueError(f"{what} is {expected or f'{least} or more'}, not {n}")
    return n


def real_number(what: str, value: Any) -> float:
    """Raises TypeError for what is no number, ValueError for one that is not finite."""
    try:
        x = float(value) if not isinstance(value, (str, bytes)) else None
    except (TypeError, ValueError):
        x = None
    if x is None:
        raise TypeError(f"{what} is a number, not {type(value).__name__}")
    if not math.isfinite(x):
        raise ValueError(f"{what} is a finite number, not {x!r}")
    return x


def check_picture(size: Any, azimuth: Any, elevation: Any, zoom: Any) -> None:
    """The arguments of pictures. Raises TypeError or ValueError that names the argument."""
    if isinstance(size, (str, bytes)) or not hasattr(size, "__len__") or len(size) != 2:
        raise TypeError(f"size is a width and a height in pixels, such as (640, 480), not {size!r}")
    for side in size:
        whole_number("a side of size", side, 1)
    for what, value in (("azimuth", azimuth), ("elevation", elevation), ("zoom", zoom)):
        real_number(what, value)


def check_threads(threads: Any) -> int:
    return whole_number("threads", threads, 0, "0 (all cores) or more")


def check_solid_numbers(max_hole_edges: Any, closing: Any) -> None:
    if max_hole_edges is not None:
        whole_number("max_hole_edges", max_hole_edges, most=2**64 - 1)
    whole_number("closing", closing, 0, "0 to 64", 64)


def check_status(status: Any) -> None:
    if status is not None and not isinstance(status, dict):
        raise TypeError(f"status is a dict that is filled with counters, not {type(status).__name__}")


def check_call(call: str, grid: Any, coverage: Any, threads: Any, status: Any) -> None:
    """The arguments that most functions have."""
    check_grid(grid, call)
    check_choice("coverage", coverage, Coverage)
    check_threads(threads)
    check_status(status)
