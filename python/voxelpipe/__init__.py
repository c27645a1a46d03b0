# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Exact voxelization of triangle meshes.

Which voxels a triangle covers is decided in integers: no voxel is missed, none is added, and the same input gives the
same bytes on every machine and any number of threads.

    import voxelpipe as vp
    grid = vp.fit(mesh, 256)
    surface = vp.voxelize(mesh, grid)        # bool, (nz, ny, nx)
    inside = vp.solid(mesh, grid)            # the same, filled
    field = vp.distance(mesh, grid)          # float32, negative inside
    parts = vp.fractions(mesh, grid)         # float32, how much of each voxel is inside
    vp.save("surface.png", surface, grid)

A mesh is a pair (vertices, triangles) of arrays, a mesh of trimesh, Open3D or PyVista, a path, a Model, or a list of those.
Arrays of voxels are indexed [z, y, x]; lists of voxels have columns x, y, z: array[grid.zyx(voxels)].
"""

from importlib.metadata import PackageNotFoundError as _PackageNotFoundError
from importlib.metadata import version as _version

from ._axes import VoxelList, dense
from ._bake import bake, sparse
from ._core import Grid
from ._distance import distance, distance_at
from ._fit import fit
from ._fractions import FractionLists, SparseFractions, fraction_lists, fractions, sparse_fractions
from ._label import label
from ._links import Links, links
from ._model import Material, Model, ModelWarning, Part, Texture, load_model
from ._octree import Hits, Octree
from ._remesh import extract, remesh
from ._save import WriteError, formats, render, save
from ._solid import OpenMeshWarning, solid, tiles
from ._surface import DroppedTrianglesWarning, Fragments, fragments, voxelize
from ._view import View, view
from ._visuals import instances, lines, points

try:
    __version__ = _version("voxelpipe")
except _PackageNotFoundError:  # the folder alone, not installed
    __version__ = "0"

__all__ = [
    "DroppedTrianglesWarning",
    "FractionLists",
    "Fragments",
    "Grid",
    "Hits",
    "Links",
    "Material",
    "Model",
    "ModelWarning",
    "Octree",
    "OpenMeshWarning",
    "Part",
    "SparseFractions",
    "Texture",
    "View",
    "VoxelList",
    "WriteError",
    "bake",
    "dense",
    "distance",
    "distance_at",
    "extract",
    "fit",
    "formats",
    "fraction_lists",
    "fractions",
    "fragments",
    "instances",
    "label",
    "lines",
    "links",
    "load_model",
    "points",
    "remesh",
    "render",
    "save",
    "solid",
    "sparse",
    "sparse_fractions",
    "tiles",
    "view",
    "voxelize",
]
