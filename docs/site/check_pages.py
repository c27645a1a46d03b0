#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Opens pages of the site in a browser without a window, and looks whether they are drawn: text, a picture where one belongs, no blank.

    check_pages.py HTML_FOLDER PICTURES_FOLDER

Every link to a page and every picture within the site has to lead to a file. Needs Chromium and Pillow; without a browser that is said, and
only links are checked.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

from PIL import Image

PAGES = {"index.html": "The shortest program", "gallery/index.html": "first voxels", "api/calls.html": "voxelize_options",
         "api/python.html": "voxelpipe.bake", "performance.html": "History"}


def broken_links(html):
    for page in sorted(html.rglob("*.html")):
        for target in re.findall(r'(?:href|src)="([^"]+)"', page.read_text(encoding="utf-8")):
            if re.match(r"[a-z]+:|//|#", target) or not target:
                continue
            file = urllib.parse.unquote(target.split("#")[0].split("?")[0])
            if file and not (page.parent / file).exists():
                yield f"{page.relative_to(html)} leads to {target}"


def look(browser, page, to, size=(1280, 1400)):
    subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--force-device-scale-factor=1",
                    f"--window-size={size[0]},{size[1]}", "--virtual-time-budget=4000", f"--screenshot={to}", page.resolve().as_uri()],
                   check=True, capture_output=True, timeout=120)
    picture = Image.open(to).convert("L")
    width, height = picture.size
    # The column of the text: what differs from the background, and where.
    column = picture.crop((width // 4, 0, 3 * width // 4, height))
    background = max(column.getcolors(1 << 24))[1]
    rows = [y for y in range(0, height, 4) if any(abs(p - background) > 60 for p in column.crop((0, y, column.width, y + 1)).getdata())]
    return len(rows) / (height / 4)


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
        blank = pictures / "blank.html"
        blank.write_text("<!doctype html><title>blank</title>")
        if look(browser, blank, pictures / "blank.png") > 0:
            errors.append("the check does not see that a blank page is blank")
        for page in PAGES:
            filled = look(browser, html / page, pictures / (page.replace("/", "_") + ".png"))
            print(f"{page}: {100 * filled:.0f} % of its rows are drawn")
            if filled < 0.25:
                errors.append(f"{page} is blank")
    for line in errors:
        print(f"error: {line}", file=sys.stderr)
    sys.exit(1 if errors else 0)


main()
