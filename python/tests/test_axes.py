# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Arrays are indexed [z, y, x], lists have columns x, y, z, and what goes from one to the other hides no mistake."""

import pickle

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, sphere


@pytest.fixture(scope="module", params=[(24, 24, 24), (10, 20, 30)])
def scene(request):
    mesh = box((1, 2, 3), (9, 5, 8))
    grid = vp.Grid((0.5, -1, 2), (0.5, 0.75, 0.25), request.param)
    return mesh, grid, vp.voxelize(mesh, grid), vp.sparse(mesh, grid)[0]


def test_a_list_and_an_array_are_the_same_voxels(scene):
    _, grid, surface, voxels = scene
    assert isinstance(voxels, vp.VoxelList) and voxels.dtype == np.int32
    made = np.zeros(grid.shape, bool)
    made[grid.zyx(voxels)] = True
    assert np.array_equal(made, surface) and np.array_equal(vp.dense(voxels, True, grid), surface)
    flat = np.zeros(surface.size, bool)
    flat[grid.index(voxels)] = True
    assert np.array_equal(flat.reshape(grid.shape), surface)
    again = grid.ijk(surface)
    assert isinstance(again, vp.VoxelList)
    assert set(map(tuple, again.tolist())) == set(map(tuple, voxels.tolist()))


def test_the_tuple_of_columns_cannot_be_made(scene):
    _, grid, surface, voxels = scene
    for columns in (voxels.T, voxels.transpose(), np.transpose(voxels), voxels.swapaxes(0, 1), voxels[::2].T,
                    pickle.loads(pickle.dumps(voxels)).T, vp.fragments(box(), grid).voxels.T):  # fmt: skip
        for take in (tuple, list, lambda c: surface[(*c,)], lambda c: np.stack([*c])):
            with pytest.raises(TypeError, match=r"array\[grid.zyx\(voxels\)\]"):
                take(columns)
    # What says its order is as it was.
    assert surface[tuple(voxels.T[::-1])].all() and surface[tuple(voxels[:, ::-1].T)].all()
    assert surface[voxels[:, 2], voxels[:, 1], voxels[:, 0]].all()


def test_a_list_is_an_array_otherwise(scene):
    _, _, _, voxels = scene
    plain = np.asarray(voxels)
    assert type(plain) is np.ndarray
    assert type(voxels[3:5]) is vp.VoxelList and type(voxels[voxels[:, 0] > 4]) is vp.VoxelList
    for part in (voxels[:, 0], voxels[:, :2], voxels[3], voxels + 1, voxels * 0.5, voxels.max(axis=0), voxels == 2):
        assert type(part) is np.ndarray
    assert isinstance(voxels.max(), np.int32) and voxels[2, 1] == plain[2, 1]
    assert [tuple(row) for row in voxels[:3]] == [tuple(row) for row in plain[:3]]
    assert np.array_equal(np.unique(voxels, axis=0), np.unique(plain, axis=0))
    assert np.array_equal(np.concatenate([voxels, voxels])[len(voxels) :], plain)
    assert np.array_equal(np.lexsort(voxels.T), np.lexsort(plain.T)) and np.array_equal(voxels.T @ voxels, plain.T @ plain)


def test_positions_and_voxels(scene):
    mesh, grid, _, voxels = scene
    centres = grid.to_xyz(voxels)
    assert centres.dtype == np.float64
    assert np.allclose(centres[7], grid.voxel_center(tuple(int(i) for i in voxels[7])), rtol=0, atol=1e-12)
    assert np.array_equal(grid.to_ijk(centres), voxels) and isinstance(grid.to_ijk(centres), vp.VoxelList)
    part = grid.crop((2, 3, 4), (5, 6, 7))
    assert np.array_equal(part.to_xyz([[0, 0, 0]]), grid.to_xyz([[4, 3, 2]]))
    assert part.to_ijk(grid.to_xyz([[4, 3, 2]])).tolist() == [[0, 0, 0]]
    assert grid.to_ijk([grid.origin]).tolist() == [[0, 0, 0]]
    below = np.array([grid.origin]) - 0.01
    assert grid.to_ijk(below).tolist() == [[-1, -1, -1]]
    for bad in ([[np.nan, 0, 0]], [[1e30, 0, 0]]):
        with pytest.raises(ValueError, match="finite"):
            grid.to_ijk(bad)


def test_voxels_outside_are_refused(scene):
    _, grid, surface, _ = scene
    nz, ny, nx = grid.shape
    for outside in ([[0, 0, -1]], [[nx, 0, 0]], [[0, 0, 0], [0, ny, 0]], [[2**40, 0, 0]]):
        for call in (grid.zyx, grid.index, lambda v: vp.dense(v, True, grid)):
            with pytest.raises(IndexError):
                call(outside)
    with pytest.raises(IndexError, match=rf"voxel 1 is \(0, {ny}, 0\) \(x, y, z\).*{nx} x {ny} x {nz}"):
        vp.dense([[0, 0, 0], [0, ny, 0]], True, grid)
    with pytest.raises(ValueError, match="columns x, y, z"):
        grid.zyx([[1, 2]])
    with pytest.raises(ValueError, match="whole numbers"):
        grid.zyx([[1.5, 2, 3]])
    with pytest.raises(ValueError, match="grid's is"):
        grid.ijk(surface[1:])


@pytest.mark.parametrize("dtype", [np.bool_, np.uint8, np.int16, np.float32, np.float64, np.int64])
@pytest.mark.parametrize("columns", [(), (1,), (3,), (5,)])
def test_dense_holds_any_values(dtype, columns):
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (5, 6, 7))
    chosen = np.random.default_rng(3).permutation(5 * 6 * 7)[:40]
    z, y, x = np.unravel_index(chosen, grid.shape)
    voxels = np.stack([x, y, z], axis=1)
    values = np.random.default_rng(4).integers(0, 100, (40, *columns)).astype(dtype)
    for fill in (0, 1):
        made = vp.dense(voxels, values, grid, fill=fill, threads=2)
        expected = np.full((*grid.shape, *columns), fill, dtype)
        expected[z, y, x] = values
        assert made.dtype == dtype and np.array_equal(made, expected)
    with pytest.raises(ValueError, match="values have 40 rows, ijk has 39 voxels"):
        vp.dense(voxels[1:], values, grid)


def test_lists_of_torch_are_signed_and_index():
    torch = pytest.importorskip("torch")
    v, f = sphere(levels=2)
    mesh = (torch.from_numpy(v), torch.from_numpy(f.astype(np.int64)))
    grid = vp.fit(mesh, 24)
    lists = vp.fragments(mesh, grid)
    assert mesh[1][lists.triangles].shape == (len(lists.triangles), 3)
    assert [a.dtype for a in lists] == [torch.int32, torch.int64, torch.int64, torch.float32]
    assert lists.interpolate(mesh[0], mesh[1]).shape == (len(lists.triangles), 3)
    assert int(torch.bincount(lists.triangles).sum()) == len(lists.triangles) and int(lists.triangles.max()) < len(f)
    ids = torch.arange(len(f), dtype=torch.int32)
    voxels, rows = vp.sparse(mesh, grid, {"id": ids})
    surface = vp.voxelize(mesh, grid)
    assert bool(surface[grid.zyx(voxels)].all()) and rows["id"].dtype == torch.int32
    assert torch.equal(vp.dense(voxels, torch.ones(len(voxels), dtype=torch.bool), grid), surface)
    assert torch.equal(grid.to_ijk(grid.to_xyz(voxels)), voxels)
    assert torch.equal(surface.reshape(-1)[grid.index(voxels)], torch.ones(len(voxels), dtype=torch.bool))
    for words in (vp.voxelize(mesh, grid, packed=True), vp.solid(mesh, grid, packed=True)):
        assert words.dtype == torch.int32
    assert vp.bake(mesh, grid, ["count"])["count"].dtype == torch.int64
