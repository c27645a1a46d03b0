# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the OBJ, PLY, STL and OFF files of assimp's test models (Debian's package assimp-testmodels) by the tool's
readers, loaded and streamed, and by trimesh, and compares their triangles: number, bounds, area, and the corners of
each; where there are none, the points. Every difference has to be one of those below, and each of them has to be there.

usage: test_models.py DUMP_MODELS [--models FOLDER] [--every N]     each N-th file
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy
    import trimesh
except ImportError as missing:
    print(f"not run: {missing}")
    sys.exit(77)

# What differs, by file: how the difference begins, and why.
DIFFERENCES = {
    "OBJ/box_UTF16BE.obj": ("tool: the file is text in UTF-16, not UTF-8", "trimesh guesses the encoding"),
    "OBJ/concave_polygon.obj": ("area 0.245497, trimesh has 3.22474", "trimesh cuts a concave polygon as a fan"),
    "OBJ/number_formats.obj": ("tool: line 11: 'v 1e+2 2.e+1 3.1+e2' has a coordinate that is no number; 9 of the file's"
                               " 15 vertices can be read", "trimesh drops the line, whose last word is no number"),
    "OBJ/space_in_material_name.obj": ("area 0.245497, trimesh has 3.22474", "the same concave polygon"),
    "OFF/invalid.off": ("neither: line 7: face 1 names a vertex 20, and 0 to 2 were expected", "trimesh has no faces"),
    "PLY/pond.0.ply": ("neither: the header promises 70051 vertices, and the file has 70048", "trimesh has an error, too"),
    "invalid/OutOfMemory.off": ("neither: the header promises more vertices or faces than can be numbered", ""),
    "invalid/empty.obj": ("neither: the file is empty", ""),
    "invalid/empty.off": ("neither: the file is empty", ""),
    "invalid/empty.ply": ("neither: the file is empty", ""),
    "invalid/malformed.obj": ("neither: line 23: 'f 4 12 2 1' has an invalid vertex index: there are 8 vertices; the file "
                              "has 6 lines 'f', and 4 of them can be read", "trimesh has an error, too"),
    "invalid/malformed2.obj": ("tool: line 23: 'f' names 0 vertices, and a face has 3 or more; the file has 6 lines 'f',"
                               " and 5 of them can be read", "trimesh passes over the face"),
}


def read_by_trimesh(file):
    """The triangles' corners, (n, 3, 3), or points, (n, 3), or why there are none."""
    try:
        loaded = trimesh.load(file, process=False)
        parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
        if all(isinstance(part, trimesh.PointCloud) for part in parts):
            return numpy.concatenate([numpy.asarray(part.vertices, dtype=float) for part in parts])
        parts = [part for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]
        if not parts:
            return f"no triangles, but {type(loaded).__name__}"
        return numpy.concatenate([numpy.asarray(part.vertices)[part.faces] for part in parts])
    except Exception as error:  # whatever it throws
        return f"{type(error).__name__}: {error}"[:100]


def read_by_tool(program, names):
    """By name: the triangles' corners, or without any the points, or the message."""
    done = subprocess.run([program], input="".join(n + "\n" for n in names), capture_output=True, text=True, check=True)
    found, current = {}, None
    for line in done.stdout.splitlines():
        word, _, rest = line.partition(" ")
        if word == "file":
            current = found.setdefault(rest.removeprefix("stream "), [])
        elif word == "t":
            current.append([float(x) for x in rest.split()[:9]])
        elif word == "l":
            ends = [float(x) for x in rest.split()]
            current.append(tuple(ends[:3]) if ends[:3] == ends[3:] else tuple(ends))
        elif word in ("error", "refused"):
            current.append(rest)
    made = {}
    for name, lines in found.items():
        texts = [line for line in lines if isinstance(line, str)]
        points = {end for line in lines if isinstance(line, tuple) for end in (line[:3], line[-3:])}
        corners = [line for line in lines if isinstance(line, list)]
        if texts:
            made[name] = texts[0]
        elif corners or not points:
            made[name] = numpy.array(corners, dtype=float).reshape(-1, 3, 3)
        else:
            made[name] = numpy.array(sorted(points), dtype=float)
    return made


def area_of(triangles):
    return numpy.linalg.norm(numpy.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]),
                             axis=1).sum() / 2


def sorted_corners(triangles):
    """Each triangle from its least corner on, and all in order: the same for the same surface."""
    rounded = numpy.round(triangles.astype(numpy.float32).astype(float), 4)
    turned = []
    for t in rounded.tolist():
        first = t.index(min(t))
        turned.append(t[first:] + t[:first])
    return sorted(turned)


def difference(ours, theirs):
    """In words; empty where the two are one."""
    if isinstance(ours, str) or isinstance(theirs, str):
        if isinstance(ours, str) and isinstance(theirs, str):
            return f"neither: {ours}"
        return f"tool: {ours}" if isinstance(ours, str) else f"trimesh: {theirs}"
    if ours.ndim == 2 or theirs.ndim == 2:
        if ours.ndim != theirs.ndim:
            return "one has points, the other triangles"
        a, b = sorted(set(map(tuple, ours.tolist()))), sorted(set(map(tuple, theirs.tolist())))
        return "" if len(a) == len(b) and numpy.allclose(a, b) else f"{len(a)} points, trimesh has {len(b)}"
    if len(ours) != len(theirs):
        return f"{len(ours)} triangles, trimesh has {len(theirs)}"
    if len(ours) == 0:
        return ""
    for name, of in (("low corner", numpy.min), ("high corner", numpy.max)):
        a, b = of(ours, axis=(0, 1)), of(theirs, axis=(0, 1))
        if not numpy.allclose(a, b, rtol=1e-6, atol=1e-5):
            return f"{name} {a.tolist()}, trimesh has {b.tolist()}"
    if not numpy.isclose(area_of(ours), area_of(theirs), rtol=1e-5):
        return f"area {area_of(ours):.6g}, trimesh has {area_of(theirs):.6g}"
    if sorted_corners(ours) != sorted_corners(theirs):
        return "other triangles of the same area"
    return ""


def main():
    options = argparse.ArgumentParser()
    options.add_argument("program")
    options.add_argument("--models", default="/usr/share/assimp/models")
    options.add_argument("--every", type=int, default=1)
    how = options.parse_args()
    folder = pathlib.Path(how.models)
    files = sorted(f for f in folder.rglob("*") if f.suffix.lower() in (".obj", ".ply", ".stl", ".off"))
    if not files:
        print(f"not run: no models in {folder} (Debian: assimp-testmodels)")
        return 77
    files = files[how.every // 2::how.every]
    with tempfile.TemporaryDirectory() as scratch:
        # A stream keeps temporary files beside the model.
        links = pathlib.Path(scratch) / "models"
        subprocess.run(["cp", "-r", "--no-preserve=mode", str(folder), str(links)], check=True)
        local = {f: links / f.relative_to(folder) for f in files}
        ours = read_by_tool(how.program, [str(local[f]) for f in files])
        streamed = read_by_tool(how.program, ["stream " + str(local[f]) for f in files])
        wrong = 0
        for f in files:
            name = str(f.relative_to(folder))
            loaded, stream = ours[str(local[f])], streamed[str(local[f])]
            found = difference(loaded, read_by_trimesh(f))
            expected = DIFFERENCES.get(name, ("", ""))[0]
            if not (found.startswith(expected) if expected else found == ""):
                wrong += 1
                print(f"{name}: {found or 'as trimesh reads it'}; expected: {expected or 'no difference'}")
            if isinstance(stream, str) or isinstance(loaded, str) or loaded.ndim == 2:
                continue  # lines and points are not streamed
            if sorted_corners(loaded) != sorted_corners(stream):
                wrong += 1
                print(f"{name}: {len(loaded)} triangles loaded, {len(stream)} streamed, or others")
    print(f"{len(files)} files, {wrong} unexpected")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
