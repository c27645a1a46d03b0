#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes that voxelpipe and other packages make of three small inputs: boundary edges, bad edges, components, intersections and time.

    bench/python/surfaces.py [--out FILE] [--resolution 64] [--seconds 1]
    bench/python/surfaces.py --models 1000 [--every] [--first 0] [--out FILE]

The inputs are made here: two boxes that cross each other; a ball of which a twentieth of the triangles is gone; and a soup of a ball, a
plate and a shell with triangles flipped, doubled and gone. A boundary edge has one face; a bad edge has more than two, or two that go
around it alike; meshes are judged as they are indexed. Components share vertices. Intersecting faces are those that PyMeshLab selects.
Each time is the least of at least three calls after a first one, or that of one that takes longer than --seconds. A package that is not installed is left out,
and one that refuses an input says so. The table is Markdown, with all versions.

With --models, voxelpipe alone remeshes that many generated bad models by nine signs, and trimesh and manifold3d, which both have to be
installed, judge every mesh as it is indexed: watertight, wound consistently, of a volume above 0, and a manifold. Each model is taken by
every sign at one place on one grid, or with --every at all three places on grids of 32 and 64. Ends with 1 where one mesh fails.
"""
import argparse
import os
import pathlib
import platform
import sys
import time

import numpy as np
import voxelpipe as vp

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python" / "tests"))
from meshes import sphere  # noqa: E402
from versions import version  # noqa: E402

BOX = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
SIDES = np.array([[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]])


def joined(*parts):
    firsts = np.cumsum([0] + [len(v) for v, _ in parts])
    return np.concatenate([v for v, _ in parts]).astype(np.float64), np.concatenate([f + n for (_, f), n in zip(parts, firsts)])


def inputs():
    rng = np.random.default_rng(61)
    ball = sphere(levels=4)
    yield "crossing boxes", joined((BOX, SIDES), (0.6 + BOX * [0.7, 0.8, 0.9], SIDES))
    yield "ball with holes", (ball[0].astype(np.float64), ball[1][rng.random(len(ball[1])) > 0.05])
    v, f = joined((ball[0], ball[1]), (BOX * [3, 3, 0.08] - [1.5, 1.5, 0.04], SIDES), (0.6 * ball[0], ball[1]))
    f = f[rng.random(len(f)) > 0.02].copy()
    turned = rng.random(len(f)) < 0.02
    f[turned] = f[turned][:, ::-1]
    yield "soup", (v, np.concatenate([f, f[rng.random(len(f)) < 0.02]]))


def judged(faces):
    """(boundary edges, bad edges, components) of triangles as they are indexed."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    forward = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, which, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    balance = np.bincount(which.ravel(), forward)
    parent = np.arange(int(faces.max()) + 1)
    while True:  # the least vertex of each component spreads
        least = parent[faces].min(axis=1)
        before = parent.copy()
        for k in range(3):
            np.minimum.at(parent, faces[:, k], least)
        parent = parent[parent]
        if (parent == before).all():
            break
    return int((count == 1).sum()), int(((count > 2) | ((count == 2) & (balance != 0))).sum()), len(np.unique(parent[faces]))


def intersecting(vertices, faces):
    import pymeshlab

    work = pymeshlab.MeshSet()
    work.add_mesh(pymeshlab.Mesh(np.asarray(vertices, np.float64), np.asarray(faces, np.int32)))
    work.compute_selection_by_self_intersections_per_face()
    return work.current_mesh().selected_face_number()


def voxelpipe_remesh(mesh, n, place):
    grid = vp.fit(mesh, n)
    return lambda: vp.remesh(mesh, grid, repair="close_holes", place=place)[:2]


def voxelpipe_exterior(mesh, n):
    size = float(np.ptp(mesh[0], axis=0).max()) / n
    grid = vp.fit(mesh, voxel_size=size, padding=4)
    return lambda: vp.remesh(mesh, grid, repair="exterior", closing=1, level=size)[:2]


def pymeshlab_filter(mesh, n, name, lengths, **options):
    """lengths: in voxels of n along the longest side."""
    import pymeshlab

    size = float(np.ptp(mesh[0], axis=0).max()) / n
    options |= {k: pymeshlab.PureValue(size * voxels) for k, voxels in lengths.items()}

    def call():
        work = pymeshlab.MeshSet()
        work.add_mesh(pymeshlab.Mesh(mesh[0], mesh[1].astype(np.int32)))
        getattr(work, name)(**options)
        made = work.current_mesh()
        return made.vertex_matrix(), made.face_matrix()

    return call


def alpha_wrap(mesh, n):
    return pymeshlab_filter(mesh, n, "generate_alpha_wrap", {"alpha": 1, "offset": 0.25})


def resampled(mesh, n):
    return pymeshlab_filter(mesh, n, "generate_resampled_uniform_mesh", {"cellsize": 1}, mergeclosevert=True)


def open3d_poisson(mesh, n):
    import open3d as o3d

    model = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(mesh[0]), o3d.utility.Vector3iVector(mesh[1].astype(np.int32)))

    def call():
        points = model.sample_points_uniformly(20000, use_triangle_normal=True)
        made, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(points, depth=int(np.log2(n)))
        return np.asarray(made.vertices), np.asarray(made.triangles)

    return call


def pyvista_contour(mesh, n):
    import pyvista as pv

    model = pv.PolyData(mesh[0], np.hstack([np.full((len(mesh[1]), 1), 3), mesh[1]]).ravel())
    size = float(np.ptp(mesh[0], axis=0).max()) / n
    shape = np.ceil(np.ptp(mesh[0], axis=0) / size).astype(int) + 4
    image = pv.ImageData(dimensions=shape, spacing=(size,) * 3, origin=mesh[0].min(axis=0) - 1.5 * size)

    def call():
        mask = model.voxelize_binary_mask(reference_volume=image)
        made = mask.contour([0.5], scalars="mask")
        return np.asarray(made.points), np.asarray(made.faces).reshape(-1, 4)[:, 1:]

    return call


def trimesh_cubes(mesh, n):
    import trimesh

    model = trimesh.Trimesh(*mesh, process=False)

    def call():
        made = model.voxelized(model.extents.max() / n).fill().marching_cubes
        return made.vertices, made.faces

    return call


def manifold_of(mesh, _):
    import manifold3d

    def call():
        given = manifold3d.Mesh(mesh[0].astype(np.float32), mesh[1].astype(np.uint32))
        given.merge()
        made = manifold3d.Manifold(given)
        if made.status() != manifold3d.Error.NoError:
            raise ValueError(str(made.status()).split(".")[-1])
        made = manifold3d.Manifold.batch_boolean(made.decompose(), manifold3d.OpType.Add).to_mesh()
        return made.vert_properties[:, :3], made.tri_verts

    return call


PROGRAMS = [  # name, package, function
    ("voxelpipe remesh, sharp", "voxelpipe", lambda m, n: voxelpipe_remesh(m, n, "sharp")),
    ("voxelpipe remesh, mean", "voxelpipe", lambda m, n: voxelpipe_remesh(m, n, "mean")),
    ("voxelpipe remesh, exterior, level of a voxel", "voxelpipe", voxelpipe_exterior),
    ("PyMeshLab alpha wrap (CGAL)", "pymeshlab", alpha_wrap),
    ("PyMeshLab uniform resampling", "pymeshlab", resampled),
    ("Open3D Poisson", "open3d", open3d_poisson),
    ("PyVista mask and contour", "pyvista", pyvista_contour),
    ("trimesh voxelized, filled, marching cubes", "trimesh", trimesh_cubes),
    ("manifold3d merge and union", "manifold3d", manifold_of),
]


SIGNS = [
    {},
    {"sign": "even_odd"},
    {"sign": "positive"},
    {"repair": "close_holes"},
    {"repair": "exterior"},
    {"repair": "exterior", "closing": 1},
    {"repair": "vote"},
    {"repair": "winding"},
    {"level": 0.04},
]
PLACES = ("corner", "mean", "sharp")


def bad_model(seed):
    """Crossing parts, shells, plates, some of no thickness; triangles gone, flipped, doubled, cut beside an edge; slivers; NaN; far corners."""
    rng = np.random.default_rng([61, seed])
    ball = sphere(levels=2)
    octahedron = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    eight = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    parts = []
    for _ in range(rng.integers(1, 5)):
        c, r = rng.uniform(0.3, 0.7, 3), rng.uniform(0.1, 0.3)
        kind = rng.integers(5)
        if kind == 0:
            parts.append((c + r * ball[0], ball[1]))
        elif kind == 1:
            parts.append((c + r * octahedron, eight))
        elif kind == 2:
            parts.append((c - [r, r, 0] + BOX * [2 * r, 2 * r, rng.choice([0.0, 0.02])], SIDES))
        elif kind == 3:
            parts += [(c + r * ball[0], ball[1]), (c + 0.7 * r * ball[0], ball[1])]
        else:
            parts.append((c - r + BOX * [2 * r, 1.5 * r, 2 * r], SIDES))
    v, f = joined(*parts)
    f = np.delete(f, rng.choice(len(f), min(len(f) - 4, int(rng.integers(20))), replace=False), axis=0)
    faults = rng.random(6) < 0.5
    if faults[0]:
        turned = rng.integers(len(f), size=5)
        f[turned] = f[turned][:, ::-1]
    if faults[1]:
        f = np.concatenate([f, f[rng.integers(len(f), size=5)]])
    if faults[2]:
        for k in rng.choice(len(f), 4, replace=False):
            a, b, c = f[k]
            v = np.concatenate([v, [(v[a] + v[b]) / 2 + [0, 0, 0.003]]])
            f[k] = [a, len(v) - 1, c]
            f = np.concatenate([f, [[len(v) - 1, b, c]]])
    if faults[3]:
        for _ in range(6):
            p, q = rng.uniform(0.1, 0.9, (2, 3))
            f = np.concatenate([f, [[len(v), len(v) + 1, len(v) + 2]]])
            v = np.concatenate([v, [p, q, q + [0, 0, 1e-4]]])
    if faults[4]:
        v[rng.integers(len(v)), 1] = np.nan
    if faults[5]:
        v[rng.integers(len(v))] = [1e6, -1e9, 3]
    return v, f


def faults_of(vertices, faces):
    """What trimesh and manifold3d say against a mesh."""
    import manifold3d
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    boundary, bad, _ = judged(faces)
    solid = manifold3d.Manifold(manifold3d.Mesh64(np.asarray(vertices, np.float64), np.asarray(faces, np.uint64)))
    said = {
        "boundary edges": boundary != 0,
        "bad edges": bad != 0,
        "trimesh: not watertight": not mesh.is_watertight,
        "trimesh: wound inconsistently": not mesh.is_winding_consistent,
        "trimesh: no volume": not mesh.volume > 0,
        "manifold3d: no manifold": solid.status() != manifold3d.Error.NoError,
    }
    return [what for what, is_so in said.items() if is_so]


def judge_models(args):
    import warnings

    warnings.simplefilter("ignore")
    box = (np.array([[0.0, 0, 0], [1, 1, 1]]), np.array([[0, 1, 1]]))
    grids = {n: vp.fit(box, n) for n in (32, 64)}
    meshes = faces_in_all = empty = 0
    counts, said = {}, []
    start = time.perf_counter()
    for seed in range(args.first, args.first + args.models):
        model = bad_model(seed)
        for way, options in enumerate(SIGNS):
            for p, place in enumerate(PLACES):
                for n, grid in grids.items():
                    if not args.every and (p != (seed + way) % 3 or (n == 64) != (seed % 8 == 0)):
                        continue
                    vertices, faces, _ = vp.remesh(model, grid, place=place, status=counts, **options)
                    if len(faces) == 0:
                        empty += 1
                        continue
                    meshes += 1
                    faces_in_all += len(faces)
                    said += [(what, seed, options, place, n) for what in faults_of(vertices, faces)]
    names = ("voxelpipe", "numpy", "trimesh", "manifold3d")
    text = f"{args.models} bad models from {args.first} on, {meshes} meshes of {faces_in_all} triangles, {empty} empty ones; {len(said)} faults"
    text += f"; {time.perf_counter() - start:.0f} s; Python {platform.python_version()}, " + ", ".join(f"{p} {version(p)}" for p in names) + "\n"
    for what, seed, options, place, n in said:
        text += f"{what}: model {seed}, {options}, {place}, grid of {n}\n"
    print(text, end="")
    if args.out:
        args.out.write_text(text, encoding="utf-8")
    return 1 if said or meshes == 0 else 0


def timed(call, seconds):
    time.sleep(0.5)  # threads of the package before may still turn
    call()
    times = []
    while len(times) < 3 or sum(times) < seconds:
        start = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - start)
        if times[-1] > seconds:
            break
    return 1000 * min(times), result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--resolution", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=1)
    parser.add_argument("--models", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--every", action="store_true")
    args = parser.parse_args()
    if args.models:
        return judge_models(args)
    import warnings

    warnings.simplefilter("ignore")
    packages = ("voxelpipe", "numpy", "pymeshlab", "open3d", "pyvista", "trimesh", "manifold3d")
    versions = ", ".join(f"{p} {version(p)}" if version(p) else f"{p} not installed" for p in packages)
    lines = [f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, {versions}; resolution {args.resolution}", "",
             "| input | program | triangles | boundary edges | bad edges | components | intersecting faces | ms |", "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    print("\n".join(lines), flush=True)
    for name, mesh in inputs():
        for program, package, prepare in PROGRAMS:
            if version(package) is None:
                continue
            try:
                ms, (vertices, faces) = timed(prepare(mesh, args.resolution), args.seconds)
                crossing = intersecting(vertices, faces) if version("pymeshlab") else ""
                cells = [len(faces), *judged(np.asarray(faces)), crossing, f"{ms:.1f}"]
            except Exception as error:  # of any package: the table says it
                cells = [f"refused: {str(error).splitlines()[0][:60]}", "", "", "", "", ""]
            lines.append(f"| {name} | {program} | " + " | ".join(map(str, cells)) + " |")
            print(lines[-1], flush=True)
    if args.out:
        args.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
