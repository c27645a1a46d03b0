# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import voxelpipe as vp

from meshes import box, box_surface, sphere


def test_box_on_the_lattice():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (10, 11, 12))
    surface = vp.voxelize(box((2, 3, 4), (6, 8, 9)), grid)
    assert surface.dtype == np.bool_ and surface.shape == (10, 11, 12)
    assert np.array_equal(surface, box_surface((2, 3, 4), (6, 8, 9), grid.shape))


def test_packed_bits_are_the_same_voxels():
    mesh = sphere()
    grid = vp.fit(mesh, 45)
    for coverage in ("conservative", "thin"):
        dense = vp.voxelize(mesh, grid, coverage)
        words = vp.voxelize(mesh, grid, coverage, packed=True)
        assert words.dtype == np.uint32 and words.shape == (45, 45, 2)
        bits = np.unpackbits(words.view(np.uint8), axis=-1, bitorder="little")[..., :45].astype(bool)
        assert np.array_equal(bits, dense)


def test_thin_crosshair_and_diagonal_are_part_of_conservative_and_less():
    mesh = sphere(levels=3)
    grid = vp.fit(mesh, 64)
    thin, conservative = vp.voxelize(mesh, grid, "thin"), vp.voxelize(mesh, grid)
    crosshair = vp.voxelize(mesh, grid, "crosshair")
    assert not (thin & ~conservative).any() and not (crosshair & ~conservative).any()
    assert 0.8 < crosshair.sum() / thin.sum() < 1
    diagonal = vp.voxelize(mesh, grid, "diagonal")
    assert not (diagonal & ~conservative).any() and 0.95 < diagonal.sum() / conservative.sum() <= 1
    assert 0.3 < thin.sum() / conservative.sum() < 0.8


def test_threads_and_crops_give_the_same_bytes():
    mesh = sphere(levels=3)
    grid = vp.fit(mesh, 50)
    whole = vp.voxelize(mesh, grid, threads=1)
    assert np.array_equal(whole, vp.voxelize(mesh, grid, threads=3))
    part = vp.voxelize(mesh, grid.crop((7, 11, 13), (20, 21, 22)))
    assert np.array_equal(part, whole[7:27, 11:32, 13:35])


def test_far_from_the_origin_in_double():
    """Positions in double lose nothing to a far origin, and those that float32 holds are drawn as float32."""
    v, f = sphere(levels=3, dtype=np.float64)
    v = v.astype(np.float32).astype(np.float64)
    near = vp.Grid((-1.5, -1.5, -1.5), (1 / 16,) * 3, (48, 48, 48))
    far = vp.Grid(tuple(np.array(near.origin) + 4194304.0), near.voxel_size, near.shape)
    expected = vp.voxelize((v.astype(np.float32), f), near)
    assert np.array_equal(vp.voxelize((v, f), near), expected)
    assert np.array_equal(vp.voxelize((v + 4194304.0, f), far), expected)
    assert not np.array_equal(vp.voxelize(((v + 4194304.0).astype(np.float32), f), far), expected)


@pytest.mark.parametrize("dtype", [np.int32, np.uint32, np.int64, np.uint64, np.int16, np.uint8])
def test_indices_of_every_type(dtype):
    v, f = box()
    grid = vp.fit((v, f), 8)
    assert np.array_equal(vp.voxelize((v, f.astype(dtype)), grid), vp.voxelize((v, f), grid))


@pytest.mark.parametrize("dtype, bad", [(np.int32, -1), (np.int64, -1), (np.int64, 2**33), (np.uint32, 8), (np.int16, -7)])
def test_bad_index_names_the_triangle(dtype, bad):
    v, f = box()
    broken = f.astype(dtype)
    broken[5, 1] = bad
    with pytest.raises(IndexError, match="triangle 5"):
        vp.voxelize((v, broken), vp.fit((v, f), 8))


def test_bad_arguments():
    v, f = box()
    grid = vp.fit((v, f), 8)
    with pytest.raises(ValueError, match="coverage is one of 'conservative'"):
        vp.voxelize((v, f), grid, "thick")
    with pytest.raises(ValueError, match=r"\(v, 3\)"):
        vp.voxelize((v[:, :2], f), grid)
    with pytest.raises(ValueError, match=r"\(f, 3\)"):
        vp.voxelize((v, np.zeros((2, 4), int)), grid)
    with pytest.raises(ValueError, match="integers"):
        vp.voxelize((v, f.astype(float)), grid)
    with pytest.raises(TypeError, match="no mesh"):
        vp.voxelize(3, grid)


def test_dropped_triangles_warn():
    v, f = box()
    v[0, 0] = np.nan
    status = {}
    with pytest.warns(vp.DroppedTrianglesWarning, match="of 12 triangles"):
        vp.voxelize((v, f), vp.Grid((0, 0, 0), (0.25,) * 3, (4, 4, 4)), status=status)
    assert status["triangles"] == 12 and 0 < status["triangles_dropped"] < 12


def test_nothing_is_drawn_of_no_triangles():
    v, f = box()
    assert not vp.voxelize((v, f[:0]), vp.fit((v, f), 4)).any()
    assert not vp.voxelize([], vp.fit((v, f), 4)).any()


def test_list_of_meshes_is_the_union():
    a, b = sphere(1, (0, 0, 0)), sphere(0.5, (1, 1, 1))
    grid = vp.fit([a, b], 40)
    assert np.array_equal(vp.voxelize([a, b], grid), vp.voxelize(a, grid) | vp.voxelize(b, grid))
    v, f = box()
    with pytest.raises(IndexError, match="triangle 0 of part 0"):
        vp.voxelize([(v, f + 8), a], grid)


def test_fragments():
    mesh = sphere(levels=2)
    grid = vp.fit(mesh, 24)
    lists = vp.fragments(mesh, grid)
    surface = vp.voxelize(mesh, grid)
    seen = np.zeros_like(surface)
    seen[tuple(lists.voxels.T[::-1])] = True
    assert np.array_equal(seen, surface)
    assert lists.offsets[0] == 0 and lists.offsets[-1] == len(lists.triangles) == len(lists.barycentrics)
    assert (np.diff(lists.offsets) > 0).all()
    assert np.allclose(lists.barycentrics.sum(axis=1), 1, atol=1e-5) and (lists.barycentrics >= 0).all()
    # A fragment's point lies within its voxel's column, so not far from the voxel.
    owner = np.repeat(np.arange(len(lists.voxels)), np.diff(lists.offsets))
    corners = mesh[0][mesh[1][lists.triangles]]
    points = (corners * lists.barycentrics[:, :, np.newaxis]).sum(axis=1)
    voxel = (points - grid.origin) / grid.voxel_size
    assert np.abs(voxel - (lists.voxels[owner] + 0.5)).max() < 2
    for i in range(len(lists.voxels)):
        triangles = lists.triangles[lists.offsets[i] : lists.offsets[i + 1]]
        assert (np.diff(triangles) > 0).all()
    assert lists.triangles.dtype == np.int32
    for values in (mesh[0], mesh[0][:, 0]):
        assert np.allclose(lists.interpolate(values, mesh[1]), points if values.ndim == 2 else points[:, 0], atol=1e-6)
