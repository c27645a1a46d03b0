# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Where arrays are put to test what runs on a GPU."""

import sys
import types

import numpy as np
import pytest


class Torch:
    def __init__(self):
        pytest.importorskip("voxelpipe_cuda")
        self.torch = pytest.importorskip("torch")
        if not self.torch.cuda.is_available():
            pytest.skip("no GPU")

    def put(self, a):
        return self.torch.from_numpy(np.ascontiguousarray(a)).cuda()

    def is_ours(self, a):
        return isinstance(a, self.torch.Tensor) and a.is_cuda

    def get(self, a):
        return a.cpu().numpy()


class Cupy:
    def __init__(self):
        pytest.importorskip("voxelpipe_cuda")
        self.cupy = pytest.importorskip("cupy")
        if self.cupy.cuda.runtime.getDeviceCount() == 0:
            pytest.skip("no GPU")

    def put(self, a):
        return self.cupy.asarray(a)

    def is_ours(self, a):
        return isinstance(a, self.cupy.ndarray)

    def get(self, a):
        return a.get()


class StandIn(Cupy):
    """No GPU: CuPy and the module are those of stand_in_cupy and stand_in_cuda."""

    def __init__(self, monkeypatch):
        import stand_in_cuda
        import stand_in_cupy

        monkeypatch.setitem(sys.modules, "cupy", stand_in_cupy)
        monkeypatch.setitem(sys.modules, "voxelpipe_cuda", types.SimpleNamespace(_cuda=stand_in_cuda))
        self.cupy = stand_in_cupy


def same(gpu, on_device, on_host):
    """The same bytes, type and shape; a surface's faces are 64 bits wide for torch."""
    assert gpu.is_ours(on_device)
    a, b = gpu.get(on_device), on_host
    assert a.dtype == b.dtype and a.shape == b.shape
    assert a.tobytes() == b.tobytes()
