// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Passes of a surface whose sizes only the device knows, in arrays of fixed room: functors for loops over the room.

#include <voxelpipe/surfaces/passes/parts.hpp>
#include <voxelpipe/surfaces/passes/vertices.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// What such a call keeps beside its arrays. What does not fit counts, and leaves all that follows without work.
struct bounded_surface {
    surface_counters counts;                          // of the surface; zeros where something does not fit
    std::uint64_t all_cells, all_vertices, all_quads; // that there are, before parts are left out
    std::uint64_t cells, vertices, quads;             // that passes work on
    std::uint64_t parts[static_cast<int>(part_count::count)];
};

// F for numbers below *count.
template <class F>
struct bounded {
    F f;
    const std::uint64_t* count;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i < *count) f(i);
    }
};
// F for all numbers, unless *count is 0.
template <class F>
struct if_any {
    F f;
    const std::uint64_t* count;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (*count != 0) f(i);
    }
};

// Whether the cells fit.
struct bound_cells {
    const std::uint64_t* total;
    std::uint64_t room;
    bounded_surface* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        state->all_cells = *total;
        state->cells = *total <= room ? *total : 0;
    }
};
// Whether the vertices and the quads fit.
struct bound_vertices {
    const std::uint64_t *vertices, *quads;
    std::uint64_t vertex_room, quad_room;
    bounded_surface* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        state->all_vertices = *vertices;
        state->all_quads = *quads;
        const bool fits = *vertices <= vertex_room && *quads <= quad_room;
        if (!fits) state->cells = 0;
        state->vertices = fits ? *vertices : 0;
        state->quads = fits ? *quads : 0;
    }
};

// flip_cells with zeros behind the cells.
struct flip_bounded_cells {
    flip_cells<sample_bits> flips;
    const std::uint64_t* cells;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i < *cells)
            flips(i);
        else
            flips.sheets[i] = flips.edges[i] = 0;
    }
};

// drop_vertices and drop_quads with zeros behind what there is.
template <class Drop>
struct drop_bounded {
    Drop drop;
    const std::uint64_t* count;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i < *count)
            drop(i);
        else
            drop.kept[i] = 0;
    }
};

// What is left of vertices and quads; null where all are.
struct count_surface {
    const std::uint64_t *vertices, *quads;
    bool has_quads;
    bounded_surface* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        if (vertices != nullptr) {
            state->vertices = *vertices;
            state->quads = *quads;
        }
        surface_counters& c = state->counts;
        c.vertices = state->vertices;
        c.faces = has_quads ? state->quads : 2 * state->quads;
        c.components_left_out = state->parts[static_cast<int>(part_count::left_out)];
        c.components = state->parts[static_cast<int>(part_count::found)] - c.components_left_out;
        if (state->cells != 0 || state->all_cells == 0) return;
        c = surface_counters{};
    }
};

} // namespace voxelpipe::core::passes
