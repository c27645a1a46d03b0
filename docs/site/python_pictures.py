# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""A picture for each function of the Python package, which the site shows below its docstring. Needs the package and Pillow.

    python_pictures.py docs/python [VOXELS [WIDTH]]
"""

import pathlib
import sys

import numpy as np
import voxelpipe as vp
from PIL import Image

folder = pathlib.Path(sys.argv[1])
size = int(sys.argv[2]) if len(sys.argv) > 2 else 96  # voxels along a side
width = int(sys.argv[3]) if len(sys.argv) > 3 else 360


def rings(profile, n=96, of=(0, 0, 0)):
    """A closed surface around y: the rows of `profile`, radius and height, turned."""
    around = np.linspace(0, 2 * np.pi, n, endpoint=False)
    r, y = (np.array(column)[:, None] for column in zip(*profile))
    points = np.stack([r * np.cos(around), y + 0 * around, r * np.sin(around)], axis=-1)
    here = np.arange(points.size // 3).reshape(points.shape[:2])
    below, right = np.roll(here, -1, axis=0), np.roll(here, -1, axis=1)
    corner = np.roll(below, -1, axis=1)
    halves = [np.stack(t, axis=-1).reshape(-1, 3) for t in ((here, below, right), (right, below, corner))]
    return points.reshape(-1, 3) + np.array(of), np.concatenate(halves)


def torus(of=(0, 0, 0), radius=1.0, thickness=0.4):
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    profile = [(radius + thickness * np.cos(a), thickness * np.sin(a)) for a in angle]
    return rings(profile, of=of)


def half(array):
    """The array without what lies in front of its middle."""
    cut = array.copy()
    cut[array.shape[0] // 2 :] = False if array.dtype == np.bool_ else 0
    return cut


def show(name, values, grid, occupied=None, **how):
    picture = folder / f"{name}.png"
    vp.save(picture, values, grid, occupied=occupied, size=(width, width * 2 // 3), background="white", **how)
    Image.open(picture).quantize(128).save(picture, optimize=True)  # a third of the bytes


def scale(values, low, high):
    """Colours from blue over white to red."""
    t = np.clip((np.asarray(values, np.float64) - low) / (high - low), 0, 1)[..., None]
    blue, white, red = np.array([38, 84, 164]), np.array([240, 238, 232]), np.array([188, 48, 38])
    mixed = np.where(t < 0.5, blue + (white - blue) * 2 * t, white + (red - white) * (2 * t - 1))
    return np.rint(mixed).astype(np.uint8)


def hue(points):
    """sRGB colours that go round the y axis."""
    angle = np.arctan2(points[:, 2], points[:, 0])
    return np.uint8(127 + 127 * np.stack([np.cos(angle), np.cos(angle - 2), np.cos(angle + 2)], axis=-1))


ring = torus()
vertices, triangles = ring
rgb = hue(vertices)
grid, coarse = vp.fit(ring, size), vp.fit(ring, size // 4)

surface = vp.voxelize(ring, grid)
inside = vp.solid(ring, grid)
show("fit", vp.voxelize(ring, coarse), coarse)
show("voxelize", half(surface), grid)
show("solid", half(inside), grid)

voxels, tiles = vp.tiles(ring, grid)
blocks = np.zeros((*grid.shape, 3), np.uint8)
for (x, y, z), edge in zip(*(a.tolist() for a in (tiles[:, :3], tiles[:, 3]))):
    blocks[z : z + edge, y : y + edge, x : x + edge] = 80 + np.random.default_rng(x + 999 * y + 9 * z).integers(0, 170, 3)
blocks[grid.zyx(voxels)] = (200, 200, 196)
show("tiles", half(blocks), grid)

field = vp.distance(ring, grid, band="whole") / grid.voxel_size[0]
show("distance", scale(field, -0.18 * size, 0.18 * size), grid, half(np.ones(grid.shape, bool)))

part = vp.fractions(ring, coarse)
show("fractions", scale(part, 0, 1), coarse, half(part > 0))

cells = vp.sparse_fractions(ring, grid)
blocks = np.zeros((*grid.shape, 3), np.uint8)
blocks[grid.zyx(cells.voxels)] = np.uint8(200 * cells.values["fraction"])[:, None]
for x, y, z, edge in cells.cubes.tolist():
    blocks[z : z + edge, y : y + edge, x : x + edge] = 80 + np.random.default_rng(x + 999 * y + 9 * z).integers(0, 170, 3)
listed = np.zeros(grid.shape, bool)
listed[grid.zyx(cells.voxels)] = True
show("sparse_fractions", blocks, grid, half(listed | (blocks > 0).any(axis=-1)))

pair = [ring, torus((0.0, 0.0, 0.0), 0.62, 0.3)]
mix = vp.fraction_lists(pair, coarse)
share = np.zeros((*coarse.shape, 2))
entries = np.repeat(mix.voxels, np.diff(mix.offsets), axis=0)
share[(*coarse.zyx(entries), mix.bodies)] = mix.fractions
blend = share @ np.array([[222, 160, 58], [62, 124, 178]]) / np.maximum(share.sum(axis=-1, keepdims=True), 1e-6)
show("fraction_lists", np.uint8(np.rint(blend)), coarse, half(share.sum(axis=-1) > 0.5))

links = [torus((2.0 * i, 0.0, 0.0), 0.7, 0.22) for i in range(3)]
chain = vp.fit(links, 2 * size)
labels = vp.label(vp.solid(links, chain))
named = np.unique(labels[labels >= 0])
colors = np.array([[0, 0, 0], [222, 160, 58], [62, 124, 178], [176, 70, 60]], np.uint8)
show("label", colors[np.searchsorted(named, labels, side="right")], chain)

color = vp.bake(ring, grid, {"rgb": rgb})["rgb"]
show("bake", color, grid, surface)
listed, rows = vp.sparse(ring, grid, {"rgb": rgb})
show("sparse", (listed[::3], {"rgb": rows["rgb"][::3]}), grid)
show("dense", vp.dense(listed, rows["rgb"], grid), grid, surface, azimuth=70)

thick = rings([(1 + 0.4 * np.cos(a), 0.4 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 14, endpoint=False)], 30)
wires = vp.lines(thick[0], np.concatenate([thick[1][:, :2], thick[1][:, 1:]]))
show("lines", vp.voxelize(wires, grid), grid)

random = np.random.default_rng(7)
cloud = vertices[random.integers(0, len(vertices), 60 * size)] + random.normal(0, 0.02, (60 * size, 3))
show("points", vp.bake(vp.points(cloud, hue(cloud)), grid)["color"], grid)

places = np.tile(np.eye(4), (12, 1, 1))
for i, place in enumerate(places):
    turn = 2 * np.pi * i / 12
    place[:3, 3] = 4 * np.cos(turn), 0.6 * np.sin(3 * turn), 4 * np.sin(turn)
many = vp.instances(ring, places)
wide = vp.fit(many, 2 * size)
show("instances", vp.solid(many, wide), wide)

nodes = vp.Octree(listed, grid).level(2)
show("Octree", vp.dense(nodes, True, coarse), coarse)

lists = vp.fragments(ring, grid)
counts = np.diff(lists.offsets)
show("fragments", (lists.voxels, {"rgb": scale(counts, 1, counts.max())}), grid)

rough = vp.fit(ring, size // 5)
for name, mesh in (("remesh", vp.remesh(ring, rough)), ("extract", vp.extract(vp.solid(ring, rough), rough, place="corner"))):
    facets = scale(np.arange(len(mesh[1])) * 37 % 101, 0, 100)
    show(name, vp.bake(mesh[:2], grid, {"facets": facets}, per={"facets": "triangle"})["facets"], grid)

show("save", vp.bake(ring, coarse, {"rgb": rgb})["rgb"], coarse)
