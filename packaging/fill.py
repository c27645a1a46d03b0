#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the recipes of this folder with the URL and the hashes of a release's archive in the place of their placeholders.

    packaging/fill.py --archive build/dist/voxelpipe-0.1.0.tar.gz --repository https://HOST/OWNER/voxelpipe [--url URL] --out FOLDER

The URL is that of a release's file, as GitHub and forges like it have it; --url gives another. Needs the standard library only.
"""
import argparse
import hashlib
import pathlib
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
RECIPES = ["vcpkg", "conan", "spack", "conda", "homebrew"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--archive", type=pathlib.Path, required=True)
    parser.add_argument("--repository", required=True)
    parser.add_argument("--url")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    args = parser.parse_args()
    data = args.archive.read_bytes()
    version = args.archive.name.removeprefix("voxelpipe-").removesuffix(".tar.gz")
    values = {
        "ARCHIVE_URL": args.url or f"{args.repository}/releases/download/v{version}/{args.archive.name}",
        "REPOSITORY_URL": args.repository,
        "ARCHIVE_SHA256": hashlib.sha256(data).hexdigest(),
        "ARCHIVE_SHA512": hashlib.sha512(data).hexdigest(),
    }
    unused = set(values)
    for folder in RECIPES:
        for file in sorted((HERE / folder).rglob("*")):
            if not file.is_file() or "__pycache__" in file.parts:
                continue
            text = file.read_text(encoding="utf-8")
            unused -= {name for name in values if name in text}
            for name, value in values.items():
                text = text.replace(name, value)
            to = args.out / file.relative_to(HERE)
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_text(text, encoding="utf-8")
    # conda's test is Conan's program.
    (args.out / "conda" / "test").mkdir(exist_ok=True)
    for name in ("CMakeLists.txt", "test_package.cpp"):
        shutil.copy(HERE / "conan" / "test_package" / name, args.out / "conda" / "test" / name)
    if unused:
        sys.exit(f"error: no recipe has {', '.join(sorted(unused))}")


main()
