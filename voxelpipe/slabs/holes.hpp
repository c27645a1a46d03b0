// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::close_holes for a mesh that does not fit into memory: its triangles come one by one, its directed edges are
// cancelled in bins, on disk beyond a budget, and only those of the holes' boundaries are held. The cones go to the
// call of each slab (solid_options::cones). Needs POSIX files.

#include <voxelpipe/core/holes.hpp>
#include <voxelpipe/slabs/bins.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// The holes of one body. Members throw std::bad_alloc, and std::system_error of files.
class hole_finder {
public:
    // num_triangles: that come, about. budget: bytes that may be held beside the edges of the holes. folder: for
    // temporary files.
    hole_finder(std::uint64_t num_triangles, std::uint64_t budget, std::string folder)
        : bins_(bins_for(num_triangles, budget)), memory_(budget / 2, bins_.size(), std::move(folder)),
          block_(static_cast<std::size_t>(std::clamp<std::uint64_t>(budget / 8 / sizeof(edge), 64, 65536))) {}

    // A triangle, snapped in the whole grid, corners as they are drawn. One that cannot be drawn is left out.
    void add(const core::snapped_position& a, const core::snapped_position& b, const core::snapped_position& c) {
        if (!core::is_drawable(a) || !core::is_drawable(b) || !core::is_drawable(c)) return;
        add_edge(a, b);
        add_edge(b, c);
        add_edge(c, a);
        if (fresh_.size() >= block_) sort_out();
    }

    // The cones of all triangles that came, for solid_options::cones: those of core::close_holes. Throws
    // std::length_error, too, as that does. Nothing is added later.
    [[nodiscard]] core::hole_cones finish(std::uint64_t max_hole_edges) {
        sort_out();
        std::vector<core::edge_chain::edge> boundary;
        std::vector<core::snapped_position> ends; // two an edge
        std::vector<edge> of_bin;
        for (bin<edge>& b : bins_) {
            of_bin.clear();
            of_bin.reserve(static_cast<std::size_t>(b.size()));
            b.for_each_block(
                [&](std::span<const edge> block) { of_bin.insert(of_bin.end(), block.begin(), block.end()); });
            b = {};
            cancel(of_bin);
            for (const edge& e : of_bin) {
                const std::uint64_t low = ends.size(), high = low + 1;
                ends.insert(ends.end(), {e.low, e.high});
                for (std::int64_t i = e.sum; i > 0; --i) boundary.push_back({low, high});
                for (std::int64_t i = e.sum; i < 0; ++i) boundary.push_back({high, low});
            }
        }
        of_bin = {};
        return core::close_boundary(
            boundary, [&](std::uint64_t v) { return ends[static_cast<std::size_t>(v)]; }, max_hole_edges);
    }

private:
    // The directed edges between two positions.
    struct edge {
        core::snapped_position low, high; // in the order of place()
        std::int64_t sum;                 // edges from low to high minus edges from high to low
    };
    [[nodiscard]] static auto place(const core::snapped_position& p) { return std::tie(p.x, p.y, p.z); }
    [[nodiscard]] static auto place(const edge& e) { return std::tuple_cat(place(e.low), place(e.high)); }

    // Bins that fit a quarter of the budget each, if no edge cancels before.
    [[nodiscard]] static std::size_t bins_for(std::uint64_t num_triangles, std::uint64_t budget) {
        constexpr std::uint64_t most = 1024;
        return static_cast<std::size_t>(std::clamp<std::uint64_t>(
            1 + 12 * num_triangles * sizeof(edge) / std::max<std::uint64_t>(budget, 1), 1, most));
    }
    void add_edge(const core::snapped_position& from, const core::snapped_position& to) {
        if (place(from) < place(to)) fresh_.push_back({from, to, 1});
        if (place(to) < place(from)) fresh_.push_back({to, from, -1});
    }
    // Equal edges become one, and those whose sum is 0 none.
    static void cancel(std::vector<edge>& edges) {
        std::sort(edges.begin(), edges.end(), [](const edge& a, const edge& b) { return place(a) < place(b); });
        std::size_t kept = 0;
        for (std::size_t i = 0; i < edges.size();) {
            edge all = edges[i++];
            for (; i < edges.size() && place(edges[i]) == place(all); ++i) all.sum += edges[i].sum;
            if (all.sum != 0) edges[kept++] = all;
        }
        edges.resize(kept);
    }
    // Most edges cancel between neighbours, which come one after the other; the others go to the bins.
    void sort_out() {
        cancel(fresh_);
        for (const edge& e : fresh_) memory_.push(bins_, bin_of(e), e);
        fresh_.clear();
    }
    [[nodiscard]] std::size_t bin_of(const edge& e) const {
        std::uint64_t h = 0;
        for (const std::int64_t c : {e.low.x, e.low.y, e.low.z, e.high.x, e.high.y, e.high.z})
            h = (h ^ static_cast<std::uint64_t>(c)) * 0x9e3779b97f4a7c15u, h ^= h >> 29;
        return static_cast<std::size_t>(h % bins_.size());
    }

    std::vector<bin<edge>> bins_;
    bin_memory<edge> memory_;
    std::size_t block_;
    std::vector<edge> fresh_;
};

} // namespace voxelpipe::slabs
