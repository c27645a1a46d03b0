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
