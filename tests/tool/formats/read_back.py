# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Reads files of the voxelize writers with other people's readers and compares every value.

usage: read_back.py FORMAT FOLDER     FORMAT is an extension that write_samples, which filled FOLDER, writes: npy, glb, ...
       read_back.py --have-modules    exit code 0 when all the readers are installed

The expected values are computed here from the voxel's position, by the function that test_volumes.hpp describes; nothing is
compared with another file of ours.
"""

import collections
import json
import pathlib
import sys

MODULES = ["numpy", "vtkmodules", "nrrd", "nibabel", "SimpleITK", "trimesh", "PIL", "pyvox", "midvoxio", "pygltflib", "mcschematic", "litemapy", "lib3mf", "lxml",
           "networkx", "zarr", "tensorstore", "tinyvdb", "meshio"]


def have_modules():
    import importlib.util

    missing = [name for name in MODULES if importlib.util.find_spec(name) is None]
    if missing:
        print("missing: " + " ".join(missing))
    return not missing


def pattern(extent, channel, component):
    """32 well-mixed bits for each voxel, as an array (nz, ny, nx)."""
    import numpy as np

    nx, ny, nz = extent
    mask = np.uint64(0xFFFFFFFF)
    i = np.arange(nx, dtype=np.uint64)[None, None, :] * np.uint64(73856093) & mask
    j = np.arange(ny, dtype=np.uint64)[None, :, None] * np.uint64(19349663) & mask
    k = np.arange(nz, dtype=np.uint64)[:, None, None] * np.uint64(83492791) & mask
    h = i ^ j ^ k ^ np.uint64((channel * 4 + component + 1) * 2654435761 & 0xFFFFFFFF)
    h ^= h >> np.uint64(15)
    h = h * np.uint64(0x2C1B3C6D) & mask
    h ^= h >> np.uint64(12)
    return h


def expected(case, index):
    """Values of a channel as (nz, ny, nx) or (nz, ny, nx, components), in the type that NumPy files have."""
    import numpy as np

    name, kind, components = case["channels"][index]
    if kind == "bit":
        if case["density"] == 0:
            return np.zeros(case["extent"][::-1], np.uint8)
        return (pattern(case["extent"], index, 0) % np.uint64(case["density"]) == 0).astype(np.uint8)
    planes = []
    for m in range(components):
        h = pattern(case["extent"], index, m)
        n = h.astype(np.int64)
        planes.append(
            {
                "u8": lambda: h.astype(np.uint8),
                "u16": lambda: h.astype(np.uint16),
                "u32": lambda: h.astype(np.uint32),
                "u64": lambda: h * np.uint64(0x100000001),
                "i32": lambda: h.astype(np.uint32).view(np.int32),
                "i64": lambda: (n - 0x80000000) * 0x10001,
                "f16": lambda: ((n % 801 - 400) / 4).astype(np.float16),
                "f32": lambda: ((n % 20001 - 10000) / 8).astype(np.float32),
                "f64": lambda: (n % 2000001 - 1000000) / 1024,
            }[kind]()
        )
    return planes[0] if components == 1 else np.stack(planes, axis=-1)


def widened(values):
    """VTK and NRRD have no half floats."""
    import numpy as np

    return values.astype(np.float32) if values.dtype == np.float16 else values


def same(got, want, what):
    import numpy as np

    assert got.shape == want.shape, f"{what}: shape {got.shape}, expected {want.shape}"
    assert got.dtype == want.dtype, f"{what}: type {got.dtype}, expected {want.dtype}"
    assert np.array_equal(got, want), f"{what}: {np.count_nonzero(got != want)} of {want.size} values differ"


def close(got, want, what):
    import numpy as np

    assert np.allclose(got, want, rtol=1e-12, atol=0), f"{what}: {got}, expected {want}"


def check_npy(case, files):
    import numpy as np

    assert len(files) == len(case["channels"])
    for n, file in enumerate(files):
        same(np.load(file), expected(case, n), file.name)


def check_npz(case, files):
    import numpy as np

    with np.load(files[0]) as archive:
        assert archive.files == [c[0] for c in case["channels"]], archive.files
        for n, (name, _, _) in enumerate(case["channels"]):
            same(archive[name], expected(case, n), f"{files[0].name}: {name}")


def morton(coords):
    """The Morton keys of rows x, y, z, x the lowest bit of each triple."""
    import numpy as np

    keys = np.zeros(len(coords), np.uint64)
    for bit in range(21):
        for axis in range(3):
            keys |= (coords[:, axis].astype(np.uint64) >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return keys


def check_sparse_values(case, coords, values):
    """coords (n, 3), columns x, y, z, in Morton order; values by channel name: those of the occupied voxels."""
    import numpy as np

    assert coords.dtype == np.int32 and coords.ndim == 2 and coords.shape[1] == 3, (coords.dtype, coords.shape)
    names = [c[0] for c in case["channels"]]
    occupied = expected(case, names.index("occupancy"))
    x, y, z = coords.T
    found = np.zeros_like(occupied)
    found[z, y, x] = 1
    same(found, occupied, "coords")
    assert len(coords) == np.count_nonzero(occupied), "a voxel comes twice"
    keys = morton(coords)
    assert np.all(keys[1:] > keys[:-1]), "not in Morton order"
    assert sorted(values) == sorted(n for n in names if n != "occupancy"), sorted(values)
    for n, name in enumerate(names):
        if name != "occupancy":
            same(values[name], expected(case, n)[z, y, x], name)


def check_sparse_npz(case, files):
    import numpy as np

    with np.load(files[0]) as archive:
        assert archive.files[0] == "coords", archive.files
        check_sparse_values(case, archive["coords"], {name: archive[name] for name in archive.files[1:]})


def check_sparse_npy(case, files):
    import numpy as np

    values = {file.name.split(".")[1]: np.load(file) for file in files[1:]}
    check_sparse_values(case, np.load(files[0]), values)


def check_nvdb(case, files):
    """tinyvdb reads the values of the first grid, if they are floats, and names, types, boxes and numbers of voxels of all."""
    import numpy as np
    from tinyvdb._tinyvdb_nanovdb import NanoVDBFile

    occupied = expected(case, [c[0] for c in case["channels"]].index("occupancy"))
    z, y, x = np.nonzero(occupied)
    types = {"bit": "Mask", "u8x4": "RGBA8", "f32x1": "Float", "f32x3": "Vec3f", "u32x1": "UInt32", "i32x1": "Int32"}
    file = NanoVDBFile(str(files[0]))
    ends = [8, 24, 40] if case["name"] == "slabs" else [case["extent"][2]]  # whole bricks
    assert file.grid_count() == len(case["channels"]) * len(ends), file.grid_count()
    for n in range(file.grid_count()):
        name, kind, components = case["channels"][n // len(ends)]
        slab = n % len(ends)
        name += f".{slab + 1}" if len(ends) > 1 else ""
        there = (z >= (ends[slab - 1] if slab else 0)) & (z < ends[slab])
        assert file.grid_name(n) == name, file.grid_name(n)
        assert file.grid_type(n) == types[kind if kind == "bit" else f"{kind}x{components}"], file.grid_type(n)
        assert file.active_voxel_count(n) == there.sum(), (name, file.active_voxel_count(n))
        low, high = file.bbox(n)
        assert low == tuple(a[there].min() for a in (x, y, z)), (name, low)
        assert high == tuple(a[there].max() for a in (x, y, z)), (name, high)
        close(file.voxel_size(n), case["voxel_size"][0], name)
    want = np.where(occupied != 0, expected(case, 0), np.float32(0))
    want[ends[0]:] = 0
    got = np.array([[[file.get(0, i, j, k) for i in range(want.shape[2])] for j in range(want.shape[1])]
                    for k in range(want.shape[0])], np.float32)
    same(got, want, case["channels"][0][0])


def check_vti(case, files):
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    check_image(case, files[0], vtkXMLImageDataReader())


def check_pvti(case, files):
    from vtkmodules.vtkIOXML import vtkXMLPImageDataReader

    assert case["name"] != "types" or len(files) == 4
    check_image(case, files[-1], vtkXMLPImageDataReader())


def check_image(case, file, reader):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    assert reader.CanReadFile(str(file))
    reader.SetFileName(str(file))
    reader.Update()
    image = reader.GetOutput()
    assert reader.GetErrorCode() == 0
    assert list(image.GetDimensions()) == [n + 1 for n in case["extent"]]
    close(image.GetOrigin(), case["origin"], "origin")
    close(image.GetSpacing(), case["voxel_size"], "spacing")
    cells = image.GetCellData()
    assert image.GetPointData().GetNumberOfArrays() == 0
    assert cells.GetNumberOfArrays() == len(case["channels"])
    for n, (name, _, components) in enumerate(case["channels"]):
        want = widened(expected(case, n))
        got = vtk_to_numpy(cells.GetArray(name))
        same(got.reshape(want.shape), want, f"{file.name}: {name}")


DIRECTIONS = [sign + axis for axis in "xyz" for sign in "-+"]  # by the numbers of the sets


class Hexahedra:
    """What .vtu, .inp and .msh of a case hold: cells in the order of their voxels, nodes in that of the lattice."""

    def __init__(self, case):
        import numpy as np

        nx, ny, _ = case["extent"]
        names = [name for name, _, _ in case["channels"]]
        self.occupied = expected(case, names.index("occupancy")) != 0
        if case["threshold"] != 0:
            self.occupied = expected(case, names.index("fraction")) >= np.float32(case["threshold"])
        self.voxels = np.argwhere(self.occupied)[:, ::-1]
        around = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
        corners = self.voxels[:, None, :] + around
        self.step = np.array([1, nx + 1, (nx + 1) * (ny + 1)])
        self.keys, cells = np.unique((corners * self.step).sum(axis=-1), return_inverse=True)
        self.cells = cells.reshape(-1, 8)
        places = np.stack([self.keys % (nx + 1), self.keys // (nx + 1) % (ny + 1), self.keys // self.step[2]], axis=-1)
        self.points = np.array(case["origin"]) + places * np.array(case["voxel_size"])
        self.size = np.array(case["voxel_size"])
        self.materials = None
        if "material" in names:
            self.materials = (pattern(case["extent"], 9, 0) % np.uint64(6)).astype(np.int32) - 1
            if case["name"] == "none":
                self.materials[...] = 0

    def channel(self, case, index):
        """Values of a channel at the cells."""
        import numpy as np

        values = self.materials if case["channels"][index][0] == "material" else widened(expected(case, index))
        return np.ascontiguousarray(values[self.occupied])

    def sides(self, direction):
        """Whether each cell has no neighbour there."""
        import numpy as np

        axis, upper = 2 - direction // 2, direction % 2 != 0
        beside = np.roll(self.occupied, -1 if upper else 1, axis)
        edge = [slice(None)] * 3
        edge[axis] = -1 if upper else 0
        beside[tuple(edge)] = False
        return ~beside[self.occupied]

    def corners_of_sides(self, cells, direction):
        """The four nodes, ascending, of the sides of cells in a direction."""
        import numpy as np

        at_side = np.array([n >> (direction // 2) & 1 for n in (0, 1, 3, 2, 4, 5, 7, 6)]) == direction % 2
        return np.sort(self.cells[cells][:, at_side], axis=-1)

    def nodes_of_sides(self, direction):
        import numpy as np

        return np.unique(self.corners_of_sides(self.sides(direction), direction))

    def numbers(self):
        """The material of each cell; 0 without materials."""
        import numpy as np

        return np.zeros(len(self.voxels), np.int32) if self.materials is None else self.materials[self.occupied]

    def sets(self):
        """Numbers of the sets of cells in order, with their names."""
        numbers = sorted(set(self.numbers().tolist()), key=lambda n: n if n >= 0 else 1 << 40)
        return {n: "VOXELS" if self.materials is None else "NO_MATERIAL" if n < 0 else f"MATERIAL_{n}" for n in numbers}

    def side_sets(self):
        """(set, set beside or None): rows of a cell, a direction and four nodes, for the sides at which sets of cells end."""
        import numpy as np

        nothing = 1 << 30
        around = np.full(np.array(self.occupied.shape) + 2, nothing)
        around[1:-1, 1:-1, 1:-1][self.occupied] = self.numbers()
        found = []
        for direction in range(6):
            there = self.voxels + 1
            there[:, direction // 2] += 1 if direction % 2 else -1
            beside = around[there[:, 2], there[:, 1], there[:, 0]]
            cells = np.flatnonzero(beside != self.numbers())
            same_direction = np.full(len(cells), direction)
            nodes = self.corners_of_sides(cells, direction)
            found.append(np.column_stack([self.numbers()[cells], beside[cells], cells, same_direction, nodes]))
        rows = np.concatenate(found)
        rows = rows[np.lexsort((rows[:, 3], rows[:, 2]))]
        order = [*self.sets(), nothing]
        groups = {}
        for a in order:
            for b in order[-1:] + order[:-1]:
                chosen = rows[(rows[:, 0] == a) & (rows[:, 1] == b)][:, 2:]
                if len(chosen) != 0:
                    groups[a, None if b == nothing else b] = chosen
        return groups

    def name_of_sides(self, both):
        return "_".join(self.sets()[n] for n in both if n is not None)

    def is_first(self, both):
        """For one of the two that have the sides between two sets, and for outer ones."""
        order = list(self.sets())
        return both[1] is None or order.index(both[0]) < order.index(both[1])

    def check(self, points, cells, name):
        """The mesh as a reader has it; every corner of every cell has the volume of a voxel around it."""
        import numpy as np

        assert points.dtype == np.float64 and points.shape == self.points.shape, f"{name}: {points.shape} points"
        assert np.allclose(points, self.points, rtol=1e-15, atol=1e-14 * np.abs(self.points).max(initial=1)), f"{name}: positions"
        assert np.array_equal(cells, self.cells), f"{name}: the corners of cells"
        for n, others in enumerate([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]]):
            edges = points[cells[:, others]] - points[cells[:, n]][:, None, :]
            assert np.allclose(np.linalg.det(edges), self.size.prod(), rtol=1e-9), f"{name}: Jacobian at corner {n}"


def check_vtu(case, files):
    import meshio
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    file, want, reader = files[0], Hexahedra(case), vtkXMLUnstructuredGridReader()
    assert reader.CanReadFile(str(file))
    reader.SetFileName(str(file))
    reader.Update()
    mesh = reader.GetOutput()
    assert reader.GetErrorCode() == 0
    assert mesh.GetNumberOfCells() == len(want.voxels) and mesh.GetNumberOfPoints() == len(want.points)
    data = mesh.GetCellData()
    assert data.GetNumberOfArrays() == len(case["channels"]) and mesh.GetPointData().GetNumberOfArrays() == 0
    if len(want.voxels) == 0:
        return
    want.check(vtk_to_numpy(mesh.GetPoints().GetData()), vtk_to_numpy(mesh.GetCells().GetConnectivityArray()).reshape(-1, 8), file.name)
    assert np.array_equal(vtk_to_numpy(mesh.GetCells().GetOffsetsArray()), 8 * np.arange(len(want.voxels) + 1))
    assert set(vtk_to_numpy(mesh.GetCellTypes())) == {12}
    bits = 64 if case["name"] == "wide" else 32
    header = file.read_bytes().partition(b"<AppendedData")[0].decode()
    assert all(f'type="Int{bits}" Name="{name}"' in header for name in ("connectivity", "offsets")), header
    for n, (name, _, _) in enumerate(case["channels"]):
        values = want.channel(case, n)
        same(vtk_to_numpy(data.GetArray(name)).reshape(values.shape), values, f"{file.name}: {name}")
    # meshio puts other offsets into the elements while it looks for these, and confuses them where there are many.
    if case["name"] == "raw":
        return
    other = meshio.read(file)
    assert [block.type for block in other.cells] == ["hexahedron"]
    want.check(other.points, other.cells[0].data, f"{file.name} by meshio")
    for n, (name, _, _) in enumerate(case["channels"]):
        values = want.channel(case, n)
        same(other.cell_data[name][0].reshape(values.shape), values, f"{file.name} by meshio: {name}")


def check_inp(case, files):
    import meshio
    import numpy as np

    file, want = files[0], Hexahedra(case)
    text = file.read_text()
    if len(want.voxels) == 0:
        assert text.split("\n")[2:] == ["*NODE, NSET=NODES", ""]
        return
    mesh = meshio.read(file)
    assert [block.type for block in mesh.cells] == ["hexahedron"]
    want.check(mesh.points, mesh.cells[0].data, file.name)
    sets = {"VOXELS": np.arange(len(want.voxels))}
    nodes = {}
    if want.materials is not None:
        for n, name in want.sets().items():
            sets[name] = np.flatnonzero(want.numbers() == n)
            nodes[name] = np.unique(want.cells[sets[name]])
        for both, sides in want.side_sets().items():
            if want.is_first(both):
                nodes[f"NODES_{want.name_of_sides(both)}"] = np.unique(sides[:, 2:])
    assert set(mesh.cell_sets) == set(sets), f"{file.name}: {list(mesh.cell_sets)}"
    for name, cells in sets.items():
        same(np.concatenate(mesh.cell_sets[name]).astype(np.int64), cells, f"{file.name}: {name}")
    for name, numbers in nodes.items():
        same(np.asarray(mesh.point_sets[name]).astype(np.int64), numbers, f"{file.name}: nodes {name}")
    sections = {part.partition("\n")[0]: part.partition("\n")[2].split() for part in text.split("*")}
    # The corners, from 1, of a C3D8's faces S1 to S6.
    faces = [[1, 2, 3, 4], [5, 8, 7, 6], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 8, 4], [4, 8, 5, 1]]
    assert len(mesh.point_sets) == 6 + len(nodes), list(mesh.point_sets)
    face_of_direction = []
    for n, direction in enumerate(DIRECTIONS):
        name = direction[1].upper() + ("_NEGATIVE" if direction[0] == "-" else "_POSITIVE")
        lines = sections[f"SURFACE, TYPE=ELEMENT, NAME=SIDES_{name}"]
        same(np.array([int(cell.rstrip(",")) for cell in lines[::2]]) - 1, np.flatnonzero(want.sides(n)), f"{file.name}: {name}")
        assert len(set(lines[1::2])) == 1
        corners = mesh.points[mesh.cells[0].data[0]][np.array(faces[int(lines[1][1:]) - 1]) - 1]
        a, b = corners[1] - corners[0], corners[3] - corners[0]
        inward = mesh.points[mesh.cells[0].data[0]].mean(axis=0) - corners.mean(axis=0)
        assert inward[n // 2] * (1 if direction[0] == "-" else -1) > 0 and np.dot(np.cross(a, b), inward) > 0, f"{file.name}: the face {lines[1]}"
        same(np.asarray(mesh.point_sets[f"NODES_{name}"]).astype(np.int64), want.nodes_of_sides(n), f"{file.name}: nodes {name}")
        face_of_direction.append(lines[1])
    surfaces = {name.partition("NAME=SIDES_")[2]: lines for name, lines in sections.items() if name.startswith("SURFACE")}
    by_materials = want.side_sets() if want.materials is not None else {}
    assert len(surfaces) == 6 + len(by_materials), list(surfaces)
    for both, sides in by_materials.items():
        lines = surfaces[want.name_of_sides(both)]
        got = np.column_stack([[int(cell.rstrip(",")) - 1 for cell in lines[::2]], [face_of_direction.index(face) for face in lines[1::2]]])
        same(got, sides[:, :2], f"{file.name}: {want.name_of_sides(both)}")


def elements_and_surfaces_of_msh(file, num_volumes, num_surfaces):
    """The tags of all elements, and the signed tags of the surfaces that bound each volume."""
    import numpy as np

    data = file.read_bytes()

    def take(at, kind, count):
        values = np.frombuffer(data, kind, count, at)
        return values.tolist(), at + values.nbytes

    counts, at = take(data.index(b"$Entities\n") + 10, "<u8", 4)
    assert counts == [0, 0, num_surfaces, num_volumes], counts
    bounding = {}
    for n in range(num_surfaces + num_volumes):
        (tag,), at = take(at, "<i4", 1)
        _, at = take(at, "<f8", 6)
        (groups,), at = take(at, "<u8", 1)
        physical, at = take(at, "<i4", groups)
        assert physical == [tag]
        (boundaries,), at = take(at, "<u8", 1)
        boundary, at = take(at, "<i4", boundaries)
        if n < num_surfaces:
            assert boundary == []
        else:
            bounding[tag] = boundary
    assert data[at:].startswith(b"\n$EndEntities\n")
    (blocks, elements, least, most), at = take(data.index(b"$Elements\n") + 10, "<u8", 4)
    tags = []
    for _ in range(blocks):
        (dimension, _, _), at = take(at, "<i4", 3)
        (count,), at = take(at, "<u8", 1)
        rows, at = take(at, "<u8", count * (1 + 2**dimension))
        tags += rows[:: 1 + 2**dimension]
    assert data[at:] == b"\n$EndElements\n"
    assert (elements, least, most) == (len(tags), min(tags), max(tags))
    return np.array(tags), bounding


def check_msh(case, files):
    import meshio
    import numpy as np

    file, want = files[0], Hexahedra(case)
    if len(want.voxels) == 0:
        assert b"$PhysicalNames\n0\n$EndPhysicalNames\n" in file.read_bytes()
        return
    mesh = meshio.read(file)
    sets, sides = want.sets(), want.side_sets()
    tag_of_none = max(sets) + 2  # that of NO_MATERIAL, whose number is -1
    volumes = {n: n + 1 if n >= 0 else tag_of_none for n in sets}
    surfaces, last = {}, max(volumes.values())
    for both in filter(want.is_first, sides):
        if both[1] is not None:
            last += 1
        surfaces[both] = volumes[both[0]] if both[1] is None else last
    groups = {name: [volumes[n], 3] for n, name in sets.items()}
    groups.update({f"SIDES_{want.name_of_sides(both)}": [tag, 2] for both, tag in surfaces.items()})
    assert {name: list(value) for name, value in mesh.field_data.items()} == groups, mesh.field_data
    assert [block.type for block in mesh.cells] == ["hexahedron"] * len(sets) + ["quad"] * len(surfaces)
    blocks = list(zip(mesh.cells, mesh.cell_data["gmsh:physical"]))
    cells = np.empty_like(want.cells)
    for (n, tag), (block, physical) in zip(volumes.items(), blocks):
        assert set(physical) == {tag}
        cells[want.numbers() == n] = block.data
    want.check(mesh.points, cells, file.name)
    for (both, tag), (block, physical) in zip(surfaces.items(), blocks[len(sets) :]):
        name = f"{file.name}: {want.name_of_sides(both)}"
        assert set(physical) == {tag}
        same(np.sort(block.data, axis=-1).astype(np.int64), sides[both][:, 2:], name)
        # Counter-clockwise from outside: the vector area is that of a voxel's side, in the side's direction.
        corners = mesh.points[block.data]
        normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) / 2
        directions = sides[both][:, 1]
        expected = np.zeros((len(directions), 3))
        area = want.size.prod() / want.size[directions // 2]
        expected[np.arange(len(directions)), directions // 2] = np.where(directions % 2, area, -area)
        assert np.allclose(normals, expected, rtol=1e-9, atol=1e-9 * area.max()), name
        # A quadrangle has one cell of its set, and of the set beside it.
        for n in both:
            if n is None:
                continue
            own = np.flatnonzero(want.numbers() == n)
            faces = np.concatenate([want.corners_of_sides(own, d) for d in range(6)])
            faces = [tuple(face) for face in faces.tolist()]
            times = collections.Counter(faces)
            assert all(times[tuple(quad)] == 1 for quad in np.sort(block.data, axis=-1).tolist()), f"{name}: cells of {sets[n]}"
    tags, bounding = elements_and_surfaces_of_msh(file, len(sets), len(surfaces))
    of_cells = np.concatenate([np.flatnonzero(want.numbers() == n) + 1 for n in volumes])
    same(tags, np.concatenate([of_cells, np.arange(len(of_cells), len(tags)) + 1]), f"{file.name}: tags of elements")
    for n, tag in volumes.items():
        signed = [t if both[0] == n else -t for both, t in surfaces.items() if n in both]
        assert bounding[tag] == signed, f"{file.name}: the boundary of {sets[n]}: {bounding[tag]}"


def check_nrrd(case, files):
    """pynrrd has the numbers of the header, SimpleITK what they mean in LPS coordinates."""
    import nrrd
    import numpy as np
    import SimpleITK

    lps = place_in_patient(case)
    space = {"lps": "left-posterior-superior", "ras": "right-anterior-superior"}[case["space"]]

    for n, file in enumerate(files):
        _, _, components = case["channels"][n]
        data, header = nrrd.read(str(file), index_order="C")
        same(np.ascontiguousarray(data), widened(expected(case, n)), file.name)
        size = np.array(case["voxel_size"])
        close(header["space origin"], np.array(case["origin"]) + size / 2, "space origin")
        close(header["space directions"][-3:], np.diag(size), "space directions")
        assert header["kinds"][-3:] == ["domain"] * 3 and len(header["kinds"]) == (3 if components == 1 else 4)
        assert header["space"] == space, header["space"]
        read = SimpleITK.ReadImage(str(file))
        same(SimpleITK.GetArrayFromImage(read), widened(expected(case, n)), f"{file.name} by SimpleITK")
        close(read.GetSpacing(), case["voxel_size"], "spacing")
        close(read.GetOrigin(), lps[:3, 3], "origin")
        close(read.GetDirection(), np.diag(np.sign(np.diag(lps)[:3])).ravel(), "direction")


def place_in_patient(case):
    """The affine to LPS coordinates: from the numbers i, j, k of a voxel to its centre."""
    import numpy as np

    affine = np.diag([*case["voxel_size"], 1.0])
    affine[:3, 3] = np.array(case["origin"]) + np.array(case["voxel_size"]) / 2
    return affine if case["space"] == "lps" else np.diag([-1.0, -1, 1, 1]) @ affine


def check_nii(case, files):
    """nibabel has RAS coordinates, SimpleITK has LPS ones."""
    import nibabel
    import numpy as np
    import SimpleITK

    assert len(files) == len(case["channels"])
    lps = place_in_patient(case)
    ras = (np.diag([-1.0, -1, 1, 1]) @ lps).astype(np.float32)
    for n, file in enumerate(files):
        name, kind, components = case["channels"][n]
        want = widened(expected(case, n))
        image = nibabel.load(str(file))
        values = np.asanyarray(image.dataobj)
        if kind == "u8" and components > 2:
            values = np.stack([values[c] for c in "RGBA"[:components]], axis=-1).transpose(2, 1, 0, 3)
        elif components > 1:
            assert image.header.get_intent()[0] == "vector" and values.shape[3:] == (1, components), values.shape
            values = values[:, :, :, 0].transpose(2, 1, 0, 3)
        else:
            values = values.transpose(2, 1, 0)
        same(np.ascontiguousarray(values), want, file.name)
        for form in ("sform", "qform"):
            affine, code = getattr(image.header, "get_" + form)(coded=True)
            assert code == 2 and np.allclose(affine, ras, rtol=1e-6, atol=0), f"{file.name}: {form} {code} {affine}"
        assert image.header["intent_name"].item().decode() == name[:15]
        read = SimpleITK.ReadImage(str(file))
        got = SimpleITK.GetArrayFromImage(read)
        same(got.reshape(want.shape), want, f"{file.name} by SimpleITK")
        assert np.allclose(read.GetSpacing()[:3], case["voxel_size"], rtol=1e-6), read.GetSpacing()
        assert np.allclose(read.GetOrigin()[:3], lps[:3, 3], rtol=1e-6), read.GetOrigin()
        signs = np.sign(np.diag(lps)[:3])
        assert np.allclose(np.array(read.GetDirection()).reshape(3, 3), np.diag(signs)), read.GetDirection()


def check_nii_gz(case, files):
    assert all(file.read_bytes()[:2] == b"\x1f\x8b" for file in files)
    check_nii(case, files)


def srgb_tables():
    """Linear light of the 256 bytes, and the least light that each byte stands for."""
    import numpy as np

    def linear(encoded):
        return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)

    threshold = linear((np.arange(256) - 0.5) / 255).astype(np.float32)
    threshold[0] = 0
    return linear(np.arange(256) / 255).astype(np.float32), threshold


def children(values, fill):
    """The eight voxels below each of the next level, as an array (..., 8)."""
    import numpy as np

    even = np.pad(values, [(0, n % 2) for n in values.shape], constant_values=fill)
    return np.stack([even[z::2, y::2, x::2] for z in (0, 1) for y in (0, 1) for x in (0, 1)], axis=-1)


def sum_of_children(planes):
    import numpy as np

    return np.stack([children(planes[..., c], 0).sum(axis=-1) for c in range(planes.shape[-1])], axis=-1)


def majority(values):
    """The commonest of eight values other than -1, the least of several; -1 if there is none."""
    import numpy as np

    best, most = np.full(values.shape[:-1], -1), np.zeros(values.shape[:-1], int)
    for candidate in range(3):
        count = (values == candidate).sum(axis=-1)
        best, most = np.where(count > most, candidate, best), np.maximum(count, most)
    return best


def levels_of(name, finest):
    """The mip levels of a target from 1 on, until a level has 64 voxels along each axis; components last."""
    import numpy as np

    linear, threshold = srgb_tables()
    value, sums, levels = finest, None, []
    if name in ("color", "color-replace", "color-outer"):
        light = np.rint(linear[finest[..., :3]].astype(float) * 0xFFFFFF).astype(np.uint64) * finest[..., 3:]
        sums = np.concatenate([light, finest[..., 3:].astype(np.uint64), finest.any(axis=-1)[..., None].astype(np.uint64)], -1)
    elif name == "normal":
        sums = finest.astype(float)
    while max(value.shape[:3]) > 64:
        if name == "occupancy":
            value = children(value, False).any(axis=-1)
        elif name in ("count", "triangle"):
            value = children(value, 0 if name == "count" else -1).max(axis=-1)
        elif name == "color-max":
            value = np.stack([children(value[..., c], 0).max(axis=-1) for c in range(4)], axis=-1)
        elif name == "material":
            value = majority(children(value, -1)).astype(np.int32)
        elif name == "depth":
            value = np.fmin.reduce(children(value, np.nan), axis=-1)
        elif name == "normal":
            sums = sum_of_children(sums)
            whole = sums.astype(np.float32).astype(float)
            length = np.sqrt((whole**2).sum(axis=-1, keepdims=True))
            value = np.where(length > 2.0**-10, whole / np.where(length > 0, length, 1), 0).astype(np.float32)
        else:
            sums = sum_of_children(sums)
            mean = sums[..., :4] / np.maximum(sums[..., 4:], 1)
            light = (mean[..., :3] / np.where(mean[..., 3:] > 0, mean[..., 3:], 1) / 0xFFFFFF).astype(np.float32)
            encoded = np.searchsorted(threshold, light, side="right") - 1
            value = np.concatenate([encoded, np.floor(mean[..., 3:] + 0.5)], axis=-1).astype(np.uint8)
        levels.append(value)
    return levels


def check_zarr_levels(case, files):
    import numpy as np
    import tensorstore
    import zarr

    names = [c[0] for c in case["channels"]]
    occupied = expected(case, names.index("occupancy")).astype(bool)
    empty = {"material": -1, "triangle": -1, "depth": np.nan}
    group = zarr.open_group(files[0], mode="r")
    assert sorted(group.group_keys()) == sorted(names) and not list(group.array_keys())
    for n, (name, kind, components) in enumerate(case["channels"]):
        finest = occupied if kind == "bit" else expected(case, n)
        if name in ("material", "triangle"):
            finest = (finest.view(np.uint32) % (3 if name == "material" else 2**31)).astype(np.int32)
        if kind != "bit":
            there = occupied if components == 1 else occupied[..., None]
            finest = np.where(there, finest, np.array(empty.get(name, 0), finest.dtype))
        want = [finest] + levels_of(name, finest)
        assert len(want) == 4, len(want)
        ome = group[name].attrs["ome"]
        assert ome["version"] == "0.5"
        (scales,) = ome["multiscales"]
        letters = "czyx" if components > 1 else "zyx"
        assert scales["axes"] == [{"name": a, "type": "channel" if a == "c" else "space"} for a in letters], scales["axes"]
        assert [d["path"] for d in scales["datasets"]] == ["0", "1", "2", "3"]
        for level, dataset in enumerate(scales["datasets"]):
            what = f"{files[0].name}: {name}, level {level}"
            scale, translation = dataset["coordinateTransformations"]
            size = np.array(case["voxel_size"][::-1]) * 2**level
            close(scale["scale"], [1] * (components > 1) + list(size), what)
            close(translation["translation"], [0] * (components > 1) + list(np.array(case["origin"][::-1]) + size / 2), what)
            stored = want[level] if components == 1 else np.moveaxis(want[level], -1, 0)
            array = group[name][str(level)]
            assert array.metadata.dimension_names == tuple(letters), array.metadata.dimension_names
            spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": str(files[0] / name / str(level))}}
            for got in (array[...], np.asarray(tensorstore.open(spec).result().read().result())):
                assert got.shape == stored.shape and got.dtype == stored.dtype, (what, got.shape, got.dtype)
                off = np.count_nonzero((got != stored) & ~((got != got) & (stored != stored)))
                assert off == 0, f"{what}: {off} of {stored.size} values differ"


def check_zarr(case, files):
    if case["name"] == "levels":
        return check_zarr_levels(case, files)
    import numpy as np
    import tensorstore
    import zarr

    group = zarr.open_group(files[0], mode="r")
    assert sorted(group.array_keys()) == sorted(c[0] for c in case["channels"]), list(group.array_keys())
    close(group.attrs["voxelpipe"]["origin"], case["origin"], "origin")
    close(group.attrs["voxelpipe"]["voxel_size"], case["voxel_size"], "voxel size")
    for n, (name, kind, components) in enumerate(case["channels"]):
        want = expected(case, n)
        if kind == "bit":
            want = want.astype(bool)
        array = group[name]
        same(array[...], want, f"{files[0].name}: {name}")
        assert array.metadata.dimension_names == ("z", "y", "x", "c")[: want.ndim], array.metadata.dimension_names
        spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": str(files[0] / name)}}
        same(np.asarray(tensorstore.open(spec).result().read().result()), want, f"{files[0].name}: {name} by tensorstore")
        # An array without a value other than 0 has no files beside its description.
        shards = [f for f in (files[0] / name).rglob("*") if f.is_file() and f.name != "zarr.json"]
        assert bool(shards) == bool(want.any()), shards


def check_binvox(case, files):
    import numpy as np
    import trimesh

    with open(files[0], "rb") as file:
        runs = trimesh.exchange.binvox.parse_binvox(file)
        close(runs.translate, case["origin"], "translate")
        close(runs.scale, max(case["extent"]) * case["voxel_size"][0], "scale")
        file.seek(0)
        grid = trimesh.exchange.binvox.load_binvox(file)
    nx, ny, nz = case["extent"]
    got = grid.matrix.transpose(2, 1, 0)
    assert got.shape == (max(nx, ny, nz),) * 3, got.shape
    same(got[:nz, :ny, :nx].astype(np.uint8), expected(case, 0), files[0].name)
    assert got.sum() == got[:nz, :ny, :nx].sum(), "voxels in the padding"


def check_vox(case, files):
    import numpy as np
    from midvoxio.parser import Parser
    from pyvox.parser import VoxParser

    occupancy = expected(case, 0)
    k, j, i = np.nonzero(occupancy)
    nx, ny, nz = case["extent"]
    # MagicaVoxel is z up: where y is up in the volume, (i, j, k) stands at (i, nz-1-k, j).
    places = np.stack([i, nz - 1 - k, j] if case["up"] == "y" else [i, j, k], axis=1)
    single = max(case["extent"]) <= 256
    if single:
        vox = VoxParser(str(files[0])).parse()
        assert len(vox.models) == 1
        assert list(vox.models[0].size) == ([nx, nz, ny] if case["up"] == "y" else [nx, ny, nz])
        voxels = np.array([[v.x, v.y, v.z, v.c] for v in vox.models[0].voxels])
        palette = np.array([[c.r, c.g, c.b] for c in vox.palette])
    else:
        # The other reader knows the scene graph. A transform moves the middle of a model, floor(size / 2).
        vox = Parser(str(files[0])).parse()
        shapes = {shape.node_id: shape.models[0].id for shape in vox.nshps}
        parts = []
        for node in vox.ntrns:
            if node.child_node_id not in shapes:
                continue
            model = shapes[node.child_node_id]
            part = np.array(vox.voxels[model])
            part[:, :3] += np.array(list(map(int, node.frames[0]["_t"].split()))) - np.array(vox.sizes[model]) // 2
            parts.append(part)
        assert len(parts) == len(vox.voxels) > 1
        voxels = np.concatenate(parts)
        palette = np.array(vox.palettes[0])[:, :3]
        whole = np.array([nx, nz, ny] if case["up"] == "y" else [nx, ny, nz])
        places = places - np.array([whole[0] // 2, whole[1] // 2, 0])
    assert len(voxels) == len(places), f"{len(voxels)} voxels, expected {len(places)}"
    order = np.lexsort(voxels[:, :3].T)
    wanted = np.lexsort(places.T)
    assert np.array_equal(voxels[order, :3], places[wanted]), "voxels stand elsewhere"
    if len(case["channels"]) < 2:
        assert len(np.unique(voxels[:, 3])) == 1
        return
    # Random colours do not fit 255 entries, so compare distances: at worst that of a cube of an eighth a side.
    want = expected(case, 1)[k, j, i, :3][wanted].astype(int)
    got = palette[voxels[order, 3] - 1].astype(int)
    distance = np.sqrt(((got - want) ** 2).sum(axis=1))
    few = len(np.unique(want, axis=0)) <= 255
    assert distance.max() <= (0 if few else 100), f"a colour is off by {distance.max()}"
    assert distance.mean() <= 25, f"colours are off by {distance.mean()}"


def expected_blocks(case, folder):
    """{(x, y, z): name} of a case, as Minecraft has it."""
    import numpy as np

    nx, ny, nz = case["extent"]
    k, j, i = np.nonzero(expected(case, 0))
    # Minecraft is y up: where z is up in the volume, (i, j, k) stands at (i, k, ny-1-j).
    places = np.stack([i, j, k] if case["up"] == "y" else [i, k, ny - 1 - j], axis=1)
    table = json.loads((folder / ("listed.json" if case["listed"] else "blocks.json")).read_text())
    colors = np.array([color for color, _ in table["colors"]], dtype=int)
    numbers = np.array([number for _, number in table["colors"]], dtype=int)
    clay = np.array(case["clay"])
    want = expected(case, 1)[k, j, i, :3].astype(int) if len(case["channels"]) > 1 else np.broadcast_to(clay, places.shape)
    blocks = numbers[((want[:, None, :] - colors[None, :, :]) ** 2).sum(axis=2).argmin(axis=1)]
    if case["listed"]:
        material = (pattern(case["extent"], 9, 0) % np.uint64(6)).astype(int)[k, j, i] - 1
        assert set(material) == set(range(-1, 5))
        for number, block in table["materials"]:
            blocks = np.where(material == number, block, blocks)
        assert blocks.max() > 127 and len(table["names"]) > 255
    return {tuple(place): table["names"][block - 1] for place, block in zip(places.tolist(), blocks)}


def check_schem(case, files):
    import nbtlib
    from mcschematic import MCSchematic

    nx, ny, nz = case["extent"]
    tree = nbtlib.load(str(files[0]), gzipped=True)
    tree = tree["Schematic"] if "Schematic" in tree else tree
    assert tree["Version"] == 2
    size = [int(tree[name]) for name in ("Width", "Height", "Length")]
    assert size == ([nx, ny, nz] if case["up"] == "y" else [nx, nz, ny]), size
    assert case["listed"] or len(tree["BlockData"]) == nx * ny * nz
    assert len(tree["Palette"]) == int(tree["PaletteMax"])

    structure = MCSchematic(str(files[0])).getStructure()
    names = structure.getBlockPalette()
    name_of = {int(number): name for name, number in names.items() if isinstance(name, str)}
    got = {place: name_of[number] for place, number in structure.getBlockStates().items()}
    want = expected_blocks(case, files[0].parent)
    assert set(got) == set(want), "blocks stand elsewhere"
    for place, name in want.items():
        assert got[place] == name, f"{place}: {got[place]}, expected {name}"


def check_litematic(case, files):
    import nbtlib
    from litemapy import Schematic

    nx, ny, nz = case["extent"]
    size = (nx, ny, nz) if case["up"] == "y" else (nx, nz, ny)
    want = expected_blocks(case, files[0].parent)
    tree = nbtlib.load(str(files[0]), gzipped=True)
    meta = tree["Metadata"]
    assert [int(meta["EnclosingSize"][a]) for a in "xyz"] == list(size)
    assert int(meta["TotalBlocks"]) == len(want) and int(meta["TotalVolume"]) == nx * ny * nz
    schematic = Schematic.load(str(files[0]))
    (region,) = schematic.regions.values()
    assert (region.width, region.height, region.length) == size and (region.x, region.y, region.z) == (0, 0, 0)
    names = []
    for state in region.palette:
        states = ",".join(f"{key}={value}" for key, value in state.properties())
        names.append(state.id + (f"[{states}]" if states else ""))
    assert names[0] == "minecraft:air"
    # Looking up a block at a time would take a minute: the numbers that the reader unpacked, in the file's order.
    blocks = region._Region__blocks
    for y in range(size[1]):
        for z in range(size[2]):
            for x in range(size[0]):
                name = names[int(blocks[x, y, z])]
                assert name == want.get((x, y, z), "minecraft:air"), f"{x} {y} {z}: {name}"


def expected_sides(case):
    """Every side between an occupied and an empty voxel: for each of -x, +x, -y, +y, -z, +z its voxels (i, j, k) in storage
    order."""
    import numpy as np

    padded = np.pad(expected(case, 0) != 0, 1)
    inner = padded[1:-1, 1:-1, 1:-1]
    sides = []
    for axis in (2, 1, 0):  # x, y, z of an array (nz, ny, nx)
        for shift in (1, -1):
            beside = np.roll(padded, shift, axis)[1:-1, 1:-1, 1:-1]
            sides.append(np.argwhere(inner & ~beside)[:, ::-1])
    return sides


def check_sides(case, triangles, colors, relative):
    """Compares triangles (n, 3, 3) in world units, with one colour (n, 3) each or None, with the sides of the voxels. Two
    triangles make a rectangle, which is the bounding box of either; rectangles must not overlap or leave a side out.
    relative: largest error of a coordinate, in voxels."""
    import numpy as np

    lattice = (triangles - np.array(case["origin"])) / np.array(case["voxel_size"])
    corners = np.rint(lattice).astype(int)
    assert len(triangles) == 0 or np.abs(lattice - corners).max() <= relative, f"off by {np.abs(lattice - corners).max()}"
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.count_nonzero(normals, axis=1) == 1), "a triangle that leans, or has no area"
    axis = np.abs(normals).argmax(axis=1)
    direction = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] > 0)
    want_colors = None if len(case["channels"]) < 2 else expected(case, 1)
    joined = 0
    for d, voxels in enumerate(expected_sides(case)):
        here = direction == d
        boxes = np.concatenate([corners[here].min(axis=1), corners[here].max(axis=1)], axis=1)
        rectangles, first, count = np.unique(boxes, axis=0, return_index=True, return_counts=True)
        assert np.all(count == 2), "a rectangle without its two triangles"
        low, high = rectangles[:, :3].copy(), rectangles[:, 3:].copy()
        low[:, d // 2] -= d % 2  # from the plane to the voxel before it
        high[:, d // 2] = low[:, d // 2] + 1
        size = high - low
        number = size.prod(axis=1)
        owners = np.repeat(np.arange(len(low)), number)
        within = np.arange(len(owners)) - np.repeat(np.cumsum(number) - number, number)
        nj, nk = size[owners, 1], size[owners, 2]
        cells = low[owners] + np.stack([within // (nj * nk), within // nk % nj, within % nk], axis=1)
        joined += len(cells) - len(rectangles)
        order = np.lexsort(cells.T)
        wanted = voxels[np.lexsort(voxels.T)]
        assert len(cells) == len(wanted), f"direction {d}: {len(cells)} sides, expected {len(wanted)}"
        assert np.array_equal(cells[order], wanted), f"direction {d}: sides elsewhere"
        if colors is not None and len(wanted):
            got = colors[here][first][owners[order]]
            i, j, k = wanted.T
            off = np.abs(got.astype(int) - want_colors[k, j, i, :3].astype(int)).max()
            assert off == 0, f"direction {d}: a colour is off by {off}"
    assert case["merge"] or joined == 0, f"{joined} sides were joined"
    assert not case["merge"] or want_colors is not None or joined > 0, "nothing was joined"
    assert (colors is None) == (want_colors is None)


def check_closed(case, vertices, faces, name):
    """The mesh is a closed manifold as it is indexed: no vertex is joined or left out before it is judged."""
    import numpy as np
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False, validate=False)
    assert len(mesh.vertices) == len(vertices) == len(np.unique(faces)), f"{name}: a vertex of no face"
    if case["merge"] or case["name"] == "pieces":
        return
    assert mesh.is_watertight, f"{name}: not watertight"
    assert mesh.is_winding_consistent, f"{name}: faces of both windings"
    _, count = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    assert np.all(count == 2), f"{name}: an edge of {count.max()} faces"
    # The faces around a vertex are one cycle if its edges across faces form one ring.
    around = {}
    for a, b, c in faces.tolist():
        for at, first, last in ((a, b, c), (b, c, a), (c, a, b)):
            around.setdefault(at, []).append((first, last))
    for at, ways in around.items():
        follow = dict(ways)
        assert len(follow) == len(ways), f"{name}: vertex {at} has several fans"
        first = step = ways[0][0]
        for n in range(len(ways)):
            step = follow[step]
            assert (step == first) == (n == len(ways) - 1), f"{name}: vertex {at} has several fans"
    voxels = expected(case, 0).sum() * np.prod(case["voxel_size"])
    assert abs(mesh.volume - voxels) <= 0.02 * voxels, f"{name}: encloses {mesh.volume}, not {voxels}"


def one_color(corners):
    """(n, corners, 3) -> (n, 3): all corners of a face have the same colour."""
    import numpy as np

    assert np.all(corners == corners[:, :1]), "a face with several colours"
    return corners[:, 0]


def check_ply(case, files):
    import numpy as np
    import plyfile
    import trimesh
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOPLY import vtkPLYReader

    if case["points"]:
        check_points(case, trimesh.load(files[0]))
        return
    triangles, colors = [], []
    for file in files:
        reader = vtkPLYReader()
        reader.SetFileName(str(file))
        reader.Update()
        mesh = reader.GetOutput()
        if case["density"] == 0:
            assert mesh.GetNumberOfCells() == 0
            continue
        quads = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 4)
        assert mesh.GetPointData().GetArray("RGB") is None, "colours of vertices"
        rgb = mesh.GetCellData().GetArray("RGB")
        if rgb is not None:
            colors.append(np.repeat(vtk_to_numpy(rgb), 2, axis=0))
        # trimesh keeps the doubles, VTK makes them floats.
        loaded = trimesh.load(file, process=False)
        assert len(loaded.faces) == 2 * len(quads)
        faces_of_file = plyfile.PlyData.read(file)["face"]
        if rgb is not None:
            assert np.array_equal(np.stack([faces_of_file[c] for c in ("red", "green", "blue")], 1), vtk_to_numpy(rgb))
        points = np.asarray(loaded.vertices)
        faces = np.stack([quads[:, :3], quads[:, [0, 2, 3]]], 1).reshape(-1, 3)
        triangles.append(points[faces])
        check_closed(case, points, faces, file.name)
    assert case["name"] != "pieces" or len(files) > 3
    if triangles:
        check_sides(case, np.concatenate(triangles), np.concatenate(colors) if colors else None, 1e-9)


def check_obj(case, files):
    import numpy as np
    import trimesh

    if case["density"] == 0:
        assert not any(line.startswith(("v ", "f ")) for line in files[0].read_text().splitlines())
        return
    triangles, colors = [], []
    for file in files:
        mesh = trimesh.load(file, process=False, maintain_order=True)
        triangles.append(np.asarray(mesh.triangles))
        if len(case["channels"]) > 1:
            colors.append(one_color(np.asarray(mesh.visual.vertex_colors)[mesh.faces][:, :, :3]))
        else:
            assert mesh.visual.kind != "vertex"
            check_closed(case, mesh.vertices, mesh.faces, file.name)
    check_sides(case, np.concatenate(triangles), np.concatenate(colors) if colors else None, 1e-9)


def check_stl(case, files):
    import numpy as np
    import trimesh
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkSTLReader

    triangles = []
    for file in files:
        data = file.read_bytes()
        assert not data.startswith(b"solid"), "readers would take it for text"
        if case["density"] == 0:
            assert len(data) == 84 and data[80:] == bytes(4)
            continue
        mesh = trimesh.load(file, process=False)
        triangles.append(np.asarray(mesh.triangles))
        assert len(data) == 84 + 50 * len(mesh.faces)
        a, b, c = triangles[-1].transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        stored = np.frombuffer(data, np.dtype([("n", "<f4", 3), ("v", "<f4", 9), ("a", "<u2")]), offset=84)["n"]
        assert np.abs(stored - normals).max() < 1e-3, "a normal that is not its triangle's"
        reader = vtkSTLReader()
        reader.SetFileName(str(file))
        reader.MergingOff()
        reader.Update()
        assert reader.GetOutput().GetNumberOfCells() == len(mesh.faces)
        assert np.array_equal(vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).reshape(-1, 3, 3), triangles[-1])
    assert case["name"] != "pieces" or len(files) > 3
    if triangles:
        # The format has no colours, so those of the volume neither are there nor keep faces apart. Corners where sheets
        # meet stand off by at most half a 64th.
        everything = np.concatenate(triangles)
        check_sides(dict(case, channels=case["channels"][:1]), everything, None, 1e-4 if case["merge"] else 2**-7 + 1e-4)
        points, numbers = np.unique(everything.reshape(-1, 3), axis=0, return_inverse=True)
        check_closed(dict(case, name="joined"), points, numbers.reshape(-1, 3), files[0].name)


def check_3mf(case, files):
    import lib3mf
    import numpy as np
    import trimesh

    triangles, colors = [], []
    for file in files:
        model = lib3mf.get_wrapper().CreateModel()
        reader = model.QueryReader("3mf")
        reader.SetStrictModeActive(True)
        reader.ReadFromFile(str(file))
        assert reader.GetWarningCount() == 0, reader.GetWarning(0)
        assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter
        objects = model.GetMeshObjects()
        items = model.GetBuildItems()
        if case["density"] == 0:
            assert not objects.MoveNext() and not items.MoveNext()
            continue
        assert objects.MoveNext() and items.MoveNext() and not items.GetCurrent().HasObjectTransform()
        mesh = objects.GetCurrentMeshObject()
        assert not objects.MoveNext() and not items.MoveNext(), "more than one object"
        points = np.array([list(v.Coordinates) for v in mesh.GetVertices()])
        faces = np.array([list(t.Indices) for t in mesh.GetTriangleIndices()])
        if not case["merge"] and case["name"] != "pieces":
            assert mesh.IsManifoldAndOriented(), "lib3mf calls it no manifold"
        check_closed(case, points, faces, file.name)
        # lib3mf has floats, trimesh the decimals of the file.
        scene = trimesh.load(file, process=False)
        (other,) = scene.geometry.values()
        assert np.array_equal(other.faces, faces)
        triangles.append(np.asarray(other.vertices)[faces])
        groups = model.GetColorGroups()
        if not groups.MoveNext():
            continue
        group = groups.GetCurrentColorGroup()
        number = group.GetResourceID()
        table = {n: group.GetColor(n) for n in group.GetAllPropertyIDs()}
        assert all(c.Alpha == 255 for c in table.values())
        rows = []
        for t in mesh.GetAllTriangleProperties():
            assert t.ResourceID == number and len(set(t.PropertyIDs)) == 1, "a triangle of several colours"
            c = table[t.PropertyIDs[0]]
            rows.append((c.Red, c.Green, c.Blue))
        colors.append(np.array(rows, np.uint8))
    if triangles:
        check_sides(case, np.concatenate(triangles), np.concatenate(colors) if colors else None, 1e-9)


def check_glb(case, files):
    import numpy as np
    import pygltflib
    import trimesh

    triangles, colors = [], []
    for file in files:
        gltf = pygltflib.GLTF2().load(str(file))
        assert gltf.asset.version == "2.0"
        if case["density"] == 0:
            assert not gltf.meshes
            continue
        blob = gltf.binary_blob()
        assert len(blob) == gltf.buffers[0].byteLength

        def values(number):
            accessor = gltf.accessors[number]
            view = gltf.bufferViews[accessor.bufferView]
            kind = {5123: np.uint16, 5125: np.uint32, 5126: np.float32}[accessor.componentType]
            width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
            array = np.frombuffer(blob, kind, accessor.count * width, view.byteOffset).reshape(accessor.count, width)
            assert array.nbytes == view.byteLength
            if accessor.min:
                assert np.array_equal(array.min(axis=0), np.array(accessor.min, np.float32))
                assert np.array_equal(array.max(axis=0), np.array(accessor.max, np.float32))
            return array

        (primitive,) = gltf.meshes[0].primitives
        (node,) = gltf.nodes
        close(node.translation, case["origin"], "translation")
        positions = values(primitive.attributes.POSITION).astype(float) + np.array(node.translation)
        faces = values(primitive.indices).reshape(-1, 3)
        triangles.append(positions[faces])
        if primitive.attributes.COLOR_0 is not None:
            linear = values(primitive.attributes.COLOR_0) / 65535.0
            assert np.all(linear[:, 3] == 1)
            srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)[:, :3]
            colors.append(one_color(np.rint(srgb * 255).astype(np.uint8)[faces]))
        else:
            check_closed(case, positions, faces, file.name)
        # The bounds of the scene, as a viewer places it.
        scene = trimesh.load(file)
        assert np.allclose(scene.bounds, [positions.min(axis=0), positions.max(axis=0)], rtol=1e-6, atol=1e-6)
        if not case["merge"] and case["name"] != "pieces":
            merged = scene.to_geometry()
            merged.merge_vertices(merge_tex=True, merge_norm=True)
            voxels = expected(case, 0).sum() * np.prod(case["voxel_size"])
            assert abs(merged.volume - voxels) <= 1e-4 * voxels, f"encloses {merged.volume}, not {voxels}"
    assert case["name"] != "pieces" or len(files) > 3
    if triangles:
        check_sides(case, np.concatenate(triangles), np.concatenate(colors) if colors else None, 1e-4)


def check_points(case, cloud):
    import numpy as np

    k, j, i = np.nonzero(expected(case, 0))
    want = np.stack([i, j, k], axis=1)
    got = (np.asarray(cloud.vertices) - np.array(case["origin"])) / np.array(case["voxel_size"]) - 0.5
    assert got.shape == want.shape, f"{len(got)} points, expected {len(want)}"
    assert np.abs(got - want).max() <= 1e-9, "points elsewhere"
    if len(case["channels"]) > 1:
        colors = np.asarray(cloud.colors)[:, :3]
        assert np.array_equal(colors, expected(case, 1)[k, j, i, :3]), "colours differ"


def check_xyz(case, files):
    import trimesh

    if case["density"] == 0:
        assert files[0].read_text() == ""
        return
    columns = {len(line.split()) for line in files[0].read_text().splitlines()}
    assert columns == {3 if len(case["channels"]) < 2 else 6}, columns
    check_points(case, trimesh.load(files[0]))


def check_png(case, files):
    import numpy as np
    from PIL import Image

    with Image.open(files[0]) as picture:
        picture.load()
        assert picture.format == "PNG"
        assert picture.size == (160, 120), picture.size
        pixels = np.asarray(picture)
    if case["name"] == "glass":
        assert picture.mode == "RGBA"
        assert pixels[0, 0, 3] == 0 and pixels[60, 80, 3] == 255
    else:
        assert picture.mode == "RGB"
    colors = len(np.unique(pixels.reshape(-1, pixels.shape[-1]), axis=0))
    assert colors > 20, f"only {colors} colours"


def check_slices(case, files):
    """Layers from 0000.png on, whose first row is the highest y."""
    import numpy as np
    from PIL import Image

    nx, ny, nz = case["extent"]
    if case["name"] == "slices":
        want = expected(case, 0) * np.uint8(255)
    else:
        k, j, i = np.ogrid[:nz, :ny, :nx]
        share = np.clip((i + 2 * j + 3 * k).astype(np.float32) / 64 - np.float32(0.25), 0, 1)
        white, kind = (255, np.uint8) if case["name"] == "bytes_of_shares" else (65535, np.uint16)
        want = np.floor(share.astype(np.float64) * white + 0.5).astype(kind)
    assert len(files) == nz
    for layer, file in enumerate(files):
        assert file.name == f"{layer:04}.png", file.name
        with Image.open(file) as picture:
            picture.load()
            assert picture.format == "PNG" and picture.info["gamma"] == 1
            assert picture.mode == ("L" if want.dtype == np.uint8 else "I;16"), picture.mode
            pixels = np.asarray(picture)
        assert np.array_equal(pixels[::-1], want[layer]), f"layer {layer} differs"


def page_volume(file):
    """(description, occupied (nz, ny, nx), {channel: values by voxel}, indices of the voxels) of a page, as page.html says."""
    import base64
    import re
    import zlib

    import numpy as np

    text = file.read_text(encoding="utf-8")
    assert not re.search(r"https?:", text, flags=re.I), "the page names an address"
    shape = json.loads(re.search(r'<script id="shape" type="application/json">(.*?)</script>', text, flags=re.S)[1])
    encoded = re.search(r'<script id="data" type="text/plain">(.*?)</script>', text, flags=re.S)[1]
    data = zlib.decompressobj(-15).decompress(base64.b64decode(encoded, validate=True))
    bricks = shape["bricks"]
    position = np.frombuffer(data, "<u4", 3 * bricks).reshape(3, bricks).T.astype(np.int64)
    masks = np.frombuffer(data, np.uint8, 64 * bricks, 12 * bricks).reshape(bricks, 64)
    bits = np.unpackbits(masks, axis=1, bitorder="little")
    brick, number = np.nonzero(bits)
    within = np.stack([sum((number >> (3 * i + a) & 1) << i for i in range(3)) for a in range(3)], axis=1)
    voxels = 8 * position[brick] + within
    assert len(voxels) == shape["voxels"]
    occupied = np.zeros(shape["extent"][::-1], bool)
    occupied[tuple(voxels.T[::-1])] = True
    at, values = 76 * bricks, {}
    for c in shape["channels"]:
        kind = {"u8": np.uint8, "u32": np.uint32, "i32": np.int32, "f32": np.float32}[c["type"]]
        count = len(voxels) * c["components"]
        rows = np.frombuffer(data, kind, count, at)
        values[c["name"]] = rows if c["components"] == 1 else rows.reshape(-1, c["components"])
        at += count * np.dtype(kind).itemsize
    assert at == len(data), "bytes are left over"
    return shape, occupied, values, voxels


def check_html(case, files):
    import numpy as np

    shape, occupied, values, voxels = page_volume(files[0])
    assert shape["extent"] == case["extent"] and shape["up"] == case["up"] and shape["name"] == case["name"]
    close(shape["voxel_size"], case["voxel_size"], "voxel size")
    place = tuple(voxels.T[::-1])
    for n, (name, kind, _) in enumerate(case["channels"]):
        want = expected(case, n)
        if kind == "bit":
            same(occupied, want.astype(bool), f"{files[0].name}: {name}")
        else:
            kept = want.dtype in (np.uint8, np.uint32, np.int32, np.float32)
            same(values[name], want[place] if kept else want[place].astype(np.float32), f"{files[0].name}: {name}")


def faces_of(case, name):
    """The case of the faces across an axis, which are centred in voxels of an image of their own."""
    axis = "xyz".index(name[-1])
    extent, origin = list(case["extent"]), list(case["origin"])
    extent[axis] += 1
    origin[axis] -= case["voxel_size"][axis] / 2
    return {**case, "extent": extent, "origin": origin, "channels": [[name, "f32", 1]], "faces": []}


def check_with_faces(kind, case, files):
    """.npz and .zarr hold all arrays; of others each array of faces is a file, the last ones."""
    import numpy as np
    import zarr

    of_faces = [faces_of(case, name) for name in case["faces"]]
    voxels = {**case, "faces": []}
    if kind in ("npz", "zarr"):
        assert len(files) == 1
        want = {channel[0]: expected(voxels, n) for n, channel in enumerate(case["channels"])}
        want.update({name: expected(each, 0) for name, each in zip(case["faces"], of_faces)})
        found = np.load(files[0]) if kind == "npz" else zarr.open_group(files[0], mode="r")
        names = found.files if kind == "npz" else sorted(found.array_keys())
        assert names == (list(want) if kind == "npz" else sorted(want)), names
        for name in names:
            same(found[name][...].astype(want[name].dtype), want[name], f"{files[0].name}: {name}")
        return
    check = globals()["check_" + kind]
    if case["channels"]:
        check(voxels, files[: -len(of_faces)])
    for each, file in zip(of_faces, files[-len(of_faces) :]):
        check(each, [file])


def main():
    if sys.argv[1:] == ["--have-modules"]:
        return 0 if have_modules() else 1
    if len(sys.argv) != 3:
        print(__doc__)
        return 2
    kind, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    cases = json.loads((folder / "manifest.json").read_text())
    failures = checked = 0
    for case in cases:
        files = case["files"].get("." + kind.replace("_gz", ".gz"))
        if files is None:
            continue
        checked += 1
        try:
            paths = [folder / name for name in files]
            check_with_faces(kind, case, paths) if case["faces"] else globals()["check_" + kind](case, paths)
            print(f"{case['name']}: as expected")
        except Exception as problem:  # whatever a reader throws is a failure of this case
            failures += 1
            print(f"{case['name']}: {type(problem).__name__}: {problem}")
    if checked == 0:
        print("no file of this format")
    return 1 if failures or checked == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
