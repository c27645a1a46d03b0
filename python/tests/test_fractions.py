# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, sphere

GRID = vp.Grid((0, 0, 0), (0.5, 0.25, 1), (14, 20, 9))


def box_fractions(grid, low, high):
    """The part of every voxel that lies within a box: a product of three overlaps."""
    nz, ny, nx = grid.shape
    parts = []
    for axis, n in enumerate((nx, ny, nz)):
        first = grid.origin[axis] + grid.voxel_size[axis] * np.arange(n)
        overlap = np.minimum(first + grid.voxel_size[axis], high[axis]) - np.maximum(first, low[axis])
        parts.append(np.clip(overlap, 0, None) / grid.voxel_size[axis])
    return parts[2][:, None, None] * parts[1][None, :, None] * parts[0][None, None, :]


def test_fractions_of_a_box_are_its_overlaps():
    low, high, status = (0.625, 0.375, 1.25), (5.875, 3.0625, 6.5), {}
    f = vp.fractions(box(low, high), GRID, status=status)
    assert f.dtype == np.float32 and f.shape == GRID.shape
    assert np.array_equal(f, box_fractions(GRID, low, high).astype(np.float32))  # multiples of 2^-10: exact
    assert status["cut_voxels"] > 0 and status["voxels"] == (f != 0).sum()
    assert status["open_rows"] == status["open_edges"] == status["below_zero"] == status["above_one"] == 0


def test_volume_of_a_sphere_and_threads():
    mesh = sphere()
    grid = vp.fit(mesh, 24)
    f = vp.fractions(mesh, grid, threads=1)
    assert f.tobytes() == vp.fractions(mesh, grid, threads=2).tobytes()
    vertices, triangles = mesh
    corners = np.asarray(vertices, np.float64)[np.asarray(triangles)]
    volume = np.linalg.det(corners).sum() / 6
    assert f.sum(dtype=np.float64) * np.prod(grid.voxel_size) == pytest.approx(volume, rel=1e-5)
    outer, inner = vp.solid(mesh, grid), vp.solid(mesh, grid, extent="inner")
    assert (f[inner] == 1).all() and (f[~outer] == 0).all()


def test_bodies_add_up_or_stay_apart():
    a, b = ((0.5, 0.25, 1), (3.25, 3, 5)), ((2.5, 1, 2), (6, 4, 8))
    status = {}
    both = vp.fractions([box(*a), box(*b)], GRID, status=status)
    each = vp.fractions([box(*a), box(*b)], GRID, bodies="each")
    assert each.shape == (2, *GRID.shape)
    for values, (low, high) in zip(each, (a, b)):
        assert np.array_equal(values, box_fractions(GRID, low, high).astype(np.float32))
    assert np.array_equal(both, each[0] + each[1]) and both.max() == 2 and status["above_one"] == (both > 1).sum()
    vertices, triangles = box(*a)
    assert np.array_equal(vp.fractions((vertices, np.asarray(triangles)[:, ::-1]), GRID), -each[0])


def test_open_meshes_warn_and_mistakes_are_named():
    vertices, triangles = box((1, 1, 1), (3, 3, 3))
    with pytest.warns(vp.OpenMeshWarning, match="rows of voxels do not balance"):
        vp.fractions((vertices, np.delete(triangles, 8, axis=0)), GRID)  # of the face at low x
    with pytest.raises(ValueError, match="bodies"):
        vp.fractions((vertices, triangles), GRID, bodies="some")
    with pytest.raises(TypeError, match="grid"):
        vp.fractions((vertices, triangles), 64)
    with pytest.raises(IndexError):
        vp.fractions((vertices, np.array([[0, 1, 99]])), GRID)
    empty = vp.fractions((np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)), GRID)
    assert empty.shape == GRID.shape and not empty.any()
