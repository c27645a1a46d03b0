#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Prints the version, which stands in voxelpipe/config.hpp alone: CMake, the tool and the Python package read it there.

    scripts/version.py [--check]

--check holds to it what cannot read it: the newest section of CHANGELOG.md, CITATION.cff, and the recipes of packaging/. Needs the
standard library only.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# File, and the pattern whose every match has the version (or "v" and it) as its group.
STATED = [
    ("CITATION.cff", r"^version: (\S+)$"),
    ("docs/badges.svg", r">version</text><text[^>]*>([^<]+)<"),
    ("packaging/vcpkg/voxelpipe/vcpkg.json", r'"version": "([^"]+)"'),
    ("packaging/conan/conandata.yml", r'^  "([^"]+)":'),
    ("packaging/conan/conandata.yml", r"voxelpipe-(\d[\w.]*)\.tar\.gz"),
    ("packaging/spack/package.py", r'^    version\("([^"]+)"'),
    ("packaging/conda/recipe.yaml", r'^  version: "([^"]+)"$'),
]


def version():
    text = (ROOT / "voxelpipe" / "config.hpp").read_text(encoding="utf-8")
    return ".".join(re.search(rf"^#define VOXELPIPE_VERSION_{part} (\d+)$", text, flags=re.M)[1] for part in ("MAJOR", "MINOR", "PATCH"))


def errors():
    expected = version()
    released = re.findall(r"^## (\d\S*) - (\S+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.M)
    if not released or released[0][0] != expected:
        yield f"CHANGELOG.md has no section `## {expected} - YYYY-MM-DD` above those of other versions"
    elif not re.fullmatch(r"\d{4}-\d\d-\d\d", released[0][1]):
        yield f"CHANGELOG.md: {released[0][1]} is no date"
    for name, pattern in STATED:
        if not (ROOT / name).exists():  # packaging/ is no part of the source archive
            continue
        found = re.findall(pattern, (ROOT / name).read_text(encoding="utf-8"), flags=re.M)
        if not found or set(found) != {expected}:
            yield f"{name} states {', '.join(found) or 'no version'} and voxelpipe/config.hpp {expected}"


def main():
    if sys.argv[1:] == ["--check"]:
        found = list(errors())
        for line in found:
            print(f"error: {line}", file=sys.stderr)
        sys.exit(1 if found else 0)
    if sys.argv[1:]:
        sys.exit(__doc__)
    print(version())


main()
