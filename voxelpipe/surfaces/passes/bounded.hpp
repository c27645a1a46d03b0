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
    std::uint64_t words, cells, vertices, quads;      // that passes work on
    std::uint64_t totals[3];                          // cells, vertices and crossed edges, as far as cells fit
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

// Whether the cells fit; all_cells is known.
struct bound_cells {
    const std::uint64_t* num_words;
    std::uint64_t room;
    bounded_surface* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        const bool fits = state->all_cells <= room;
        state->words = fits ? *num_words : 0;
        state->cells = fits ? state->all_cells : 0;
    }
};
// Whether the vertices and the quads fit.
struct bound_vertices {
    std::uint64_t vertex_room, quad_room;
    bounded_surface* state;
    VOXELPIPE_HD void operator()(std::uint64_t) const {
        state->all_vertices = state->totals[1];
        state->all_quads = state->totals[2];
        const bool fits = state->all_vertices <= vertex_room && state->all_quads <= quad_room;
        if (!fits) state->words = state->cells = 0;
        state->vertices = fits ? state->all_vertices : 0;
        state->quads = fits ? state->all_quads : 0;
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
