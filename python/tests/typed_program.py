# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checked by mypy --strict, not run: the package has types, they are those that a program expects, and mistakes are found.
A mistake that is not found leaves its comment without a use, which --strict reports."""

import numpy as np
import numpy.typing as npt
import voxelpipe as vp

Array = npt.NDArray[np.float32]


def occupied(vertices: Array, triangles: npt.NDArray[np.int64]) -> int:
    mesh = (vertices, triangles)
    grid: vp.Grid = vp.fit(mesh, 64)
    shape: tuple[int, int, int] = grid.shape
    surface: npt.NDArray[np.bool_] = vp.voxelize(mesh, grid)
    words: npt.NDArray[np.uint32] = vp.solid(mesh, grid, packed=True)
    picture: npt.NDArray[np.uint8] = vp.render(surface, grid)
    lists: vp.Fragments = vp.fragments(mesh, grid)
    field: npt.NDArray[np.float32] = vp.distance(mesh, grid, "whole", corners=True)
    parts: npt.NDArray[np.float32] = vp.fractions(mesh, grid)
    cells: dict[str, npt.NDArray[np.float64]] = vp.fractions(mesh, grid, of=("aperture_x", "face_centroid_y", "area_vector"))
    cut: vp.SparseFractions = vp.sparse_fractions(mesh, grid, of=("fraction", "area"))
    shared: vp.FractionLists = vp.fraction_lists([mesh, mesh], grid)
    bodies: list[vp.SparseFractions] = vp.sparse_fractions([mesh, mesh], grid, bodies="each")
    walls: vp.Links = vp.links(mesh, grid, 26)
    labels, components = vp.label(parts > 0, 26, components=True)
    baked: dict[str, npt.NDArray[np.uint8]] = vp.bake("lighthouse.glb", grid)
    model: vp.Model = vp.load_model("lighthouse.glb")
    voxels, attributes = vp.sparse(model, grid, ["color", "normal"], solid="nonzero", extent="center")
    listed: vp.VoxelList = voxels
    surface[grid.zyx(listed)] = True
    vp.save("a.vox", (voxels, attributes), grid, up="z", merge=True)
    del words, picture, lists, field, parts, cells, cut, bodies, walls, labels, components, baked
    return shape[0]


def mistakes(vertices: Array, triangles: npt.NDArray[np.int64], grid: vp.Grid) -> None:
    mesh = (vertices, triangles)
    vp.voxelize(mesh, 64)  # type: ignore[call-overload]
    vp.voxelize(mesh, grid, "conservativ")  # type: ignore[call-overload]
    vp.solid(mesh, grid, repair="holes")  # type: ignore[call-overload]
    vp.fractions(mesh, grid, of="aperture")  # type: ignore[arg-type]
    vp.fractions(mesh, grid, repair="vote")  # type: ignore[call-overload]
    vp.sparse_fractions(mesh, grid, of="aperture_x")  # type: ignore[arg-type]
    vp.voxelize(5, grid)  # type: ignore[call-overload]
    vp.save("a.npy", vp.voxelize(mesh, grid), grid, nonsense=1)  # type: ignore[call-arg]
    vp.bake(mesh, grid, {"rgb": vertices}, blend="median")  # type: ignore[call-overload]
    vp.bake(mesh, grid, "colour")  # type: ignore[arg-type]
    vp.fit(mesh, "64")  # type: ignore[arg-type]
