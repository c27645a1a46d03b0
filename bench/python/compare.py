#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Times voxelpipe for Python beside trimesh, Open3D and PyVista, with the errors of what they find, and beside C++.

    bench/python/compare.py [--out FOLDER] [--resolutions 32 64 128 256] [--seconds 2] [--without-cpp] [--processor-time]

The mesh is a sphere of 524,288 triangles. Each cell is the median of at least three calls, or of one that takes longer than --seconds;
an entry that would take more than --most seconds at the next resolution is left out there. A peer that is not installed is left out.
--processor-time measures that, of all cores together, for machines that do other work meanwhile; it hides what threads gain.
Surfaces are compared with the voxels that the closed triangles touch, solids with those whose centre is inside; both exact. Of solids the
error of the volume is that against the mesh's own, in percent.
"""
import argparse
import csv
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import voxelpipe as vp

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python" / "tests"))
from meshes import sphere  # noqa: E402
from versions import version  # noqa: E402

clock = time.perf_counter


def timed(call, seconds):
    """(median milliseconds, result)."""
    times, result = [], None
    while len(times) < 3 or sum(times) < seconds:
        start = clock()
        result = call()
        times.append(clock() - start)
        if times[-1] > seconds:
            break
    return 1000 * statistics.median(times), result


def trimesh_surface(mesh, grid):
    import trimesh

    pitch = grid.voxel_size[0]
    shift = np.asarray(grid.origin) + pitch / 2  # its voxels have their centres at multiples of the pitch
    model = trimesh.Trimesh(mesh[0].astype(np.float64) - shift, mesh[1], process=False)
    return lambda: model.voxelized(pitch), lambda r: np.rint(r.points / pitch).astype(int)


def trimesh_solid(mesh, grid):
    call, voxels_of = trimesh_surface(mesh, grid)
    return lambda: call().fill(), voxels_of


def open3d_solid(mesh, grid):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(mesh[0].astype(np.float32)), o3d.core.Tensor(mesh[1].astype(np.uint32)))
    axes = [np.asarray(grid.origin)[a] + (np.arange(grid.shape[2 - a]) + 0.5) * grid.voxel_size[a] for a in range(3)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    centres = o3d.core.Tensor(np.stack([x, y, z], axis=-1).astype(np.float32))
    return lambda: scene.compute_occupancy(centres), lambda r: np.argwhere(r.numpy() > 0)[:, ::-1]


def mesh_volume(mesh):
    a, b, c = (mesh[0].astype(np.float64)[mesh[1][:, i]] for i in range(3))
    return abs(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def open3d_surface(mesh, grid):
    import open3d as o3d

    model = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(mesh[0]), o3d.utility.Vector3iVector(mesh[1].astype(np.int32)))
    low = np.asarray(grid.origin)
    high = low + np.asarray(grid.voxel_size) * grid.shape[::-1]
    call = lambda: o3d.geometry.VoxelGrid.create_from_triangle_mesh_within_bounds(model, grid.voxel_size[0], low, high)  # noqa: E731
    return call, lambda r: np.array([v.grid_index for v in r.get_voxels()])


def pyvista_solid(mesh, grid):
    import pyvista as pv

    faces = np.hstack([np.full((len(mesh[1]), 1), 3), mesh[1]]).ravel()
    model = pv.PolyData(mesh[0], faces)
    # A point of the image is the centre of a voxel.
    nz, ny, nx = grid.shape
    size = np.asarray(grid.voxel_size)
    image = pv.ImageData(dimensions=(nx, ny, nz), spacing=size, origin=np.asarray(grid.origin) + size / 2)
    call = lambda: model.voxelize_binary_mask(reference_volume=image)  # noqa: E731
    return call, lambda r: np.argwhere(np.asarray(r.point_data["mask"]).reshape(nz, ny, nx) != 0)[:, ::-1]


PEERS = [  # name, package, what is compared, function
    ("trimesh voxelized", "trimesh", "surface", trimesh_surface),
    ("Open3D VoxelGrid", "open3d", "surface", open3d_surface),
    ("trimesh voxelized().fill()", "trimesh", "solid", trimesh_solid),
    ("Open3D compute_occupancy", "open3d", "solid", open3d_solid),
    ("PyVista voxelize_binary_mask", "pyvista", "solid", pyvista_solid),
]


def errors(voxels, exact):
    """(voxels that are missing, that are too many) of a list x, y, z."""
    found = np.zeros(exact.shape, bool)
    inside = ((voxels >= 0) & (voxels < exact.shape[::-1])).all(axis=1)
    found[tuple(voxels[inside].T[::-1])] = True
    return int((exact & ~found).sum()), int((found & ~exact).sum() + (~inside).sum())


class CppCall:
    """The program call.cpp and its input, in a folder that goes when this does."""

    def __init__(self, mesh):
        self.folder = tempfile.TemporaryDirectory()
        self.program, *self.files = (os.path.join(self.folder.name, name) for name in ("call", "vertices", "triangles"))
        subprocess.run([os.environ.get("CXX", "g++"), "-std=c++20", "-O3", "-DNDEBUG", "-pthread", f"-I{ROOT}",
                        str(ROOT / "bench/python/call.cpp"), "-o", self.program], check=True)
        for file, a in zip(self.files, mesh):
            a.tofile(file)

    def milliseconds(self, n, runs):
        """(median milliseconds by the clock in use, voxels)."""
        wall, processor, voxels = subprocess.run([self.program, *self.files, str(n), str(runs)], check=True, capture_output=True,
                                                 text=True).stdout.split()
        return float(processor if clock is time.process_time else wall), int(voxels)


def plot(rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4.2), dpi=120)
    for name in dict.fromkeys(r["program"] for r in rows):
        cells = [(r["resolution"], r["ms"]) for r in rows if r["program"] == name]
        axes.plot(*zip(*cells), marker="o", linewidth=2 if name.startswith("voxelpipe") else 1.2, label=name)
    axes.set(xscale="log", yscale="log", xlabel="voxels a side", ylabel=f"milliseconds{' of processor time' if clock is time.process_time else ''} a call", title="A sphere of 524,288 triangles")
    axes.set_xticks(sorted({r["resolution"] for r in rows}), labels=[str(n) for n in sorted({r["resolution"] for r in rows})])
    axes.minorticks_off()
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--resolutions", type=int, nargs="+", default=[32, 64, 128, 256, 512])
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--most", type=float, default=60)
    parser.add_argument("--without-cpp", action="store_true")
    parser.add_argument("--processor-time", action="store_true")
    args = parser.parse_args()
    global clock
    if args.processor_time:
        clock = time.process_time

    mesh = sphere(levels=8)
    assert len(mesh[1]) == 524288
    versions = ", ".join(f"{p} {version(p)}" for p in ("voxelpipe", "numpy", "trimesh", "open3d", "pyvista") if version(p))
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, {versions}")
    rows, too_slow = [], set()
    cpp = None if args.without_cpp else CppCall(mesh)

    volume = mesh_volume(mesh)

    def add(program, n, ms, voxels, missing, extra, what):
        error = f"{100 * (voxels * np.prod(grid.voxel_size) / volume - 1):+.3f}" if what == "solid" else ""
        rows.append({"program": program, "resolution": n, "ms": round(ms, 3), "voxels": voxels, "missing": missing, "extra": extra,
                     "volume_error": error})  # fmt: skip
        print(f"{program:32} {n:5} {ms:12.2f} ms {voxels:12} voxels, {missing} missing, {extra} too many {error}", flush=True)

    for n in args.resolutions:
        grid = vp.fit(mesh, n)
        exact = {}
        for program, what, call in (("voxelpipe voxelize", "surface", lambda: vp.voxelize(mesh, grid)),
                                    ("voxelpipe solid", "solid", lambda: vp.solid(mesh, grid, extent="centre"))):
            ms, exact[what] = timed(call, args.seconds)
            add(program, n, ms, int(exact[what].sum()), 0, 0, what)
        if cpp:
            ms, voxels = cpp.milliseconds(n, 15)
            assert voxels == exact["surface"].sum()
            add("the same call from C++", n, ms, voxels, 0, 0, "surface")
        for program, package, what, prepare in PEERS:
            if version(package) is None or program in too_slow:
                continue
            call, voxels_of = prepare(mesh, grid)
            ms, result = timed(call, args.seconds)
            voxels = voxels_of(result)
            add(program, n, ms, len(voxels), *errors(voxels, exact[what]), what)
            if ms > 1000 * args.most / 8:
                too_slow.add(program)
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        with open(args.out / "python.csv", "w", newline="", encoding="utf-8") as f:
            writer = csv.DictWriter(f, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)
        plot(rows, args.out / "python.png")


if __name__ == "__main__":
    main()
