# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Opens pages of write_samples in a browser without a window and compares what it draws with a picture that is made here.

usage: page_in_browser.py CHROMIUM FOLDER

The silhouette of the voxels, and the colours of those in front, must be those of the voxels projected one by one. A blank canvas, one
with other voxels, from another side or in other colours fails. The test makes such pages too, and sees that they do.
"""

import math
import pathlib
import sys
import tempfile

import numpy as np
from PIL import Image, ImageDraw

from browser import Browser
from read_back import page_volume

WIDTH, HEIGHT = 320, 240


def expected(volume, azimuth, elevation, cut):
    """(covered, colours): what a camera at these angles sees, by painting voxels from the farthest to the nearest."""
    shape, _, values, voxels = volume
    size = np.array(shape["voxel_size"]) / min(shape["voxel_size"])
    bricks = voxels // 8
    low, high = 8 * bricks.min(axis=0), np.minimum(8 * bricks.max(axis=0) + 8, shape["extent"])
    middle, radius = (low + high) / 2, np.linalg.norm((high - low) * size) / 2
    sa, ca, se, ce = math.sin(azimuth), math.cos(azimuth), math.sin(elevation), math.cos(elevation)
    to_world = (lambda r, u, f: np.array([r, -f, u])) if shape["up"] == "z" else (lambda r, u, f: np.array([r, u, f]))
    right, up, back = to_world(ca, 0, -sa), to_world(-sa * se, ce, -ca * se), to_world(sa * ce, se, ca * ce)
    tangent = math.tan(0.25)
    distance = radius / math.sin(math.atan(tangent * min(1, WIDTH / HEIGHT))) * 1.02
    shown = (voxels >= cut).all(axis=1)
    centres = ((voxels[shown] + 0.5) - middle) * size
    colors = values["color"][shown, :3] if "color" in values else np.tile([222, 214, 203], (shown.sum(), 1))
    eye = distance * back
    number = Image.new("I", (WIDTH, HEIGHT))  # of the voxel in front, from 1 on
    painter = ImageDraw.Draw(number)
    for i in np.argsort(-np.linalg.norm(centres - eye, axis=1)):
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            side = np.repeat(centres[np.newaxis, i], 4, axis=0)
            side[:, axis] += size[axis] / 2 * (1 if eye[axis] > centres[i, axis] else -1)
            side[:, u] += size[u] / 2 * np.array([-1, 1, 1, -1])
            side[:, v] += size[v] / 2 * np.array([-1, -1, 1, 1])
            scale = HEIGHT / 2 / ((distance - side @ back) * tangent)
            painter.polygon(list(zip(WIDTH / 2 + side @ right * scale - 0.5, HEIGHT / 2 - side @ up * scale - 0.5)), fill=int(i) + 1)
    front = np.asarray(number)
    return front > 0, colors[np.maximum(front - 1, 0)].astype(float)


def differences(pixels, volume, azimuth, elevation, cut=(0, 0, 0)):
    """(overlap of the silhouettes, correlation of the colours), 1 and 1 at best."""
    covered, colors = expected(volume, azimuth, elevation, np.array(cut))
    top, bottom = np.array([190, 208, 226.0]), np.array([240, 238, 233.0])
    height = 1 - (np.arange(HEIGHT) + 0.5)[:, np.newaxis, np.newaxis] / HEIGHT
    background = bottom + (top - bottom) * height
    drawn = np.abs(pixels - background).max(axis=-1) > 6
    overlap = (drawn & covered).sum() / max(1, (drawn | covered).sum())
    both = drawn & covered
    if both.sum() < 100:
        return overlap, 0.0
    # Relative to the brightness: light and shade change that alone.
    tint = [c[both] / c[both].mean(axis=-1, keepdims=True) for c in (pixels + 1, colors + 1)]
    spread = [t.std() for t in tint]
    return overlap, 1.0 if spread[1] < 0.06 else float(np.corrcoef(tint[0].ravel(), tint[1].ravel())[0, 1])


def check_view(browser, page, azimuth, elevation, cut):
    """The page shows what a picture made here shows, and the comparison sees a turn."""
    volume = page_volume(page)
    address = f"azimuth={azimuth}&elevation={elevation}&zoom=1&panel=off" + (f"&cut={cut}" if cut else "")
    browser.open(f"{page.resolve().as_uri()}#{address}")
    low = [int(cut[2:]) if cut and cut[0] == axis else 0 for axis in "xyz"]
    pixels = browser.pixels()
    overlap, colors = differences(pixels, volume, azimuth, elevation, low)
    print(f"{page.name} {address}: silhouette {overlap:.3f}, colours {colors:.3f}", flush=True)
    assert overlap > 0.93, "the voxels are not where they should be"
    assert colors > 0.7, "the colours are not those of the voxels"
    elsewhere, _ = differences(pixels, volume, azimuth + 0.25, elevation, low)
    assert elsewhere < overlap - 0.02, "this test does not see another side"


def check_hands(browser, page):
    """Keys, mouse and fingers turn, zoom, cut and choose values."""
    browser.open(f"{page.resolve().as_uri()}#panel=off")
    start = browser.evaluate("({...camera})")
    browser.press("ArrowLeft")
    assert browser.evaluate("camera.azimuth") < start["azimuth"]
    browser.press("+")
    assert browser.evaluate("camera.zoom") > start["zoom"]
    browser.press("]")
    assert browser.evaluate("cut") == [1, 0, 0]
    browser.press("0")
    assert browser.evaluate("({...camera})") == start
    browser.drag((160, 120), (200, 150))
    turned = browser.evaluate("({...camera})")
    assert turned["azimuth"] < start["azimuth"] and turned["elevation"] > start["elevation"]
    browser.pinch([(140, 120), (180, 120)], [(120, 120), (200, 120)])
    assert browser.evaluate("camera.zoom") > 1.5 * start["zoom"]
    browser.pixels()


def main():
    chromium, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as scratch, Browser(chromium, f"{scratch}/profile", WIDTH, HEIGHT) as browser:
        check_view(browser, folder / "odd.html", -1.2, 0.3, "")
        check_view(browser, folder / "odd.html", 2.4, -0.5, "y:12")
        check_view(browser, folder / "plain.html", 0.2, 0.9, "")
        check_hands(browser, folder / "odd.html")
        browser.open((folder / "empty.html").resolve().as_uri())
        assert browser.evaluate("document.body.dataset.state") == "drawn", "an empty grid"

        # The comparison sees that nothing is drawn, and that colours are wrong; the page says that data are damaged.
        broken = pathlib.Path(scratch) / "broken.html"
        text = (folder / "odd.html").read_text(encoding="utf-8")
        volume = page_volume(folder / "odd.html")

        def open_broken(old, new):
            assert old in text
            broken.write_text(text.replace(old, new, 1), encoding="utf-8")
            browser.open(broken.as_uri() + "#azimuth=-1.2&elevation=0.3&zoom=1&panel=off")

        open_broken("return true;", "return false;")
        assert differences(browser.pixels(), volume, -1.2, 0.3)[0] < 0.1
        open_broken("write(i++, layer, at)", "write(0, layer, at)")
        assert differences(browser.pixels(), volume, -1.2, 0.3)[1] < 0.6
        open_broken('"voxels":', '"voxels":1')
        assert browser.evaluate("document.body.dataset.state") == "failed"
        assert "do not fit" in browser.evaluate("document.getElementById('message').textContent")


if __name__ == "__main__":
    main()
