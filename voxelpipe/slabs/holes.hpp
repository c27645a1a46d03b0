// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::close_holes for a mesh that does not fit into memory: its triangles come one by one, its directed edges are
// cancelled in bins, on disk beyond a budget, and only those of the holes' boundaries are held. The cones go to the
// call of each slab (solid_options::cones). Needs POSIX files.

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/solid/core/holes.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// The holes of one body. Members throw std::bad_alloc, and std::system_error of files.
class hole_finder {
public:
    // The directed edges between two positions.
    struct edge {
        core::snapped_position low, high; // ordered by x, then y, then z
        std::int64_t sum;                 // edges from low to high minus edges from high to low
    };

    // What edges are ordered by.
    [[nodiscard]] static auto place(const core::snapped_position& p) { return std::tie(p.x, p.y, p.z); }
    [[nodiscard]] static auto place(const edge& e) { return std::tuple_cat(place(e.low), place(e.high)); }

    // num_triangles: that come, about; 0: not known. budget: bytes that may be held beside the edges of the holes.
    // folder: for temporary files.
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

    // The edges that are left of all triangles that came, each once. Nothing is added later.
    [[nodiscard]] std::vector<edge> take_edges() {
        sort_out();
        std::vector<edge> left, of_bin;
        for (bin<edge>& b : bins_) {
            of_bin.clear();
            of_bin.reserve(static_cast<std::size_t>(b.size()));
            b.for_each_block(
                [&](std::span<const edge> block) { of_bin.insert(of_bin.end(), block.begin(), block.end()); });
            b = {};
            cancel(of_bin);
            left.insert(left.end(), of_bin.begin(), of_bin.end());
        }
        return left;
    }
    // The cones of all triangles that came, for solid_options::cones: those of core::close_holes. Throws
    // std::length_error, too, as that does. Nothing is added later.
    [[nodiscard]] core::hole_cones finish(std::uint64_t max_hole_edges) { return close(take_edges(), max_hole_edges); }

    // One edge; none from a position to itself.
    [[nodiscard]] static std::optional<edge> edge_between(const core::snapped_position& from,
                                                          const core::snapped_position& to) {
        if (place(from) < place(to)) return edge{from, to, 1};
        if (place(to) < place(from)) return edge{to, from, -1};
        return std::nullopt;
    }
    // Equal edges become one, and those whose sum is 0 none: edges of several finders may be joined.
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
    // The cones over edges that are left, each of which is there once.
    [[nodiscard]] static core::hole_cones close(const std::vector<edge>& left, std::uint64_t max_hole_edges) {
        std::vector<core::edge_chain::edge> boundary;
        for (std::size_t i = 0; i < left.size(); ++i) {
            const std::uint64_t low = 2 * i, high = low + 1;
            for (std::int64_t n = left[i].sum; n > 0; --n) boundary.push_back({low, high});
            for (std::int64_t n = left[i].sum; n < 0; ++n) boundary.push_back({high, low});
        }
        const auto position = [&](std::uint64_t v) {
            const edge& e = left[static_cast<std::size_t>(v / 2)];
            return v % 2 == 0 ? e.low : e.high;
        };
        return core::close_boundary(core::weld_edges(boundary, position), max_hole_edges);
    }

private:
    // Bins that fit a quarter of the budget each, if no edge cancels before. Each may have an open file.
    [[nodiscard]] static std::size_t bins_for(std::uint64_t num_triangles, std::uint64_t budget) {
        constexpr std::uint64_t most = 1024;
        if (num_triangles == 0) return static_cast<std::size_t>(std::clamp<std::uint64_t>(budget >> 16, 16, 256));
        return static_cast<std::size_t>(std::clamp<std::uint64_t>(
            1 + 12 * num_triangles * sizeof(edge) / std::max<std::uint64_t>(budget, 1), 1, most));
    }
    void add_edge(const core::snapped_position& from, const core::snapped_position& to) {
        if (const auto e = edge_between(from, to)) fresh_.push_back(*e);
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
