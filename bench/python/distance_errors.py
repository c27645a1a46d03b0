#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Counts wrong signs and the largest errors of signed distances of voxelpipe, trimesh, Open3D, VTK, OpenVDB and Warp.

    bench/python/distance_errors.py [--points 2000] [--seed 1] [--out FILE]

Ten closed meshes that this script makes: plain ones, and those on which signs go wrong: thin plates, close parallel walls, slivers, shells in
shells, parts that touch. Points are drawn around and near the surface, with coordinates of float32, so that all get the same. The truth is brute
force in double: the least distance over all triangles, and the winding number as a sum of solid angles. Points nearer than 1e-6 of the mesh's size, on which
that sum decides nothing, are left out of the signs. voxelpipe snaps points and vertices to a lattice of 2^-24 of the grid: its error here is that of the lattice.
OpenVDB has values at the voxels of its grid alone, 256 along the mesh: it is asked, and judged, at those that are nearest to the points.
A peer that is not installed is left out and named. Versions are printed.
"""
import argparse
import pathlib
import platform
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python" / "tests"))
from meshes import box, sphere  # noqa: E402
from versions import version  # noqa: E402


def joined(*parts):
    first = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    return np.concatenate([v for v, _ in parts]), np.concatenate([f + np.uint32(n) for (_, f), n in zip(parts, first)])


def turned(mesh, angle=0.7):
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return (mesh[0].astype(np.float64) @ turn.T).astype(np.float32), mesh[1]


def scaled(mesh, factors):
    return (mesh[0] * np.float32(factors)).astype(np.float32), mesh[1]


def inverted(mesh):
    return mesh[0], np.ascontiguousarray(mesh[1][:, ::-1])


def torus(n=48, m=24, large=1.0, small=0.35):
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    r = large + small * np.cos(v)
    i = np.arange(n * m).reshape(n, m)
    right, up = np.roll(i, -1, 0), np.roll(i, -1, 1)
    corner = np.roll(right, -1, 1)
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((i, right, up), (right, corner, up))])
    return np.stack([r * np.cos(u), r * np.sin(u), small * np.sin(v)], -1).reshape(-1, 3).astype(np.float32), faces.astype(np.uint32)


def star(spikes=9):
    """A flat star with sharp tips, extruded: reflex edges, where the nearest face alone has the wrong side."""
    a = np.arange(2 * spikes) * np.pi / spikes
    ring = np.stack([np.cos(a), np.sin(a)], -1) * np.where(np.arange(2 * spikes) % 2 == 0, 1.0, 0.15)[:, None]
    n = len(ring)
    v = np.concatenate([np.c_[ring, np.full(n, -0.02)], np.c_[ring, np.full(n, 0.02)], [[0, 0, -0.02], [0, 0, 0.02]]])
    f = []
    for i in range(n):
        j = (i + 1) % n
        f += [(i, j, n + j), (i, n + j, n + i), (2 * n, j, i), (2 * n + 1, n + i, n + j)]
    return v.astype(np.float32), np.array(f, np.uint32)


def all_meshes():
    return {
        "sphere": sphere(levels=4),
        "torus": torus(),
        "turned box": turned(box((-1, -1, -1), (1, 1, 1))),
        "thin plate": turned(box((-1, -1, -0.001), (1, 1, 0.001))),
        "close walls": turned(joined(box((-1, -1, -0.1), (1, 1, -0.001)), box((-1, -1, 0.001), (1, 1, 0.1)))),
        "needle": turned(scaled(sphere(levels=3), (1, 0.004, 0.004))),
        "star": turned(star()),
        "shell": joined(sphere(levels=4), inverted(sphere(0.98, levels=4))),
        "touching boxes": joined(box((-1, -1, -1), (0, 1, 1)), box((0, -0.5, -0.5), (1, 0.5, 0.5))),
        "overlap": joined(sphere(levels=3), sphere(0.8, (0.9, 0.1, 0.2), levels=3)),
    }


def truth(mesh, points):
    """(distances, winding numbers), in double, a block of points at a time."""
    v, f = mesh[0].astype(np.float64), mesh[1]
    a, b, c = v[f[:, 0]], v[f[:, 1]], v[f[:, 2]]
    square, winding = np.empty(len(points)), np.empty(len(points))
    for at in range(0, len(points), 50):
        p = points[at : at + 50, None].astype(np.float64)
        pa, pb, pc = a - p, b - p, c - p
        best = np.full(pa.shape[:2], np.inf)
        for u, w, e in ((pa, pb, b - a), (pb, pc, c - b), (pc, pa, a - c)):
            t = np.clip(-(u * e).sum(-1) / np.maximum((e * e).sum(-1), 1e-300), 0, 1)
            best = np.minimum(best, ((u + t[..., None] * e) ** 2).sum(-1))
        n = np.cross(b - a, c - a)
        sides = [(np.cross(u, w) * n).sum(-1) for u, w in ((pa, pb), (pb, pc), (pc, pa))]
        is_face = (sides[0] > 0) & (sides[1] > 0) & (sides[2] > 0)
        plane = (pa * n).sum(-1) ** 2 / np.maximum((n * n).sum(-1), 1e-300)
        square[at : at + 50] = np.where(is_face, np.minimum(plane, best), best).min(1)
        la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (pa, pb, pc))
        det = (pa * np.cross(pb, pc)).sum(-1)
        den = la * lb * lc + (pa * pb).sum(-1) * lc + (pb * pc).sum(-1) * la + (pc * pa).sum(-1) * lb
        winding[at : at + 50] = (2 * np.arctan2(det, den)).sum(1) / (4 * np.pi)
    return np.sqrt(square), winding


def samples(mesh, count, rng):
    v, f = mesh
    low, high = v.min(0), v.max(0)
    around = rng.uniform(low - 0.1, high + 0.1, (count // 2, 3))
    weights = rng.dirichlet((1, 1, 1), count - count // 2)
    on = (v[f[rng.integers(len(f), size=len(weights))]] * weights[..., None]).sum(1)
    return np.concatenate([around, on + rng.normal(0, 1e-3, on.shape) * np.ptp(v, axis=0).max()]).astype(np.float32)


def with_voxelpipe(mesh, points):
    import voxelpipe as vp

    return vp.distance_at(mesh, points)


def with_trimesh(mesh, points):
    import trimesh

    return -trimesh.proximity.signed_distance(trimesh.Trimesh(*mesh, process=False), points)


def with_open3d(mesh, points):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(mesh[0]), o3d.core.Tensor(mesh[1]))
    return scene.compute_signed_distance(o3d.core.Tensor(points)).numpy()


def with_vtk(mesh, points):
    """What PyVista's compute_implicit_distance calls."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    data, at, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
    at.SetData(numpy_to_vtk(mesh[0].astype(np.float64), deep=True))
    rows = np.c_[np.full(len(mesh[1]), 3), mesh[1]].astype(np.int64)
    cells.SetCells(len(rows), numpy_to_vtkIdTypeArray(rows.ravel(), deep=True))
    data.SetPoints(at)
    data.SetPolys(cells)
    field = vtkImplicitPolyDataDistance()
    field.SetInput(data)
    result = vtkDoubleArray()
    field.EvaluateFunction(numpy_to_vtk(points.astype(np.float64), deep=True), result)
    return vtk_to_numpy(result).copy()


def openvdb_voxel(mesh):
    return float(np.ptp(mesh[0], axis=0).max()) / 256


def with_openvdb(mesh, points):
    """A level set of 256 voxels along the mesh, at its voxels `points`: distances of those within its band alone."""
    import pyopenvdb as vdb

    size = openvdb_voxel(mesh)
    grid = vdb.FloatGrid.createLevelSetFromPolygons(
        mesh[0], mesh[1], transform=vdb.createLinearTransform(voxelSize=size), halfWidth=3)
    accessor = grid.getConstAccessor()
    return np.array([accessor.getValue(tuple(int(i) for i in p)) for p in np.rint(points / size)])


def with_warp(mesh, points):
    import warp as wp

    @wp.kernel
    def query(mesh_id: wp.uint64, at: wp.array(dtype=wp.vec3), out: wp.array(dtype=float)):  # type: ignore[valid-type]
        i = wp.tid()
        q = wp.mesh_query_point_sign_winding_number(mesh_id, at[i], 1.0e6)
        out[i] = q.sign * wp.length(at[i] - wp.mesh_eval_position(mesh_id, q.face, q.u, q.v))

    shape = wp.Mesh(wp.array(mesh[0], dtype=wp.vec3, device="cpu"),
                    wp.array(mesh[1].astype(np.int32).ravel(), dtype=int, device="cpu"), support_winding_number=True)
    out = wp.zeros(len(points), dtype=float, device="cpu")
    wp.launch(query, len(points), [shape.id, wp.array(points, dtype=wp.vec3, device="cpu"), out], device="cpu")
    return out.numpy()


PEERS = {
    "voxelpipe": with_voxelpipe,
    "trimesh": with_trimesh,
    "open3d": with_open3d,
    "vtk": with_vtk,
    "openvdb": with_openvdb,
    "warp-lang": with_warp,
}
MODULES = {"openvdb": "pyopenvdb", "warp-lang": "warp", "vtk": "vtkmodules"}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--points", type=int, default=2000, help="of each mesh")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=pathlib.Path, help="the table, also printed")
    options = parser.parse_args()
    versions = {name: version(name, MODULES.get(name, name)) for name in PEERS}
    lines = [f"{platform.machine()}, Python {platform.python_version()}; " + "; ".join(
        f"{name} {v or 'not installed'}" for name, v in versions.items())]
    lines.append(f"{options.points} points a mesh, seed {options.seed}: wrong signs / largest error of the distance, share of the mesh's size")
    lines.append("mesh                 triangles  checked  " + "".join(f"{n:>20}" for n, v in versions.items() if v))
    for number, (name, mesh) in enumerate(all_meshes().items()):
        points = samples(mesh, options.points, np.random.default_rng([options.seed, number]))
        size = float(np.ptp(mesh[0], axis=0).max())

        def judged_at(where):
            distance, winding = truth(mesh, where)
            is_clear = (distance > 1e-6 * size) & (np.abs(np.abs(winding) - 0.5) > 0.25)
            return where, distance, is_clear, np.abs(winding) > 0.5

        all_points = judged_at(points)
        voxel = openvdb_voxel(mesh)
        voxels = judged_at(np.rint(points / voxel) * voxel) if versions["openvdb"] else None
        row = f"{name:20} {len(mesh[1]):9}  {int(all_points[2].sum()):7}  "
        for peer, call in PEERS.items():
            if not versions[peer]:
                continue
            where, distance, is_clear, is_inside = voxels if peer == "openvdb" else all_points
            try:
                found = np.asarray(call(mesh, where), np.float64)
            except Exception as error:  # a peer that fails on a mesh is a result, too
                row += f"{type(error).__name__[:18]:>20}"
                continue
            wrong = int(((found < 0) != is_inside)[is_clear].sum())
            counted = distance < 2 * voxel if peer == "openvdb" else np.ones(len(where), bool)
            error = np.abs(np.abs(found) - distance)[counted].max() / size
            row += f"{wrong:>9} / {error:8.1e}"
        lines.append(row)
        print(row, flush=True)
    text = "\n".join(lines) + "\n"
    print(text)
    if options.out:
        options.out.write_text(text)


if __name__ == "__main__":
    main()
