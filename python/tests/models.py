# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Files of models that the tests make."""

import json
import os
import struct
import subprocess

import numpy as np
from voxelpipe._save import png_bytes

from meshes import sphere


def picture(width=16, height=8):
    """RGBA texels of which no two rows or columns are alike."""
    y, x = np.mgrid[0:height, 0:width]
    alpha = np.where((x + y) % 5 == 0, 40, 255)
    return np.stack([x * 15, y * 30, (x * 7 + y * 50) % 256, alpha], axis=-1).astype(np.uint8)


def _padded(data, filler=b"\0"):
    return data + filler * (-len(data) % 4)


def glb(path, primitives, materials, pictures=(), nodes=None):
    """Writes a .glb. primitives: dicts of arrays by attribute, with "indices", "material" and perhaps "mode"; each is a
    mesh. nodes: of the scene; by default one for each mesh."""
    blob, views, accessors, meshes = b"", [], [], []

    def view(data):
        nonlocal blob
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob += _padded(data)
        return len(views) - 1

    def accessor(name, a):
        kind = {np.dtype(np.float32): 5126, np.dtype(np.uint32): 5125, np.dtype(np.uint8): 5121}[a.dtype]
        shape = "SCALAR" if a.ndim == 1 else f"VEC{a.shape[1]}"
        entry = {"bufferView": view(a.tobytes()), "componentType": kind, "count": len(a), "type": shape}
        if name == "POSITION":
            entry.update(min=a.min(axis=0).tolist(), max=a.max(axis=0).tolist())
        if name.startswith("COLOR") and a.dtype == np.uint8:
            entry["normalized"] = True
        accessors.append(entry)
        return len(accessors) - 1

    for p in primitives:
        made = {"attributes": {n: accessor(n, a) for n, a in p.items() if n.isupper() or "_" in n}}
        made["indices"] = accessor("indices", p["indices"].astype(np.uint32).ravel())
        made["material"] = p["material"]
        made["mode"] = p.get("mode", 4)
        meshes.append({"primitives": [made]})
    images = [{"bufferView": view(png_bytes(p)), "mimeType": "image/png"} for p in pictures]
    nodes = nodes if nodes is not None else [{"mesh": i} for i in range(len(meshes))]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    if images:
        document.update(images=images, samplers=[{}], textures=[{"source": i, "sampler": 0} for i in range(len(images))])
    text = _padded(json.dumps(document).encode(), b" ")
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def textured_sphere(levels=3):
    """Positions, texture coordinates that are multiples of 1/64, from the upper edge, and triangles."""
    v, f = sphere(levels=levels)
    uv = np.stack([np.round((v[:, 0] + 1) * 32), np.round((v[:, 1] + 1) * 48)], axis=-1) / 64
    return v, uv.astype(np.float32), f


def lighthouse(path):
    """Every kind of colour: a texture that is masked, twice and mirrored, colours of vertices, a factor, lines."""
    v, uv, f = textured_sphere()
    colors = np.uint8(255 * (v - v.min(axis=0)) / 2).clip(0, 255)
    line = np.array([[-3, 0, 0], [3, 0.5, 0.25]], np.float32)
    return glb(
        path,
        [
            {"POSITION": v, "TEXCOORD_0": uv, "indices": f, "material": 0},
            {"POSITION": v, "COLOR_0": np.concatenate([colors, np.full((len(v), 1), 255, np.uint8)], axis=1),
             "indices": f, "material": 1},
            {"POSITION": line, "indices": np.array([0, 1]), "material": 1, "mode": 1},
        ],
        [
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "MASK", "alphaCutoff": 0.4},
            {"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.5, 0.25, 1]}, "name": "painted"},
        ],
        [picture()],
        [
            {"mesh": 0},
            {"mesh": 0, "translation": [1.7, 0.3, 0.1], "rotation": [0, 0.6, 0, 0.8], "scale": [0.5, 0.7, -0.6]},
            {"mesh": 1, "translation": [-1.6, 0.2, 0.3], "scale": [0.6, 0.6, 0.6]},
            {"mesh": 2},
        ],
    )  # fmt: skip


def tool():
    """The voxelize tool, where the environment names one."""
    path = os.environ.get("VOXELPIPE_TOOL", "")
    return path if path and os.access(path, os.X_OK) else None


def tool_writes(model, output, *options):
    """The output's name, and the tool's statistics."""
    call = [tool(), str(model), "-o", str(output), "-q", "--stats", "json", *options]
    return output, json.loads(subprocess.run(call, check=True, capture_output=True).stdout)
