# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import base64
import json
import re
import shutil
import struct
import subprocess
import zlib

import numpy as np
import pytest
import voxelpipe as vp

from meshes import sphere


@pytest.fixture(scope="module")
def scene():
    mesh = sphere(levels=3)
    grid = vp.fit(mesh, 32)
    rgb = ((mesh[0] + 1) * 127).astype(np.uint8)
    return mesh, grid, vp.voxelize(mesh, grid), vp.bake(mesh, grid, {"color": rgb})["color"]


def decode(png):
    """Pixels of a PNG without filters."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data = 8, b""
    while at < len(png):
        (length,) = struct.unpack(">I", png[at : at + 4])
        kind, body = png[at + 4 : at + 8], png[at + 8 : at + 8 + length]
        assert struct.unpack(">I", png[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + body)
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert depth == 8
        if kind == b"IDAT":
            data += body
        at += 12 + length
    components = {2: 3, 6: 4}[color]
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + width * components)
    assert (rows[:, 0] == 0).all()
    return rows[:, 1:].reshape(height, width, components)


def test_picture_shows_the_model(scene, tmp_path):
    _, grid, surface, color = scene
    vp.save(tmp_path / "a.png", color, grid, occupied=surface, size=(160, 120), background="transparent")
    pixels = decode((tmp_path / "a.png").read_bytes())
    assert pixels.shape == (120, 160, 4)
    assert (pixels[60, 80, 3], pixels[2, 2, 3]) == (255, 0)
    assert np.array_equal(pixels, vp.render({"c": color}, grid, occupied=surface, size=(160, 120), background="transparent"))
    assert not np.array_equal(pixels[..., :3], vp.render(surface, grid, size=(160, 120)))


def test_float_colours_are_those_of_bytes(scene):
    _, grid, surface, color = scene
    a = vp.render(color, grid, occupied=surface, size=(80, 60))
    b = vp.render((color / 255).astype(np.float32), grid, occupied=surface, size=(80, 60), threads=2)
    assert np.array_equal(a, b)


def test_numpy_files(scene, tmp_path):
    mesh, grid, surface, color = scene
    vp.save(tmp_path / "a.npy", surface, grid)
    assert np.array_equal(np.load(tmp_path / "a.npy"), surface)
    vp.save(tmp_path / "a.npz", {"surface": surface, "color": color}, grid)
    with np.load(tmp_path / "a.npz") as f:
        assert np.array_equal(f["color"], color) and np.array_equal(f["surface"], surface)
        assert tuple(f["origin"]) == grid.origin and tuple(f["voxel_size"]) == grid.voxel_size
    listed = vp.sparse(mesh, grid, {"a": mesh[0][:, 0]})
    vp.save(tmp_path / "b.npz", listed, grid)
    with np.load(tmp_path / "b.npz") as f:
        assert np.array_equal(f["coords"], listed[0]) and np.array_equal(f["a"], listed[1]["a"])


def test_nanovdb(scene, tmp_path):
    mesh, grid, surface, color = scene
    values = {"occupancy": surface, "color": color, "height": vp.bake(mesh, grid, {"h": mesh[0][:, 1]})["h"]}
    path = tmp_path / "a.nvdb"
    vp.save(path, values, grid)
    again = tmp_path / "again.nvdb"
    vp.save(again, values, grid)
    assert path.read_bytes() == again.read_bytes()
    listed = tmp_path / "listed.nvdb"
    voxels, attributes = vp.sparse(mesh, grid, {"height": mesh[0][:, 1]})
    vp.save(listed, (voxels, attributes), grid)
    shuffled = np.random.default_rng(1).permutation(len(voxels))
    vp.save(again, (voxels[shuffled], {"height": attributes["height"][shuffled]}), grid)
    assert listed.read_bytes() == again.read_bytes()
    if shutil.which("nanovdb_print"):
        text = subprocess.run(["nanovdb_print", path], check=True, capture_output=True, text=True).stdout
        assert str(int(surface.sum())) in text.replace(",", "") and "height" in text
        subprocess.run(["nanovdb_validate", path], check=True, capture_output=True)


def test_page(scene, tmp_path):
    """The data of the page, decoded as page.html describes them, are the voxels and their values."""
    mesh, grid, surface, color = scene
    vp.save(tmp_path / "a.html", {"occupancy": surface, "color": color, "big": np.full(grid.shape, 7, np.int64)}, grid, up="z")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "http:" not in text and "https:" not in text
    shape = json.loads(re.search(r'<script id="shape" type="application/json">(.*?)</script>', text, re.S)[1])
    data = zlib.decompress(base64.b64decode(re.search(r'<script id="data" type="text/plain">(.*?)</script>', text, re.S)[1]), -15)
    assert shape["extent"] == [32, 32, 32] and shape["up"] == "z" and shape["voxels"] == surface.sum()
    assert [(c["name"], c["type"], c["components"]) for c in shape["channels"]] == [("color", "u8", 3), ("big", "f32", 1)]
    n = shape["bricks"]
    position = np.frombuffer(data, "<u4", 3 * n).reshape(3, n).T
    brick, m = np.nonzero(np.unpackbits(np.frombuffer(data, np.uint8, 64 * n, 12 * n).reshape(n, 64), axis=1, bitorder="little"))
    x, y, z = (8 * position[brick, a] + sum((m >> (3 * i + a) & 1) << i for i in range(3)) for a in range(3))
    drawn = np.zeros_like(surface)
    drawn[z, y, x] = True
    assert np.array_equal(drawn, surface)
    assert np.array_equal(np.frombuffer(data, np.uint8, 3 * len(x), 76 * n).reshape(-1, 3), color[z, y, x])
    assert len(data) == 76 * n + 7 * len(x)
    listed = vp.view(vp.sparse(mesh, grid), grid)
    assert listed._repr_html_().startswith("<iframe srcdoc=") and json.dumps("occupancy") not in listed.html
    assert vp.view(np.zeros(grid.shape, bool), grid).html.count("<canvas") == 2


def test_failures_leave_no_file(scene, tmp_path):
    _, grid, surface, color = scene
    with pytest.raises(ValueError, match="formats are .npy, .npz, .vox"):
        vp.save(tmp_path / "a.abc", surface, grid)
    with pytest.raises(ValueError, match="one array"):
        vp.save(tmp_path / "a.npy", {"a": surface, "b": color}, grid)
    with pytest.raises(ValueError, match="shape"):
        vp.save(tmp_path / "a.png", surface[1:], grid)
    with pytest.raises(ValueError, match="background"):
        vp.save(tmp_path / "a.png", surface, grid, background="pink")
    with pytest.raises(IndexError, match="voxel 0 is .0, 0, 99. .x, y, z."):
        vp.save(tmp_path / "a.nvdb", (np.array([[0, 0, 99]], np.int32), {}), grid)
    with pytest.raises(TypeError, match="png"):
        vp.save(tmp_path / "a.npy", surface, grid, zoom=2)
    with pytest.raises(OSError):
        vp.save(tmp_path / "none" / "a.npy", surface, grid)
    assert list(tmp_path.iterdir()) == []


def test_every_format_of_the_tool_is_written(scene, tmp_path):
    """Of dense arrays and of a list, which are the same voxels, the same bytes where the format holds voxels alone."""
    mesh, grid, surface, color = scene
    values = {"occupancy": surface, "color": color, "height": np.where(surface, np.float32(2.5), np.float32(0))}
    voxels = grid.ijk(surface)
    listed = (voxels, {n: a[grid.zyx(voxels)] for n, a in values.items() if n != "occupancy"})
    assert {".npy", ".npz", ".vox", ".schem", ".binvox", ".vti", ".nrrd", ".nii", ".nii.gz", ".zarr", ".glb", ".stl", ".nvdb"} < set(vp.formats())
    for extension in vp.formats():
        if extension in (".npy", ".png", "{z}.png", ".html"):  # which other tests write
            continue
        for name, what in (("dense", values), ("list", listed)):
            files = vp.save(tmp_path / f"{name}{extension}", what, grid)
            assert files and all((tmp_path / f).exists() for f in files), extension
    for extension in (".vox", ".schem", ".binvox", ".glb", ".obj", ".ply", ".stl", ".xyz", ".nvdb", ".vtu", ".inp", ".msh"):
        assert (tmp_path / f"dense{extension}").read_bytes() == (tmp_path / f"list{extension}").read_bytes(), extension
    rows = np.loadtxt(tmp_path / "dense.xyz")
    assert len(rows) == surface.sum()
    at = grid.zyx(grid.to_ijk(rows[:, :3]))
    assert surface[at].all() and np.array_equal(rows[:, 3:], color[at])
    vp.save(tmp_path / "plain.ply", surface, grid)
    vp.save(tmp_path / "merged.ply", surface, grid, merge=True)
    assert (tmp_path / "merged.ply").stat().st_size < (tmp_path / "plain.ply").stat().st_size


def test_slices_are_grey_pictures_of_layers(scene, tmp_path):
    """The first row is the highest y; bools are black and white, floats 16 bits, and other values are refused."""
    _, grid, surface, color = scene
    image = pytest.importorskip("PIL.Image")
    share = np.where(surface, np.float32(0.5), np.float32(-1))
    for values, want in ((surface, surface * 255), (share, np.where(surface, 32768, 0))):
        files = vp.save(tmp_path / "a{z}.png", values, grid)
        assert files == [str(tmp_path / f"a{z:04}.png") for z in range(grid.shape[0])]
        for z in (0, grid.shape[0] // 2):
            assert np.array_equal(np.asarray(image.open(files[z]))[::-1], want[z])
    with pytest.raises(ValueError, match="one channel of one component"):
        vp.save(tmp_path / "b{z}.png", color, grid)
    with pytest.raises(ValueError, match="the formats are"):
        vp.save(tmp_path / "{z}.npy", surface, grid)


def test_hexahedra_have_sets_of_materials(scene, tmp_path):
    _, grid, surface, _ = scene
    material = np.where(surface, np.arange(grid.shape[2]) % 2, -1)
    vp.save(tmp_path / "a.inp", {"material": material}, grid, occupied=surface)
    text = (tmp_path / "a.inp").read_text()
    sets = [text.partition(f"*ELSET, ELSET=MATERIAL_{n}\n")[2].partition("*")[0].replace(",", " ").split() for n in (0, 1)]
    assert [len(s) for s in sets] == [np.count_nonzero(material == n) for n in (0, 1)] and "NO_MATERIAL" not in text


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
