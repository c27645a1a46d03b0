#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Times signed distance fields of voxelpipe beside those of OpenVDB, trimesh and Open3D, and compares the distances.

    bench/python/distances.py [--out FOLDER] [--resolutions 64 128 256 512] [--bands 1 3 8] [--whole 32 64 128 256] [--processor-time]

Bands: a sphere of 524,288 triangles at every resolution with band 3, and at the resolution before the last with every band. OpenVDB makes
a level set with the same voxels and the same half width (createLevelSetFromPolygons). Whole fields: a torus of 51,200 triangles; trimesh
and Open3D get the grid's centres. Where all of them would take more than --most seconds, a part of the centres is drawn at random and the
time is scaled, less that of the tree, which is measured apart. Each cell is the median of at least three calls, or of one that takes longer than --seconds.
A peer that is not installed is left out. Differences are in voxels: the largest one, in bands but for the half voxel at their ends, and samples with another sign that are further than
1e-3 of a voxel from the surface. --processor-time measures that, of all cores together, for machines that do other work meanwhile.
"""
import argparse
import csv
import os
import pathlib
import platform
import time

import numpy as np
import voxelpipe as vp

import compare
from compare import timed
from distance_errors import torus
from meshes import sphere
from versions import version

MODULES = {"openvdb": "pyopenvdb"}


def openvdb_band(mesh, grid, band):
    """(call, what reads its distances at the grid's samples)."""
    import pyopenvdb as vdb

    size, first = grid.voxel_size[0], np.asarray(grid.origin) + np.asarray(grid.voxel_size) / 2
    points = (mesh[0] - first).astype(np.float32)  # so that its voxels lie at the grid's centres
    transform = vdb.createLinearTransform(voxelSize=size)

    def read(level_set):
        values = np.empty(grid.shape[::-1], np.float32)
        level_set.copyToArray(values, ijk=(0, 0, 0))
        return values.transpose(2, 1, 0)

    return lambda: vdb.FloatGrid.createLevelSetFromPolygons(points, mesh[1], transform=transform, halfWidth=band), read


def trimesh_points(mesh):
    import trimesh

    model = trimesh.Trimesh(*mesh, process=False)
    query = trimesh.proximity.ProximityQuery(model)
    return lambda points: -query.signed_distance(points)


def open3d_points(mesh):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(mesh[0]), o3d.core.Tensor(mesh[1]))
    return lambda points: scene.compute_signed_distance(o3d.core.Tensor(points.astype(np.float32))).numpy()


def differences(ours, theirs, voxel, band=np.inf):
    """(largest difference in voxels, but for the half voxel at the band's ends, samples of another sign)."""
    near = np.abs(ours) < (band - 0.5) * voxel
    return (float(np.abs(ours - theirs)[near].max()) / voxel,
            int(((ours < 0) != (theirs < 0))[(np.abs(ours) > 1e-3 * voxel)].sum()))


def part_of_call(call, centres, seconds, most):
    """(milliseconds for all centres, the places and values that were measured)."""
    rng = np.random.default_rng(5)
    some = rng.permutation(len(centres))[:1000]
    first = compare.clock()
    call(centres[some[:1]])  # makes the tree
    tree = compare.clock() - first
    ms, values = timed(lambda: call(centres[some]), 0)
    count = len(centres) if ms / 1000 * len(centres) / len(some) <= most else int(most / max(ms / 1000 / len(some), 1e-9))
    if count > len(some):
        some = rng.permutation(len(centres))[:count]
        ms, values = timed(lambda: call(centres[some]), seconds)
    return tree * 1000 + ms * len(centres) / len(some), some, values


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, help="folder of distances.csv")
    parser.add_argument("--resolutions", type=int, nargs="*", default=[64, 128, 256, 512])
    parser.add_argument("--bands", type=float, nargs="*", default=[1, 3, 8])
    parser.add_argument("--whole", type=int, nargs="*", default=[32, 64, 128, 256])
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--most", type=float, default=20)
    parser.add_argument("--processor-time", action="store_true")
    args = parser.parse_args()
    if args.processor_time:
        compare.clock = time.process_time
    has = {p: version(p, MODULES.get(p)) for p in ("voxelpipe", "numpy", "openvdb", "trimesh", "open3d")}
    named = ", ".join(f"{p} {v}" for p, v in has.items() if v)
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, {named}, "
          f"load average {os.getloadavg()[0]:.1f}, {'processor time' if args.processor_time else 'time'}")
    rows = []

    def add(mesh, n, band, program, ms, ours, difference=0.0, signs=0, measured=0):
        rows.append({"triangles": len(mesh[1]), "resolution": n, "band": band, "program": program, "ms": round(ms, 2),
                     "times_ours": round(ms / ours, 2), "difference_voxels": f"{difference:.2g}", "other_signs": signs,
                     "samples": field.size, "measured": measured or field.size})
        print(*(f"{k} {v}" for k, v in rows[-1].items()), sep="  ", flush=True)

    mesh = sphere(levels=8)
    cells = [(n, 3.0) for n in args.resolutions]
    if len(args.resolutions) > 1:
        cells += [(args.resolutions[-2], b) for b in args.bands if b != 3]
    for n, band in cells:
        grid = vp.fit(mesh, n)
        ours, field = timed(lambda grid=grid, band=band: vp.distance(mesh, grid, band=band), args.seconds)
        add(mesh, n, band, "voxelpipe", ours, ours)
        if has["openvdb"]:
            call, read = openvdb_band(mesh, grid, band)
            ms, level_set = timed(call, args.seconds)
            add(mesh, n, band, "OpenVDB", ms, ours, *differences(field, read(level_set), grid.voxel_size[0], band))
    mesh = torus(160, 160)
    for n in args.whole:
        grid = vp.fit(mesh, n)
        ours, field = timed(lambda grid=grid: vp.distance(mesh, grid, band="whole"), args.seconds)
        add(mesh, n, "whole", "voxelpipe", ours, ours)
        axes = [grid.origin[a] + (np.arange(grid.shape[2 - a]) + 0.5) * grid.voxel_size[a] for a in range(3)]
        centres = np.stack(np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")[::-1], -1).reshape(-1, 3)
        for name, package, prepare in (("trimesh", "trimesh", trimesh_points), ("Open3D", "open3d", open3d_points)):
            if not has[package]:
                continue
            ms, some, values = part_of_call(prepare(mesh), centres, args.seconds, args.most)
            add(mesh, n, "whole", name, ms, ours, *differences(field.ravel()[some], values, grid.voxel_size[0]), len(some))
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        with open(args.out / "distances.csv", "w", newline="", encoding="utf-8") as f:
            writer = csv.DictWriter(f, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
