# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Puts the tool and the scripts that run it into one page.

usage: make_page.py VOXELIZE.wasm PAGE.html LICENCE...
"""

import base64
import gzip
import pathlib
import sys


def main():
    program, page, *licences = map(pathlib.Path, sys.argv[1:])
    here = pathlib.Path(__file__).parent
    packed = gzip.compress(program.read_bytes(), 9, mtime=0)
    texts = "\n\n".join(f"==== {'/'.join(path.parts[-3:])}\n\n{path.read_text(encoding='utf-8', errors='replace')}" for path in licences)
    packed_texts = gzip.compress(texts.encode(), 9, mtime=0)
    worker = "".join((here / name).read_text(encoding="utf-8") for name in ("wasi.js", "worker.js"))
    text = (here / "page.html").read_text(encoding="utf-8")
    for mark, part in (("/*tool*/", base64.b64encode(packed).decode()), ("/*licences*/", base64.b64encode(packed_texts).decode()),
                       ("/*worker*/", worker)):
        if text.count(mark) != 1 or "</script" in part:
            sys.exit(f"make_page.py: {mark} is not once in the page, or what takes its place would end it")
        text = text.replace(mark, part)
    page.write_text(text, encoding="utf-8")
    print(f"{page}: {page.stat().st_size} bytes; {program.stat().st_size} of WebAssembly, {len(packed)} as gzip")


if __name__ == "__main__":
    main()
