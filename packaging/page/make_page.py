# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Puts the tool and the scripts that run it into one page.

usage: make_page.py VOXELIZE.wasm PAGE.html LICENCE...
"""

import gzip
import pathlib
import sys

# 91 characters that neither end a script nor make an address.
LETTERS = "".join(chr(c) for c in range(33, 127) if chr(c) not in "<:\\")


def as_text(data):
    """The number of bytes, a blank, and 13 bits in every two letters: 1.23 letters a byte, where base64 has 1.33. page.html reads it."""
    pairs = [low + high for high in LETTERS for low in LETTERS]
    out, bits, count = [f"{len(data)} "], 0, 0
    for byte in data:
        bits |= byte << count
        count += 8
        if count >= 13:
            out.append(pairs[bits & 8191])
            bits >>= 13
            count -= 13
    if count:
        out.append(pairs[bits])
    return "".join(out)


def main():
    program, page, *licences = map(pathlib.Path, sys.argv[1:])
    here = pathlib.Path(__file__).parent
    packed = gzip.compress(program.read_bytes(), 9, mtime=0)
    texts = "\n\n".join(f"==== {'/'.join(path.parts[-3:])}\n\n{path.read_text(encoding='utf-8', errors='replace')}" for path in licences)
    packed_texts = gzip.compress(texts.encode(), 9, mtime=0)
    worker = "".join((here / name).read_text(encoding="utf-8") for name in ("wasi.js", "worker.js"))
    text = (here / "page.html").read_text(encoding="utf-8")
    for mark, part in (("/*tool*/", as_text(packed)), ("/*licences*/", as_text(packed_texts)), ("/*worker*/", worker)):
        if text.count(mark) != 1 or "</script" in part:
            sys.exit(f"make_page.py: {mark} is not once in the page, or what takes its place would end it")
        text = text.replace(mark, part)
    page.write_text(text, encoding="utf-8")
    print(f"{page}: {page.stat().st_size} bytes; {program.stat().st_size} of WebAssembly, {len(packed)} as gzip")


if __name__ == "__main__":
    main()
