#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Doxygen's input filter: comments of the headers are plain `//`, and Doxygen reads `///`.

A block of `//` lines directly above code documents what follows it, a comment behind code what stands before it. A block with an empty line
behind it documents nothing, as in the headers themselves. Bodies of functions are left out: Doxygen needs declarations alone.
"""
import re
import sys

TRAILING = re.compile(r"^(\s*[^/\s\"](?:[^\"]|\"[^\"]*\")*?(?:;|,|\{|\}|\w|\))\s*)//(?!/) ?(.*)$")


def escaped(text):
    """Escapes text that Doxygen would take for a command, a tag or a link; not within backticks."""
    parts = re.split(r"(`[^`]*`)", text)
    for i in range(0, len(parts), 2):
        parts[i] = re.sub(r"([<>&@\\#%$])", r"\\\1", parts[i])
    return "".join(parts)


def main():
    lines = open(sys.argv[1], encoding="utf-8").read().splitlines()
    out, i = [], 0
    while i < len(lines):
        line = lines[i]
        block = re.match(r"^\s*//(?!/)", line)
        if block and not line.lstrip().startswith(("// SPDX-", "// NOLINT", "// ----")):
            end = i
            while end < len(lines) and re.match(r"^\s*//(?!/)", lines[end]):
                end += 1
            documents = end < len(lines) and lines[end].strip() not in ("", "}", "};") and not lines[end].lstrip().startswith(("#", "public:", "private:"))
            for k in range(i, end):
                indent, text = re.match(r"^(\s*)// ?(.*)$", lines[k]).groups()
                out.append(f"{indent}/// {escaped(text)}" if documents else "")
            i = end
            continue
        trailing = TRAILING.match(line)
        if trailing and "NOLINT" not in trailing[2]:
            # A comment that goes on under itself, in the same column.
            column = line.index("//", len(trailing[1]) - 1)
            out.append(f"{trailing[1]}///< {escaped(trailing[2])}")
            while i + 1 < len(lines) and re.match(r"^\s{%d}// " % column, lines[i + 1]) and column > 8:
                i += 1
                out.append(" " * column + "///< " + escaped(lines[i].strip()[3:]))
            i += 1
            continue
        if re.match(r"^(class|struct) \w+;$", line):
            # Declared here, defined in another header, whose group it belongs to.
            line = ""
            if out and re.match(r"^template <.*>$", out[-1]):
                out[-1] = ""
        out.append(line)
        i += 1
    text = "\n".join(out)
    # [[nodiscard]] and the library's macros say nothing to a reader of the site.
    text = re.sub(r"\[\[(?:nodiscard|no_unique_address)\]\] ?", "", text)
    # Doxygen takes deduction guides for functions and the names of their types twice; Sphinx cannot read designated initialisers.
    text = re.sub(r"^template <[^;{}]*?>\n\w+\([^;{}]*\)\s*->[^;]*;$", "", text, flags=re.M)
    text = re.sub(r"^(inline constexpr [\w:]+ \w+)\{\..*\};$", r"\1{};", text, flags=re.M)
    text = text.replace("__extension__ typedef", "typedef")
    # Members that are defined outside of their class would be in the page twice.
    text = re.sub(r"^(?:template <[^\n]*>\n)*(?=[a-z])[^\n{};#(/]*\b\w+::~?\w+\([^;{]*\)[^;{]*\{.*?^\}", "", text, flags=re.M | re.S)
    # A group for each header, which a page of the site shows.
    name = sys.argv[1].rsplit("/voxelpipe/", 1)[-1].removeprefix("voxelpipe/")
    name = "cpu_backend.hpp" if name.endswith("cpu_ref/cpu_backend.hpp") else name
    group = re.sub(r"\W", "_", name)
    text = re.sub(r"^(namespace voxelpipe(?:::\w+)* \{)$", rf"\1\n/** \\addtogroup {group} {name}\n * @{{ */\n", text, flags=re.M)
    text = re.sub(r"^(\} // namespace voxelpipe(?:::\w+)*)$", r"/** @} */\n\1", text, flags=re.M)
    print(text)


main()
