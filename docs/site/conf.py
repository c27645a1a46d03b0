# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Sphinx's configuration; scripts/docs.sh makes the folder that it stands in (docs/site/prepare.py)."""
import os
import pathlib
import re
import sys

sys.path.insert(0, os.environ["VOXELPIPE_SITE"])
from theme_files import repair_theme

project = "VoxelPipe"
author = "The VoxelPipe authors"
copyright = "2026 The VoxelPipe authors"
version = release = os.environ["VOXELPIPE_VERSION"]
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
html_theme = "furo"
html_title = f"VoxelPipe {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_show_sourcelink = False
html_theme_options = {"sidebar_hide_name": False, "navigation_with_keys": True}
pygments_style = "friendly"
pygments_dark_style = "monokai"
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]
breathe_projects = {"voxelpipe": os.environ["VOXELPIPE_DOXYGEN_XML"]}
breathe_default_project = "voxelpipe"
breathe_default_members = ("members",)
breathe_show_include = False
primary_domain = "cpp"
highlight_language = "none"
# The compiled module is not needed to read docstrings.
sys.path.insert(0, os.environ["VOXELPIPE_PYTHON_SOURCE"])
autodoc_mock_imports = ["voxelpipe._core", "dask"]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
exclude_patterns = ["_build"]


def fields_of(app, what, name, obj, options, lines):
    """Docstrings list arguments as `name: words`, further lines indented; Sphinx calls them fields. Backticks stand around code."""
    out, in_list = [], False
    for line in lines:
        argument = re.match(r"(\w+(?:, \w+)*): (.+)$", line)
        if argument and not line.startswith(("Raises", "Returns")):
            if not in_list:
                out.append("")
            line, in_list = f":param {argument[1]}: {argument[2]}", True
        elif in_list and line and not line.startswith(" "):
            out.append("")
            in_list = False
        out.append(re.sub(r"(?<!`)`([^`]+)`(?!`)", r"``\1``", line))
    lines[:] = out


def finished(app, exception):
    if exception is None:
        repair_theme(pathlib.Path(app.outdir) / "_static")


def setup(app):
    app.connect("build-finished", finished)
    app.connect("autodoc-process-docstring", fields_of)
