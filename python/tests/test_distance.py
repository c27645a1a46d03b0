# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, sphere


def box_distance(points, low, high):
    """Signed, of points (..., 3)."""
    middle, half = (np.add(low, high)) / 2, np.subtract(high, low) / 2
    q = np.abs(points - middle) - half
    outside = np.linalg.norm(np.maximum(q, 0), axis=-1)
    return outside + np.minimum(q.max(axis=-1), 0)


def samples(grid, corners=False):
    shape = tuple(n + corners for n in grid.shape)
    z, y, x = np.indices(shape)
    at = np.stack([x, y, z], axis=-1) + (0 if corners else 0.5)
    return np.asarray(grid.origin) + at * np.asarray(grid.voxel_size)


GRID = vp.Grid((0, 0, 0), (0.5, 0.5, 0.5), (14, 15, 16))
LOW, HIGH = (2, 2.5, 2), (5.5, 5, 5.5)


@pytest.mark.parametrize("corners", [False, True])
def test_whole_field_of_a_box_is_exact(corners):
    d = vp.distance(box(LOW, HIGH), GRID, "whole", corners=corners)
    expected = box_distance(samples(GRID, corners), LOW, HIGH).astype(np.float32)
    assert d.dtype == np.float32 and np.array_equal(d, expected)


def test_band_holds_its_distance_and_the_rest_the_band():
    status = {}
    d = vp.distance(box(LOW, HIGH), GRID, 1.5, status=status)
    expected = np.clip(box_distance(samples(GRID), LOW, HIGH), -0.75, 0.75).astype(np.float32)
    assert np.array_equal(d, expected)
    assert status["band_samples"] == (np.abs(box_distance(samples(GRID), LOW, HIGH)) <= 0.75).sum()


def test_voxels_may_have_three_sizes():
    grid = vp.Grid((0, 0, 0), (0.5, 0.25, 0.125), (40, 30, 16))
    d = vp.distance(box(LOW, HIGH), grid, 2)
    expected = np.clip(box_distance(samples(grid), LOW, HIGH), -1, 1).astype(np.float32)
    assert np.array_equal(d, expected)


def test_nearest_is_the_first_triangle_of_those_at_the_distance():
    d, nearest = vp.distance([box((1, 1, 1), (3, 3, 3)), box((4, 1, 1), (6, 3, 3))], GRID, 1, nearest=True)
    assert nearest.dtype == np.int64 and nearest.shape == d.shape
    assert nearest[4, 4, 1] in (8, 9) and nearest[4, 4, 12] in (22, 23)  # low x face of the first, high x of the second
    assert nearest.max() < 24 and (nearest[np.abs(d) < 0.5] >= 0).all() and (nearest == -1).any()


def test_sign_is_that_of_a_solid():
    shell, core = box((1, 1, 1), (6.5, 6.5, 6.5)), box((2.5, 2.5, 2.5), (5, 5, 5))
    for fill in ("nonzero", "even_odd", "positive"):
        d = vp.distance([shell, core], GRID, "whole", fill)
        assert np.array_equal(d < 0, vp.solid([shell, core], GRID, fill, extent="centre"))
    assert (vp.distance([shell, core], GRID, "whole", "unsigned") == np.abs(d)).all()


def test_open_mesh_warns_and_repairs_decide_the_sign():
    v, f = box((1, 1, 1), (6, 6, 6))
    holed = (v, np.delete(f, [8, 9], axis=0))  # without the low x face
    with pytest.warns(vp.OpenMeshWarning, match="rows of samples"):
        vp.distance(holed, GRID)
    closed = vp.distance(holed, GRID, "whole", repair="close_holes")
    assert np.array_equal(vp.distance(holed, GRID, "whole", repair="winding"), closed)  # the hole is flat
    assert np.array_equal(closed < 0, vp.solid((v, f), GRID, extent="centre"))
    for sample in ("centre", "corner"):
        assert (vp.distance(holed, GRID, sign="unsigned", corners=sample == "corner") >= 0).all()


def test_crop_is_the_crop_of_the_whole():
    mesh = sphere(2.0, (3.5, 3.6, 3.7))
    whole = vp.distance(mesh, GRID, 2)
    part = GRID.crop((3, 4, 2), (6, 8, 11))
    assert np.array_equal(vp.distance(mesh, part, 2), whole[3:9, 4:12, 2:13])


def test_positions_in_double_far_from_the_origin():
    offset = np.array([1e6, -2e6, 3e6]) + 1 / 3
    v, f = box(LOW, HIGH, np.float64)
    far = vp.Grid(tuple(offset), (0.5, 0.5, 0.5), GRID.shape)
    assert np.allclose(vp.distance((v + offset, f), far), vp.distance((v, f), GRID), atol=1e-5)


def test_no_triangles_are_the_band_away():
    nothing = (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))
    assert (vp.distance(nothing, GRID) == np.float32(1.5)).all()
    assert (vp.distance(nothing, GRID, "whole") == math.inf).all()


def test_what_is_refused():
    mesh = box(LOW, HIGH)
    for band in (0, -1, math.inf, math.nan, "half"):
        with pytest.raises(ValueError, match="band"):
            vp.distance(mesh, GRID, band)
    with pytest.raises(ValueError, match="unsigned"):
        vp.distance(mesh, GRID, sign="unsigned", repair="vote")
    with pytest.raises(ValueError, match="nonzero"):
        vp.distance(mesh, GRID, sign="odd")
    with pytest.raises(IndexError):
        vp.distance((mesh[0], mesh[1] + 8), GRID)


def test_any_number_of_threads_gives_the_same_bytes():
    mesh = sphere(2.5, (3.5, 3.6, 3.7))
    one = vp.distance(mesh, GRID, threads=1)
    assert one.tobytes() == vp.distance(mesh, GRID, threads=3).tobytes()


def test_torch_gives_tensors():
    torch = pytest.importorskip("torch")
    v, f = box(LOW, HIGH)
    mesh = torch.from_numpy(v), torch.from_numpy(f.astype(np.int64))
    d, nearest = vp.distance(mesh, GRID, nearest=True)
    assert torch.is_tensor(d) and d.dtype == torch.float32 and nearest.dtype == torch.int64
    assert np.array_equal(d.numpy(), vp.distance((v, f), GRID))


def test_points_get_the_distance_of_the_whole_field():
    mesh = box(LOW, HIGH)
    at = samples(GRID).reshape(-1, 3).astype(np.float32)
    d, nearest = vp.distance_at(mesh, at, GRID, nearest=True)
    assert d.dtype == np.float32 and nearest.dtype == np.int64
    field, numbers = vp.distance(mesh, GRID, "whole", nearest=True)
    assert np.array_equal(d, field.ravel()) and np.array_equal(nearest, numbers.ravel())
    anywhere = np.array([[100.0, 3, 3], [4, 3, 4], [2, 2.5, 2]])
    assert np.allclose(vp.distance_at(mesh, anywhere), box_distance(anywhere, LOW, HIGH), atol=1e-4)


def test_points_that_have_no_distance_are_counted():
    mesh = box(LOW, HIGH)
    status = {}
    at = np.array([[0, 0, 0], [np.nan, 0, 0], [np.inf, 0, 0], [1e30, 0, 0]], np.float32)
    d, nearest = vp.distance_at(mesh, at, nearest=True, status=status)
    assert math.isfinite(d[0]) and np.isnan(d[1:]).all() and (nearest[1:] == -1).all() and nearest[0] >= 0
    assert status["bad_points"] == 3
    with pytest.raises(ValueError, match=r"\(n, 3\)"):
        vp.distance_at(mesh, np.zeros((3, 2)))
    with pytest.raises(ValueError):
        vp.distance_at(mesh, at, repair="vote")
    with pytest.raises(ValueError, match="nonzero"):
        vp.distance_at(mesh, at, sign="even_odd", repair="winding")


def test_points_in_double_far_from_the_origin():
    """Vertices that single precision holds, and points that it does not."""
    vertices, triangles = box(np.add(LOW, 2**21), np.add(HIGH, 2**21))
    assert np.array_equal(np.float32(vertices), vertices)
    grid = vp.Grid((2**21,) * 3, (0.125,) * 3, (56, 60, 64))
    at = samples(grid)
    assert not np.array_equal(at.astype(np.float32), at)
    field = vp.distance((vertices, triangles), grid, "whole")
    np.testing.assert_array_equal(vp.distance_at((vertices, triangles), at.reshape(-1, 3), grid), field.reshape(-1))
    single = (np.asarray(vertices, np.float32), triangles)
    np.testing.assert_array_equal(vp.distance_at(single, at.reshape(-1, 3), grid), field.reshape(-1))


def test_a_flood_of_a_grid_within_the_mesh_is_refused():
    mesh = box((-2, -2, -2), (2, 2, 2))
    grid = vp.Grid((-0.5,) * 3, (0.125,) * 3, (8, 8, 8))
    for call in (vp.solid, vp.distance, vp.remesh, vp.tiles):
        with pytest.raises(ValueError, match="crop_without_whole|whole|within"):
            call(mesh, grid, repair="exterior")
    with pytest.raises(ValueError):
        vp.sparse(mesh, grid, solid="nonzero", repair="exterior")
