#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a Spack recipe without Spack: its directives are recorded, and cmake_args is called with and without CUDA. Directives and names that
the recipe misspells are found, and options that CMakeLists.txt does not have; whether Spack concretizes it is not.

    spack.py RECIPE CMAKE_LISTS
"""
import pathlib
import re
import sys
import types

DIRECTIVES = ["license", "version", "depends_on", "requires", "variant", "conflicts", "maintainers"]
calls = []
package = types.ModuleType("spack.package")
for name in DIRECTIVES:
    setattr(package, name, lambda *args, _name=name, **options: calls.append((_name, args, options)))


class CMakePackage:
    run_tests = False

    def define(self, name, value):
        text = ";".join(value) if isinstance(value, list) else {True: "ON", False: "OFF"}.get(value, value)
        return f"-D{name}={text}"


package.CMakePackage = CMakePackage
package.CudaPackage = type("CudaPackage", (), {})
sys.modules["spack"] = types.ModuleType("spack")
sys.modules["spack.package"] = package

recipe, lists = map(pathlib.Path, sys.argv[1:])
scope = {}
exec(compile(recipe.read_text(encoding="utf-8"), recipe, "exec"), scope)
text = re.sub(r"\s+", " ", lists.read_text(encoding="utf-8"))
for cuda in (False, True):
    spec = types.SimpleNamespace(satisfies=lambda what, cuda=cuda: {"+cuda": cuda}[what],
                                 variants={"cuda_arch": types.SimpleNamespace(value=("90",))})
    made = scope["Voxelpipe"]()
    made.spec = spec
    for argument in made.cmake_args():
        option = re.match(r"-D(\w+)=\S+$", argument)[1]
        assert option.startswith("CMAKE_") or re.search(rf"\b(option|set)\({option}\b", text), f"CMakeLists.txt has no {option}"
    assert any(a.startswith("-DCMAKE_CUDA_ARCHITECTURES=90") for a in made.cmake_args()) == cuda
assert [c for c in calls if c[0] == "version"] and re.fullmatch(r"[0-9a-f]{64}", dict(calls[1][2])["sha256"]), calls
print(f"the recipe of Spack: {len(calls)} directives")
