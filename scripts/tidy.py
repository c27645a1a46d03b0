#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""tidy.py BUILD JOBS REGEX...: clang-tidy over the sources in BUILD/compile_commands.json that a REGEX matches.

Most of a run goes into the headers that sources share: all sources with the same flags are checked as one file, their
texts one behind the other, so that checks that look at a main file see each of them. Where that file does not come out
clean, be it that two sources have the same name for two things, its sources are checked apart, and that counts: the
messages then name the source and its line.
"""

import concurrent.futures
import json
import pathlib
import re
import shlex
import subprocess
import sys


def flags_of(entry):
    """The compiler and its flags: no launcher, no files, no optimisation."""
    given = iter(entry.get("arguments") or shlex.split(entry["command"]))
    kept = []
    for argument in given:
        if argument in ("-o", "-c", "-MF", "-MT"):
            next(given)
        elif argument != "-MD" and not re.fullmatch(r"-O.?|.*/ccache|ccache", argument):
            kept.append(argument)
    return tuple(kept)


def check(folder, source):
    command = ["clang-tidy-14", "-quiet", "-p", str(folder), str(source)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return done.returncode == 0, done.stdout


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    jobs = int(sys.argv[2])
    wanted = re.compile("|".join(sys.argv[3:]))

    groups = {}
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        if wanted.search(entry["file"]):
            groups.setdefault(flags_of(entry), []).append(entry["file"])
    if not groups:
        sys.exit("no source matches")

    joined = build / "tidy"
    joined.mkdir(exist_ok=True)
    database = []
    for flags, sources in groups.items():
        text = joined / f"joined_{len(database)}.cpp"
        text.write_text("".join(pathlib.Path(s).read_text(encoding="utf-8") + "\n" for s in sources), encoding="utf-8")
        folders = sorted({f"-iquote{pathlib.Path(s).parent}" for s in sources})
        arguments = [flags[0], *folders, *flags[1:], "-c", str(text)]
        database.append({"directory": str(build), "file": str(text), "arguments": arguments})
    (joined / "compile_commands.json").write_text(json.dumps(database, indent=1))

    def check_group(text, sources):
        names = ", ".join(pathlib.Path(s).name for s in sources)
        if check(joined, text)[0]:
            return True, f"clean: {names}\n"
        results = [check(build, s) for s in sources]
        if all(clean for clean, _ in results):
            return True, f"note: clean, but only apart, for they do not go into one file: {names}\n"
        return False, "".join(output for clean, output in results if not clean)

    texts = [pathlib.Path(entry["file"]) for entry in database]
    largest_first = sorted(zip(texts, groups.values()), key=lambda pair: -pair[0].stat().st_size)
    failed = False
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for clean, text in pool.map(lambda pair: check_group(*pair), largest_first):
            print(text, end="", flush=True)
            failed = failed or not clean
    sys.exit(1 if failed else 0)


main()
