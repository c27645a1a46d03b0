// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The counters of triangles that a call has, from the classes of triangles (core/primitive.hpp).

#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/status.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Adds `count` triangles of a class to the counters that a call has.
inline void count_class(counters& counts, triangle_class kind, std::uint64_t count = 1) {
    counts.triangles_in += count;
    switch (kind) {
    case triangle_class::nonfinite:
        counts.triangles_nonfinite += count;
        break;
    case triangle_class::too_far:
        counts.triangles_too_far += count;
        break;
    case triangle_class::zero_area:
        counts.triangles_zero_area += count;
        break;
    case triangle_class::outside:
        counts.triangles_outside += count;
        break;
    case triangle_class::drawn:
        counts.triangles_drawn += count;
        break;
    }
}

// Adds what different parts of a mesh have counted of their triangles.
inline void add_triangles(counters& all, const counters& one) {
    all.triangles_in += one.triangles_in;
    all.triangles_nonfinite += one.triangles_nonfinite;
    all.triangles_too_far += one.triangles_too_far;
    all.triangles_zero_area += one.triangles_zero_area;
    all.triangles_outside += one.triangles_outside;
    all.triangles_drawn += one.triangles_drawn;
}

} // namespace voxelpipe::core
