// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The part of a surface that belongs to some layers of cells: functors for a backend's for_each.

#include <voxelpipe/surfaces/passes/vertices.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// Where a layer of cells begins in the arrays of a surface.
struct layer_begin {
    std::uint64_t vertex, edge;
};

// Where layer first + i * layers begins: 0 for the begin of a range of layers, 1 for its end.
template <class Cells>
struct find_layers {
    Cells cells;
    std::uint64_t count; // of cells
    cell_grid all;
    int first, layers;
    layer_begin* begins;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t row = all.row(0, first + static_cast<int>(i) * layers);
        const std::uint64_t cell = row < all.rows() ? cells.index.first_cell(row) : count;
        begins[i] = {cells.first_vertices[cell], cells.first_edges[cell]};
    }
};

// The items from `first` on.
template <class T>
struct copy_part {
    const T* from;
    std::uint64_t first;
    T* to;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { to[i] = from[first + i]; }
};

// Vertices in the cells of the whole.
struct raise_vertices {
    surface_vertex* vertices;
    int layers_below;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { vertices[i].cell.z += layers_below; }
};

// Indices of the whole. `shift` may stand for a number below 0, modulo 2^32.
template <class Face>
struct move_slab_faces {
    const Face* from;
    std::uint64_t first;
    std::uint32_t shift;
    Face* to;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        Face f = from[first + i];
        for (int k = 0; k < static_cast<int>(Face::length()); ++k) f[k] += shift;
        to[i] = f;
    }
};

} // namespace voxelpipe::core::passes
