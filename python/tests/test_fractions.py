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


def test_faces_of_a_box_are_its_overlaps():
    low, high, status = (0.625, 0.375, 1.25), (3.875, 3.0625, 6.5), {}
    names = ("fraction", "aperture_x", "aperture_y", "aperture_z", "area_vector")
    cells = vp.fractions(box(low, high), GRID, of=names, status=status)
    assert tuple(cells) == names and status["open_rows"] == 0
    assert np.array_equal(cells["fraction"], vp.fractions(box(low, high), GRID))
    area = np.zeros(3)
    for axis, name in enumerate(names[1:4]):
        faces = cells[name]
        shape = list(GRID.shape)
        shape[2 - axis] += 1
        assert faces.dtype == np.float64 and faces.shape == tuple(shape)
        # The faces inside lie where the plane is within the box, and are overlaps of the two other axes.
        planes = GRID.origin[axis] + GRID.voxel_size[axis] * np.arange(shape[2 - axis])
        wide_low, wide_high = list(low), list(high)
        wide_low[axis], wide_high[axis] = -100, 100
        across = box_fractions(GRID, wide_low, wide_high).take(0, axis=2 - axis)
        inside = (planes > low[axis]) & (planes <= high[axis])
        expected = np.expand_dims(across, 2 - axis) * inside.reshape([-1 if a == 2 - axis else 1 for a in range(3)])
        assert np.array_equal(faces, expected)
        # Discrete Gauss, to the last bit: the sizes are powers of two.
        face = np.prod(GRID.voxel_size) / GRID.voxel_size[axis]
        assert np.array_equal(cells["area_vector"][..., axis], -np.diff(faces, axis=2 - axis) * face)
        area[axis] = np.abs(cells["area_vector"][..., axis]).sum()
    size = np.subtract(high, low)
    assert np.array_equal(area, 2 * np.prod(size) / size)


def test_faces_of_crops_and_bodies_and_the_last_faces():
    # The first box leaves the grid at its high ends, where the last faces are inside.
    a, b = ((0.5, 0.25, 1), (9, 9, 20)), ((0.5, 1, 2), (2, 4, 8))
    names = ["area_vector", "aperture_z", "aperture_x", "aperture_y"]
    whole = vp.fractions([box(*a), box(*b)], GRID, of=names)
    each = vp.fractions([box(*a), box(*b)], GRID, of=names, bodies="each")
    for name in names:
        assert np.array_equal(whole[name], each[name].sum(axis=0))
    assert (each["aperture_x"][0, 1:, 1:, -1] == 1).all() and (each["aperture_z"][0, -1, 1:, 1:] == 1).all()
    assert (each["aperture_y"][0, 1:, -1, 1:] == 1).all() and not whole["aperture_x"][..., 0].any()
    part = vp.fractions([box(*a), box(*b)], GRID.crop((1, 3, 2), (6, 9, 4)), of=names)
    where = np.s_[1:7, 3:12, 2:6]
    assert np.array_equal(part["area_vector"], whole["area_vector"][where])
    for axis, name in enumerate(("aperture_x", "aperture_y", "aperture_z")):
        stop = [s.stop + (2 - axis == n) for n, s in enumerate(where)]
        assert np.array_equal(part[name], whole[name][tuple(slice(s.start, e) for s, e in zip(where, stop))])
    alone = vp.fractions([box(*a), box(*b)], GRID, of="aperture_y")
    assert np.array_equal(alone, whole["aperture_y"])


def test_face_centroids_of_a_box_are_those_of_its_overlaps():
    low, high = (0.625, 0.375, 1.25), (3.875, 3.0625, 6.5)
    names = [f"{what}_{axis}" for what in ("aperture", "face_centroid") for axis in "xyz"]
    for where in (GRID, GRID.crop((1, 1, 1), (4, 9, 3))):
        cells = vp.fractions(box(low, high), where, of=names)
        together = vp.fractions(box(low, high), where, of=[*names, "centroid", "area"])
        for axis in range(3):
            faces, middles = cells[names[axis]], cells[names[3 + axis]]
            assert middles.dtype == np.float32 and middles.shape == (*faces.shape, 3)
            assert np.array_equal(middles, together[names[3 + axis]])
            expected = np.zeros(middles.shape)
            for other in range(3):
                first = where.origin[other] + where.voxel_size[other] * np.arange(faces.shape[2 - other])
                begin = np.maximum(first, low[other])
                end = np.minimum(first + where.voxel_size[other], high[other])
                offset = ((begin + end) / 2 - first) / where.voxel_size[other] - 0.5
                shape = [-1 if a == 2 - other else 1 for a in range(3)]
                if other != axis:
                    expected[..., other] = offset.reshape(shape)
            expected[faces == 0] = 0
            assert np.abs(middles - expected).max() < 1e-6 and np.abs(middles).max() > 0.1
    each = vp.fractions([box(low, high), sphere()], GRID, of="face_centroid_z", bodies="each")
    assert each.shape == (2, 15, 20, 9, 3) and np.array_equal(
        each[0], vp.fractions(box(low, high), GRID, of="face_centroid_z")
    )


def test_area_of_a_sphere():
    mesh = sphere()
    grid = vp.fit(mesh, 20)
    cells = vp.fractions(mesh, grid, of=("area_vector", "aperture_y"), threads=1)
    for name, values in vp.fractions(mesh, grid, of=("area_vector", "aperture_y"), threads=2).items():
        assert cells[name].tobytes() == values.tobytes()
    assert np.abs(cells["area_vector"].sum(axis=(0, 1, 2))).max() < 1e-9  # a closed surface's is 0
    vertices, triangles = mesh
    corners = np.asarray(vertices, np.float64)[np.asarray(triangles)]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    found = np.linalg.norm(cells["area_vector"], axis=-1).sum()
    assert 0.99 * area < found <= area * (1 + 1e-6)  # a curved part counts as its chord


def test_centroids_and_areas_of_a_box_are_those_of_its_overlaps():
    low, high, status = np.array((0.625, 0.375, 1)), np.array((3.875, 3.0625, 6.5)), {}
    names = ["multi_cut", "centroid", "area", "area_centroid"]
    cells = vp.fractions(box(low, high), GRID, of=names, status=status)
    assert list(cells) == names and not cells["multi_cut"].any()
    assert status["lost_centroids"] == 7 * 12  # of voxels with nothing but the side at z = 1, their upper face
    shape = (*GRID.shape, 3)
    assert cells["centroid"].dtype == cells["area_centroid"].dtype == np.float32
    assert cells["area"].dtype == np.float64 and cells["multi_cut"].dtype == np.bool_
    assert cells["centroid"].shape == cells["area_centroid"].shape == shape and cells["area"].shape == GRID.shape
    at = np.stack(np.meshgrid(*(np.arange(n) for n in GRID.shape), indexing="ij"), -1)[..., ::-1]
    first = np.array(GRID.origin) + at * GRID.voxel_size
    start, end = np.maximum(first, low), np.minimum(first + GRID.voxel_size, high)
    has_part = (start < end).all(-1)
    middle = ((start + end) / 2 - first) / GRID.voxel_size - 0.5
    assert np.abs(cells["centroid"] - middle)[has_part].max() < 1e-6 and not cells["centroid"][~has_part].any()
    size = high - low
    assert cells["area"].sum() == pytest.approx(2 * (size * np.roll(size, 1)).sum(), rel=1e-12)
    weighted = (cells["area"][..., None] * (first + (cells["area_centroid"] + 0.5) * GRID.voxel_size)).sum((0, 1, 2))
    assert weighted / cells["area"].sum() == pytest.approx((low + high) / 2, rel=1e-6)
    # The side at z = 1, a plane between voxels, is the lower voxels'.
    assert (cells["area"][0] > 0).any() and np.abs(cells["area_centroid"][0][cells["area"][0] > 0][:, 2] - 0.5).max() < 1e-6


def test_marks_of_voxels_with_two_sheets_and_bodies_apart():
    plate = vp.fractions(box((0.25, 0.125, 2.25), (4.25, 4.875, 2.75)), GRID, of="multi_cut")
    assert plate[2, 1:-1, 1:-1].all() and plate.sum() == plate[2, 1:-1, 1:-1].size
    a, b = box((0.5, 0.25, 1.25), (3.25, 3, 1.5)), box((0.5, 0.25, 1.75), (3.25, 3, 5))
    together = vp.fractions([a, b], GRID, of=("multi_cut", "area", "centroid"))
    each = vp.fractions([a, b], GRID, of=("multi_cut", "area", "centroid"), bodies="each")
    assert np.allclose(together["area"], each["area"].sum(0), rtol=1e-12) and each["centroid"].shape == (2, *GRID.shape, 3)
    assert (together["multi_cut"] & ~each["multi_cut"].any(0)).any()  # a sheet of each
    for threads in (1, 2):
        assert np.array_equal(vp.fractions([a, b], GRID, of="centroid", threads=threads), together["centroid"])


def test_open_meshes_warn_and_mistakes_are_named():
    vertices, triangles = box((1, 1, 1), (3, 3, 3))
    with pytest.warns(vp.OpenMeshWarning, match="rows of voxels do not balance"):
        vp.fractions((vertices, np.delete(triangles, 8, axis=0)), GRID)  # of the face at low x
    with pytest.warns(vp.OpenMeshWarning, match=r" of 406 rows"):  # along x and y
        vp.fractions((vertices, np.delete(triangles, 8, axis=0)), GRID, of=("aperture_y",), status=(status := {}))
    assert status["open_rows"] > 0
    for mistake in ("areas", ("fraction", "aperture"), ()):
        with pytest.raises(ValueError, match="of "):
            vp.fractions((vertices, triangles), GRID, of=mistake)
    with pytest.raises(ValueError, match="bodies"):
        vp.fractions((vertices, triangles), GRID, bodies="some")
    with pytest.raises(TypeError, match="grid"):
        vp.fractions((vertices, triangles), 64)
    with pytest.raises(IndexError):
        vp.fractions((vertices, np.array([[0, 1, 99]])), GRID)
    empty = vp.fractions((np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)), GRID)
    assert empty.shape == GRID.shape and not empty.any()


def test_closed_holes_are_those_of_the_closed_box():
    low, high = (0.625, 0.375, 1.25), (3.875, 3.0625, 6.5)
    vertices, triangles = box(low, high)
    corners = np.asarray(vertices)[np.asarray(triangles)]
    is_side = (corners[:, :, 0] == high[0]).all(axis=1)
    open_box = (vertices, np.asarray(triangles)[~is_side])
    assert is_side.sum() == 2
    expected, status = box_fractions(GRID, low, high), {}
    closed = vp.fractions(open_box, GRID, repair="close_holes", status=status)
    assert np.abs(closed - expected).max() < 1e-7
    assert [status[name] for name in ("open_edges", "open_rows", "hole_edges", "holes", "cones")] == [0, 0, 4, 1, 1]
    both = vp.fractions([open_box, open_box], GRID, bodies="each", repair="close_holes", status=status)
    assert np.array_equal(both[0], closed) and np.array_equal(both[1], closed) and status["cones"] == 2
    with pytest.warns(vp.OpenMeshWarning):
        left = vp.fractions(open_box, GRID, repair="close_holes", max_hole_edges=3, status=status)
    assert [status[name] for name in ("open_edges", "holes", "cones")] == [4, 1, 0]
    with pytest.warns(vp.OpenMeshWarning):
        assert np.array_equal(left, vp.fractions(open_box, GRID, status=status))
    assert status["holes"] == 0
    measured = vp.fractions(open_box, GRID, of=("area", "area_vector"), repair="close_holes")
    size = np.subtract(high, low)
    assert measured["area"].sum() == pytest.approx(2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]))
    assert np.abs(measured["area_vector"].sum(axis=(0, 1, 2))).max() < 1e-9
    with pytest.raises(ValueError, match="repair"):
        vp.fractions(open_box, GRID, repair="vote")


def opened(lists, grid, name):
    """Voxels and cubes of sparse_fractions() as an array, each voxel of which was written once at most."""
    values = lists.values[name]
    array, times = vp.dense(lists.voxels, values, grid), vp.dense(lists.voxels, 1, grid)
    for (x, y, z, side), value in zip(lists.cubes, lists.cube_values[name]):
        place = np.s_[z : z + side, y : y + side, x : x + side]
        array[place] = value
        times[place] += 1
    assert times.max(initial=0) <= 1
    return array


def test_lists_and_cubes_are_the_dense_values():
    names = ["multi_cut", "fraction", "centroid", "area", "area_centroid"]
    low, high = (4.03, 2.27, 3.4), (20.6, 10.9, 48.2)
    outer, inner = box(low, high), box((7.9, 3.9, 9.7), (16.1, 8.7, 32.3))
    grid = vp.Grid((0, 0, 0), (0.5, 0.25, 1), (50, 44, 45))
    for where in (grid, grid.crop((3, 5, 9), (45, 33, 28))):
        status, expected = {}, {}
        lists = vp.sparse_fractions([outer, inner], where, of=names, status=status)
        dense = vp.fractions([outer, inner], where, of=names, status=expected)
        assert isinstance(lists, vp.SparseFractions) and status == expected
        assert type(lists.voxels) is vp.VoxelList and lists.voxels.dtype == lists.cubes.dtype == np.int32
        assert list(lists.values) == list(lists.cube_values) == names
        for name in names:
            found = opened(lists, where, name)
            assert found.dtype == dense[name].dtype and found.tobytes() == dense[name].tobytes(), name
            assert len(lists.cube_values[name]) == len(lists.cubes)
        assert set(lists.cubes[:, 3]) >= {8, 16} and set(lists.cube_values["fraction"]) == {1, 2}
        assert not lists.cube_values["area"].any() and not lists.cube_values["centroid"].any()
        alone = vp.sparse_fractions([outer, inner], where, threads=1)
        assert opened(alone, where, "fraction").tobytes() == dense["fraction"].tobytes()


def test_lists_of_bodies_and_of_open_and_empty_meshes():
    a, b = box((0.5, 0.25, 1), (6, 4.6, 8)), box((1.5, 1, 2), (5, 4, 8.5))
    each = vp.sparse_fractions([a, b], GRID, bodies="each", of=("centroid", "fraction"))
    dense = vp.fractions([a, b], GRID, bodies="each", of=("centroid", "fraction"))
    assert len(each) == 2
    for body, lists in enumerate(each):
        assert list(lists.values) == ["centroid", "fraction"]
        for name in lists.values:
            assert opened(lists, GRID, name).tobytes() == dense[name][body].tobytes()
    vertices, triangles = box((0.625, 0.375, 1.25), (3.875, 3.0625, 6.5))
    open_box, status = (vertices, np.delete(triangles, 8, axis=0)), {}
    with pytest.warns(vp.OpenMeshWarning, match=r" of 280 rows"):
        lists = vp.sparse_fractions(open_box, GRID, status=status)
    assert status["open_rows"] > 0 and status["open_edges"] == 3
    closed = vp.sparse_fractions(open_box, GRID, repair="close_holes", status=status)
    assert status["cones"] == 1 and status["open_edges"] == 0
    assert opened(closed, GRID, "fraction").tobytes() == vp.fractions(open_box, GRID, repair="close_holes").tobytes()
    assert not np.array_equal(opened(closed, GRID, "fraction"), opened(lists, GRID, "fraction"))
    none = vp.sparse_fractions((np.zeros((0, 3)), np.zeros((0, 3), int)), GRID, of=("area", "area_centroid"))
    assert none.voxels.shape == (0, 3) and none.cubes.shape == (0, 4)
    assert none.values["area"].shape == (0,) and none.cube_values["area_centroid"].shape == (0, 3)


def test_lists_by_voxel_are_the_fractions_of_each_body():
    a, b, c = box((0.5, 0.25, 1), (3.25, 3, 5)), box((2.5, 1, 2), (6, 4, 8)), sphere()
    for where in (GRID, GRID.crop((1, 3, 2), (9, 12, 6))):
        status, expected = {}, {}
        lists = vp.fraction_lists([a, b, c], where, status=status)
        dense = vp.fractions([a, b, c], where, bodies="each", status=expected)
        assert isinstance(lists, vp.FractionLists) and type(lists.voxels) is vp.VoxelList
        assert lists.offsets.dtype == np.int64 and lists.bodies.dtype == np.int32
        found = np.zeros_like(dense)
        entries = np.repeat(lists.voxels, np.diff(lists.offsets), axis=0)
        found[(lists.bodies, *where.zyx(entries))] = lists.fractions
        assert found.tobytes() == dense.tobytes()
        numbers = np.ravel_multi_index(where.zyx(lists.voxels), where.shape)
        assert (np.diff(numbers) > 0).all()  # z-major, each once
        first = np.isin(np.arange(len(lists.bodies)), lists.offsets)
        assert (first[1:] | (np.diff(lists.bodies) > 0)).all() and np.diff(lists.offsets).max() > 1
        assert status["voxels"] == len(lists.voxels) and status["fragments"] == len(lists.bodies)
        assert [status[n] for n in ("cut_voxels", "below_zero")] == [expected[n] for n in ("cut_voxels", "below_zero")]
        alone = vp.fraction_lists([a, b, c], where, threads=1)
        assert all(x.tobytes() == y.tobytes() for x, y in zip(alone, lists))
    vertices, triangles = a
    open_box, status = (vertices, np.delete(triangles, 8, axis=0)), {}
    with pytest.warns(vp.OpenMeshWarning, match=r" of 560 rows"):
        vp.fraction_lists([b, open_box], GRID, status=status)
    assert status["open_edges"] == 3
    closed = vp.fraction_lists([b, open_box], GRID, repair="close_holes", status=status)
    assert status["open_edges"] == 0 and status["cones"] == 1 and set(closed.bodies) == {0, 1}
    none = vp.fraction_lists((np.zeros((0, 3)), np.zeros((0, 3), int)), GRID)
    assert none.voxels.shape == (0, 3) and none.offsets.tolist() == [0] and none.fractions.shape == (0,)
    with pytest.raises(ValueError, match="repair"):
        vp.fraction_lists(a, GRID, repair="vote")
    with pytest.raises(TypeError, match=r"fraction_lists\(mesh, fit\(mesh, 64\)\)"):
        vp.fraction_lists(a, 64)
    with pytest.raises(IndexError):
        vp.fraction_lists((vertices, [(0, 1, 99)]), GRID)


def test_lists_of_a_grid_that_does_not_fit_densely():
    # 2^60 voxels, of which 24 by 24 by 24 and their sides are listed.
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (1 << 20, 1 << 20, 1 << 20))
    corner = np.array((500_000, 8_000, 1_000_000))
    lists = vp.sparse_fractions(box(corner + 0.25, corner + 24.5), grid, of=("fraction", "area"))
    volume = lists.values["fraction"].sum(dtype=np.float64)
    volume += (lists.cube_values["fraction"] * lists.cubes[:, 3].astype(np.float64) ** 3).sum()
    assert volume == 24.25**3  # in units of 1/8: positions beyond 2^19 have 5 bits after the point
    assert lists.values["area"].sum() == 6 * 24.25**2 and len(lists.voxels) < 25**3 and len(lists.cubes) > 0
    assert lists.voxels.min(axis=0).tolist() == corner.tolist() and lists.voxels.max(axis=0).tolist() == (corner + 24).tolist()


def test_mistakes_of_lists_are_named():
    mesh = box((1, 1, 1), (2, 2, 2))
    for mistake in ("aperture_x", ("fraction", "area_vector"), ()):
        with pytest.raises(ValueError, match="of "):
            vp.sparse_fractions(mesh, GRID, of=mistake)
    with pytest.raises(ValueError, match="bodies"):
        vp.sparse_fractions(mesh, GRID, bodies="some")
    with pytest.raises(ValueError, match="repair"):
        vp.sparse_fractions(mesh, GRID, repair="vote")
    with pytest.raises(TypeError, match=r"sparse_fractions\(mesh, fit\(mesh, 64\)\)"):
        vp.sparse_fractions(mesh, 64)
    with pytest.raises(IndexError):
        vp.sparse_fractions((mesh[0], [(0, 1, 99)]), GRID)
