#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Parses and renders a conda recipe with rattler-build's own library; nothing is built, for that needs a channel of packages.

    conda.py RECIPE
"""
import pathlib
import sys

import rattler_build

recipe = rattler_build.Stage0Recipe.from_file(pathlib.Path(sys.argv[1]))
# The compiler and the C library are named by the channel, conda-forge for one.
rendered = recipe.render(rattler_build.VariantConfig.from_yaml("c_stdlib: [sysroot]\nc_stdlib_version: [\"2.28\"]\n"))
assert len(rendered) == 1
package = rendered[0].recipe.package
print(f"the recipe of conda: {package.name} {package.version}, rattler-build {rattler_build.rattler_build_version()}")
