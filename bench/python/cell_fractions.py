#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Times fractions of voxels beside what trimesh, Open3D and PyVista give by supersampling, with the errors of that.

    bench/python/cell_fractions.py [--out FILE] [--resolutions 64 128 256] [--samples 6] [--voxels 2000] [--levels 8] [--seconds 2] [--most 20]
                                   [--processor-time]

The mesh is a sphere of 8 * 4^levels triangles, 524,288 of them at --levels 8. Two ways without fractions:
- averaged: a mask of the grid that is --samples times finer along each axis, slab by slab, whose samples are averaged;
- queries: --samples^3 points in each voxel that is cut are asked whether they lie inside. --voxels of these voxels are measured, spread
  over all, or as many as take about --most seconds; the time is scaled to all of them, and of the other voxels nothing is asked.
Making the peers' trees is not counted. Each cell is the median of at least three calls, or of one that takes longer than --seconds. A peer
that is not installed is left out. Errors are of voxels that are cut, against our fractions. --processor-time measures that, of all cores
together, for machines that do other work meanwhile; it hides what threads gain.
"""
import argparse
import csv
import os
import platform
import sys
import time

import numpy as np
import voxelpipe as vp

import compare
from compare import ROOT, timed
from versions import version

sys.path.insert(0, str(ROOT / "python" / "tests"))
from meshes import sphere  # noqa: E402


def polydata(mesh):
    import pyvista as pv

    return pv.PolyData(mesh[0], np.hstack([np.full((len(mesh[1]), 1), 3), mesh[1]]).ravel())


def averaged(mask_of, grid, samples, layers):
    """The means of samples^3 numbers a voxel; mask_of(first fine layer, fine layers) gives [z, y, x]."""
    means = np.empty(grid.shape, np.float32)
    nz, ny, nx = grid.shape
    for begin in range(0, nz, layers):
        end = min(nz, begin + layers)
        mask = mask_of(samples * begin, samples * (end - begin))
        parts = mask.reshape(end - begin, samples, ny, samples, nx, samples)
        means[begin:end] = parts.sum(axis=(1, 3, 5), dtype=np.uint32) / np.float32(samples**3)
    return means


def finer_solid(mesh, grid, samples):
    fine = vp.Grid(grid.origin, [s / samples for s in grid.voxel_size], [n * samples for n in grid.shape])
    _, ny, nx = fine.shape
    return lambda first, count: vp.solid(mesh, fine.crop((first, 0, 0), (count, ny, nx)), extent="centre", diagnose=False)


def pyvista_mask(mesh, grid, samples):
    import pyvista as pv

    model = polydata(mesh)
    nz, ny, nx = (n * samples for n in grid.shape)
    size = np.asarray(grid.voxel_size) / samples

    def mask(first, count):
        low = np.asarray(grid.origin) + size / 2 + (0, 0, first * size[2])
        image = pv.ImageData(dimensions=(nx, ny, count), spacing=size, origin=low)
        found = model.voxelize_binary_mask(reference_volume=image)
        return np.asarray(found.point_data["mask"]).reshape(count, ny, nx) != 0

    return mask


def trimesh_queries(mesh):
    import trimesh

    model = trimesh.Trimesh(mesh[0].astype(np.float64), mesh[1], process=False)
    model.contains(np.zeros((1, 3)))  # makes its tree
    return model.contains


def open3d_queries(mesh):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(mesh[0].astype(np.float32)), o3d.core.Tensor(mesh[1].astype(np.uint32)))
    return lambda points: scene.compute_occupancy(o3d.core.Tensor(points.astype(np.float32))).numpy() > 0


def pyvista_queries(mesh):
    import pyvista as pv

    model = polydata(mesh)
    return lambda points: np.asarray(pv.PolyData(points).select_interior_points(model, check_surface=False)["selected_points"]) != 0


AVERAGED = [("voxelpipe solid", ["voxelpipe"], finer_solid), ("PyVista voxelize_binary_mask", ["pyvista"], pyvista_mask)]
QUERIES = [
    ("trimesh contains", ["trimesh", "rtree"], trimesh_queries),
    ("Open3D compute_occupancy", ["open3d"], open3d_queries),
    ("PyVista select_interior_points", ["pyvista"], pyvista_queries),
]


def points_in(grid, voxels, samples):
    """The sample points of voxels (z, y, x), samples^3 each."""
    within = (np.arange(samples) + 0.5) / samples
    z, y, x = np.meshgrid(within, within, within, indexing="ij")
    offsets = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    places = voxels[:, None, ::-1] + offsets[None]
    return (np.asarray(grid.origin) + places.reshape(-1, 3) * np.asarray(grid.voxel_size)).astype(np.float64)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", help="a .csv file")
    parser.add_argument("--resolutions", type=int, nargs="+", default=[64, 128, 256])
    parser.add_argument("--samples", type=int, default=6)
    parser.add_argument("--voxels", type=int, default=2000)
    parser.add_argument("--layers", type=int, default=16, help="of voxels whose finer mask is held at once")
    parser.add_argument("--levels", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--most", type=float, default=20)
    parser.add_argument("--processor-time", action="store_true")
    args = parser.parse_args()
    if args.processor_time:
        compare.clock = time.process_time

    mesh = sphere(levels=args.levels)
    versions = ", ".join(f"{p} {version(p)}" for p in ("voxelpipe", "numpy", "trimesh", "open3d", "pyvista") if version(p))
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, {versions}")
    print(f"{len(mesh[1])} triangles, {args.samples}^3 samples a voxel{', processor time' if args.processor_time else ''}")
    rows, first = [], 0  # of the resolution

    def add(program, way, n, ms, of, errors):
        ours = rows[first]["ms"] if len(rows) > first else ms
        mean, most = (errors.mean(), errors.max()) if errors is not None else (0.0, 0.0)
        rows.append({"program": program, "way": way, "resolution": n, "ms": round(ms, 3), "measured_voxels": of,
                     "times_ours": round(ms / ours, 2), "mean_error": f"{mean:.5f}", "largest_error": f"{most:.5f}"})  # fmt: skip
        print(f"{program:32} {way:9} {n:5} {ms:14.1f} ms {ms / ours:10.1f} x, errors {mean:.5f}, at most {most:.5f}", flush=True)

    for n in args.resolutions:
        grid = vp.fit(mesh, n)
        ms, fractions = timed(lambda: vp.fractions(mesh, grid), args.seconds)
        first = len(rows)
        is_cut = (fractions > 0) & (fractions < 1)
        cut = np.argwhere(is_cut)
        add("voxelpipe fractions", "exact", n, ms, fractions.size, None)
        for program, packages, prepare in AVERAGED:
            if not all(map(version, packages)):
                continue
            mask = prepare(mesh, grid, args.samples)
            ms, means = timed(lambda: averaged(mask, grid, args.samples, args.layers), args.seconds)
            add(program, "averaged", n, ms, means.size, np.abs(means - fractions)[is_cut])
        for program, packages, prepare in QUERIES:
            if not all(map(version, packages)):
                continue
            is_inside = prepare(mesh)

            def ask(count):
                chosen = cut[np.linspace(0, len(cut) - 1, count).astype(int)]
                points = points_in(grid, chosen, args.samples)
                return chosen, lambda: is_inside(points).reshape(count, -1).mean(axis=1)

            _, few = ask(4)
            each = timed(few, 0)[0] / 4000  # seconds a voxel, or more: a call has its own cost
            chosen, call = ask(min(len(cut), args.voxels, max(4, int(args.most / each))))
            ms, means = timed(call, args.seconds)
            add(program, "queries", n, ms * len(cut) / len(chosen), len(chosen), np.abs(means - fractions[tuple(chosen.T)]))
    if args.out:
        with open(args.out, "w", newline="", encoding="utf-8") as f:
            writer = csv.DictWriter(f, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
