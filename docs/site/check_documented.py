#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checks in Doxygen's XML that every public name of the C++ API is documented; prints the others, and how many there are.

    check_documented.py XML_FOLDER

Of functions with one name in one scope, one has to be; of members declared in one line, one; an enumerator also by its name in its enum's text. Members that have the meaning of the standard library's containers need no words, and
neither do copies, moves, comparisons and destructors.
"""
import pathlib
import re
import sys
import xml.etree.ElementTree as tree

STANDARD = {"begin", "end", "size", "empty", "data", "operator=", "operator==", "operator[]", "operator*", "operator->", "operator++",
            "operator--", "operator+", "operator-", "operator+=", "operator-=", "operator<=>", "value_type", "difference_type", "reference",
            "iterator_category", "iterator_concept", "iterator", "pointer"}


def text_of(element):
    return "".join("".join(element.find(part).itertext()) if element.find(part) is not None else ""
                   for part in ("briefdescription", "detaileddescription")).strip()


def main():
    folder = pathlib.Path(sys.argv[1])
    missing, count = [], 0
    for file in sorted(folder.glob("*.xml")):
        compound = tree.parse(file).getroot().find("compounddef")
        if compound is None or compound.get("kind") not in ("class", "struct", "namespace", "union"):
            continue
        scope = compound.findtext("compoundname")
        # Code that writes NanoVDB's structures is no interface but for what nanovdb_file takes; a specialisation is part of its template.
        if compound.get("prot", "public") != "public" or not scope.startswith("voxelpipe") or scope == "voxelpipe::io::nanovdb" or "<" in scope:
            continue
        where = compound.find("location")
        if compound.get("kind") != "namespace":
            count += 1
            if not text_of(compound):
                missing.append((where.get("file"), where.get("line"), scope))
        names, lines = {}, set()
        for member in compound.iter("memberdef"):
            if member.get("kind") in ("variable", "typedef") and text_of(member):
                lines.add(member.find("location").get("line"))
        for member in compound.iter("memberdef"):
            if member.get("prot") != "public" or member.get("kind") == "friend" or "->" in (member.findtext("argsstring") or ""):
                continue  # "->": a deduction guide
            names.setdefault(member.findtext("name"), []).append(member)
            for value in member.iter("enumvalue"):
                names.setdefault(f"{member.findtext('name')}::{value.findtext('name')}", []).append((value, member))
        for name, members in names.items():
            count += 1
            bare = scope.rsplit("::", 1)[-1].split("<")[0]
            if name in STANDARD or name == f"~{bare}":
                continue
            if name == bare and all(not m.findtext("argsstring").strip("() ") or "=default" in m.findtext("argsstring").replace(" ", "")
                                    or f"{bare} &" in m.findtext("argsstring") for m in members):
                continue  # default, copy and move
            if isinstance(members[0], tuple):
                value, enum = members[0]
                known = bool(text_of(value)) or value.findtext("name") in re.findall(r"\w+", text_of(enum))
            else:
                known = any(text_of(m) for m in members) or members[0].find("location").get("line") in lines
            if not known:
                first = members[0][1] if isinstance(members[0], tuple) else members[0]
                at = first.find("location")
                missing.append((at.get("file"), at.get("line"), f"{scope}::{name}"))
    for file, line, name in sorted(missing, key=lambda m: (m[0], int(m[1]))):
        print(f"error: {file}:{line}: {name} is not documented", file=sys.stderr)
    print(f"{count} public names, {len(missing)} not documented")
    sys.exit(1 if missing or not count else 0)


main()
