# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Makes the files of Debian's furo whole. They are made for Debian's own web root: furo.js imports a module that a plain script cannot, and
furo.css a file of the root. furo from PyPI has neither, and is left as it is."""
import pathlib
import re

NORMALIZE = re.compile(r"@import url\(/(javascript/normalize\.css/normalize\.css)\);")
GUMSHOE = re.compile(r'^import Gumshoe from "\./(gumshoe-patched\.js)";$', flags=re.M)


def repair_theme(static, share=pathlib.Path("/usr/share")):
    """static: the site's folder _static. share: where Debian has the files of its web root."""
    script, style = static / "scripts" / "furo.js", static / "styles" / "furo.css"
    text = script.read_text(encoding="utf-8")
    text = GUMSHOE.sub(lambda m: (script.parent / m[1]).read_text(encoding="utf-8"), text)
    script.write_text(text, encoding="utf-8")
    text = style.read_text(encoding="utf-8")
    style.write_text(NORMALIZE.sub(lambda m: (share / m[1]).read_text(encoding="utf-8"), text), encoding="utf-8")
