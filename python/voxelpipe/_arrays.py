# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Arrays of other libraries, in host memory."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np


def is_torch(a: Any) -> bool:
    return type(a).__module__.split(".")[0] == "torch"


def torch_of(a: Any) -> Any:
    """The module of a tensor."""
    return sys.modules["torch"]


def is_on_device(a: Any) -> bool:
    """True if an array lies in a GPU's memory."""
    return hasattr(a, "__cuda_array_interface__") or getattr(getattr(a, "device", None), "type", "cpu") == "cuda"


def to_numpy(a: Any, what: str) -> np.ndarray:
    """An array of any library in host memory; shares its memory where it can."""
    if isinstance(a, np.ndarray):
        return a
    if is_on_device(a):
        raise TypeError(f"{what} is in a GPU's memory, the mesh is not: copy it to the host, as with .cpu() or .get()")
    if hasattr(a, "detach"):  # a tensor of torch that records gradients
        a = a.detach()
    if hasattr(a, "__dlpack__") and not hasattr(a, "__array__"):
        return np.from_dlpack(a)
    return np.asarray(a)


def to_torch(a: np.ndarray) -> Any:
    """A tensor that shares the memory of an array. Unsigned numbers above uint8, with which torch can do next to nothing,
    become the next larger signed ones."""
    wider = {"uint16": np.int32, "uint32": np.int64, "uint64": np.int64}.get(a.dtype.name)
    import torch

    return torch.from_numpy(np.asarray(a if wider is None else a.astype(wider)))
