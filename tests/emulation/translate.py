#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Device code as C++ for the CPU.

    translate.py TO ROOT FILE...

Copies files, named relative to ROOT, into the folder TO, .cu as .cpp. Replaces everything that is not C++ by functions of
emulation/: `kernel<<<...>>>(...)`, dynamic shared memory, and inline PTX. A PTX statement that is not in the table is an error.
Everything else compiles unchanged with the headers of include/. Lines keep their numbers.
"""

import pathlib
import re
import sys

# A statement of PTX, and the function of emulation::ptx that takes its operands in the order of the assembly's lists.
PTX = {
    "": "keep",
    "red.relaxed.gpu.global.or.b32 [%0], %1;": "red_or_b32",
    "red.relaxed.gpu.global.and.b32 [%0], %1;": "red_and_b32",
    "red.relaxed.gpu.global.add.f32 [%0], %1;": "red_add_f32",
    "red.relaxed.gpu.global.add.f64 [%0], %1;": "red_add_f64",
    "red.relaxed.gpu.global.add.u32 [%0], %1;": "red_add_u32",
    "red.relaxed.gpu.global.add.u64 [%0], %1;": "red_add_u64",
    "atom.relaxed.gpu.global.add.u32 %0, [%1], 1;": "atom_increment_u32",
    "atom.relaxed.gpu.global.add.u64 %0, [%1], 1;": "atom_increment_u64",
    "{ .reg .pred any; setp.ne.u32 any, %1, 0; @any red.relaxed.gpu.global.or.b32 [%0], %1; }": "red_or_b32_where",
    "{ .reg .pred any; setp.ne.u32 any, %1, 0; @any red.relaxed.gpu.global.and.b32 [%0], %2; }": "red_and_b32_where",
    "{ .reg .pred p; setp.ne.u32 p, %2, 0; @p red.relaxed.gpu.global.add.f32 [%0], %1; }": "red_add_f32_where",
    "{ .reg .pred p; setp.ne.u32 p, %2, 0; @p red.relaxed.gpu.global.add.f64 [%0], %1; }": "red_add_f64_where",
    "ld.relaxed.gpu.global.u32 %0, [%1];": "ld_u32",
    "ld.relaxed.gpu.global.u64 %0, [%1];": "ld_u64",
    "st.relaxed.gpu.global.u32 [%0], %1;": "st_u32",
    "st.relaxed.gpu.global.u64 [%0], %1;": "st_u64",
    "atom.relaxed.cta.shared.cas.b32 %0, [%1], %2, %3;": "atom_shared_cas_b32",
    "red.relaxed.cta.shared.or.b32 [%0 + 4], %1;": "red_shared_or_b32_second",
    "mov.u32 %0, %1;": "mov_u32",
    "st.shared.u32 [%0], %1;": "st_shared_u32",
    "cp.async.ca.shared.global [%0], [%1], 4;": "cp_async_4",
    "cp.async.cg.shared.global [%0], [%1], 16;": "cp_async_16",
    "cp.async.wait_all;": "cp_async_wait_all",
    "ld.shared.u32 %0, [%1];": "ld_shared_u32",
    "griddepcontrol.wait;": None,
    "griddepcontrol.launch_dependents;": None,
}


def closing(text, at):
    """Position of the bracket that closes the one at `at`."""
    depth = 0
    quoted = False
    for i in range(at, len(text)):
        if text[i] == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif text[i] in "([{":
            depth += 1
        elif text[i] in ")]}":
            depth -= 1
            if depth == 0:
                return i
    raise ValueError("a bracket that does not close")


def with_lines_of(old, new):
    return new + "\n" * (old.count("\n") - new.count("\n"))


def split(text):
    """Splits at commas outside of brackets."""
    parts = [""]
    at = 0
    while at < len(text):
        if text[at] in "([{":
            end = closing(text, at)
            parts[-1] += text[at : end + 1]
            at = end + 1
            continue
        if text[at] == ",":
            parts.append("")
        else:
            parts[-1] += text[at]
        at += 1
    return [part.strip() for part in parts if part.strip()]


def operands(text):
    """The expressions of `: "=r"(a) : "r"(b), "l"(c) : "memory"`."""
    found = []
    for match in re.finditer(r'"[^"]*"\s*(\(?)', text):
        if match.group(1):
            found.append(text[match.end() : closing(text, match.end() - 1)].strip())
    return found


def translate_assembly(text):
    done = []
    at = 0
    for match in re.finditer(r"\basm\s+volatile\s*\(", text):
        end = closing(text, match.end() - 1)
        statement = re.match(r'\s*"([^"]*)"', text[match.end() : end])
        if statement is None or statement.group(1) not in PTX:
            raise ValueError(f"inline assembly that translate.py does not know: {text[match.start():end]}")
        name = PTX[statement.group(1)]
        given = operands(text[match.end() + statement.end() : end])
        call = f"::emulation::ptx::{name}({', '.join(given)})" if name else "(void)0"
        done += [text[at : match.start()], with_lines_of(text[match.start() : end + 1], call)]
        at = end + 1
    return "".join(done) + text[at:]


def begin_of_name(text, end):
    """Start of the name that ends before `end`, including template arguments."""
    at = end
    if text[at - 1] == ">":
        depth = 0
        while True:
            at -= 1
            depth += {">": 1, "<": -1}.get(text[at], 0)
            if depth == 0:
                break
    while re.match(r"[\w:]", text[at - 1]):
        at -= 1
    return at


def translate_launches(text):
    while (at := text.find("<<<")) >= 0:
        end_of_name = len(text[:at].rstrip())
        begin = begin_of_name(text, end_of_name)
        end_of_shape = text.index(">>>", at)
        open_bracket = text.index("(", end_of_shape)
        end = closing(text, open_bracket)
        shape = split(text[at + 3 : end_of_shape])
        shape += ["0", "nullptr"][len(shape) - 2 :]
        given = split(text[open_bracket + 1 : end])
        kernel = " ".join(text[begin:end_of_name].split())
        call = f"(void)::emulation::launch([=](const auto&... a) {{ {kernel}(a...); }}, {', '.join(shape + given)})"
        text = text[:begin] + with_lines_of(text[begin : end + 1], call) + text[end + 1 :]
    return text


def translate(text):
    text = translate_launches(translate_assembly(text))
    return re.sub(
        r"extern __shared__ __align__\(\d+\) ([\w ]+?) (\w+)\[\];",
        r"\1* const \2 = reinterpret_cast<\1*>(::emulation::dynamic_shared());",
        text,
    )


def main():
    to, root = map(pathlib.Path, sys.argv[1:3])
    for name in sys.argv[3:]:
        try:
            text = translate((root / name).read_text())
        except ValueError as error:
            sys.exit(f"{name}: {error}")
        made = to / re.sub(r"\.cu$", ".cpp", name)
        made.parent.mkdir(parents=True, exist_ok=True)
        if not made.exists() or made.read_text() != text:
            made.write_text(text)


if __name__ == "__main__":
    main()
