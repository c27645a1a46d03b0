# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""label(): labels by NumPy alone, and the partition of scipy.ndimage.label where SciPy is installed."""

import itertools

import numpy as np
import pytest
import voxelpipe as vp

from meshes import box

try:
    from scipy import ndimage
except ImportError:  # no requirement of the tests
    ndimage = None

CONNECTIVITIES = (6, 18, 26)


def spread_names(inside, most):
    """Lowest numbers, which go from neighbour to neighbour until nothing changes; `most` coordinates differ."""
    names = np.full(np.add(inside.shape, 2), inside.size)
    within = names[1:-1, 1:-1, 1:-1]
    within[inside] = np.flatnonzero(inside)
    steps = [s for s in itertools.product((0, 1, 2), repeat=3) if 0 < sum(n != 1 for n in s) <= most]
    while True:
        before = within.copy()
        for z, y, x in steps:
            near = names[z : z + inside.shape[0], y : y + inside.shape[1], x : x + inside.shape[2]]
            within[inside] = np.minimum(within, near)[inside]
        if np.array_equal(before, within):
            return np.where(inside, within, -1)


@pytest.mark.parametrize("connectivity", CONNECTIVITIES)
@pytest.mark.parametrize("shape", [(7, 9, 65), (9, 17, 64), (1, 1, 1), (5, 1, 130)])
def test_labels_are_the_lowest_numbers_of_components(shape, connectivity):
    rank = CONNECTIVITIES.index(connectivity) + 1
    random = np.random.default_rng(7)
    for share in (0.1, 0.3, 0.6, 1.0):
        inside, status = random.random(shape) < share, {}
        labels, parts = vp.label(inside, connectivity, components=True, status=status)
        assert labels.dtype == np.int32 and np.array_equal(labels, spread_names(inside, rank))
        names, counts = np.unique(labels[inside], return_counts=True)
        assert np.array_equal(parts["name"], names) and np.array_equal(parts["voxels"], counts)
        assert status == {"components": len(names)}
        for name, low, high in zip(names, parts["min"], parts["max"]):
            at = np.argwhere(labels == name)[:, ::-1]
            assert np.array_equal(low, at.min(axis=0)) and np.array_equal(high, at.max(axis=0))
        if ndimage is not None:
            partition, count = ndimage.label(inside, ndimage.generate_binary_structure(3, rank))
            pairs = np.unique(np.stack([labels.ravel(), partition.ravel()]), axis=1)
            assert count == len(names) and len(set(pairs[0])) == len(set(pairs[1])) == pairs.shape[1]


def test_bodies_of_a_solid_have_labels_and_boxes():
    grid = vp.Grid((0, 0, 0), (1, 1, 1), (6, 8, 12))
    inside = vp.solid([box((1, 1, 1), (4, 4, 4)), box((6, 2, 2), (11, 7, 5))], grid, extent="centre")
    labels, parts = vp.label(inside, components=True)
    assert parts["name"].tolist() == [1 + 12 * (1 + 8), 6 + 12 * (2 + 8 * 2)]
    assert parts["voxels"].tolist() == [27, 75]
    assert parts["min"].tolist() == [[1, 1, 1], [6, 2, 2]] and parts["max"].tolist() == [[3, 3, 3], [10, 6, 4]]
    assert (labels[~inside] == -1).all() and (labels[1:4, 1:4, 1:4] == parts["name"][0]).all()
    assert np.array_equal(vp.label(inside.astype(np.uint8) * 3, threads=1), labels)
    assert np.array_equal(vp.label(np.asfortranarray(inside), threads=2), labels)


def test_mistakes_are_named():
    inside = np.ones((2, 3, 4), bool)
    for connectivity in (4, 8, 27):
        with pytest.raises(ValueError, match="connectivity is 6, 18 or 26"):
            vp.label(inside, connectivity)
    with pytest.raises(TypeError, match="float64"):
        vp.label(inside.astype(float))
    with pytest.raises(ValueError, match=r"\(nz, ny, nx\)"):
        vp.label(inside[0])
    with pytest.raises(ValueError, match=r"\(nz, ny, nx\)"):
        vp.label(inside[:, :0])
    with pytest.raises(ValueError, match="threads"):
        vp.label(inside, threads=-1)
