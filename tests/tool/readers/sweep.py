# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Writes hundreds of files of one format, every layout by every encoding by every order, and compares what the tool's
reader makes of each, loaded and streamed, with what another reader makes of it: plyfile for PLY, trimesh for STL, meshio
for OFF without colours and trimesh for OFF with.

usage: sweep.py ply|stl|off DUMP_MODELS [--every N]     each N-th file
       sweep.py --have-modules                          exit code 0 when the readers are installed
"""

import importlib.util
import io
import itertools
import pathlib
import subprocess
import sys
import tempfile
import zlib

MODULES = ["numpy", "plyfile", "meshio", "trimesh"]
FACES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7, 5)]
CORNERS = [(i & 1, i >> 1 & 1, i >> 2 & 1) for i in range(8)]
SIZE = (2.0, 3.5, 0.75)
COLOURS = [(255, 128, 0), (1, 2, 3), (0, 0, 0), (200, 100, 50), (17, 255, 33), (64, 64, 64), (255, 255, 255), (9, 250, 99)]


def positions(shift=(0.0, 0.0, 0.0)):
    return [tuple(c * s + d for c, s, d in zip(corner, SIZE, shift)) for corner in CORNERS]


# ---- PLY -------------------------------------------------------------------------------------------------------------

TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
NAMES = {"char": "int8", "uchar": "uint8", "short": "int16", "ushort": "uint16", "int": "int32", "uint": "uint32",
         "float": "float32", "double": "float64"}


def encoded(encoding, type_name, values):
    import struct
    if encoding == "ascii":
        return " ".join(repr(v) if isinstance(v, float) else str(v) for v in values).encode() + b" "
    return struct.pack(("<" if encoding == "binary_little_endian" else ">") + str(len(values)) + TYPES[type_name], *values)


def ply_files():
    orders = list(itertools.permutations(["vertex", "face", "extra"]))
    encodings = ["ascii", "binary_little_endian", "binary_big_endian"]
    lists = [(a, b) for a in ("uchar", "ushort", "int", "uint", "char", "short") for b in ("int", "uint", "uchar", "short")]
    colours = [None, ("uchar", "vertex"), ("float", "vertex"), ("uchar", "face"), ("double", "face")]
    number = 0
    for order, encoding, (length, index), colour in itertools.product(orders, encodings, lists, colours):
        number += 1
        axis = ["float", "double", "int"][number % 3]
        names = NAMES if number % 2 else {t: t for t in TYPES}
        end = [b"\n", b"\r\n"][number % 5 == 0]
        shift = (431234.0, 4649776.0, 100.0) if axis == "double" and number % 4 == 0 else (0.0, 0.0, 0.0)
        header = [b"ply", b"format " + encoding.encode() + b" 1.0", b"comment a"]
        bodies = []
        for element in order:
            if element == "vertex":
                props, body = [(axis, a) for a in "xyz"], []
                if number % 3 == 1:
                    props.insert(number % 4, ("short", "quality"))
                if colour and colour[1] == "vertex":
                    props[number % 2 * 3:number % 2 * 3] = [(colour[0], c) for c in ("red", "green", "blue")]
                for i, p in enumerate(positions(shift)):
                    for type_name, name in props:
                        value = 7 if name == "quality" else p["xyz".index(name)] if name in "xyz" else \
                            COLOURS[i][("red", "green", "blue").index(name)]
                        if name in ("red", "green", "blue") and type_name == "float":
                            value = value / 255
                        value = float(value) if type_name in ("float", "double") else int(value)
                        body.append(encoded(encoding, type_name, [value]))
                    body.append(end if encoding == "ascii" else b"")
                header.append(b"element vertex 8")
                header += [f"property {names[t]} {n}".encode() for t, n in props]
            elif element == "face":
                header.append(f"element face {len(FACES)}".encode())
                name = ["vertex_indices", "vertex_index"][number % 2]
                header.append(f"property list {names[length]} {names[index]} {name}".encode())
                body, own = [], colour and colour[1] == "face"
                if own:
                    header += [f"property {names[colour[0]]} {c}".encode() for c in ("red", "green", "blue")]
                for i, f in enumerate(FACES):
                    body += [encoded(encoding, length, [len(f)]), encoded(encoding, index, list(f))]
                    if own:
                        values = [v if colour[0] == "uchar" else v / 255 for v in COLOURS[i]]
                        body.append(encoded(encoding, colour[0], values))
                    body.append(end if encoding == "ascii" else b"")
            else:
                header += [b"element extra 2", f"property {names['double']} a".encode(),
                           f"property list {names['uchar']} {names['short']} b".encode()]
                body = []
                for values in ([1, 2, 3], []):
                    body += [encoded(encoding, "double", [0.5]), encoded(encoding, "uchar", [len(values)])]
                    body += [encoded(encoding, "short", values) if values else b"", end if encoding == "ascii" else b""]
            bodies += body
        header.append(b"end_header")
        yield end.join(header) + end + b"".join(bodies)


def ply_expected(path):
    import plyfile
    data = plyfile.PlyData.read(str(path))
    vertex, face = data["vertex"], data["face"]

    def colours(element):
        if "red" not in element.data.dtype.names:
            return None
        return [tuple(round(255 * float(v)) if element[c].dtype.kind == "f" else int(v)
                      for c, v in zip(("red", "green", "blue"), row))
                for row in zip(element["red"], element["green"], element["blue"])]

    of_vertices, of_faces = colours(vertex), colours(face)
    places = [tuple(float(v) for v in row) for row in zip(vertex["x"], vertex["y"], vertex["z"])]
    name = next(n for n in face.data.dtype.names if n.startswith("vertex_ind"))
    triangles = []
    for i, indices in enumerate(face[name]):
        for k in range(2, len(indices)):
            corner = [int(indices[0]), int(indices[k - 1]), int(indices[k])]
            shown = [of_faces[i] if of_faces else of_vertices[c] if of_vertices else (255, 255, 255) for c in corner]
            triangles.append(([places[c] for c in corner], shown))
    return triangles


# ---- STL -------------------------------------------------------------------------------------------------------------


def stl_triangles(shift):
    places = positions(shift)
    return [[places[f[0]], places[f[k - 1]], places[f[k]]] for f in FACES for k in range(2, len(f))]


def stl_files():
    import struct
    shifts = [(0.0, 0.0, 0.0), (-1000.5, 2.25, 7.125)]
    headers = [b"", b"solid binary", b"a" * 80, b"VisCAM"]
    for shift, header, normal, rest in itertools.product(shifts, headers, ((0, 0, 1), (float("nan"),) * 3), range(2)):
        body = b"".join(struct.pack("<12fH", *normal, *(v for p in t for v in p), 7) for t in stl_triangles(shift))
        yield header.ljust(80, b" ") + struct.pack("<I", len(stl_triangles(shift))) + body
    starts = ["solid a\n", "solid\n", " \n solid name of it\n"]
    ends = ["\n", "\r\n", "\n\n", " \n\t"]
    for shift, start, end, upper, digits, blank in itertools.product(shifts, starts, ends, range(2),
                                                                     ("%r", "%.9e", "%+.6f"), (" ", "\t ")):
        text = start
        for t in stl_triangles(shift):
            text += "facet normal 0 0 1" + end + "outer loop" + end
            for p in t:
                text += "vertex" + "".join(blank + digits % v for v in p) + end
            text += "endloop" + end + "endfacet" + end
        text += "endsolid" + end
        yield (text.upper() if upper else text).encode()


def stl_expected(path):
    import struct
    import trimesh
    data = path.read_bytes()
    if len(data) > 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        loaded = trimesh.exchange.stl.load_stl_binary(path.open("rb"))
    else:
        # It knows lower case and one way to begin.
        text = data.decode().lower().strip()
        loaded = trimesh.exchange.stl.load_stl_ascii(io.StringIO(text))
        loaded = next(iter(loaded["geometry"].values())) if "geometry" in loaded else loaded
    return [([tuple(float(v) for v in loaded["vertices"][i]) for i in face], [(255, 255, 255)] * 3)
            for face in loaded["faces"]]


# ---- OFF -------------------------------------------------------------------------------------------------------------


def off_files():
    heads = ["OFF\n8 {n} 0\n", "OFF 8 {n} 0\n", "# first\nOFF\n# second\n8 {n} 18\n", "OFF\n\n8 {n} 0 # third\n"]
    ends = ["\n", "\r\n", " \n", "\n\n"]
    numbers = ["%r", "%.7f", "%.14e", "%+r"]
    colours = [None, "vertex 3", "vertex 4", "face 3", "face 4", "face float"]
    shifts = [(0.0, 0.0, 0.0), (431234.0, 4649776.0, 100.0)]
    for head, end, digits, colour, shift in itertools.product(heads, ends, numbers, colours, shifts):
        text = head.format(n=len(FACES))
        if colour and colour.startswith("vertex"):
            text = text.replace("OFF", "COFF", 1)
        for i, p in enumerate(positions(shift)):
            text += " ".join(("%+.6f" if digits == "%+r" else digits) % v for v in p)
            if colour and colour.startswith("vertex"):
                text += "".join(f" {c}" for c in COLOURS[i]) + (" 255" if colour.endswith("4") else "")
            text += end
        for i, f in enumerate(FACES):
            text += f"{len(f)} " + " ".join(map(str, f))
            if colour == "face float":
                text += "".join(f" {c / 255:.5f}" for c in COLOURS[i])
            elif colour and colour.startswith("face"):
                text += "".join(f" {c}" for c in COLOURS[i]) + (" 255" if colour.endswith("4") else "")
            text += end
        yield text.encode()


def off_expected(path):
    """Positions as meshio and trimesh have them; colours as they stand in the lines, which neither reads."""
    import trimesh
    lines = [w for line in path.read_text().splitlines() if (w := line.split("#")[0].split())]
    has_vertex_colours = lines[0][0] == "COFF"
    if all(len(line) == 4 for line in lines[10 if len(lines[0]) == 1 else 9:]) and not has_vertex_colours:
        import meshio
        mesh = meshio.read(path)
        places, faces = mesh.points, [tuple(f) for f in mesh.cells[0].data]
    else:
        # It knows no comments, no counts behind the word and no colours: it gets the numbers alone.
        rest = lines[1:] if len(lines[0]) > 1 else lines[2:]
        plain = [["OFF"], ["8", str(len(rest) - 8), "0"]] + [line[:3] for line in rest[:8]]
        plain += [line[:int(line[0]) + 1] for line in rest[8:]]
        text = "".join(" ".join(line) + "\n" for line in plain)
        mesh = trimesh.load(io.BytesIO(text.encode()), file_type="off", process=False)
        places, faces = mesh.vertices, None
    body = lines[1:] if len(lines[0]) > 1 else lines[2:]
    of_vertex, triangles = [], []
    for line in body[:8]:
        of_vertex.append(tuple(int(v) for v in line[3:6]) if has_vertex_colours else None)
    for line in body[8:]:
        n = int(line[0])
        corners = [int(v) for v in line[1:n + 1]]
        own = line[n + 1:n + 4]
        if own:
            own = tuple(round(255 * float(v)) if "." in v else int(v) for v in own)
        for k in range(2, n):
            corner = (corners[0], corners[k - 1], corners[k])
            shown = [own or of_vertex[c] or (255, 255, 255) for c in corner]
            triangles.append(([tuple(float(v) for v in places[c]) for c in corner], shown))
    assert faces is None or len(faces) == len(triangles)
    assert faces is not None or len(mesh.faces) == len(triangles), "trimesh has another number of triangles"
    return triangles


# ---- Comparison ------------------------------------------------------------------------------------------------------


def parse(output):
    models, current = [], None
    for line in output.splitlines():
        words = line.split()
        if words[0] == "file":
            current = {"triangles": [], "other": []}
            models.append(current)
        elif words[0] == "t":
            numbers = [float(w) for w in words[1:10]]
            bytes_ = [int(w) for w in words[10:]]
            current["triangles"].append(([tuple(numbers[i:i + 3]) for i in (0, 3, 6)],
                                         [tuple(bytes_[i:i + 3]) for i in (0, 3, 6)]))
        else:
            current["other"].append(line)
    return models


def difference(expected, found, tolerance):
    if found["other"]:
        return found["other"][0]
    if len(expected) != len(found["triangles"]):
        return f"{len(expected)} triangles, and {len(found['triangles'])} were read"
    for i, (wanted, got) in enumerate(zip(expected, found["triangles"])):
        if any(abs(a - b) > tolerance for p, q in zip(wanted[0], got[0]) for a, b in zip(p, q)):
            return f"triangle {i} is at {wanted[0]}, and was read at {got[0]}"
        if wanted[1] != got[1]:
            return f"triangle {i} has colours {wanted[1]}, and {got[1]} were read"
    return None


def main():
    if sys.argv[1:] == ["--have-modules"]:
        return 0 if all(importlib.util.find_spec(m) for m in MODULES) else 1
    kind, dump = sys.argv[1], sys.argv[2]
    every = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    expected_of = {"ply": ply_expected, "stl": stl_expected, "off": off_expected}[kind]
    files = {"ply": ply_files, "stl": stl_files, "off": off_files}[kind]()
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for number, data in enumerate(files):
            # Without regard to the sides of the product, so that each of their values comes up.
            if zlib.crc32(str(number).encode()) % every:
                continue
            paths.append(pathlib.Path(folder) / f"{number}.{kind}")
            paths[-1].write_bytes(data)
        names = "".join(f"{p}\nstream {p}\n" for p in paths)
        output = subprocess.run([dump], input=names, capture_output=True, text=True, check=True).stdout
        models = parse(output)
        assert len(models) == 2 * len(paths), f"{len(models)} of {2 * len(paths)} files"
        failures = 0
        for i, path in enumerate(paths):
            expected = expected_of(path)
            for how, found in (("loaded", models[2 * i]), ("streamed", models[2 * i + 1])):
                # Floats of the model's size, wherever it lies; trimesh has floats of an STL's distance.
                what = difference(expected, found, 1e-3 if kind == "stl" else 1e-6)
                if what:
                    failures += 1
                    if failures <= 10:
                        print(f"{path.name} {how}: {what}")
        print(f"{kind}: {len(paths)} files, {failures} failures")
        return 1 if failures or len(paths) < 10 else 0


if __name__ == "__main__":
    sys.exit(main())
