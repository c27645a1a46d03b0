# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""What wrong arguments say: the argument by name, and what was expected."""

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box

MESH = box()
GRID = vp.fit(MESH, 8)
V, F = MESH
NO_TRIANGLES = (np.full((3, 3), np.nan, np.float32), np.array([[0, 1, 2]]))
RGB = {"rgb": np.zeros((8, 3), np.uint8)}

CASES = [
    (TypeError, r"grid is a Grid.*not int: voxelize\(mesh, fit\(mesh, 64\)\)", lambda: vp.voxelize(MESH, 64)),
    (TypeError, "grid is a Grid.*not NoneType", lambda: vp.solid(MESH, None)),
    (TypeError, "grid is a Grid", lambda: vp.bake(MESH, (8, 8, 8), RGB)),
    (TypeError, "grid is a Grid", lambda: vp.save("a.npy", np.zeros(GRID.shape), 8)),
    (ValueError, r"threads is 0 \(all cores\) or more, not -1", lambda: vp.voxelize(MESH, GRID, threads=-1)),
    (ValueError, "threads", lambda: vp.solid(MESH, GRID, threads=1.5)),
    (TypeError, "threads is a whole number, not str", lambda: vp.sparse(MESH, GRID, threads="all")),
    (IndexError, r"triangle 0 is \(0, -1, 2\), the mesh has 4 vertices",
     lambda: vp.voxelize((V[:4], np.array([[0, -1, 2], [0, 1, 2]])), GRID)),
    (IndexError, r"triangle 1 is \(0, 7, 2\), the mesh has 4 vertices",
     lambda: vp.voxelize((V[:4], np.array([[0, 1, 2], [0, 7, 2]], np.uint32)), GRID)),
    (ValueError, r"resolution is 1 to 2\^20 .*not 1000000000", lambda: vp.fit(MESH, 10**9)),
    (ValueError, r"resolution is 1 to 2\^20 .*not 0", lambda: vp.fit(MESH, 0)),
    (ValueError, r"resolution is \(nz, ny, nx\), each from 1 to 2\^20, not \(8, 0, 8\)", lambda: vp.fit(MESH, (8, 0, 8))),
    (ValueError, r"shape is \(nz, ny, nx\), each from 1 to 2\^20", lambda: vp.Grid((0, 0, 0), (1, 1, 1), (2**21, 1, 1))),
    (ValueError, "voxel_size is above 0 and finite, not 0", lambda: vp.fit(MESH, voxel_size=0)),
    (TypeError, r"^origin is three numbers \(x, y, z\), not \(0, 0\)$", lambda: vp.Grid((0, 0), (1, 1, 1), (1, 1, 1))),
    (TypeError, "^voxel_size is three numbers, along x, y and z, not 1$", lambda: vp.Grid((0, 0, 0), 1, (1, 1, 1))),
    (TypeError, r"^shape is three whole numbers \(nz, ny, nx\), not 'x'$", lambda: vp.Grid((0, 0, 0), (1, 1, 1), "x")),
    (TypeError, r"^begin is three whole numbers \(z, y, x\), not None$", lambda: GRID.crop(None, (1, 1, 1))),
    (TypeError, r"^voxel is three whole numbers \(i, j, k\), not \(0, 0\.5, 1\)$", lambda: GRID.voxel_center((0, 0.5, 1))),
    (ValueError, "voxel_size is above 0 and finite, not -1", lambda: vp.Grid((0, 0, 0), (1, -1, 1), (1, 1, 1))),
    (ValueError, "resolution is a whole number, not 12.5", lambda: vp.fit(MESH, 12.5)),
    (ValueError, "padding is 0 or more", lambda: vp.fit(MESH, voxel_size=0.1, padding=-1)),
    (ValueError, "no vertex at a finite position", lambda: vp.fit((V[:0], F[:0]), 8)),
    (ValueError, "no vertex at a finite position", lambda: vp.fit(NO_TRIANGLES, 8)),
    (ValueError, r"values has the shape \(7, 8, 8\), the grid's is \(8, 8, 8\)",
     lambda: vp.save("a.png", np.zeros((7, 8, 8), bool), GRID)),
    (ValueError, r"values has the shape \(7, 8, 8\)", lambda: vp.save("a.npy", np.zeros((7, 8, 8)), GRID)),
    (ValueError, r"rgb has the shape \(8, 8, 7, 3\)", lambda: vp.view({"rgb": np.zeros((8, 8, 7, 3), np.uint8)}, GRID)),
    (ValueError, r"occupied has the shape \(1, 8, 8\)",
     lambda: vp.render(np.zeros(GRID.shape), GRID, occupied=np.zeros((1, 8, 8), bool))),
    (OSError, "'/nonexistent/x.png'", lambda: vp.save("/nonexistent/x.png", np.zeros(GRID.shape, bool), GRID)),
    (OSError, "'/nonexistent/x.vox'", lambda: vp.save("/nonexistent/x.vox", np.zeros(GRID.shape, bool), GRID)),
    (ValueError, "per names no value: 'typo'; there are 'rgb'", lambda: vp.bake(MESH, GRID, RGB, per={"typo": "vertex"})),
    (ValueError, "blend names no value: 'typo'", lambda: vp.bake(MESH, GRID, RGB, blend={"typo": "max"})),
    (TypeError, "per is a mapping by name", lambda: vp.bake(MESH, GRID, RGB, per="vertex")),
    (TypeError, "status is a dict.*not list", lambda: vp.voxelize(MESH, GRID, status=[])),
    (TypeError, "status is a dict", lambda: vp.distance_at(MESH, V, status=[])),
    (ValueError, "coverage is one of 'conservative', .*not 3", lambda: vp.voxelize(MESH, GRID, 3)),
    (ValueError, "repair is one of", lambda: vp.distance(MESH, GRID, repair="holes")),
    (ValueError, "closing is a whole number", lambda: vp.remesh(MESH, GRID, repair="exterior", closing=1.5)),
    (ValueError, "max_hole_edges is 0 or more", lambda: vp.distance(MESH, GRID, max_hole_edges=-1)),
    (ValueError, "min_component is", lambda: vp.remesh(MESH, GRID, min_component=2**40)),
    (ValueError, "threads is 0", lambda: vp.remesh(MESH, GRID, threads=2**32)),
    (TypeError, "band is a number of voxels or", lambda: vp.distance(MESH, GRID, band=None)),
    (ValueError, "sign is one of .*unsigned", lambda: vp.distance_at(MESH, np.zeros((1, 3)), sign="zz")),
    (ValueError, "repair is one of", lambda: vp.distance_at(MESH, np.zeros((1, 3)), repair=None)),
    (ValueError, "which looks at a grid", lambda: vp.distance_at(MESH, np.zeros((1, 3)), repair="vote")),
    (ValueError, "compression is 0 to 9, not 10", lambda: vp.save("a.vti", np.ones(GRID.shape, bool), GRID, compression=10)),
    (TypeError, "as sparse.. returns it", lambda: vp.save("a.npz", vp.tiles(MESH, GRID), GRID)),
    (ValueError, "a has 7 rows for 1 voxels", lambda: vp.save("a.npz", (np.zeros((1, 3), int), {"a": np.zeros(7)}), GRID)),
    (IndexError, "voxel 0 is .-1, 0, 99. .x, y, z., which lies outside the grid", lambda: vp.save("a.html", (np.array([[-1, 0, 99]]), {}), GRID)),
    (ValueError, "occupied is of dense arrays", lambda: vp.save("a.vox", (np.zeros((1, 3), int), {}), GRID, occupied=np.ones(GRID.shape, bool))),
    (TypeError, "cubes are integers", lambda: vp.extract((np.zeros((0, 3), int), np.array([[0.9, 0, 0, 8]])), GRID)),
    (IndexError, "cube 0 leaves the grid", lambda: vp.extract((np.zeros((0, 3), int), np.array([[2**32, 0, 0, 8]])), GRID)),
    (ValueError, "has no triangles", lambda: vp.distance(vp.points(np.eye(3)), GRID)),
    (ValueError, "part 1 of the list is a model of points", lambda: vp.voxelize([MESH, vp.points(np.eye(3))], GRID)),
    (ValueError, "closing is 0 to 64, not -1", lambda: vp.solid(MESH, GRID, repair="exterior", closing=-1)),
    (ValueError, "max_hole_edges is 0 or more", lambda: vp.solid(MESH, GRID, repair="close_holes", max_hole_edges=-1)),
    (ValueError, "up is one of 'y', 'z', not 'x'", lambda: vp.save("a.html", np.zeros(GRID.shape, bool), GRID, up="x")),
    (TypeError, "zoom: for .png only", lambda: vp.save("a.npy", np.zeros(GRID.shape), GRID, zoom=2)),
    (ValueError, "background is 'sky'.*not 'pink'", lambda: vp.render(np.ones(GRID.shape, bool), GRID, background="pink")),
    (TypeError, "size is a width and a height.*not 64", lambda: vp.render(np.ones(GRID.shape, bool), GRID, size=64)),
    (ValueError, "a side of size is 1 or more, not 0", lambda: vp.render(np.ones(GRID.shape, bool), GRID, size=(0, 9))),
    (TypeError, "zoom is a number, not str", lambda: vp.render(np.ones(GRID.shape, bool), GRID, zoom="near")),
    (TypeError, "compression is a whole number, not str",
     lambda: vp.save("a.vti", np.ones(GRID.shape, bool), GRID, compression="high")),
    (ValueError, "pieces is 0 or more, not -1", lambda: vp.save("a.pvti", np.ones(GRID.shape, bool), GRID, pieces=-1)),
    (TypeError, "level is a number, not str", lambda: vp.remesh(MESH, GRID, level="x")),
    (ValueError, "level is a finite number, not nan", lambda: vp.remesh(MESH, GRID, level=float("nan"))),
    (ValueError, "min_component is a number of vertices", lambda: vp.remesh(MESH, GRID, min_component=-1)),
    (ValueError, r"positions are an array \(n, 3\), not \(4, 2\)", lambda: vp.points(np.zeros((4, 2)))),
    (ValueError, r"positions are an array \(n, 3\), not \(\)", lambda: vp.points(5)),
    (ValueError, "solid is one of 'nonzero'.*not 'yes'", lambda: vp.sparse(MESH, GRID, solid="yes")),
    (ValueError, r"voxels: an array \(n, 3\)", lambda: vp.Octree(np.zeros((2, 2), int), GRID)),
]  # fmt: skip


@pytest.mark.parametrize("kind, text, call", CASES, ids=[str(i) for i in range(len(CASES))])
def test_errors_name_the_argument(kind, text, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(kind, match=text):
        call()
    assert not list(tmp_path.iterdir())


def test_both_spellings_of_the_centre():
    assert np.array_equal(vp.solid(MESH, GRID, extent="center"), vp.solid(MESH, GRID, extent="centre"))


def test_a_vertex_at_infinity_is_a_warning():
    broken = np.concatenate([V, [[np.inf, 0, 0]]]).astype(np.float32)
    with pytest.warns(vp.DroppedTrianglesWarning, match="1 of 9 vertices are not finite"):
        assert vp.fit((broken, F), 8) == GRID


def test_a_grids_text_gives_the_grid():
    odd = vp.fit((V * np.float32(1 / 3), F), voxel_size=(0.1, 0.07, 1e-3))
    for grid in (GRID, odd, odd.crop((1, 2, 0), (3, 2, 1)), vp.Grid((1e-17, 1 / 3, -2e300), (1, 1, 1), (1, 2, 3))):
        assert eval(repr(grid), {"Grid": vp.Grid}) == grid
