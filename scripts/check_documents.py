#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checks the Markdown files of the root and of docs/, bench/, packaging/, python/, records/ and tests/ against the repository.

    check_documents.py [--update]

1. A block of code behind `<!-- samples/FILE -->` is that sample without its licence lines; behind `<!-- samples/FILE: NAME -->`
   it is the part between `// snippet: NAME` and `// end snippet` (`#` in Python), also of files of tests/ and python/. All of them are built and run. --update
   writes them.
2. Links to files of the repository lead somewhere, and to headings that exist.
3. Names of sources in backticks (`*.hpp`, `*.cuh`, `*.cpp`, `*.cu`, `*.py`, `*.sh`) are names of files that exist.
4. docs/extending.md has at least five recipes of `##`, at most 160 lines, and paths in backticks from the root that exist.

Needs the standard library only.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"(<!-- ((?:samples|tests|python)/[^ :]+)(?:: ([^>]+?))? -->\n```\w*\n)(.*?)(^```$)", flags=re.S | re.M)
FENCED = re.compile(r"^```.*?^```$", flags=re.S | re.M)


def tracked(*patterns):
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", *patterns], cwd=ROOT, check=True,
                            capture_output=True, text=True).stdout
    return [path for path in listed.split("\n") if path and (ROOT / path).exists()]


def sample(path, snippet):
    """The whole sample, or its part of that name, less what the part is indented by."""
    lines = (ROOT / path).read_text(encoding="utf-8").splitlines()
    if snippet is None:
        return "\n".join(line for line in lines if not line.startswith(("// SPDX-", "# SPDX-"))) + "\n"
    starts = [i for i, line in enumerate(lines) if line.strip() in (f"// snippet: {snippet}", f"# snippet: {snippet}")]
    if len(starts) != 1:
        raise ValueError(f"{path} has {len(starts)} snippets called {snippet}")
    end = next((i for i in range(starts[0], len(lines)) if lines[i].strip() in ("// end snippet", "# end snippet")), None)
    if end is None:
        raise ValueError(f"{path}: snippet {snippet} has no end")
    return textwrap.dedent("\n".join(lines[starts[0] + 1:end])) + "\n"


def anchors(path):
    """The headings of a Markdown file as GitHub links to them."""
    text = FENCED.sub("", path.read_text(encoding="utf-8"))
    titles = re.findall(r"^#+ (.*)$", text, flags=re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def check_links(path, text):
    for target in re.findall(r"\]\(([^)\s]+)\)", FENCED.sub("", text)):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, heading = target.partition("#")
        to = (path.parent / file) if file else path
        if not to.exists():
            yield f"no file {target}"
        elif heading and to.suffix == ".md" and heading not in anchors(to):
            yield f"no heading {target}"


def check_names(text, files):
    endings = {"/" + file for file in files}
    for name in sorted(set(re.findall(r"`([\w./-]+\.(?:hpp|cuh|cpp|cu|py|sh))`", text))):
        if not any(file.endswith("/" + name) for file in endings):
            yield f"no file is called {name}"


def check_recipes(text, root=ROOT):
    """Files and folders that a recipe names with their folder are there."""
    if len(re.findall(r"^## ", text, flags=re.M)) < 5:
        yield "fewer than five recipes"
    if text.count("\n") > 160:
        yield "more than 160 lines"
    for name in sorted(set(re.findall(r"`([\w.-]+/[\w./-]+)`", FENCED.sub("", text)))):
        if not (root / name).exists() and not name.endswith("/"):
            yield f"no file {name}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true")
    update = parser.parse_args().update
    files = tracked()
    errors = []
    for name in (f for f in files if re.fullmatch(r"(?!docs/site/)(?:[A-Z]+\.md|(docs|bench|packaging|python|records|tests)/.*\.md)", f)):
        path = ROOT / name
        text = path.read_text(encoding="utf-8")
        try:
            fresh = BLOCK.sub(lambda m: m[1] + sample(m[2], m[3]) + m[5], text)
        except (OSError, ValueError) as error:
            errors.append(f"{name}: {error}")
            continue
        if update and fresh != text:
            path.write_text(fresh, encoding="utf-8")
        elif fresh != text:
            errors.append(f"{name} shows other code than its samples; scripts/check_documents.py --update writes it")
        errors += [f"{name}: {what}" for what in check_links(path, fresh)]
        errors += [f"{name}: {what}" for what in check_names(FENCED.sub("", fresh), files)]
        if name == "docs/extending.md":
            errors += [f"{name}: {what}" for what in check_recipes(fresh)]
    for line in errors:
        print(f"error: {line}", file=sys.stderr)
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
