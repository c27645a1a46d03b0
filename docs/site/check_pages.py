#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Opens every page of the site in a browser without a window: nothing stands in its console as an error, no file is missing, it is no wider than
a screen or a telephone, and some pages are looked at: text, a picture where one belongs, no blank.

    check_pages.py HTML_FOLDER PICTURES_FOLDER

Every link to a page and every picture within the site has to lead to a file. Needs Chromium, NumPy and Pillow; without a browser that is said,
and only links are checked.
"""
import base64
import io
import pathlib
import re
import shutil
import sys
import tempfile
import urllib.parse

from PIL import Image

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests" / "tool" / "formats"))
from browser import Browser  # noqa: E402

PAGES = {"index.html": "A file", "gallery/index.html": "first voxels", "api/calls.html": "voxelize_options", "api/tasks.html": "A mesh with holes",
         "api/python.html": "voxelpipe.bake", "performance.html": "History", "tutorials/volume.html": "centre of mass", "solids.html": "fill rule",
         "paper.html": "Schwarz", "api/formats.html": "unorm8x4"}
# Where all code has to fit its column.
FITTING = {"index.html", "tutorials/volume.html", "tutorials/scan.html", "tutorials/network.html", "tutorials/colours.html"}
WIDTHS = {"screen": (1280, 1400), "telephone": (390, 844)}


def broken_links(html):
    for page in sorted(html.rglob("*.html")):
        for target in re.findall(r'(?:href|src)="([^"]+)"', page.read_text(encoding="utf-8")):
            if re.match(r"[a-z]+:|//|#", target) or not target:
                continue
            file = urllib.parse.unquote(target.split("#")[0].split("?")[0])
            if file and not (page.parent / file).exists():
                yield f"{page.relative_to(html)} leads to {target}"


def complaints(browser, page):
    """Opens a page; what its console says, scripts that fail, and files that are missing."""
    browser.events = []
    browser.visit(page.resolve().as_uri())
    for event in browser.events:
        what = event["params"]
        if event["method"] == "Runtime.exceptionThrown":
            details = what["exceptionDetails"]
            yield details.get("exception", {}).get("description", details["text"]).split("\n")[0]
        elif event["method"] == "Log.entryAdded" and what["entry"]["level"] == "error":
            yield f"{what['entry']['text']} {what['entry'].get('url', '')}"
        elif event["method"] == "Runtime.consoleAPICalled" and what["type"] == "error":
            yield " ".join(str(a.get("value", a.get("description"))) for a in what["args"])


def rows_drawn(browser, to):
    """The share of a page's rows that are not blank in the column of the text."""
    png = base64.b64decode(browser.call("Page.captureScreenshot", format="png")["data"])
    to.write_bytes(png)
    picture = Image.open(io.BytesIO(png)).convert("L")
    width, height = picture.size
    column = picture.crop((width // 4, 0, 3 * width // 4, height))
    background = max(column.getcolors(1 << 24))[1]
    rows = [y for y in range(0, height, 4) if any(abs(p - background) > 60 for p in column.crop((0, y, column.width, y + 1)).getdata())]
    return len(rows) / (height / 4)


def look(browser, html, pictures):
    """What is wrong with the pages, and that this check sees what is."""
    bad = pictures / "bad.html"
    bad.write_text('<!doctype html><title>bad</title><link rel="stylesheet" href="none.css"><script>import x from "y";</script>')
    if len(list(complaints(browser, bad))) != 2 or rows_drawn(browser, pictures / "bad.png") > 0:
        yield "the check does not see a script that fails, a file that is missing, and a blank page"
    for kind, (width, height) in WIDTHS.items():
        browser.resize(width, height)
        for page in sorted(html.rglob("*.html")):
            name = page.relative_to(html).as_posix()
            if kind == "telephone" and name not in PAGES:
                continue
            yield from (f"{name}: {line}" for line in complaints(browser, page))
            wide = browser.evaluate("document.documentElement.scrollWidth")
            if wide > width:
                yield f"{name} is {wide} pixels wide on a {kind} of {width}"
            cut = browser.evaluate("[...document.querySelectorAll('.highlight pre')].filter(p => p.scrollWidth > p.clientWidth).length")
            if kind == "screen" and name in FITTING and cut:
                yield f"{name}: {cut} blocks of code are wider than their column"
            if name in PAGES:
                filled = rows_drawn(browser, pictures / f"{kind}_{name.replace('/', '_')}.png")
                print(f"{name} on a {kind}: {100 * filled:.0f} % of its rows are drawn")
                if filled < 0.25:
                    yield f"{name} is blank on a {kind}"
    # What the theme's script and the site's own do.
    browser.resize(*WIDTHS["screen"])
    browser.visit((html / "index.html").resolve().as_uri())
    mode = "document.body.dataset.theme"
    before = browser.evaluate(mode)
    browser.evaluate("document.querySelector('.theme-toggle').click()")
    if browser.evaluate(mode) == before:
        yield "the button for the dark mode does nothing"
    copied = browser.evaluate("""(() => { let text; navigator.clipboard.writeText = async t => { text = t; };
        document.querySelector('.copy').click(); return text; })()""")
    if "make demo" not in (copied or ""):
        yield "the button beside code does not copy it"


def main():
    html, pictures = map(pathlib.Path, sys.argv[1:])
    pictures.mkdir(parents=True, exist_ok=True)
    errors = list(broken_links(html))
    for page, words in PAGES.items():
        if words.lower() not in re.sub(r"<[^>]+>", "", (html / page).read_text(encoding="utf-8")).lower():
            errors.append(f"{page} does not say {words!r}")
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        print("not run: no browser here, so pages were not looked at")
    else:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, Browser(browser, profile, *WIDTHS["screen"]) as tab:
            for domain in ("Runtime", "Log", "Page"):
                tab.call(f"{domain}.enable")
            errors += look(tab, html, pictures)
    for line in errors:
        print(f"error: {line}", file=sys.stderr)
    sys.exit(1 if errors else 0)


main()
