# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The 256 cells of docs/design.md, "Surfaces", with their sheets, and the flipped ones below them. The sheets are those of the table
that the library makes, which a program compiled here prints. Needs Pillow 10.1 and a C++ compiler.

    cell_pictures.py docs/cells.png [WIDTH]
"""

import os
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw, ImageFont

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = r"""
#include <voxelpipe/surfaces/core/cell_table.hpp>
#include <cstdio>
using namespace voxelpipe::core;
int main() {
    for (int f = 0; f < 6; ++f) {
        const cell_face face = face_of_cell(f);
        for (int i = 0; i < 4; ++i) std::printf("%d %d ", face.corner[i], face.edge[i]);
        std::puts("");
    }
    for (int e = 0; e < 12; ++e) std::printf("%d %d ", edge_corner(e), edge_corner(e) + (1 << (e >> 2)));
    std::puts("");
    for (const cell_sheets& s : make_cell_table()) {
        for (int e = 0; e < 12; ++e) std::printf("%d ", s.of_edge(e));
        std::printf("%d %d\n", s.count(), s.joined_face());
    }
}
"""
COLORS = [(236, 140, 40), (64, 132, 200), (96, 170, 84), (196, 84, 140)]  # of sheets
NO_SHEET, NO_FACE = 15, 7
SIDE, DEPTH = (0.84, 0.09), (-0.35, 0.16)  # of x and y on the paper; z points up


def table():
    """Faces as lists of (corner, edge), edges as pairs of corners, and 512 rows: a sheet an edge, their number, the joined face."""
    with tempfile.TemporaryDirectory() as folder:
        source, program = pathlib.Path(folder, "table.cpp"), pathlib.Path(folder, "table")
        source.write_text(PROGRAM, encoding="utf-8")
        subprocess.run([os.environ.get("CXX", "g++"), "-std=c++20", f"-I{ROOT}", "-o", program, source], check=True)
        printed = subprocess.run([program], check=True, stdout=subprocess.PIPE, text=True).stdout
    rows = [[int(n) for n in line.split()] for line in printed.splitlines()]
    pairs = [list(zip(row[::2], row[1::2])) for row in rows[:7]]
    return pairs[:6], pairs[6], rows[7:]


def segments(corners, flipped, faces, edges):
    """Pairs of crossed edges on each face, as docs/design.md says."""
    crossed = [(corners >> a & 1) != (corners >> b & 1) for a, b in edges]
    pairs = []
    for f, face in enumerate(faces):
        on_face = [e for _, e in face if crossed[e]]
        if len(on_face) == 2:
            pairs.append(tuple(on_face))
        for i in range(4 if len(on_face) == 4 else 0):
            corner, after = face[i]
            if (corners >> corner & 1) != (f == flipped):
                pairs.append((face[i - 1][1], after))
    return pairs


def cycles(corners, row, flipped, faces, edges):
    """(sheet, its edges in order) of a cell; each is a cycle of segments, and they are the table's."""
    neighbours = {}
    for a, b in segments(corners, flipped, faces, edges):
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    found = []
    while neighbours:
        cycle = [min(neighbours)]
        while True:
            around = neighbours.pop(cycle[-1])
            onward = [e for e in around if e in neighbours]
            if not onward:
                break
            cycle.append(onward[0])
        assert {row[e] for e in cycle} == {len(found)} and len(cycle) == row[:12].count(len(found))
        found.append((len(found), cycle))
    assert len(found) == row[12]
    return found


class Sheet:
    """The paper: cells of `step` pixels, drawn larger and made smaller at the end."""

    def __init__(self, width, lines):
        self.step = 4 * (width - 28) // 16
        self.left, self.top = width * 4 - 16 * self.step, 4 * 24
        self.image = Image.new("RGB", (width * 4, self.top + int(self.step * lines) + 40), "white")
        self.pen = ImageDraw.Draw(self.image, "RGBA")
        self.font = ImageFont.load_default(size=self.step // 9)

    def place(self, at, point):
        x, y, z = point
        scale = 0.66 * self.step
        u = 0.35 + SIDE[0] * x + DEPTH[0] * y
        v = 1.16 + SIDE[1] * x + DEPTH[1] * y - 0.86 * z
        return at[0] + scale * u + 0.10 * self.step, at[1] + scale * (v - 0.20) + 0.10 * self.step

    def cell(self, column, line, corners, found, joined, faces, edges, is_flipped=False):
        at = (self.left + column * self.step, self.top + line * self.step)
        position = [(c & 1, 1 - (c >> 1 & 1), c >> 2) for c in range(8)]  # y goes away from the reader
        paper = [self.place(at, p) for p in position]
        thin = max(1, self.step // 130)

        def draw_edges(is_behind):
            for a, b in edges:
                touches = 2 in (a, b)  # the corner furthest away: x 0, y 1, z 0
                if touches == is_behind:
                    self.pen.line([paper[a], paper[b]], fill=(176, 176, 176) if is_behind else (120, 120, 120), width=thin)

        draw_edges(True)
        if joined != NO_FACE:
            corner = [paper[c] for c, _ in faces[joined]]
            self.pen.polygon(corner, fill=(220, 30, 30, 34))
        middles = [tuple((position[a][k] + position[b][k]) / 2 for k in range(3)) for a, b in edges]
        polygons = []
        for sheet, cycle in found:
            mean = tuple(sum(middles[e][k] for e in cycle) / len(cycle) for k in range(3))
            for i, e in enumerate(cycle):
                corner = [mean, middles[e], middles[cycle[(i + 1) % len(cycle)]]]
                far = sum(p[0] * 0.3 - p[1] + p[2] * 0.5 for p in corner)
                u, v = ([b - a for a, b in zip(corner[0], c)] for c in corner[1:])
                normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
                length = sum(n * n for n in normal) ** 0.5
                light = 0.62 + 0.38 * abs(normal[2] * 0.8 - normal[0] * 0.4 + normal[1] * 0.45) / length
                color = tuple(int(light * c) for c in COLORS[sheet]) + (216,)
                polygons.append((far, [self.place(at, p) for p in corner], color))
        for _, corner, color in sorted(polygons, key=lambda p: p[0]):
            self.pen.polygon(corner, fill=color)
        for _, cycle in found:
            self.pen.line([self.place(at, middles[e]) for e in [*cycle, cycle[0]]], fill=(40, 40, 40), width=thin)
        draw_edges(False)
        if joined != NO_FACE:
            corner = [paper[c] for c, _ in faces[joined]]
            self.pen.line([*corner, corner[0]], fill=(220, 30, 30), width=2 * thin)
        radius = self.step / 34
        for c, (x, y) in enumerate(paper):
            if corners >> c & 1:
                self.pen.ellipse([x - radius, y - radius, x + radius, y + radius], fill=(30, 30, 30))
        if is_flipped:
            self.write((at[0] + self.step * 0.12, at[1] + self.step * 0.10), f"{corners:02X}", (220, 30, 30))

    def write(self, at, text, fill=(90, 90, 90)):
        self.pen.text(at, text, fill=fill, font=self.font, anchor="mm")

    def save(self, path):
        small = self.image.resize((self.image.width // 4, self.image.height // 4), Image.LANCZOS)
        small.quantize(256, method=Image.Quantize.FASTOCTREE).save(path, optimize=True)


def main():
    width = int(sys.argv[2]) if len(sys.argv) > 2 else 1600
    faces, edges, rows = table()
    joined = [c for c in range(256) if rows[c][13] != NO_FACE]
    sheet = Sheet(width, 16 + 0.5 + (len(joined) + 15) // 16)
    for n in range(16):
        sheet.write((sheet.left + (n + 0.5) * sheet.step, sheet.top / 2), f"{n:X}")
        sheet.write((sheet.left / 2, sheet.top + (n + 0.5) * sheet.step), f"{n:X}0")
    for c in range(256):
        sheet.cell(c % 16, c // 16, c, cycles(c, rows[c], NO_FACE, faces, edges), rows[c][13], faces, edges)
    sheet.write((sheet.left + 2.6 * sheet.step, sheet.top + 16.25 * sheet.step), "The cells with a red face, that face flipped:")
    for n, c in enumerate(joined):
        found = cycles(c, rows[256 + c], rows[c][13], faces, edges)
        sheet.cell(n % 16, 16.5 + n // 16, c, found, rows[c][13], faces, edges, True)
    sheet.save(sys.argv[1])
    print(f"{len(joined)} cells have a face to flip")


if __name__ == "__main__":
    main()
