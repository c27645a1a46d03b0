// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Lists of voxels of Python as the library's bricks.

#include "arrays.hpp"

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/grid.hpp>

#include <algorithm>
#include <stdexcept>

namespace voxelpipe::python {

// (n, 3) indices x, y, z, as voxelpipe/_axes.py prepares them.
using voxel_array = nb::ndarray<const std::int32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

// Bricks of voxels that are listed in any order.
struct listed_bricks {
    std::vector<std::uint64_t> keys, offsets;
    std::vector<brick_mask> masks;
    std::vector<std::uint64_t> row_of; // by rank: where the voxel stands in the list
};

[[nodiscard]] inline std::string voxel_text(const std::int32_t* p) {
    return '(' + std::to_string(p[0]) + ", " + std::to_string(p[1]) + ", " + std::to_string(p[2]) + ") (x, y, z)";
}

// `offset` is added to all voxels of the grid. Throws IndexError for a voxel outside of the grid and ValueError for one
// that is listed twice.
[[nodiscard]] inline listed_bricks bricks_of(const voxel_array& voxels, const grid& g, const glm::ivec3& offset) {
    const std::size_t n = voxels.shape(0);
    std::vector<std::pair<std::uint64_t, std::uint64_t>> order(n); // key of the voxel, row
    for (std::size_t i = 0; i < n; ++i) {
        const std::int32_t* p = voxels.data() + 3 * i;
        const glm::ivec3 voxel(p[0], p[1], p[2]);
        if (!g.contains(voxel))
            throw std::out_of_range("voxel " + std::to_string(i) + " is " + voxel_text(p) +
                                    ", which lies outside the grid");
        order[i] = {core::morton_key(voxel + offset), i};
    }
    std::sort(order.begin(), order.end());
    listed_bricks b;
    b.row_of.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        const auto [key, row] = order[i];
        if (i != 0 && order[i - 1].first == key)
            throw std::invalid_argument("voxels " + std::to_string(order[i - 1].second) + " and " +
                                        std::to_string(row) + " of the list are the same");
        if (b.keys.empty() || b.keys.back() != key >> 9) {
            b.keys.push_back(key >> 9);
            b.masks.emplace_back();
            b.offsets.push_back(i);
        }
        b.masks.back().words[(key & 511u) >> 6] |= std::uint64_t{1} << (key & 63u);
        b.row_of.push_back(row);
    }
    if (n != 0) b.offsets.push_back(n);
    return b;
}

} // namespace voxelpipe::python
