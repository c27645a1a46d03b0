// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The baseline: the program that one would write first. One thread; each triangle's bounding box, every voxel of it
// tested exactly (thin: every column). It shares the snapped positions and the setup's half-planes with the library, so
// it gives the same sets; it has no tiles, no spans, no shortcuts.

#include "mesh_data.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/grid.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace bench::baseline {

namespace vp = voxelpipe;

// True if the closed voxel at (u, v, w), relative to the setup's origin, meets the closed triangle.
template <class Int>
bool covers(const vp::core::triangle_setup<Int>& t, Int u, Int v, Int w) {
    for (int i = 0; i < 3; ++i)
        if (t.uv[i].at(u, v) < 0 || t.vw[i].at(v, w) < 0 || t.wu[i].at(w, u) < 0) return false;
    const Int nu = t.plane[0], nv = t.plane[1], nw = t.plane[2];
    const Int corner = nu * u + nv * v + nw * w;
    return corner + vp::core::positive_part(nu) + vp::core::positive_part(nv) + nw >= t.plane_low &&
           corner + vp::core::negative_part(nu) + vp::core::negative_part(nv) <= t.plane_high;
}

template <class Int, class Emit>
void conservative(const vp::core::triangle_setup<Int>& t, const vp::core::voxel_box& box, Emit&& emit) {
    for (std::int64_t z = box.lo[2]; z <= box.hi[2]; ++z)
        for (std::int64_t y = box.lo[1]; y <= box.hi[1]; ++y)
            for (std::int64_t x = box.lo[0]; x <= box.hi[0]; ++x) {
                const auto p = vp::core::to_uvw(t.axis, x, y, z);
                if (covers<Int>(t, p[0] - t.origin[0], p[1] - t.origin[1], p[2] - t.origin[2]))
                    emit(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
            }
}

template <class Int, class Emit>
void thin(const vp::core::triangle_setup<Int>& t, const vp::core::voxel_box& grid, const vp::core::voxel_box& box,
          Emit&& emit) {
    if (t.zero_area) return;
    const auto lo = vp::core::to_uvw(t.axis, box.lo[0], box.lo[1], box.lo[2]);
    const auto hi = vp::core::to_uvw(t.axis, box.hi[0], box.hi[1], box.hi[2]);
    for (std::int64_t v = lo[1] - t.origin[1]; v <= hi[1] - t.origin[1]; ++v)
        for (std::int64_t u = lo[0] - t.origin[0]; u <= hi[0] - t.origin[0]; ++u) {
            if (t.uv[0].at(u, v) < 0 || t.uv[1].at(u, v) < 0 || t.uv[2].at(u, v) < 0) continue;
            const Int depth = vp::exact::floor_div<Int>(
                t.plane_high - t.plane[0] * (2 * u + 1) - t.plane[1] * (2 * v + 1), 2 * t.plane[2]);
            const auto p = vp::core::to_xyz(t.axis, t.origin[0] + u, t.origin[1] + v,
                                            t.origin[2] + static_cast<std::int64_t>(depth));
            if (p[0] >= grid.lo[0] && p[1] >= grid.lo[1] && p[2] >= grid.lo[2] && p[0] <= grid.hi[0] &&
                p[1] <= grid.hi[1] && p[2] <= grid.hi[2])
                emit(static_cast<int>(p[0]), static_cast<int>(p[1]), static_cast<int>(p[2]));
        }
}

// Calls emit(x, y, z, triangle) for every fragment, triangle by triangle.
template <class Emit>
void voxelize(const mesh_data& mesh, const vp::grid& grid, vp::coverage rule, Emit&& emit) {
    const vp::core::snap_transform snap = vp::core::make_snap_transform(grid);
    const vp::core::voxel_box whole{{{0, 0, 0}}, {{grid.extent.x - 1, grid.extent.y - 1, grid.extent.z - 1}}};
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        vp::core::snapped_position p[3];
        bool drawable = true;
        for (int k = 0; k < 3; ++k) {
            const glm::vec3& v = mesh.positions[mesh.triangles[i][k]];
            p[k] = vp::core::snap(snap, v.x, v.y, v.z);
            drawable = drawable && vp::core::is_drawable(p[k]);
        }
        if (!drawable) continue;
        const auto bounds = vp::core::bounds(p[0], p[1], p[2], snap.fraction);
        const auto keep = [&](int x, int y, int z) { emit(x, y, z, i); };
        const auto run = [&]<class Int>(Int) {
            using vp::core::span_rule;
            if (rule == vp::coverage::thin) {
                const auto t = vp::core::setup_triangle<span_rule::thin, Int>(p[0], p[1], p[2], snap.fraction);
                // Along the dominant axis the fragment may lie beyond the box, so only the columns are cut here.
                thin(t, whole, vp::core::intersect(bounds, whole), keep);
            } else {
                const auto t = vp::core::setup_triangle<span_rule::conservative, Int>(p[0], p[1], p[2], snap.fraction);
                conservative(t, vp::core::intersect(bounds, whole), keep);
            }
        };
        if (vp::core::fits_narrow(p[0], p[1], p[2], snap.fraction))
            run(std::int64_t{});
        else
            run(vp::int128{});
    }
}

// ---- outputs --------------------------------------------------------------------------------------------------------

// Bits, 32 along x to a word, rows padded to words: what a linear target of bits holds.
inline void bits(const mesh_data& mesh, const vp::grid& grid, vp::coverage rule, std::vector<std::uint32_t>& words) {
    const auto row = static_cast<std::size_t>((grid.extent.x + 31) / 32);
    std::fill(words.begin(), words.end(), 0u);
    voxelize(mesh, grid, rule, [&](int x, int y, int z, std::uint32_t) {
        const std::size_t line =
            static_cast<std::size_t>(z) * static_cast<std::size_t>(grid.extent.y) + static_cast<std::size_t>(y);
        words[line * row + static_cast<std::size_t>(x >> 5)] |= 1u << (x & 31);
    });
}

inline std::uint64_t linear(const vp::grid& grid, int x, int y, int z) {
    return (static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(grid.extent.y) + static_cast<std::uint64_t>(y)) *
               static_cast<std::uint64_t>(grid.extent.x) +
           static_cast<std::uint64_t>(x);
}

// Adds 1.0f a fragment.
inline void sums(const mesh_data& mesh, const vp::grid& grid, vp::coverage rule, std::vector<float>& values) {
    std::fill(values.begin(), values.end(), 0.0f);
    voxelize(mesh, grid, rule, [&](int x, int y, int z, std::uint32_t) { values[linear(grid, x, y, z)] += 1.0f; });
}

struct lists {
    std::vector<std::uint64_t> voxels, offsets;
    std::vector<std::uint32_t> primitives;
};

// All fragments, then one stable sort by voxel.
inline lists fragments(const mesh_data& mesh, const vp::grid& grid, vp::coverage rule) {
    struct fragment {
        std::uint64_t voxel;
        std::uint32_t triangle;
    };
    std::vector<fragment> all;
    voxelize(mesh, grid, rule, [&](int x, int y, int z, std::uint32_t t) {
        all.push_back({linear(grid, x, y, z), t});
    });
    std::stable_sort(all.begin(), all.end(), [](const fragment& a, const fragment& b) { return a.voxel < b.voxel; });
    lists out;
    out.primitives.reserve(all.size());
    for (const fragment& f : all) {
        if (out.voxels.empty() || out.voxels.back() != f.voxel) {
            out.voxels.push_back(f.voxel);
            out.offsets.push_back(out.primitives.size());
        }
        out.primitives.push_back(f.triangle);
    }
    if (!out.voxels.empty()) out.offsets.push_back(out.primitives.size());
    return out;
}

// About how many voxels (thin: columns) the loops above test: for skipping what would take minutes.
inline double tests_needed(const mesh_data& mesh, const vp::grid& grid, vp::coverage rule) {
    const vp::core::snap_transform snap = vp::core::make_snap_transform(grid);
    const vp::core::voxel_box whole{{{0, 0, 0}}, {{grid.extent.x - 1, grid.extent.y - 1, grid.extent.z - 1}}};
    double total = 0;
    for (const glm::uvec3& t : mesh.triangles) {
        vp::core::snapped_position p[3];
        bool drawable = true;
        for (int k = 0; k < 3; ++k) {
            const glm::vec3& v = mesh.positions[t[k]];
            p[k] = vp::core::snap(snap, v.x, v.y, v.z);
            drawable = drawable && vp::core::is_drawable(p[k]);
        }
        if (!drawable) continue;
        const auto box = vp::core::intersect(vp::core::bounds(p[0], p[1], p[2], snap.fraction), whole);
        if (box.empty()) continue;
        double n[3];
        for (int a = 0; a < 3; ++a) n[a] = static_cast<double>(box.hi[a] - box.lo[a] + 1);
        total += rule == vp::coverage::thin ? n[0] * n[1] * n[2] / std::min({n[0], n[1], n[2]}) : n[0] * n[1] * n[2];
    }
    return total;
}

} // namespace bench::baseline
