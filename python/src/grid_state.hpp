// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A grid as Python's numbers: its constructor's, and those by which it is pickled and goes from module to module.

#include "report.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>

namespace voxelpipe::python {

using triple_of_double = std::array<double, 3>;
using triple_of_int = std::array<std::int64_t, 3>;
// Origin, voxel size, shape of the whole grid, then the part's first voxel and its shape, these as (z, y, x).
using grid_state = std::tuple<triple_of_double, triple_of_double, triple_of_int, triple_of_int, triple_of_int>;

[[nodiscard]] inline glm::dvec3 to_vector(const triple_of_double& t) { return {t[0], t[1], t[2]}; }

// An extent from a shape (nz, ny, nx). A number that no grid can have becomes one that validate() refuses.
[[nodiscard]] inline glm::ivec3 extent_of(const triple_of_int& shape) {
    glm::ivec3 extent;
    for (std::size_t a = 0; a < 3; ++a)
        extent[static_cast<int>(a)] = static_cast<int>(std::clamp<std::int64_t>(shape[2 - a], -1, 1 << 30));
    return extent;
}

// Throws ValueError for a grid that the library refuses.
[[nodiscard]] inline const grid& checked(const grid& g) {
    if (const status s = validate(g); !s.ok()) throw nb::value_error(s.message().c_str());
    return g;
}

[[nodiscard]] inline grid make_grid(const triple_of_double& origin, const triple_of_double& voxel_size,
                                    const triple_of_int& shape) {
    grid g;
    g.origin = to_vector(origin);
    g.voxel_size = to_vector(voxel_size);
    g.extent = extent_of(shape);
    return checked(g);
}

// The grid of Grid.__getstate__(). Throws ValueError.
[[nodiscard]] inline grid grid_of(const grid_state& state) {
    const auto& [origin, voxel_size, whole, offset, shape] = state;
    const grid all = make_grid(origin, voxel_size, whole);
    return shape == whole ? all : checked(all.crop(extent_of(offset), extent_of(shape)));
}

} // namespace voxelpipe::python
