#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Draws the CSV files that the benchmarks write and records/ keeps.

    plot.py [--label TEXT] --out FOLDER FILE_OR_FOLDER...
    plot.py --paper --out docs          the chart of docs/paper.md, from records/h200

A folder stands for every CSV file in it of a known kind. A file is known by its columns, not by its name:

    GPU table        ahead.png: times ahead of the fastest published figure
    GPU scaling      scaling_triangles.png, scaling_grid.png, scaling_size.png, scaling_depth.png
    GPU, CPU stages  stages.png: share of each stage
    policies         policies.png: each policy against the best one of its cell
    CPU table        cpu.png: milliseconds by mesh, grid and threads
    CPU published    published.png: the icosphere next to other programs
    history          history.png: geometric mean over the scenes, commit by commit

Series and cells that a file does not have are left out. Needs matplotlib (bench/requirements.txt).
"""
import argparse
import csv
import math
import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend has to be chosen first)
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: E402

import paper  # noqa: E402

CELL_NAMES = {
    "bit_conservative": "bit, conservative",
    "bit_thin": "bit, thin",
    "bit_counted_conservative": "bit, conservative, voxels counted",
    "float_replace_conservative": "float replace by a constant, conservative",
    "float_add_conservative": "float add, reproducible, conservative",
    "float_add_unordered_conservative": "float add, unordered, conservative",
    "float_add_varying_conservative": "float add of a varying, conservative",
    "float_replace_tracked_conservative": "float replace by a constant, changes tracked",
    "float_add_tracked_conservative": "float add, changes tracked",
    "float_add_varying_tracked_conservative": "float add of a varying, changes tracked",
    "abuffer_thin": "A-buffer, thin",
    "abuffer_conservative": "A-buffer, conservative",
    "bit_solid_even_odd": "solid in bits, even_odd",
    "bit_solid_nonzero": "solid in bits, nonzero",
}
VARIANT_COLOURS = ["#1f6fb4", "#d1661c"]
BASELINE, REFERENCE = "#8a8a8a", "#b0b0b0"

# x axis, y axis, whether y is the time of a fragment, and the slopes of the reference lines with their names.
SERIES = {
    "triangles": ("triangles", "milliseconds", False, [(1, "∝ triangles")]),
    "grid": ("voxels along a side, N", "milliseconds", False, [(2, "∝ N²"), (3, "∝ N³")]),
    "size": ("edge of a triangle, voxels", "nanoseconds a fragment", True, [(0, "constant")]),
    "depth": ("fragments a voxel", "nanoseconds a fragment", True, [(0, "constant")]),
}


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def points(rows, column, each):
    """(x, y) of the rows that have this time, y in milliseconds or nanoseconds a fragment."""
    out = []
    for row in rows:
        if row[column]:
            y = float(row[column])
            out.append((float(row["x"]), y * 1e6 / float(row["fragments"]) if each else y))
    return sorted(out)


def draw(axes, xy, **style):
    if xy:
        axes.plot(*zip(*xy), **style)


def reference(axes, xy, slope, name):
    """A line of this slope through the last point, as far as the curve reaches and no lower."""
    (x0, low), (x1, y1) = (xy[0][0], min(y for _, y in xy)), xy[-1]
    if slope == 0:
        y1 = low
        left = x0
    else:
        left = max(x0, x1 * (low / y1) ** (1 / slope))
    axes.plot([left, x1], [y1 * (left / x1) ** slope, y1], ":", color=REFERENCE, linewidth=1.5, zorder=0)
    below = 10 if slope < 3 else 20
    axes.annotate(name, (left, y1 * (left / x1) ** slope), xytext=(0, -below), textcoords="offset points", fontsize=8,
                  color="#707070")


def plot_series(name, rows, label, out):
    x_name, y_name, each, slopes = SERIES[name]
    cells = [c for c in CELL_NAMES if any(r["cell"] == c for r in rows)]
    variants = list(dict.fromkeys(r["variant"] for r in rows))
    columns = 2 if len(cells) != 3 else 3
    lines = -(-len(cells) // columns)
    figure, panels = plt.subplots(lines, columns, figsize=(5.2 * columns, 3.9 * lines + 0.6), sharex=True, sharey=True,
                                  squeeze=False, layout="constrained")
    for axes in list(panels.flat)[len(cells):]:
        axes.set_visible(False)
    for axes, cell in zip(panels.flat, cells):
        for variant, colour in zip(variants, VARIANT_COLOURS):
            mine = [r for r in rows if r["cell"] == cell and r["variant"] == variant]
            if not mine:
                continue
            of = f", {variant}" if len(variants) > 1 else ""
            whole = points(mine, "ms", each)
            if variant == variants[0]:
                for slope, text in slopes:
                    reference(axes, whole, slope, text)
            draw(axes, points(mine, "baseline_ms", each), color=BASELINE, marker="x", markersize=4, linewidth=1,
                 linestyle="-" if variant == variants[0] else "--", label="one thread a triangle" + of)
            draw(axes, points(mine, "async_ms", each), color=colour, linestyle="--", linewidth=1.2,
                 label="voxelize_async" + of)
            draw(axes, whole, color=colour, marker="o", markersize=4, label="voxelize" + of)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_title(CELL_NAMES[cell], fontsize=10)
        axes.grid(True, which="major", color="#e4e4e4", linewidth=0.8)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelbottom=True)
        axes.set_xlabel(x_name)
        if name == "grid":
            sizes = sorted({int(float(r["x"])) for r in rows})
            axes.set_xticks(sizes, [str(n) for n in sizes])
            axes.xaxis.set_minor_formatter(NullFormatter())
    low, high = panels.flat[0].get_ylim()
    if high / low < 100:  # less than two decades: label 2 and 5 as well
        for axes in panels.flat:
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    for line in panels:
        line[0].set_ylabel(y_name)
    panels.flat[0].legend(fontsize=8, frameon=False)
    resolutions = {r["resolution"] for r in rows}
    where = f", {resolutions.pop()}³ voxels" if len(resolutions) == 1 else ""
    figure.suptitle(f"{name}: {', '.join(variants)}{where}" + (f" — {label}" if label else ""), fontsize=11)
    kind = "scaling_solids" if all(c.startswith("bit_solid") for c in cells) else "scaling"
    figure.savefig(out / f"{kind}_{name}.png", dpi=110)
    plt.close(figure)


def plot_ahead(rows, label, out):
    """How far ahead of the fastest published figure: a row a kind of cell, a mark a scene and resolution."""
    rows = [r for r in rows if r["fastest_over_ms"]]
    cells = [c for c in CELL_NAMES if any(r["cell"] == c for r in rows)]
    if not cells:
        return False
    scenes = list(dict.fromkeys(r["scene"] for r in rows))
    resolutions = sorted({int(r["resolution"]) for r in rows})
    colours = ["#1f6fb4", "#d1661c", "#3a9a56", "#8b5fbf", "#b8902a"]
    figure, axes = plt.subplots(figsize=(9.5, 0.75 * len(cells) + 1.9), layout="constrained")
    for row in rows:
        place = cells.index(row["cell"]) + (scenes.index(row["scene"]) - (len(scenes) - 1) / 2) * 0.14
        axes.plot(float(row["fastest_over_ms"]), place, "osD"[resolutions.index(int(row["resolution"])) % 3],
                  color=colours[scenes.index(row["scene"]) % len(colours)], markersize=5, alpha=0.9)
    for goal, text in ((1, "as fast"), (1.5, "the least"), (3, "the goal")):
        axes.axvline(goal, color="#606060" if goal == 1 else "#c0c0c0", linewidth=1, zorder=0)
        axes.annotate(f"{goal} × {text}", (goal, 1), xytext=(0, 3), xycoords=("data", "axes fraction"),
                      textcoords="offset points", fontsize=7, va="bottom", ha="center", color="#606060")
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g} ×"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yticks(range(len(cells)), [CELL_NAMES[c] for c in cells])
    axes.invert_yaxis()
    axes.grid(True, axis="x", color="#eeeeee")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("fastest published figure / ours (right is faster)")
    marks = [plt.Line2D([], [], marker="o", linestyle="", color=c, label=s) for s, c in zip(scenes, colours)]
    marks += [plt.Line2D([], [], marker=m, linestyle="", color="#606060", label=f"{n}³")
              for m, n in zip("osD", resolutions)]
    axes.legend(handles=marks, fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes.set_title("Ahead of the fastest published figure" + (f" — {label}" if label else ""), fontsize=11, pad=16)
    figure.savefig(out / "ahead.png", dpi=110)
    plt.close(figure)
    return True


def tidy(axes):
    axes.grid(True, axis="x", color="#eeeeee")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def number(text):
    """The first number of a cell of a table (of a range its lower end), or None where it holds none."""
    found = re.search(r"\d+(?:\.\d+)?", text)
    return float(found.group()) if found else None


def mean(values):
    return math.exp(sum(map(math.log, values)) / len(values))


def save(figure, label, title, out, name):
    figure.suptitle(title + (f" — {label}" if label else ""), fontsize=11)
    figure.savefig(out / name, dpi=110)
    plt.close(figure)


def plot_stages(rows, label, out):
    """A bar a scene and grid, a panel a kind of cell; of a CPU's the rows of one thread."""
    gpu = "scene" in rows[0]
    mesh, grid = ("scene", "resolution") if gpu else ("mesh", "N")
    rows = [r for r in rows if gpu or r["threads"] == "1"]
    known = {mesh, grid, "cell", "threads", "all stages", "call", "all, ms", "cpu, ms"}
    stages = [c for c in rows[0] if c not in known and any(r[c] and float(r[c]) for r in rows)]
    cells = list(dict.fromkeys(r["cell"] for r in rows))
    bars = list(dict.fromkeys((r[mesh], r[grid]) for r in rows))
    lines = -(-len(cells) // 3)
    figure, panels = plt.subplots(lines, 3, figsize=(14, (0.19 * len(bars) + 1.0) * lines + 0.8), sharey=True, squeeze=False,
                                  layout="constrained")
    for axes in list(panels.flat)[len(cells):]:
        axes.set_visible(False)
    for axes, cell in zip(panels.flat, cells):
        for row in (r for r in rows if r["cell"] == cell):
            times = [float(row[s] or 0) for s in stages]
            left, y = 0, bars.index((row[mesh], row[grid]))
            for k, share in enumerate(100 * t / sum(times) for t in times):
                axes.barh(y, share, left=left, color=plt.cm.tab10(k), height=0.8)
                left += share
        axes.set_yticks(range(len(bars)), [f"{m} {n}" for m, n in bars], fontsize=8)
        axes.set_title(CELL_NAMES.get(cell, cell), fontsize=9)
        axes.set_xlim(0, 100)
        tidy(axes)
    panels[0][0].invert_yaxis()
    marks = [plt.Rectangle((0, 0), 1, 1, color=plt.cm.tab10(k)) for k in range(len(stages))]
    figure.legend(marks, [s.replace("_", " ") for s in stages], loc="outside lower center", ncols=len(stages), frameon=False)
    save(figure, label, "Share of each stage in per cent" + ("" if gpu else ", one thread"), out, "stages.png")


def plot_policies(rows, label, out):
    """Every policy of the fine raster against the best one of its cell."""
    rows = [r for r in rows if r["over_best"]]
    targets = list(dict.fromkeys(r["target"] for r in rows))
    figure, panels = plt.subplots(1, len(targets), figsize=(6.5 * len(targets), 5), squeeze=False, layout="constrained")
    for axes, target in zip(panels[0], targets):
        by_policy = {}
        for r in (r for r in rows if r["target"] == target):
            name = f"{r['threads_per_block']} threads, {2 ** int(r['log2_tile_size'])}³, {r['min_blocks_per_sm']} blocks"
            by_policy.setdefault(name, []).append(float(r["over_best"]))
        order = sorted(by_policy, key=lambda name: mean(by_policy[name]))
        for y, name in enumerate(order):
            axes.plot(by_policy[name], [y] * len(by_policy[name]), "o", color="#1f6fb4", markersize=4, alpha=0.5)
            axes.plot(mean(by_policy[name]), y, "|", color="#d1661c", markersize=16, markeredgewidth=2.5)
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g} ×"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_yticks(range(len(order)), order)
        axes.invert_yaxis()
        axes.set_title(target, fontsize=10)
        axes.set_xlabel("time / best policy of the cell (line: geometric mean)")
        tidy(axes)
    save(figure, label, "Policies of the fine raster", out, "policies.png")


def plot_cpu(rows, label, out):
    cells = list(dict.fromkeys(r["cell"] for r in rows))
    meshes = list(dict.fromkeys(r["mesh"] for r in rows))
    columns = [c for c in rows[0] if re.fullmatch(r"\d+ threads?, ms", c)]
    figure, panels = plt.subplots(1, len(cells), figsize=(3.3 * len(cells), 4.2), sharey=True, squeeze=False,
                                  layout="constrained")
    for axes, cell in zip(panels[0], cells):
        for k, name in enumerate(meshes):
            mine = [r for r in rows if r["cell"] == cell and r["mesh"] == name]
            for column, style in zip(columns, ("-o", "--s", ":D", "-.^")):
                xy = [(float(r["N"]), number(r[column])) for r in mine]
                draw(axes, xy, marker=style[-1], linestyle=style[:-1], color=plt.cm.tab10(k), markersize=4,
                     label=f"{name}, {column.removesuffix(', ms')}")
        axes.set_xscale("log", base=2)
        axes.set_yscale("log")
        sizes = sorted({int(r["N"]) for r in rows})
        axes.set_xticks(sizes, [str(n) for n in sizes])
        axes.set_title(cell, fontsize=10)
        axes.set_xlabel("voxels along a side, N")
        tidy(axes)
    panels[0][0].set_ylabel("milliseconds")
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=min(len(meshes), 2 * len(cells)), fontsize=8,
                  frameon=False)
    save(figure, label, "CPU table", out, "cpu_solids.png" if all("solid" in c for c in cells) else "cpu.png")


def plot_published(rows, label, out):
    names = [c for c in rows[0] if c not in ("N", "voxels") and not c.startswith("ahead")]
    figure, panels = plt.subplots(1, len(rows), figsize=(4.6 * len(rows), 3.6), sharey=True, squeeze=False,
                                  layout="constrained")
    for axes, row in zip(panels[0], rows):
        for y, name in enumerate(names):
            ms = number(row[name])
            axes.barh(y, ms or 0, color="#1f6fb4" if name.startswith("VoxelPipe") else BASELINE)
            axes.annotate(row[name] if ms else "no figure", (ms or 5, y), xytext=(4, 0), textcoords="offset points",
                          va="center", fontsize=8)
        axes.set_xscale("log")
        axes.set_xlim(5, 4 * max(number(row[name]) or 0 for name in names))
        axes.set_yticks(range(len(names)), names)
        axes.set_title(f"{row['N']}³", fontsize=10)
        axes.set_xlabel("milliseconds")
        tidy(axes)
    panels[0][0].invert_yaxis()
    save(figure, label, "Icosphere, conservative bits", out, "published.png")


def plot_history(rows, label, out):
    """A panel a machine with more than one commit, a line a kind of cell: the mean of what every commit of the line has."""
    machines = {}
    for r in rows:
        scene, n, *cell = r["cell"].split("/")
        if cell[-1] == "async":
            continue
        commits = machines.setdefault(r["machine"], {})
        commits.setdefault(r["commit"], {}).setdefault("/".join(cell), {})[scene, n] = float(r["ms"])
    machines = {name: commits for name, commits in machines.items() if len(commits) > 1}
    if not machines:
        return False
    figure, panels = plt.subplots(len(machines), 1, figsize=(12, 5.5 * len(machines)), squeeze=False, layout="constrained")
    for axes, (machine, commits) in zip(panels[:, 0], machines.items()):
        order = list(commits)
        cells = list(dict.fromkeys(cell for tables in commits.values() for cell in tables))
        for k, cell in enumerate(cells):
            having = [c for c in order if cell in commits[c]]
            shared = set.intersection(*(set(commits[c][cell]) for c in having))
            xy = [(order.index(c), mean([commits[c][cell][place] for place in sorted(shared)])) for c in having]
            draw(axes, xy, marker="o", markersize=4, color=plt.cm.tab20(k % 20), label=CELL_NAMES.get(cell, cell))
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_xticks(range(len(order)), order, rotation=60, ha="right", fontsize=8)
        axes.set_ylabel("milliseconds, geometric mean of scenes and grids")
        axes.set_title(machine, fontsize=10)
        axes.grid(True, color="#eeeeee")
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    save(figure, label, "History", out, "history.png")
    return True


def plot_scaling(rows, label, out):
    drawn = 0
    for name in SERIES:
        mine = [r for r in rows if r["series"] == name]
        if mine:
            plot_series(name, mine, label, out)
            drawn += 1
    return drawn


# Columns that tell a kind of file from the others.
KINDS = [
    ({"scene", "fastest_over_ms"}, plot_ahead),
    ({"series", "variant"}, plot_scaling),
    ({"scene", "all stages"}, plot_stages),
    ({"mesh", "threads", "all, ms"}, plot_stages),
    ({"threads_per_block", "over_best"}, plot_policies),
    ({"mesh", "1 thread, ms"}, plot_cpu),
    ({"N", "VoxelPipe, 1 thread"}, plot_published),
    ({"commit", "machine", "cell", "ms"}, plot_history),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--label", default="", help="e.g. the device and the commit, for the titles")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for the PNG files")
    parser.add_argument("--paper", action="store_true", help="draw the chart of the paper's scenes")
    parser.add_argument("inputs", type=pathlib.Path, nargs="*", help="CSV files, or folders of them")
    how = parser.parse_args()
    if not how.inputs and not how.paper:
        parser.error("a file, a folder or --paper")
    how.out.mkdir(parents=True, exist_ok=True)
    drawn = int(how.paper and paper.plot(how.out, how.label))
    for path in [f for given in how.inputs for f in (sorted(given.glob("*.csv")) if given.is_dir() else [given])]:
        rows = read(path)
        plot = next((plot for columns, plot in KINDS if rows and columns <= set(rows[0])), None)
        if plot is None:
            if path not in how.inputs:
                continue  # a record of another kind
            sys.exit(f"error: {path} has no rows, or columns of no known kind")
        result = plot(rows, how.label, how.out)
        drawn += 1 if result is None else int(result)
    print(f"{drawn} plots in {how.out}")
    return 0 if drawn else 1


if __name__ == "__main__":
    sys.exit(main())
