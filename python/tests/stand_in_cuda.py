# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""A stand-in for voxelpipe_cuda._cuda where there is no GPU: takes what voxelpipe gives that module, addresses of
stand_in_cupy's arrays among it, and has the CPU's module do the work."""

import ctypes
import math

import numpy as np
from voxelpipe import Grid, _core


def at(address, shape, dtype):
    """The array at an address; None at 0, unless it is empty."""
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if size == 0:
        return np.empty(shape, dtype)
    return np.frombuffer((ctypes.c_char * size).from_address(address), dtype).reshape(shape) if address else None


def grid_of(state):
    g = Grid.__new__(Grid)
    g.__setstate__(state)
    return g


def mesh_of(positions, triangles):
    return at(positions[0], (positions[1], 3), np.float32), at(triangles[0], (triangles[1], 3), np.uint32)


def solid_mask(on, positions, triangles, firsts, state, *options_and_out):
    *options, out = options_and_out
    g = grid_of(state)
    return _core.solid_dense(*mesh_of(positions, triangles), firsts, g, *options, at(out, g.shape, np.uint8), None, 0)


def diagnose_repair(on, positions, triangles, firsts, state, bodies, closing):
    return _core.diagnose_repair(*mesh_of(positions, triangles), firsts, grid_of(state), bodies, closing, 0)


def distance_field(on, positions, triangles, firsts, state, *options_and_out):
    *options, out, nearest = options_and_out
    g = grid_of(state)
    shape = [n + options[-1] for n in g.shape]
    arrays = (at(out, shape, np.float32), at(nearest, shape, np.int64))
    return _core.distance_field(*mesh_of(positions, triangles), firsts, g, *options, *arrays, 0)


def distance_at(on, positions, triangles, firsts, state, points, *options_and_out):
    *options, out, nearest = options_and_out
    n = points[1]
    arrays = (at(out, (n,), np.float32), at(nearest, (n,), np.int64))
    where = at(points[0], (n, 3), np.float32)
    return _core.distance_at(*mesh_of(positions, triangles), firsts, grid_of(state), where, *options, *arrays, 0)


def fractions(on, positions, triangles, state, axis, close_holes, max_hole_edges, out, faces, inner):
    g = grid_of(state)
    wide = list(g.shape)
    wide[2 - axis] += 1
    shapes = [wide, (*g.shape, 3), (*wide, 3), (*g.shape, 3), g.shape, (*g.shape, 3), g.shape]
    types = [np.float64, np.float64, np.float32, np.float32, np.float64, np.float32, np.bool_]
    arrays = [at(a, shape, dtype) for a, shape, dtype in zip((*faces, *inner), shapes, types)]
    given = (at(out, g.shape, np.float32), *arrays, close_holes, max_hole_edges, 0)
    return _core.fractions(*mesh_of(positions, triangles), g, axis, *given)


class Surface:
    def __init__(self, made, floats=None, integers=None):
        *self.arrays, self.counts = made
        self.num_vertices, self.num_faces = len(made[0]), len(made[1])
        self.num_corners = made[1].shape[1]
        self.values = [floats, integers]

    def copy(self, arrays, wide, floats, integers):
        n = self.num_vertices
        if len(self.arrays[4]) != n:
            self.arrays[4] = np.full(n, -1, np.int64)
        types = [np.float64, np.int64 if wide else np.uint32, np.int32, np.uint8, np.int64]
        for address, dtype, a in zip(arrays, types, self.arrays):
            at(address, a.shape, dtype)[...] = a
        for (address, columns), a in zip((floats, integers), self.values):
            if columns:
                at(address, (n, columns), a.dtype)[...] = a


def remesh(on, positions, triangles, firsts, state, world, corners, *rest):
    inside, shape, (floats, integers) = rest[:7], rest[7:11], rest[11:]
    where = grid_of(world)
    arrays = []
    for columns, dtype in ((floats, np.float32), (integers, np.int64)):
        for (address, n), rows in zip(columns, (positions[1], triangles[1])):
            arrays.append(at(address, (rows, n), dtype))
    return Surface(
        *_core.remesh(
            *mesh_of(positions, triangles),
            firsts,
            grid_of(state),
            _core.at_corners(where) if corners else where,
            *inside,
            corners,
            *shape,
            *arrays,
            0,
        )
    )


def _samples(state, corners):
    return _core.at_corners(grid_of(state)) if corners else grid_of(state)


def extract_bits(on, values, shape, state, corners, place, *options):
    return Surface(_core.extract_bits(at(values, shape, np.uint8), _samples(state, corners), place, *options, 0))


def extract_field(on, values, shape, state, corners, place, level, *options):
    return Surface(_core.extract_field(at(values, shape, np.float32), _samples(state, corners), place, level, *options, 0))


class Components:
    def __init__(self, made):
        self.count, *self.arrays = made

    def copy(self, *addresses):
        for address, a in zip(addresses, self.arrays):
            at(address, a.shape, a.dtype)[...] = a


def label(on, values, shape, connectivity, components, labels, wide):
    from voxelpipe._surface import packed

    out = at(labels, shape, np.int64 if wide else np.int32)
    return Components(_core.label(packed(at(values, shape, np.bool_)), out, connectivity, components, 0))
