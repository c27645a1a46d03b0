#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Draws the CSV files of bench_gpu_scaling and bench_gpu_table.

    plot.py [--scaling gpu_scaling.csv] [--table gpu.csv] [--label TEXT] OUT_FOLDER

Writes scaling_triangles.png, scaling_grid.png, scaling_size.png and scaling_depth.png from the one, ahead.png from the
other; series and cells that a file does not have are left out. Needs matplotlib (bench/requirements.txt).
"""
import argparse
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend has to be chosen first)
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: E402

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
    figure.savefig(out / f"scaling_{name}.png", dpi=110)
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scaling", help="gpu_scaling.csv")
    parser.add_argument("--table", help="gpu.csv")
    parser.add_argument("--label", default="", help="e.g. the device and the commit, for the titles")
    parser.add_argument("out", type=pathlib.Path, help="folder for the PNG files")
    how = parser.parse_args()
    how.out.mkdir(parents=True, exist_ok=True)
    drawn = 0
    if how.scaling:
        rows = read(how.scaling)
        for name in SERIES:
            mine = [r for r in rows if r["series"] == name]
            if mine:
                plot_series(name, mine, how.label, how.out)
                drawn += 1
    if how.table:
        drawn += plot_ahead(read(how.table), how.label, how.out)
    print(f"{drawn} plots in {how.out}")
    return 0 if drawn else 1


if __name__ == "__main__":
    sys.exit(main())
