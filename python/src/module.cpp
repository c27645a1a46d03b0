// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

NB_MODULE(_core, m) {
    namespace python = voxelpipe::python;
    m.doc() = "The compiled part of voxelpipe. Arrays are prepared by the modules beside it; use those.";
    python::bind_grid(m);
    python::bind_surface(m);
    python::bind_solid(m);
    python::bind_distance(m);
    python::bind_remesh(m);
    python::bind_fractions(m);
    python::bind_label(m);
    python::bind_links(m);
    python::bind_sparse_float(m);
    python::bind_sparse_fractions(m);
    python::bind_sparse_integer(m);
    python::bind_files(m);
    python::bind_lists(m);
    python::bind_octree(m);
    python::bind_scene(m);
}
