# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The table of the paper of 2011 beside the 2011 code on an H200 and ours: what document_tables.py writes and plot.py draws.

Figures of the paper and of the 2011 code are quoted in published_gpu_figures.hpp; ours are records/h200/table.csv (the strategy
that a call chooses) and computed.csv (tiles, forced). Needs the standard library only.
"""
import hashlib
import re
import struct
import zlib

from record import ROOT, read

QUOTED = ROOT.parent / "bench" / "published_gpu_figures.hpp"
CHART = ROOT.parent / "docs" / "paper_bits.png"
# Name of the scene in the records: in the paper, triangles there, what stands for it here.
SCENES = {
    "conference": ("Conference", "282 k", "original, in another variant"),
    "dragon": ("Dragon", "871 k", "original"),
    "blade": ("Turbine Blade", "1.76 M", "stand-in: a split decimation"),
    "hairball": ("Hairball", "2.88 M", "stand-in: procedural"),
    "asiandragon": ("XYZ RGB Asian Dragon", "7.21 M", "stand-in: a split decimation"),
}
# Columns of a row of published_gpu_figures.hpp by their place.
FIELDS = ("original_bit", "original_bit_thin", "original_float", "original_abuffer", "peer_bit", "peer", "floor_bit",
          "floor_float", "floor_abuffer", "target_bit", "target_bit_thin", "target_float", "target_abuffer",
          "paper_one_thread_a_triangle", "paper_bit", "paper_float", "paper_abuffer")  # fmt: skip


def quoted():
    """{(scene, resolution): {field: milliseconds}} of the header."""
    text = QUOTED.read_text(encoding="utf-8")
    if tuple(re.findall(r"(?<![\w.])(?:original|peer|floor|target|paper)\w*(?=[,;])", text[text.index("struct"):text.index("};")])) != FIELDS:
        raise ValueError(f"{QUOTED.name} has other fields than this script knows")
    out = {}
    for scene, n, rest in re.findall(r'^ *\{"(\w+)", (\d+),(.*)\},$', text, flags=re.M):
        values = [v.strip() for v in rest.split(",")]
        out[scene, int(n)] = {f: float(v) for f, v in zip(FIELDS, values, strict=True) if f != "peer"}
    return out


def rows():
    """A dictionary for each scene and grid, in the order of the paper."""
    ours = {(r["scene"], int(r["resolution"]), r["cell"]): r for r in read(ROOT / "h200" / "table.csv")}
    forced = {(r["scene"], int(r["resolution"]), r["program"], r["strategy"]): r for r in read(ROOT / "h200" / "computed.csv")}
    out = []
    for (scene, n), figures in quoted().items():
        cells = {kind: ours[scene, n, cell] for kind, cell in (
            ("bit", "bit_conservative"), ("float", "float_add_conservative"), ("abuffer", "abuffer_thin"), ("abuffer_conservative", "abuffer_conservative"))}
        row = {"scene": scene, "resolution": n, "triangles": int(cells["bit"]["triangles"]), **figures}
        row |= {f"ours_{kind}": float(r["ms"]) for kind, r in cells.items()}
        row |= {f"tiled_{kind}": float(forced[scene, n, program, "tiled"]["ms"])
                for kind, program in (("bit", "constant_bit"), ("float", "constant_sum"))}
        out.append(row)
    return out


# What the chart shows: name, column, whether it ran on the card of 2011.
BARS = [("Schwarz and Seidel, GTX 480", "paper_one_thread_a_triangle", "#c9c9c9"), ("VoxelPipe 2011, GTX 480", "paper_bit", "#8a8a8a"),
        ("VoxelPipe 2011, H200", "original_bit", "#e0a06a"), ("this library by tiles, H200", "tiled_bit", "#d1661c"),
        ("this library, H200", "ours_bit", "#1f6fb4")]  # fmt: skip


def digest(all_rows):
    """Names the figures that a chart shows; the chart keeps it, so that one of other figures is noticed."""
    shown = [(r["scene"], r["resolution"], *(r[column] for _, column, _ in BARS)) for r in all_rows if r["resolution"] != 128]
    return hashlib.sha256(repr(shown).encode()).hexdigest()[:16]


def digest_of_png(path):
    """What the text `records` of a PNG says, or None."""
    data = path.read_bytes() if path.is_file() else b""
    at = 8
    while at + 8 <= len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"tEXt" and body.startswith(b"records\0") and zlib.crc32(kind + body) == struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0]:
            return body[8:].decode("latin-1")
        at += 12 + length
    return None


def plot(out, label=""):
    """Draws binary output at 512³ and 1024³, as the talk has it, into the folder `out`. Returns True."""
    import matplotlib.pyplot as plt

    figures = rows()
    figure, panels = plt.subplots(2, 1, figsize=(9.5, 8), sharex=True, layout="constrained")
    for axes, n in zip(panels, (512, 1024)):
        mine = [r for r in figures if r["resolution"] == n]
        for k, (name, column, colour) in enumerate(BARS):
            places = [i + (k - (len(BARS) - 1) / 2) * 0.17 for i in range(len(mine))]
            drawn = axes.bar(places, [r[column] for r in mine], width=0.16, color=colour, label=name)
            axes.bar_label(drawn, [f"{r[column]:.3g}" for r in mine], fontsize=6.5, padding=1)
        axes.set_yscale("log")
        axes.set_ylim(0.04, 600)
        axes.set_yticks((0.1, 1, 10, 100), ("0.1", "1", "10", "100"))
        axes.set_xticks(range(len(mine)), [f"{SCENES[r['scene']][0]}\nH200: {SCENES[r['scene']][2].split(',')[0].split(':')[0]}" for r in mine],
                        fontsize=9)
        axes.set_ylabel("milliseconds, logarithmic")
        axes.set_title(f"{n}³", fontsize=10)
        axes.tick_params(labelbottom=True)
        axes.grid(True, axis="y", color="#eeeeee")
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    figure.suptitle("Binary output" + (f" — {label}" if label else ""), fontsize=11)
    figure.savefig(out / CHART.name, dpi=110, metadata={"records": digest(figures)})
    plt.close(figure)
    return True
