# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import warnings

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, sphere


def inverted(mesh):
    return mesh[0], mesh[1][:, ::-1].copy()


def test_box_is_filled_exactly():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (10, 11, 12))
    expected = np.zeros(grid.shape, bool)
    expected[4:9, 3:8, 2:6] = True
    status = {}
    assert np.array_equal(vp.solid(box((2, 3, 4), (6, 8, 9)), grid, extent="centre", status=status), expected)
    assert status["open_rows"] == 0 and status["max_winding"] == 1


def test_extents_contain_each_other():
    mesh = sphere(levels=3)
    grid = vp.fit(mesh, 40)
    outer, centre, inner = (vp.solid(mesh, grid, extent=e) for e in ("outer", "centre", "inner"))
    surface = vp.voxelize(mesh, grid)
    assert np.array_equal(outer, centre | surface)
    assert np.array_equal(inner, centre & ~surface)
    assert np.array_equal(vp.solid(mesh, grid), outer)


def test_fill_rules():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (12, 12, 12))
    shell, core = box((1, 1, 1), (11, 11, 11)), box((3, 3, 3), (9, 9, 9))

    def volume(meshes, **options):
        return int(vp.solid(meshes, grid, extent="centre", **options).sum())

    assert volume([shell, inverted(core)]) == 1000 - 216
    assert volume([shell, core]) == 1000
    assert volume([shell, core], fill="even_odd") == 1000 - 216
    assert volume([shell, core], fill="even_odd", bodies="each") == 1000
    assert volume([inverted(shell)], fill="positive") == 0
    assert volume([inverted(shell)]) == 1000


def test_open_mesh_warns_and_repairs_close_it():
    v, f = box((2, 2, 2), (8, 8, 8))
    opened = (v, f[2:])  # without the low z face: rows along x still balance
    holed = (v, np.delete(f, [8, 9], axis=0))  # without the low x face
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (10, 10, 10))
    whole = vp.solid((v, f), grid, extent="centre")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(vp.solid(opened, grid, extent="centre"), whole)
    with pytest.warns(vp.OpenMeshWarning, match="36 of 100 rows"):
        vp.solid(holed, grid, extent="centre")
    status = {}
    assert np.array_equal(vp.solid(holed, grid, extent="centre", repair="close_holes", status=status), whole)
    assert status["holes"] == status["cones"] == 1 and status["hole_edges"] == 4
    vote = vp.solid(holed, grid, repair="vote")
    assert np.array_equal(vote & whole, whole)
    assert np.array_equal(vp.solid(holed, grid, extent="centre", repair="winding", status=status), whole)
    assert status["holes"] == 1 and status["open_rows"] == 0


def test_winding_is_the_solid_angle_of_the_triangles():
    def numbers(mesh, points):
        """Generalized winding numbers, by the formula of van Oosterom and Strackee."""
        v, f = mesh
        a, b, c = (v[f[:, k]][None].astype(float) - points[:, None] for k in range(3))
        length = [np.linalg.norm(x, axis=2) for x in (a, b, c)]
        volume = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        other = length[0] * length[1] * length[2]
        for x, y, n in ((a, b, length[2]), (b, c, length[0]), (c, a, length[1])):
            other += np.einsum("ijk,ijk->ij", x, y) * n
        return np.arctan2(volume, other).sum(axis=1) / (2 * np.pi)

    v, f = sphere(5.0, (6.1, 5.9, 6.3))
    for fill, faces in (("nonzero", f[::-1][: len(f) // 2]), ("nonzero", f[40:, ::-1]), ("positive", f[25:])):
        mesh, grid = (v, faces), vp.Grid((0, 0, 0), (1, 1, 1), (12, 12, 12))
        inside = vp.solid(mesh, grid, fill, extent="centre", repair="winding")
        k, j, i = np.indices(inside.shape).reshape(3, -1)
        w = numbers(mesh, np.stack((i, j, k), 1) + 0.5).reshape(inside.shape)
        size = np.abs(w) if fill == "nonzero" else w
        sure = np.abs(size - 0.5) > 1e-5  # positions are snapped
        assert sure.mean() > 0.99 and inside.sum() > 50
        assert np.array_equal(inside[sure], size[sure] > 0.5)
        crop = grid.crop((3, 4, 2), (6, 8, 9))
        assert np.array_equal(vp.solid(mesh, crop, fill, extent="centre", repair="winding"), inside[3:9, 4:12, 2:11])
    with pytest.raises(ValueError, match="neither even nor odd"):
        vp.solid((v, f), grid, "even_odd", repair="winding")


def test_exterior_fills_cavities():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (12, 12, 12))
    both = [box((1, 1, 1), (11, 11, 11)), inverted(box((3, 3, 3), (9, 9, 9)))]
    assert vp.solid(both, grid, repair="exterior").sum() == vp.solid(both[0], grid).sum()


def without_faces(mesh, count, direction=(0.5, 0.6, 0.7)):
    """Without the faces that lie furthest in a direction."""
    v, f = mesh
    order = np.argsort(-(v[f].mean(axis=1) @ np.asarray(direction)), kind="stable")
    return v, f[np.sort(order[count:])]


def volume_of(inside, grid):
    return float(inside.sum() * np.prod(grid.voxel_size))


@pytest.mark.parametrize("size", [32, 48])
def test_exterior_of_a_sphere_without_forty_faces_says_what_it_lost_and_names_what_keeps_it(size):
    whole = sphere(levels=4)
    mesh = without_faces(whole, 40)
    grid = vp.fit(mesh, size)
    truth = vp.solid(whole, grid, extent="inner")
    status = {}
    with pytest.warns(vp.OpenMeshWarning, match="came in by 1 hole of the mesh, of up to [0-9]+ voxels") as caught:
        emptied = vp.solid(mesh, grid, repair="exterior", status=status)
    assert volume_of(emptied & truth, grid) < 0.1 * volume_of(truth, grid)
    assert status["open_rows"] == 0 and status["lost_voxels"] > 0.9 * truth.sum()
    assert status["entered_holes"] == 1 and status["enclosed_voxels"] == 0
    # The hole is a cap of 40 of 2048 faces: 2 sin(acos(1 - 2 * 40 / 2048)) of the radius across.
    across = 2 * np.sin(np.arccos(1 - 80 / 2048)) * size / 2
    assert 0.6 * across < status["hole_width"] < 1.4 * across + 2
    closing = status["tried_closing"]
    message = str(caught[0].message)
    assert len(caught) == 1 and f"closing={closing}" in message and 'repair="close_holes"' in message
    assert str(status["lost_voxels"]) in message and f'{status["hole_width"]} voxels' in message
    # What it names does as it says, and is silent.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for options in ({"repair": "exterior", "closing": closing}, {"repair": "close_holes"}):
            kept = vp.solid(mesh, grid, **options, status=status)
            assert volume_of(kept & truth, grid) > 0.95 * volume_of(truth, grid)
    assert status["open_rows"] == 0


def test_open_mesh_warning_names_what_was_tried_and_helps():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (36, 36, 36))
    whole = sphere(radius=15.0, centre=(18.1, 18.2, 18.3), levels=4)
    mesh = without_faces(whole, 40)
    truth = vp.solid(whole, grid, extent="inner")

    def message(mesh, **options):
        with pytest.warns(vp.OpenMeshWarning) as caught:
            vp.solid(mesh, grid, **options)
        assert len(caught) == 1
        return str(caught[0].message)

    text = message(mesh)
    closing = int(text.split('repair="exterior", closing=')[1].split()[0])
    for options in ({"repair": "exterior", "closing": closing}, {"repair": "close_holes"}):
        assert f'repair="{options["repair"]}"' in text
        assert (vp.solid(mesh, grid, **options) & truth).sum() > 0.95 * truth.sum()
    # A crack: the flood does not come in, and needs no closing.
    cracked = (whole[0] * [1, 1, 1], np.delete(whole[1], 1000, axis=0))
    fine = vp.Grid((0, 0, 0), (3, 3, 3), (12, 12, 12))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        vp.solid(cracked, fine, repair="exterior")
    assert not caught
    assert "tried" not in message(mesh, diagnose=False)
    assert 'close_holes" without max_hole_edges' in message(mesh, repair="close_holes", max_hole_edges=3)
    # A sheet encloses nothing, whatever is done: no flood is recommended.
    sheet = (np.array([[5, 5, 5], [5, 30, 5], [5, 5, 30]], np.float32), np.array([[0, 1, 2]], np.uint32))
    assert "exterior" not in message(sheet)


def test_exterior_refuses_a_grid_within_the_mesh_and_says_where_the_mesh_leaves_it():
    mesh = sphere(radius=15.0, centre=(18, 18, 18), levels=3)
    whole = vp.Grid((0, 0, 0), (1, 1, 1), (36, 36, 36))
    crop = vp.solid(mesh, whole, repair="exterior")[:, :, :18]
    with pytest.raises(ValueError, match="crop without whole"):
        vp.solid(mesh, vp.Grid((14, 14, 14), (1, 1, 1), (8, 8, 8)), repair="exterior")
    status = {}
    with pytest.warns(vp.OpenMeshWarning, match="where the mesh leaves the grid"):
        half = vp.solid(mesh, vp.Grid((0, 0, 0), (1, 1, 1), (36, 36, 18)), repair="exterior", status=status)
    assert status["face_voxels"] == status["lost_voxels"] == (crop & ~half).sum() > 4000
    assert status["entered_holes"] == status["tried_closing"] == 0
    outside = vp.Grid((40, 40, 40), (1, 1, 1), (8, 8, 8))
    assert not vp.solid(mesh, outside, repair="exterior").any()


@pytest.mark.parametrize("repair", ["exterior", "vote"])
def test_repairs_with_an_inside_of_their_own_refuse_a_rule_and_an_extent(repair):
    mesh = box()
    grid = vp.fit(mesh, 8)
    for options in ({"fill": "even_odd"}, {"fill": "positive"}, {"extent": "centre"}, {"extent": "inner"}):
        with pytest.raises(ValueError, match=next(iter(options))):
            vp.solid(mesh, grid, repair=repair, **options)
        vp.solid(mesh, grid, repair="close_holes", **options)
    assert vp.solid(mesh, grid, repair=repair, fill="nonzero", extent="outer").all()


def test_bad_options():
    mesh = box()
    grid = vp.fit(mesh, 8)
    for name, value in (("fill", "odd"), ("extent", "all"), ("repair", "glue"), ("bodies", "some")):
        with pytest.raises(ValueError, match=f"{name} is one of"):
            vp.solid(mesh, grid, **{name: value})
    with pytest.raises(ValueError, match="closing is 0 to 64, not 65"):
        vp.solid(mesh, grid, repair="exterior", closing=65)
    with pytest.raises(ValueError, match="crop"):
        vp.solid(mesh, grid.crop((0, 0, 0), (4, 4, 4)), repair="exterior")


def test_packed_and_tiled_solids_are_the_same_voxels():
    mesh = sphere(levels=3)
    grid = vp.fit(mesh, (50, 60, 70))
    inside = vp.solid(mesh, grid, extent="centre")
    words = vp.solid(mesh, grid, extent="centre", packed=True)
    assert words.dtype == np.uint32 and words.shape == (50, 60, 3)
    bits = np.unpackbits(words.view(np.uint8), axis=-1, bitorder="little")[..., :70].astype(bool)
    assert np.array_equal(bits, inside)
    voxels, cubes = vp.tiles(mesh, grid, extent="centre")
    assert len(cubes) > 3 and len(voxels) + (cubes[:, 3] ** 3).sum() == inside.sum()
    made = vp.dense(voxels, True, grid)
    for x, y, z, side in cubes:
        assert not made[z : z + side, y : y + side, x : x + side].any()
        made[z : z + side, y : y + side, x : x + side] = True
    assert np.array_equal(made, inside)
    part = grid.crop((3, 4, 5), (30, 31, 33))
    assert np.array_equal(vp.dense(vp.sparse(mesh, part, solid="nonzero", extent="centre")[0], True, part), inside[3:33, 4:35, 5:38])


def test_open_solids_as_lists_warn():
    v, f = box((2, 2, 2), (8, 8, 8))
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (10, 10, 10))
    with pytest.warns(vp.OpenMeshWarning, match="36 rows"):
        vp.tiles((v, np.delete(f, [8, 9], axis=0)), grid)
