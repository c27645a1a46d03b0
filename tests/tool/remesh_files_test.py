# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Files of --remesh by readers that share nothing with the tool. Argument: the tool.

The colours of a .3mf, by zipfile and XML, are those of the .ply, at every corner of every triangle; so they are by lib3mf,
where that is installed. trimesh and manifold3d, where installed, call the meshes of bad models watertight, consistent and
manifold.
"""
import importlib.util
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
import zipfile

tool = sys.argv[1]
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
MATERIAL = "{http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"


def is_installed(name):
    return importlib.util.find_spec(name) is not None


def box(low, size, color):
    """Vertices with colours, and triangles."""
    corners = [[low[a] + size[a] * (i >> a & 1) for a in range(3)] for i in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    colors = [[color[a] * (0.25 + 0.75 * (i >> a & 1)) for a in range(3)] for i in range(8)]
    return [(*p, *c) for p, c in zip(corners, colors)], [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def bad_model(seed):
    """Boxes that cross, some thin, with triangles deleted, flipped and doubled."""
    dice = random.Random(seed)
    vertices, triangles = [], []
    for _ in range(dice.randint(1, 4)):
        size = [dice.uniform(0.1, 0.6) for _ in range(3)]
        if dice.random() < 0.3:
            size[dice.randrange(3)] = dice.choice((0.0, 0.02))
        more, faces = box([dice.uniform(0.0, 0.4) for _ in range(3)], size, [dice.random() for _ in range(3)])
        triangles += [[i + len(vertices) for i in t] for t in faces]
        vertices += more
    for _ in range(dice.randint(0, 6)):
        k = dice.randrange(len(triangles))
        what = dice.randrange(3)
        if what == 0 and len(triangles) > 4:
            del triangles[k]
        elif what == 1:
            triangles[k] = triangles[k][::-1]
        else:
            triangles.append(list(triangles[k]))
    return vertices, triangles


def write_obj(path, vertices, triangles):
    lines = ["v " + " ".join(f"{x:.6f}" for x in v) for v in vertices] + ["f " + " ".join(str(i + 1) for i in t) for t in triangles]
    path.write_text("\n".join(lines) + "\n")


def read_ply(path):
    """Positions, colours and triangles of a .ply with colours."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    counts = {words[1]: int(words[2]) for words in (line.split() for line in head.decode().splitlines()) if words[0] == "element"}
    rows = [struct.unpack_from("<3d3f3B", body, 39 * v) for v in range(counts["vertex"])]
    at = 39 * counts["vertex"]
    faces = [struct.unpack_from("<B3I", body, at + 13 * f) for f in range(counts["face"])]
    assert len(body) == at + 13 * counts["face"] and all(f[0] == 3 for f in faces)
    return [r[:3] for r in rows], [r[6:] for r in rows], [f[1:] for f in faces]


def read_3mf(path):
    """The same of a .3mf, with three colours a triangle."""
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        root = xml.etree.ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    groups = {
        g.get("id"): [tuple(bytes.fromhex(c.get("color")[1:7])) for c in g.findall(MATERIAL + "color")]
        for g in root.iter(MATERIAL + "colorgroup")
    }
    (mesh,) = root.iter(CORE + "mesh")
    points = [tuple(float(v.get(a)) for a in "xyz") for v in mesh.iter(CORE + "vertex")]
    faces, colors = [], []
    for t in mesh.iter(CORE + "triangle"):
        faces.append(tuple(int(t.get(f"v{k}")) for k in (1, 2, 3)))
        colors.append([groups[t.get("pid")][int(t.get(f"p{k}"))] for k in (1, 2, 3)])
    return points, faces, colors


def check_colors(folder, seed):
    points, colors, faces = read_ply(folder / "o.ply")
    assert len(set(colors)) > 20, f"model {seed} has {len(set(colors))} colours"
    of_file, faces_of_file, corners = read_3mf(folder / "o.3mf")
    assert of_file == [tuple(p) for p in points], "positions"
    assert faces_of_file == [tuple(f) for f in faces], "triangles"
    assert corners == [[colors[v] for v in f] for f in faces], "colours"
    if not is_installed("lib3mf"):
        return
    import lib3mf

    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(folder / "o.3mf"))
    assert reader.GetWarningCount() == 0
    objects, groups = model.GetMeshObjects(), model.GetColorGroups()
    assert objects.MoveNext() and groups.MoveNext()
    mesh, group = objects.GetCurrentMeshObject(), groups.GetCurrentColorGroup()
    table = {n: group.GetColor(n) for n in group.GetAllPropertyIDs()}
    read = [[(table[n].Red, table[n].Green, table[n].Blue) for n in t.PropertyIDs] for t in mesh.GetAllTriangleProperties()]
    assert read == corners, "colours by lib3mf"
    assert mesh.IsManifoldAndOriented(), "lib3mf calls it no manifold"


def check_mesh(folder, what):
    points, _, faces = read_ply(folder / "o.ply")
    edges = [(f[k], f[(k + 1) % 3]) for f in faces for k in range(3)]
    assert len(set(edges)) == len(edges) and {(b, a) for a, b in edges} == set(edges), f"{what}: edges"
    if is_installed("trimesh"):
        import trimesh

        mesh = trimesh.Trimesh(points, faces, process=False)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, f"{what}: trimesh"
    if is_installed("manifold3d"):
        import manifold3d
        import numpy as np

        mesh = manifold3d.Mesh64(np.array(points, np.float64), np.array(faces, np.uint64))
        assert manifold3d.Manifold(mesh).status() == manifold3d.Error.NoError, f"{what}: manifold3d"


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    meshes = 0
    for seed in range(12):
        write_obj(folder / "m.obj", *bad_model(seed))
        for sign in ([], ["--close-holes"], ["--solid", "exterior", "--closing", "1"], ["--vote"], ["--winding"]):
            place = ("corner", "mean", "sharp")[meshes % 3]
            outputs = [str(folder / "o.ply"), "-o", str(folder / "o.3mf")]
            command = [tool, str(folder / "m.obj"), "--remesh", "-r", "24", "--place", place, *sign, "-q", "-o", *outputs]
            subprocess.run(command, check=True)
            if b"element face 0\n" in (folder / "o.ply").read_bytes():
                continue
            meshes += 1
            check_mesh(folder, f"model {seed}, {sign}, {place}")
            check_colors(folder, seed)
    assert meshes > 30, meshes
    judges = [m for m in ("lib3mf", "trimesh", "manifold3d") if is_installed(m)]
    print(f"{meshes} meshes, judged by zipfile and XML" + "".join(f", {m}" for m in judges))
