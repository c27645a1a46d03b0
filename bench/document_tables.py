#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of measured times in README.md, docs/paper.md and docs/performance_tables.md from records/.

    document_tables.py [--update]

A table stands between the lines `<!-- records: NAME -->` and `<!-- /records -->`. Without --update the script only compares, and
fails where a document, or the chart of docs/paper.md (bench/plot.py --paper), shows other figures than the records. Needs the standard library only.
"""
import argparse
import math
import re
import sys

import paper as paper_figures
from record import ROOT, read, sections

DOCUMENTS = ["README.md", "docs/paper.md", "docs/performance_tables.md"]
COLUMNS = [
    ("bit_conservative", "bit, conservative"),
    ("bit_thin", "bit, thin"),
    ("float_add_conservative", "float sum of 1"),
    ("float_add_tracked_conservative", "the same, changes tracked"),
    ("float_add_varying_conservative", "float sum of a varying"),
    ("abuffer_thin", "A-buffer, thin"),
    ("abuffer_conservative", "A-buffer, conservative"),
]
PUBLISHED = ["bit_conservative", "bit_thin", "float_add_conservative", "abuffer_thin"]
NAMES = dict(COLUMNS)


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def short(ms):
    """Three significant digits, as the benchmark's own tables have them."""
    value = float(ms)
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def gpu_rows():
    return {(r["scene"], int(r["resolution"]), r["cell"]): r for r in read(ROOT / "h200" / "table.csv")}


def fastest(row):
    """The fastest published figure of a cell in milliseconds, as text."""
    return min((text for text in (row["original_ms"], row["peer_ms"]) if text), key=float)


def ahead(rows, cells, column="ms"):
    """How many times as fast as the fastest published figure, of every scene and grid that has one."""
    return [float(fastest(r)) / float(r[column]) for (_, _, cell), r in rows.items() if cell in cells]


def head_line(machine, file="table.csv"):
    parts = sections((ROOT / machine / "README.md").read_text(encoding="utf-8"))
    head = next(body for title, body in parts.items() if file in title.split(", "))
    value = {k: re.search(rf"^- {k}: (.*)$", head, flags=re.M) for k in ("device", "processor", "driver", "commit", "date")}
    got = {k: found.group(1) for k, found in value.items() if found}
    device = got.get("device", got.get("processor", "")).split(", ")[0].replace("(R)", "")
    driver = f", driver {got['driver'].split(' ')[0]}" if "driver" in got else ""
    return f"{device}{driver}, {got['date'].split(' ')[0]}, commit {got['commit'][:7]}."


def times():
    """Every scene and grid in the columns of the GPU's table."""
    rows = gpu_rows()
    places = list(dict.fromkeys(key[:2] for key in rows))
    body = [[f"{scene} {n}"] + [short(rows[scene, n, cell]["ms"]) for cell, _ in COLUMNS] for scene, n in places]
    return head_line("h200") + " Milliseconds, medians of 20 calls.\n\n" + table(["scene, N"] + [t for _, t in COLUMNS], body)


def means():
    """Geometric means against the fastest published figures."""
    rows = gpu_rows()
    body = []
    tracked = ["float_add_tracked_conservative" if c == "float_add_conservative" else c for c in PUBLISHED]
    for name, cells, column in (
        ("`voxelize`", PUBLISHED, "ms"),
        ("`voxelize_async`", PUBLISHED, "async_ms"),
        ("`voxelize`, sums with tracked changes", tracked, "ms"),
        ("`voxelize_async`, sums with tracked changes", tracked, "async_ms"),
    ):
        values = ahead(rows, cells, column)
        body.append([name] + [f"{mean(ahead(rows, [c], column)):.2f} ×" for c in cells] + [f"{mean(values):.2f} ×"] +
                    [str(sum(v >= least for v in values)) for least in (1.5, 3)])
    head = [""] + [NAMES[c] for c in PUBLISHED] + [f"all {len(ahead(rows, PUBLISHED))}", "1.5 × or more", "3 × or more"]
    return table(head, body)


def solid_rows():
    return {(r["scene"], int(r["resolution"]), r["rule"]): r for r in read(ROOT / "h200" / "solids.csv")}


def solids_behind():
    """Where `voxelize_solid` takes longer than the fastest published figure: grid, rule, how many scenes, the ratios."""
    parts = []
    behind = {}
    for (_, n, rule), r in solid_rows().items():
        if rule in ("even_odd", "nonzero") and r["peer_ms"] and float(r["peer_ms"]) < float(r["ms"]):
            behind.setdefault((n, rule), []).append(float(r["peer_ms"]) / float(r["ms"]))
    for (n, rule), values in behind.items():
        ratios = dict.fromkeys(f"{v:.2f}" for v in (min(values), max(values)))
        parts.append(f"{rule} on {len(values)} scenes at {n}³ ({' to '.join(ratios)} ×)" if len(values) > 1 else
                     f"{rule} on one scene at {n}³ ({values[0]:.2f} ×)")
    if not parts:
        return "`voxelize_solid` is ahead of the published figures in every cell."
    return "`voxelize_solid`, which waits for its counters, is behind the published figures with\n" + " and ".join(parts) + "."


def solids():
    """Solids into bits: both rules beside the published figure, the baseline and the floor."""
    rows = solid_rows()
    body = []
    for (scene, n, rule), r in rows.items():
        if rule != "even_odd" or not r["peer_ms"]:
            continue
        other = rows[scene, n, "nonzero"]
        body.append([f"{scene} {n}"] + [short(v) for v in (r["ms"], r["async_ms"], other["ms"], r["peer_ms"])] +
                    [f"{float(r['peer_ms']) / float(ours):.2f} ×" for ours in (r["async_ms"], r["ms"], other["ms"])] +
                    [short(r["baseline_ms"]), short(r["floor_ms"])])
    head = ["scene, N", "even_odd", "even_odd, async", "nonzero", "fastest published", "published / async", "published / even_odd",
            "published / nonzero", "baseline", "floor"]
    return "\n\n".join([head_line("h200", "solids.csv") + " Milliseconds, medians of 7 calls.", table(head, body), solids_behind()])


def solid_rules():
    """Both rules and the repairs into bits, of the newest design."""
    rows = {(r["scene"], r["resolution"], r["rule"]): r for r in read(ROOT / "h200" / "solids.csv")}
    body = []
    for scene, n in dict.fromkeys(key[:2] for key in rows):
        if n == "256":
            continue
        odd, nonzero, *repairs = (rows[scene, n, rule] for rule in ("even_odd", "nonzero", "vote", "close_holes"))
        body.append([f"{scene} {n}", short(odd["ms"]), short(nonzero["ms"]), f"{float(nonzero['ms']) / float(odd['ms']):.2f} ×"] +
                    [short(r["ms"]) for r in repairs] + [short(odd["floor_ms"])])
    head = ["scene, N", "even_odd", "nonzero", "nonzero / even_odd", "vote", "close_holes", "floor"]
    return head_line("h200", "solids.csv") + " Milliseconds, medians of 7 calls.\n\n" + table(head, body)


def speed():
    """A row a kind of target: two scenes at 512, and the mean over all scenes and grids; solids from 512 on."""
    rows = gpu_rows()
    body = []

    def add(name, pair, ours, published, values, grids):
        body.append([name] + [text for r in pair for text in (short(ours(r)), short(published(r)))] + [f"{mean(values):.1f} × at {grids}"])

    for cell in PUBLISHED:
        pair = [rows[scene, 512, cell] for scene in ("dragon", "conference")]
        add(NAMES[cell], pair, lambda r: r["ms"], fastest, ahead(rows, [cell]), "128³, 512³, 1024³")
    solid = solid_rows()
    for rule in ("even_odd", "nonzero"):
        pair = [solid[scene, 512, rule] for scene in ("dragon", "conference")]
        values = [float(r["peer_ms"]) / float(r["ms"]) for (_, n, which), r in solid.items() if which == rule and n >= 512]
        add(f"solid bits, {rule}", pair, lambda r: r["ms"], lambda r: r["peer_ms"], values, "512³, 1024³")
    dragon, conference = (int(rows[scene, 512, "bit_thin"]["triangles"]) for scene in ("dragon", "conference"))
    head = ["512³ voxels, milliseconds", f"dragon, {dragon:,} triangles", "fastest published", f"conference, {conference:,} triangles",
            "fastest published", "mean of 5 scenes"]
    return "\n\n".join([head_line("h200") + "\nSolids: " + head_line("h200", "solids.csv"), table(head, body), solids_behind()])


def icosphere():
    rows = read(ROOT / "xeon" / "published.csv")
    ours = ["VoxelPipe, 1 thread", "VoxelPipe, 2 threads"]
    others = [c for c in rows[0] if c not in ("N", "voxels", "baseline, 1 thread", *ours) and not c.startswith("ahead")]
    body = [[r["N"]] + [r[c] for c in ours + others] for r in rows]
    return head_line("xeon", "published.csv") + " Milliseconds.\n\n" + table(["N"] + ours + others, body)


def peers():
    """The newest record of bench/python/compare.py: surfaces and solids at one resolution, by program."""
    cells = {(r["program"], r["resolution"]): r for r in read(ROOT / "xeon" / "python.csv")}
    columns = [("voxelpipe voxelize", "surface: VoxelPipe"), ("Open3D VoxelGrid", "Open3D"), ("trimesh voxelized", "trimesh"),
               ("voxelpipe solid", "solid: VoxelPipe"), ("Open3D compute_occupancy", "Open3D"), ("trimesh voxelized().fill()", "trimesh"),
               ("PyVista voxelize_binary_mask", "PyVista")]
    columns = [c for c in columns if any(program == c[0] for program, _ in cells)]
    sizes = sorted({int(n) for _, n in cells})
    body = [[str(n)] + [short(cells[p, str(n)]["ms"]) if (p, str(n)) in cells else "-" for p, _ in columns] for n in sizes]
    return head_line("xeon", "python.csv") + " Milliseconds.\n\n" + table(["N"] + [name for _, name in columns], body)


def paper(title, columns):
    """Columns of the paper beside those of the H200, every scene and grid."""
    body = []
    for r in paper_figures.rows():
        name, _, here = paper_figures.SCENES[r["scene"]]
        what = f"{name}, {re.split('[,:]', here)[0]}" if r["resolution"] == 128 else ""
        body.append([what, f"{r['resolution']}³"] + [f"{r[c]:.1f}" if c.startswith("paper") else short(r[c]) for _, c in columns])
    heads = head_line("h200")
    if any(c.startswith("tiled") for _, c in columns):
        heads += "\nBy tiles: " + head_line("h200", "computed.csv")
    return f"{title}, milliseconds. H200, ours: " + heads + "\n\n" + table(["scene, its mesh on the H200", "N"] + [t for t, _ in columns], body)


def paper_scenes():
    """Which mesh stands for each scene of the paper."""
    triangles = {r["scene"]: r["triangles"] for r in paper_figures.rows()}
    body = [[name, there, here, f"{triangles[scene]:,}"] for scene, (name, there, here) in paper_figures.SCENES.items()]
    return table(["scene", "triangles in the paper", "mesh on the H200", "its triangles"], body)


def paper_binary():
    return paper("Binary output", [("GTX 480, paper: Schwarz & Seidel", "paper_one_thread_a_triangle"), ("GTX 480, paper: VoxelPipe", "paper_bit"),
                                   ("H200: 2011 code", "original_bit"), ("H200: ours by tiles", "tiled_bit"), ("H200: ours", "ours_bit")])


def paper_float():
    return paper("Float output", [("GTX 480, paper: VoxelPipe", "paper_float"), ("H200: 2011 code", "original_float"),
                                  ("H200: ours by tiles", "tiled_float"), ("H200: ours", "ours_float")])


def paper_abuffer():
    return paper("A-buffer", [("GTX 480, paper: VoxelPipe", "paper_abuffer"), ("H200: 2011 code, thin", "original_abuffer"),
                              ("H200: ours, thin", "ours_abuffer"), ("H200: ours, conservative", "ours_abuffer_conservative")])


def paper_means():
    """2011 / ours of each column: mean, least, greatest."""
    rows = paper_figures.rows()
    pairs = [("binary, chosen", "original_bit", "ours_bit"), ("float, chosen", "original_float", "ours_float"),
             ("A-buffer, thin", "original_abuffer", "ours_abuffer"), ("binary, tiles", "original_bit", "tiled_bit"),
             ("float, tiles", "original_float", "tiled_float")]
    body = []
    for name, theirs, ours in pairs:
        ratios = [r[theirs] / r[ours] for r in rows]
        body.append([name, f"{mean(ratios):.2f} ×", f"{min(ratios):.2f} ×", f"{max(ratios):.2f} ×", str(sum(v < 1 for v in ratios))])
    return table(["2011 code / ours, one H200", "mean of 15", "least", "greatest", "cells behind"], body)


TABLES = {"peers": peers, "paper_scenes": paper_scenes, "paper_binary": paper_binary, "paper_float": paper_float, "paper_abuffer": paper_abuffer,
          "paper_means": paper_means,
          "times": times, "means": means, "speed": speed, "icosphere": icosphere, "solids": solids, "solid_rules": solid_rules}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true")
    update = parser.parse_args().update
    status = 0
    for name in DOCUMENTS:
        path = ROOT.parent / name
        text = path.read_text(encoding="utf-8")
        fresh = re.sub(r"(<!-- records: (\w+) -->\n).*?(<!-- /records -->)",
                       lambda m: f"{m[1]}{TABLES[m[2]]()}\n{m[3]}", text, flags=re.S)
        if update and fresh != text:
            path.write_text(fresh, encoding="utf-8")
        elif fresh != text:
            print(f"error: {name} shows other figures than records/; bench/document_tables.py --update writes them", file=sys.stderr)
            status = 1
    if paper_figures.digest_of_png(paper_figures.CHART) != paper_figures.digest(paper_figures.rows()):
        print(f"error: {paper_figures.CHART.name} shows other figures than records/; bench/plot.py --paper --out docs draws it", file=sys.stderr)
        status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
