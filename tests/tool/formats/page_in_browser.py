# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Opens pages of write_samples in a browser without a window and compares what it draws with a picture that is made here.

usage: page_in_browser.py CHROMIUM FOLDER

The silhouette of the voxels, and the colours of those in front, must be those of the voxels projected one by one. A blank canvas, one
with other voxels, from another side or in other colours fails. The test makes such pages too, and sees that they do.
"""

import base64
import json
import math
import pathlib
import re
import sys
import tempfile
import zlib

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


def write_page(template, to, name="model", extent=(24, 20, 16), pages=None):
    """A page made here, by what page.html says of its data: a box of voxels with a value of every kind. (voxels, values) in its order."""
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in extent), indexing="ij"), axis=-1).reshape(-1, 3)
    voxels = grid[(grid >= 2).all(axis=1) & (grid < np.array(extent) - 2).all(axis=1)]
    within = sum((voxels[:, a] >> bit & 1) << (3 * bit + a) for a in range(3) for bit in range(8))
    order = np.argsort(within, kind="stable")
    voxels, within = voxels[order], within[order]
    bricks, first = np.unique(within >> 9, return_index=True)
    bits = np.zeros((len(bricks), 512), np.uint8)
    bits[np.searchsorted(bricks, within >> 9), within & 511] = 1
    x, y, z = voxels.T
    count = (1 + x).astype(np.uint32)
    count[0] = 100000
    values = {"color": np.stack([9 * x, 9 * y, 9 * z, 255 + 0 * x], axis=1).astype(np.uint8), "count": count,
              "normal": np.tile(np.float32([0, 1, 0]), (len(x), 1)), "material": (x // 9).astype(np.int32),
              "triangle": (x * 1000 + y).astype(np.int32), "depth": np.float32(0.25) * z.astype(np.float32)}  # fmt: skip
    kinds = {"uint8": "u8", "uint32": "u32", "int32": "i32", "float32": "f32"}
    shape = {"name": name, "extent": extent, "voxel_size": [0.5, 0.5, 0.5], "origin": [-1, 0, 2], "up": "y", "bricks": len(bricks),
             "voxels": len(x), "channels": [{"name": n, "type": kinds[a.dtype.name], "components": a.size // len(x)}
                                            for n, a in values.items()]}  # fmt: skip
    data = (voxels[first] >> 3).T.astype("<u4").tobytes() + np.packbits(bits, axis=1, bitorder="little").tobytes()
    packer = zlib.compressobj(1, zlib.DEFLATED, -15)
    packed = packer.compress(data + b"".join(a.tobytes() for a in values.values())) + packer.flush()
    if pages:
        shape = {**shape, "bricks": 0, "voxels": 0, "channels": [], "pages": pages}
        packed = b""
    text = re.sub(r'(<script id="shape"[^>]*>).*?(</script>)', lambda m: m[1] + json.dumps(shape) + m[2], template, flags=re.S)
    encoded = base64.b64encode(packed).decode()
    to.write_text(re.sub(r'(<script id="data"[^>]*>).*?(</script>)', lambda m: m[1] + encoded + m[2], text, flags=re.S), encoding="utf-8")
    return voxels, values


def open_undrawn(browser, page, address=""):
    """Opens a page that draws once, at the least size: what is tested is beside the picture, which software draws slowly."""
    browser.resize(100, 100)
    browser.open(f"{page.resolve().as_uri()}#{address}")
    browser.evaluate("draw = () => { canvas.dataset.fine = true; }")
    browser.resize(WIDTH, HEIGHT)


def check_panel(browser, page):
    """At a telephone's width and at two of screens the panel and the legend stay small, whatever is shown."""
    open_undrawn(browser, page)
    assert browser.evaluate("element('panel').classList.contains('folded')"), "a telephone begins with the model"
    for width, height in ((390, 844), (1280, 720), (1920, 1080)):
        browser.resize(width, height)
        browser.evaluate("fold(false); show('hint', true)")
        for number in range(browser.evaluate("channels.length")):
            browser.evaluate(f"element('channel').value = {number}; repaint()")
            sides = browser.evaluate("['panel', 'scale', 'hint'].map(id => element(id).getBoundingClientRect().toJSON())")
            name = browser.evaluate(f"channels[{number}].name")
            for box in sides:
                assert 0 <= box["left"] and box["right"] <= width and 0 <= box["top"] and box["bottom"] <= height, (width, name, box)
            assert sides[0]["width"] <= 268, (width, name, sides[0])
            assert (sides[1]["height"] == 12) == (name in ("count", "depth")), (width, name, sides[1])
            assert name != "material" or browser.evaluate("element('numbers').children.length") == 3
        assert browser.evaluate("document.documentElement.scrollWidth") <= width
    browser.resize(WIDTH, HEIGHT)


def check_readout(browser, page, voxels, values):
    """The voxel under a pointer and a finger, with its place and values, is the one that is drawn there."""
    browser.open(page.resolve().as_uri() + "#zoom=1.6&help=off&panel=off")
    text = "element('readout').classList.contains('hidden') ? '' : [...element('readout').children].map(e => e.textContent).join('|')"
    rows = {tuple(v): i for i, v in enumerate(voxels)}
    pixels, seen = browser.pixels(), set()
    browser.evaluate("draw = () => { canvas.dataset.fine = true; }")
    for at in ((160, 120), (125, 100), (190, 130), (165, 150)):
        browser.move(at)
        browser.wait_for(f"({text}) !== ''")
        lines = browser.evaluate(text).split("|")
        voxel = tuple(map(int, re.match(r"voxel (\d+), (\d+), (\d+) at ", lines[0]).groups()))
        row = rows[voxel]
        place = [float(x) for x in lines[0].split(" at ")[1].split(", ")]
        assert np.allclose(place, np.array([-1, 0, 2]) + 0.5 * (np.array(voxel) + 0.5), atol=1e-3), lines[0]
        for line in lines[1:]:
            name, shown = line.split(" ", 1)
            assert np.allclose([float(x) for x in shown.split(", ")], np.atleast_1d(values[name][row]), rtol=1e-4), (voxel, line)
        assert {line.split()[0] for line in lines[1:]} == set(values)
        drawn, color = pixels[at[1], at[0]], values["color"][row, :3].astype(float)
        assert np.corrcoef(drawn, color)[0, 1] > 0.9 or np.ptp(color) < 20, (voxel, drawn, color)
        seen.add(voxel)
    assert len(seen) == 4
    browser.move((3, 3))
    browser.wait_for(f"({text}) === ''")
    browser.tap((160, 120))
    browser.wait_for(f"({text}) !== ''")


def check_ranges(browser, page):
    """Percentiles, a logarithm and limits of one's own map colours, and the bar says so."""
    open_undrawn(browser, page, "channel=count&help=off")
    ends = "['low', 'middle', 'high'].map(id => element(id).textContent).join(' ')"
    color = "(() => { const c = [0, 0, 0]; colorsOf(channels[+element('channel').value]).write(2, c, 0); return c.map(Math.round); })()"
    choose = "element('range').value = '{}'; element('range').dispatchEvent(new Event('change'))"
    assert browser.evaluate(ends) == "3 12.5 \u2265 22", browser.evaluate(ends)
    assert browser.evaluate(color) == [58, 20, 92]
    browser.evaluate(choose.format("all"))
    assert browser.evaluate(ends) == "3 50002 100000", browser.evaluate(ends)
    browser.evaluate("element('log').click()")
    assert browser.evaluate(ends) == "3 547.72 100000", browser.evaluate(ends)
    browser.evaluate("element('most').value = 12; element('most').dispatchEvent(new Event('change'))")
    assert browser.evaluate("element('range').value") == "own" and browser.evaluate(ends) == "3 6 \u2265 12"
    browser.evaluate("element('least').value = 1; element('least').dispatchEvent(new Event('change')); element('log').click()")
    assert browser.evaluate(ends) == "1 6.5 \u2265 12" and browser.evaluate(color) != [58, 20, 92]
    assert "range=1:12" in browser.evaluate("address()")


def check_link(browser, page):
    """The address holds the view, and the readout of the cut says where it is."""
    open_undrawn(browser, page, "help=off")
    browser.evaluate("""element('axis').value = 1; showCut(); setCut(4, 9); element('axis').value = 0; showCut(); setCut(3, 23);
        Object.assign(camera, { azimuth: 1.25, elevation: -0.5, zoom: 2, x: 0.1, y: -0.2 });
        element('channel').value = 1; repaint(); Object.assign(channels[1].range, { mode: 'own', low: 2, high: 9, log: true }); repaint()""")
    lines = browser.evaluate("[...element('cuts').children].map(e => e.textContent)")
    assert lines == ["x: voxels 3 to 23 of 0 to 23, at 0.5 to 11", "y: voxels 4 to 9 of 0 to 19, at 2 to 5"], lines
    state = "JSON.stringify([camera, cut, cutEnd, element('channel').value, channels[1].range, element('low').textContent])"
    before = browser.evaluate(state)
    browser.wait_for("location.hash.includes('range=2:9')")
    link = browser.evaluate("location.href")
    open_undrawn(browser, page, link.split("#")[1])
    assert browser.evaluate(state) == before, (browser.evaluate(state), before)
    browser.press("0")
    assert browser.evaluate("({...camera})") == json.loads(before)[0], "the view of the link is where 0 leads"
    browser.press("}")
    browser.press("{")
    browser.press("{")
    assert browser.evaluate("cutEnd") == [24, 9, 16]


def check_help(browser, page):
    """The help is there at first and hides by itself, by its button and by a key."""
    open_undrawn(browser, page)
    browser.resize(640, 480)
    hidden = "element('hint').classList.contains('hidden')"
    assert not browser.evaluate(hidden)
    browser.drag((400, 120), (405, 122))
    assert browser.evaluate(hidden)
    browser.press("?")
    assert not browser.evaluate(hidden)
    browser.evaluate("element('close').click()")
    assert browser.evaluate(hidden)
    browser.evaluate("element('help').click()")
    assert not browser.evaluate(hidden)
    browser.resize(WIDTH, HEIGHT)


def check_beside(browser, template, folder):
    """Pages side by side turn together, cut at the same share of their grids, and say what is missing."""
    for name, extent in (("one", (24, 20, 16)), ("two & more", (48, 20, 16))):
        write_page(template, folder / f"{name}.html", name, extent)
    write_page(template, folder / "all.html", pages=[{"name": n, "file": f"{n}.html"} for n in ("one", "two & more")])
    browser.resize(420, 200)
    browser.open((folder / "all.html").as_uri() + "#channel=depth")
    browser.wait_for("document.querySelectorAll('[data-ready]').length === 2")
    browser.drag((120, 120), (160, 130))
    browser.wait_for("/azimuth=0\\.\\d+/.test(location.hash)")
    link = browser.evaluate("location.hash")
    assert link.startswith("#show=0,1&channel=depth&") and "azimuth=0.6&" not in link, link
    frames = browser.frames()
    assert len(frames) == 2
    states = [browser.evaluate_in(f, "address()") for f in frames]
    assert states[0] == states[1] and "channel=depth" in states[0], states
    browser.evaluate_in(frames[0], "setCut(6, 23)")
    for _ in range(100):
        if browser.evaluate_in(frames[1], "cut[0]") == 12:
            break
    assert [browser.evaluate_in(f, "cut[0]") for f in frames] == [6, 12]
    browser.evaluate("document.querySelector('#models input').click()")
    assert browser.evaluate("location.hash").startswith("#show=1&") and len(browser.frames()) == 1
    browser.resize(WIDTH, HEIGHT)


def main():
    chromium, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch, Browser(chromium, f"{scratch}/profile", WIDTH, HEIGHT) as browser:
        check_view(browser, folder / "odd.html", -1.2, 0.3, "")
        check_view(browser, folder / "odd.html", 2.4, -0.5, "y:12")
        check_view(browser, folder / "plain.html", 0.2, 0.9, "")
        check_hands(browser, folder / "odd.html")
        browser.open((folder / "empty.html").resolve().as_uri())
        assert browser.evaluate("document.body.dataset.state") == "drawn", "an empty grid"

        template, scratch_page = (folder / "odd.html").read_text(encoding="utf-8"), pathlib.Path(scratch) / "made.html"
        voxels, values = write_page(template, scratch_page)
        check_panel(browser, scratch_page)
        check_readout(browser, scratch_page, voxels, values)
        check_ranges(browser, scratch_page)
        check_link(browser, scratch_page)
        check_help(browser, scratch_page)
        check_beside(browser, template, pathlib.Path(scratch))

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
