# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""What voxelpipe uses of CuPy, in host memory: a stand-in for tests of the way to a GPU where there is none. Its arrays are
no arrays of NumPy, and do not become some unless get() is called."""

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin


class Device:
    def __init__(self, number):
        self.id = number

    def __eq__(self, other):
        return self.id == other.id

    def __enter__(self):
        return self

    def __exit__(self, *error):
        return None


def _plain(a):
    return a._a if isinstance(a, ndarray) else a


def _wrapped(a, number):
    return ndarray(a, number) if isinstance(a, np.ndarray) else ndarray(np.asarray(a), number)


class ndarray(NDArrayOperatorsMixin):  # noqa: N801, the name that CuPy gives it
    """`number`: of the GPU."""

    def __init__(self, a, number=0):
        self._a = a
        self._number = number

    def get(self):
        return self._a

    def __array__(self, *args, **options):
        raise TypeError("Implicit conversion to a NumPy array is not allowed.")

    def __array_ufunc__(self, ufunc, method, *given, **options):
        return _wrapped(getattr(ufunc, method)(*map(_plain, given), **options), self._number)

    @property
    def __cuda_array_interface__(self):
        return self._a.__array_interface__

    @property
    def device(self):
        return Device(self._number)

    @property
    def data(self):
        class Memory:
            ptr = self._a.ctypes.data

        return Memory

    def __getattr__(self, name):
        if name not in ("dtype", "shape", "ndim", "size", "itemsize"):
            raise AttributeError(name)
        return getattr(self._a, name)

    def __len__(self):
        return len(self._a)

    def __bool__(self):
        return bool(self._a)

    def __int__(self):
        return int(self._a)

    __index__ = __int__

    def tolist(self):
        return self._a.tolist()

    def __iter__(self):
        return (_wrapped(row, self._number) for row in self._a)

    def __getitem__(self, key):
        keys = tuple(map(_plain, key)) if isinstance(key, tuple) else _plain(key)
        return _wrapped(self._a[keys], self._number)

    def __setitem__(self, key, value):
        keys = tuple(map(_plain, key)) if isinstance(key, tuple) else _plain(key)
        self._a[keys] = _plain(value)

    def nonzero(self):
        return tuple(_wrapped(a, self._number) for a in self._a.nonzero())

    def astype(self, dtype):
        return _wrapped(self._a.astype(dtype), self._number)

    def view(self, dtype):
        return _wrapped(self._a.view(dtype), self._number)

    def any(self, axis=None):
        return _wrapped(self._a.any(axis), self._number)

    def all(self, axis=None):
        return _wrapped(self._a.all(axis), self._number)

    def min(self, axis=None):
        return _wrapped(self._a.min(axis), self._number)

    def max(self, axis=None):
        return _wrapped(self._a.max(axis), self._number)


def asarray(a, dtype=None):
    return a if isinstance(a, ndarray) and dtype in (None, a.dtype) else ndarray(np.array(_plain(a), dtype))


def ascontiguousarray(a, dtype=None):
    with np.errstate(over="ignore", invalid="ignore"):
        return ndarray(np.ascontiguousarray(_plain(a), dtype), getattr(a, "_number", 0))


def empty(shape, dtype):
    """Filled with what shows where nobody has written."""
    made = np.empty(shape, dtype)
    made.view(np.uint8).fill(0xCD) if made.ndim else None
    return ndarray(made)


def zeros(shape, dtype):
    return ndarray(np.zeros(shape, dtype))


def isfinite(a):
    return np.isfinite(a)


def rint(a):
    return np.rint(a)


def concatenate(arrays):
    return ndarray(np.concatenate([a._a for a in arrays]))


def stack(arrays, axis=0):
    return ndarray(np.stack([a._a for a in arrays], axis))


class cuda:  # noqa: N801
    class runtime:  # noqa: N801
        @staticmethod
        def getDeviceCount():  # noqa: N802
            return 1

    class _Stream:
        ptr = 0

    @staticmethod
    def get_current_stream():
        return cuda._Stream
