#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Hexahedral meshes with shared nodes of a model's solid, by the voxelize tool and by automesh.

    bench/python/hexahedra.py --tool PATH --model FILE [--resolution 512] [--threads 2] [--runs 3] [--processor-time]

The tool voxelizes the model and writes .vtu, .inp and .msh; and .npy, whose voxels automesh reads, meshes, and writes as Abaqus' .inp, as
INRIA's .mesh, as .exo and as .vtk, where its version has them. Each time is the least of --runs whole processes; automesh's are without
the start of Python. "voxels/s" is of the whole, "without the solid" is less the tool's time for the .npy. automesh is left out if it is not
installed (a wheel that fits: pip install --only-binary :all: automesh). --processor-time measures that, for machines that do other work.
"""
import argparse
import json
import os
import pathlib
import platform
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

PEER = """
import sys, time, automesh
clock = time.process_time if sys.argv[3] == "cpu" else time.perf_counter
start = clock()
made = automesh.Voxels.from_npy(sys.argv[1]).as_finite_elements(remove=[0])
getattr(made, sys.argv[2].split(":")[0])(sys.argv[2].split(":")[1])
print(clock() - start)
"""


def of_children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tool", type=pathlib.Path, required=True)
    parser.add_argument("--model", type=pathlib.Path, required=True)
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--processor-time", action="store_true")
    options = parser.parse_args()
    clock = of_children if options.processor_time else time.perf_counter
    with tempfile.TemporaryDirectory() as folder:
        folder, rows = pathlib.Path(folder), []

        def draw(name):
            line = [options.tool, options.model, "-r", str(options.resolution), "--solid", "nonzero", "--solid-extent", "centre"]
            times = []
            for _ in range(options.runs):
                start = clock()
                subprocess.run([*line, "-j", str(options.threads), "-o", folder / name, "--stats", "json"], check=True, capture_output=True)
                times.append(clock() - start)
            return min(times)

        solid = draw("solid.npy")
        bits = np.load(folder / "solid.npy") != 0
        voxels = int(bits.sum())
        np.save(folder / "bytes.npy", bits.astype(np.uint8))
        for name in ("x.vtu", "x.inp", "x.msh"):
            spent = draw(name)
            rows.append((f"voxelize {name[1:]}", spent, spent - solid, (folder / name).stat().st_size))
            (folder / name).unlink()
        for way in ("write_inp:a.inp", "write_mesh:a.mesh", "write_exo:a.exo", "write_vtk:a.vtk"):
            times = []
            for _ in range(options.runs):
                command = [sys.executable, "-c", PEER, folder / "bytes.npy", way, "cpu" if options.processor_time else "wall"]
                done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
                if done.returncode != 0:
                    print(f"automesh {way}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
                    break
                times.append(float(done.stdout))
            if not times:
                continue
            file = folder / way.split(":")[1]
            rows.append((f"automesh .{file.suffix[1:]}", min(times), min(times), file.stat().st_size))
            file.unlink()
    kind = "processor time" if options.processor_time else "wall clock"
    print(f"{voxels:,} voxels, {kind}, {options.threads} threads, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, Python {platform.python_version()}")
    print(json.dumps({"commit": subprocess.run([options.tool, "--version"], capture_output=True, text=True).stdout.strip()}))
    print("| | s | M voxels/s | without the solid | MB |\n|---|---|---|---|---|")
    for what, spent, without, size in rows:
        print(f"| {what} | {spent:.2f} | {voxels / spent / 1e6:.2f} | {voxels / without / 1e6:.2f} | {size / 1e6:.0f} |")


if __name__ == "__main__":
    main()
