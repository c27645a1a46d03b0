# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""save() does not replace what is read, nor one array by another."""

import os

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box

MODEL = """mtllib model.mtl
usemtl a
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
f 1/1 2/1 3/1
f 1/1 2/1 4/1
f 1/1 3/1 4/1
f 2/1 3/1 4/1
"""


@pytest.fixture
def model(tmp_path):
    (tmp_path / "model.obj").write_text(MODEL)
    (tmp_path / "model.mtl").write_text("newmtl a\nKd 1 1 1\n")
    return tmp_path / "model.obj"


def test_a_model_and_its_files_stay(model, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    grid = vp.fit("model.obj", 8)
    surface = vp.voxelize("model.obj", grid)
    os.symlink("model.obj", "soft.npy")
    os.link("model.mtl", "hard.html")
    for path, what in (("soft.npy", "the model 'model.obj'"), (tmp_path / "hard.html", "a file of 'model.obj'")):
        with pytest.raises(ValueError, match=what):
            vp.save(path, surface, grid)
    with pytest.raises(ValueError, match="a file of"):
        vp.view(surface, grid).save("hard.html")
    os.rename("hard.html", "out.height.nrrd")  # what one of several files would be called
    with pytest.raises(ValueError, match="a file of"):
        vp.save("out.nrrd", {"occupancy": surface, "height": surface.astype(np.uint8)}, grid)
    os.rename("out.height.nrrd", "hard.html")
    assert model.read_text() == MODEL
    assert sorted(os.listdir()) == ["hard.html", "model.mtl", "model.obj", "soft.npy"]
    vp.save("other.npy", surface, grid)
    vp.save("other.npy", surface, grid)  # its own is replaced
    os.remove("hard.html")
    vp.save("hard.html", surface, grid)  # another file


def test_a_mapped_array_stays(tmp_path):
    mesh = box()
    grid = vp.fit(mesh, 8)
    surface = vp.voxelize(mesh, grid)
    path = tmp_path / "a.npy"
    vp.save(path, surface, grid)
    before = path.read_bytes()
    mapped = np.load(path, mmap_mode="r")
    for values in (mapped, {"a": mapped[:]}):
        with pytest.raises(ValueError, match="holds an array that is being saved"):
            vp.save(path, values, grid)
    assert path.read_bytes() == before
    vp.save(tmp_path / "b.npy", mapped, grid)
    vp.save(path, np.array(mapped), grid)


@pytest.mark.parametrize("name", ["origin", "voxel_size", "coords", "file"])
def test_two_arrays_of_a_npz_have_two_names(tmp_path, name):
    mesh = box()
    grid = vp.fit(mesh, 8)
    voxels, rows = vp.sparse(mesh, grid, {"id": np.arange(len(mesh[1]), dtype=np.int32)}, per={"id": "triangle"})
    with pytest.raises(ValueError, match=name):
        vp.save(tmp_path / "a.npz", (voxels, {name: rows["id"]}), grid)
    assert os.listdir(tmp_path) == []
