// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the theorem tests share: triangles with exact positions, and the library's voxel set of each triangle.

#include "library.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace theorems {

using oracle::grid;
using oracle::snapped_triangle;
using oracle::splitmix64;
using oracle::test_grid;
using oracle::triangle_class;
using oracle::voxel;
using oracle::world_triangle;
namespace vp = voxelpipe;

using voxels = std::vector<voxel>;

inline std::string rule_name(vp::coverage rule) { return rule == vp::coverage::thin ? "thin" : "conservative"; }
inline std::string rule_of(const ::testing::TestParamInfo<vp::coverage>& info) { return rule_name(info.param); }

// The library's voxels of each triangle, ascending, from one call.
inline std::vector<voxels> library_sets(const grid& g, const std::vector<world_triangle>& triangles, vp::coverage rule,
                                        unsigned threads = 2) {
    const oracle::soup mesh(triangles);
    vp::cpu_backend be(threads);
    vp::abuffer<vp::cpu_backend> lists{be};
    vp::voxelize(be, mesh.view(), oracle::as_library(g), vp::passthrough{}, vp::constant(true), lists, rule).or_throw();
    return oracle::voxels_by_triangle(lists.to_host(be), triangles.size(), oracle::whole_of(g));
}

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
// to just that. False where a float cannot hold it, which far outside the grid happens.
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

// Random triangles of every class for a grid; on grids that are not dense without those that cover much.
inline std::vector<world_triangle> all_kinds(splitmix64& random, const test_grid& where, int of_each) {
    std::vector<world_triangle> list;
    for (const triangle_class kind : oracle::all_triangle_classes) {
        if (oracle::covers_much(kind) && !where.dense) continue;
        const int count = oracle::covers_much(kind) ? (of_each + 7) / 8 : of_each;
        for (int n = 0; n < count; ++n) list.push_back(oracle::make_triangle(random, where, kind));
    }
    return list;
}

} // namespace theorems
