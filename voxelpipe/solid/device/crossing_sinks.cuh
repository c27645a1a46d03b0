// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sinks of crossings: a list, bits, or winding numbers.

#include <voxelpipe/solid/device/crossing_list.cuh>
#include <voxelpipe/solid/device/solid_source.cuh>

#include <cstdint>

namespace voxelpipe::device {

// Appends to the list. The order does not show.
struct crossing_appender {
    static constexpr bool is_listing = true;
    crossing_list list;
    bool is_split;                   // a body a draw
    std::uint32_t num_draws;         // the cones of body k are draw num_draws + k
    std::uint32_t* counts = nullptr; // of entries, by row: row_groups; null: not wanted

    // at: the crossing's number in the list
    __device__ VOXELPIPE_INLINE void emit(const row_grid& grid, unsigned long long at, std::uint32_t draw,
                                          std::uint64_t row, std::int64_t first, int winding) const {
        list.store(at, row,
                   !is_split          ? 0
                   : draw < num_draws ? draw
                                      : draw - num_draws,
                   entry_value::of(grid.position(first), winding > 0 ? entry_kind::enter : entry_kind::leave));
        if (counts != nullptr) atomicAdd(counts + row, 1u);
    }
};

// Toggles the first bit behind the crossing; a later pass spreads it (solid/device/parity_rows.cuh). Marks crossed rows
// by a byte each, which needs no atomic, and rows crossed behind the part an odd number of times by a bit each.
struct crossing_toggler {
    static constexpr bool is_listing = false;
    word* bits;
    std::uint8_t* marked;
    word* odd_behind;
    std::uint32_t words_x;

    __device__ VOXELPIPE_INLINE void emit(const row_grid& grid, unsigned long long, std::uint32_t, std::uint64_t row,
                                          std::int64_t first, int) const {
        const std::uint32_t x = grid.position(first);
        marked[row] = 1;
        if (x < static_cast<std::uint32_t>(grid.extent.x))
            atomicXor(bits + row * words_x + x / 32, 1u << (x & 31));
        else
            atomicXor(odd_behind + row / 32, 1u << (row & 31));
    }
};

// Adds to the first voxel behind the crossing, of its body; a later pass sums them up (solid/device/winding.cuh). A row
// has a place a voxel, and one behind it. Marks crossed rows by a byte each.
struct winding_adder {
    static constexpr bool is_listing = false;
    std::int32_t* windings;
    std::int32_t* of_cones;  // what of it is of cones; null: not wanted
    std::uint8_t* marked;    // by body and row
    std::uint64_t of_body;   // places
    bool is_split;           // a body a draw
    std::uint32_t num_draws; // the cones of body k are draw num_draws + k

    __device__ VOXELPIPE_INLINE void emit(const row_grid& grid, unsigned long long, std::uint32_t draw,
                                          std::uint64_t row, std::int64_t first, int winding) const {
        const bool is_cone = draw >= num_draws;
        const std::uint64_t body = is_cone ? draw - num_draws : is_split ? draw : 0;
        const std::uint64_t row_places = static_cast<std::uint64_t>(grid.extent.x) + 1;
        const std::uint64_t place = body * of_body + row * row_places + grid.position(first);
        marked[body * grid.num_rows() + row] = 1;
        atomicAdd(windings + place, winding > 0 ? 1 : -1);
        if (is_cone && of_cones != nullptr) atomicAdd(of_cones + place, winding > 0 ? 1 : -1);
    }
};

} // namespace voxelpipe::device
