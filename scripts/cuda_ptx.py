#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""cuda_ptx.py [--front-end] BUILD JOBS REGEX...: compiles the .cu of BUILD/compile_commands.json that a REGEX matches to PTX, each once.

nvcc reads all of a file and generates the kernels' code. What is left out are the host's pass, ptxas and the link, two
thirds of the time: a program that nobody can run without a GPU needs none of them. Mistakes that only those find, such as
a symbol that no file defines, are found by `.ci/run nvcc_apart`. With --front-end no PTX is generated either, where nvcc
has the option for that: a quarter of the rest. The files that each was made of are listed in BUILD/ptx/*.d, in make's form.
"""

import concurrent.futures
import json
import pathlib
import re
import shlex
import subprocess
import sys


def ptx_command(entry, name, more):
    """The entry's nvcc and its options, without a launcher, and MORE; PTX of one architecture in place of an object."""
    given = iter(shlex.split(entry["command"]))
    kept = []
    for argument in given:
        if argument in ("-o", "-MF", "-MT"):
            next(given)
        elif argument not in ("-c", "-MD") and not re.match(r"--generate-code=|.*/ccache$|ccache$", argument):
            kept.append(argument)
    return [*kept, *more, "-ptx", "-arch=compute_80", "-MD", "-MF", f"ptx/{name}.d", "-MT", name, "-o", f"ptx/{name}.ptx"]


def main():
    arguments = sys.argv[1:]
    more = []
    if arguments[0] == "--front-end":
        arguments.pop(0)
        known = subprocess.run(["nvcc", "--help"], stdout=subprocess.PIPE, text=True, check=True).stdout
        more = ["-fdevice-syntax-only"] if "--fdevice-syntax-only" in known else []
    build = pathlib.Path(arguments[0]).resolve()
    jobs = int(arguments[1])
    wanted = re.compile("|".join(arguments[2:]))
    database = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    entries = {entry["file"]: entry for entry in database if entry["file"].endswith(".cu") and wanted.search(entry["file"])}
    if not entries:
        sys.exit("no .cu matches")
    (build / "ptx").mkdir(exist_ok=True)

    def compile_one(number, entry):
        name = f"{pathlib.Path(entry['file']).stem}_{number}"
        done = subprocess.run(ptx_command(entry, name, more), cwd=build, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        (build / "ptx" / f"{name}.ptx").unlink(missing_ok=True)
        return done.returncode, f"{entry['file']}: {'compiles' if done.returncode == 0 else 'does not compile'}\n{done.stdout}"

    failed = False
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for code, text in pool.map(compile_one, range(len(entries)), entries.values()):
            print(text, end="", flush=True)
            failed = failed or code != 0
    sys.exit(1 if failed else 0)


main()
