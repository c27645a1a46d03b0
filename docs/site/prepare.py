#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Makes the folder that Sphinx reads: the Markdown documents of the repository with links that hold on the site, a page for each part of the
API, and a plot of records/history.csv.

    prepare.py OUT --xml DOXYGEN_XML [--repository https://HOST/OWNER/voxelpipe]

A link to a document leads to its page. A link to another file leads to the repository if its address is given, else only its text is left.
"""
import argparse
import pathlib
import re
import shutil

import history
from api_pages import PYTHON, picture_of, write_api

ROOT = pathlib.Path(__file__).resolve().parents[2]
SITE = ROOT / "docs" / "site"
# Document of the repository: page of the site.
PAGES = {
    "docs/guide.md": "guide", "docs/tool.md": "tool", "docs/scale.md": "scale", "docs/solvers.md": "solvers", "docs/c_api.md": "c_api", "python/README.md": "python", "docs/gallery/README.md": "gallery/index",
    "python/tutorials/volume.md": "tutorials/volume", "python/tutorials/colours.md": "tutorials/colours", "python/tutorials/scan.md": "tutorials/scan",
    "python/tutorials/network.md": "tutorials/network",
    "docs/design.md": "design", "docs/paper.md": "paper", "docs/pipeline.md": "pipeline", "docs/performance.md": "performance", "docs/optimizations.md": "optimizations",
    "docs/performance_tables.md": "performance_tables",
    "docs/rejected.md": "rejected", "docs/contributing.md": "contributing", "docs/extending.md": "extending", "docs/release.md": "release", "packaging/README.md": "packaging",
    "CHANGELOG.md": "changelog", "README.md": "index",
}
LINK = re.compile(r"(!?)\[((?:[^\]\[]|\[[^\]]*\])*)\]\(([^)\s]+)\)")


class Converter:
    def __init__(self, out, repository):
        self.out, self.repository = out, repository

    def link(self, source, page, match):
        image, text, target = match.groups()
        if re.match(r"[a-z]+:", target) or target.startswith("#"):
            return match[0]
        file, _, heading = target.partition("#")
        path = ((ROOT / source).parent / file).resolve().relative_to(ROOT).as_posix()
        up = "../" * page.count("/")
        if image:
            return f"![{text}]({up}{self.picture(path)})"
        if path in PAGES:
            # The site's first page has words of its own, without the README's headings.
            anchor = f"#{heading}" if heading and path != "README.md" else ""
            return f"[{text}]({up}{PAGES[path]}.md{anchor})"
        return f"[{text}]({self.repository}/blob/main/{path})" if self.repository else text

    def picture(self, path):
        to = self.out / "_static" / path
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, to)
        return f"_static/{path}"

    def markdown(self, source, page):
        up = "../" * page.count("/")
        pieces = re.split(r"(^```.*?^```$)", (ROOT / source).read_text(encoding="utf-8"), flags=re.S | re.M)
        for i in range(0, len(pieces), 2):  # the others are code
            text = re.sub(r"<!--.*?-->\n?", "", pieces[i], flags=re.S)
            text = re.sub(r'(<img src=")([^"]+)', lambda m: m[1] + up + self.picture(
                ((ROOT / source).parent / m[2]).resolve().relative_to(ROOT).as_posix()), text)
            pieces[i] = LINK.sub(lambda m: self.link(source, page, m), text)
        return "".join(pieces)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--xml", type=pathlib.Path, required=True)
    parser.add_argument("--repository", default="")
    args = parser.parse_args()
    shutil.rmtree(args.out, ignore_errors=True)
    (args.out / "_static").mkdir(parents=True)
    (args.out / "gallery").mkdir()
    (args.out / "tutorials").mkdir()
    converter = Converter(args.out, args.repository)
    for source, page in PAGES.items():
        if page != "index":
            (args.out / f"{page}.md").write_text(converter.markdown(source, page), encoding="utf-8")
    with (args.out / "performance.md").open("a", encoding="utf-8") as f:
        f.write(history.page(ROOT / "records" / "history.csv", args.out / "_static" / "history.svg"))
    for name in ("conf.py", "index.md", "solids.md"):
        shutil.copy(SITE / name, args.out / name)
    for name in ("site.css", "site.js"):
        shutil.copy(SITE / name, args.out / "_static" / name)
    converter.picture("docs/lighthouse.png")
    converter.picture("docs/lighthouse_cut.png")
    for file in {picture_of(name) for name in PYTHON} - {""}:
        converter.picture(file)
    write_api(args.out, args.xml, (ROOT / "python" / "src" / "grid.cpp").read_text(encoding="utf-8"))


main()
