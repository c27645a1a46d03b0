# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes and arrays of other libraries. What is not installed is not tested, and shows as skipped."""

import importlib.metadata
import threading

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, sphere


def expected_of(mesh, n=24):
    grid = vp.fit(mesh, n)
    return grid, vp.voxelize(mesh, grid)


def test_the_gpu_is_an_extra():
    """voxelpipe[gpu] brings the package that draws on a GPU, and without the extra nothing does."""
    names = [line for line in importlib.metadata.requires("voxelpipe") if line.startswith("voxelpipe-cuda13")]
    assert len(names) == 1 and "extra ==" in names[0] and "gpu" in names[0]


def test_trimesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    v, f = sphere()
    grid, expected = expected_of((v, f))
    mesh = trimesh.Trimesh(v, f, process=False)
    assert vp.fit(mesh, 24) == grid
    assert np.array_equal(vp.voxelize(mesh, grid), expected)
    assert np.array_equal(vp.voxelize(trimesh.Scene([mesh]), grid), expected)
    path = tmp_path / "sphere.ply"
    mesh.export(path)
    assert np.array_equal(vp.voxelize(path, grid), expected)
    assert np.array_equal(vp.voxelize(str(path), grid), expected)


def test_trimesh_volume_agrees():
    trimesh = pytest.importorskip("trimesh")
    v, f = sphere(levels=4)
    mesh = trimesh.Trimesh(v, f, process=False)
    grid = vp.fit(mesh, 128)
    volume = vp.solid(mesh, grid, extent="centre").sum() * np.prod(grid.voxel_size)
    assert abs(volume / mesh.volume - 1) < 2e-3


def test_open3d():
    o3d = pytest.importorskip("open3d")
    v, f = sphere()
    grid, expected = expected_of((v, f))
    legacy = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(v), o3d.utility.Vector3iVector(f.astype(np.int32)))
    assert np.array_equal(vp.voxelize(legacy, grid), expected)
    assert np.array_equal(vp.voxelize(o3d.t.geometry.TriangleMesh.from_legacy(legacy), grid), expected)


def test_pyvista():
    pv = pytest.importorskip("pyvista")
    v, f = sphere()
    grid, expected = expected_of((v, f))
    faces = np.hstack([np.full((len(f), 1), 3), f]).ravel()
    assert np.array_equal(vp.voxelize(pv.PolyData(v, faces), grid), expected)
    cube = pv.Cube()  # quads
    assert vp.voxelize(cube, vp.fit(cube, 8)).sum() == 8**3 - 6**3


def test_torch():
    torch = pytest.importorskip("torch")
    v, f = sphere()
    grid, expected = expected_of((v, f))
    mesh = (torch.from_numpy(v).requires_grad_(), torch.from_numpy(f.astype(np.int64)))
    surface = vp.voxelize(mesh, grid)
    assert isinstance(surface, torch.Tensor) and surface.dtype == torch.bool
    assert np.array_equal(surface.numpy(), expected)
    baked = vp.bake(mesh, grid, {"a": torch.ones(len(v), 3)})["a"]
    assert isinstance(baked, torch.Tensor) and baked.dtype == torch.float32 and baked.shape == (*grid.shape, 3)


class Exported:
    """An array that is known by the protocol alone."""

    def __init__(self, a):
        self.a = a

    def __dlpack__(self, **options):
        return self.a.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.a.__dlpack_device__()


def test_dlpack_and_buffers():
    v, f = sphere()
    grid, expected = expected_of((v, f))
    assert np.array_equal(vp.voxelize((Exported(v), Exported(f)), grid), expected)
    assert np.array_equal(vp.voxelize((memoryview(v), memoryview(f)), grid), expected)
    assert np.array_equal(vp.voxelize((v.tolist(), f.tolist()), grid), expected)


def test_strided_and_read_only_arrays():
    v, f = sphere()
    grid, expected = expected_of((v, f))
    wide = np.zeros((len(v), 6), np.float32)
    wide[:, 1:4] = v
    frozen = f.copy()
    frozen.flags.writeable = False
    assert np.array_equal(vp.voxelize((wide[:, 1:4], np.asfortranarray(frozen)), grid), expected)
    assert np.array_equal(vp.voxelize((v, frozen), grid), expected)


def test_arrays_on_a_gpu_are_named():
    class OnGpu:
        __cuda_array_interface__ = {}
        shape = (3, 3)

    with pytest.raises(TypeError, match="GPU"):
        vp.voxelize((OnGpu(), np.zeros((1, 3), int)), vp.fit(box(), 4))


def test_other_threads_run_meanwhile():
    mesh = sphere(levels=5)
    grid = vp.fit(mesh, 400)  # long enough for a machine that does other work too
    expected = vp.voxelize(mesh, grid)
    ticks, done = [0], threading.Event()

    def count():
        while not done.is_set():
            ticks[0] += 1
            done.wait(0.0005)

    counter = threading.Thread(target=count)
    counter.start()
    results = []
    workers = [threading.Thread(target=lambda: results.append(vp.voxelize(mesh, grid))) for _ in range(2)]
    for w in workers:
        w.start()
    for w in workers:
        w.join()
    done.set()
    counter.join()
    assert ticks[0] > 3
    assert all(np.array_equal(r, expected) for r in results)
