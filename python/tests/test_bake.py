# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, sphere


def folded(lists, values, fold):
    """The reference: fold(values of a voxel's fragments, in order) for each voxel of fragment lists."""
    return [fold(values[a:b]) for a, b in zip(lists.offsets[:-1], lists.offsets[1:])]


@pytest.fixture(scope="module")
def scene():
    mesh = sphere(levels=2)
    grid = vp.fit(mesh, 20)
    return mesh, grid, vp.fragments(mesh, grid)


def at(dense, lists):
    return dense[tuple(lists.voxels.T[::-1])]


@pytest.mark.parametrize("columns", [1, 2, 3, 4, 5, 9])
def test_means_of_vertex_values(scene, columns):
    mesh, grid, lists = scene
    values = np.random.default_rng(1).random((len(mesh[0]), columns), np.float32)
    baked = vp.bake(mesh, grid, {"a": values})["a"]
    assert baked.shape == (*grid.shape, columns) and baked.dtype == np.float32
    corners = values[mesh[1][lists.triangles]].astype(np.float64)
    per_fragment = (corners * lists.barycentrics[:, :, np.newaxis]).sum(axis=1)
    expected = folded(lists, per_fragment, lambda v: v.mean(axis=0))
    assert np.allclose(at(baked, lists), expected, atol=1e-5)
    empty = ~vp.voxelize(mesh, grid)
    assert (baked[empty] == 0).all()


@pytest.mark.parametrize("blend, fold", [("sum", sum), ("min", min), ("max", max), ("last", lambda v: v[-1])])
@pytest.mark.parametrize("dtype", [np.float32, np.int32, np.uint8, np.int64])
def test_blends_of_triangle_values(scene, blend, fold, dtype):
    mesh, grid, lists = scene
    values = np.random.default_rng(2).integers(1, 200, len(mesh[1])).astype(dtype)
    baked = vp.bake(mesh, grid, {"a": values}, blend=blend, fill=7)["a"]
    assert baked.dtype == (np.int64 if blend == "sum" and dtype != np.float32 else dtype)
    expected = folded(lists, [v.item() for v in values[lists.triangles]], fold)
    assert np.array_equal(at(baked, lists), expected)
    assert (baked[~vp.voxelize(mesh, grid)] == 7).all()


def test_integers_are_exact(scene):
    mesh, grid, lists = scene
    values = np.arange(len(mesh[1]), dtype=np.int64) + 2**60
    baked = vp.bake(mesh, grid, {"id": values})["id"]
    assert baked.dtype == np.int64
    assert np.array_equal(at(baked, lists), folded(lists, [int(v) for v in values[lists.triangles]], lambda v: v[-1]))
    with pytest.raises(ValueError, match="2.63"):
        vp.bake(mesh, grid, {"id": values.astype(np.uint64) + np.uint64(2**63)})


def test_colours_stay_bytes(scene):
    mesh, grid, _ = scene
    colors = np.full((len(mesh[0]), 3), (10, 128, 255), np.uint8)
    baked = vp.bake(mesh, grid, {"rgb": colors})["rgb"]
    surface = vp.voxelize(mesh, grid)
    assert baked.dtype == np.uint8 and (baked[surface] == (10, 128, 255)).all()


def test_several_attributes_and_threads(scene):
    mesh, grid, _ = scene
    rgb = np.random.default_rng(3).random((len(mesh[0]), 3), np.float32)
    ids = np.arange(len(mesh[1]), dtype=np.int32)
    one = vp.bake(mesh, grid, {"rgb": rgb, "id": ids}, blend={"rgb": "mean", "id": "last"}, threads=1)
    many = vp.bake(mesh, grid, {"rgb": rgb, "id": ids}, threads=4)
    for name in ("rgb", "id"):
        assert one[name].tobytes() == many[name].tobytes()


@pytest.mark.parametrize("columns", [0, 1, 3, 6])
def test_sparse_is_the_dense_grid_where_it_is_occupied(scene, columns):
    mesh, grid, _ = scene
    shape = (len(mesh[0]),) if columns == 0 else (len(mesh[0]), columns)
    values = {
        "a": np.random.default_rng(4).random(shape, np.float32),
        "id": np.arange(len(mesh[1]), dtype=np.uint32),
        "c": np.random.default_rng(5).integers(0, 255, (len(mesh[0]), 3)).astype(np.uint8),
    }
    voxels, attributes = vp.sparse(mesh, grid, values)
    dense = vp.bake(mesh, grid, values)
    place = tuple(voxels.T[::-1])
    occupied = np.zeros(grid.shape, bool)
    occupied[place] = True
    assert voxels.dtype == np.int32 and np.array_equal(occupied, vp.voxelize(mesh, grid))
    for name in values:
        assert attributes[name].dtype == dense[name].dtype
        assert np.array_equal(attributes[name], dense[name][place])


def test_sparse_in_a_grid_that_no_memory_holds():
    mesh = sphere(1e-4, (0.3, 0.3, 0.3), levels=1)
    grid = vp.Grid((0, 0, 0), (2.0**-20,) * 3, (2**20,) * 3)
    voxels, _ = vp.sparse(mesh, grid)
    assert len(voxels) > 1000 and np.abs(voxels * 2.0**-20 - 0.3).max() < 1.1e-4


def test_dense_memory_is_the_results_alone():
    """The values are folded in bricks: a dense array beside the result would show."""
    import tracemalloc

    mesh = sphere(levels=1)
    grid = vp.fit(mesh, 96)
    colors = np.full((len(mesh[0]), 3), 77, np.uint8)
    tracemalloc.start()
    baked = vp.bake(mesh, grid, {"rgb": colors, "x": mesh[0][:, 0]})
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1.5 * sum(a.nbytes for a in baked.values())


@pytest.mark.parametrize("extent", ["outer", "centre", "inner"])
def test_solids_as_lists_and_their_values(scene, extent):
    mesh, grid, _ = scene
    ids = np.arange(len(mesh[1]), dtype=np.int32)
    voxels, rows = vp.sparse(mesh, grid, {"id": ids, "x": mesh[0][:, 0]}, solid="nonzero", extent=extent, fill=-5)
    inside = vp.solid(mesh, grid, extent=extent)
    assert isinstance(voxels, vp.VoxelList) and np.array_equal(vp.dense(voxels, True, grid), inside)
    assert np.array_equal(voxels, vp.sparse(mesh, grid, solid="nonzero", extent=extent)[0])
    dense = vp.bake(mesh, grid, {"id": ids, "x": mesh[0][:, 0]}, fill=-5)
    for name, row in rows.items():
        assert np.array_equal(row, dense[name][grid.zyx(voxels)])
    own = vp.sparse(mesh, grid, ["triangle"], solid="nonzero", extent=extent)[1]["triangle"]
    assert np.array_equal(own, vp.bake(mesh, grid, "triangle")["triangle"][grid.zyx(voxels)])


def test_values_must_fit_the_mesh(scene):
    mesh, grid, _ = scene
    with pytest.raises(ValueError, match="a: 3 rows of values"):
        vp.bake(mesh, grid, {"a": np.zeros(3)})
    with pytest.raises(ValueError, match="blend is one of"):
        vp.bake(mesh, grid, {"a": np.zeros(len(mesh[0]))}, blend="over")
    tetrahedron = (
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32),
        np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    )
    ids = np.array([5, 6, 7, 8])
    with pytest.raises(ValueError, match="as many vertices as triangles"):
        vp.bake(tetrahedron, vp.fit(tetrahedron, 4), {"id": ids})
    by_triangle = vp.bake(tetrahedron, vp.fit(tetrahedron, 4), {"id": ids}, per={"id": "triangle"}, blend="max")
    assert by_triangle["id"].max() == 8


def test_a_mean_does_not_depend_on_the_order_of_triangles(scene):
    (v, f), grid, _ = scene
    values = np.random.default_rng(6).random(len(f), np.float32)
    order = np.random.default_rng(7).permutation(len(f))
    a = vp.bake((v, f), grid, {"a": values})["a"]
    b = vp.bake((v, f[order]), grid, {"a": values[order]})["a"]
    assert a.tobytes() == b.tobytes()


def test_a_grid_that_cannot_be_held_is_refused_at_once():
    vertices, triangles = box((0, 0, 0), (1, 1, 1))
    grid = vp.Grid((0, 0, 0), (2.0**-20,) * 3, (2**20,) * 3)
    for values in ({"a": np.zeros(len(triangles))}, "occupancy"):
        with pytest.raises(MemoryError, match="Unable to allocate"):
            vp.bake((vertices, triangles), grid, values, **({"per": {"a": "triangle"}} if isinstance(values, dict) else {}))


def test_fill_is_a_value_of_the_type(scene):
    vertices, triangles = box((0, 0, 0), (1, 1, 1))
    grid = vp.fit((vertices, triangles), 6)
    for dtype, fill in ((np.int8, 300), (np.int32, 1.7), (np.uint32, -1), (np.int64, 2**70), (np.uint8, np.nan)):
        with pytest.raises(ValueError, match="fill is a whole number from"):
            vp.bake((vertices, triangles), grid, {"a": np.zeros(len(triangles), dtype)}, fill=fill, per={"a": "triangle"})
    with pytest.raises(TypeError, match="fill is a number"):
        vp.bake((vertices, triangles), grid, {"a": np.zeros(len(triangles))}, fill=None, per={"a": "triangle"})
    made = vp.bake((vertices, triangles), grid, {"a": np.ones(len(triangles), np.uint64)}, fill=2**63, per={"a": "triangle"})["a"]
    assert made.dtype == np.uint64 and made.max() == 2**63
    with pytest.raises(ValueError, match="points or lines"):
        vp.bake(vp.points(np.eye(3)), grid, {"a": np.array([5, 6, 7])})
