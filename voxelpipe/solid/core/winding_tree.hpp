// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding: whether the generalized winding number of a sample is at least 1/2 (docs/design.md, "Solids"). It is
// k, the winding number of the mesh with the cones of close_holes, less the cones' solid angles over 4 pi, whose sum is
// one of integers. A tree over the cones' triangles bounds what far ones can add, so that few samples need the sum. The
// bounds only save work: a verdict that they allow is that of the sum.

#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/core/solid_angle.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelpipe::core {

// Triangles next to each other in the tree's order, within a ball; world units.
struct winding_node {
    double centre[3];
    double radius;
    double area;               // sum of the triangles' areas, rounded up
    double vector_area[3];     // sum of half the crosses of their edges
    std::uint32_t first, last; // triangles, the last one not included
    std::uint32_t behind;      // number of the node behind those that lie within this one; a leaf's is the next
};

// The cones of a body, in a backend's memory. Not owned.
struct winding_view {
    const winding_node* nodes = nullptr; // the first one has all triangles; within a node, its two halves
    std::uint32_t num_nodes = 0;
    const snapped_position* corners = nullptr; // three a triangle
    std::uint32_t num_triangles = 0;
    distance_scale scale{};
};

struct world_point {
    double x[3];
};
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE world_point to_world(const winding_view& t, const snapped_position& p) {
    return {{exact::mul(t.scale.length[0], static_cast<double>(p.x)),
             exact::mul(t.scale.length[1], static_cast<double>(p.y)),
             exact::mul(t.scale.length[2], static_cast<double>(p.z))}};
}

inline constexpr double four_pi = 4.0 * pi_as_double;
// More than what roundings of the bounds can amount to, as winding numbers.
[[nodiscard]] VOXELPIPE_HD constexpr double winding_margin(std::uint32_t num_triangles) {
    return 0x1p-20 + 0x1p-40 * num_triangles;
}

// The vector from a node's centre to a point's, and its length.
struct node_offset {
    double d[3], length;
};
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE node_offset offset_of(const winding_node& n, const world_point& p) {
    node_offset o{};
    for (int k = 0; k < 3; ++k) o.d[k] = n.centre[k] - p.x[k];
    o.length = exact::sqrt(o.d[0] * o.d[0] + o.d[1] * o.d[1] + o.d[2] * o.d[2]);
    return o;
}

// True if the sum of the solid angles' magnitudes stays below half of 4 pi at all points of a ball: there the verdict
// is that of k. A triangle at a distance d covers at most its area / d^2. `reach`: the ball's radius, world units.
[[nodiscard]] VOXELPIPE_HD inline bool is_decided_by_crossings(const winding_view& t, const world_point& centre,
                                                               double reach) {
    const double limit = (0.5 - winding_margin(t.num_triangles)) * four_pi;
    double sum = 0.0;
    for (std::uint32_t i = 0; i < t.num_nodes;) {
        const winding_node& n = t.nodes[i];
        const double gap = offset_of(n, centre).length - n.radius - reach;
        const bool is_leaf = n.behind == i + 1;
        const double most = gap > 0.0 ? n.area / (gap * gap) : 4.0 * limit;
        if (!is_leaf && most > 0.02 * limit) {
            ++i;
            continue;
        }
        sum += most;
        if (!(sum < limit)) return false;
        i = n.behind;
    }
    return true;
}

// The sum over the triangles from `first` to `last`, in units of 2^-bits. Sets `is_on` if the sample lies on one.
[[nodiscard]] VOXELPIPE_HD inline std::int64_t sum_angles(const winding_view& t, const snapped_position& p, int bits,
                                                          std::uint32_t first, std::uint32_t last, bool& is_on) {
    std::int64_t sum = 0;
    // The narrow form is for samples of a grid; every one of these has a narrow triangle with all of its corners there.
    const bool is_sample = is_narrow_in_grid(p, p, p) && p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= 0x1008000 &&
                           p.y <= 0x1008000 && p.z <= 0x1008000;
    for (std::uint32_t i = first; i < last; ++i) {
        const snapped_position* const c = t.corners + 3 * std::size_t{i};
        const seen_angle seen =
            find_angle(see_corners(c[0], c[1], c[2], p, is_sample && is_narrow_in_grid(c[0], c[1], c[2])), t.scale);
        is_on = is_on || seen.is_on;
        sum += angle_units(seen.half, bits);
    }
    return sum;
}

// True if k - sum / 2^bits is inside: at least 1/2, or with fill_rule::nonzero its magnitude.
[[nodiscard]] VOXELPIPE_HD inline bool is_inside_by_sum(fill_rule rule, std::int64_t k, std::int64_t sum, int bits) {
    const std::int64_t whole = k - (sum >> bits), part = sum & ((std::int64_t{1} << bits) - 1); // whole - part / 2^bits
    const std::int64_t half = std::int64_t{1} << (bits - 1);
    if (whole >= 2) return true;
    if (whole == 1) return part <= half;
    if (rule != fill_rule::nonzero) return false;
    return whole == 0 ? part >= half : true; // at most -1/2
}

// The verdict of a sample whose winding number, with the cones, is k.
[[nodiscard]] VOXELPIPE_HD inline bool is_inside_by_winding(const winding_view& t, const snapped_position& p,
                                                            std::int64_t k, fill_rule rule) {
    if (t.num_triangles == 0) return is_inside(rule, k);
    const world_point at = to_world(t, p);
    const int bits = angle_bits(t.num_triangles);
    // Near nodes are opened down to their triangles, which are summed; of far ones, at a distance d of more than
    // `ratio` radii R, the solid angle is vector area . (c - p) / d^3, to within area * 2 R / (d - R)^3: the gradient
    // of (y - p) / |y - p|^3 has norm 2 / |y - p|^3.
    for (double ratio = 2.0; ratio < 1000.0; ratio *= 4.0) {
        double far = 0.0, error = 0.0;
        std::int64_t near = 0;
        bool is_on = false;
        for (std::uint32_t i = 0; i < t.num_nodes;) {
            const winding_node& n = t.nodes[i];
            const node_offset o = offset_of(n, at);
            if (o.length > ratio * n.radius && o.length > 0.0) {
                const double cube = o.length * o.length * o.length, gap = o.length - n.radius;
                far += (n.vector_area[0] * o.d[0] + n.vector_area[1] * o.d[1] + n.vector_area[2] * o.d[2]) / cube;
                error += 2.0 * n.area * n.radius / (gap * gap * gap);
                i = n.behind;
            } else if (n.behind == i + 1) {
                near += sum_angles(t, p, bits, n.first, n.last, is_on);
                i = n.behind;
            } else {
                ++i;
            }
        }
        if (is_on) return is_inside(rule, k);
        const double w = static_cast<double>(k) -
                         static_cast<double>(near) / static_cast<double>(std::int64_t{1} << bits) - far / four_pi;
        const double size = rule == fill_rule::nonzero && w < 0.0 ? -w : w,
                     doubt = error / four_pi + winding_margin(t.num_triangles);
        if (size > 0.5 + doubt) return true;
        if (size < 0.5 - doubt) return false;
    }
    bool is_on = false;
    const std::int64_t sum = sum_angles(t, p, bits, 0, t.num_triangles, is_on);
    return is_on ? is_inside(rule, k) : is_inside_by_sum(rule, k, sum, bits);
}

// ---- on the host ----------------------------------------------------------------------------------------------------

// The tree of a body's cones, in host memory.
class winding_tree {
public:
    winding_tree() = default;
    // scale: of the grid in whose units the cones' positions are. Throws std::bad_alloc.
    winding_tree(const hole_cones& cones, const distance_scale& scale) : scale_(scale) {
        std::vector<item> items;
        items.reserve(cones.triangles.size());
        for (const glm::uvec3& t : cones.triangles)
            items.push_back(make_item(cones.positions[t.x], cones.positions[t.y], cones.positions[t.z]));
        nodes_.reserve(items.size());
        if (!items.empty()) add(items, 0, items.size());
        corners_.reserve(3 * items.size());
        for (const item& i : items) corners_.insert(corners_.end(), i.p, i.p + 3);
    }

    [[nodiscard]] const std::vector<winding_node>& nodes() const { return nodes_; }
    [[nodiscard]] const std::vector<snapped_position>& corners() const { return corners_; }
    // The same in another memory, which has the arrays' elements.
    [[nodiscard]] winding_view view(const winding_node* nodes, const snapped_position* corners) const {
        return {nodes, static_cast<std::uint32_t>(nodes_.size()), corners,
                static_cast<std::uint32_t>(corners_.size() / 3), scale_};
    }
    // Refers to the object.
    [[nodiscard]] winding_view view() const { return view(nodes_.data(), corners_.data()); }

private:
    static constexpr std::size_t leaf_triangles = 4;
    struct item {
        snapped_position p[3];
        double vertex[3][3]; // world units
        double middle[3];    // of the bounding box
        double area;
        double vector_area[3];
    };

    [[nodiscard]] item make_item(const snapped_position& a, const snapped_position& b,
                                 const snapped_position& c) const {
        item i{{a, b, c}, {}, {}, 0.0, {}};
        for (int v = 0; v < 3; ++v) {
            const std::int64_t q[3] = {i.p[v].x, i.p[v].y, i.p[v].z};
            for (int k = 0; k < 3; ++k) i.vertex[v][k] = scale_.length[k] * static_cast<double>(q[k]);
        }
        const std::int64_t e[2][3] = {{b.x - a.x, b.y - a.y, b.z - a.z}, {c.x - a.x, c.y - a.y, c.z - a.z}};
        for (int k = 0; k < 3; ++k) {
            const int u = (k + 1) % 3, w = (k + 2) % 3;
            const int128 cross = static_cast<int128>(e[0][u]) * e[1][w] - static_cast<int128>(e[0][w]) * e[1][u];
            i.vector_area[k] = 0.5 * scale_.area[k] * exact::to_double(cross);
            i.middle[k] = 0.5 * (std::min({i.vertex[0][k], i.vertex[1][k], i.vertex[2][k]}) +
                                 std::max({i.vertex[0][k], i.vertex[1][k], i.vertex[2][k]}));
        }
        i.area = std::hypot(i.vector_area[0], i.vector_area[1], i.vector_area[2]) * (1.0 + 0x1p-40);
        return i;
    }

    // Appends the node of the items from `first` to `last`, and those within it.
    void add(std::vector<item>& items, std::size_t first, std::size_t last) {
        const std::size_t at = nodes_.size();
        nodes_.push_back({});
        winding_node n{};
        double low[3], high[3];
        for (int k = 0; k < 3; ++k) {
            low[k] = high[k] = items[first].vertex[0][k];
            for (std::size_t i = first; i < last; ++i)
                for (const auto& v : items[i].vertex) {
                    low[k] = std::min(low[k], v[k]);
                    high[k] = std::max(high[k], v[k]);
                }
            n.centre[k] = 0.5 * (low[k] + high[k]);
        }
        for (std::size_t i = first; i < last; ++i) {
            for (const auto& v : items[i].vertex)
                n.radius = std::max(n.radius, std::hypot(v[0] - n.centre[0], v[1] - n.centre[1], v[2] - n.centre[2]));
            n.area += items[i].area;
            for (int k = 0; k < 3; ++k) n.vector_area[k] += items[i].vector_area[k];
        }
        // Positions are rounded beside their size, not that of the ball.
        double size = 0.0;
        for (int k = 0; k < 3; ++k) size += std::abs(low[k]) + std::abs(high[k]);
        n.radius = n.radius * (1.0 + 0x1p-40) + size * 0x1p-48;
        n.first = static_cast<std::uint32_t>(first);
        n.last = static_cast<std::uint32_t>(last);
        if (last - first > leaf_triangles) {
            int axis = 0;
            for (int k = 1; k < 3; ++k)
                if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
            const std::size_t middle = first + (last - first) / 2;
            const auto begin = items.begin();
            std::nth_element(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(middle),
                             begin + static_cast<std::ptrdiff_t>(last),
                             [axis](const item& a, const item& b) { return a.middle[axis] < b.middle[axis]; });
            add(items, first, middle);
            add(items, middle, last);
        }
        n.behind = static_cast<std::uint32_t>(nodes_.size());
        nodes_[at] = n;
    }

    distance_scale scale_{};
    std::vector<winding_node> nodes_;
    std::vector<snapped_position> corners_;
};

} // namespace voxelpipe::core
