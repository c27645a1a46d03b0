# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""remesh() and extract(): closed manifolds by trimesh and manifold3d, which know nothing of this library."""

import numpy as np
import pytest

import voxelpipe as vp

BOX = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
FACES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
)


def judge(vertices, faces):
    """Asserts a closed manifold; gives the mesh of trimesh."""
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume > 0
    try:
        import manifold3d
    except ImportError:
        return mesh
    solid = manifold3d.Manifold(manifold3d.Mesh64(np.asarray(vertices, np.float64), np.asarray(faces, np.uint64)))
    assert solid.status() == manifold3d.Error.NoError
    return mesh


def test_a_remesh_of_crossing_boxes_is_closed_and_keeps_its_planes():
    soup = np.concatenate([BOX, 0.6 + BOX])
    faces = np.concatenate([FACES, 8 + FACES])
    grid = vp.fit((soup, faces), 24)
    counts = {}
    vertices, triangles, more = vp.remesh((soup, faces), grid, status=counts)
    mesh = judge(vertices, triangles)
    assert mesh.volume == pytest.approx(2 - 0.4**3, rel=2e-3)
    assert counts["made_crossings"] == 0 and counts["components"] == 1
    planes = np.array([0.0, 1.0, 0.6, 1.6])
    assert np.abs(vertices[:, :, None] - planes).min((1, 2)).max() < 1e-3
    assert vertices.dtype == np.float64 and triangles.dtype == np.uint32
    assert more["cell"].shape == vertices.shape and more["sheet"].max() < 4 and more["source"].max() < 24
    quads = vp.remesh((soup, faces), grid, quads=True)[1]
    assert quads.shape == (len(triangles) // 2, 4)


def test_random_voxels_and_fields_are_closed():
    rng = np.random.default_rng(3)
    grid = vp.Grid((0, 0, 0), (0.5,) * 3, (17, 9, 11))
    inside = rng.random(grid.shape) < 0.5
    for place in ("corner", "mean", "sharp"):
        judge(*vp.extract(inside, grid, place=place)[:2])
    field = rng.random(grid.shape).astype(np.float32) - 0.5
    field[3, 2, 1] = np.nan
    counts = {}
    judge(*vp.extract(field, grid, level=0.1, status=counts)[:2])
    assert counts["nan_samples"] == 1


def test_corners_of_one_voxel():
    grid = vp.Grid((1, 2, 3), (0.5,) * 3, (3, 3, 3))
    inside = np.zeros(grid.shape, bool)
    inside[1, 1, 1] = True
    vertices, triangles, more = vp.extract(inside, grid, place="corner")
    assert sorted(map(tuple, vertices)) == sorted(
        (1 + x, 2 + y, 3 + z) for x in (0.5, 1.0) for y in (0.5, 1.0) for z in (0.5, 1.0)
    )
    assert len(triangles) == 12 and (more["source"] == -1).all()


def test_bad_arguments():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (4, 4, 4))
    with pytest.raises(TypeError, match="bool"):
        vp.extract(np.zeros(grid.shape, np.int32), grid)
    with pytest.raises(ValueError, match="level"):
        vp.extract(np.zeros(grid.shape, bool), grid, level=1)
    with pytest.raises(ValueError, match="shape"):
        vp.extract(np.zeros((3, 4, 4), bool), grid)
    with pytest.raises(ValueError, match="place"):
        vp.remesh((BOX, FACES), grid, place="middle")
