# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The colours that meshes of other libraries have by themselves, as a scene of the tool."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _core
from ._arrays import to_numpy
from ._model import Model, narrowed, read_scene

_WHITE = (1.0, 1.0, 1.0, 1.0)


@dataclass
class _Scene:
    """What _core.Scene.of() takes."""

    parts: list[Any] = field(default_factory=list)
    materials: list[Any] = field(default_factory=list)
    textures: list[Any] = field(default_factory=list)
    pictures: list[np.ndarray] = field(default_factory=list)
    has_colors: bool = True  # all parts have colours of their own

    def add_texture(self, picture: Any) -> int:
        self.pictures.append(_rgba(picture))
        self.textures.append((len(self.pictures) - 1, "repeat", "repeat", "linear"))
        return len(self.textures) - 1

    def add_material(self, color: Any = _WHITE, texture: int = -1, alpha: str = "opaque", cutoff: float = 0.5,
                     double_sided: bool = False, name: str = "") -> int:  # fmt: skip
        rgba = tuple(float(c) for c in color)
        self.materials.append((name, rgba, texture, alpha, float(cutoff), bool(double_sided)))
        return len(self.materials) - 1

    def add_part(self, vertices: Any, triangles: Any, material: int, *, uv: Any = None, colors: Any = None,
                 face_colors: Any = None, corner_uv: Any = None, lines: Any = None) -> None:  # fmt: skip
        """colors, face_colors: linear, (n, 4). Values of faces and corners give each triangle vertices of its own."""
        v, origin = _placed(vertices)
        t = np.ascontiguousarray(triangles)
        if face_colors is not None or corner_uv is not None:
            corners = t.reshape(-1).astype(np.int64)
            v = v[corners]
            uv = corner_uv if corner_uv is not None else uv[corners] if uv is not None else None
            colors = (
                np.repeat(face_colors, 3, axis=0)
                if face_colors is not None
                else colors[corners] if colors is not None else None
            )
            t = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
        self.parts.append(
            (
                "",
                np.ascontiguousarray(v),
                origin,
                t.astype(np.uint32, copy=False),
                None if uv is None else np.ascontiguousarray(uv, np.float32),
                None if colors is None else np.ascontiguousarray(colors, np.float32),
                material,
                lines,
            )
        )

    def made(self) -> Any:
        return _core.Scene.of(self.parts, self.materials, self.textures, self.pictures)


def _placed(vertices: Any) -> tuple[np.ndarray, tuple[float, float, float]]:
    """Positions in float32, and the point in double that they are relative to."""
    v = np.asarray(vertices)
    single = narrowed(v.astype(np.float64)) if v.dtype != np.float32 else v
    if single.dtype == np.float32:
        return single, (0.0, 0.0, 0.0)
    finite = v[np.isfinite(v).all(axis=1)]
    middle = (finite.min(axis=0) + finite.max(axis=0)) / 2 if len(finite) else np.zeros(3)
    with np.errstate(over="ignore", invalid="ignore"):
        return (v - middle).astype(np.float32), (float(middle[0]), float(middle[1]), float(middle[2]))


def _rgba(picture: Any) -> np.ndarray:
    """uint8 (height, width, 4) of a picture of PIL or an array."""
    if hasattr(picture, "convert"):
        return np.ascontiguousarray(np.asarray(picture.convert("RGBA"), np.uint8))
    a = np.asarray(picture)
    if a.dtype.kind == "f":
        a = np.rint(np.clip(a, 0, 1) * 255)
    a = a.astype(np.uint8)
    if a.ndim == 2:
        a = a[:, :, None]
    if a.shape[2] == 1:
        a = np.repeat(a, 3, axis=2)
    if a.shape[2] == 3:
        a = np.concatenate([a, np.full((*a.shape[:2], 1), 255, np.uint8)], axis=2)
    return np.ascontiguousarray(a)


def _linear(colors: Any) -> np.ndarray:
    """sRGB colours with or without alpha, uint8 or floats from 0 to 1, as linear ones with alpha: (n, 4) float32."""
    a = np.asarray(to_numpy(colors, "the mesh's colours"))
    a = a.astype(np.float32) / np.float32(255) if a.dtype.kind in "iu" else a.astype(np.float32)
    if a.shape[1] == 3:
        a = np.concatenate([a, np.ones((len(a), 1), np.float32)], axis=1)
    return np.asarray(_core.Scene.linear_colors(np.ascontiguousarray(a)))


def _add_trimesh(scene: _Scene, mesh: Any) -> None:
    visual = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    if visual is None or kind not in ("vertex", "face", "texture"):
        scene.has_colors = False
        scene.add_part(mesh.vertices, mesh.faces, scene.add_material())
    elif kind == "vertex":
        scene.add_part(mesh.vertices, mesh.faces, scene.add_material(), colors=_linear(visual.vertex_colors))
    elif kind == "face":
        scene.add_part(mesh.vertices, mesh.faces, scene.add_material(), face_colors=_linear(visual.face_colors))
    else:
        uv = None if visual.uv is None else np.array(visual.uv, np.float64)
        if uv is not None:
            uv[:, 1] = 1 - uv[:, 1]  # trimesh counts from the picture's lower edge
        scene.add_part(mesh.vertices, mesh.faces, _trimesh_material(scene, visual.material, uv is not None), uv=uv)


def _trimesh_material(scene: _Scene, material: Any, has_uv: bool) -> int:
    if hasattr(material, "baseColorFactor"):  # of glTF: factors are linear
        factor = material.baseColorFactor
        color = _WHITE if factor is None else np.asarray(factor, np.float64)
        if factor is not None and np.asarray(factor).dtype.kind in "iu":
            color = color / 255
        picture = material.baseColorTexture
        alpha = (material.alphaMode or "OPAQUE").lower()
        cutoff = 0.5 if material.alphaCutoff is None else material.alphaCutoff
        sides = bool(material.doubleSided)
    else:
        picture, alpha, cutoff, sides = getattr(material, "image", None), "opaque", 0.5, False
        color = _WHITE
        if picture is None and getattr(material, "diffuse", None) is not None:
            color = _linear(np.asarray(material.diffuse)[None, :])[0]
    texture = scene.add_texture(picture) if picture is not None and has_uv else -1
    return scene.add_material(color, texture, alpha, cutoff, sides, str(getattr(material, "name", None) or ""))


def _add_open3d(scene: _Scene, mesh: Any) -> None:
    v, t = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    textures = [np.asarray(p) for p in getattr(mesh, "textures", [])]
    uv = np.asarray(mesh.triangle_uvs) if len(getattr(mesh, "triangle_uvs", [])) else None
    if uv is not None and any(p.size for p in textures):
        # Pictures are stored with the bottom row first, from where coordinates count.
        numbers = [scene.add_texture(p) if p.size else -1 for p in textures]
        ids = np.asarray(mesh.triangle_material_ids)
        ids = ids if len(ids) == len(t) else np.zeros(len(t), int)
        for i in np.unique(ids):
            mine = ids == i
            material = scene.add_material(texture=numbers[i] if i < len(numbers) else -1)
            scene.add_part(v, t[mine], material, corner_uv=uv.reshape(-1, 3, 2)[mine].reshape(-1, 2))
    elif len(mesh.vertex_colors):
        scene.add_part(v, t, scene.add_material(), colors=_linear(mesh.vertex_colors))
    else:
        scene.has_colors = False
        scene.add_part(v, t, scene.add_material())


def _add_open3d_tensors(scene: _Scene, mesh: Any) -> None:
    v, t = mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy()
    maps = getattr(mesh.material, "texture_maps", {}) if mesh.has_valid_material() else {}
    if "albedo" in maps and "texture_uvs" in mesh.triangle:
        material = scene.add_material(texture=scene.add_texture(maps["albedo"].as_tensor().numpy()[::-1]))
        scene.add_part(v, t, material, corner_uv=mesh.triangle.texture_uvs.numpy().reshape(-1, 2))
    elif "colors" in mesh.vertex:
        scene.add_part(v, t, scene.add_material(), colors=_linear(mesh.vertex.colors.numpy()))
    elif "colors" in mesh.triangle:
        scene.add_part(v, t, scene.add_material(), face_colors=_linear(mesh.triangle.colors.numpy()))
    else:
        scene.has_colors = False
        scene.add_part(v, t, scene.add_material())


def _named_colors(data: Any) -> Any:
    """The array of point or cell data that is colours: the active one, or one of a usual name."""
    usual = ("rgba", "rgb", "colors", "colours", "color", "colour")
    names = [n for n in [data.active_scalars_name, *data.keys()] if n is not None]
    for name in names:
        a = np.asarray(data[name])
        is_active = name == data.active_scalars_name
        if a.ndim == 2 and a.shape[1] in (3, 4) and (a.dtype == np.uint8 and is_active or name.lower() in usual):
            return a
    return None


def _add_pyvista(scene: _Scene, mesh: Any) -> None:
    surface = mesh if mesh.is_all_triangles else mesh.triangulate()
    v, t = np.asarray(surface.points), np.asarray(surface.faces).reshape(-1, 4)[:, 1:]
    of_points = _named_colors(surface.point_data)
    of_cells = _named_colors(surface.cell_data) if of_points is None else None
    scene.has_colors = scene.has_colors and (of_points is not None or of_cells is not None)
    scene.add_part(
        v,
        t,
        scene.add_material(),
        colors=None if of_points is None else _linear(of_points),
        face_colors=None if of_cells is None else _linear(of_cells),
    )


def _add(scene: _Scene, mesh: Any) -> None:
    if isinstance(mesh, (str, os.PathLike, Model)):
        raise TypeError("own values of a list of models: give one model at a time")
    if hasattr(mesh, "geometry") and hasattr(mesh, "graph"):  # a scene of trimesh
        for part in mesh.dump():
            if hasattr(part, "faces"):
                _add_trimesh(scene, part)
    elif isinstance(mesh, tuple) and len(mesh) == 2:
        scene.has_colors = False
        v, t = (to_numpy(a, what) for a, what in zip(mesh, ("the array of vertices", "the array of triangles")))
        scene.add_part(v, t, scene.add_material())
    elif hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        _add_trimesh(scene, mesh)
    elif hasattr(mesh, "vertices") and hasattr(mesh, "triangles"):
        _add_open3d(scene, mesh)
    elif hasattr(mesh, "vertex") and hasattr(mesh, "triangle"):
        _add_open3d_tensors(scene, mesh)
    else:
        _add_pyvista(scene, mesh)


def own_scene(mesh: Any, needs_colors: bool, stacklevel: int) -> Any:
    """The scene of a mesh with its own visuals. Raises ValueError where colours are needed and it has none."""
    parts = mesh if isinstance(mesh, list) else [mesh]
    if len(parts) == 1 and isinstance(parts[0], Model):
        return parts[0]._scene
    if len(parts) == 1 and isinstance(parts[0], (str, os.PathLike)):
        return read_scene(os.fspath(parts[0]), False, stacklevel + 1)
    scene = _Scene()
    for part in parts:
        _add(scene, part)
    if needs_colors and not scene.has_colors:
        raise ValueError("the mesh has no colours of its own: give values, such as {'rgb': an array with a row for each vertex}")
    return scene.made()


def lines(vertices: Any, segments: Any, colors: Any = None) -> Model:
    """Line segments as a Model, for voxelize(), sparse() and bake(): their voxels are those that a segment touches.

    Args:
        vertices: (v, 3) positions.
        segments: (s, 2) vertex numbers.
        colors: of the vertices, (v, 3 or 4), sRGB, uint8 or floats from 0 to 1; for bake(model, grid).

    Raises:
        IndexError: a segment names a vertex that does not exist.

    Example:
        >>> wires = vp.lines(vertices, mesh.edges_unique)
        >>> occupied = vp.voxelize(wires, vp.fit(wires, 128))
    """
    v = np.asarray(to_numpy(vertices, "vertices"))
    pairs = np.asarray(to_numpy(segments, "segments"))
    if v.ndim != 2 or v.shape[1] != 3:
        raise ValueError(f"vertices are an array (v, 3), not {v.shape}")
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iu":
        raise ValueError(f"segments are an array (s, 2) of vertex numbers, not {pairs.shape} of {pairs.dtype}")
    bad = ((pairs < 0) | (pairs >= len(v))).any(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise IndexError(f"segment {row} is {tuple(int(i) for i in pairs[row])}, there are {len(v)} vertices")
    linear = None if colors is None else _linear(colors)
    if linear is not None and len(linear) != len(v):
        raise ValueError(f"colors has {len(linear)} rows for {len(v)} vertices")
    scene = _Scene()
    none = np.zeros((0, 3), np.uint32)
    scene.add_part(v, none, scene.add_material(), colors=linear, lines=np.ascontiguousarray(pairs, np.uint32))
    return Model("lines", scene.made())


def points(positions: Any, colors: Any = None) -> Model:
    """Points as a Model, for voxelize(), sparse() and bake(): their voxels are those in which a point lies; of one in the
    side of a voxel, all that it touches.

    Args:
        positions: (n, 3).
        colors: (n, 3 or 4), sRGB, uint8 or floats from 0 to 1; for bake(model, grid), which has their mean.

    Example:
        >>> cloud = vp.points(xyz, rgb)
        >>> voxels, rows = vp.sparse(cloud, vp.fit(cloud, voxel_size=0.05), "color")
    """
    shape = np.shape(to_numpy(positions, "positions"))
    if len(shape) != 2 or shape[1] != 3:
        raise ValueError(f"positions are an array (n, 3), not {shape}")
    n = np.arange(shape[0])
    return Model("points", lines(positions, np.stack([n, n], axis=1), colors)._scene)


def instances(mesh: Any, transforms: Any) -> Model:
    """A mesh at many places, each once in memory, as a Model, with its own colours where it has any.

    Args:
        mesh: what voxelize() takes, on the CPU.
        transforms: (n, 4, 4) or (n, 3, 4) matrices, which are multiplied by (x, y, z, 1).

    Example:
        >>> forest = vp.instances("tree.glb", matrices)
        >>> color = vp.bake(forest, vp.fit(forest, 512))["color"]
    """
    m = np.asarray(to_numpy(transforms, "transforms"), np.float64)
    if m.ndim == 2:
        m = m[None]
    if m.ndim != 3 or m.shape[1:] not in ((4, 4), (3, 4)):
        raise ValueError(f"transforms are matrices (n, 4, 4) or (n, 3, 4), not an array {m.shape}")
    if m.shape[1] == 4 and not (m[:, 3] == (0, 0, 0, 1)).all():
        raise ValueError("transforms end with the row (0, 0, 0, 1)")
    scene = own_scene(mesh, False, 2)
    return Model("instances", scene.instances(np.ascontiguousarray(m[:, :3])))
