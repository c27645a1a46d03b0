# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""remesh() and extract(): closed manifolds by trimesh and manifold3d, which know nothing of this library."""

import os
import subprocess

import numpy as np
import pytest

import voxelpipe as vp

BOX = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
FACES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
)


def judge(vertices, faces):
    """Asserts a closed manifold; gives the mesh of trimesh."""
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume > 0
    try:
        import manifold3d
    except ImportError:
        return mesh
    solid = manifold3d.Manifold(manifold3d.Mesh64(np.asarray(vertices, np.float64), np.asarray(faces, np.uint64)))
    assert solid.status() == manifold3d.Error.NoError
    return mesh


def test_a_remesh_of_crossing_boxes_is_closed_and_keeps_its_planes():
    soup = np.concatenate([BOX, 0.6 + BOX])
    faces = np.concatenate([FACES, 8 + FACES])
    grid = vp.fit((soup, faces), 24)
    counts = {}
    vertices, triangles, more = vp.remesh((soup, faces), grid, status=counts)
    mesh = judge(vertices, triangles)
    assert mesh.volume == pytest.approx(2 - 0.4**3, rel=2e-3)
    assert counts["made_crossings"] == 0 and counts["components"] == 1
    planes = np.array([0.0, 1.0, 0.6, 1.6])
    assert np.abs(vertices[:, :, None] - planes).min((1, 2)).max() < 1e-3
    assert vertices.dtype == np.float64 and triangles.dtype == np.uint32
    assert more["cell"].shape == vertices.shape and more["sheet"].max() < 4 and more["source"].max() < 24
    quads = vp.remesh((soup, faces), grid, quads=True)[1]
    assert quads.shape == (len(triangles) // 2, 4)


def test_random_voxels_and_fields_are_closed():
    rng = np.random.default_rng(3)
    grid = vp.Grid((0, 0, 0), (0.5,) * 3, (17, 9, 11))
    inside = rng.random(grid.shape) < 0.5
    for place in ("corner", "mean", "sharp"):
        judge(*vp.extract(inside, grid, place=place)[:2])
    field = rng.random(grid.shape).astype(np.float32) - 0.5
    field[3, 2, 1] = np.nan
    counts = {}
    judge(*vp.extract(field, grid, level=0.1, status=counts)[:2])
    assert counts["nan_samples"] == 1


def same(a, b):
    for x, y in zip(a[:2], b[:2]):
        np.testing.assert_array_equal(x, y)
    for name in ("cell", "sheet", "source"):
        np.testing.assert_array_equal(a[2][name], b[2][name])


def test_lists_are_the_dense_surface():
    trimesh = pytest.importorskip("trimesh")
    rng = np.random.default_rng(4)
    grid = vp.Grid((0, 0, 0), (0.5,) * 3, (50, 45, 40)).crop((3, 2, 9), (30, 33, 21))
    inside = rng.random(grid.shape) < 0.2
    voxels = np.argwhere(inside)[:, ::-1]
    rng.shuffle(voxels)
    same(vp.extract(voxels, grid, quads=True, min_component=9), vp.extract(inside, grid, quads=True, min_component=9))
    ball = trimesh.creation.icosphere(subdivisions=3, radius=21)
    grid = vp.fit(ball, 47)
    inside = vp.solid(ball, grid, extent="centre")
    counts = {}
    voxels, cubes = vp.tiles(ball, grid, extent="centre")
    assert len(cubes) > 10
    made = vp.extract((voxels, cubes), grid, status=counts)
    same(made, vp.extract(inside, grid))
    judge(*made[:2])
    assert counts["components"] == 1
    same(vp.extract(vp.sparse(ball, grid, solid="nonzero", extent="centre"), grid), made)
    # A grid whose bits are 2^50.
    grid = vp.Grid((-20, -20, -20), (1, 1, 1), (2**17,) * 3)
    judge(*vp.remesh(ball, grid)[:2])
    judge(*vp.extract(vp.tiles(ball, grid), grid)[:2])


def test_lists_that_are_none():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (20, 20, 20))
    none = np.empty((0, 3), np.int32)
    assert len(vp.extract(none, grid)[0]) == 0
    with pytest.raises(IndexError, match="outside"):
        vp.extract(np.array([[1, 20, 3]]), grid)
    with pytest.raises(ValueError, match="same"):
        vp.extract(np.array([[1, 2, 3], [1, 2, 3]]), grid)
    with pytest.raises(ValueError, match="level"):
        vp.extract(none, grid, level=1)
    with pytest.raises(ValueError, match="multiple"):
        vp.extract((none, np.array([[4, 8, 8, 8]])), grid)
    with pytest.raises(ValueError, match="multiple"):
        vp.extract((none, np.array([[0, 0, 0, 9]])), grid)
    with pytest.raises(IndexError, match="leaves"):
        vp.extract((none, np.array([[16, 8, 8, 8]])), grid)
    with pytest.raises(ValueError, match="in one place"):
        vp.extract((np.array([[8, 9, 10]]), np.array([[8, 8, 8, 8]])), grid)
    with pytest.raises(ValueError, match="in one place"):
        vp.extract((none, np.array([[0, 0, 0, 16], [8, 8, 8, 8]])), grid)


def test_corners_of_one_voxel():
    grid = vp.Grid((1, 2, 3), (0.5,) * 3, (3, 3, 3))
    inside = np.zeros(grid.shape, bool)
    inside[1, 1, 1] = True
    vertices, triangles, more = vp.extract(inside, grid, place="corner")
    assert sorted(map(tuple, vertices)) == sorted(
        (1 + x, 2 + y, 3 + z) for x in (0.5, 1.0) for y in (0.5, 1.0) for z in (0.5, 1.0)
    )
    assert len(triangles) == 12 and (more["source"] == -1).all()


def test_bad_arguments():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (4, 4, 4))
    with pytest.raises(TypeError, match="bool"):
        vp.extract(np.zeros(grid.shape, np.int32), grid)
    with pytest.raises(ValueError, match="level"):
        vp.extract(np.zeros(grid.shape, bool), grid, level=1)
    with pytest.raises(ValueError, match="shape"):
        vp.extract(np.zeros((3, 4, 4), bool), grid)
    with pytest.raises(ValueError, match="place"):
        vp.remesh((BOX, FACES), grid, place="middle")


def sphere():
    """A ball of radius 1, and positions of the mesh's vertices."""
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(3)
    return np.asarray(ball.vertices, np.float32), np.asarray(ball.faces)


def test_attributes_are_interpolated():
    positions, faces = sphere()
    grid = vp.fit((positions, faces), 30)
    linear = positions @ np.array([[1.0, 2, 3]]).T
    counts = {}
    attributes = {"at": positions, "linear": linear[:, 0], "byte": np.full((len(positions), 3), 77, np.uint8)}
    vertices, triangles, more = vp.remesh((positions, faces), grid, place="mean", attributes=attributes, status=counts)
    assert counts["nearest_values"] == 0
    assert more["at"].dtype == np.float32 and more["at"].shape == vertices.shape
    assert more["linear"].shape == (len(vertices),)
    # A vertex is the mean of its crossings, rounded to 2^-16 of a cell of 1 / 15.
    assert np.abs(more["at"] - vertices).max() < 4e-6
    assert np.abs(more["linear"] - vertices @ [1, 2, 3]).max() < 1e-5
    assert more["byte"].dtype == np.uint8 and (more["byte"] == 77).all()
    plain = vp.remesh((positions, faces), grid, place="mean")
    assert np.array_equal(plain[0], vertices) and np.array_equal(plain[1], triangles)
    assert np.array_equal(plain[2]["source"], more["source"])


def test_materials_are_the_majority_and_many_columns_take_several_runs():
    positions, faces = sphere()
    grid = vp.fit((positions, faces), 20)
    material = (positions[faces].mean(1)[:, 2] > 0).astype(np.int16)
    wide = np.repeat(positions[:, :1], 35, axis=1)
    many = np.repeat(material[:, None].astype(np.int64), 6, axis=1) * (1 << 40)
    vertices, _, more = vp.remesh((positions, faces), grid, attributes={"material": material, "wide": wide, "many": many})
    assert more["material"].dtype == np.int16
    sure = np.abs(vertices[:, 2]) > 0.2
    assert (more["material"][sure] == (vertices[sure, 2] > 0)).all()
    assert more["wide"].shape == (len(vertices), 35) and (more["wide"] == more["wide"][:, :1]).all()
    assert np.abs(more["wide"][:, 0] - vertices[:, 0]).max() < 0.1
    assert more["many"].shape == (len(vertices), 6) and (more["many"] == more["material"][:, None].astype(np.int64) << 40).all()


def test_attributes_of_a_level_are_those_of_the_nearest_point():
    positions, faces = sphere()
    grid = vp.fit((positions, faces), voxel_size=0.08, padding=4)
    counts = {}
    vertices, _, more = vp.remesh((positions, faces), grid, level=0.2, attributes={"at": positions}, status=counts)
    assert counts["nearest_values"] == len(vertices)
    between = np.linalg.norm(vertices - more["at"], axis=1)
    assert np.abs(between - vp.distance_at((positions, faces), vertices.astype(np.float32))).max() < 1e-5


def test_embedded_moves_vertices_of_triangles_that_intersect():
    dice = np.random.default_rng(0)
    corners = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
    faces = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    parts = [corners * dice.uniform(0.02, 0.3, 3) + dice.uniform(0.2, 0.8, 3) for _ in range(40)]
    mesh = (np.concatenate(parts).astype(np.float32), np.concatenate([faces + 6 * i for i in range(40)]))
    grid = vp.fit(mesh, 13)
    counts = {}
    plain = vp.remesh(mesh, grid, status=counts)
    assert (counts["embed_rounds"], counts["moved_vertices"], counts["intersecting_pairs"]) == (0, 0, 0)
    embedded = vp.remesh(mesh, grid, embedded=True, status=counts)
    assert counts["embed_rounds"] > 0 and counts["intersecting_pairs"] == 0
    changed = (plain[0] != embedded[0]).any(1).sum()
    assert 0 < changed <= counts["moved_vertices"]
    inside = dice.random(grid.shape) < 0.4
    vp.extract(inside, grid, embedded=True, status=counts)
    assert counts["embed_rounds"] == counts["intersecting_pairs"] == 0
    vp.extract(np.where(inside, -1.0, 0.5).astype(np.float32), grid, embedded=True, status=counts)
    assert counts["intersecting_pairs"] == 0


def test_bad_attributes():
    positions, faces = sphere()
    grid = vp.fit((positions, faces), 8)
    with pytest.raises(ValueError, match="another name"):
        vp.remesh((positions, faces), grid, attributes={"cell": positions})
    with pytest.raises(ValueError, match="rows"):
        vp.remesh((positions, faces), grid, attributes={"rgb": positions[:5]})
    with pytest.raises(ValueError, match="as many vertices as triangles"):
        tetrahedron = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
        sides = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        vp.remesh((tetrahedron, sides), vp.fit((tetrahedron, sides), 8), attributes={"rgb": tetrahedron})


def test_corners_are_samples_as_distance_has_them():
    grid = vp.fit((BOX, FACES), voxel_size=1 / 12, padding=4)
    made = vp.remesh((BOX, FACES), grid, corners=True, place="mean", level=0.1)
    judge(*made[:2])
    assert made[0].max() == pytest.approx(1.1, abs=1e-3) and made[0].min() == pytest.approx(-0.1, abs=1e-3)
    field = vp.distance((BOX, FACES), grid, "whole", corners=True)
    assert field.shape == tuple(n + 1 for n in grid.shape)
    same = vp.extract(field, grid, corners=True, level=0.1)
    np.testing.assert_array_equal(made[0], same[0])
    np.testing.assert_array_equal(made[1], same[1])
    np.testing.assert_array_equal(made[2]["cell"], same[2]["cell"])
    moved = (BOX + 0.01, FACES)  # whose planes hold no sample
    inside = vp.distance(moved, grid, corners=True) < 0
    blocks = [vp.remesh(moved, grid, corners=True, place="corner"), vp.extract(inside, grid, corners=True, place="corner")]
    np.testing.assert_array_equal(blocks[0][0], blocks[1][0])
    np.testing.assert_array_equal(blocks[0][1], blocks[1][1])
    with pytest.raises(ValueError):
        vp.extract(field, grid)


def test_open_borders_leave_faces_out():
    grid = vp.Grid((0.25, 0.25, 0.25), (0.25,) * 3, (8, 8, 8))  # the box begins before it
    closed = vp.remesh((BOX, FACES), grid)
    judge(*closed[:2])
    opened = vp.remesh((BOX, FACES), grid, border="open")
    assert 0 < len(opened[1]) < len(closed[1])
    with pytest.raises(ValueError, match="border"):
        vp.remesh((BOX, FACES), grid, border="ajar")


@pytest.mark.skipif("VOXELPIPE_TOOL" not in os.environ, reason="VOXELPIPE_TOOL names no voxelize")
def test_the_tools_arrays_are_those_of_remesh(tmp_path):
    soup, faces = np.concatenate([BOX, 0.6 + BOX]), np.concatenate([FACES, 8 + FACES])
    model = tmp_path / "m.obj"
    model.write_text("".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in soup) + "".join(f"f {a} {b} {c}\n" for a, b, c in faces + 1))
    place = ["--origin", "-0.25,-0.25,-0.25", "--extent", "36,35,34", "-s", "0.0625"]
    grid = vp.Grid((-0.25,) * 3, (0.0625,) * 3, (36, 35, 34))
    for name in ("sharp", "mean", "corner"):
        out = tmp_path / f"{name}.npz"
        subprocess.run([os.environ["VOXELPIPE_TOOL"], model, "--remesh", "--place", name, *place, "-o", out], check=True, capture_output=True)
        with np.load(out) as file:
            vertices, triangles, more = vp.remesh((soup, faces), grid, place=name)
            np.testing.assert_allclose(file["vertices"], vertices, rtol=0, atol=1e-12)
            np.testing.assert_array_equal(file["triangles"], triangles)
            for key in ("cell", "sheet", "source"):
                np.testing.assert_array_equal(file[key], more[key])
            assert file["normal"].shape == vertices.shape


def test_levels_of_doubles_are_those_that_doubles_have():
    grid = vp.Grid((0, 0, 0), (1,) * 3, (8, 8, 8))
    ramp = np.zeros(grid.shape) + np.arange(8.0) * 1e-3
    near = vp.extract(ramp, grid, level=3.5e-3)
    far = vp.extract(ramp + 1e6, grid, level=1e6 + 3.5e-3)
    np.testing.assert_allclose(far[0], near[0], rtol=0, atol=1e-3)
    assert far[1].shape == near[1].shape
    signs = np.where(np.arange(8) < 3, -1e-60, 1e-60) + np.zeros(grid.shape)
    assert vp.extract(signs, grid)[1].shape == vp.extract(np.sign(signs), grid)[1].shape
