#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""tidy.py [--deep] BUILD JOBS REGEX...: clang-tidy over the sources in BUILD/compile_commands.json that a REGEX matches.

clang's static analyzer takes three quarters of the time, so that it runs with --deep alone, and so do SLOW_CHECKS.

Most of a run goes into the headers that sources share: all samples, or all sources of the tool, that have the same flags are
checked as one file, their texts one behind the other, so that checks that look at a main file see each of them. Where two sources have the same name
for two things, each stands in a namespace; where that does not compile either, the sources are halved. A file that does
not come out clean is checked again, each source apart, and that counts: the messages then name the source and its line.
"""

import concurrent.futures
import itertools
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


# These take a third of the time of all checks but the analyzer's.
SLOW_CHECKS = ("bugprone-assert-side-effect", "bugprone-infinite-loop", "bugprone-multiple-statement-macro", "bugprone-stringview-nullptr",
               "bugprone-suspicious-semicolon", "bugprone-suspicious-string-compare", "bugprone-undelegated-constructor",
               "bugprone-unused-raii", "readability-redundant-control-flow")


def check(source, is_deep, how, folder):
    """Whether a source is clean, and what clang-tidy says. HOW names the compiler's flags or the folder of their database."""
    checks = [] if is_deep else ["--checks=-clang-analyzer-*," + ",".join(f"-{name}" for name in SLOW_CHECKS)]
    command = ["clang-tidy-14", "-quiet", *checks, str(source), *how]
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
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


def layouts_of(sources):
    """Ways to put sources into one file, in the order in which they are tried; of programs only one will do."""
    programs = sum(1 for s in sources if re.search(r"^int main\(", text_of(s), re.MULTILINE))
    return (each_in_a_namespace,) if programs > 1 else (one_behind_the_other, each_in_a_namespace)


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
    numbers = itertools.count()

    # Whether all are clean, and what there is to print. A group that does not go into one file is halved until it does.
    def check_group(flags, sources):
        names = ", ".join(pathlib.Path(s).name for s in sources)
        folders = sorted({f"-iquote{pathlib.Path(s).parent}" for s in sources})
        for layout in layouts_of(sources) if len(sources) > 1 else []:
            text = joined / f"joined_{next(numbers)}.cpp"
            text.write_text(layout(sources), encoding="utf-8")
            clean, output = check(text, is_deep, ["--", *folders, *flags[1:]], build)
            if clean:
                return True, f"clean: {names}\n"
            if "[clang-diagnostic-error]" not in output:
                break
        else:
            if len(sources) > 1:
                middle = len(sources) // 2
                halves = [check_group(flags, sources[:middle]), check_group(flags, sources[middle:])]
                return all(clean for clean, _ in halves), f"note: not in one file: {names}\n" + "".join(text for _, text in halves)
        results = [check(s, is_deep, ["-p", str(build)], build) for s in sources]
        if all(clean for clean, _ in results):
            return True, f"clean, each apart: {names}\n"
        return False, "".join(output for clean, output in results if not clean)

    def length(group):
        return sum(pathlib.Path(s).stat().st_size for s in group[1])

    largest_first = sorted(((flags, sources) for (_, flags), sources in groups.items()), key=length, reverse=True)
    failed = False
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for clean, text in pool.map(lambda group: check_group(*group), largest_first):
            print(text, end="", flush=True)
            failed = failed or not clean
    sys.exit(1 if failed else 0)


main()
