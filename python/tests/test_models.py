# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Paths are read by the tool's readers, and what is baked of them is what the tool gives, byte for byte: compared with the
tool where VOXELPIPE_TOOL names it, and with hashes of what it gave."""

import hashlib

import numpy as np
import pytest
import voxelpipe as vp

import models
from meshes import box, sphere

TARGETS = ["color", "color-max", "color-replace", "color-outer", "normal", "material", "triangle", "depth", "count"]
# Of the tool's arrays of models.lighthouse() at --resolution 40, first 16 digits of SHA-256.
HASHES = {
    "occupancy": "a4aa487ee2918e18",
    "color": "5e7382bc87807df4",
    "color-max": "64156e0402bb24cf",
    "color-replace": "ddc6d1d36fd0a437",
    "color-outer": "52fd22128345f808",
    "normal": "16d2c14650093e23",
    "material": "4e4468d7393752e0",
    "triangle": "eab542b9092938a5",
    "depth": "c4493caeb36591ff",
    "count": "1b5efebff1d58a0c",
}


def digest(a):
    return hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest()[:16]


@pytest.fixture(scope="module")
def lighthouse(tmp_path_factory):
    return models.lighthouse(tmp_path_factory.mktemp("models") / "lighthouse.glb")


def test_every_value_of_a_path_is_the_tools(lighthouse, tmp_path):
    grid = vp.fit(lighthouse, 40)
    status = {}
    baked = vp.bake(lighthouse, grid, TARGETS, status=status)
    baked["occupancy"] = vp.voxelize(lighthouse, grid)
    assert status["lines"] == 1 and status["fragments_discarded"] > 0
    if models.tool():
        options = [o for name in ["occupancy", *TARGETS] for o in ("--target", name)]
        written, stats = models.tool_writes(lighthouse, tmp_path / "a.npz", "--resolution", "40", *options)
        assert stats["grid"] == {
            "extent": list(grid.shape[::-1]), "origin": list(grid.origin), "voxel_size": list(grid.voxel_size)
        }  # fmt: skip
        with np.load(written) as f:
            for name, a in baked.items():
                assert f[name].tobytes() == a.tobytes() and f[name].shape == a.shape, name
    assert {name: digest(a) for name, a in baked.items()} == HASHES


def test_bake_without_values_is_the_colour(lighthouse):
    grid = vp.fit(lighthouse, 24)
    color = vp.bake(lighthouse, grid)["color"]
    assert color.dtype == np.uint8 and color.shape == (*grid.shape, 4)
    model = vp.load_model(lighthouse)
    assert np.array_equal(vp.bake(model, grid, "color")["color"], color)
    surface = vp.voxelize(lighthouse, grid)
    assert np.array_equal(color.any(axis=-1), surface) and np.array_equal(surface, vp.voxelize(model, grid))
    voxels, rows = vp.sparse(lighthouse, grid, "color")
    assert np.array_equal(vp.dense(voxels, rows["color"], grid), color)
    assert np.array_equal(np.unpackbits(vp.voxelize(model, grid, packed=True).view(np.uint8), axis=-1, bitorder="little")
                          [..., : grid.shape[2]].astype(bool), surface)  # fmt: skip
    part = grid.crop((1, 2, 5), (7, 6, 11))
    assert np.array_equal(vp.bake(model, part)["color"], color[1:8, 2:8, 5:16])
    assert vp.bake(model, grid, ["material"])["material"][~surface].tolist() == [-1] * int((~surface).sum())


def test_a_model_has_what_its_file_has(lighthouse):
    model = vp.load_model(str(lighthouse))
    v, uv, f = models.textured_sphere()
    assert model.vertices.shape == (3 * len(v) + 2, 3) and model.faces.dtype == np.int32
    assert np.array_equal(model.vertices[: len(v)], v) and np.array_equal(model.faces[: len(f)], f)
    assert np.array_equal(model.uv[: len(v)], uv) and model.colors.shape == (len(model.vertices), 4)
    assert [p.material for p in model.parts] == [0, 0, 1, 1]
    assert model.face_materials.tolist() == [0] * 2 * len(f) + [1] * len(f)
    assert model.lines.tolist() == [[3 * len(v), 3 * len(v) + 1]]
    assert model.materials[0].alpha == "mask" and model.materials[1].name == "painted"
    assert model.materials[1].base_color == pytest.approx((0.9, 0.5, 0.25, 1)) and model.materials[1].texture is None
    assert np.array_equal(model.pictures[model.textures[model.materials[0].texture].picture], models.picture())
    # The second sphere is mirrored, and its triangles still face outward.
    mirrored = model.vertices[model.faces[len(f) : 2 * len(f)]]
    volume = np.einsum("ij,ij->i", mirrored[:, 0], np.cross(mirrored[:, 1], mirrored[:, 2])).sum() / 6
    assert volume == pytest.approx(0.5 * 0.7 * 0.6 * 4 / 3 * np.pi, rel=0.1)
    assert "3" in repr(model) and model.path == str(lighthouse)


@pytest.mark.parametrize("extension", [".ply", ".stl", ".off", ".obj"])
def test_every_reader_reads(tmp_path, extension):
    v, f = box((0.25, 0.5, 1), (3.5, 3, 2.75))
    path = tmp_path / f"a{extension}"
    rows = ["%g %g %g" % tuple(p) for p in v]
    if extension == ".off":
        path.write_text("\n".join(["OFF", f"{len(v)} {len(f)} 0", *rows, *("3 %d %d %d" % tuple(t) for t in f)]) + "\n")
    elif extension == ".obj":
        lines = ["v " + r for r in rows] + ["f %d %d %d" % tuple(t + 1) for t in f.astype(int)]
        path.write_text("\n".join(lines) + "\n")
    elif extension == ".stl":
        facets = ["outer loop\n" + "".join(f"vertex {rows[i]}\n" for i in t) + "endloop\nendfacet" for t in f]
        path.write_text("solid\n" + "".join(f"facet normal 0 0 0\n{t}\n" for t in facets) + "endsolid\n")
    else:
        header = ["ply", "format ascii 1.0", f"element vertex {len(v)}", *(f"property float {a}" for a in "xyz"),
                  f"element face {len(f)}", "property list uchar int vertex_indices", "end_header"]  # fmt: skip
        path.write_text("\n".join([*header, *rows, *("3 %d %d %d" % tuple(t) for t in f)]) + "\n")
    grid = vp.Grid((0, 0, 0), (0.25,) * 3, (16, 16, 16))
    assert np.array_equal(vp.voxelize(path, grid), vp.voxelize((v, f), grid))
    assert np.array_equal(vp.solid(str(path), grid), vp.solid((v, f), grid))
    assert np.array_equal(vp.distance(path, grid), vp.distance((v, f), grid))
    assert len(vp.fragments(path, grid).triangles) == len(vp.fragments((v, f), grid).triangles)


def test_parts_of_a_model_are_bodies(tmp_path):
    v, f = box((1, 1, 1), (7, 7, 7))
    inner, _ = box((3, 3, 3), (5, 5, 5))
    path = models.glb(tmp_path / "two.glb", [{"POSITION": p, "indices": f, "material": 0} for p in (v, inner)], [{}])
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (8, 8, 8))
    assert vp.solid(path, grid, "even_odd", extent="centre").sum() == 216 - 8
    assert vp.solid(path, grid, "even_odd", extent="centre", bodies="each").sum() == 216


def test_far_models_are_drawn_as_the_tool_draws_them(tmp_path):
    v, f = sphere(levels=3)
    where = [4649776.25, 431234.5, 300.0]
    path = models.glb(tmp_path / "far.glb", [{"POSITION": v, "indices": f, "material": 0}], [{}],
                      nodes=[{"mesh": 0, "translation": where}])  # fmt: skip
    model = vp.load_model(path)
    assert model.vertices.dtype == np.float64
    grid = vp.fit(model, 32)
    near = vp.Grid(tuple(np.array(grid.origin) - where), grid.voxel_size, grid.shape)
    assert (vp.voxelize(model, grid) != vp.voxelize((v, f), near)).sum() < 20
    assert np.array_equal(vp.distance_at(model, np.array([where]), grid) < -0.9, [True])
    if models.tool():
        written, _ = models.tool_writes(path, tmp_path / "far.npy", "--resolution", "32")
        assert np.array_equal(np.load(written).astype(bool), vp.voxelize(path, grid))


def test_files_that_are_no_models(tmp_path):
    with pytest.raises(FileNotFoundError, match="none.glb"):
        vp.voxelize(tmp_path / "none.glb", vp.Grid((0, 0, 0), (1, 1, 1), (1, 1, 1)))
    with pytest.raises(IsADirectoryError):
        vp.load_model(tmp_path)
    (tmp_path / "passwd").write_text("root:x:0:0\n")
    (tmp_path / "a.xyz").write_text("0 0 0\n")
    for name in ("passwd", "a.xyz"):
        with pytest.raises(ValueError, match=r"\.glb, \.gltf, \.obj, \.ply, \.stl and \.off"):
            vp.fit(tmp_path / name, 8)
    (tmp_path / "a.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\n")
    with pytest.raises(ValueError, match="a.ply"):
        vp.load_model(tmp_path / "a.ply")


def test_what_a_reader_leaves_out_is_a_warning(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.warns(vp.ModelWarning, match="none.mtl"):
        model = vp.load_model(path)
    assert len(model.faces) == 1 and len(model.warnings) == 1
