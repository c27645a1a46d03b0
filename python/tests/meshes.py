# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Meshes that the tests make, as (vertices, triangles)."""

import numpy as np


def box(low=(0, 0, 0), high=(1, 1, 1), dtype=np.float32):
    """A closed box, faces outward."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float64)
    vertices = np.asarray(low) + corners * (np.asarray(high, np.float64) - np.asarray(low))
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return vertices.astype(dtype), np.array(triangles, np.uint32)


def sphere(radius=1.0, centre=(0, 0, 0), levels=2, dtype=np.float32):
    """An octahedron, each triangle split into four `levels` times, on the sphere."""
    v = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float64)
    f = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(levels):
        edges = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1)
        unique, number = np.unique(edges, axis=0, return_inverse=True)
        middle = v[unique].sum(axis=1)
        number = number.reshape(3, -1) + len(v)
        v = np.concatenate([v, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        a, b, c = f.T
        ab, bc, ca = number
        f = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return (v * radius + np.asarray(centre)).astype(dtype), f.astype(np.uint32)


def box_surface(low, high, shape):
    """The voxels whose closed box meets the surface of the box of lattice points low to high (x, y, z): by hand."""
    z, y, x = np.indices(shape)
    touches = np.ones(shape, bool)
    within = np.ones(shape, bool)
    for index, a, b in zip((x, y, z), low, high):
        touches &= (index + 1 >= a) & (index <= b)
        within &= (index > a) & (index + 1 < b)
    return touches & ~within
