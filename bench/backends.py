#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""When a GPU pays in the tool: the time of whole commands by --backend cpu and cuda, and what auto chooses.

    backends.py VOXELIZE [--models FOLDER] [--scenes FOLDER] [--runs 5] [--only TEXT] [--out FILE.csv]

VOXELIZE is the program, built with CUDA. --models has DamagedHelmet.glb and gltf-transform/chr_knight.glb as in glTF's samples,
--scenes has .vpz files and vpmesh.py, which unpacks them; models that are not there are left out. Each case runs cold, as a process
of its own, the two backends in turn; times are medians in milliseconds of the whole command, writing included. The last column says
whether auto took the quicker one; where they differ by less than a tenth, either is right.
"""

import argparse
import csv
import json
import os
import pathlib
import statistics
import struct
import subprocess
import sys
import tempfile
import time

# Model, options, output.
CASES = [
    ("DamagedHelmet.glb", "-r 128", "a.npz"),
    ("DamagedHelmet.glb", "-r 512 -t color,normal", "a.npy"),
    ("DamagedHelmet.glb", "-r 1024 -t color,normal --dense", "a.npy"),
    ("DamagedHelmet.glb", "-r 1024 -t color,normal --sparse", "a.npz"),
    ("DamagedHelmet.glb", "-r 2048 -t color", "a.nvdb"),
    ("gltf-transform/chr_knight.glb", "-r 256 -t color", "a.vox"),
    ("dragon.ply", "-r 512", "a.npy"),
    ("dragon.ply", "-r 1536", "a.npy"),
    ("dragon.ply", "-r 1024 --solid nonzero", "a.nvdb"),
    ("conference.ply", "-r 1024 -t normal --sparse", "a.npz"),
    ("hairball.ply", "-r 1024 -t count", "a.npy"),
    ("asiandragon.ply", "-r 512 -t normal,depth", "a.npy"),
]


def unpack(scenes, name, folder):
    """NAME.vpz of the scenes as a binary PLY; None where it is not there."""
    packed = scenes / (name + ".vpz")
    if not packed.exists():
        return None
    plain, model = folder / (name + ".vpm"), folder / (name + ".ply")
    subprocess.run([sys.executable, scenes / "vpmesh.py", "decode", packed, plain], check=True, stdout=subprocess.DEVNULL)
    import numpy

    data = plain.read_bytes()
    vertices, triangles = struct.unpack_from("<II", data, 8)
    points = numpy.frombuffer(data, "<f4", 3 * vertices, 16)
    faces = numpy.empty(triangles, numpy.dtype([("n", "u1"), ("corners", "<u4", 3)]))
    faces["n"] = 3
    faces["corners"] = numpy.frombuffer(data, "<u4", 3 * triangles, 16 + 12 * vertices).reshape(-1, 3)
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n"
              f"property float z\nelement face {triangles}\nproperty list uchar uint vertex_indices\nend_header\n")
    with open(model, "wb") as file:
        file.write(header.encode())
        file.write(points.tobytes())
        file.write(faces.tobytes())
    plain.unlink()
    return model


def run(command):
    """Milliseconds of a command, and what its --stats say."""
    start = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True)
    ms = 1000 * (time.monotonic() - start)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}: {done.stderr}")
    return ms, json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("--models", type=pathlib.Path)
    parser.add_argument("--scenes", type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--only", default="", help="cases whose model and options have this text")
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--stages", action="store_true", help="print the stages of the last run of each")
    given = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as scratch:
        folder = pathlib.Path(scratch)
        found = {}
        for name, options, output in CASES:
            if given.only not in f"{name} {options}":
                continue
            if name not in found:
                if name.endswith(".ply"):
                    found[name] = unpack(given.scenes, name[:-4], folder) if given.scenes else None
                else:
                    found[name] = given.models / name if given.models and (given.models / name).exists() else None
            if found[name] is None:
                print(f"not run: {name} {options}", file=sys.stderr)
                continue
            command = [given.program, found[name], *options.split(), "-o", folder / output, "-q", "--stats", "json"]
            times = {"cpu": [], "cuda": []}
            stats = {}
            for _ in range(given.runs):
                for backend, taken in times.items():
                    ms, stats[backend] = run(command + ["--backend", backend])
                    taken.append(ms)
            cpu, cuda = (statistics.median(times[b]) for b in ("cpu", "cuda"))
            ms, automatic = run(command + ["--backend", "auto"])
            chosen = automatic["backend"]
            right = (cuda < cpu) == (chosen == "cuda") or max(cpu, cuda) < 1.1 * min(cpu, cuda)
            rows.append([name, options, output, f"{cpu:.0f}", f"{cuda:.0f}", f"{cuda / cpu:.2f}", chosen,
                         automatic.get("estimate", ""), "yes" if right else "no"])
            print(*rows[-1], sep=", ", flush=True)
            if given.stages:
                for backend in times:
                    stages = {k: round(v, 1) for k, v in stats[backend]["ms"].items() if v >= 0.5}
                    print("   ", backend, stages, flush=True)
            for file in folder.glob("a.*"):
                file.unlink()
    if given.out:
        with open(given.out, "w", newline="") as file:
            out = csv.writer(file)
            out.writerow(["model", "options", "output", "cpu_ms", "cuda_ms", "cuda_to_cpu", "auto", "estimate", "right"])
            out.writerows(rows)
    print(f"auto was right in {sum(r[-1] == 'yes' for r in rows)} of {len(rows)}")


if __name__ == "__main__":
    main()
