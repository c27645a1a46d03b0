#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checks a Homebrew formula without Homebrew: its options are CMakeLists.txt's, its archive is there by URL and hash, and the C program of
its test compiles against the header of the C API. Where there is a ruby, its syntax too.

    homebrew.py FORMULA CMAKE_LISTS HEADER
"""
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

formula, lists, header = map(pathlib.Path, sys.argv[1:])
text = formula.read_text(encoding="utf-8")
known = re.sub(r"\s+", " ", lists.read_text(encoding="utf-8"))
options = re.findall(r"-D(\w+)=", text)
assert len(options) > 2
for option in options:
    assert re.search(rf"\b(option|set)\({option}\b", known), f"CMakeLists.txt has no {option}"

url, digest = (re.search(rf'^  {key} "([^"]+)"$', text, re.MULTILINE)[1] for key in ("url", "sha256"))
archive = pathlib.Path(urllib.parse.unquote(urllib.parse.urlparse(url).path))
assert hashlib.sha256(archive.read_bytes()).hexdigest() == digest, url
# Homebrew takes the version from the archive's name.
assert re.search(r"-(\d+\.\d+\.\d+)\.tar\.gz$", url), url

program = re.search(r"<<~C\n(.*?)^    C$", text, re.DOTALL | re.MULTILINE)[1]
subprocess.run(["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"-I{header.parent}", "-x", "c", "-"],
               input=program, text=True, check=True)
if shutil.which("ruby"):
    subprocess.run(["ruby", "-c", str(formula)], stdout=subprocess.DEVNULL, check=True)
print(f"the formula of Homebrew: {len(options)} options, its test compiles" + ("" if shutil.which("ruby") else "; no ruby here"))
