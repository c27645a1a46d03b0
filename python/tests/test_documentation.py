# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""What a package index and help() show."""

import inspect
import pathlib
import re

import pytest
import voxelpipe as vp
import voxelpipe.dask


def test_every_function_has_an_example():
    functions = [f for f in (getattr(vp, name) for name in vp.__all__) if inspect.isfunction(f)]
    assert len(functions) > 15
    lazy = voxelpipe.dask
    functions += [f for f in (getattr(lazy, name) for name in lazy.__all__) if inspect.isfunction(f)]
    for f in functions:
        assert "Example:\n        >>> " in f.__doc__, f.__name__
        arguments = re.findall(r"^        ((?:\w+, )*\w+): ", f.__doc__, re.M)
        named = {name for group in arguments for name in group.split(", ")}
        assert set(inspect.signature(f).parameters) <= named or not inspect.signature(f).parameters, f.__name__
    for name in ("zyx", "index", "to_xyz", "to_ijk", "ijk"):
        assert "Example: ``" in getattr(vp.Grid, name).__doc__


def test_nothing_but_the_package_is_public():
    # `dask` is a module for those who import it.
    assert {name for name in dir(vp) if not name.startswith("_")} - {"dask"} == set(vp.__all__)


def test_links_of_the_package_page_are_absolute():
    readme = pathlib.Path(__file__).parents[1] / "README.md"
    if not readme.exists():
        pytest.skip("not beside the sources")
    links = re.findall(r"\]\(([^)]+)\)", readme.read_text(encoding="utf-8"))
    assert len(links) >= 3 and all(link.startswith("https://") for link in links)
