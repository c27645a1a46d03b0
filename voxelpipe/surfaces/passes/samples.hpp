// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Samples of targets: which are inside, and where a field crosses edges. Functors for a backend's for_each.

#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/surfaces/core/edge_crossing.hpp>
#include <voxelpipe/surfaces/passes/cells.hpp>

#include <cstdint>
#include <type_traits>

namespace voxelpipe::core::passes {

// Word i of the bits of a target's samples: those that are set, or below the level.
template <class View>
struct read_samples {
    View from;
    double level;
    std::uint32_t* words;
    std::uint64_t* nan_samples; // a count
    counted_layers counted = {};

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto row_words = static_cast<std::uint64_t>((from.extent.x + 31) / 32);
        const std::uint64_t row = i / row_words;
        const int first = static_cast<int>(i % row_words) * 32;
        const int y = static_cast<int>(row % static_cast<std::uint64_t>(from.extent.y)),
                  z = static_cast<int>(row / static_cast<std::uint64_t>(from.extent.y));
        std::uint32_t word = 0, nans = 0;
        for (int bit = 0; bit < 32 && first + bit < from.extent.x; ++bit) {
            const auto value = from(first + bit, y, z);
            bool inside = false;
            if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, bool>) {
                inside = value;
            } else {
                const double number = exact::to_double(value);
                inside = number < level;
                nans += number >= 0 || number < 0 ? 0 : 1; // not a number
            }
            word |= inside ? 1u << bit : 0u;
        }
        words[i] = word;
        if (nans != 0 && counted.has(z)) add_shared(*nan_samples, nans);
    }
};

// Where a field crosses an edge: t = d0 / (d0 - d1), d the values minus the level. In the middle where that is no
// number from 0 to 1: next to a NaN, and at the faces of the grid. For edges_of_cell.
template <class View>
struct cross_field {
    View from;
    double level;
    edge_crossing* crossings;
    std::uint64_t* made;         // a count
    counted_layers counted = {}; // of cells

    VOXELPIPE_HD void operator()(std::uint64_t number, int axis, const glm::ivec3& low, bool) const {
        const glm::ivec3 high(low.x + (axis == 0 ? 1 : 0), low.y + (axis == 1 ? 1 : 0), low.z + (axis == 2 ? 1 : 0));
        edge_crossing c;
        double t = -1.0;
        if (from.has(low.x, low.y, low.z) && from.has(high.x, high.y, high.z)) {
            const double below = exact::to_double(from(low.x, low.y, low.z)) - level,
                         above = exact::to_double(from(high.x, high.y, high.z)) - level;
            t = exact::div(below, below - above);
        }
        if (t >= 0.0 && t <= 1.0)
            c.t = static_cast<std::uint32_t>(exact::round_to_int64(exact::mul(t, 1 << edge_crossing::fraction)));
        else if (counted.has(low.z + 1))
            add_shared(*made, 1);
        crossings[number] = c;
    }
};

} // namespace voxelpipe::core::passes
