// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The triangles of a distance call in a tree of boxes, eight children a node. Lengths are in units of the largest voxel
// size. The tree only rejects: its boxes are rounded outwards, and what it keeps is decided by exact numbers.

#include <cpu_ref/pipeline.hpp>
#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/distance/core/point_triangle.hpp>
#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/triangle_counts.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace voxelpipe::cpu {

inline constexpr int lanes = 8;

// Eight boxes or points side by side, for loops that compilers turn into vector instructions.
using lane_floats = std::array<float, lanes>;

struct vector3 {
    double x, y, z;
};

// A triangle in units, by the order of the tree.
struct placed_triangle {
    std::array<vector3, 3> vertex;
    std::uint32_t primitive; // as the call draws them
    bool narrow;             // has the narrow form for all samples of the call
};

class triangle_tree {
public:
    // Eight children: nodes of the level below, or on level 0 runs of eight triangles.
    struct node {
        std::array<lane_floats, 3> low, high;
    };

    // Takes the triangles that are drawn. `reach`: voxels of the grid whose samples they may concern; others count as
    // outside. `most`: as is_narrow.
    triangle_tree(const execution& how, const geometry& s, const core::voxel_box& reach,
                  const core::triple<std::int64_t>& most, const vector3& scale) {
        how.enter(stage::coarse_raster);
        const stopwatch watch(how.times, &stage_times::coarse_raster);
        scale_ = scale;
        if (take(how, s, reach, most)) build(how);
    }

    [[nodiscard]] status_code code() const { return code_; }
    [[nodiscard]] const counters& counts() const { return counts_; }
    [[nodiscard]] bool empty() const { return triangles_.empty(); }
    [[nodiscard]] std::size_t size() const { return triangles_.size(); }
    [[nodiscard]] const placed_triangle& operator[](std::size_t i) const { return triangles_[i]; }

    // Calls leaf(first, last) for the runs of triangles whose box lies within `bound()` of the point; nearer boxes
    // first. bound() may fall meanwhile.
    template <class Bound, class Leaf>
    void visit(const vector3& at, const Bound& bound, const Leaf& leaf) const {
        if (levels_.empty()) return;
        const float x = static_cast<float>(at.x), y = static_cast<float>(at.y), z = static_cast<float>(at.z);
        // Rounding of the point is 2^-24 of a coordinate, of each difference 2^-24 of it: a distance is too large by at
        // most 2^-21 of itself and 2^-22 of the point's coordinates.
        const float slack = 0x1p-20f * (std::abs(x) + std::abs(y) + std::abs(z));
        visit_node(levels_.size() - 1, 0, {x, y, z}, slack, bound, leaf);
    }

    // Calls leaf(first, last) for the runs whose box meets the row along x that begins at the point and goes down.
    // Coordinates are rounded outwards, so none is missed.
    template <class Leaf>
    void visit_below(const vector3& at, const Leaf& leaf) const {
        if (levels_.empty()) return;
        visit_row(levels_.size() - 1, 0, at, leaf);
    }

private:
    bool take(const execution& how, const geometry& s, const core::voxel_box& reach,
              const core::triple<std::int64_t>& most) {
        constexpr std::size_t block = 8192;
        const std::size_t n = s.first_primitive.back();
        const std::size_t blocks = (n + block - 1) / block;
        struct block_result {
            status_code code = status_code::ok;
            counters counts{};
            std::vector<placed_triangle> kept;
        };
        std::vector<block_result> parts(blocks);
        parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
            block_result& part = parts[b];
            const std::size_t last = std::min(n, (b + 1) * block);
            part.kept.reserve(last - b * block);
            for (std::size_t i = b * block; i < last; ++i) {
                const auto id = static_cast<std::uint32_t>(i);
                const auto tri = s.find(id);
                const geometry::part& in = s.parts[tri.draw];
                if (tri.index.x >= in.num_vertices || tri.index.y >= in.num_vertices ||
                    tri.index.z >= in.num_vertices) {
                    part.code = status_code::index_out_of_range;
                    return;
                }
                const core::snapped_position &p = in.positions[tri.index.x], &q = in.positions[tri.index.y],
                                             &r = in.positions[tri.index.z];
                core::triangle_class kind = core::classify_positions(p, q, r);
                if (kind == core::triangle_class::drawn &&
                    core::intersect(core::bounds(p, q, r, s.snap.fraction), reach).empty())
                    kind = core::triangle_class::outside;
                core::count_class(part.counts, kind);
                if (kind == core::triangle_class::drawn)
                    part.kept.push_back({{place(p), place(q), place(r)}, id, core::is_narrow(p, q, r, most)});
            }
        });
        std::size_t kept = 0;
        for (const block_result& part : parts) {
            if (part.code != status_code::ok) {
                code_ = part.code;
                return false;
            }
            core::add_triangles(counts_, part.counts);
            kept += part.kept.size();
        }
        counts_.triangles_in = n;
        triangles_.reserve(kept);
        for (block_result& part : parts) {
            triangles_.insert(triangles_.end(), part.kept.begin(), part.kept.end());
            part.kept = {};
        }
        return true;
    }

    [[nodiscard]] vector3 place(const core::snapped_position& p) const {
        return {static_cast<double>(p.x) * scale_.x, static_cast<double>(p.y) * scale_.y,
                static_cast<double>(p.z) * scale_.z};
    }

    // Sorts the triangles by the Morton code of their centres and puts boxes over runs of eight.
    void build(const execution& how) {
        if (triangles_.empty()) return;
        vector3 low{0, 0, 0}, high{0, 0, 0};
        const auto centre = [](const placed_triangle& t) {
            const auto middle = [](double a, double b, double c) {
                return 0.5 * (std::min({a, b, c}) + std::max({a, b, c}));
            };
            const auto& v = t.vertex;
            return vector3{middle(v[0].x, v[1].x, v[2].x), middle(v[0].y, v[1].y, v[2].y),
                           middle(v[0].z, v[1].z, v[2].z)};
        };
        low = high = centre(triangles_[0]);
        for (const placed_triangle& t : triangles_) {
            const vector3 c = centre(t);
            low = {std::min(low.x, c.x), std::min(low.y, c.y), std::min(low.z, c.z)};
            high = {std::max(high.x, c.x), std::max(high.y, c.y), std::max(high.z, c.z)};
        }
        const double side = std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-300});
        const double cells = 2047.0 / side;
        struct item {
            std::uint64_t key;
            std::uint32_t at;
        };
        raw_array<item> order(triangles_.size());
        const auto cell = [&](double at, double from) { return static_cast<int>((at - from) * cells); };
        for (std::size_t i = 0; i < triangles_.size(); ++i) {
            const vector3 c = centre(triangles_[i]);
            order[i] = {core::morton_key(cell(c.x, low.x), cell(c.y, low.y), cell(c.z, low.z)),
                        static_cast<std::uint32_t>(i)};
        }
        radix_sort(how.threads, order, 33);
        std::vector<placed_triangle> sorted(triangles_.size());
        for (std::size_t i = 0; i < sorted.size(); ++i) sorted[i] = triangles_[order[i].at];
        triangles_ = std::move(sorted);

        std::size_t runs = (triangles_.size() + lanes - 1) / lanes;
        std::vector<std::array<float, 6>> boxes(runs);
        parallel_for(how.threads, (runs + 1023) / 1024, [&](unsigned, std::size_t b) {
            for (std::size_t r = b * 1024; r < std::min(runs, (b + 1) * 1024); ++r) boxes[r] = box_of_run(r);
        });
        do {
            const std::size_t nodes = (boxes.size() + lanes - 1) / lanes;
            std::vector<node> level(nodes);
            std::vector<std::array<float, 6>> joined(nodes);
            for (std::size_t i = 0; i < nodes; ++i) {
                std::array<float, 6> all = empty_box();
                for (std::size_t k = 0; k < lanes; ++k) {
                    const std::size_t child = i * lanes + k;
                    const std::array<float, 6> box = child < boxes.size() ? boxes[child] : empty_box();
                    for (std::size_t a = 0; a < 3; ++a) {
                        level[i].low[a][k] = box[a];
                        level[i].high[a][k] = box[a + 3];
                        all[a] = std::min(all[a], box[a]);
                        all[a + 3] = std::max(all[a + 3], box[a + 3]);
                    }
                }
                joined[i] = all;
            }
            levels_.push_back(std::move(level));
            boxes = std::move(joined);
        } while (boxes.size() > 1);
    }
    [[nodiscard]] static std::array<float, 6> empty_box() {
        constexpr float inf = std::numeric_limits<float>::infinity();
        return {inf, inf, inf, -inf, -inf, -inf};
    }
    [[nodiscard]] std::array<float, 6> box_of_run(std::size_t run) const {
        vector3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
        const std::size_t last = std::min(triangles_.size(), (run + 1) * lanes);
        for (std::size_t i = run * lanes; i < last; ++i)
            for (const vector3& v : triangles_[i].vertex) {
                low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
                high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
            }
        const auto down = [](double a) {
            return static_cast<float>(a - std::abs(a) * 0x1p-22) - std::numeric_limits<float>::min();
        };
        return {down(low.x), down(low.y), down(low.z), -down(-high.x), -down(-high.y), -down(-high.z)};
    }

    template <class Bound, class Leaf>
    void visit_node(std::size_t level, std::size_t index, const std::array<float, 3>& p, float slack,
                    const Bound& bound, const Leaf& leaf) const {
        const node& n = levels_[level][index];
        lane_floats square{};
        for (std::size_t k = 0; k < lanes; ++k) {
            const float x = std::max(std::max(n.low[0][k] - p[0], p[0] - n.high[0][k]), 0.0f);
            const float y = std::max(std::max(n.low[1][k] - p[1], p[1] - n.high[1][k]), 0.0f);
            const float z = std::max(std::max(n.low[2][k] - p[2], p[2] - n.high[2][k]), 0.0f);
            square[k] = x * x + y * y + z * z;
        }
        const auto is_near = [&](float sq) {
            const float most = (bound() + slack) * (1.0f + 0x1p-19f);
            return sq <= std::numeric_limits<float>::max() && sq <= most * most * (1.0f + 0x1p-20f);
        };
        // The nearest child first, then the others in their order of distance.
        std::array<std::uint8_t, lanes> order{};
        std::size_t count = 0;
        for (std::size_t k = 0; k < lanes; ++k) {
            if (!is_near(square[k])) continue;
            std::size_t at = count++;
            for (; at > 0 && square[order[at - 1]] > square[k]; --at) order[at] = order[at - 1];
            order[at] = static_cast<std::uint8_t>(k);
        }
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t k = order[i];
            if (!is_near(square[k])) return;
            const std::size_t child = index * lanes + k;
            if (level > 0)
                visit_node(level - 1, child, p, slack, bound, leaf);
            else
                leaf(child * lanes, std::min(triangles_.size(), (child + 1) * lanes));
        }
    }

    template <class Leaf>
    void visit_row(std::size_t level, std::size_t index, const vector3& p, const Leaf& leaf) const {
        const node& n = levels_[level][index];
        for (std::size_t k = 0; k < lanes; ++k) {
            const bool meets = static_cast<double>(n.low[1][k]) <= p.y && p.y <= static_cast<double>(n.high[1][k]) &&
                               static_cast<double>(n.low[2][k]) <= p.z && p.z <= static_cast<double>(n.high[2][k]) &&
                               static_cast<double>(n.low[0][k]) <= p.x;
            if (!meets) continue;
            const std::size_t child = index * lanes + k;
            if (level > 0)
                visit_row(level - 1, child, p, leaf);
            else
                leaf(child * lanes, std::min(triangles_.size(), (child + 1) * lanes));
        }
    }

    status_code code_ = status_code::ok;
    counters counts_{};
    vector3 scale_{};
    std::vector<placed_triangle> triangles_;
    std::vector<std::vector<node>> levels_; // from the runs up
};

} // namespace voxelpipe::cpu
