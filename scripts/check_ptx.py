#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Checks PTX for kernel parameters that are read from a wrong address, and for calls in kernels that are slow with them. Prints
each; the exit status is 1 if there is any.

nvcc 13.0 with --Ofast-compile=mid does not convert every address of a parameter: where operator[] of a glm vector in a
`__grid_constant__` structure returns a reference to a component that is chosen at run time, PTX has a plain load from an
address in the state space .param, without cvta.param, and the kernel reads address 0xa0, say. Device code names the components
instead. Only PTX can be checked: a source does not show which member of which object an index selects.

ptxas writes YIELD into the loops of a kernel that calls a function, which 128-bit divisions may be (exact::floor_div). The time of
votes is that of a few threads with long loops: 1.5 x as long with YIELD.

    scripts/check_ptx.py FILE...    PTX of any level of optimisation
"""
import pathlib
import re
import sys

FUNCTION = re.compile(r"^(?:\.(?:visible|weak|extern)\s+)*\.(entry|func)\b[^;{]*?([\w$.]+)\s*\([^()]*\)[^;{]*\{", re.M)
STATEMENT = re.compile(r"(?:@!?%p\d+\s+)?([a-z][\w.:]*)\s+([^;]*);")
REGISTER = re.compile(r"%[A-Za-z]+\d+")
ADDRESS = re.compile(r"\[\s*(%[A-Za-z]+\d+)\s*(?:\+\s*-?\d+\s*)?\]")
CALLED = re.compile(r"\bcall(?:\.uni)?\b[^;]*?\b(_Z\w+)")
# Parts of the names of functions, and of those that they must not call.
WITHOUT_CALLS = {"toggle_along_kernel": ("floor_div_wide", "narrow_row")}
MEMORY = ("ld", "ldu", "st", "atom", "red", "prefetch", "prefetchu")


def bodies(text):
    """(name, body) of each function in PTX."""
    starts = list(FUNCTION.finditer(text))
    for match, following in zip(starts, [*starts[1:], None]):
        yield match.group(2), text[match.end() : following.start() if following else len(text)]


def parameter_addresses(body, name):
    """Registers that may hold an address of the .param state space: the address itself, moved, chosen, or with an offset."""
    found = set(re.findall(r"\bmov\.[bu]64\s+(%\w+), " + re.escape(name) + r"_param_\d+(?:\+\d+)?;", body))
    if not found:
        return found
    flow = []
    for operation, operands in STATEMENT.findall(body):
        if operation.split(".")[0] in ("mov", "add", "sub", "selp", "min", "max", "mad", "and", "or"):
            registers = REGISTER.findall(operands)
            flow.append((registers[:1], registers[1:]))
    grows = True
    while grows:
        grows = False
        for to, sources in flow:
            if to and to[0] not in found and not found.isdisjoint(sources):
                found.add(to[0])
                grows = True
    return found


def complaints(text):
    """'statement, in function' for each use of such an address other than by ld.param and cvta.param."""
    for name, body in bodies(text):
        addresses = parameter_addresses(body, name)
        if not addresses:
            continue
        for operation, operands in STATEMENT.findall(body):
            kind, *modifiers = operation.split(".")
            if kind in MEMORY:
                through = ADDRESS.search(operands)
                wrong = through and through.group(1) in addresses and "param" not in modifiers
                if kind == "st":  # an address that is kept in memory, or passed to a function, is read as a generic one
                    wrong = wrong or not addresses.isdisjoint(REGISTER.findall(operands.split("]", 1)[-1]))
            elif kind == "cvta":
                wrong = "param" not in modifiers and not addresses.isdisjoint(REGISTER.findall(operands))
            else:
                wrong = False
            if wrong:
                yield f"{operation} {operands}, in {name}"


def slow_calls(text):
    """(name, callee) for each call that makes a kernel slow."""
    for name, body in bodies(text):
        for kernel, callees in WITHOUT_CALLS.items():
            if kernel in name:
                yield from ((name, callee) for callee in CALLED.findall(body) if any(part in callee for part in callees))


def main(files):
    status = functions = 0
    for file in files:
        text = pathlib.Path(file).read_text()
        read = sum(1 for _ in bodies(text))
        functions += read
        if not read:
            print(f"{file}: no function was found, so nothing was checked")
            status = 1
        for complaint in complaints(text):
            print(f"{file}: an address of a parameter without cvta.param: {complaint}")
            status = 1
        for name, callee in slow_calls(text):
            print(f"{file}: a call that makes a kernel slow: {callee}, in {name}")
            status = 1
    print(f"{functions} functions of {len(files)} files were read")
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
