#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The C API used by ctypes: every error has its code and its message and leaves what was there, memory that runs out among them;
arrays with strides; several threads at once; and the library exports what the header declares, and nothing else.

    capi_test.py LIBRARY HEADER [cuda]   needs the standard library, and nm of binutils for the exports; with `cuda` calls run on
                                         the GPU, and it ends with 77 where there is no device
"""
import ctypes as c
import re
import resource
import shutil
import subprocess
import sys
import threading
import unittest

LIBRARY, HEADER = sys.argv[1:3]
BACKEND = 1 if sys.argv[3:] == ["cuda"] else 0
vp = c.CDLL(LIBRARY)
vp.vp_last_message.restype = vp.vp_code_name.restype = vp.vp_version.restype = c.c_char_p

with open(HEADER, encoding="utf-8") as header:
    TEXT = re.sub(r"/\*.*?\*/", "", header.read(), flags=re.S)
DECLARED = set(re.findall(r"VP_API [\w* ]*?(vp_\w+)\(", TEXT))
# The enumerators, with the names that the header gives them.
CODES = {name: int(value) for name, value in re.findall(r"\b(VP_[A-Z0-9_]+) = (\d+)", TEXT)}
TYPES = {
    "uint32_t": c.c_uint32, "int32_t": c.c_int32, "uint64_t": c.c_uint64, "double": c.c_double, "pointer": c.c_void_p,
}


def structure(name):
    """The structure as the header declares it."""
    body = re.search(r"typedef struct " + name + r" \{(.*?)\} " + name + ";", TEXT, flags=re.S)[1]
    fields = []
    for declaration in filter(None, (line.strip() for line in body.split(";"))):
        base, names = re.fullmatch(r"((?:const )?\w+\*?) (.*)", declaration, flags=re.S).groups()
        kind = TYPES["pointer" if base.endswith("*") else base]
        for member in names.split(","):
            array = re.fullmatch(r"\s*(\w+)\[(\d)\]", member)
            fields.append((array[1], kind * int(array[2])) if array else (member.strip(), kind))
    made = type(name, (c.Structure,), {"_fields_": fields})
    return lambda **members: made(struct_size=c.sizeof(made), **members)


MeshDesc, Grid, Array, Counters, SurfaceOptions, SolidOptions, Rows, DistanceOptions, FractionOptions, LinkOptions = map(
    structure,
    "vp_mesh_desc vp_grid vp_array vp_counters vp_surface_options vp_solid_options vp_rows vp_distance_options "
    "vp_fraction_options vp_link_options".split(),
)

LOW, HIGH = 0.75, 3.25  # a cube among 4 x 4 x 4 voxels of size 1: capi_test.c has what it gives
CORNERS = [HIGH if i >> a & 1 else LOW for i in range(8) for a in range(3)]
FACES = [0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5]
SEEN = set()
ABI = int(re.search(r"#define VP_ABI_VERSION (\d+)u", TEXT)[1])


def has_cuda():
    """True if the library was built with CUDA, whether there is a device or not."""
    other = c.c_void_p()
    vp.vp_context_create(ABI, CODES["VP_BACKEND_CUDA"], 1, c.byref(other))
    has = b"without" not in vp.vp_last_message()
    vp.vp_context_destroy(other)
    return has


HAS_CUDA = has_cuda()


def mesh_desc(positions=CORNERS, faces=FACES, index=c.c_uint32, **members):
    positions, faces = (c.c_float * len(positions))(*positions), (index * len(faces))(*faces)
    desc = MeshDesc(positions=c.cast(positions, c.c_void_p), num_vertices=len(positions) // 3, triangles=c.cast(faces, c.c_void_p),
                    num_triangles=len(faces) // 3, index_bytes=c.sizeof(index))
    desc.kept = positions, faces
    for name, value in members.items():
        setattr(desc, name, value)
    return desc


def unit_grid(n=4, **members):
    return Grid(**{"voxel_size": (1, 1, 1), "extent": (n, n, n), **members})


def array(kind, elements, **members):
    ctype = [c.c_uint8, c.c_uint32, c.c_float, c.c_int64][kind]
    memory = (ctype * elements)()
    made = Array(type=kind, data=c.cast(memory, c.c_void_p), size=c.sizeof(memory))
    made.kept = memory
    for name, value in members.items():
        setattr(made, name, value)
    return made


class Api(unittest.TestCase):
    def setUp(self):
        self.context, self.cube = c.c_void_p(), c.c_void_p()
        self.ok(vp.vp_context_create(ABI, BACKEND, 2, c.byref(self.context)))
        self.ok(vp.vp_mesh_create(self.context, c.byref(mesh_desc()), c.byref(self.cube)))

    def tearDown(self):
        vp.vp_mesh_destroy(self.cube)
        vp.vp_context_destroy(self.context)

    def ok(self, result):
        self.assertEqual((result, vp.vp_last_message()), (0, b""))

    def fails(self, name, text, result):
        """The call failed with this code, and its message has this text."""
        message = vp.vp_last_message().decode()
        self.assertEqual(vp.vp_code_name(result).decode(), "VP_ERROR_" + name, message)
        self.assertIn(text, message)
        SEEN.add("VP_ERROR_" + name)

    def surface(self, out, grid=None, options=None, mesh=None, counters=None):
        by = lambda s: None if s is None else c.byref(s)
        return vp.vp_surface(self.context, mesh or self.cube, c.byref(grid or unit_grid()), by(options), by(out), by(counters))

    def test_null_and_wrong_handles(self):
        out, grid, other = array(0, 64), unit_grid(), c.c_void_p()
        for call in (vp.vp_surface, vp.vp_solid, vp.vp_fractions):
            self.fails("NULL_HANDLE", "context", call(None, self.cube, c.byref(grid), None, c.byref(out), None))
            self.fails("NULL_HANDLE", "mesh", call(self.context, None, c.byref(grid), None, c.byref(out), None))
            self.fails("WRONG_HANDLE", "context", call(self.cube, self.cube, c.byref(grid), None, c.byref(out), None))
            self.fails("WRONG_HANDLE", "mesh", call(self.context, self.context, c.byref(grid), None, c.byref(out), None))
            self.fails("NULL_POINTER", "grid", call(self.context, self.cube, None, None, c.byref(out), None))
            self.fails("NULL_POINTER", "out", call(self.context, self.cube, c.byref(grid), None, None, None))
        self.fails("NULL_HANDLE", "mesh", vp.vp_distance(self.context, None, c.byref(grid), None, c.byref(out), None, None))
        self.fails("NULL_HANDLE", "mesh", vp.vp_distance_at(self.context, None, c.byref(grid), None, None, c.c_uint64(0), c.c_uint64(0), None, None, None))
        for call in (vp.vp_surface_values, vp.vp_surface_list):
            self.fails("NULL_HANDLE", "context", call(None, self.cube, c.byref(grid), None, None, None, None, None))
        self.fails("NULL_HANDLE", "mesh", vp.vp_grid_fit_longest(None, c.c_uint64(4), c.byref(grid)))
        self.fails("NULL_HANDLE", "context", vp.vp_mesh_create(None, c.byref(mesh_desc()), c.byref(other)))
        self.fails("NULL_POINTER", "mesh", vp.vp_mesh_create(self.context, c.byref(mesh_desc()), None))
        self.fails("NULL_POINTER", "desc", vp.vp_mesh_create(self.context, None, c.byref(other)))
        self.fails("NULL_HANDLE", "list", vp.vp_list_size(None, c.byref(c.c_uint64()), None))
        self.fails("WRONG_HANDLE", "list", vp.vp_list_size(self.cube, c.byref(c.c_uint64()), None))
        self.fails("NULL_POINTER", "list", vp.vp_solid_list(self.context, self.cube, c.byref(grid), None, None, None))
        self.fails("NULL_HANDLE", "mesh", vp.vp_links_create(self.context, None, c.byref(grid), None, c.byref(other), None))
        self.fails("NULL_POINTER", "links", vp.vp_links_create(self.context, self.cube, c.byref(grid), None, None, None))
        self.fails("NULL_HANDLE", "links", vp.vp_links_size(None, c.byref(c.c_uint64()), None))
        self.fails("WRONG_HANDLE", "links", vp.vp_links_read(self.cube, c.c_uint64(0), c.c_uint64(0), None, None, None, None))
        self.assertFalse(other)
        for destroy in (vp.vp_mesh_destroy, vp.vp_list_destroy, vp.vp_links_destroy):
            destroy(self.context)  # another kind: left alone
        self.ok(self.surface(out))

    def test_versions_and_backends(self):
        other, out = c.c_void_p(), array(0, 64)
        self.fails("VERSION", "version 2 ", vp.vp_context_create(2, 0, 0, c.byref(other)))
        result = vp.vp_context_create(1, 1, 0, c.byref(other))
        if result == 0:
            vp.vp_context_destroy(other)
            other = c.c_void_p()
            SEEN.add("VP_ERROR_NO_BACKEND")
        else:
            self.fails("NO_BACKEND", "VP_BACKEND_CUDA", result)
        self.fails("BAD_OPTION", "backend", vp.vp_context_create(1, 7, 0, c.byref(other)))
        self.fails("BAD_OPTION", "threads", vp.vp_context_create(1, 0, 1 << 20, c.byref(other)))
        self.fails("NULL_POINTER", "context", vp.vp_context_create(1, 0, 0, None))
        for broken in (0, 4, 1 << 20):
            self.fails("VERSION", "grid: struct_size", self.surface(out, self.sized(unit_grid(), broken)))
            self.fails("VERSION", "options: struct_size", self.surface(out, options=self.sized(SurfaceOptions(), broken)))
            self.fails("VERSION", "out: struct_size", self.surface(self.sized(array(0, 64), broken)))
            self.fails("VERSION", "counters: struct_size", self.surface(out, counters=self.sized(Counters(), broken)))
            self.fails("VERSION", "desc: struct_size", vp.vp_mesh_create(self.context, c.byref(self.sized(mesh_desc(), broken)), c.byref(other)))
        self.fails("VERSION", "reserved", self.surface(out, unit_grid(reserved=1)))
        self.assertFalse(other)
        self.assertEqual(bytes(out.kept), bytes(64))

    @staticmethod
    def sized(s, size):
        s.struct_size = size
        return s

    def test_bad_meshes(self):
        other = c.c_void_p()

        def create(**members):
            return vp.vp_mesh_create(self.context, c.byref(mesh_desc(**members)), c.byref(other))

        for index in (c.c_uint16, c.c_uint32, c.c_uint64):
            self.fails("BAD_INDEX", "triangle 11 names vertex 8 of 8", create(faces=FACES[:-1] + [8], index=index))
        self.fails("BAD_INDEX", f"vertex {2**63}", create(faces=FACES[:-1] + [2**63], index=c.c_uint64))
        self.fails("BAD_OPTION", "index_bytes", create(index_bytes=3))
        self.fails("NULL_POINTER", "positions", self.without("positions"))
        self.fails("NULL_POINTER", "triangles", self.without("triangles"))
        self.fails("BAD_ARRAY", "position_stride", create(position_stride=8))
        self.fails("BAD_ARRAY", "triangle_stride", create(triangle_stride=2**63))
        self.fails("TOO_LARGE", "vertices", create(num_vertices=2**32 + 1))
        self.fails("TOO_LARGE", "triangles", create(num_triangles=2**32))
        for parts, text in (([1], "first_of_part[0]"), ([0, 9, 5], "first_of_part[2]"), ([0, 13], "first_of_part[1]")):
            memory = (c.c_uint64 * len(parts))(*parts)
            self.fails("BAD_OPTION", text, create(first_of_part=c.cast(memory, c.c_void_p), num_parts=len(parts)))
        self.fails("NULL_POINTER", "first_of_part", create(num_parts=2))
        self.assertFalse(other)

    def without(self, member):
        desc = mesh_desc()
        setattr(desc, member, None)
        return vp.vp_mesh_create(self.context, c.byref(desc), c.byref(c.c_void_p()))

    def test_bad_grids(self):
        out = array(0, 64)
        for members in ({"extent": (0, 4, 4)}, {"extent": (2**40, 4, 4)}, {"offset": (1, 0, 0)}, {"origin": (float("nan"), 0, 0)},
                        {"voxel_size": (0, 1, 1)}, {"voxel_size": (1, -1, 1)}, {"whole": (3, 4, 4)}, {"whole": (8, 0, 8)},
                        {"whole": (8, 8, 8), "offset": (5, 0, 0)}, {"offset": (2**63, 0, 0), "whole": (8, 8, 8)}):
            self.fails("BAD_GRID", "", self.surface(out, unit_grid(**members)))
        for extent in ((0, 4, 4), (2**50, 4, 4)):
            grid = unit_grid()
            self.fails("BAD_GRID", "", vp.vp_grid_fit(self.cube, (c.c_uint64 * 3)(*extent), c.byref(grid)))
            self.assertEqual(list(grid.extent), [4, 4, 4])
        self.fails("NULL_POINTER", "extent", vp.vp_grid_fit(self.cube, None, c.byref(unit_grid())))
        for size in (0.0, -1.0, float("nan"), 1e-300, float("inf")):
            self.fails("BAD_GRID", "", vp.vp_grid_fit_voxel_size(self.cube, (c.c_double * 3)(size, 1, 1), c.c_uint64(0), c.byref(unit_grid())))
        self.fails("BAD_GRID", "", vp.vp_grid_fit_longest(self.cube, c.c_uint64(0), c.byref(unit_grid())))
        self.fails("BAD_GRID", "", vp.vp_grid_fit_longest(self.cube, c.c_uint64(2**60), c.byref(unit_grid())))

    def test_bad_options(self):
        out, out_float = array(0, 64), array(2, 64)
        grid = c.byref(unit_grid())
        self.fails("BAD_OPTION", "coverage is 4", self.surface(out, options=SurfaceOptions(coverage=4)))
        for members, text in (({"fill": -1}, "fill"), ({"bodies": 2}, "bodies"), ({"extent": 3}, "extent"), ({"repair": 5}, "repair"),
                              ({"closing": 65}, "closing"), ({"repair": 3, "fill": 1}, "bad solid options"), ({"repair": 4, "fill": 1}, "bad solid options")):
            self.fails("BAD_OPTION", text, vp.vp_solid(self.context, self.cube, grid, c.byref(SolidOptions(**members)), c.byref(out), None))
        for members, text in (({"is_whole": 1, "band": 3.0}, "band"), ({"band": -1.0}, "distance options"), ({"band": float("nan")}, "distance options"),
                              ({"is_unsigned": 1, "fill": 1}, "distance options"), ({"repair": 9}, "repair")):
            self.fails("BAD_OPTION", text, vp.vp_distance(self.context, self.cube, grid, c.byref(DistanceOptions(**members)), c.byref(out_float), None, None))
        point = (c.c_float * 3)(1, 1, 1)
        self.fails("BAD_OPTION", "distance options", vp.vp_distance_at(self.context, self.cube, grid, c.byref(DistanceOptions(repair=2)), point, c.c_uint64(1), c.c_uint64(0), None, None, None))
        self.fails("BAD_ARRAY", "point_stride", vp.vp_distance_at(self.context, self.cube, grid, None, point, c.c_uint64(1), c.c_uint64(4), None, None, None))
        self.fails("NULL_POINTER", "points", vp.vp_distance_at(self.context, self.cube, grid, None, None, c.c_uint64(1), c.c_uint64(0), None, None, None))
        self.fails("BAD_OPTION", "axis is 3", vp.vp_fractions(self.context, self.cube, grid, c.byref(FractionOptions(axis=3)), c.byref(out_float), None))
        links, short = c.c_void_p(), LinkOptions()
        short.struct_size = 4
        for wrong in (6, 17, -1):
            self.fails("BAD_OPTION", f"neighbours is {wrong}, not 18 or 26", vp.vp_links_create(self.context, self.cube, grid, c.byref(LinkOptions(neighbours=wrong)), c.byref(links), None))
        self.fails("VERSION", "options", vp.vp_links_create(self.context, self.cube, grid, c.byref(short), c.byref(links), None))
        for wrong in (-1, 26):
            self.fails("BAD_OPTION", f"link is {wrong}", vp.vp_link_direction(wrong, (c.c_int32 * 3)()))
        self.fails("NULL_POINTER", "direction", vp.vp_link_direction(0, None))
        self.assertFalse(links)
        part = unit_grid(2, whole=(4, 4, 4))
        self.fails("BAD_OPTION", "crop", vp.vp_solid(self.context, self.cube, c.byref(part), c.byref(SolidOptions(repair=2)), c.byref(array(0, 8)), None))
        self.assertEqual(bytes(out.kept), bytes(64))

    def test_bad_rows(self):
        values, out = (c.c_float * 64)(), array(2, 64)
        rows = {"columns": 1, "values": c.cast(values, c.c_void_p), "num_rows": 8}
        for changed, name, text in (({"per": 2}, "BAD_OPTION", "per"), ({"blend": 5}, "BAD_OPTION", "blend"), ({"columns": 0}, "BAD_OPTION", "columns"),
                                    ({"columns": 2000}, "BAD_OPTION", "columns"), ({"num_rows": 7}, "BAD_ARRAY", "8 vertices"),
                                    ({"per": 1}, "BAD_ARRAY", "12 triangles"), ({"row_stride": 6}, "BAD_ARRAY", "row_stride"),
                                    ({"row_stride": 2**63}, "BAD_ARRAY", "row_stride"), ({"values": None}, "NULL_POINTER", "values"),
                                    ({"values": c.addressof(values) + 2}, "BAD_ARRAY", "aligned"), ({"columns": 8}, "BAD_ARRAY", "out")):
            made = Rows(**{**rows, **changed})
            self.fails(name, text, vp.vp_surface_values(self.context, self.cube, c.byref(unit_grid()), None, c.byref(made), None, c.byref(out), None))

    def test_bad_arrays(self):
        for out, text in ((array(0, 63), "size is 63"), (array(1, 15), "size is 60"), (array(2, 64), "type 2"), (array(0, 64, type=9), "type 9"),
                          (array(0, 64, stride=(1, 4, 2**62)), "beyond"), (array(0, 64, stride=(0, 4, 16)), "overlap"),
                          (array(0, 64, stride=(1, 3, 16)), "overlap"), (array(1, 64, stride=(4, 6, 64)), "no whole number"),
                          (array(1, 64, data=array(1, 64).data + 1), "aligned")):
            self.fails("BAD_ARRAY", text, self.surface(out))
        self.fails("NULL_POINTER", "out", self.surface(array(0, 64, data=None)))
        self.fails("BAD_ARRAY", "too few", self.surface(array(0, 64), unit_grid(2**20)))

    def test_strides(self):
        """Padded rows, reversed axes and planes of values hold what the packed array has, and nothing else is touched."""
        dense = array(0, 64)
        self.ok(self.surface(dense))
        for stride in ((1, 5, 23), (16, 4, 1), (3, 12, 48)):
            out = array(0, 200, stride=stride)
            c.memset(out.kept, 7, 200)
            self.ok(self.surface(out))
            places = {x * stride[0] + y * stride[1] + z * stride[2]: dense.kept[(z * 4 + y) * 4 + x] for x in range(4) for y in range(4) for z in range(4)}
            self.assertEqual([places.get(i, 7) for i in range(200)], list(out.kept))
        words, spaced = array(1, 16), array(1, 64, stride=(4, 8, 32))
        self.ok(self.surface(words))
        self.ok(self.surface(spaced))
        self.assertEqual(list(words.kept), [spaced.kept[8 * z + 2 * y] for z in range(4) for y in range(4)])
        # Positions within a structure, indices of 64 bits with a gap, and values in planes.
        positions = [v for i in range(8) for v in CORNERS[3 * i:3 * i + 3] + [1e30, 1e30]]
        faces = [v for i in range(12) for v in FACES[3 * i:3 * i + 3] + [99]]
        mesh = c.c_void_p()
        self.ok(vp.vp_mesh_create(self.context, c.byref(mesh_desc(positions, faces, c.c_uint64, num_vertices=8, num_triangles=12, position_stride=20, triangle_stride=32)), c.byref(mesh)))
        again = array(0, 64)
        self.ok(self.surface(again, mesh=mesh))
        self.assertEqual(bytes(again.kept), bytes(dense.kept))
        values = (c.c_float * 16)(*[v for i in range(8) for v in (1.0, CORNERS[3 * i])])
        rows = Rows(columns=2, values=c.cast(values, c.c_void_p), num_rows=8)
        packed, planes = array(2, 128), array(2, 128, stride=(4, 16, 64), value_stride=256)
        for out in (packed, planes):
            self.ok(vp.vp_surface_values(self.context, mesh, c.byref(unit_grid()), None, c.byref(rows), None, c.byref(out), None))
        self.assertEqual(list(planes.kept), [packed.kept[2 * i + value] for value in range(2) for i in range(64)])
        self.assertEqual(sum(planes.kept[:64]), 56)
        vp.vp_mesh_destroy(mesh)

    def test_lists(self):
        voxels = c.c_void_p()
        self.ok(vp.vp_surface_list(self.context, self.cube, c.byref(unit_grid()), None, None, c.byref(voxels), None))
        n, columns = c.c_uint64(), c.c_uint32(9)
        self.ok(vp.vp_list_size(voxels, c.byref(n), c.byref(columns)))
        self.assertEqual((n.value, columns.value), (56, 0))
        coordinates = (c.c_int32 * 168)()
        for first, count in ((0, 57), (57, 0), (56, 1), (2**63, 2**63), (1, 2**64 - 1)):
            self.fails("BAD_INDEX", "of a list of 56", vp.vp_list_read(voxels, c.c_uint64(first), c.c_uint64(count), coordinates, None))
        self.fails("BAD_OPTION", "no values", vp.vp_list_read(voxels, c.c_uint64(0), c.c_uint64(1), None, (c.c_float * 1)()))
        self.fails("NULL_POINTER", "voxels", vp.vp_list_size(voxels, None, None))
        self.ok(vp.vp_list_read(voxels, c.c_uint64(56), c.c_uint64(0), coordinates, None))
        self.assertEqual(sum(coordinates), 0)
        self.ok(vp.vp_list_read(voxels, c.c_uint64(0), n, coordinates, None))
        dense = array(0, 64)
        self.ok(self.surface(dense))
        listed = {tuple(coordinates[3 * i:3 * i + 3]) for i in range(56)}
        self.assertEqual(listed, {(i % 4, i // 4 % 4, i // 16) for i in range(64) if dense.kept[i]})
        vp.vp_list_destroy(voxels)

    def test_links(self):
        """A part of a grid has the links of the whole, and ranges are those of the whole list."""
        links, part, n, neighbours = c.c_void_p(), c.c_void_p(), c.c_uint64(), c.c_uint32()
        self.ok(vp.vp_links_create(self.context, self.cube, c.byref(unit_grid()), None, c.byref(links), None))
        self.ok(vp.vp_links_size(links, c.byref(n), c.byref(neighbours)))
        self.assertEqual((n.value, neighbours.value), (56, 18))  # all but the corners, beyond which only corners lie
        places, q, triangles, parts = (c.c_int32 * 168)(), (c.c_float * 1008)(), (c.c_int64 * 1008)(), (c.c_int32 * 1008)()
        for first, count in ((0, 57), (56, 1), (2**63, 2**63)):
            self.fails("BAD_INDEX", "of 56 with links", vp.vp_links_read(links, c.c_uint64(first), c.c_uint64(count), places, q, triangles, parts))
        self.assertEqual(sum(places), 0)
        self.ok(vp.vp_links_read(links, c.c_uint64(0), n, places, q, triangles, parts))
        rows = {tuple(places[3 * i:3 * i + 3]): (q[18 * i:18 * i + 18], triangles[18 * i:18 * i + 18]) for i in range(56)}
        self.assertEqual(sorted(rows, key=lambda p: p[::-1]), list(rows))
        self.assertEqual({t for of in rows.values() for t in of[1]}, set(range(-1, 12)))
        self.assertEqual([t == -1 for t in triangles], [p == -1 for p in parts])
        one = (c.c_float * 18)()
        self.ok(vp.vp_links_read(links, c.c_uint64(20), c.c_uint64(1), None, one, None, None))
        self.assertEqual(list(one), q[360:378])
        half = Grid(voxel_size=(1, 1, 1), extent=(4, 4, 2), offset=(0, 0, 2), whole=(4, 4, 4))
        self.ok(vp.vp_links_create(self.context, self.cube, c.byref(half), None, c.byref(part), None))
        self.ok(vp.vp_links_size(part, c.byref(n), None))
        self.ok(vp.vp_links_read(part, c.c_uint64(0), n, places, q, None, None))
        found = {(places[3 * i], places[3 * i + 1], places[3 * i + 2] + 2): q[18 * i:18 * i + 18] for i in range(n.value)}
        self.assertEqual(found, {p: of[0] for p, of in rows.items() if p[2] >= 2})
        vp.vp_links_destroy(links)
        vp.vp_links_destroy(part)

    @unittest.skipIf(HAS_CUDA, "CUDA takes addresses without end, and its runtime memory for each thread")
    def test_memory_that_runs_out(self):
        """Calls that need more than the process may have fail with a message, and work afterwards."""
        grid, out = Grid(voxel_size=(4 / 4096,) * 3, extent=(4096,) * 3), c.c_void_p()
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        for threads in (1, 4):
            context = c.c_void_p()
            self.ok(vp.vp_context_create(ABI, 0, threads, c.byref(context)))
            with open("/proc/self/statm", encoding="ascii") as pages:
                used = int(pages.read().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (used + (48 << 20), hard))
            try:
                self.fails("OUT_OF_MEMORY", "", vp.vp_surface_list(context, self.cube, c.byref(grid), None, None, c.byref(out), None))
                self.fails("OUT_OF_MEMORY", "", vp.vp_solid_list(context, self.cube, c.byref(grid), None, c.byref(out), None))
                # Vertices that nobody reads before memory for them was found.
                desc = mesh_desc(num_vertices=2**31)
                self.fails("OUT_OF_MEMORY", "", vp.vp_mesh_create(context, c.byref(desc), c.byref(out)))
            finally:
                resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
            self.assertFalse(out)
            vp.vp_context_destroy(context)
        field = array(0, 64)
        self.ok(self.surface(field))
        self.assertEqual(sum(field.kept), 56)

    def test_threads_share_handles(self):
        """Each thread has its results and its messages."""
        problems = []

        def work(number):
            for _ in range(20):
                out = array(0, 64)
                if self.surface(out) != 0 or sum(out.kept) != 56:
                    problems.append((number, "result"))
                if self.surface(out, options=SurfaceOptions(coverage=10 + number)) == 0 or f"coverage is {10 + number}," not in vp.vp_last_message().decode():
                    problems.append((number, vp.vp_last_message()))

        threads = [threading.Thread(target=work, args=(n,)) for n in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(problems, [])

    @unittest.skipUnless(shutil.which("nm"), "needs nm of binutils")
    def test_exports(self):
        lines = subprocess.run(["nm", "-D", "--defined-only", "--with-symbol-versions", LIBRARY], check=True, capture_output=True, text=True).stdout.split("\n")
        names = {line.split()[2] for line in lines if line} - {"VOXELPIPE_1", "VOXELPIPE_1@@VOXELPIPE_1"}  # the version itself
        self.assertEqual(names, {name + "@@VOXELPIPE_1" for name in DECLARED})
        self.assertGreater(len(DECLARED), 20)

    def test_names_of_codes(self):
        for name, value in CODES.items():
            if name.startswith("VP_ERROR_") or name == "VP_OK":
                self.assertEqual(vp.vp_code_name(value).decode(), name)
        self.assertEqual(vp.vp_code_name(-1), b"unknown code")
        self.assertEqual(vp.vp_code_name(99), b"unknown code")
        self.assertRegex(vp.vp_version().decode(), r"^\d+\.\d+\.\d+$")

    def test_zz_every_error_was_seen(self):
        """Runs last: the tests above have met all codes but those of a fault, of the library or of a device."""
        never = {"VP_ERROR_INTERNAL", "VP_ERROR_DEVICE"} | ({"VP_ERROR_OUT_OF_MEMORY"} if HAS_CUDA else set())
        self.assertEqual(SEEN, {name for name in CODES if name.startswith("VP_ERROR_")} - never)


if BACKEND and vp.vp_context_create(ABI, BACKEND, 1, c.byref(c.c_void_p())) == CODES["VP_ERROR_NO_BACKEND"]:
    print(f"skipped: no device ({vp.vp_last_message().decode()})")
    sys.exit(77)
unittest.main(argv=sys.argv[:1], verbosity=1)
