// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by these tests: triangles with exact positions, and the library's voxels for each triangle.

#include "library.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace properties {

using oracle::grid;
using oracle::snapped_triangle;
using oracle::splitmix64;
using oracle::test_grid;
using oracle::triangle_class;
using oracle::voxel;
using oracle::world_triangle;
namespace vp = voxelpipe;

using voxels = std::vector<voxel>;

inline std::string rule_name(vp::coverage rule) { return vp::name(rule); }
inline std::string rule_of(const ::testing::TestParamInfo<vp::coverage>& info) { return rule_name(info.param); }

// The library's voxels of each triangle, ascending, from one call.
std::vector<voxels> library_sets(const grid& g, const std::vector<world_triangle>& triangles, vp::coverage rule,
                                 unsigned threads = 2);

// A framebuffer of occupancy, the last primitive, a sum of floats and the voxel that the shader was given. A fragment
// that is lost, doubled or shaded differently changes it.
using occupancy_target = vp::target<vp::bit, vp::blend::bit_or>;
using last_target = vp::target<std::uint32_t, vp::blend::replace>;
using sum_target = vp::target<glm::vec3, vp::blend::add>;
using place_target = vp::target<glm::ivec3, vp::blend::max>;
struct image {
    vp::host_target<occupancy_target> occupied;
    vp::host_target<last_target> last;    // 0xffffffff where empty
    vp::host_target<sum_target> sums;     // of barycentrics
    vp::host_target<place_target> places; // fragment::voxel; -1 where empty
    vp::counters counts;
};
image library_image(const vp::grid& g, const std::vector<world_triangle>& triangles, vp::coverage rule);

// A triangle given in fixed-point units of an exact grid.
inline world_triangle from_units(const grid& g, const std::int64_t (&v)[3][3]) {
    world_triangle w{};
    for (int n = 0; n < 3; ++n) {
        const auto p = oracle::to_world(
            g, {static_cast<double>(v[n][0]), static_cast<double>(v[n][1]), static_cast<double>(v[n][2])});
        std::copy(p.begin(), p.end(), w.v[n]);
    }
    return w;
}

inline bool same_units(const snapped_triangle& t, const std::int64_t (&v)[3][3]) {
    for (int n = 0; n < 3; ++n)
        if (t.dropped || !std::equal(t.v[n], t.v[n] + 3, v[n])) return false;
    return true;
}

// Moves every position to the nearest multiple of `multiple` units in the (exact) grid's fixed point, so that it snaps
// to exactly that. False if a float cannot hold it, as happens far outside the grid.
inline bool make_exact(const grid& g, std::int64_t multiple, world_triangle& w) {
    const snapped_triangle t = oracle::snap(g, w.v);
    if (t.dropped) return false;
    std::int64_t v[3][3];
    for (int n = 0; n < 3; ++n)
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t q = t.v[n][axis] + (t.v[n][axis] < 0 ? -multiple / 2 : multiple / 2);
            v[n][axis] = q / multiple * multiple;
        }
    w = from_units(g, v);
    return same_units(oracle::snap(g, w.v), v);
}

// `count` times the test scale, but at least 4.
inline int scaled(int count) {
    return std::max(4, static_cast<int>(count * std::min(1.0, 4.0 * oracle::test_scale())));
}

// Random triangles of every class for a grid. Classes that cover many voxels are left out if the grid is not dense.
std::vector<world_triangle> all_kinds(splitmix64& random, const test_grid& where, int of_each);

} // namespace properties
