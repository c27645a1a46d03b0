#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checks the direction of the library's includes. Prints each include that breaks a rule; the exit status is 1 if any does.

Inside voxelpipe/device/ an include names a file of the same folder or of a folder further down:

    optional            (compiled by programs that call it only: solids, sparse framebuffers)
    device/ itself      (backend, voxelize_async, abuffer_async)
    solid, sparse
    call
    tiles, fragments    (neither includes the other)
    raster
    targets
    scene
    base

core/ includes core/, tuning/ and config.hpp only: no header of the API, nothing of device/. tuning/ includes core/ and tuning/
only. programs/, octree/ and sparse/ hold the passes behind the API's headers and count as these. cpu_ref/ includes nothing of
device/, and of the API headers only voxelpipe.hpp includes device/. No include cycle anywhere. At most four files lie directly
in device/.

    scripts/check_includes.py [ROOT]
"""
import pathlib
import re
import sys

LAYERS = ["optional", "", "solid sparse", "call", "tiles fragments", "raster", "targets", "scene", "base"]  # of device/, from the top down
MAX_LOOSE = 4  # files directly in device/: what a reader meets first
LEVEL = {folder: level for level, folders in enumerate(LAYERS) for folder in (folders.split() or [""])}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)


def place(name):
    """(part, folder): part is device, core, tuning, api, io or cpu_ref; folder is that within device/."""
    parts = name.split("/")
    if parts[0] == "cpu_ref":
        return "cpu_ref", ""
    part = parts[1] if len(parts) > 2 else "api"
    return part, parts[2] if part == "device" and len(parts) > 3 else ""


def complaint(source, target):
    """Why `source` may not include `target`, or None. Cycles are found apart."""
    part, folder = place(source)
    to_part, to_folder = place(target)
    if part == "core" and to_part not in ("core", "tuning") and target != "voxelpipe/config.hpp":
        return f"core/ may not include {to_part}"
    if part == "tuning" and to_part not in ("core", "tuning") and target != "voxelpipe/config.hpp":
        return f"tuning/ may not include {to_part}"
    if to_part == "device" and part != "device" and source != "voxelpipe/voxelpipe.hpp":
        return f"{part} may not include device/"
    if to_part == "cpu_ref" and part != "cpu_ref":
        return f"{part} may not include cpu_ref/"
    if part == "device" and to_part == "device" and folder != to_folder:
        if folder not in LEVEL:
            return f"device/{folder}/ is no layer: name it in scripts/check_includes.py"
        if to_folder not in LEVEL or LEVEL[to_folder] <= LEVEL[folder]:
            return f"device/{folder} may not include device/{to_folder}: includes run downward"
    return None


def find_cycle(includes):
    """One cycle of includes, or None."""
    finished, path = set(), []

    def visit(name):
        if name in path:
            return path[path.index(name):] + [name]
        if name in finished:
            return None
        path.append(name)
        for target in includes[name]:
            cycle = visit(target)
            if cycle:
                return cycle
        finished.add(path.pop())
        return None

    for name in sorted(includes):
        cycle = visit(name)
        if cycle:
            return cycle
    return None


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent)
    files = [f for folder in ("voxelpipe", "cpu_ref") for f in sorted((root / folder).rglob("*")) if f.suffix in (".hpp", ".cuh")]
    names = {f.relative_to(root).as_posix(): f for f in files}
    includes, failed = {}, False
    for name, file in names.items():
        found = INCLUDE.findall(file.read_text())
        includes[name] = [t for t in found if t in names]
        for target in found:
            ours = target.startswith(("voxelpipe/", "cpu_ref/")) and target.endswith((".hpp", ".cuh"))
            why = complaint(name, target) if target in names else "no such file" if ours else None
            if why:
                print(f"{name}: includes <{target}>: {why}")
                failed = True
    cycle = find_cycle(includes)
    if cycle:
        print("cycle of includes: " + " -> ".join(cycle))
    if not files:
        print(f"no headers below {root}")
    loose = [name for name in names if name.startswith("voxelpipe/device/") and name.count("/") == 2]
    if len(loose) > MAX_LOOSE:
        print(f"{len(loose)} files lie directly in device/, more than {MAX_LOOSE}: " + ", ".join(loose))
    sys.exit(failed or bool(cycle) or not files or len(loose) > MAX_LOOSE)


main()
