# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""A plot of records/history.csv: the geometric mean of a machine's cells, commit after commit, each relative to its last."""
import collections
import csv
import math

SERIES = [("bit_conservative", "bit, conservative", "#2f6f9f"), ("bit_thin", "bit, thin", "#d07a2d"),
          ("float_add_conservative", "float sum", "#4f8a4b"), ("abuffer_thin", "A-buffer, thin", "#9a4f96")]
WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 760, 380, 60, 60, 20


def means(path, machine, column):
    """[(commit, mean ratio to the last value of each cell)] in the file's order, of commits that have all cells."""
    values = collections.OrderedDict()
    with open(path, newline="", encoding="utf-8") as f:
        for row in csv.DictReader(f):
            mesh, n, name, *rest = row["cell"].split("/")
            if row["machine"] == machine and name == column and not rest and float(row["ms"]) > 0:
                values.setdefault(row["commit"], {})[mesh, n] = float(row["ms"])
    if not values:
        return []
    last = list(values.values())[-1]
    whole = [(commit, cells) for commit, cells in values.items() if last.keys() <= cells.keys()]
    return [(commit, math.exp(sum(math.log(cells[c] / last[c]) for c in last) / len(last))) for commit, cells in whole]


def svg(series):
    commits = list(dict.fromkeys(commit for _, _, points in series for commit, _ in points))
    top = max(ratio for _, _, points in series for _, ratio in points)
    ticks = [t for t in (1, 2, 4, 8, 16, 32) if t < 2 * top]

    def x(commit):
        return LEFT + (WIDTH - LEFT - 190) * commits.index(commit) / max(1, len(commits) - 1)

    def y(ratio):
        return HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * math.log(max(ratio, 0.8) / 0.8) / math.log(ticks[-1] / 0.8)

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
             f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>']
    for tick in ticks:
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - 190}" y1="{y(tick):.1f}" y2="{y(tick):.1f}" stroke="#d8dce0"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{y(tick) + 4:.1f}" text-anchor="end" fill="#444">{tick} ×</text>')
    # Names of two curves that end at one place are moved apart.
    ends = [HEIGHT - BOTTOM - 18 * (len(series) - i) for i in range(len(series))]
    for (name, color, points), end in zip(series, ends):
        line = " ".join(f"{x(c):.1f},{y(r):.1f}" for c, r in points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="2.5" stroke-linejoin="round"/>')
        parts.append(f'<rect x="{WIDTH - 180}" y="{end - 9:.1f}" width="14" height="4" fill="{color}"/>')
        parts.append(f'<text x="{WIDTH - 160}" y="{end:.1f}" fill="#222">{name}</text>')
    for commit in (commits[0], commits[-1]):
        parts.append(f'<text x="{x(commit):.1f}" y="{HEIGHT - BOTTOM + 22}" text-anchor="middle" fill="#444">{commit}</text>')
    parts.append(f'<text x="{LEFT}" y="{HEIGHT - 12}" fill="#444">Time relative to the latest commit, mean of all scenes and resolutions</text>')
    return "\n".join(parts + ["</svg>"]) + "\n"


def page(path, to):
    """Writes the plot, and returns the words for the page of performance."""
    series = [(name, color, means(path, "h200", column)) for column, name, color in SERIES]
    series = [s for s in series if len(s[2]) > 1]
    to.write_text(svg(series), encoding="utf-8")
    count = len({commit for _, _, points in series for commit, _ in points})
    return f"\n## History\n\nEach of the {count} commits that were measured on an H200, from records/history.csv.\n\n![Time by commit](_static/history.svg)\n"
