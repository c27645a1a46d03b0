# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The voxelize tool that the package brings: `python -m voxelpipe` and the command `voxelize`."""

import io
import re
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
import voxelpipe as vp

import models
from meshes import box

TOOL = Path(vp.__file__).parent / "bin" / "voxelize"
pytestmark = pytest.mark.skipif(not TOOL.exists(), reason="built without the tool")


def run(*arguments, cwd=None, **options):
    return subprocess.run([sys.executable, "-m", "voxelpipe", *map(str, arguments)], capture_output=True, text=True, cwd=cwd, **options)


def mesh_files(folder):
    """A box as OBJ, OFF, STL, PLY and .glb."""
    vertices, triangles = box((0, 0, 0), (3, 2, 1))
    vertices, triangles = np.asarray(vertices, np.float32), np.asarray(triangles, np.uint32)
    rows = ["v {} {} {}".format(*v) for v in vertices] + ["f {} {} {}".format(*(t + 1)) for t in triangles]
    (folder / "a.obj").write_text("\n".join(rows) + "\n")
    text = [" ".join(map(str, v)) for v in vertices.tolist()] + [" ".join(map(str, (3, *t))) for t in triangles.tolist()]
    (folder / "a.off").write_text("\n".join(["OFF", f"{len(vertices)} {len(triangles)} 0", *text]) + "\n")
    header = f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
    header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    (folder / "a.ply").write_text(header + "\n".join(text) + "\n")
    facets = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    facets["corners"] = vertices[triangles]
    (folder / "a.stl").write_bytes(bytes(80) + np.uint32(len(triangles)).tobytes() + facets.tobytes())
    models.glb(folder / "a.glb", [{"POSITION": vertices, "indices": triangles, "material": 0}], [{}])
    return vertices, triangles


def test_version_is_the_packages():
    shown = run("--version")
    assert shown.returncode == 0 and vp.__version__ in shown.stdout


def test_the_command_is_the_tool():
    command = shutil.which("voxelize", path=sysconfig.get_path("scripts"))
    assert command is not None
    asked = [[sys.executable, "-m", "voxelpipe", "--help"], [command, "--help"], [TOOL, "--help"]]
    shown = [subprocess.run(a, capture_output=True, text=True, check=True).stdout for a in asked]
    assert shown[0] == shown[1] == shown[2] and "--resolution" in shown[0]


@pytest.mark.parametrize("extension", ["obj", "off", "ply", "stl", "glb"])
def test_every_own_format_becomes_voxels(tmp_path, extension):
    mesh = mesh_files(tmp_path)
    out = tmp_path / "a.npz"
    done = run(tmp_path / f"a.{extension}", "-o", out, "--resolution", 24)
    assert done.returncode == 0, done.stderr
    assert str(out) in done.stdout
    with np.load(out) as f:
        assert np.array_equal(f["occupancy"] != 0, vp.voxelize(mesh, vp.fit(mesh, 24)))


def test_files_of_voxel_editors(tmp_path):
    mesh_files(tmp_path)
    assert run("a.glb", "-o", "a.vox", "-o", "a.png", "--resolution", 16, cwd=tmp_path).returncode == 0
    assert (tmp_path / "a.vox").read_bytes()[:4] == b"VOX " and (tmp_path / "a.png").read_bytes()[1:4] == b"PNG"


def test_exit_codes_and_messages_are_the_tools(tmp_path):
    mesh_files(tmp_path)
    (tmp_path / "broken.obj").write_text("v 0 0 0\nf 1 2 3\n")
    full = ["a.obj", "-o", "/dev/full.npz/a.npz"]
    for arguments, code in ((["--resolution"], 1), (["no.obj", "-o", "a.npz"], 2), (["broken.obj", "-o", "a.npz"], 2),
                            (["a.obj", "-o", "a.npz", "--resolution", "1024", "--max-memory", "1"], 3), (full, 4),
                            (["a.obj", "-o", "a.npz", "--backend", "cuda"], 5)):  # fmt: skip
        ours = run(*arguments, cwd=tmp_path)
        theirs = subprocess.run([TOOL, *arguments], capture_output=True, text=True, cwd=tmp_path)
        # Needs are of what a process holds at the time, to a mebibyte.
        texts = [re.sub(r"at least [0-9]+ MiB", "at least N MiB", p.stderr) for p in (ours, theirs)]
        assert (ours.returncode, ours.stdout, texts[0]) == (theirs.returncode, theirs.stdout, texts[1])
        assert ours.returncode == code and ours.stderr.startswith("voxelize: "), (arguments, ours)


def test_formats_without_assimp_are_refused_by_a_sentence(tmp_path):
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    done = run("a.dae", "-o", "a.npz", cwd=tmp_path)
    assert done.returncode == 2
    if "no assimp" in done.stderr:
        assert "reads glTF, OBJ, OFF, PLY and STL only" in done.stderr and done.stderr.count("\n") == 1


def test_standard_output_holds_the_file_alone(tmp_path):
    mesh_files(tmp_path)
    command = [sys.executable, "-m", "voxelpipe", "a.obj", "-q", "-o", "npy:-", "--resolution", "8"]
    streamed = subprocess.run(command, capture_output=True, cwd=tmp_path, check=True)
    assert streamed.stdout[:6] == b"\x93NUMPY" and np.load(io.BytesIO(streamed.stdout)).any()


def test_a_package_without_the_tool_says_so(tmp_path):
    shutil.copytree(Path(vp.__file__).parent, tmp_path / "voxelpipe", ignore=shutil.ignore_patterns("bin"))
    done = run("a.obj", env={**os.environ, "PYTHONPATH": str(tmp_path)}, cwd=tmp_path)
    assert done.returncode == 1 and "without the voxelize tool" in done.stderr
