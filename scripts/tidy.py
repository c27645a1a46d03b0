#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""tidy.py BUILD JOBS REGEX...: clang-tidy over the sources in BUILD/compile_commands.json that a REGEX matches.

Most of a run goes into the headers that the sources of a target share: all sources of a target are checked as one file,
their texts one behind the other, so that checks that look at a main file see each of them. Where that file does not come
out clean, be it that two sources have the same name for two things, its sources are checked apart, and that counts: the
messages then name the source and its line.
"""

import concurrent.futures
import json
import pathlib
import re
import shlex
import subprocess
import sys


def arguments_of(entry, source):
    """The compiler's arguments for `source` in place of the entry's file: no launcher, no outputs."""
    given = iter(entry.get("arguments") or shlex.split(entry["command"]))
    kept = []
    for argument in given:
        if argument in ("-o", "-c", "-MF", "-MT"):
            next(given)
        elif argument != "-MD" and pathlib.Path(argument).name != "ccache":
            kept.append(argument)
    return kept + ["-c", str(source)]


def check(folder, source):
    command = ["clang-tidy-14", "-quiet", "-p", str(folder), str(source)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return done.returncode == 0, done.stdout


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    jobs = int(sys.argv[2])
    wanted = re.compile("|".join(sys.argv[3:]))

    targets = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        if wanted.search(entry["file"]):
            target = re.search(r"([^/\s]+)\.dir/", entry.get("output") or entry["command"]).group(1)
            targets.setdefault(target, []).append(entry)
    if not targets:
        sys.exit("no source matches")

    joined = build / "tidy"
    joined.mkdir(exist_ok=True)
    database = []
    for target, entries in targets.items():
        text = joined / f"{target}.cpp"
        text.write_text("".join(pathlib.Path(e["file"]).read_text() + "\n" for e in entries))
        folders = sorted({f"-iquote{pathlib.Path(e['file']).parent}" for e in entries})
        arguments = arguments_of(entries[0], text)
        database.append({"directory": str(build), "file": str(text), "arguments": arguments[:1] + folders + arguments[1:]})
    (joined / "compile_commands.json").write_text(json.dumps(database, indent=1))

    def check_target(target):
        clean, _ = check(joined, joined / f"{target}.cpp")
        if clean:
            return True, f"{target}: {len(targets[target])} sources, clean\n"
        results = [check(build, e["file"]) for e in targets[target]]
        if all(r[0] for r in results):
            return True, f"note: {target}: clean, but only apart: its sources do not go into one file\n"
        return False, f"{target}:\n" + "".join(r[1] for r in results if not r[0])

    largest_first = sorted(targets, key=lambda t: -(joined / f"{t}.cpp").stat().st_size)
    failed = False
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for clean, text in pool.map(check_target, largest_first):
            print(text, end="", flush=True)
            failed = failed or not clean
    sys.exit(1 if failed else 0)


main()
