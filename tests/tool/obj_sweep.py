#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Writes one mesh in hundreds of layouts of OBJ and compares the voxels of the tool with those of an independent reader.

usage: obj_sweep.py VOXELIZE [--every N]

trimesh reads each mesh in its plainest layout and writes it as a binary STL; the voxels of every layout have to be those
of that STL. --every N takes one layout of N (1 by default). Ends with 1 at a difference.
"""
import argparse
import itertools
import pathlib
import random
import subprocess
import sys
import tempfile

try:
    import numpy
    import trimesh
except ImportError as missing:
    print(f"not run: {missing}")
    sys.exit(77)

GRID = "-s .125 --origin=-2,-2,-2 --extent 32,32,32 -t occupancy --backend cpu -j 1 --quiet".split()


def voxels(program, model, folder):
    out = folder / "o.npy"
    out.unlink(missing_ok=True)
    done = subprocess.run([program, model, "-o", out, *GRID], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None, done.stderr
    return numpy.load(out), done.stderr


def meshes():
    """Name, vertices, polygons: closed and open, with triangles, quadrilaterals and a concave polygon."""
    box = trimesh.creation.box(extents=(1.3, 0.9, 1.1))
    ball = trimesh.creation.icosphere(subdivisions=1, radius=1.2)
    yield "box", box.vertices.tolist(), box.faces.tolist()
    yield "ball", ball.vertices.tolist(), ball.faces.tolist()
    cube = [[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
    yield "quads", cube, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    corner = [[1.5, 0, 0.3], [1.5, 1, 0.3], [0.5, 1, 0.3], [0.5, 1.7, 0.3], [-1, 1.7, 0.3], [-1, 0, 0.3]]
    yield "concave", corner, [[0, 1, 2, 3, 4, 5]]


NUMBERS = {
    "repr": repr,
    "exponent": lambda x: f"{x:.17e}",
    "upper exponent": lambda x: f"{x:.17E}",
    "short": lambda x: repr(x).replace("0.", ".") if abs(x) < 1 and "e" not in repr(x) else repr(x),
    "signs": lambda x: f"{x:+.17g}",
}
CORNERS = {
    "v": lambda v, n, nt: f"{v + 1}",
    "v/t": lambda v, n, nt: f"{v + 1}/{v % nt + 1}",
    "v//n": lambda v, n, nt: f"{v + 1}//1",
    "v/t/n": lambda v, n, nt: f"{v + 1}/{v % nt + 1}/1",
    "back": lambda v, n, nt: f"{v - n}",
    "back/t": lambda v, n, nt: f"{v - n}/{-1 - v % nt}/-1",
    "no vt": lambda v, n, nt: f"{v + 1}/{v + 1000}/1",
}
EXTRAS = {"": "", "weight": " 1.0", "colour": " .1 .2 .3", "alpha": " .1 .2 .3 .4", "comment": " # 1 2 3"}
LINES = {
    "lf": lambda t, r: t,
    "crlf": lambda t, r: t.replace("\n", "\r\n"),
    "cr": lambda t, r: t.replace("\n", "\r"),
    "indented": lambda t, r: "".join(r.choice(["", " ", "\t", "  \t"]) + line + "\n" for line in t.splitlines()),
    "continued": lambda t, r: "".join(
        (line.replace(" ", " \\\n ", r.randrange(3)) if "#" not in line else line) + "\n" for line in t.splitlines()),
    "mark": lambda t, r: "\ufeff" + t,
    "noise": lambda t, r: "".join(
        r.choice(["", "\n", "# f 1 2 3\n", "s off\n", "g a b\n", "o c\n", "usemtl d\n", "lod 3\n"]) + line + "\n"
        for line in t.splitlines()),
    "no end": lambda t, r: t.rstrip("\n"),
}


def text_of(vertices, faces, number, corner, extra, order):
    with_vt = corner not in ("v", "v//n", "back", "no vt")
    head = "vt 0 0\nvt 1 .5\n" if with_vt else ""
    head += "vn 0 0 1\n" if corner not in ("v", "back") else ""
    points = "".join("v " + " ".join(NUMBERS[number](float(x)) for x in v) + EXTRAS[extra] + "\n" for v in vertices)
    polygons = "".join(
        "f " + " ".join(CORNERS[corner](v, len(vertices), 2) for v in face) + "\n" for face in faces)
    if order == "faces first" and corner in ("v", "v/t", "v//n", "v/t/n"):
        return head + polygons + points
    return head + points + polygons


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("voxelize", type=pathlib.Path)
    parser.add_argument("--every", type=int, default=1)
    options = parser.parse_args()
    number_of_files, wrong = 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for number, (what, vertices, faces) in enumerate(meshes()):
            plain = folder / "plain.obj"
            plain.write_text(text_of(vertices, faces, "repr", "v", "", "vertices first"))
            mesh = trimesh.load(plain, process=False, force="mesh")
            if what != "concave":  # trimesh cuts that into a fan
                mesh.export(folder / "plain.stl")
            reference = folder / ("plain.obj" if what == "concave" else "plain.stl")
            right, err = voxels(options.voxelize, reference, folder)
            if right is None:
                sys.exit(f"{reference}: {err}")
            layouts = itertools.product(NUMBERS, CORNERS, EXTRAS, LINES, ("vertices first", "faces first"))
            for i, layout in enumerate(layouts):
                # Of 2800 layouts each mesh has some 350 at --every 1.
                if random.Random(4 * i + number).randrange(8 * options.every) != 0:
                    continue
                *how, lines, order = layout
                text = LINES[lines](text_of(vertices, faces, *how, order), random.Random(i))
                model = folder / "m.obj"
                model.write_bytes(text.encode())
                found, err = voxels(options.voxelize, model, folder)
                number_of_files += 1
                if found is None or not numpy.array_equal(found != 0, right != 0) or err:
                    wrong += 1
                    print(f"{what}, {layout}: {err or 'other voxels'}")
    print(f"{number_of_files} files, {wrong} wrong")
    if number_of_files == 0 or wrong:
        sys.exit(1)


if __name__ == "__main__":
    main()
