# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Colours that meshes of other libraries have by themselves give what the tool gives of their files, byte for byte."""

import types

import numpy as np
import pytest
import voxelpipe as vp

import models
from meshes import box, sphere


def test_texture_of_trimesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    v, uv, f = models.textured_sphere()
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 0.6, 0.2, 1]}}
    path = models.glb(
        tmp_path / "a.glb", [{"POSITION": v, "TEXCOORD_0": uv, "indices": f, "material": 0}], [material], [models.picture()]
    )
    grid = vp.fit(path, 32)
    expected = vp.bake(path, grid)["color"]
    scene = trimesh.load_scene(path)
    assert np.array_equal(vp.bake(scene, grid)["color"], expected)
    (mesh,) = scene.dump()
    assert mesh.visual.kind == "texture" and np.array_equal(vp.bake(mesh, grid)["color"], expected)
    assert len(np.unique(expected.reshape(-1, 4), axis=0)) > 100


def ply(path, v, f, colors, of):
    names = [f"property uchar {c}" for c in ("red", "green", "blue")]
    header = ["ply", "format ascii 1.0", f"element vertex {len(v)}", *(f"property float {a}" for a in "xyz"),
              *(names if of == "vertex" else []), f"element face {len(f)}", "property list uchar int vertex_indices",
              *(names if of == "face" else []), "end_header"]  # fmt: skip
    rows = [" ".join(repr(float(c)) for c in p) for p in v]
    faces = ["3 %d %d %d" % tuple(t) for t in f]
    target = rows if of == "vertex" else faces
    target[:] = [f"{row} {c[0]} {c[1]} {c[2]}" for row, c in zip(target, colors)]
    path.write_text("\n".join([*header, *rows, *faces]) + "\n")
    return path


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "open3d"])
@pytest.mark.parametrize("of", ["vertex", "face"])
def test_colours_of_vertices_and_faces(tmp_path, library, of):
    module = pytest.importorskip(library)
    v, f = sphere(levels=3)
    colors = np.random.default_rng(1).integers(0, 256, (len(v if of == "vertex" else f), 3)).astype(np.uint8)
    path = ply(tmp_path / "a.ply", v, f, colors, of)
    if library == "trimesh":
        mesh = module.Trimesh(v, f, process=False, **{f"{of}_colors": colors})
    elif library == "pyvista":
        mesh = module.PolyData(v, np.hstack([np.full((len(f), 1), 3), f]).ravel())
        (mesh.point_data if of == "vertex" else mesh.cell_data)["RGB"] = colors
    elif of == "face":
        pytest.skip("Open3D's legacy meshes have no colours of triangles")
    else:
        mesh = module.geometry.TriangleMesh(
            module.utility.Vector3dVector(v), module.utility.Vector3iVector(f.astype(np.int32))
        )
        mesh.vertex_colors = module.utility.Vector3dVector(colors / 255)
    grid = vp.fit(path, 32)
    expected = vp.bake(path, grid)["color"]
    assert np.array_equal(vp.bake(mesh, grid)["color"], expected)
    assert np.array_equal(vp.bake([mesh], grid)["color"], expected)


def test_textures_of_open3ds_kind_count_from_the_first_row():
    """By an object that has what Open3D's meshes have: a lower half of the picture is the first half of its rows."""
    v, f = box((0, 0, 0), (4, 4, 4), np.float64)
    half = np.zeros((8, 4, 3), np.uint8)
    half[:4] = (200, 0, 0)
    half[4:] = (0, 0, 200)
    corners = v[f.reshape(-1)]
    mesh = types.SimpleNamespace(
        vertices=v, triangles=f, vertex_colors=[], textures=[half], triangle_material_ids=np.zeros(len(f), int),
        triangle_uvs=np.stack([corners[:, 0], corners[:, 1]], axis=-1) / 4,
    )  # fmt: skip
    grid = vp.Grid((0, 0, 0), (0.5,) * 3, (8, 8, 8))
    color = vp.bake(mesh, grid)["color"]
    assert color[0, 1, 4].tolist() == [200, 0, 0, 255] and color[0, 6, 4].tolist() == [0, 0, 200, 255]


def test_values_without_colours():
    v, f = sphere(levels=2)
    grid = vp.fit((v, f), 16)
    baked = vp.bake((v, f), grid, ["normal", "count", "triangle"])
    surface = vp.voxelize((v, f), grid)
    assert np.allclose(np.linalg.norm(baked["normal"][surface], axis=-1), 1, atol=1e-5)
    assert np.array_equal(baked["count"] > 0, surface) and np.array_equal(baked["triangle"] >= 0, surface)
    assert np.array_equal(baked["triangle"], np.where(surface, vp.bake((v, f), grid, {"i": np.arange(len(f))})["i"], -1))
    for mesh in ((v, f), [(v, f), (v, f)]):
        with pytest.raises(ValueError, match="no colours of its own"):
            vp.bake(mesh, grid)
    with pytest.raises(ValueError, match="'color'.*not 'rgb'"):
        vp.bake((v, f), grid, "rgb")
    with pytest.raises(ValueError, match="without arrays of values"):
        vp.bake((v, f), grid, "normal", blend="max")
    with pytest.raises(ValueError, match=r"per=\{'typo': 'corner'\} without arrays of values"):
        vp.bake((v, f), grid, per={"typo": "corner"})
    with pytest.raises(TypeError, match="values is a mapping"):
        vp.bake((v, f), grid, 5)


def test_a_solid_with_its_colours_reads_a_file_once(tmp_path, monkeypatch):
    v, f = sphere(levels=2)
    path = ply(tmp_path / "a.ply", v, f, np.full((len(v), 3), 200, np.uint8), "vertex")
    grid = vp.fit(path, 16)
    loaded = vp.load_model(path)
    expected = vp.sparse(loaded, grid, "color", solid="nonzero")
    read = []
    monkeypatch.setattr("voxelpipe._model.note_model", lambda file, named: read.append(file))
    for model in (path, [path]):
        voxels, rows = vp.sparse(model, grid, "color", solid="nonzero")
        assert np.array_equal(voxels, expected[0]) and np.array_equal(rows["color"], expected[1]["color"])
    assert read == [str(path)] * 2
