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


def test_exterior_fills_cavities():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (12, 12, 12))
    both = [box((1, 1, 1), (11, 11, 11)), inverted(box((3, 3, 3), (9, 9, 9)))]
    assert vp.solid(both, grid, repair="exterior").sum() == vp.solid(both[0], grid).sum()


def test_bad_options():
    mesh = box()
    grid = vp.fit(mesh, 8)
    for name, value in (("fill", "odd"), ("extent", "all"), ("repair", "glue"), ("bodies", "some")):
        with pytest.raises(ValueError, match=f"{name} is one of"):
            vp.solid(mesh, grid, **{name: value})
    with pytest.raises(ValueError, match="solid options"):
        vp.solid(mesh, grid, repair="exterior", closing=65)
    with pytest.raises(ValueError, match="crop"):
        vp.solid(mesh, grid.crop((0, 0, 0), (4, 4, 4)), repair="exterior")
