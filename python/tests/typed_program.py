# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checked by mypy, not run: the package has types, and they are those that a program expects."""

import numpy as np
import voxelpipe as vp


def occupied(vertices: np.ndarray, triangles: np.ndarray) -> int:
    grid: vp.Grid = vp.fit((vertices, triangles), 64)
    shape: tuple[int, int, int] = grid.shape
    picture: np.ndarray = vp.render(vp.voxelize((vertices, triangles), grid), grid)
    lists: vp.Fragments = vp.fragments((vertices, triangles), grid)
    field: np.ndarray = vp.distance((vertices, triangles), grid, "whole", corners=True)
    del picture, lists, field
    return shape[0]
