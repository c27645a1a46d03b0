# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Blocks of Dask's arrays are the parts of the whole, in this process and on a cluster of two."""

import os
import warnings

import numpy as np
import pytest

import voxelpipe as vp

pytest.importorskip("dask.array")
pytest.importorskip("distributed")
import dask.array as da  # noqa: E402
from distributed import Client, LocalCluster  # noqa: E402
from meshes import box, sphere  # noqa: E402

import voxelpipe.dask  # noqa: E402

CHUNKS = (9, 16, 23)  # none divides the grid's sides


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    # The workers' folder is not that of the paths.
    folder = tmp_path_factory.mktemp("workers")
    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        local_directory=str(folder),
        memory_limit=0,
    ) as cluster, Client(cluster, set_as_default=False) as connection:
        yield connection


def ball_and_box():
    vertices, triangles = sphere(levels=3)
    more, faces = box((1.5, -0.25, -0.5), (2.25, 0.5, 0.25))
    return [(vertices, triangles), (np.asarray(more, np.float32), faces)]


def calls(mesh, grid):
    """(lazy, whole) of every function."""
    return {
        "surface": (vp.dask.voxelize(mesh, grid, CHUNKS), vp.voxelize(mesh, grid)),
        "thin": (vp.dask.voxelize(mesh, grid, CHUNKS, "thin"), vp.voxelize(mesh, grid, "thin")),
        "solid": (vp.dask.solid(mesh, grid, CHUNKS, extent="centre"), vp.solid(mesh, grid, extent="centre")),
        "even_odd": (vp.dask.solid(mesh, grid, CHUNKS, "even_odd"), vp.solid(mesh, grid, "even_odd")),
        "band": (vp.dask.distance(mesh, grid, CHUNKS), vp.distance(mesh, grid)),
        "field": (vp.dask.distance(mesh, grid, CHUNKS, "whole"), vp.distance(mesh, grid, "whole")),
        "fractions": (vp.dask.fractions(mesh, grid, CHUNKS), vp.fractions(mesh, grid)),
    }


def check(lazy, whole, **how):
    assert isinstance(lazy, da.Array)
    assert lazy.shape == whole.shape and lazy.dtype == whole.dtype
    assert lazy.numblocks > (1, 1, 1)
    drawn = lazy.compute(**how)
    assert drawn.dtype == whole.dtype
    assert drawn.tobytes() == whole.tobytes()


def test_blocks_are_parts_of_the_whole():
    mesh = ball_and_box()
    for lazy, whole in calls(mesh, vp.fit(mesh, 40)).values():
        assert whole.any()
        check(lazy, whole)


def test_blocks_close_the_holes_of_the_whole():
    mesh = [(vertices, np.delete(triangles, 3, axis=0)) for vertices, triangles in ball_and_box()]
    grid, status = vp.fit(mesh, 40), {}
    whole = vp.fractions(mesh, grid, repair="close_holes", status=status)
    assert status["cones"] == 2 and status["open_edges"] == 0
    check(vp.dask.fractions(mesh, grid, CHUNKS, repair="close_holes"), whole)


def test_blocks_go_to_zarr(tmp_path):
    zarr = pytest.importorskip("zarr")
    mesh = ball_and_box()
    grid = vp.fit(mesh, 37)
    vp.dask.solid(mesh, grid, chunks=CHUNKS).to_zarr(str(tmp_path / "part.zarr"))
    written = zarr.open(str(tmp_path / "part.zarr"), mode="r")
    np.testing.assert_array_equal(np.asarray(written[...]), vp.solid(mesh, grid))


def test_a_cluster_of_two_processes_gives_the_whole(client):
    mesh = ball_and_box()
    for lazy, whole in calls(mesh, vp.fit(mesh, 40)).values():
        check(lazy, whole, scheduler=client.get)


def test_models_by_path_and_loaded(tmp_path, monkeypatch, client):
    vertices, triangles = sphere(levels=2)
    obj = tmp_path / "ball.obj"
    obj.write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in vertices.tolist())
        + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles.tolist())
    )
    grid = vp.fit(obj, 30)
    whole = vp.solid(obj, grid)
    monkeypatch.chdir(tmp_path)
    check(vp.dask.solid("ball.obj", grid, 13), whole, scheduler=client.get)  # relative to this process
    check(vp.dask.solid(vp.load_model(obj), grid, 13), whole)
    # A file that changes is read again.
    obj.write_text(obj.read_text().replace("f ", "# ", 1))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vp.OpenMeshWarning)
        check(vp.dask.voxelize(obj, grid, 13), vp.voxelize(obj, grid))


def test_a_mesh_that_the_workers_have(client):
    mesh = sphere(levels=2)
    grid = vp.fit(mesh, 30)
    (there,) = client.scatter([mesh])
    check(vp.dask.voxelize(there, grid, 16), vp.voxelize(mesh, grid), scheduler=client.get)


def test_nothing_is_drawn_before_it_is_computed(tmp_path, monkeypatch):
    grid = vp.fit(sphere(levels=1), 16)
    lazy = vp.dask.voxelize(tmp_path / "none.obj", grid, 8)
    with pytest.raises(FileNotFoundError):
        lazy.compute()
    # The block of a slice is drawn, the others are not.
    mesh = sphere(levels=2)
    grid = vp.fit(mesh, 64)
    drawn = []

    def voxelize(mesh, grid, **options):
        drawn.append(grid)
        return vp.voxelize(mesh, grid, **options)

    monkeypatch.setattr(voxelpipe.dask._surface, "voxelize", voxelize)
    first = vp.dask.voxelize(mesh, grid, 16)[:16, 20:25, :16]
    assert not drawn
    assert first.compute().tobytes() == vp.voxelize(mesh, grid)[:16, 20:25, :16].tobytes()
    assert [tuple(g.offset) for g in drawn] == [(0, 16, 0)]


def test_crops_are_cut_further():
    mesh = sphere(levels=3)
    crop = vp.fit(mesh, 48).crop((5, 7, 9), (30, 31, 32))
    check(vp.dask.solid(mesh, crop, 11), vp.solid(mesh, crop))


def test_what_no_block_can_do():
    mesh = sphere(levels=1)
    grid = vp.fit(mesh, 16)
    with pytest.raises(ValueError, match="exterior"):
        vp.dask.solid(mesh, grid, 8, repair="exterior")
    with pytest.raises(TypeError, match="grid"):
        vp.dask.voxelize(mesh, 64, 8)
    with pytest.raises(TypeError, match="is no mesh"):
        vp.dask.voxelize(7, grid, 8)


def volume(model, resolution):
    if os.path.basename(model.path) == "killer.obj":
        os._exit(1)
    if os.path.basename(model.path) == "raises.obj":
        raise RuntimeError("not this one")
    return int(vp.solid(model, vp.fit(model, resolution)).sum())


def some_models(folder, names):
    for name in names:
        (folder / name).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    (folder / "bad.obj").write_text("v 0 0\nf 1 2 99\n")
    return [folder / name for name in names]


def test_one_bad_model_never_ends_a_run(tmp_path):
    a, raises, b = some_models(tmp_path, ["a.obj", "raises.obj", "b.obj"])
    paths = [b, tmp_path / "bad.obj", raises, tmp_path / "none.obj", a]
    outcomes = vp.dask.map_models(paths, volume, retries=1, resolution=12)
    assert [o.path for o in outcomes] == [str(p) for p in paths]
    expected = volume(vp.load_model(a), 12)
    assert expected > 0
    assert [o.result for o in outcomes] == [expected, None, None, None, expected]
    assert [o.attempts for o in outcomes] == [1, 2, 2, 2, 1]
    assert outcomes[2].error == "RuntimeError: not this one"
    assert "none.obj" in outcomes[3].error and outcomes[0].error is None
    with pytest.raises(ValueError, match="retries"):
        vp.dask.map_models(paths, volume, retries=-1)


def test_nor_does_a_worker_that_dies(tmp_path, client):
    a, killer, b = some_models(tmp_path, ["a.obj", "killer.obj", "b.obj"])
    with client.as_current():
        outcomes = vp.dask.map_models([a, killer, b], volume, resolution=12)
    expected = volume(vp.load_model(a), 12)
    assert [o.result for o in outcomes] == [expected, None, expected]
    assert outcomes[1].error.startswith("KilledWorker")
    assert [o.path for o in outcomes] == [str(p) for p in (a, killer, b)]


def test_what_workers_cannot_have_is_refused():
    mesh = ball_and_box()
    grid = vp.fit(mesh, 16)
    with pytest.raises(ValueError, match='bodies is "all"'):
        vp.dask.fractions(mesh, grid, CHUNKS, bodies="each")
    with pytest.raises(ValueError, match="no file that workers could open"):
        vp.dask.voxelize(vp.instances(mesh[0], np.stack([np.eye(4)])), grid, CHUNKS)
