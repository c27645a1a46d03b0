// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Makes the tree of a body's holes (winding_tree.hpp) of the cones of close_holes. On the host.

#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/core/winding_tree.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace voxelpipe::core {

// Owns what a winding_view refers to, in host memory.
class winding_tree {
public:
    winding_tree() = default;
    // scale: of the grid in whose units the cones' positions are. Throws std::bad_alloc.
    winding_tree(const hole_cones& cones, const distance_scale& scale)
        : scale_(scale), has_all_(cones.cones == cones.holes ? 1 : 0) {
        corners_.reserve(3 * cones.triangles.size());
        for (const glm::uvec3& t : cones.triangles)
            corners_.insert(corners_.end(), {cones.positions[t.x], cones.positions[t.y], cones.positions[t.z]});
        std::vector<loop> loops = find_loops(cones);
        if (loops.empty()) return;
        nodes_.reserve(2 * corners_.size() / 3);
        lids_.reserve(2 * corners_.size());
        std::vector<std::size_t> order(loops.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        add_loops(loops, order, 0, order.size());
        add_holes(loops, order, 0, order.size());
    }

    [[nodiscard]] const std::vector<winding_node>& nodes() const { return nodes_; }
    [[nodiscard]] const std::vector<snapped_position>& lids() const { return lids_; }
    [[nodiscard]] const std::vector<winding_node>& holes() const { return holes_; }
    [[nodiscard]] const std::vector<snapped_position>& corners() const { return corners_; }
    // The same in another memory, which has the arrays' elements.
    [[nodiscard]] winding_view view(const winding_node* nodes, const snapped_position* lids, const winding_node* holes,
                                    const snapped_position* corners) const {
        return {nodes,
                static_cast<std::uint32_t>(nodes_.size()),
                lids,
                holes,
                static_cast<std::uint32_t>(holes_.size()),
                corners,
                static_cast<std::uint32_t>(corners_.size() / 3),
                has_all_,
                scale_};
    }
    // Refers to the object.
    [[nodiscard]] winding_view view() const {
        return view(nodes_.data(), lids_.data(), holes_.data(), corners_.data());
    }

private:
    struct point {
        double x[3];
    };
    // A closed walk along edges of one hole, each once.
    struct loop {
        std::vector<snapped_position> corners; // the first one again at the end
        point middle;
        winding_node edges, cone; // their balls; the area is the cone's
    };

    [[nodiscard]] point place(const snapped_position& p) const {
        return {{scale_.length[0] * static_cast<double>(p.x), scale_.length[1] * static_cast<double>(p.y),
                 scale_.length[2] * static_cast<double>(p.z)}};
    }
    // Half the cross of a triangle's edges.
    [[nodiscard]] point vector_area(const snapped_position& a, const snapped_position& b,
                                    const snapped_position& c) const {
        const std::int64_t e1[3] = {b.x - a.x, b.y - a.y, b.z - a.z}, e2[3] = {c.x - a.x, c.y - a.y, c.z - a.z};
        point r{};
        for (int k = 0; k < 3; ++k) {
            const int u = (k + 1) % 3, w = (k + 2) % 3;
            r.x[k] = 0.5 * scale_.area[k] *
                     exact::to_double(static_cast<int128>(e1[u]) * e2[w] - static_cast<int128>(e1[w]) * e2[u]);
        }
        return r;
    }
    [[nodiscard]] static double norm(const point& p) { return std::hypot(p.x[0], p.x[1], p.x[2]); }
    // Puts the ball of points around them, of which a few may be far from the others.
    void put_ball(winding_node& n, const snapped_position* first, const snapped_position* last) const {
        point low = place(*first), high = low;
        for (const snapped_position* p = first; p != last; ++p) {
            const point q = place(*p);
            for (int k = 0; k < 3; ++k) {
                low.x[k] = std::min(low.x[k], q.x[k]);
                high.x[k] = std::max(high.x[k], q.x[k]);
            }
        }
        double size = 0.0;
        for (int k = 0; k < 3; ++k) {
            n.centre[k] = 0.5 * (low.x[k] + high.x[k]);
            size += std::abs(low.x[k]) + std::abs(high.x[k]);
        }
        n.radius = 0.0;
        for (const snapped_position* p = first; p != last; ++p) {
            const point q = place(*p);
            n.radius = std::max(n.radius, norm({{q.x[0] - n.centre[0], q.x[1] - n.centre[1], q.x[2] - n.centre[2]}}));
        }
        // Positions are rounded beside their size, not that of the ball.
        n.radius = n.radius * (1.0 + 0x1p-40) + size * 0x1p-48;
    }

    // The cones' edges as closed walks: as many edges begin at a vertex of a hole as end there.
    [[nodiscard]] std::vector<loop> find_loops(const hole_cones& cones) const {
        std::vector<std::uint32_t> order(cones.triangles.size()); // edges x -> y by apex z and x
        std::iota(order.begin(), order.end(), 0u);
        const auto& t = cones.triangles;
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return t[a].z != t[b].z ? t[a].z < t[b].z : t[a].x != t[b].x ? t[a].x < t[b].x : t[a].y < t[b].y;
        });
        std::vector<bool> is_used(order.size());
        std::vector<loop> loops;
        std::vector<snapped_position> all;
        for (std::size_t begin = 0; begin < order.size(); ++begin) {
            if (is_used[begin]) continue;
            loop l{};
            const std::uint32_t apex = t[order[begin]].z;
            double area = 0.0;
            std::size_t at = begin;
            do {
                is_used[at] = true;
                const glm::uvec3& edge = t[order[at]];
                const snapped_position &a = cones.positions[edge.x], &b = cones.positions[edge.y];
                l.corners.push_back(a);
                area += norm(vector_area(a, b, cones.positions[apex]));
                if (edge.y == t[order[begin]].x) break;
                auto next = std::lower_bound(order.begin(), order.end(), edge.y, [&](std::uint32_t i, std::uint32_t v) {
                    return t[i].z != apex ? t[i].z < apex : t[i].x < v;
                });
                while (is_used[static_cast<std::size_t>(next - order.begin())]) ++next;
                at = static_cast<std::size_t>(next - order.begin());
            } while (true);
            all = l.corners;
            all.push_back(cones.positions[apex]);
            put_ball(l.cone, all.data(), all.data() + all.size());
            l.cone.area = area * (1.0 + 0x1p-40);
            put_ball(l.edges, l.corners.data(), l.corners.data() + l.corners.size());
            l.corners.push_back(l.corners.front());
            for (int k = 0; k < 3; ++k) l.middle.x[k] = l.cone.centre[k];
            loops.push_back(std::move(l));
        }
        return loops;
    }

    // Appends the node of a chain from corner `first` to `last`, and those within it.
    void add_chain(const std::vector<snapped_position>& corners, std::size_t first, std::size_t last) {
        const std::size_t at = nodes_.size();
        nodes_.emplace_back();
        lids_.insert(lids_.end(), 3, snapped_position{});
        winding_node n{};
        put_ball(n, corners.data() + first, corners.data() + last + 1);
        if (last - first > 1) {
            const std::size_t middle = first + (last - first) / 2;
            const snapped_position &a = corners[first], &b = corners[middle], &c = corners[last];
            const point lid = vector_area(a, b, c);
            n.has_lid = norm(lid) > 0.0 ? 1 : 0;
            n.area = norm(lid) * (1.0 + 0x1p-40);
            for (int k = 0; k < 3; ++k) n.vector_area[k] = lid.x[k];
            const snapped_position own[3] = {a, b, c};
            std::copy(own, own + 3, lids_.begin() + static_cast<std::ptrdiff_t>(3 * at));
            for (const auto& [from, to] : {std::pair{first, middle}, std::pair{middle, last}}) {
                const std::size_t child = nodes_.size();
                add_chain(corners, from, to);
                add_up(n, nodes_[child]);
            }
        } else {
            const point a = place(corners[first]), b = place(corners[last]);
            n.length = norm({{b.x[0] - a.x[0], b.x[1] - a.x[1], b.x[2] - a.x[2]}}) * (1.0 + 0x1p-40) +
                       0x1p-48 * (norm(a) + norm(b));
        }
        n.behind = static_cast<std::uint32_t>(nodes_.size());
        nodes_[at] = n;
    }
    static void add_up(winding_node& n, const winding_node& child) {
        n.area += child.area;
        n.length += child.length;
        for (int k = 0; k < 3; ++k) n.vector_area[k] += child.vector_area[k];
    }
    // Puts the ball around those of loops, each of which ball(loop) gives.
    template <class Ball>
    static void put_ball(winding_node& n, const std::vector<loop>& loops, const std::vector<std::size_t>& order,
                         std::size_t first, std::size_t last, const Ball& ball) {
        double size = 0.0;
        for (int k = 0; k < 3; ++k) {
            double low = ball(loops[order[first]]).centre[k], high = low;
            for (std::size_t i = first; i < last; ++i) {
                const winding_node& b = ball(loops[order[i]]);
                low = std::min(low, b.centre[k] - b.radius);
                high = std::max(high, b.centre[k] + b.radius);
            }
            n.centre[k] = 0.5 * (low + high);
            size += std::abs(low) + std::abs(high);
        }
        for (std::size_t i = first; i < last; ++i) {
            const winding_node& b = ball(loops[order[i]]);
            const double distance =
                std::hypot(b.centre[0] - n.centre[0], b.centre[1] - n.centre[1], b.centre[2] - n.centre[2]);
            n.radius = std::max(n.radius, distance + b.radius);
        }
        n.radius = n.radius * (1.0 + 0x1p-40) + size * 0x1p-48;
    }

    // Sorts loops so that the first half lies before the other one, along the axis on which they are most apart.
    static std::size_t halve(const std::vector<loop>& loops, std::vector<std::size_t>& order, std::size_t first,
                             std::size_t last) {
        point low = loops[order[first]].middle, high = low;
        for (std::size_t i = first; i < last; ++i)
            for (int k = 0; k < 3; ++k) {
                low.x[k] = std::min(low.x[k], loops[order[i]].middle.x[k]);
                high.x[k] = std::max(high.x[k], loops[order[i]].middle.x[k]);
            }
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (high.x[k] - low.x[k] > high.x[axis] - low.x[axis]) axis = k;
        const std::size_t middle = first + (last - first) / 2;
        const auto begin = order.begin();
        std::nth_element(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(middle),
                         begin + static_cast<std::ptrdiff_t>(last), [&](std::size_t a, std::size_t b) {
                             const double x = loops[a].middle.x[axis], y = loops[b].middle.x[axis];
                             return x != y ? x < y : a < b;
                         });
        return middle;
    }
    void add_loops(const std::vector<loop>& loops, std::vector<std::size_t>& order, std::size_t first,
                   std::size_t last) {
        if (last - first == 1) {
            const auto& corners = loops[order[first]].corners;
            const std::size_t at = nodes_.size();
            add_chain(corners, 0, corners.size() - 1);
            nodes_[at].is_closed = 1;
            return;
        }
        const std::size_t at = nodes_.size(), middle = halve(loops, order, first, last);
        nodes_.emplace_back();
        lids_.insert(lids_.end(), 3, snapped_position{});
        add_loops(loops, order, first, middle);
        const std::size_t second = nodes_.size();
        add_loops(loops, order, middle, last);
        winding_node n{};
        put_ball(n, loops, order, first, last, [](const loop& l) -> const winding_node& { return l.edges; });
        add_up(n, nodes_[at + 1]);
        add_up(n, nodes_[second]);
        n.is_closed = 1;
        n.behind = static_cast<std::uint32_t>(nodes_.size());
        nodes_[at] = n;
    }
    void add_holes(const std::vector<loop>& loops, std::vector<std::size_t>& order, std::size_t first,
                   std::size_t last) {
        const std::size_t at = holes_.size();
        if (last - first == 1) {
            holes_.push_back(loops[order[first]].cone);
            holes_[at].behind = static_cast<std::uint32_t>(at + 1);
            return;
        }
        const std::size_t middle = halve(loops, order, first, last);
        holes_.emplace_back();
        add_holes(loops, order, first, middle);
        const std::size_t second = holes_.size();
        add_holes(loops, order, middle, last);
        winding_node n{};
        put_ball(n, loops, order, first, last, [](const loop& l) -> const winding_node& { return l.cone; });
        n.area = holes_[at + 1].area + holes_[second].area;
        n.behind = static_cast<std::uint32_t>(holes_.size());
        holes_[at] = n;
    }

    distance_scale scale_{};
    std::uint32_t has_all_ = 1;
    std::vector<winding_node> nodes_, holes_;
    std::vector<snapped_position> lids_, corners_;
};

} // namespace voxelpipe::core
