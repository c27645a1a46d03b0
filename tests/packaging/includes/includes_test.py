# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""scripts/check_includes.py on small trees: right ones pass, and each mistake is named.

    includes_test.py SCRIPT
"""
import pathlib
import subprocess
import sys
import tempfile

RIGHT = {
    "voxelpipe/voxelpipe.hpp": "<voxelpipe/mesh.hpp>",
    "voxelpipe/mesh.hpp": "<voxelpipe/core/bits.hpp>",
    "voxelpipe/core/bits.hpp": "<cstdint>",
    "tool/main.cpp": '"run/run.hpp"',
    "tool/run/run.hpp": '"draw/drawer.hpp"',
    "tool/draw/drawer.hpp": '"model/scene.hpp"',
    "tool/read/file.hpp": '"inner/text.hpp"',  # beside the file
    "tool/read/inner/text.hpp": '"model/scene.hpp"',
    "tool/write/file.hpp": '"model/scene.hpp"',
    "tool/model/scene.hpp": "<voxelpipe/mesh.hpp>",
}
WRONG = [
    ("voxelpipe/core/bits.hpp", "<voxelpipe/mesh.hpp>", "core/ may not include api"),
    ("tool/model/scene.hpp", '"draw/drawer.hpp"', "tool/model may not include tool/draw"),
    ("tool/read/file.hpp", '"write/file.hpp"', "tool/read may not include tool/write"),
    ("tool/write/file.hpp", '"read/inner/text.hpp"', "tool/write may not include tool/read"),
    ("tool/draw/drawer.hpp", '"run/run.hpp"', "tool/draw may not include tool/run"),
    ("tool/model/scene.hpp", '"main.cpp"', "tool/model may not include tool/:"),
    ("tool/other/file.hpp", '"model/scene.hpp"', "tool/other/ is no layer of the tool"),
    ("tool/model/scene.hpp", '"scene.hpp"', "cycle of includes: tool/model/scene.hpp"),
]


def check(files, *options):
    """The script's exit status and output for a tree of files with one include each."""
    with tempfile.TemporaryDirectory() as folder:
        for name, include in files.items():
            path = pathlib.Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"#include {include}\n")
        done = subprocess.run([sys.executable, sys.argv[1], *options, folder], capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr


def main():
    expected = [(RIGHT, (), 0, ""), (RIGHT, ("--depth", "3"), 0, ""), (RIGHT, ("--depth", "2"), 1, "a chain of 3 includes, more than 2")]
    expected += [({**RIGHT, name: include}, (), 1, text) for name, include, text in WRONG]
    for files, options, status, text in expected:
        got, output = check(files, *options)
        if got != status or text not in output:
            sys.exit(f"expected {status} and '{text}' but got {got} and '{output}'")
    print(f"{len(expected)} trees were checked")


main()
