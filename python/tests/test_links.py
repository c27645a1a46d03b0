# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, sphere

GRID = vp.Grid((0, 0, 0), (0.5, 0.25, 1), (7, 12, 9))


def at(links, voxel, direction):
    """Row and column of a link."""
    row = np.flatnonzero((np.asarray(links.voxels) == voxel).all(axis=1))
    column = np.flatnonzero((links.directions == direction).all(axis=1))
    assert len(row) == len(column) == 1
    return row[0], column[0]


def test_links_of_a_box_are_the_distances_of_its_faces():
    low, high, status = (0.625, 0.4375, 1.25), (3.875, 2.25, 5.75), {}
    links = vp.links(box(low, high), GRID, 26, status=status)
    n = len(links.voxels)
    assert links.voxels.dtype == np.int32 and type(links.voxels).__name__ == "VoxelList"
    assert links.q.dtype == np.float32 and links.q.shape == links.triangles.shape == links.bodies.shape == (n, 26)
    assert links.triangles.dtype == links.bodies.dtype == np.int32 and links.directions.shape == (26, 3)
    assert status["voxels"] == n and status["fragments"] == (links.q > 0).sum() > 500
    # The face at x = 0.625 is 1.25 voxels from the origin: from the centre of voxel 0, at 0.5, it is 0.75 of a link.
    assert links.q[at(links, (0, 5, 3), (1, 0, 0))] == 0.75 and links.q[at(links, (1, 5, 3), (-1, 0, 0))] == 0.25
    assert links.q[at(links, (5, 1, 3), (0, 1, 0))] == 0.25 and links.q[at(links, (5, 1, 3), (0, -1, 0))] == -1
    assert links.q[at(links, (5, 5, 0), (0, 0, 1))] == 0.75 and links.q[at(links, (5, 5, 6), (0, 0, -1))] == 0.75
    crossed = links.q > 0
    assert (links.q[~crossed] == -1).all() and links.q.max() <= 1
    assert ((links.triangles >= 0) == crossed).all() and links.triangles.max() == 11
    assert ((links.bodies == 0) == crossed).all() and links.bodies.min() == -1
    assert np.array_equal(links.directions[::2], -links.directions[1::2])


def test_walls_part_what_solids_part():
    mesh = sphere()
    grid = vp.fit(mesh, voxel_size=0.11, padding=1)
    inside = np.pad(vp.solid(mesh, grid, extent="centre"), 1)
    links = vp.links(mesh, grid, 18, threads=1)
    again = vp.links(mesh, grid, threads=2)
    assert all(np.array_equal(a, b) for a, b in zip(links, again))
    row, link = (links.q > 0).nonzero()
    crossed = np.zeros((18, *grid.shape), bool)
    crossed[(link, *grid.zyx(links.voxels[row]))] = True
    nz, ny, nx = grid.shape
    here = inside[1:-1, 1:-1, 1:-1]
    for k, (x, y, z) in enumerate(links.directions):
        there = inside[1 + z : nz + 1 + z, 1 + y : ny + 1 + y, 1 + x : nx + 1 + x]
        assert (crossed[k] >= (here != there)).all() and (here != there).any()


def test_bodies_crops_and_open_meshes():
    a, b = box((0.6, 0.3, 1.3), (1.9, 2.1, 5.2)), box((2.6, 0.7, 2.3), (4.1, 2.6, 6.1))
    links = vp.links([a, b], GRID)
    assert links.q.shape[1] == 18
    assert set(np.unique(links.bodies)) == {-1, 0, 1}
    assert (links.triangles[links.bodies == 0] < 12).all() and (links.triangles[links.bodies == 1] >= 12).all()
    part = vp.links([a, b], GRID.crop((1, 3, 2), (4, 6, 5)))  # z, y, x
    begin = np.array((2, 3, 1))
    within = ((np.asarray(links.voxels) >= begin) & (np.asarray(links.voxels) < begin + (5, 6, 4))).all(axis=1)
    assert np.array_equal(np.asarray(part.voxels) + begin, np.asarray(links.voxels)[within])
    assert np.array_equal(part.q, links.q[within]) and np.array_equal(part.triangles, links.triangles[within])
    sheet = ([(0.7, -9, -9), (0.7, 99, -9), (0.7, -9, 99)], [(0, 1, 2)])
    assert (vp.links(sheet, GRID).triangles.max(axis=1) == 0).all()
    none = vp.links((np.zeros((0, 3)), np.zeros((0, 3), int)), GRID)
    assert none.voxels.shape == (0, 3) and none.q.shape == (0, 18) and none.directions.shape == (18, 3)


def test_what_is_refused():
    mesh = box((1, 1, 1), (2, 2, 2))
    for neighbours in (6, 19, 27):
        with pytest.raises(ValueError, match="neighbours is 18 or 26"):
            vp.links(mesh, GRID, neighbours)
    with pytest.raises(ValueError, match="neighbours is a whole number"):
        vp.links(mesh, GRID, 18.5)
    with pytest.raises(IndexError):
        vp.links((mesh[0], [(0, 1, 99)]), GRID)
