# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""A GPU's results have the bits of the CPU's. Needs a GPU, voxelpipe-cuda13, and torch or CuPy."""

import numpy as np
import pytest
import voxelpipe as vp

from gpus import Cupy, Torch, same
from meshes import box, sphere


@pytest.fixture(params=[Torch, Cupy], ids=["torch", "cupy"])
def gpu(request):
    return request.param()


MESH = sphere(radius=0.9, levels=3)
GRID = vp.Grid((-1, -1, -1), (0.05, 0.05, 0.06), (35, 41, 39))


@pytest.mark.parametrize("coverage", ["conservative", "thin", "crosshair", "diagonal"])
def test_surfaces(gpu, coverage):
    mesh = tuple(map(gpu.put, MESH))
    on_device, on_host = {}, {}
    same(
        gpu,
        vp.voxelize(mesh, GRID, coverage, status=on_device),
        vp.voxelize(MESH, GRID, coverage, status=on_host),
    )
    assert on_device == on_host and on_host["voxels"] > 1000
    words = vp.voxelize(MESH, GRID, coverage, packed=True)  # signed for torch
    same(gpu, vp.voxelize(mesh, GRID, coverage, packed=True), words.view(np.int32) if isinstance(gpu, Torch) else words)
    crop = GRID.crop((3, 5, 7), (20, 11, 30))
    same(gpu, vp.voxelize(mesh, crop, coverage), vp.voxelize(MESH, crop, coverage))


def test_grids_around_meshes_on_a_gpu():
    gpu = Torch()
    v = MESH[0].copy()
    v[5] = np.nan
    assert vp.fit((gpu.put(v), gpu.put(MESH[1])), 64) == vp.fit((v, MESH[1]), 64)


@pytest.mark.parametrize("fill", ["nonzero", "even_odd", "positive"])
@pytest.mark.parametrize("extent", ["outer", "centre", "inner"])
def test_solids(gpu, fill, extent):
    parts = [box((-0.5, -0.5, -0.5), (0.3, 0.4, 0.5)), sphere(radius=0.6, centre=(0.2, 0, 0))]
    mesh = [tuple(map(gpu.put, part)) for part in parts]
    for bodies in ("all", "each"):
        a, b = {}, {}
        same(
            gpu,
            vp.solid(mesh, GRID, fill, extent=extent, bodies=bodies, status=a),
            vp.solid(parts, GRID, fill, extent=extent, bodies=bodies, status=b),
        )
        assert a == b


@pytest.mark.parametrize("repair", ["close_holes", "exterior", "vote", "winding"])
def test_repairs(gpu, repair):
    mesh = (MESH[0], MESH[1][8:])
    on_device = tuple(map(gpu.put, mesh))
    same(gpu, vp.solid(on_device, GRID, repair=repair), vp.solid(mesh, GRID, repair=repair))


@pytest.mark.parametrize("blend", ["mean", "sum", "min", "max", "last"])
def test_attributes(gpu, blend):
    rng = np.random.default_rng(7)
    vertices, triangles = len(MESH[0]), len(MESH[1])
    values = {
        "one": rng.normal(size=vertices).astype(np.float32),
        "three": rng.normal(size=(vertices, 3)).astype(np.float32),
        "five": rng.normal(size=(triangles, 5)).astype(np.float32),
        "colour": rng.integers(0, 256, (vertices, 4), dtype=np.uint8),
        "id": rng.integers(-1000, 1000, triangles, dtype=np.int32),
        "long": rng.integers(-(1 << 60), 1 << 60, (triangles, 2), dtype=np.int64),
    }
    mesh = tuple(map(gpu.put, MESH))
    given = {name: gpu.put(a) for name, a in values.items()}
    drawn, expected = vp.bake(mesh, GRID, given, blend=blend, fill=3), vp.bake(MESH, GRID, values, blend=blend, fill=3)
    assert drawn.keys() == expected.keys()
    for name, a in expected.items():
        same(gpu, drawn[name], a)
    voxels, listed = vp.sparse(mesh, GRID, given, blend=blend)
    voxels_expected, listed_expected = vp.sparse(MESH, GRID, values, blend=blend)
    same(gpu, voxels, voxels_expected)
    for name, a in listed_expected.items():
        same(gpu, listed[name], a)


def test_fragments(gpu):
    drawn, expected = vp.fragments(tuple(map(gpu.put, MESH)), GRID), vp.fragments(MESH, GRID)
    if isinstance(gpu, Torch):
        expected = expected._replace(triangles=expected.triangles.astype(np.int64))
    for a, b in zip(drawn, expected):
        same(gpu, a, b)
    nothing = vp.fragments((gpu.put(MESH[0]), gpu.put(MESH[1][:0])), GRID)
    assert [len(a) for a in nothing] == [0, 1, 0, 0]


def test_positions_in_double_keep_their_precision(gpu):
    far = (MESH[0].astype(np.float64) + 4.7e6, MESH[1].astype(np.int64))
    grid = vp.fit(far, 40)
    mesh = tuple(map(gpu.put, far))
    assert vp.fit(mesh, 40) == grid
    same(gpu, vp.voxelize(mesh, grid), vp.voxelize(far, grid))


def test_mistakes(gpu):
    v, f = MESH
    mesh = tuple(map(gpu.put, MESH))
    bad = f.astype(np.int64)
    bad[6, 1] = -1
    with pytest.raises(IndexError, match="triangle 6"):
        vp.voxelize((gpu.put(v), gpu.put(bad)), GRID)
    bad[6, 1] = len(v)
    with pytest.raises(IndexError, match="triangle 6"):
        vp.voxelize((gpu.put(v), gpu.put(bad)), GRID)
    with pytest.raises(ValueError, match="coverage is"):
        vp.voxelize(mesh, GRID, "fat")
    with pytest.raises(TypeError, match="mesh"):
        vp.bake(mesh, GRID, {"a": np.ones(len(v))})
    with pytest.raises(TypeError, match="mesh"):
        vp.bake(MESH, GRID, {"a": gpu.put(np.ones(len(v)))})
    with pytest.raises(ValueError, match="a: 5 rows"):
        vp.bake(mesh, GRID, {"a": gpu.put(np.ones(5))})


def test_the_current_stream_is_used():
    gpu = Torch()
    stream = gpu.torch.cuda.Stream()
    expected = vp.voxelize(MESH, GRID)
    with gpu.torch.cuda.stream(stream):
        # The vertices are not there before this stream has worked on them.
        v = gpu.put(np.zeros_like(MESH[0]))
        v.copy_(gpu.put(MESH[0]), non_blocking=True)
        drawn = vp.voxelize((v, gpu.put(MESH[1])), GRID)
    same(gpu, drawn, expected)
