# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Distances, fractions, surfaces and labels of arrays in a GPU's memory have the bits of the CPU's. Needs a GPU,
voxelpipe-cuda13, and torch or CuPy; without them a stand-in tests what lies between the functions and the GPU's module."""

import warnings

import numpy as np
import pytest
import voxelpipe as vp

from gpus import Cupy, StandIn, Torch, same
from meshes import box, sphere


@pytest.fixture(params=[Torch, Cupy, StandIn], ids=["torch", "cupy", "stand_in"])
def gpu(request, monkeypatch):
    return request.param(monkeypatch) if request.param is StandIn else request.param()


MESH = sphere(radius=0.9, levels=2)
PARTS = [box((-0.5, -0.5, -0.5), (0.3, 0.4, 0.5)), sphere(radius=0.6, centre=(0.2, 0, 0))]
OPEN = (MESH[0], MESH[1][8:])
GRID = vp.Grid((-1, -1, -1), (0.1, 0.1, 0.12), (17, 21, 20))


def put(gpu, mesh):
    if isinstance(mesh, list):
        return [put(gpu, part) for part in mesh]
    return tuple(map(gpu.put, mesh))


def told(f, **options):
    """What f returns, the counters, and the warnings."""
    status = {}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = f(status=status, **options)
    return result, status, [(w.category, str(w.message)) for w in caught]


def compare(gpu, f, on_device, on_host, *more, **options):
    """f of arrays on the device gives what it gives of those on the host: arrays, counters and warnings. Returns the
    counters."""
    there, status, warned = told(lambda **o: f(on_device, *more, **o), **options)
    here, status_here, warned_here = told(lambda **o: f(on_host, *more, **o), **options)
    flat, flat_here = [], []
    for results, a in ((flat, there), (flat_here, here)):
        for part in a if isinstance(a, tuple) else [a]:
            results += [part[name] for name in sorted(part)] if isinstance(part, dict) else [part]
    assert len(flat) == len(flat_here)
    for a, b in zip(flat, flat_here):
        is_of_faces = isinstance(gpu, Torch) and b.dtype == np.uint32
        same(gpu, a, b.astype(np.int64) if is_of_faces else b)
    assert status == status_here and warned == warned_here
    return status_here


def message_of(f):
    with pytest.raises(Exception) as caught:
        f()
    return type(caught.value), str(caught.value)


# ---- distances --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", ["nonzero", "even_odd", "positive", "unsigned"])
@pytest.mark.parametrize("corners", [False, True])
def test_distances(gpu, sign, corners):
    for band in (1.5, 3, "whole"):
        for nearest in (False, True):
            options = {"corners": corners, "nearest": nearest}
            counts = compare(gpu, vp.distance, put(gpu, PARTS), PARTS, GRID, band, sign, **options)
            assert counts["band_samples"] > 500
    crop = GRID.crop((3, 5, 2), (10, 11, 15))
    compare(gpu, vp.distance, put(gpu, MESH), MESH, crop, 2, sign, corners=corners)
    if sign != "unsigned":
        compare(gpu, vp.distance, put(gpu, PARTS), PARTS, GRID, sign=sign, bodies="each")


@pytest.mark.parametrize(
    "repair", [{}, {"repair": "close_holes"}, {"repair": "close_holes", "max_hole_edges": 3},
               {"repair": "exterior", "closing": 1}, {"repair": "vote"}, {"repair": "winding"}]
)  # fmt: skip
def test_distances_of_an_open_mesh(gpu, repair):
    counts = compare(gpu, vp.distance, put(gpu, OPEN), OPEN, GRID, **repair)
    assert counts["triangles"] == len(OPEN[1])
    if repair.get("repair") in (None, "close_holes", "winding"):
        points = np.random.default_rng(3).uniform(-1, 1, (50, 3)).astype(np.float32)
        mesh, at = put(gpu, OPEN), gpu.put(points)
        same(gpu, vp.distance_at(mesh, at, GRID, **repair), vp.distance_at(OPEN, points, GRID, **repair))


def test_distances_of_nothing(gpu):
    empty = (MESH[0], MESH[1][:0])
    for band in (3, "whole"):
        compare(gpu, vp.distance, put(gpu, empty), empty, GRID, band, nearest=True)


POINTS = np.random.default_rng(5).uniform(-1.2, 1.2, (200, 3))


@pytest.mark.parametrize(
    "points",
    [POINTS.astype(np.float32), POINTS, POINTS.astype(np.float16), np.rint(POINTS * 2).astype(np.int64), POINTS[:0],
     np.array([[0, 0, np.nan], [np.inf, 0, 0], [1e30, 0, 0], [0, 0, 0.25]]), np.array([[1 << 40, 3, 2], [0, 1, 2]])],
    ids=["float32", "float64", "float16", "int64", "none", "bad", "far"],
)  # fmt: skip
def test_distances_of_points(gpu, points):
    """Points that float32 does not hold have the mesh's reference taken away, too."""

    def f(m, **options):
        on_host = m is MESH or m is far
        return vp.distance_at(m, points if on_host else gpu.put(points), **options)

    far = (MESH[0].astype(np.float64) + 1e-9, MESH[1])
    for mesh in (MESH, far):
        for grid in (None, GRID, vp.fit(mesh, 64)):
            for nearest in (False, True):
                compare(gpu, f, put(gpu, mesh), mesh, grid=grid, nearest=nearest)
    compare(gpu, f, put(gpu, MESH), MESH, sign="unsigned")


def test_positions_in_double_keep_their_precision(gpu):
    far = (MESH[0].astype(np.float64) + 4.7e6, MESH[1].astype(np.int64))
    grid = vp.fit(far, 20)
    mesh = put(gpu, far)
    compare(gpu, vp.distance, mesh, far, grid)
    compare(gpu, vp.fractions, mesh, far, grid)
    compare(gpu, vp.remesh, mesh, far, grid)
    points = POINTS + 4.7e6
    same(gpu, vp.distance_at(mesh, gpu.put(points)), vp.distance_at(far, points))


# ---- fractions --------------------------------------------------------------------------------------------------------

FACES = ("aperture_x", "aperture_y", "aperture_z", "face_centroid_x", "face_centroid_y", "face_centroid_z", "area_vector")
ALL = ("fraction", *FACES, "centroid", "area", "area_centroid", "multi_cut")


@pytest.mark.parametrize("of", ["fraction", "aperture_y", "multi_cut", ("area", "centroid"), ("area_vector",), "face_centroid_y", FACES, ALL])
def test_fractions(gpu, of):
    counts = compare(gpu, vp.fractions, put(gpu, MESH), MESH, GRID, of=of)
    assert counts["cut_voxels"] > 100
    compare(gpu, vp.fractions, put(gpu, PARTS), PARTS, GRID.crop((2, 3, 4), (11, 12, 13)), of=of, bodies="each")


@pytest.mark.parametrize("repair", [{}, {"repair": "close_holes"}, {"repair": "close_holes", "max_hole_edges": 3}])
def test_fractions_of_an_open_mesh(gpu, repair):
    counts = compare(gpu, vp.fractions, put(gpu, OPEN), OPEN, GRID, of=ALL, **repair)
    assert (counts["open_rows"] == 0) == ("repair" in repair and "max_hole_edges" not in repair)
    empty = (MESH[0], MESH[1][:0])
    compare(gpu, vp.fractions, put(gpu, empty), empty, GRID, of=ALL, **repair)


# ---- surfaces ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [{}, {"place": "mean", "quads": True}, {"place": "corner", "corners": True}, {"level": 0.07}, {"level": -0.05, "corners": True},
     {"sign": "even_odd", "bodies": "each", "border": "open"}, {"repair": "exterior"}, {"repair": "vote", "embedded": True},
     {"repair": "winding", "min_component": 30}],
    ids=str,
)  # fmt: skip
def test_remeshes(gpu, options):
    for mesh in (PARTS, OPEN):
        counts = compare(gpu, vp.remesh, put(gpu, mesh), mesh, GRID, **options)
        assert counts["components"] >= 1
    if options.get("repair") != "exterior":  # which follows from the whole grid
        crop = GRID.crop((2, 3, 4), (11, 12, 13))
        compare(gpu, vp.remesh, put(gpu, MESH), MESH, crop, **options)
    empty = (MESH[0], MESH[1][:0])
    compare(gpu, vp.remesh, put(gpu, empty), empty, GRID, **options)


@pytest.mark.parametrize("level", [0, 0.1])
@pytest.mark.parametrize("names", [["three"], ["rgb", "id"], ["three", "twenty", "rgb", "id", "long", "flat"]], ids=str)
def test_attributes_of_remeshes(gpu, names, level):
    rng = np.random.default_rng(11)
    vertices, triangles = len(MESH[0]), len(MESH[1])
    values = {
        "three": rng.normal(size=(vertices, 3)).astype(np.float32),
        "twenty": rng.normal(size=(vertices, 20)),
        "rgb": rng.integers(0, 256, (vertices, 3), dtype=np.uint8),
        "id": rng.integers(0, 5, triangles, dtype=np.int32),
        "long": rng.integers(-(1 << 60), 1 << 60, (vertices, 6), dtype=np.int64),
        "flat": rng.normal(size=triangles).astype(np.float32),
    }

    def f(m, **options):
        chosen = {name: values[name] if m is MESH else gpu.put(values[name]) for name in names}
        return vp.remesh(m, GRID, attributes=chosen, **options)

    compare(gpu, f, put(gpu, MESH), MESH, level=level)


@pytest.mark.parametrize(
    "options", [{}, {"place": "corner", "quads": True}, {"border": "open", "min_component": 20}, {"embedded": True}], ids=str
)
def test_extracts(gpu, options):
    rng = np.random.default_rng(2)
    bits = rng.random(GRID.shape) < 0.3
    compare(gpu, vp.extract, gpu.put(bits), bits, GRID, **options)
    strided = np.asfortranarray(bits)
    compare(gpu, vp.extract, gpu.put(strided), strided, GRID, **options)
    at_corners = rng.normal(size=[n + 1 for n in GRID.shape]).astype(np.float32)
    at_corners[3, 4, 5] = np.nan
    compare(gpu, vp.extract, gpu.put(at_corners), at_corners, GRID, corners=True, level=0.2, **options)
    for dtype in (np.float16, np.float32, np.float64):
        field = rng.normal(size=GRID.shape).astype(dtype)
        compare(gpu, vp.extract, gpu.put(field), field, GRID, level=-0.1, **options)
    tiny = np.where(bits, 1.0 - 2.0**-53, 1.0)  # what float32 does not tell from the level
    counts = compare(gpu, vp.extract, gpu.put(tiny), tiny, GRID, level=1.0, **options)
    assert counts["components"] > 0
    nothing = np.zeros(GRID.shape, bool)
    compare(gpu, vp.extract, gpu.put(nothing), nothing, GRID, **options)


# ---- labels -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("connectivity", [6, 18, 26])
def test_labels(gpu, connectivity):
    rng = np.random.default_rng(4)
    for values in (
        rng.random((5, 7, 70)) < 0.3,
        np.asfortranarray(rng.random((9, 4, 33)) < 0.5),
        rng.integers(-1, 2, (3, 4, 5)),
        rng.integers(0, 2, (1, 1, 1), dtype=np.uint8),
        np.zeros((2, 3, 4), bool),
    ):
        for components in (False, True):
            compare(gpu, vp.label, gpu.put(values), values, connectivity, components=components)


# ---- mistakes ---------------------------------------------------------------------------------------------------------


def test_mistakes_are_told_as_on_the_cpu(gpu):
    """Errors of options and shapes are the CPU's, to the letter."""
    mesh, bits = put(gpu, MESH), np.ones((3, 4, 5), bool)
    for f, on_device, on_host in (
        (lambda m: vp.distance(m, GRID, sign="unsigned", repair="vote"), mesh, MESH),
        (lambda m: vp.distance(m, GRID, "even_odd", repair="winding"), mesh, MESH),
        (lambda m: vp.distance(m, GRID, sign="even_odd", repair="winding"), mesh, MESH),
        (lambda m: vp.distance(m, GRID, closing=65), mesh, MESH),
        (lambda m: vp.distance(m, vp.Grid((-0.1, -0.1, -0.1), 0.02, (10, 10, 10)), repair="exterior"), mesh, MESH),
        (lambda m: vp.distance_at(m, m[0], GRID, repair="vote"), mesh, MESH),
        (lambda m: vp.distance_at(m, m[0][:, :2], GRID), mesh, MESH),
        (lambda m: vp.fractions(m, GRID, of="volume"), mesh, MESH),
        (lambda m: vp.remesh(m, GRID, "even_odd", repair="vote"), mesh, MESH),
        (lambda m: vp.remesh(m, GRID, level=float("nan")), mesh, MESH),
        (lambda m: vp.remesh(m, GRID, attributes={"sheet": m[0]}), mesh, MESH),
        (lambda m: vp.remesh(m, GRID, attributes={"a": m[0][:5]}), mesh, MESH),
        (lambda a: vp.extract(a, GRID), gpu.put(bits), bits),
        (lambda a: vp.extract(a, GRID, level=1), gpu.put(bits), bits),
        (lambda a: vp.label(a, 7), gpu.put(bits), bits),
        (lambda a: vp.label(a[0]), gpu.put(bits), bits),
        (lambda a: vp.label(a), gpu.put(bits[:0]), bits[:0]),
        (lambda a: vp.label(a), gpu.put(POINTS), POINTS),
        (lambda a: vp.extract(a, GRID), gpu.put(bits.astype(np.int32)), bits.astype(np.int32)),
    ):
        assert message_of(lambda: f(on_device)) == message_of(lambda: f(on_host))


def test_triangles_without_vertices_are_named(gpu):
    bad = MESH[1].astype(np.int64)
    for number in (-1, len(MESH[0])):
        bad[6, 1] = number
        mesh = put(gpu, (MESH[0], bad))
        for f in (
            lambda: vp.distance(mesh, GRID),
            lambda: vp.distance_at(mesh, gpu.put(POINTS), GRID),
            lambda: vp.fractions(mesh, GRID),
            lambda: vp.remesh(mesh, GRID),
            lambda: vp.remesh(mesh, GRID, level=0.1),
        ):
            with pytest.raises(IndexError, match="triangle 6"):
                f()


def test_what_a_gpu_does_not_do_is_said(gpu):
    mesh = put(gpu, MESH)
    with pytest.raises(TypeError, match="sparse fractions are computed on the CPU"):
        vp.sparse_fractions(mesh, GRID)
    with pytest.raises(TypeError, match="fraction lists are computed on the CPU"):
        vp.fraction_lists(mesh, GRID)
    with pytest.raises(TypeError, match="links are computed on the CPU"):
        vp.links(mesh, GRID)
    voxels = gpu.put(np.array([[1, 2, 3]], np.int32))
    for given in (voxels, (voxels, {}), (voxels, gpu.put(np.zeros((0, 4), np.int32)))):
        with pytest.raises(TypeError, match="lists of voxels are extracted on the CPU"):
            vp.extract(given, GRID)


def test_arrays_of_one_call_lie_in_one_place(gpu):
    mesh = put(gpu, MESH)
    with pytest.raises(TypeError, match="points"):
        vp.distance_at(mesh, POINTS)
    with pytest.raises(TypeError, match="points"):
        vp.distance_at(MESH, gpu.put(POINTS))
    with pytest.raises(TypeError, match="mesh"):
        vp.remesh(mesh, GRID, attributes={"a": MESH[0]})
    with pytest.raises(TypeError, match="mesh"):
        vp.remesh(MESH, GRID, attributes={"a": gpu.put(MESH[0])})


def test_without_the_package_the_error_names_it(monkeypatch):
    import sys

    gpu = StandIn(monkeypatch)
    monkeypatch.setitem(sys.modules, "voxelpipe_cuda", None)
    mesh, bits = put(gpu, MESH), gpu.put(np.ones(GRID.shape, bool))
    for f in (lambda: vp.distance(mesh, GRID), lambda: vp.extract(bits, GRID), lambda: vp.label(bits)):
        with pytest.raises(TypeError, match="voxelpipe-cuda13"):
            f()


def test_the_current_stream_is_used():
    gpu = Torch()
    expected = vp.distance(MESH, GRID)
    with gpu.torch.cuda.stream(gpu.torch.cuda.Stream()):
        # The vertices are not there before this stream has worked on them.
        v = gpu.put(np.zeros_like(MESH[0]))
        v.copy_(gpu.put(MESH[0]), non_blocking=True)
        drawn = vp.distance((v, gpu.put(MESH[1])), GRID)
        surface = vp.remesh((v, gpu.put(MESH[1])), GRID)[0]
    same(gpu, drawn, expected)
    same(gpu, surface, vp.remesh(MESH, GRID)[0])
