# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Lines, points, instances, and rays through lists."""

import numpy as np
import pytest
import voxelpipe as vp

import models
from meshes import box, sphere

GRID = vp.Grid((0, 0, 0), (1, 1, 1), (6, 7, 8))


def test_points_lie_in_their_voxels():
    at = np.random.default_rng(1).random((200, 3)) * (8, 7, 6)
    rgb = np.random.default_rng(2).integers(0, 256, (200, 3)).astype(np.uint8)
    cloud = vp.points(at, rgb)
    expected = np.zeros(GRID.shape, bool)
    expected[GRID.zyx(GRID.to_ijk(at))] = True
    assert np.array_equal(vp.voxelize(cloud, GRID), expected)
    voxels, rows = vp.sparse(cloud, GRID, ["color", "count"])
    assert np.array_equal(voxels, vp.sparse(cloud, GRID)[0]) and rows["count"].sum() == 200
    alone = rows["count"] == 1
    of_point = {tuple(p): tuple(c) for p, c in zip(GRID.to_ijk(at).tolist(), rgb.tolist())}
    for voxel, color in zip(voxels[alone].tolist(), rows["color"][alone].tolist()):
        assert tuple(color) == (*of_point[tuple(voxel)], 255)
    assert len(cloud.faces) == 0 and len(cloud.lines) == 200


def test_lines_are_drawn():
    wire = vp.lines([[0.5, 0.5, 0.5], [6.5, 0.5, 0.5], [6.5, 5.5, 0.5]], np.array([[0, 1], [1, 2]]))
    expected = np.zeros(GRID.shape, bool)
    expected[0, 0, 0:7] = expected[0, 0:6, 6] = True
    assert np.array_equal(vp.voxelize(wire, GRID), expected)
    assert np.array_equal(vp.dense(vp.sparse(wire, GRID)[0], True, GRID), expected)
    assert vp.fit(wire, 12).shape[2] == 12
    with pytest.raises(IndexError, match=r"segment 1 is \(1, 3\), there are 3 vertices"):
        vp.lines(np.zeros((3, 3)), np.array([[0, 1], [1, 3]]))
    with pytest.raises(ValueError, match="colors has 2 rows for 3"):
        vp.lines(np.zeros((3, 3)), np.array([[0, 1]]), np.zeros((2, 3), np.uint8))


def test_instances_are_copies(tmp_path):
    v, f = sphere(0.8, levels=2)
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[:, :3, 3] = [[1, 1, 1], [5, 4, 3], [6, 2, 4.5]]
    matrices[1, 0, 0] = -1.5
    copies = [(v.astype(np.float64) @ m[:3, :3].T + m[:3, 3], f[:, ::-1] if i == 1 else f) for i, m in enumerate(matrices)]
    several = vp.instances((v, f), matrices)
    assert len(several.parts) == 3 and len(several.faces) == 3 * len(f)
    assert np.array_equal(vp.voxelize(several, GRID), vp.voxelize([(c[0].astype(np.float32), c[1]) for c in copies], GRID))
    assert np.array_equal(vp.solid(several, GRID, "positive"), vp.solid(several, GRID))
    path = models.lighthouse(tmp_path / "a.glb")
    once = vp.instances(path, np.eye(4))
    grid = vp.fit(path, 20)
    assert np.array_equal(vp.bake(once, grid)["color"], vp.bake(path, grid)["color"])
    with pytest.raises(ValueError, match="matrices"):
        vp.instances(path, np.eye(3))


def test_rays_meet_the_first_voxel_of_a_list():
    grid = vp.Grid((-1, -2, 3), (0.5, 0.25, 0.75), (9, 10, 11)).crop((1, 2, 3), (8, 7, 6))
    occupied = np.random.default_rng(5).random(grid.shape) < 0.1
    voxels = grid.ijk(occupied)
    voxels = voxels[np.random.default_rng(6).permutation(len(voxels))]
    tree = vp.Octree(voxels, grid)
    size = np.array(grid.voxel_size)
    low, high = np.array(grid.origin), np.array(grid.origin) + size * grid.shape[::-1]
    rng = np.random.default_rng(7)
    origins = low + (rng.random((300, 3)) * 3 - 1) * (high - low)
    directions = low + rng.random((300, 3)) * (high - low) - origins
    hits = tree.first_hits(origins, directions, threads=2)
    # Every box against every ray.
    corner = grid.to_xyz(voxels) - size / 2
    with np.errstate(divide="ignore"):
        a = (corner[None] - origins[:, None]) / directions[:, None]
        b = (corner[None] + size - origins[:, None]) / directions[:, None]
    enter, leave = np.maximum(np.minimum(a, b).max(axis=2), 0), np.maximum(a, b).min(axis=2)
    enter[enter > leave] = np.inf
    assert np.allclose(hits.distances, enter.min(axis=1)) and np.isfinite(hits.distances).sum() > 50
    found = hits.rows >= 0
    assert np.array_equal(found, np.isfinite(enter.min(axis=1)))
    assert np.allclose(enter[found, hits.rows[found]], hits.distances[found])
    assert (hits.normals[found & (hits.distances > 0)] * directions[found & (hits.distances > 0)]).sum(axis=1).max() < 0
    assert not hits.normals[~found].any()
    short = tree.first_hits(origins, directions, limit=0.5)
    assert np.array_equal(short.rows >= 0, hits.distances <= 0.5)
    one = tree.first_hits(origins[0], directions)
    assert len(one.rows) == 300


def test_levels_of_an_octree():
    mesh = box((1, 1, 1), (15, 9, 5))
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (8, 16, 20))
    voxels, _ = vp.sparse(mesh, grid)
    tree = vp.Octree(voxels, grid)
    assert tree.num_levels == 5 and tree.nbytes > 0
    for level in range(1, 6):
        expected = np.unique(np.asarray(voxels) >> level, axis=0)
        nodes = tree.level(level)
        assert isinstance(nodes, vp.VoxelList) and np.array_equal(np.unique(nodes, axis=0), expected) and len(nodes) == len(expected)
    with pytest.raises(ValueError, match="level is 1 to 5, not 6"):
        tree.level(6)
    with pytest.raises(ValueError, match="the same"):
        vp.Octree([[0, 0, 0], [1, 0, 0], [0, 0, 0]], grid)
    assert vp.Octree(np.zeros((0, 3), int), grid).first_hits([0, 0, 0], [1, 0, 0]).rows.tolist() == [-1]
    for bad, text in ((([0, 0], [1, 0, 0]), "origins"), (([0, 0, 0], [0, 0, 0]), "length"), (([0, 0, np.nan], [1, 0, 0]), "finite")):
        with pytest.raises(ValueError, match=text):
            tree.first_hits(*bad)
