# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Models by path, read by the readers of the voxelize tool."""

from __future__ import annotations

import errno
import os
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Optional

import numpy as np

from . import _core
from ._inputs import note_model


class ModelWarning(UserWarning):
    """A model's file was read, but not all of it, or something was put right."""


@dataclass(frozen=True)
class Material:
    """A material of a Model."""

    name: str
    base_color: tuple[float, float, float, float]
    """Linear red, green, blue and alpha; multiplies texture and colours of vertices."""
    texture: Optional[int]
    """Number of its texture."""
    alpha: str
    """"opaque", "mask" (discards what is below alpha_cutoff) or "blend"."""
    alpha_cutoff: float
    double_sided: bool


@dataclass(frozen=True)
class Texture:
    """A picture of a Model, and how it is sampled."""

    picture: int
    wrap_u: str
    wrap_v: str
    """"repeat", "clamp" or "mirror"."""
    filter: str
    """"linear" or "nearest"."""


@dataclass(frozen=True)
class Part:
    """Triangles of a Model with one material, in its order: an instance of a mesh of the file."""

    name: str
    material: int
    first_vertex: int
    first_triangle: int
    num_triangles: int


class Model:
    """A model as load_model() reads it. Functions take it as a mesh. Nothing of it changes.

        model = vp.load_model("lighthouse.glb")
        grid = vp.fit(model, 128)
        color = vp.bake(model, grid)["color"]
    """

    def __init__(self, path: str, scene: Any) -> None:
        self.path: str = path
        """As it was given."""
        self._scene = scene

    def __repr__(self) -> str:
        return f"Model({self.path!r}: {len(self.vertices)} vertices, {len(self.faces)} triangles)"

    @cached_property
    def vertices(self) -> np.ndarray:
        """(v, 3) world positions: float32, or float64 where that holds positions that float32 does not."""
        return narrowed(self._scene.vertices)

    @cached_property
    def faces(self) -> np.ndarray:
        """(f, 3) int32 vertex numbers, counter-clockwise seen from the front."""
        triangles: np.ndarray = self._scene.triangles
        return triangles.view(np.int32) if len(self.vertices) < 2**31 else triangles.astype(np.int64)

    @cached_property
    def lines(self) -> np.ndarray:
        """(l, 2) int32 vertex numbers of line segments; a point is a line from a vertex to itself."""
        lines: np.ndarray = self._scene.lines
        return lines.view(np.int32) if len(self.vertices) < 2**31 else lines.astype(np.int64)

    @cached_property
    def colors(self) -> Optional[np.ndarray]:
        """(v, 4) float32 linear colours and alpha of vertices, white where a part has none; None where no part has any."""
        colors: Optional[np.ndarray] = self._scene.colors
        return colors

    @cached_property
    def uv(self) -> Optional[np.ndarray]:
        """(v, 2) float32 texture coordinates from the picture's top left corner; None where no part has any."""
        uv: Optional[np.ndarray] = self._scene.texcoords
        return uv

    @cached_property
    def parts(self) -> list[Part]:
        """What the file is made of, in the order of vertices and triangles."""
        return [Part(*p) for p in self._scene.parts]

    @cached_property
    def face_materials(self) -> np.ndarray:
        """(f,) int32 material numbers."""
        return np.repeat(
            np.array([p.material for p in self.parts], np.int32),
            np.array([p.num_triangles for p in self.parts], np.int64),
        )

    @cached_property
    def materials(self) -> list[Material]:
        """The file's materials, and the default one where that is needed."""
        return [
            Material(name, color, None if texture < 0 else texture, alpha, cutoff, double_sided)
            for name, color, texture, alpha, cutoff, double_sided in self._scene.materials
        ]

    @cached_property
    def textures(self) -> list[Texture]:
        """Textures, by the numbers that materials name."""
        return [Texture(*t) for t in self._scene.textures]

    @cached_property
    def pictures(self) -> list[np.ndarray]:
        """Pictures, by the numbers that textures name: (height, width, 4) uint8, sRGB and alpha, the top row first."""
        return list(self._scene.pictures)

    @property
    def warnings(self) -> list[str]:
        """What was left out or put right, one line each; load_model() has warned of them."""
        return list(self._scene.warnings)


def narrowed(v: np.ndarray) -> np.ndarray:
    """Doubles as float32, where that loses nothing."""
    with np.errstate(over="ignore"):
        single = v.astype(np.float32)
    return np.ascontiguousarray(single if np.array_equal(single.astype(np.float64), v, equal_nan=True) else v)


def formats_read() -> str:
    """What load_model() reads, for messages."""
    named = ".glb, .gltf, .obj, .ply, .stl and .off"
    if _core.Scene.is_read(".fbx"):
        return f"{named}, and by assimp .dae, .3mf, .fbx, .3ds and others"
    return named


def _is_gltf(path: str) -> bool:
    with open(path, "rb") as f:
        head = f.read(64)
    return head.startswith(b"glTF") or head.lstrip().startswith(b"{")


def read_scene(path: str, lenient: bool, stacklevel: int) -> Any:
    """The scene of a file, whose warnings are issued."""
    if not os.path.exists(path):
        raise FileNotFoundError(errno.ENOENT, "there is no model", path)
    if os.path.isdir(path):
        raise IsADirectoryError(errno.EISDIR, "a model is a file", path)
    extension = os.path.splitext(path)[1].lower()
    if not _core.Scene.is_read(extension) and not _is_gltf(path):
        raise ValueError(f"{path}: models are read from {formats_read()}, not from {extension or 'a file without an extension'}")
    note_model(path, _core.Scene.files_of(path))
    scene = _core.Scene.load(path, lenient)
    for text in scene.warnings:
        warnings.warn(f"{path}: {text}", ModelWarning, stacklevel=stacklevel + 1)
    return scene


def load_model(path: str | os.PathLike[str], *, lenient: bool = False) -> Model:
    """Reads a model by the readers of the voxelize tool: vertices and triangles in world units, as its file places them,
    with materials, textures, colours, lines and points.

    Functions that are given a path read it in the same way, at each call; a Model is read once.

    Args:
        path: .glb, .gltf, .obj, .ply, .stl or .off; and what assimp reads, where the package was built with it.
        lenient: faults of the file that can be put right become warnings.

    Returns:
        A Model, which functions take as a mesh.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: the format is not known, or the file is damaged; the message says where.

    Warns with ModelWarning of what was left out or put right.

    Example:
        >>> model = vp.load_model("lighthouse.glb")
        >>> inside = vp.solid(model, vp.fit(model, 128))
        >>> [m.name for m in model.materials]
    """
    name = os.fspath(path)
    return Model(name, read_scene(name, lenient, 2))
