# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""The pages of the API. Each header is a group of Doxygen's (doxygen_filter.py), which a page shows whole."""
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
from check_documents import sample

# Page: title, words, headers in the order in which a reader meets them.
CPP = {
    "calls": ("Calls and results", "The one entry point and what it returns. In the paper: the high-level API.",
              ["voxelize.hpp", "status.hpp", "stage_times.hpp"]),
    "backends": ("Backends", "Where the work runs. All backends give the same bits.",
                 ["cpu_backend.hpp", "device/backend.cuh", "device/call/strategy.hpp", "device/base/memory.cuh",
                  "device/base/device_buffer.cuh"]),
    "grids": ("Grids and coverage", "Where voxels lie in space, and which of them a triangle covers. In the paper: conservative and thin rasterization.",
              ["grid.hpp", "core/triangle_setup.hpp", "core/coverage.hpp"]),
    "meshes": ("Meshes", "Triangles, points and lines, and the memory that they are made from.",
               ["mesh.hpp", "mesh_source.hpp", "programs/elements.hpp", "core/instances.hpp"]),
    "shaders": ("Shaders", "Vertex and fragment shaders, varyings and draws. In the paper: vertex and fragment programs.",
                ["shader.hpp", "core/interpolate.hpp", "programs/field.hpp"]),
    "programs": ("Programs", "Tessellation and geometry programs, between the vertex shader and the rasterizer.",
                 ["programs/program.hpp", "programs/program_options.hpp", "programs/program_call.hpp", "programs/element_call.hpp"]),
    "framebuffers": ("Framebuffers and blends", "Render targets, how fragments meet in them, and their copies on the host. "
                     "In the paper: frame-buffer types, multiple render targets, blending modes, programmable ROP.",
                     ["framebuffer.hpp", "blend.hpp", "core/layout.hpp", "core/value_traits.hpp", "core/half.hpp", "host_target.hpp"]),
    "formats": ("Packed formats", "Vectors in one word as values of targets, and bfloat16: conversions with one rounding, blends, means.",
                ["formats/normalized.hpp", "formats/packed_floats.hpp", "core/bfloat16.hpp", "formats/packed_blend.hpp"]),
    "abuffers": ("A-buffers", "Every fragment of every voxel. In the paper: A-buffer and bucketing.", ["abuffer.hpp"]),
    "solids": ("Solids", "The inside of meshes.", ["solid/solid.hpp", "solid/diagnose_repair.hpp", "solid/core/crossing.hpp", "solid/core/row_crossing.hpp"]),
    "surfaces": ("Surfaces", "Closed manifold meshes of bits, fields and any triangles.",
                 ["surfaces/surface.hpp", "surfaces/extract.hpp", "surfaces/extract_slab.hpp", "surfaces/surface_layers.hpp", "surfaces/extract_sparse.hpp", "surfaces/device/extract_async.cuh",
                  "surfaces/remesh.hpp", "surfaces/remesh_slab.hpp", "surfaces/remesh_sparse.hpp", "surfaces/device/remesh_async.cuh"]),
    "distances": ("Distances", "Signed distances from meshes, and the nearest triangle.",
                  ["distance/distance.hpp", "distance/sparse_distance.hpp", "programs/distance_programs.hpp", "distance/distance_ray.hpp",
                   "distance/device/distance_async.cuh", "distance/device/sparse_distance_async.cuh", "programs/device/distance_program_async.cuh",
                   "distance/core/point_triangle.hpp"]),
    "label": ("Labels", "Connected components of bits.", ["label/label.hpp", "label/voxel_component.hpp"]),
    "cells": ("Cut cells", "How much of each voxel is inside, and where links between voxels are cut.", ["cells/cells.hpp", "cells/sparse_cells.hpp", "cells/cell_programs.hpp", "cells/device/cells_async.cuh", "cells/device/sparse_cells_async.cuh", "cells/links.hpp", "cells/core/link_crossing.hpp"]),
    "sparse": ("Sparse grids", "Memory in proportion to the voxels that are drawn: bricks, octrees, files.",
               ["sparse/sparse.hpp", "sparse/host_sparse.hpp", "sparse/sparse_merge.hpp", "core/brick_table.hpp", "core/brick_tile.hpp", "sparse/brick_lookup.hpp", "sparse/octree.hpp", "core/octree_view.hpp",
                "levels/reducers.hpp", "sparse/octree_dag.hpp", "sparse/backend_octree.hpp", "sparse/backend_octree_dag.hpp", "core/octree_dag_view.hpp", "sparse/io/nanovdb.hpp"]),
    "levels": ("Levels and rays of dense grids", "Coarser levels of targets, levels of light for cone tracing, rays through bits.",
               ["levels/dense_levels.hpp", "levels/direction_mips.hpp", "levels/dense_bits.hpp", "levels/cell_walk.hpp"]),
    "slabs": ("Slabs", "Meshes and grids beyond one memory or one machine: plans, out-of-core streams, MPI.",
              ["slabs/stream.hpp", "slabs/stream_surface.hpp", "slabs/slab_lists.hpp", "slabs/mpi.hpp", "slabs/plan.hpp", "slabs/records.hpp", "slabs/bins.hpp"]),
    "streams": ("Streams and graphs", "Calls that never wait, with memory of the caller. For cuda_backend.",
                ["device/voxelize_async.cuh", "device/abuffer_async.cuh", "solid/device/solid_async.cuh",
                 "sparse/device/sparse_result.cuh", "sparse/device/sparse_async.cuh", "sparse/device/sparse_merge_async.cuh", "sparse/device/sparse_solid_async.cuh", "programs/device/program_async.cuh",
                 "programs/device/program_arrays.cuh",
                 "programs/device/element_async.cuh"]),
    "arithmetic": ("Arithmetic for shaders", "Operations with the same bits on every compiler and device, and views of arrays.",
                   ["core/exact.hpp", "core/pack.hpp"]),
}
# What one wants to do, where its shortest code is (a snippet of a sample that is built and run), and where to read on.
TASKS = [
    ("A surface as voxels", "samples/00_shortest.cpp", "shortest", "calls"),
    ("A grid around a mesh", "samples/guide/grids_and_results.cpp", "grids", "grids"),
    ("A part of a grid", "samples/guide/memory_and_crops.cpp", "crops", "grids"),
    ("Results on the host", "samples/guide/grids_and_results.cpp", "read back", "framebuffers"),
    ("Attributes of vertices", "samples/guide/attributes.cpp", "attributes", "shaders"),
    ("A vertex shader", "samples/guide/attributes.cpp", "vertex shader", "shaders"),
    ("A texture", "samples/guide/attributes.cpp", "texture", "shaders"),
    ("Colours in one word", "samples/guide/packed_formats.cpp", "packed", "formats"),
    ("A blend of one's own", "samples/guide/blends.cpp", "order-free", "framebuffers"),
    ("Several meshes in one call", "samples/guide/blends.cpp", "draws", "calls"),
    ("Every fragment of a voxel", "samples/guide/grids_and_results.cpp", "find", "abuffers"),
    ("The inside of meshes", "samples/guide/solids.cpp", "bodies", "solids"),
    ("A mesh with holes", "samples/guide/solids.cpp", "holes", "solids"),
    ("Distances from a mesh", "samples/17_clearance.cpp", "fields", "distances"),
    ("A closed mesh of any triangles", "samples/19_remesh.cpp", "remesh", "surfaces"),
    ("Colours of its vertices", "samples/20_scan.cpp", "call", "surfaces"),
    ("How much of a voxel is inside", "samples/guide/solids.cpp", "fractions", "cells"),
    ("The mean colour of thin layers", "samples/25_thin_colors.cpp", "paint", "cells"),
    ("Links that a mesh cuts", "samples/24_links.cpp", "links", "cells"),
    ("Connected components", "samples/guide/solids.cpp", "labels", "label"),
    ("Instances", "samples/09_forest.cpp", "instances", "meshes"),
    ("Points", "samples/08_points.cpp", "points", "meshes"),
    ("Tessellation", "samples/05_displaced.cpp", "tessellation", "programs"),
    ("Geometry programs", "samples/06_hair.cpp", "geometry", "programs"),
    ("A sparse grid", "samples/04_sparse.cpp", "draw", "sparse"),
    ("An octree and a ray", "samples/04_sparse.cpp", "octree", "sparse"),
    ("A NanoVDB file", "samples/04_sparse.cpp", "file", "sparse"),
    ("Memory of one's own", "samples/guide/memory_and_crops.cpp", "own memory", "framebuffers"),
    ("A mesh larger than memory", "samples/guide/solids.cpp", "stream", "slabs"),
    ("Errors", "samples/guide/memory_and_crops.cpp", "errors", "calls"),
    ("A CUDA stream", "samples/guide/on_a_gpu.cu", "stream", "backends"),
    ("Frames that never wait", "samples/guide/on_a_gpu.cu", "tracked", "streams"),
]
# Shown nowhere: what the library uses to write NanoVDB files.
HIDDEN = ["sparse/io/nanovdb_nodes.hpp"]
PYTHON = ["Grid", "fit", "load_model", "Model", "Material", "Texture", "Part", "voxelize", "solid", "tiles", "distance", "distance_at", "fractions", "sparse_fractions", "SparseFractions", "fraction_lists", "FractionLists", "links", "Links", "label", "remesh", "extract",
          "bake", "sparse", "dense", "VoxelList", "lines", "points", "instances", "Octree", "Hits", "fragments", "Fragments", "save", "formats", "render", "view", "View",
          "DroppedTrianglesWarning", "OpenMeshWarning", "ModelWarning", "WriteError"]
# Pictures of functions that docs/site/python_pictures.py makes none of.
PYTHON_PICTURES = {"load_model": "docs/lighthouse.png", "render": "docs/torus.png", "view": "docs/gallery/page.png",
                   "distance_at": "docs/python/distance.png", "links": "docs/gallery/links.png"}


def picture_of(name):
    """The file of a function's picture, in the repository; empty where it has none."""
    file = PYTHON_PICTURES.get(name, f"docs/python/{name}.png")
    return file if (pathlib.Path(__file__).resolve().parents[2] / file).exists() else ""


def heading(text, line="="):
    return f"{text}\n{line * len(text)}\n\n"


def python_grid(source):
    """Grid as its binding documents it: the compiled module is not there when the site is made."""
    text = re.search(r'nb::class_<grid>.*?;\n\n', source, flags=re.S)[0]
    out = []
    for piece in re.split(r"\.def(?=\w*\()|nb::class_", text)[1:]:
        name, *strings = re.findall(r'"((?:[^"\\]|\\.)*)"', piece)
        arguments = re.findall(r'nb::arg\("(\w+)"\)', piece)
        words = "".join(s for s in strings if s not in arguments).replace("\\n", "\n")
        words = re.sub(r"(?<!`)`(\w+)`(?!`)", r"``\1``", words).replace("\n", " ")
        if name == "Grid":
            out.append(f".. py:class:: Grid(origin, voxel_size, shape)\n\n   {words}\n")
        elif name == "__init__":
            out.append(f"   {words}\n")
        elif not name.startswith("_"):
            kind = f"py:method:: {name}({', '.join(arguments)})" if arguments else f"py:property:: {name}"
            out.append(f"   .. {kind}\n\n      {words}\n")
    return "\n".join(out) + "\n"


def group_of(header):
    return re.sub("[^a-z0-9_]", "_", header)


def write_tasks(file):
    """Calls by task, each with an example."""
    text = heading("C++ calls by task") + ("The shortest code for each, cut from samples that are built and run. ``vp`` is namespace "
                                           "``voxelpipe``.\n\n.. contents::\n   :local:\n\n")
    for title, path, snippet, page in TASKS:
        code = "".join("   " + line if line.strip() else line for line in sample(path, snippet).splitlines(keepends=True))
        text += heading(title, "-") + f".. code-block:: cpp\n\n{code}\n:doc:`{CPP[page][0]} <{page}>`, from ``{path}``.\n\n"
    file.write_text(text, encoding="utf-8")


def unlisted(xml):
    """Headers with public names that CPP does not list: no name is missing on the site."""
    listed = {group_of(h) for _, _, headers in CPP.values() for h in headers} | {group_of(h) for h in HIDDEN}
    for file in sorted(xml.glob("group__*.xml")):
        text = file.read_text(encoding="utf-8")
        name, header = re.search(r"<compoundname>(.*?)</compoundname>\s*<title>(.*?)</title>", text).groups()
        if name not in listed and ("<memberdef" in text or "<innerclass" in text):
            yield header


def write_api(out, xml, python_source):
    folder = out / "api"
    folder.mkdir()
    more = list(unlisted(xml))
    if more:
        CPP["more"] = ("Further headers", "What the other pages do not show.", more)
    toc = "".join(f"   {name}\n" for name in CPP)
    (folder / "index.rst").write_text(
        heading("C++ API") + "Everything is in namespace ``voxelpipe``, which programs shorten to ``vp``. ``<cpu_ref/backend.hpp>`` brings the CPU "
        "backend, ``<voxelpipe/voxelpipe.hpp>`` the rest, with ``cuda_backend`` where nvcc compiles. Namespace ``voxelpipe::core`` is the "
        "library's own. :doc:`tasks` has the calls by what they are for.\n\n.. toctree::\n   :maxdepth: 2\n\n" + toc, encoding="utf-8")
    for name, (title, words, headers) in CPP.items():
        text = heading(title) + words + "\n\n"
        for header in headers:
            shown = {"cpu_backend.hpp": "cpu_ref/backend.hpp"}.get(header, f"voxelpipe/{header}")
            text += heading(f"<{shown}>", "-")
            text += f".. doxygengroup:: {group_of(header)}\n   :content-only:\n   :members:\n\n"
        (folder / f"{name}.rst").write_text(text, encoding="utf-8")
    write_tasks(folder / "tasks.rst")
    text = heading("Python API") + ".. py:module:: voxelpipe\n\n.. py:currentmodule:: voxelpipe\n\n"
    for name in PYTHON:
        if name == "Grid":
            text += python_grid(python_source)
        elif name[0].isupper():
            text += f".. autoclass:: {name}\n   :members:\n\n"
        else:
            text += f".. autofunction:: {name}\n\n"
        if picture_of(name):
            text += f".. image:: ../_static/{picture_of(name)}\n   :width: 360px\n   :alt: What {name} makes\n\n"
        elif name[0].islower() and name != "formats":
            sys.exit(f"{name} has no picture: docs/site/python_pictures.py")
    text += heading("Dask: voxelpipe.dask", "-") + ".. automodule:: voxelpipe.dask\n   :members:\n\n"
    (folder / "python.rst").write_text(text, encoding="utf-8")
