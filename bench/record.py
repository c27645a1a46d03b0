#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Keeps records/: the latest figures of each machine, and the history of all of them.

    record.py MACHINE RESULTS_FOLDER    copies what a benchmark has written to records/MACHINE, replaces the matching sections
                                        of its README.md, and appends the times of whole calls to records/history.csv
    record.py --check                   fails if a table under records/ is not in the history, or names no commit; if a suite.txt has
                                        failures; and if a note of a README.md on suite.txt, solids.csv or programs.csv is not of the
                                        commit that the file is of

MACHINE is a folder's name: h200, h100, xeon, epyc. Needs the standard library only.
"""
import argparse
import csv
import pathlib
import re
import shutil
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent / "records"
HISTORY = ROOT / "history.csv"
HISTORY_COLUMNS = ["commit", "machine", "cell", "ms"]

# Files that a benchmark writes: the report whose head names device and commit, and its files with their names under records/.
REPORTS = {
    "gpu.md": {"gpu.csv": "table.csv", "gpu_stages.csv": "stages.csv"},
    "gpu_scaling.md": {"gpu_scaling.csv": "scaling.csv"},
    "gpu_tune.md": {"gpu_tune.csv": "tune.csv"},
    "gpu_solids.md": {"gpu_solids.csv": "solids.csv"},
    "gpu_solids_scaling.md": {"gpu_solids_scaling.csv": "solids_scaling.csv"},
    "gpu_programs.md": {"gpu_programs.csv": "programs.csv"},
    "gpu_sparse.md": {"gpu_sparse.csv": "sparse.csv", "gpu_octrees.csv": "octrees.csv"},
    "gpu_computed.md": {"gpu_computed.csv": "computed.csv"},
    "gpu_primitives.md": {"gpu_primitives.csv": "primitives.csv"},
    "gpu_distance.md": {"gpu_distance.csv": "distance.csv"},
    "gpu_surfaces.md": {"gpu_surfaces.csv": "surfaces.csv"},
    "gpu_cut_cells.md": {"gpu_cut_cells.csv": "cut_cells.csv"},
    "cpu_cells.md": {"cpu_cells.csv": "cells.csv"},
    "cpu_sparse.md": {"cpu_sparse.csv": "sparse.csv"},
    "cpu_surfaces.md": {"cpu_surfaces.csv": "surfaces.csv"},
    "cpu_processor_time.md": {"cpu_processor_time.csv": "processor_time.csv"},
    "cpu.md": {"cpu_scenes.csv": "table.csv", "cpu_stages.csv": "stages.csv", "cpu_published.csv": "published.csv"},
}
MEANS = "Geometric means"
NOTES = "Notes"


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def sections(text):
    """{title: body} of a Markdown text by its second-level headings; what stands before the first is under ''."""
    parts = re.split(r"^## (.*)\n", text, flags=re.M)
    return {"": parts[0].strip()} | {title: body.strip() for title, body in zip(parts[1::2], parts[2::2])}


def head_of(report):
    """The lines at the start of a benchmark's report: device, compiler, commit, command."""
    found = re.search(r"^- .*(?:\n- .*)*", report, flags=re.M)
    if not found:
        sys.exit("error: the report has no head")
    return found.group()


def commit_of(head):
    found = re.search(r"^- commit: ([0-9a-f]{7})[0-9a-f]*(-dirty)?$", head, flags=re.M)
    if not found:
        sys.exit("error: the report names no commit")
    return found.group(1) + (found.group(2) or "")


def times_of(rows):
    """(cell, milliseconds as they were written) of a table's whole calls."""
    for row in rows:
        if "scene" in row:  # a GPU's: voxelize, and voxelize_async as a captured graph
            cell = f"{row['scene']}/{row['resolution']}/{row['cell']}"
            yield from ((cell + way, row[column]) for way, column in (("", "ms"), ("/async", "async_ms")) if row[column])
        else:  # a CPU's: a column for each number of threads
            cell = f"{row['mesh']}/{row['N']}/{row['cell'].replace(' ', '_')}"
            for column, ms in row.items():
                threads = re.fullmatch(r"(\d+) threads?, ms", column)
                if threads and ms not in ("", "-"):
                    yield f"{cell}/threads_{threads.group(1)}", ms


def write_readme(machine, changed):
    path = ROOT / machine / "README.md"
    kept = sections(path.read_text(encoding="utf-8")) if path.exists() else {"": f"# {machine}"}
    for title in [title for title in kept if title.endswith(".csv")]:  # a file that is renewed leaves its old section
        older = [file for file in title.split(", ") if not any(file in new.split(", ") for new in changed)]
        body = kept.pop(title)
        if older:
            kept[", ".join(older)] = body
    kept |= changed
    order = [title for title in kept if title not in ("", MEANS, NOTES)]
    order = [""] + sorted(order, key=lambda title: "table" not in title) + [t for t in (MEANS, NOTES) if t in kept]
    text = "\n\n".join((f"## {title}\n\n" if title else "") + kept[title] for title in order)
    path.write_text(text + "\n", encoding="utf-8")


def record(machine, results):
    (ROOT / machine).mkdir(parents=True, exist_ok=True)
    changed, times, commit = {}, [], ""
    for report, files in REPORTS.items():
        files = {source: kept for source, kept in files.items() if (results / source).exists()}
        if not files or not (results / report).exists():
            continue
        text = (results / report).read_text(encoding="utf-8")
        head = head_of(text)
        commit = commit_of(head)
        changed[", ".join(files.values())] = head
        if MEANS in sections(text):
            changed[MEANS] = sections(text)[MEANS]
        for source, kept in files.items():
            shutil.copyfile(results / source, ROOT / machine / kept)
            if kept == "table.csv":
                times += [[commit, machine, cell, ms] for cell, ms in times_of(read(results / source))]
    if not changed:
        sys.exit(f"error: {results} holds no report of a benchmark")
    write_readme(machine, changed)
    fresh = not HISTORY.exists()
    with open(HISTORY, "a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if fresh:
            writer.writerow(HISTORY_COLUMNS)
        writer.writerows(times)
    print(f"records/{machine}: {', '.join(changed)} of {commit}; {len(times)} lines added to records/history.csv")


def stale_notes(readme):
    """What is wrong with the suite of a machine and with notes that quote a file which is replaced as a whole."""
    folder, errors = readme.parent, []
    parts = sections(readme.read_text(encoding="utf-8"))
    notes = parts.get(NOTES, "")
    suite = folder / "suite.txt"
    if suite.exists():
        text = suite.read_text(encoding="utf-8")
        failures, commit = re.search(r"^failures: (\d+)$", text, flags=re.M), re.search(r"^commit: (\w+)", text, flags=re.M)
        if not failures or not commit or failures.group(1) != "0":
            errors.append(f"{folder.name}/suite.txt has failures, or does not say that it has none and of which commit it is")
        elif not re.search(rf"^- `suite\.txt` has .* of {commit.group(1)}[.;,]", notes, flags=re.M):
            errors.append(f"{folder.name}/README.md: no note says that suite.txt is of {commit.group(1)}")
    for subject, name in (("Solids", "solids.csv"), ("Programs", "programs.csv")):
        named = [body for title, body in parts.items() if name in title.split(", ")]
        for note in re.findall(rf"^- {subject}\b(.*)", notes, flags=re.M) if named else []:
            if not note.startswith(f" at {commit_of(named[0])}"):
                errors.append(f"{folder.name}/README.md: the note on {subject.lower()} is not of {commit_of(named[0])}, as {name} is")
    return errors


def check():
    history = read(HISTORY)
    errors = [] if history and list(history[0]) == HISTORY_COLUMNS else ["history.csv: other columns than expected"]
    known = {tuple(row.values()) for row in history}
    for path in sorted(ROOT.glob("*/*.csv")):
        machine = path.parent.name
        parts = sections((path.parent / "README.md").read_text(encoding="utf-8"))
        named = [body for title, body in parts.items() if path.name in title.split(", ")]
        if not named:
            errors.append(f"{machine}/README.md does not describe {path.name}")
        elif path.name == "table.csv":
            commit = commit_of(named[0])
            lost = [cell for cell, ms in times_of(read(path)) if (commit, machine, cell, ms) not in known]
            if lost:
                errors.append(f"history.csv lacks {len(lost)} figures of {machine}/table.csv at {commit}, first {lost[0]}")
    for readme in sorted(ROOT.glob("*/README.md")):
        errors += stale_notes(readme)
    for line in errors:
        print(f"error: {line}", file=sys.stderr)
    return 1 if errors else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("machine", nargs="?")
    parser.add_argument("results", nargs="?", type=pathlib.Path)
    how = parser.parse_args()
    if how.check:
        return check()
    if not how.machine or not how.results:
        parser.error("name a machine and a folder of results")
    record(how.machine, how.results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
