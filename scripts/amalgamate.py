#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the CPU backend and the whole API as one header, for programs that want to add one file and nothing else but GLM.

    scripts/amalgamate.py [--out FILE]        (default build/amalgamated/voxelpipe_cpu.hpp)

Every header stands there once, before those that include it. Headers of the GPU (.cuh) are left out. The test install.amalgamated
compiles it and compares a program's results with the library's.
"""
import argparse
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r"\s*#\s*include\s*<([^>]+)>")
CONDITION = re.compile(r"\s*#\s*(if|endif)")
HEAD = """// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// VoxelPipe {version}, the CPU backend and the API in one header; needs GLM, C++20 and threads (-pthread). Written by scripts/amalgamate.py:
// change the library's headers, not this file. A program includes either this file or those.
#pragma once
"""


def version():
    text = (ROOT / "voxelpipe" / "config.hpp").read_text(encoding="utf-8")
    return ".".join(re.findall(r"^#define VOXELPIPE_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)$", text, flags=re.M))


def append(name, lines, seen):
    """The header `name` behind those that it includes, less what stands in `lines` already."""
    seen.add(name)
    depth = 0
    body = []
    for line in (ROOT / name).read_text(encoding="utf-8").splitlines():
        condition, include = CONDITION.match(line), INCLUDE.match(line)
        if condition:
            depth += 1 if condition[1] == "if" else -1
        if include and include[1].endswith(".cuh"):
            continue
        if include and depth == 0 and include[1] in seen:
            continue
        if include and (ROOT / include[1]).is_file():
            if depth == 0:
                append(include[1], lines, seen)
            else:  # it stands under the condition, with what it includes; others that include it have it again
                append(include[1], body, set(seen))
        elif line.strip() != "#pragma once" and not line.startswith("// SPDX-"):
            if include and depth == 0:
                seen.add(include[1])
            body.append(line)
    text = re.sub(r"\n{3,}", "\n\n", "\n".join(body)).strip("\n")
    lines.append(f"\n// ---- {name}\n{text}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build" / "amalgamated" / "voxelpipe_cpu.hpp")
    out = parser.parse_args().out
    lines, seen = [HEAD.format(version=version())], set()
    for folder, pattern in (("cpu_ref", "backend.hpp"), ("voxelpipe", "*.hpp"), ("voxelpipe/levels", "*.hpp"), ("voxelpipe/sparse", "*.hpp"), ("voxelpipe/sparse/io", "*.hpp")):
        for file in sorted((ROOT / folder).glob(pattern)):
            name = file.relative_to(ROOT).as_posix()
            if name not in seen:
                append(name, lines, seen)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"{out}: {out.stat().st_size} bytes")


main()
