# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The files that models were read from: save() does not replace them."""

from __future__ import annotations

import os
from typing import Iterable

# By device and inode: the paths that were read, absolute, and what messages call the file.
_read: dict[tuple[int, int], dict[str, str]] = {}


def _note(path: str, what: str) -> None:
    try:
        found = os.stat(path)
    except OSError:  # the reader says so
        return
    _read.setdefault((found.st_dev, found.st_ino), {})[os.path.abspath(path)] = what


def note_model(path: str, named: Iterable[str]) -> None:
    """A model is read, and the files that it names."""
    _note(path, f"the model {path!r}")
    for file in named:
        _note(file, f"a file of {path!r}")


def refuse_input(path: str) -> None:
    """Raises ValueError if `path`, through links and by any spelling, is a file that a model was read from."""
    try:
        found = os.stat(path)
    except OSError:
        return
    for read, what in _read.get((found.st_dev, found.st_ino), {}).items():
        try:
            if os.path.samefile(read, path):  # not another file that got the number of one that is gone
                raise ValueError(f"{path} is {what}; give another name")
        except OSError:
            continue
