// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Makes the trees of a body's holes (winding_tree.hpp) of the cones of close_holes. On the host.

#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/core/threads.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/core/winding_tree.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// Owns what a winding_view refers to, in host memory.
class winding_tree {
public:
    winding_tree() = default;
    // scale: of the grid in whose units the cones' positions are. Throws std::bad_alloc, or std::length_error for 2^31
    // edges or more.
    winding_tree(const hole_cones& cones, const distance_scale& scale, unsigned threads = 1)
        : scale_(scale), has_all_(cones.cones == cones.holes ? 1 : 0) {
        if (cones.triangles.size() >= std::size_t{1} << 31)
            throw std::length_error("voxelpipe: more edges of holes than nodes can name");
        const std::vector<loop> found = find_loops(cones);
        corners_ = raw_array<snapped_position>(3 * cones.triangles.size());
        const std::vector<loop> loops = in_order(found, cones, threads);
        const auto num_small = static_cast<std::size_t>(
            std::find_if(loops.begin(), loops.end(), [](const loop& l) { return l.is_large(); }) - loops.begin());
        const auto nodes_of = [](std::size_t leaves) { return leaves == 0 ? 0 : 2 * leaves - 1; };
        num_small_ = static_cast<std::uint32_t>(nodes_of(num_small));
        holes_ = raw_array<winding_hole>(num_small_ + nodes_of(loops.size() - num_small));
        std::vector<std::size_t> edges(loops.size() + 1); // nodes of the chains before each loop
        for (std::size_t i = num_small; i < loops.size(); ++i) edges[i + 1] = edges[i] + nodes_of(loops[i].count);
        if (num_small < loops.size()) {
            nodes_ = raw_array<winding_node>(edges.back() + loops.size() - num_small - 1);
            lids_ = raw_array<snapped_position>(3 * nodes_.size());
        }
        add_forest({loops, edges}, {0, num_small, 0, 0}, threads);
        add_forest({loops, edges}, {num_small, loops.size(), num_small_, 0}, threads);
    }

    [[nodiscard]] std::span<const winding_node> nodes() const { return {nodes_.data(), nodes_.size()}; }
    [[nodiscard]] std::span<const snapped_position> lids() const { return {lids_.data(), lids_.size()}; }
    [[nodiscard]] std::span<const winding_hole> holes() const { return {holes_.data(), holes_.size()}; }
    [[nodiscard]] std::span<const snapped_position> corners() const { return {corners_.data(), corners_.size()}; }
    // The same in another memory, which has the arrays' elements.
    [[nodiscard]] winding_view view(const winding_node* nodes, const snapped_position* lids, const winding_hole* holes,
                                    const snapped_position* corners) const {
        return {nodes,      static_cast<std::uint32_t>(nodes_.size()),
                lids,       holes,
                num_small_, static_cast<std::uint32_t>(holes_.size()),
                corners,    static_cast<std::uint32_t>(corners_.size() / 3),
                has_all_,   scale_};
    }
    // Refers to the object.
    [[nodiscard]] winding_view view() const {
        return view(nodes_.data(), lids_.data(), holes_.data(), corners_.data());
    }

private:
    struct point {
        double x[3];
    };
    struct box {
        point low, high;
        void add(const box& b) {
            for (int k = 0; k < 3; ++k) {
                low.x[k] = std::min(low.x[k], b.low.x[k]);
                high.x[k] = std::max(high.x[k], b.high.x[k]);
            }
        }
    };
    // A closed walk along edges of one hole, each once: corners, triangles of its cone.
    struct loop {
        std::uint32_t first, count; // in walk_, then among the triangles of corners_
        winding_hole hole;          // a leaf
        box around;                 // the cone
        [[nodiscard]] bool is_large() const { return count > most_small_edges; }
    };
    struct all_loops {
        const std::vector<loop>& loops;
        const std::vector<std::size_t>& edges; // nodes of the chains of the large loops before each
    };
    // Loops of a subtree, and the numbers of its first nodes. Its first half lies before the other one, so it is known
    // where all nodes are to be.
    struct subtree {
        std::size_t first, last, hole, node;

        [[nodiscard]] std::size_t count() const { return last - first; }
        [[nodiscard]] std::size_t middle() const { return first + count() / 2; }
        [[nodiscard]] subtree lower() const { return {first, middle(), hole + 1, node + 1}; }
        [[nodiscard]] subtree upper(const std::vector<std::size_t>& edges) const {
            const std::size_t before = middle() - first;
            return {middle(), last, hole + 2 * before, node + before + edges[middle()] - edges[first]};
        }
        [[nodiscard]] std::size_t hole_behind() const { return hole + 2 * count() - 1; }
        [[nodiscard]] std::size_t node_behind(const std::vector<std::size_t>& edges) const {
            return node + count() - 1 + edges[last] - edges[first];
        }
    };
    struct boxes {
        box cones, edges;
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
    [[nodiscard]] static double norm(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }
    [[nodiscard]] static double norm(const point& p) { return norm(p.x[0], p.x[1], p.x[2]); }
    // Positions and distances are rounded beside their size, not that of the ball.
    [[nodiscard]] static double widened(double radius, const box& b) {
        double size = 0.0;
        for (int k = 0; k < 3; ++k) size += std::abs(b.low.x[k]) + std::abs(b.high.x[k]);
        return radius * (1.0 + 0x1p-40) + size * 0x1p-48;
    }
    template <class Node>
    static void put_centre(Node& n, const box& b) {
        for (int k = 0; k < 3; ++k) n.centre[k] = 0.5 * (b.low.x[k] + b.high.x[k]);
    }
    // Puts the ball of points at(i), first <= i <= last, around them, of which a few may be far from the others, and
    // returns their box.
    template <class Node, class At>
    box put_ball(Node& n, std::size_t first, std::size_t last, const At& at) const {
        box b{place(at(first)), place(at(first))};
        for (std::size_t i = first; i <= last; ++i) b.add({place(at(i)), place(at(i))});
        put_centre(n, b);
        n.radius = 0.0;
        for (std::size_t i = first; i <= last; ++i) {
            const point q = place(at(i));
            n.radius = std::max(n.radius, norm(q.x[0] - n.centre[0], q.x[1] - n.centre[1], q.x[2] - n.centre[2]));
        }
        n.radius = widened(n.radius, b);
        return b;
    }
    // Puts the ball around those of two others. b: the box around what these have.
    template <class Node>
    static void put_ball(Node& n, const Node& first, const Node& second, const box& b) {
        put_centre(n, b);
        double radius = 0.0;
        for (const Node* m : {&first, &second})
            radius = std::max(radius,
                              norm(m->centre[0] - n.centre[0], m->centre[1] - n.centre[1], m->centre[2] - n.centre[2]) +
                                  m->radius);
        const double across = 0.5 * norm(b.high.x[0] - b.low.x[0], b.high.x[1] - b.low.x[1], b.high.x[2] - b.low.x[2]);
        n.radius = widened(std::min(radius, across), b);
    }

    // The cones' edges as closed walks: as many edges begin at a vertex of a hole as end there. Puts the numbers of
    // their triangles into walk_, loop by loop.
    [[nodiscard]] std::vector<loop> find_loops(const hole_cones& cones) {
        const auto& t = cones.triangles; // edges x -> y with apex z
        // Edges by where they begin; next[v] is the first of v's that is not used.
        std::vector<std::uint32_t> next(cones.positions.size() + 1), order(t.size());
        for (const glm::uvec3& e : t) ++next[e.x + 1];
        for (std::size_t v = 1; v < next.size(); ++v) next[v] += next[v - 1];
        for (std::uint32_t i = 0; i < t.size(); ++i) order[next[t[i].x]++] = i;
        for (std::size_t v = next.size() - 1; v > 0; --v) next[v] = next[v - 1];
        next[0] = 0;
        walk_.reserve(t.size());
        std::vector<loop> loops;
        for (std::size_t begin = 0; begin < order.size(); ++begin) {
            const std::uint32_t start = t[order[begin]].x;
            if (next[start] > begin) continue; // used
            loop l{};
            l.first = static_cast<std::uint32_t>(walk_.size());
            std::uint32_t at = start;
            do {
                walk_.push_back(order[next[at]++]);
                at = t[walk_.back()].y;
            } while (at != start);
            l.count = static_cast<std::uint32_t>(walk_.size()) - l.first;
            loops.push_back(l);
        }
        return loops;
    }

    // The loops along a curve through their middles, the large ones last, with their leaves and corners.
    [[nodiscard]] std::vector<loop> in_order(const std::vector<loop>& found, const hole_cones& cones,
                                             unsigned threads) {
        std::vector<loop> loops(found.size());
        if (found.empty()) return loops;
        // The first corner of each tells where it is.
        const auto corner = [&](const loop& l) -> const snapped_position& {
            return cones.positions[cones.triangles[walk_[l.first]].x];
        };
        snapped_position low = corner(found[0]), high = low;
        for (const loop& l : found) {
            const snapped_position& p = corner(l);
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        int shift = 0; // to 20 bits
        while (std::max({high.x - low.x, high.y - low.y, high.z - low.z}) >> shift >= 1 << 20) ++shift;
        std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(found.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
            const snapped_position& p = corner(found[i]);
            const auto cell = [&](std::int64_t a, std::int64_t least) {
                return static_cast<int>((a - least) >> shift);
            };
            keys[i] = {std::uint64_t{found[i].is_large() ? 1u : 0u} << 63 |
                           morton_key(cell(p.x, low.x), cell(p.y, low.y), cell(p.z, low.z)),
                       static_cast<std::uint32_t>(i)};
        }
        std::sort(keys.begin(), keys.end());
        std::vector<std::uint32_t> first(found.size() + 1);
        for (std::size_t i = 0; i < found.size(); ++i) first[i + 1] = first[i] + found[keys[i].second].count;
        parallel_blocks(threads, found.size(), [&](std::size_t i) {
            loop l = found[keys[i].second];
            make_leaf(l, cones, first[i]);
            loops[i] = l;
        });
        walk_ = {};
        return loops;
    }
    // The loop's triangles are those from `first` on.
    void make_leaf(loop& l, const hole_cones& cones, std::uint32_t first) {
        snapped_position* const to = corners_.data() + 3 * std::size_t{first};
        double area = 0.0;
        point sum{};
        for (std::uint32_t i = 0; i < l.count; ++i) {
            const glm::uvec3& t = cones.triangles[walk_[l.first + i]];
            const snapped_position own[3] = {cones.positions[t.x], cones.positions[t.y], cones.positions[t.z]};
            std::copy(own, own + 3, to + 3 * std::size_t{i});
            const point a = vector_area(own[0], own[1], own[2]);
            area += norm(a);
            for (int k = 0; k < 3; ++k) sum.x[k] += a.x[k];
        }
        l.first = first;
        // The corners of the walk, and the apex.
        l.around = put_ball(l.hole, 0, l.count, [&](std::size_t i) { return i < l.count ? to[3 * i] : to[2]; });
        l.hole.area = area * (1.0 + 0x1p-40);
        for (int k = 0; k < 3; ++k) l.hole.vector_area[k] = sum.x[k];
        l.hole.first = first;
        l.hole.triangles = l.count;
    }

    // Calls f(i) for i below `count`, some of them at once.
    template <class F>
    static void parallel_blocks(unsigned threads, std::size_t count, const F& f) {
        constexpr std::size_t block = 1024;
        parallel_for(threads, (count + block - 1) / block, [&](unsigned, std::size_t b) {
            for (std::size_t i = b * block; i < std::min(count, (b + 1) * block); ++i) f(i);
        });
    }

    // Threads make subtrees, then one makes what is above these.
    void add_forest(const all_loops& all, const subtree& whole, unsigned threads) {
        if (whole.count() == 0) return;
        constexpr std::size_t share = 2048;
        std::vector<subtree> parts, left{whole};
        while (!left.empty()) {
            const subtree t = left.back();
            left.pop_back();
            if (t.count() <= share) {
                parts.push_back(t);
                continue;
            }
            left.push_back(t.upper(all.edges));
            left.push_back(t.lower());
        }
        std::vector<boxes> found(parts.size());
        parallel_for(threads, parts.size(), [&](unsigned, std::size_t i) {
            const boxes* none = nullptr;
            found[i] = add_subtree(all, parts[i], 0, none);
        });
        const boxes* next = found.data();
        (void)add_subtree(all, whole, share, next);
    }
    // Subtrees of up to `share` loops are there; their boxes are the next ones.
    boxes add_subtree(const all_loops& all, const subtree& t, std::size_t share, const boxes*& next) {
        if (t.count() <= share) return *next++;
        const bool is_large = all.loops[t.first].is_large();
        winding_hole& hole = holes_[t.hole];
        if (t.count() == 1) {
            const loop& l = all.loops[t.first];
            hole = l.hole;
            hole.behind = static_cast<std::uint32_t>(t.hole_behind());
            boxes b{l.around, {}};
            if (is_large) {
                b.edges = add_chain(corners_.data() + 3 * std::size_t{l.first}, l.count, 0, l.count, t.node);
                nodes_[t.node].is_closed = 1;
            }
            return b;
        }
        const subtree lower = t.lower(), upper = t.upper(all.edges);
        boxes b = add_subtree(all, lower, share, next);
        const boxes other = add_subtree(all, upper, share, next);
        b.cones.add(other.cones);
        hole = {};
        put_ball(hole, holes_[lower.hole], holes_[upper.hole], b.cones);
        for (const winding_hole* part : {&holes_[lower.hole], &holes_[upper.hole]}) add_up(hole, *part);
        hole.behind = static_cast<std::uint32_t>(t.hole_behind());
        if (!is_large) return b;
        b.edges.add(other.edges);
        winding_node& node = nodes_[t.node];
        node = {};
        put_ball(node, nodes_[lower.node], nodes_[upper.node], b.edges);
        for (const winding_node* part : {&nodes_[lower.node], &nodes_[upper.node]}) {
            add_up(node, *part);
            node.length += part->length;
        }
        node.is_closed = 1;
        node.behind = static_cast<std::uint32_t>(t.node_behind(all.edges));
        return b;
    }
    template <class Node>
    static void add_up(Node& n, const Node& part) {
        n.area += part.area;
        for (int k = 0; k < 3; ++k) n.vector_area[k] += part.vector_area[k];
    }
    // Makes node `at` of a chain from corner `first` to `last`, and those within it. triangles: three corners each, of
    // the loop's cone; the first is on the walk.
    box add_chain(const snapped_position* triangles, std::size_t count, std::size_t first, std::size_t last,
                  std::size_t at) {
        const auto corner = [&](std::size_t i) -> const snapped_position& { return triangles[3 * (i % count)]; };
        winding_node n{};
        const box around = put_ball(n, first, last, corner);
        snapped_position own[3] = {};
        if (last - first > 1) {
            const std::size_t middle = first + (last - first) / 2;
            own[0] = corner(first);
            own[1] = corner(middle);
            own[2] = corner(last);
            const point lid = vector_area(own[0], own[1], own[2]);
            n.has_lid = norm(lid) > 0.0 ? 1 : 0;
            n.area = norm(lid) * (1.0 + 0x1p-40);
            for (int k = 0; k < 3; ++k) n.vector_area[k] = lid.x[k];
            const std::size_t halves[2] = {at + 1, at + 2 * (middle - first)};
            (void)add_chain(triangles, count, first, middle, halves[0]);
            (void)add_chain(triangles, count, middle, last, halves[1]);
            for (const std::size_t half : halves) {
                add_up(n, nodes_[half]);
                n.length += nodes_[half].length;
            }
        } else {
            const point a = place(corner(first)), b = place(corner(last));
            n.length = norm(b.x[0] - a.x[0], b.x[1] - a.x[1], b.x[2] - a.x[2]) * (1.0 + 0x1p-40) +
                       0x1p-48 * (norm(a) + norm(b));
        }
        n.behind = static_cast<std::uint32_t>(at + 2 * (last - first) - 1);
        nodes_[at] = n;
        std::copy(own, own + 3, lids_.data() + 3 * at);
        return around;
    }

    distance_scale scale_{};
    std::uint32_t has_all_ = 1, num_small_ = 0;
    std::vector<std::uint32_t> walk_; // while it is made
    raw_array<winding_node> nodes_;
    raw_array<winding_hole> holes_;
    raw_array<snapped_position> lids_, corners_;
};

} // namespace voxelpipe::core
