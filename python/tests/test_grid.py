# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import pickle

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box


def test_grid_has_what_it_was_given():
    grid = vp.Grid((1, 2, 3), (0.5, 0.25, 2), (4, 5, 6))
    assert grid.origin == (1, 2, 3)
    assert grid.voxel_size == (0.5, 0.25, 2)
    assert grid.shape == (4, 5, 6)
    assert grid.voxel_center((0, 1, 2)) == (1.25, 2.375, 8)
    assert grid == vp.Grid((1, 2, 3), (0.5, 0.25, 2), (4, 5, 6))
    assert grid != vp.Grid((1, 2, 3), (0.5, 0.25, 2), (4, 5, 7))
    assert "shape=(4, 5, 6)" in repr(grid)


@pytest.mark.parametrize("shape", [(0, 1, 1), (1, -1, 1), (1, 1, 2**20 + 1), (2**40, 1, 1)])
def test_bad_shapes_are_refused(shape):
    with pytest.raises(ValueError):
        vp.Grid((0, 0, 0), (1, 1, 1), shape)


@pytest.mark.parametrize("size", [0, -1, float("nan"), float("inf")])
def test_bad_sizes_are_refused(size):
    with pytest.raises(ValueError, match="voxel_size"):
        vp.Grid((0, 0, 0), (size, 1, 1), (1, 1, 1))


def test_fit_by_resolution():
    grid = vp.fit(box(high=(4, 2, 1)), 64)
    assert grid.shape == (16, 32, 64)
    assert np.allclose(grid.voxel_size, 4 / 64, rtol=1e-3)
    assert vp.fit(box(), (8, 8, 8)).shape == (8, 8, 8)


def test_fit_by_voxel_size():
    grid = vp.fit(box(high=(0.6, 0.6, 0.6)), voxel_size=0.1)  # 0.6f is more than 0.6
    assert grid.shape == (6, 6, 6) and grid.origin == (0, 0, 0)
    assert vp.fit(box(high=(0.6, 0.6, 0.6)), voxel_size=0.1, padding=2).shape == (10, 10, 10)
    assert vp.fit(box(), voxel_size=(0.5, 0.25, 1)).shape == (1, 4, 2)


def test_fit_ignores_vertices_that_are_not_finite():
    vertices, triangles = box()
    broken = np.concatenate([vertices, [[np.nan, 0, 0], [0, np.inf, 0]]]).astype(np.float32)
    with pytest.warns(vp.DroppedTrianglesWarning, match="2 of 10 vertices"):
        assert vp.fit((broken, triangles), 8) == vp.fit((vertices, triangles), 8)


def test_fit_wants_one_of_two():
    with pytest.raises(ValueError, match="resolution or a voxel_size"):
        vp.fit(box())
    with pytest.raises(ValueError, match="resolution or a voxel_size"):
        vp.fit(box(), 8, voxel_size=1)


def test_crop_and_pickle():
    grid = vp.fit(box(), 32)
    part = grid.crop((1, 2, 3), (4, 5, 6))
    assert part.shape == (4, 5, 6) and part.offset == (1, 2, 3)
    for g in (grid, part):
        assert pickle.loads(pickle.dumps(g)) == g
        assert hash(pickle.loads(pickle.dumps(g))) == hash(g)
    assert grid.crop((0, 0, 0), grid.shape) == grid
    with pytest.raises(ValueError, match="crop"):
        grid.crop((0, 0, 30), (4, 4, 4))
