# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""samples/ray_models.py with two workers on one machine: two models and a file that is none. Arguments: the sample, the tool."""
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import zipfile

sample, tool = sys.argv[1:]


def write_box(path, size):
    corners = [(size * (i & 1), size * (i >> 1 & 1), size * (i >> 2 & 1)) for i in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    facets = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    data = bytes(80) + struct.pack("<I", len(facets))
    for facet in facets:
        data += struct.pack("<12fH", 0, 0, 0, *(x for i in facet for x in corners[i]), 0)
    path.write_bytes(data)


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    write_box(folder / "a.stl", 1.0)
    write_box(folder / "b.stl", 2.0)
    (folder / "none.stl").write_bytes(b"no model")
    (folder / "list.txt").write_text("".join(f"{folder / file}\n" for file in ("a.stl", "none.stl", "b.stl")))
    run = subprocess.run([sys.executable, sample, str(folder / "list.txt"), str(folder / "out"), "--", "-r", "16", "--backend", "cpu"],
                         env={**os.environ, "VOXELIZE": tool, "RAY_CPUS": "2"}, capture_output=True, text=True, check=False)
    rows = [json.loads(line) for line in run.stdout.splitlines() if line.startswith("{")]
    assert run.returncode == 2, (run.returncode, run.stdout, run.stderr)
    assert [pathlib.Path(r["model"]).name for r in rows] == ["a.stl", "none.stl", "b.stl"], rows
    assert [r["exit_code"] for r in rows] == [0, 2, 0], rows
    assert rows[0]["voxels"] == rows[2]["voxels"] > 1000, rows
    assert rows[1]["error"] and not pathlib.Path(rows[1]["output"]).exists(), rows
    for row in (rows[0], rows[2]):
        assert "occupancy.npy" in zipfile.ZipFile(row["output"]).namelist(), row
print("three models, two of them drawn")
