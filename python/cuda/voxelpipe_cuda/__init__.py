# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""voxelpipe on NVIDIA GPUs. Import voxelpipe: it finds this package, and draws meshes that lie in a GPU's memory there."""

from . import _cuda

__all__ = ["_cuda"]
