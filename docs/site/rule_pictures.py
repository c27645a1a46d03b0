# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the guide: the four coverages, the three extents of a solid, an open solid without and with each repair. Needs the
Python package and Pillow 10.1.

    rule_pictures.py docs [WIDTH]     writes coverages.png, extents.png and repairs.png
"""

import pathlib
import sys
import tempfile
import warnings

import numpy as np
import voxelpipe as vp
from PIL import Image, ImageDraw, ImageFont

folder = pathlib.Path(sys.argv[1])
width = int(sys.argv[2]) if len(sys.argv) > 2 else 1200
font = ImageFont.load_default(width // 60)
INK, PAPER, FILL, LINE = (40, 44, 52), (255, 255, 255), (232, 158, 72), (38, 84, 164)


def sphere(rows=64, sides=96):
    """Vertices and triangles of a unit sphere, the triangles row by row from the top."""
    down, around = np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, sides, endpoint=False)
    d, a = np.meshgrid(down, around, indexing="ij")
    points = np.stack([np.sin(d) * np.cos(a), np.cos(d), np.sin(d) * np.sin(a)], axis=-1).reshape(-1, 3)
    here = np.arange(len(points)).reshape(rows + 1, sides)
    below, right = here[1:], np.roll(here, -1, axis=1)
    upper = np.stack([here[:-1], right[:-1], below], axis=-1)
    lower = np.stack([right[:-1], np.roll(below, -1, axis=1), below], axis=-1)
    triangles = np.stack([upper, lower], axis=2).reshape(-1, 3)
    corners = points[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return points, triangles[area > 1e-9]


def side_by_side(name, panels):
    """Panels of one size, each with its text below."""
    gap, text = width // 60, width // 14
    height = panels[0][0].height
    whole = Image.new("RGB", (width, height + text), PAPER)
    draw = ImageDraw.Draw(whole)
    step = width / len(panels)
    for i, (picture, label) in enumerate(panels):
        whole.paste(picture, (round(i * step + (step - picture.width) / 2), 0))
        draw.multiline_text(((i + 0.5) * step, height + gap // 2), label, INK, font, anchor="ma", align="center")
    whole.quantize(128).save(folder / f"{name}.png", optimize=True)  # a third of the bytes


def rendered(values, grid, side, **how):
    with tempfile.TemporaryDirectory() as scratch:
        file = pathlib.Path(scratch, "panel.png")
        vp.save(file, values, grid, size=(side, side), background="white", **how)
        return Image.open(file).convert("RGB")


def coverages():
    triangle = np.array([[0.0, 0.0, 0.1], [1.0, 0.25, 0.0], [0.35, 0.95, 0.75]]), np.array([[0, 1, 2]])
    grid = vp.fit(triangle, 18)
    panels = []
    for rule in ("conservative", "crosshair", "diagonal", "thin"):
        covered = vp.voxelize(triangle, grid, rule)
        panels.append((rendered(covered, grid, width // 4, azimuth=60, elevation=10), f"{rule}\n{covered.sum()} voxels"))
    side_by_side("coverages", panels)


def extents():
    """The middle slice of a ball, and the ball's own outline."""
    ball, n = sphere(), 13
    side = width // 3 - width // 20
    grid = vp.Grid((-1.08,) * 3, (2.16 / n,) * 3, (n, n, n))
    unit, panels = side / n, []
    for extent in ("inner", "centre", "outer"):
        inside = vp.solid(ball, grid, extent=extent)
        picture = Image.new("RGB", (4 * side, 4 * side), PAPER)
        draw = ImageDraw.Draw(picture)
        for (y, x), occupied in np.ndenumerate(inside[n // 2]):
            box = [4 * unit * x, 4 * unit * (n - 1 - y), 4 * unit * (x + 1), 4 * unit * (n - y)]
            draw.rectangle(box, FILL if occupied else PAPER, (210, 212, 216), 4)
            if extent == "centre":
                middle = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2]
                draw.ellipse([middle[0] - 7, middle[1] - 7, middle[0] + 7, middle[1] + 7], INK)
        radius = 4 * side / 2.16
        draw.ellipse([2 * side - radius, 2 * side - radius, 2 * side + radius, 2 * side + radius], None, LINE, 12)
        picture = picture.resize((side, side), Image.Resampling.LANCZOS)
        volume = inside.sum() * (2.16 / n) ** 3 / (4 / 3 * np.pi)
        panels.append((picture, f"{extent}\n{100 * volume:.1f} % of the ball's volume"))
    side_by_side("extents", panels)


def repairs():
    """A sphere with a round hole at its upper right, halved to show its inside."""
    points, triangles = sphere()
    lid = points[triangles].mean(axis=1) @ np.array([0.8, 0.6, 0.0]) > 0.9
    grid = vp.fit((points, triangles), voxel_size=2 / 60, padding=2)
    closed = vp.solid((points, triangles), grid, extent="centre").sum()
    broken = points, triangles[~lid]
    panels = []
    for label, options in (
        ("the mesh", None),
        ("no repair", {}),
        ("close_holes", {"repair": "close_holes"}),
        ("winding", {"repair": "winding"}),
        ("vote", {"repair": "vote"}),
        ("exterior, closing 15", {"repair": "exterior", "closing": 15}),
    ):
        if options is None:
            volume, text = vp.voxelize(broken, grid), label
        else:
            extent = {} if options.get("repair") in ("vote", "exterior") else {"extent": "centre"}
            warnings.simplefilter("ignore", vp.OpenMeshWarning)
            volume = vp.solid(broken, grid, **extent, **options)
            text = f"{label}\n{100 * volume.sum() / closed:.1f} %"
        half = volume.copy()
        half[grid.shape[0] // 2 :] = False
        panels.append((rendered(half, grid, width // 6, azimuth=25, elevation=15), text))
    side_by_side("repairs", panels)


coverages()
extents()
repairs()
