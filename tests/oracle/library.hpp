// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Connects oracle and library for tests that compare the two: grids and triangles in the library's types, its results
// as voxel sets per triangle, the number of triangles of a run, and messages from which a disagreement can be replayed.
// Only this file of the oracle's folder and the tests library_* use the library.

#include "oracle.hpp"
#include "triangles.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iomanip>
#include <ostream>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace voxelpipe {

inline const char* name(coverage rule) {
    return rule == coverage::thin        ? "thin"
           : rule == coverage::crosshair ? "crosshair"
           : rule == coverage::diagonal  ? "diagonal"
                                         : "conservative";
}
inline void PrintTo(coverage rule, std::ostream* os) { *os << name(rule); }

} // namespace voxelpipe

namespace oracle {

namespace vp = voxelpipe;

inline void PrintTo(triangle_class kind, std::ostream* os) { *os << name(kind); }
inline void PrintTo(const voxel& v, std::ostream* os) { *os << '(' << v.i << ',' << v.j << ',' << v.k << ')'; }

inline vp::grid as_library(const grid& g) {
    vp::grid r;
    for (int axis = 0; axis < 3; ++axis) {
        r.origin[axis] = g.origin[axis];
        r.voxel_size[axis] = g.voxel_size[axis];
        r.extent[axis] = g.extent[axis];
    }
    return r;
}

// Three vertices for every triangle, none shared.
struct soup {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    explicit soup(std::span<const world_triangle> from) {
        positions.reserve(from.size() * 3);
        triangles.reserve(from.size());
        for (const world_triangle& t : from) {
            const auto first = static_cast<std::uint32_t>(positions.size());
            for (const auto& v : t.v) positions.emplace_back(v[0], v[1], v[2]);
            triangles.emplace_back(first, first + 1, first + 2);
        }
    }
    vp::mesh_view<> view() const { return {positions, triangles}; }
};

// Part of a grid, in voxels of the whole.
struct part {
    int begin[3];
    int size[3];

    region as_region() const {
        return {{begin[0], begin[1], begin[2]}, {begin[0] + size[0], begin[1] + size[1], begin[2] + size[2]}};
    }
};

inline part whole_of(const grid& g) { return {{0, 0, 0}, {g.extent[0], g.extent[1], g.extent[2]}}; }

inline part random_part(splitmix64& random, const grid& g, int largest_size) {
    part p{};
    for (int axis = 0; axis < 3; ++axis) {
        p.begin[axis] = static_cast<int>(random.between(0, g.extent[axis] - 1));
        p.size[axis] = static_cast<int>(random.between(1, std::min(g.extent[axis] - p.begin[axis], largest_size)));
    }
    return p;
}

inline vp::grid as_library(const grid& g, const part& p) {
    return as_library(g).crop({p.begin[0], p.begin[1], p.begin[2]}, {p.size[0], p.size[1], p.size[2]});
}

// The library's expected voxels according to the oracle.
inline std::vector<voxel> expected_voxels(const grid& g, const snapped_triangle& t, vp::coverage rule, const part& p) {
    return rule == vp::coverage::thin        ? thin(g, t, p.as_region())
           : rule == vp::coverage::crosshair ? crosshair(g, t, p.as_region())
           : rule == vp::coverage::diagonal  ? diagonal(g, t, p.as_region())
                                             : conservative(g, t, p.as_region());
}

// The library's A-buffer by triangle: for each of `triangles` its voxels, ascending, as indices of the whole grid.
template <class Payload>
std::vector<std::vector<voxel>> voxels_by_triangle(const vp::host_abuffer<Payload>& lists, std::size_t triangles,
                                                   const part& p) {
    std::vector<std::vector<voxel>> result(triangles);
    for (const auto& [at, fragments] : lists)
        for (const auto& entry : fragments)
            result.at(entry.primitive).push_back({at.x + p.begin[0], at.y + p.begin[1], at.z + p.begin[2]});
    return result;
}

// Floats in hexadecimal, so that a case can be pasted into a test.
inline std::string describe(const grid& g, const world_triangle& t) {
    std::ostringstream text;
    text << std::hexfloat << "grid {{";
    for (const double x : g.origin) text << x << ", ";
    text << "}, {";
    for (const double x : g.voxel_size) text << x << ", ";
    text << "}, {" << g.extent[0] << ", " << g.extent[1] << ", " << g.extent[2] << "}} triangle {";
    for (const auto& v : t.v) text << '{' << v[0] << "f, " << v[1] << "f, " << v[2] << "f}, ";
    text << '}' << std::defaultfloat << " snapped {";
    const snapped_triangle s = snap(g, t.v);
    for (const auto& v : s.v) text << '{' << v[0] << ", " << v[1] << ", " << v[2] << "}, ";
    text << "} F " << fraction_bits(g) << (s.dropped ? " dropped" : "");
    return text.str();
}

// `usual`, or another seed for each VOXELPIPE_ORACLE_SEED, so that a longer run tests other triangles.
inline std::uint64_t seed(std::uint64_t usual) {
    const char* const offset = std::getenv("VOXELPIPE_ORACLE_SEED");
    return offset == nullptr ? usual : usual + 1000003 * std::strtoull(offset, nullptr, 10);
}

// The number of triangles over all classes: VOXELPIPE_ORACLE_TRIANGLES, or `usual` times the test scale.
inline std::uint64_t triangle_budget(std::uint64_t usual) {
    if (const char* const count = std::getenv("VOXELPIPE_ORACLE_TRIANGLES")) return std::strtoull(count, nullptr, 10);
    return static_cast<std::uint64_t>(static_cast<double>(usual) * test_scale());
}

} // namespace oracle
