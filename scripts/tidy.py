#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""tidy.py [--deep] BUILD JOBS REGEX...: clang-tidy over the sources in BUILD/compile_commands.json that a REGEX matches.

clang's static analyzer takes three quarters of the time, so that it runs with --deep alone.

Most of a run goes into the headers that sources share: all samples, or all sources of the tool, that have the same flags are
checked as one file, their texts one behind the other, so that checks that look at a main file see each of them. Where two sources have the same name
for two things, each stands in a namespace; where that does not compile either, the sources are halved. A file that does
not come out clean is checked again, each source apart, and that counts: the messages then name the source and its line.
"""

import concurrent.futures
import json
import pathlib
import re
import shlex
import subprocess
import sys


def flags_of(entry):
    """The compiler and its flags: no launcher, no files, no optimisation, no precompiled header, which is of one level of
    optimisation."""
    given = iter(entry.get("arguments") or shlex.split(entry["command"]))
    kept = []
    for argument in given:
        if argument in ("-o", "-c", "-MF", "-MT"):
            next(given)
        elif argument == "-Xclang":
            word = next(given)
            if word.startswith("-include"):
                next(given)  # -Xclang
                next(given)  # the file
            else:
                kept += [argument, word]
        elif argument != "-MD" and not re.fullmatch(r"-O.?|.*/ccache|ccache", argument):
            kept.append(argument)
    return tuple(kept)


def check(folder, source, is_deep):
    checks = [] if is_deep else ["--checks=-clang-analyzer-*"]
    command = ["clang-tidy-14", "-quiet", *checks, "-p", str(folder), str(source)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return done.returncode == 0, done.stdout


def text_of(source):
    return pathlib.Path(source).read_text(encoding="utf-8") + "\n"


def one_behind_the_other(sources):
    return "".join(map(text_of, sources))


def each_in_a_namespace(sources):
    """For programs, which all have a main() and names of their own: what stands behind a source's last #include is put into
    a namespace, so that equal names do not meet."""
    heads = []
    bodies = []
    for number, source in enumerate(sources):
        lines = text_of(source).splitlines(keepends=True)
        begin = max((n + 1 for n, line in enumerate(lines) if line.startswith("#include")), default=0)
        heads += lines[:begin]
        bodies += [f"namespace source_{number} {{\n", *lines[begin:], "}\n"]
    return "".join(heads + bodies)


def main():
    arguments = sys.argv[1:]
    is_deep = arguments[0] == "--deep"
    if is_deep:
        del arguments[0]
    build = pathlib.Path(arguments[0]).resolve()
    jobs = int(arguments[1])
    wanted = re.compile("|".join(arguments[2:]))

    groups = {}
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        if wanted.search(entry["file"]):
            folder = "samples" if "/samples/" in entry["file"] else ""
            groups.setdefault((folder, flags_of(entry)), []).append(entry["file"])
    if not groups:
        sys.exit("no source matches")

    joined = build / "tidy"
    joined.mkdir(exist_ok=True)

    def compiles(arguments):
        return subprocess.run([*arguments, "-fsyntax-only", "-w"], cwd=build, stderr=subprocess.DEVNULL, check=False).returncode == 0

    # The database's entries and their sources; a group that does not go into one file is halved until it does.
    database = []
    def join(flags, sources):
        text = joined / f"joined_{len(database)}.cpp"
        folders = sorted({f"-iquote{pathlib.Path(s).parent}" for s in sources})
        arguments = [flags[0], *folders, *flags[1:], "-c", str(text)]
        for layout in (one_behind_the_other, each_in_a_namespace):
            text.write_text(layout(sources), encoding="utf-8")
            if len(sources) == 1 or compiles(arguments):
                database.append(({"directory": str(build), "file": str(text), "arguments": arguments}, sources))
                return
        middle = len(sources) // 2
        print("note: not in one file:", *(pathlib.Path(s).name for s in sources[:middle]), "|", *(pathlib.Path(s).name for s in sources[middle:]))
        join(flags, sources[:middle])
        join(flags, sources[middle:])

    for (_, flags), sources in groups.items():
        join(flags, sources)
    (joined / "compile_commands.json").write_text(json.dumps([entry for entry, _ in database], indent=1))

    def check_group(text, sources):
        names = ", ".join(pathlib.Path(s).name for s in sources)
        if check(joined, text, is_deep)[0]:
            return True, f"clean: {names}\n"
        results = [check(build, s, is_deep) for s in sources]
        if all(clean for clean, _ in results):
            return True, f"note: clean, but only apart: {names}\n"
        return False, "".join(output for clean, output in results if not clean)

    texts = [(pathlib.Path(entry["file"]), sources) for entry, sources in database]
    largest_first = sorted(texts, key=lambda pair: -pair[0].stat().st_size)
    failed = False
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for clean, text in pool.map(lambda pair: check_group(*pair), largest_first):
            print(text, end="", flush=True)
            failed = failed or not clean
    sys.exit(1 if failed else 0)


main()
