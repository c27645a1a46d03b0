#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checks the direction of the includes of the library and of the tool. Prints each include that breaks a rule; the exit status is 1 if any does.

The library's parts, from the top down; an include names a file of the same part or of a part further down:

    slabs
    cells
    programs
    surfaces
    distance
    sparse
    solid
    label
    levels
    formats
    voxelize.hpp and the other headers directly in voxelpipe/ (but voxelpipe.hpp, which includes all), and device/
    core, tuning

Each module (slabs to formats) has its kernels in its own device/. core/ includes core/, tuning/ and config.hpp only.
Inside voxelpipe/device/ an include names a file of the same folder or of a folder further down:

    device/ itself      (backend, surface_calls, voxelize_async, abuffer_async)
    call
    tiles, fragments    (neither includes the other)
    raster
    targets
    scene
    base

Outside a device/ folder only voxelpipe.hpp and .cuh files include one. cpu_ref/ mirrors the modules: cpu_ref/label,
cpu_ref/solid, cpu_ref/sparse, cpu_ref/distance and cpu_ref/cells stand above its other files, and cpu_ref/backend.hpp includes all. It includes no device/. No include cycle
anywhere. At most four files lie directly in device/. Forwarding headers are left out.

The tool's folders, from the top down; tool/ itself has main.cpp, which may include all of them:

    run
    draw
    read, write    (neither includes the other)
    model

    scripts/check_includes.py [--depth N] [ROOT]

--depth N: also fails if a chain of includes that begins at voxelpipe.hpp has more than N files, and prints the longest.
"""
import argparse
import pathlib
import re
import sys

LAYERS = ["", "call", "tiles fragments", "raster", "targets", "scene", "base"]  # of device/, from the top down
MODULES = ["slabs", "cells", "programs", "surfaces", "distance", "sparse", "solid", "label", "levels", "formats", "api", "core"]  # of voxelpipe/, from the top down
MAX_LOOSE = 4  # files directly in device/: what a reader meets first
LEVEL = {folder: level for level, folders in enumerate(LAYERS) for folder in (folders.split() or [""])}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)
TOOL_LEVEL = {"": 0, "run": 1, "draw": 2, "read": 3, "write": 3, "model": 4}  # folders of tool/, from the top down
UMBRELLAS = ("voxelpipe/voxelpipe.hpp", "cpu_ref/backend.hpp")


def place(name):
    """(part, folder): part is device, core, tuning, api, cpu_ref or a module; folder is that within the part."""
    if name == "voxelpipe/config.hpp":
        return "core", ""
    parts = name.split("/")
    if parts[0] == "cpu_ref":
        return "cpu_ref", parts[1] if len(parts) > 2 else ""
    part = parts[1] if len(parts) > 2 else "api"
    return part, "/".join(parts[2:-1])


def module(part):
    return {"device": "api", "tuning": "core", "cuda_kernels": "api"}.get(part, part)


def complaint(source, target):
    """Why `source` may not include `target`, or None. Cycles are found apart."""
    part, folder = place(source)
    to_part, to_folder = place(target)
    if source in UMBRELLAS or part == "slabs" and target in UMBRELLAS:
        return None
    if target in UMBRELLAS:
        return "that header is for programs"
    if part in ("core", "tuning") and to_part not in ("core", "tuning"):
        return f"{part}/ may not include {to_part}"
    to_device = to_part == "device" or to_folder.split("/")[0] == "device"
    if to_device and (part == "cpu_ref" or source.endswith(".hpp") and "device" not in (part, folder)):
        return f"{source} may not include a device/ folder"
    if part == "cpu_ref":
        order = ["cells", "distance", "sparse", "solid", "label", ""]
        if to_part == "cpu_ref" and order.index(to_folder) < order.index(folder):
            return f"cpu_ref/{folder} may not include cpu_ref/{to_folder}: includes run downward"
        return None
    if to_part == "cpu_ref":
        return f"{part} may not include cpu_ref/"
    for name in (part, to_part):
        if module(name) not in MODULES:
            return f"{name}/ is no module: name it in scripts/check_includes.py"
    if MODULES.index(module(to_part)) < MODULES.index(module(part)):
        return f"{part} may not include {to_part}: includes run downward"
    if part == "device" and to_part == "device" and folder != to_folder:
        if folder not in LEVEL:
            return f"device/{folder}/ is no layer: name it in scripts/check_includes.py"
        if to_folder not in LEVEL or LEVEL[to_folder] <= LEVEL[folder]:
            return f"device/{folder} may not include device/{to_folder}: includes run downward"
    return None


def tool_folder(name):
    """The layer of a file of tool/: its first folder, "" for tool/ itself."""
    parts = name.split("/")
    return parts[1] if len(parts) > 2 else ""


def tool_complaint(source, target):
    """Why a file of the tool may not include another, or None."""
    folder, to_folder = tool_folder(source), tool_folder(target)
    for name in (folder, to_folder):
        if name not in TOOL_LEVEL:
            return f"tool/{name}/ is no layer of the tool: name it in scripts/check_includes.py"
    if folder != to_folder and TOOL_LEVEL[to_folder] <= TOOL_LEVEL[folder]:
        return f"tool/{folder} may not include tool/{to_folder}: includes run downward"
    return None


def tool_includes(root):
    """The files of tool/ that each of them includes, as names from the root. A name is looked for beside the file, then in tool/."""
    files = [f for f in sorted((root / "tool").rglob("*")) if f.suffix in (".hpp", ".cpp", ".cuh", ".cu")]
    names = {f.relative_to(root).as_posix(): f for f in files}
    includes = {}
    for name, file in names.items():
        folder = name.rpartition("/")[0]
        found = [[f"{folder}/{t}", f"tool/{t}"] for t in INCLUDE.findall(file.read_text())]
        includes[name] = [next(t for t in places if t in names) for places in found if any(t in names for t in places)]
    return includes


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


def longest_chain(includes, name, known):
    """The longest chain of includes that begins at `name`; there are no cycles."""
    if name not in known:
        chains = [longest_chain(includes, target, known) for target in includes[name]]
        known[name] = [name] + max(chains, key=len, default=[])
    return known[name]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--depth", type=int, metavar="N")
    parser.add_argument("root", nargs="?", type=pathlib.Path, default=pathlib.Path(__file__).parent.parent)
    arguments = parser.parse_args()
    root = arguments.root
    files = [f for folder in ("voxelpipe", "cpu_ref") for f in sorted((root / folder).rglob("*")) if f.suffix in (".hpp", ".cuh")]
    files = [f for f in files if "// forwarding header" not in f.read_text()]
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
    of_tool = tool_includes(root)
    for name, targets in of_tool.items():
        for target in targets:
            why = tool_complaint(name, target)
            if why:
                print(f"{name}: includes {target}: {why}")
                failed = True
    cycle = find_cycle(includes) or find_cycle(of_tool)
    if cycle:
        print("cycle of includes: " + " -> ".join(cycle))
    if not files:
        print(f"no headers below {root}")
    loose = [name for name in names if name.startswith("voxelpipe/device/") and name.count("/") == 2]
    if len(loose) > MAX_LOOSE:
        print(f"{len(loose)} files lie directly in device/, more than {MAX_LOOSE}: " + ", ".join(loose))
    if arguments.depth and files and not cycle:
        chain = longest_chain(includes, UMBRELLAS[0], {})
        if len(chain) > arguments.depth:
            print(f"a chain of {len(chain)} includes, more than {arguments.depth}: " + " -> ".join(chain))
            failed = True
    sys.exit(failed or bool(cycle) or not files or len(loose) > MAX_LOOSE)


main()
