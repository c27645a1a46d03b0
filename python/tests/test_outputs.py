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
    pytest.importorskip("trimesh")
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


def test_every_format_of_the_tool_is_written(scene, tmp_path):
    """Of dense arrays and of a list, which are the same voxels, the same bytes where the format holds voxels alone."""
    mesh, grid, surface, color = scene
    values = {"occupancy": surface, "color": color, "height": np.where(surface, np.float32(2.5), np.float32(0))}
    voxels = grid.ijk(surface)
    listed = (voxels, {n: a[grid.zyx(voxels)] for n, a in values.items() if n != "occupancy"})
    assert {".npy", ".npz", ".vox", ".schem", ".binvox", ".vti", ".nrrd", ".zarr", ".glb", ".stl", ".nvdb"} < set(vp.formats())
    for extension in vp.formats():
        if extension == ".npy":
            continue
        for name, what in (("dense", values), ("list", listed)):
            files = vp.save(tmp_path / f"{name}{extension}", what, grid)
            assert files and all((tmp_path / f).exists() for f in files), extension
    for extension in (".vox", ".schem", ".binvox", ".glb", ".obj", ".ply", ".stl", ".xyz", ".nvdb"):
        assert (tmp_path / f"dense{extension}").read_bytes() == (tmp_path / f"list{extension}").read_bytes(), extension
    rows = np.loadtxt(tmp_path / "dense.xyz")
    assert len(rows) == surface.sum()
    at = grid.zyx(grid.to_ijk(rows[:, :3]))
    assert surface[at].all() and np.array_equal(rows[:, 3:], color[at])
    assert len(vp.save(tmp_path / "merged.ply", values, grid, merge=True)) == 1
    assert (tmp_path / "merged.ply").stat().st_size < (tmp_path / "dense.ply").stat().st_size


def test_tools_formats_say_what_they_do_not_hold(scene, tmp_path):
    _, grid, surface, _ = scene
    flat = vp.Grid((0, 0, 0), (1, 2, 1), grid.shape)
    with pytest.raises(ValueError, match="one voxel size"):
        vp.save(tmp_path / "a.vox", surface, flat)
    with pytest.raises(ValueError, match="channel name"):
        vp.save(tmp_path / "a.vti", {"a b": surface}, grid)
    with pytest.raises(ValueError, match="1 to 4"):
        vp.save(tmp_path / "a.vti", {"a": np.zeros((*grid.shape, 5), np.float32)}, grid)
    (tmp_path / "not_ours.zarr").mkdir()
    (tmp_path / "not_ours.zarr" / "file").write_text("")
    with pytest.raises(vp.WriteError, match="not_ours.zarr") as caught:
        vp.save(tmp_path / "not_ours.zarr", surface, grid)
    assert isinstance(caught.value, OSError) and isinstance(caught.value, ValueError)
    assert [p.name for p in tmp_path.iterdir()] == ["not_ours.zarr"]
