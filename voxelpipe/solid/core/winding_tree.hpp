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

// Pieces of triangles next to each other in the tree's order, within a ball; world units.
struct winding_node {
    double centre[3];
    double radius;
    double area;           // sum of the pieces' areas, rounded up
    double vector_area[3]; // sum of half the crosses of their edges
    std::uint32_t piece;   // a leaf's
    std::uint32_t behind;  // number of the node behind those that lie within this one; a leaf's is the next
};
// A triangle, or a part of a long one.
struct winding_piece {
    double vertex[3][3]; // world units
    std::uint32_t triangle;
};

// The cones of a body, in a backend's memory. Not owned.
struct winding_view {
    const winding_node* nodes = nullptr; // the first one has all pieces; within a node, its two halves
    std::uint32_t num_nodes = 0;
    const winding_piece* pieces = nullptr;
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
inline constexpr double coarse_bound = 0x1p-9 * four_pi; // for find_whole of many points
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
// The solid angle of a small piece of surface with the node's vector area.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE double vector_angle(const winding_node& n, const node_offset& o) {
    return (n.vector_area[0] * o.d[0] + n.vector_area[1] * o.d[1] + n.vector_area[2] * o.d[2]) /
           (o.length * o.length * o.length);
}

// The verdict of every sample whose winding number, with the cones, is k, and for which the sum S of the cones' angles
// over 4 pi lies between whole - 1/2 and whole + 1/2. It is that of k where whole is 0.
[[nodiscard]] VOXELPIPE_HD constexpr bool is_inside_beyond(fill_rule rule, std::int64_t k, std::int64_t whole) {
    return rule == fill_rule::nonzero ? k != whole : k > whole;
}

// True if the sum of the angles' magnitudes stays below half of 4 pi at all points of a ball, and so does that of S. A
// triangle at a distance d covers at most its area / d^2.
[[nodiscard]] VOXELPIPE_HD inline bool is_below_half(const winding_view& t, const world_point& centre, double reach) {
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

// True if S is between the same two halves at all points of a ball: whole - 1/2 and whole + 1/2. reach: the ball's
// radius, world units. The solid angle of a node's triangles, which lie in a ball of radius R at a distance d, is
// vector area . (c - p) / d^3 at the centre p, and elsewhere to within area * 2 (R + reach) / (d - R - reach)^3: the
// gradient of (y - p) / |y - p|^3 has norm 2 / |y - p|^3. A piece whose ball meets the other one decides nothing.
// `most`: the greatest error of a node that is not opened.
[[nodiscard]] VOXELPIPE_HD inline bool find_whole(const winding_view& t, const world_point& centre, double reach,
                                                  double most, std::int64_t& whole) {
    if (is_below_half(t, centre, reach)) {
        whole = 0;
        return true;
    }
    double sum = 0.0, error = winding_margin(t.num_triangles) * four_pi;
    for (std::uint32_t i = 0; i < t.num_nodes;) {
        const winding_node& n = t.nodes[i];
        const node_offset o = offset_of(n, centre);
        const double gap = o.length - n.radius - reach;
        const bool is_leaf = n.behind == i + 1;
        if (is_leaf && !(gap > 0.0)) return false;
        const double off = 2.0 * n.area * (n.radius + reach) / (gap * gap * gap);
        if (!is_leaf && !(gap > 0.0 && off <= most)) {
            ++i;
            continue;
        }
        sum += vector_angle(n, o);
        error += off;
        if (!(error < 0.5 * four_pi)) return false;
        i = n.behind;
    }
    const double turns = sum / four_pi, nearest = static_cast<double>(exact::round_to_int64(turns));
    whole = static_cast<std::int64_t>(nearest);
    return magnitude_of(turns - nearest) + error / four_pi < 0.5;
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

// The solid angle of a piece as seen from a point, to within a share of 2^-24 of 4 pi; false if roundings may do more,
// as beside edges and where the point is on the piece.
[[nodiscard]] VOXELPIPE_HD inline bool find_piece_angle(const winding_piece& piece, const world_point& p,
                                                        double& angle) {
    double v[3][3], length[3], dot[3];
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) v[i][k] = piece.vertex[i][k] - p.x[k];
        length[i] = exact::sqrt(v[i][0] * v[i][0] + v[i][1] * v[i][1] + v[i][2] * v[i][2]);
    }
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        dot[i] = v[i][0] * v[j][0] + v[i][1] * v[j][1] + v[i][2] * v[j][2];
    }
    const double volume = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
                          v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
                          v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
    const double all = length[0] * length[1] * length[2];
    const double other = all + dot[0] * length[2] + dot[1] * length[0] + dot[2] * length[1];
    // World positions are rounded beside the greatest coordinate.
    const double least = lesser(length[0], lesser(length[1], length[2]));
    double size = 0.0;
    for (int k = 0; k < 3; ++k) size = greater(size, magnitude_of(p.x[k]));
    if (!(least > size * 0x1p-16)) return false;
    if (!(greater(magnitude_of(volume), other) > 0x1p-8 * all)) return false;
    angle = 2.0 * written_atan2(volume, other);
    return true;
}

// What is known of S at a sample modulo 1: between turns - off and turns + off.
struct winding_hint {
    double turns, off; // off of 1/2 or more: nothing is known
};

// The verdict of a sample whose winding number, with the cones, is k. Adds to `work` how many
// triangles and pieces it has measured.
[[nodiscard]] VOXELPIPE_HD inline bool is_inside_by_winding(const winding_view& t, const snapped_position& p,
                                                            std::int64_t k, fill_rule rule, const winding_hint& hint,
                                                            std::uint64_t& work) {
    if (t.num_triangles == 0) return is_inside(rule, k);
    const world_point at = to_world(t, p);
    if (is_below_half(t, at, 0.0)) return is_inside(rule, k);
    const int bits = angle_bits(t.num_triangles);
    // As find_whole, but pieces that are near are measured, as long as that is less work than the sum.
    bool is_known = true;
    std::uint32_t left = t.num_triangles / 2 + 16;
    for (double most = 0x1p-5 * four_pi; is_known && most > 0x1p-22 * four_pi; most *= 0x1p-2) {
        double sum = 0.0, error = winding_margin(t.num_triangles) * four_pi;
        for (std::uint32_t i = 0; is_known && i < t.num_nodes;) {
            const winding_node& n = t.nodes[i];
            const node_offset o = offset_of(n, at);
            const double gap = o.length - n.radius;
            const double off = gap > 0.0 ? 2.0 * n.area * n.radius / (gap * gap * gap) : 2.0 * most;
            if (off <= most) {
                sum += vector_angle(n, o);
                error += off;
                i = n.behind;
                continue;
            }
            ++i;
            if (n.behind != i) continue;
            double angle = 0.0;
            is_known = left != 0 && find_piece_angle(t.pieces[n.piece], at, angle);
            if (is_known) {
                --left;
                ++work;
                sum += angle;
                error += 0x1p-24 * four_pi;
                continue;
            }
            if (left == 0) break;
            bool is_on = false;
            const std::uint32_t triangle = t.pieces[n.piece].triangle;
            (void)sum_angles(t, p, bits, triangle, triangle + 1, is_on);
            if (is_on) return is_inside(rule, k);
        }
        double turns = sum / four_pi, doubt = error / four_pi;
        if (doubt + hint.off < 0.5) { // only one of the numbers that the hint allows is near
            turns = hint.turns + static_cast<double>(exact::round_to_int64(turns - hint.turns));
            doubt = hint.off;
        }
        const double whole = static_cast<double>(exact::round_to_int64(turns));
        if (is_known && magnitude_of(turns - whole) + doubt < 0.5)
            return is_inside_beyond(rule, k, static_cast<std::int64_t>(whole));
    }
    work += t.num_triangles;
    bool is_on = false;
    const std::int64_t sum = sum_angles(t, p, bits, 0, t.num_triangles, is_on);
    return is_on ? is_inside(rule, k) : is_inside_by_sum(rule, k, sum, bits);
}

[[nodiscard]] VOXELPIPE_HD inline bool is_inside_by_winding(const winding_view& t, const snapped_position& p,
                                                            std::int64_t k, fill_rule rule) {
    std::uint64_t work = 0;
    return is_inside_by_winding(t, p, k, rule, winding_hint{0.0, 1.0}, work);
}

// ---- on the host ----------------------------------------------------------------------------------------------------

// The trees of a body's cones, in host memory.
class winding_tree {
public:
    winding_tree() = default;
    // scale: of the grid in whose units the cones' positions are; voxel: its largest voxel size. Throws std::bad_alloc.
    winding_tree(const hole_cones& cones, const distance_scale& scale, double voxel) : scale_(scale) {
        std::vector<item> items;
        items.reserve(cones.triangles.size());
        for (std::size_t i = 0; i < cones.triangles.size(); ++i) {
            const glm::uvec3& t = cones.triangles[i];
            items.push_back(make_item(cones.positions[t.x], cones.positions[t.y], cones.positions[t.z], i));
        }
        rims_.reserve(items.size());
        for (const item& i : items) { // an edge of the boundary, and the apex
            const auto& v = i.piece.vertex;
            rim_edge& e = rims_.emplace_back();
            for (int k = 0; k < 3; ++k) e.middle[k] = 0.5 * (v[0][k] + v[1][k]);
            e.length = length(i, 0);
        }
        items = cut(items, piece_length(items, voxel));
        nodes_.reserve(2 * items.size());
        if (!items.empty()) add(items, 0, items.size());
        pieces_.reserve(items.size());
        for (const item& i : items) pieces_.push_back(i.piece);
        corners_.reserve(3 * cones.triangles.size());
        for (const glm::uvec3& t : cones.triangles)
            corners_.insert(corners_.end(), {cones.positions[t.x], cones.positions[t.y], cones.positions[t.z]});
    }

    [[nodiscard]] const std::vector<winding_node>& nodes() const { return nodes_; }
    [[nodiscard]] const std::vector<winding_piece>& pieces() const { return pieces_; }
    [[nodiscard]] const std::vector<snapped_position>& corners() const { return corners_; }
    // The same in another memory, which has the arrays' elements.
    [[nodiscard]] winding_view view(const winding_node* nodes, const winding_piece* pieces,
                                    const snapped_position* corners) const {
        return {nodes,   static_cast<std::uint32_t>(nodes_.size()),       pieces,
                corners, static_cast<std::uint32_t>(corners_.size() / 3), scale_};
    }
    // Refers to the object.
    [[nodiscard]] winding_view view() const { return view(nodes_.data(), pieces_.data(), corners_.data()); }

    // S modulo 1 in a brick of 8^3 samples, as a linear function of their indices from 0 to 7.
    class linear {
    public:
        linear() = default;
        [[nodiscard]] winding_hint at(int x, int y, int z) const {
            return {turns_ + (x - 3) * slope_[0] + (y - 3) * slope_[1] + (z - 3) * slope_[2], off_};
        }

    private:
        friend winding_tree;
        double turns_ = 0.0, slope_[3] = {0.0, 0.0, 0.0}, off_ = 1.0;
    };
    // first: the brick's lowest sample; step: from sample to sample, sub-voxel units. Beside the cones' rims, S is
    // smooth but for whole steps at the cones: its gradient is that of the line integral of r x dl / r^3 / 4 pi along
    // the rims, at most the sum of length / r^2, and its second derivative at most that of 2 length / r^3. So four
    // sums, at the sample (3, 3, 3) and four samples further along each axis, give S to within 16 times the latter
    // times the square of a voxel's diagonal.
    [[nodiscard]] linear find_linear(const snapped_position& first, std::int64_t step) const {
        const winding_view t = view();
        double diagonal = 0.0, side[3];
        world_point centre = to_world(t, first);
        for (int k = 0; k < 3; ++k) {
            side[k] = scale_.length[k] * static_cast<double>(step);
            centre.x[k] += 3.5 * side[k];
            diagonal += side[k] * side[k];
        }
        const double reach = 3.5 * std::sqrt(diagonal) * (1.0 + 0x1p-20);
        double gradient = 0.0, curve = 0.0;
        for (const rim_edge& e : rims_) {
            const double gap =
                std::hypot(e.middle[0] - centre.x[0], e.middle[1] - centre.x[1], e.middle[2] - centre.x[2]) -
                0.5 * e.length - reach;
            if (!(gap > 0.0)) return {};
            gradient += e.length / (gap * gap);
            curve += 2.0 * e.length / (gap * gap * gap);
        }
        linear found;
        const double off = 16.0 * diagonal * curve / four_pi + winding_margin(t.num_triangles);
        if (!(off < 0.25 && 4.0 * std::sqrt(diagonal) * gradient < 0.25 * four_pi)) return {};
        const int bits = angle_bits(t.num_triangles);
        bool is_on = false;
        const auto sum_at = [&](int x, int y, int z) {
            const std::int64_t sum = sum_angles(t, {first.x + x * step, first.y + y * step, first.z + z * step}, bits,
                                                0, t.num_triangles, is_on);
            // Modulo 1, so that differences are exact.
            return std::ldexp(static_cast<double>(sum & ((std::int64_t{1} << bits) - 1)), -bits);
        };
        found.turns_ = sum_at(3, 3, 3);
        const double ends[3] = {sum_at(7, 3, 3), sum_at(3, 7, 3), sum_at(3, 3, 7)};
        for (int k = 0; k < 3; ++k) {
            const double change = ends[k] - found.turns_;
            found.slope_[k] = 0.25 * (change - std::round(change));
        }
        if (is_on) return {};
        found.off_ = off;
        return found;
    }

private:
    static constexpr double piece_voxels = 4.0;
    static constexpr double most_pieces = 500000.0; // beyond those that long triangles have at any length

    struct rim_edge {
        double middle[3], length;
    };
    // A triangle or a piece of one.
    struct item {
        winding_piece piece;
        double vector_area[3];
        double area;
    };

    [[nodiscard]] item make_item(const snapped_position& a, const snapped_position& b, const snapped_position& c,
                                 std::size_t triangle) const {
        item i{};
        i.piece.triangle = static_cast<std::uint32_t>(triangle);
        const std::int64_t q[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}};
        for (int v = 0; v < 3; ++v)
            for (int k = 0; k < 3; ++k) i.piece.vertex[v][k] = scale_.length[k] * static_cast<double>(q[v][k]);
        for (int k = 0; k < 3; ++k) {
            const int u = (k + 1) % 3, w = (k + 2) % 3;
            const int128 cross = static_cast<int128>(q[1][u] - q[0][u]) * (q[2][w] - q[0][w]) -
                                 static_cast<int128>(q[1][w] - q[0][w]) * (q[2][u] - q[0][u]);
            i.vector_area[k] = 0.5 * scale_.area[k] * exact::to_double(cross);
        }
        i.area = std::hypot(i.vector_area[0], i.vector_area[1], i.vector_area[2]) * (1.0 + 0x1p-40);
        return i;
    }
    // The edge that begins at a vertex.
    [[nodiscard]] static double length(const item& i, int edge) {
        const double *const a = i.piece.vertex[edge], *const b = i.piece.vertex[(edge + 1) % 3];
        return std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    }
    [[nodiscard]] static int longest_edge(const item& i) {
        int e = length(i, 1) > length(i, 0) ? 1 : 0;
        return length(i, 2) > length(i, e) ? 2 : e;
    }

    // The length of pieces: a few voxels, or more where these would be too many.
    [[nodiscard]] static double piece_length(const std::vector<item>& items, double voxel) {
        double wanted = piece_voxels * voxel;
        for (;; wanted *= 2.0) {
            double pieces = 0.0;
            for (const item& i : items) {
                const double longest = length(i, longest_edge(i));
                if (longest > wanted) pieces += 2.0 * longest / wanted + 4.0 * i.area / (wanted * wanted);
            }
            if (!(pieces > most_pieces + 4.0 * static_cast<double>(items.size()))) return wanted;
        }
    }
    // Halves the longest edges of items that are longer.
    [[nodiscard]] static std::vector<item> cut(const std::vector<item>& items, double wanted) {
        std::vector<item> pieces, left;
        for (const item& whole : items) {
            left.assign(1, whole);
            while (!left.empty()) {
                const item i = left.back();
                left.pop_back();
                const int e = longest_edge(i);
                if (!(length(i, e) > wanted)) {
                    pieces.push_back(i);
                    continue;
                }
                for (int half = 0; half < 2; ++half) {
                    item& h = left.emplace_back(i);
                    for (int k = 0; k < 3; ++k) {
                        h.piece.vertex[half == 0 ? e : (e + 1) % 3][k] =
                            0.5 * (i.piece.vertex[e][k] + i.piece.vertex[(e + 1) % 3][k]);
                        h.vector_area[k] *= 0.5;
                    }
                    h.area *= 0.5;
                }
            }
        }
        return pieces;
    }

    // Appends the node of the items from `first` to `last`, and those within it.
    void add(std::vector<item>& items, std::size_t first, std::size_t last) {
        const std::size_t at = nodes_.size();
        nodes_.push_back({});
        winding_node n{};
        double low[3], high[3];
        for (int k = 0; k < 3; ++k) {
            low[k] = high[k] = items[first].piece.vertex[0][k];
            for (std::size_t i = first; i < last; ++i)
                for (const auto& v : items[i].piece.vertex) {
                    low[k] = std::min(low[k], v[k]);
                    high[k] = std::max(high[k], v[k]);
                }
            n.centre[k] = 0.5 * (low[k] + high[k]);
        }
        for (std::size_t i = first; i < last; ++i) {
            for (const auto& v : items[i].piece.vertex)
                n.radius = std::max(n.radius, std::hypot(v[0] - n.centre[0], v[1] - n.centre[1], v[2] - n.centre[2]));
            n.area += items[i].area;
            for (int k = 0; k < 3; ++k) n.vector_area[k] += items[i].vector_area[k];
        }
        // Positions are rounded beside their size, not that of the ball.
        double size = 0.0;
        for (int k = 0; k < 3; ++k) size += std::abs(low[k]) + std::abs(high[k]);
        n.radius = n.radius * (1.0 + 0x1p-40) + size * 0x1p-48;
        n.piece = static_cast<std::uint32_t>(first);
        if (last - first > 1) {
            int axis = 0;
            for (int k = 1; k < 3; ++k)
                if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
            const auto place = [axis](const item& i) {
                return i.piece.vertex[0][axis] + i.piece.vertex[1][axis] + i.piece.vertex[2][axis];
            };
            const std::size_t middle = first + (last - first) / 2;
            const auto begin = items.begin();
            std::nth_element(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(middle),
                             begin + static_cast<std::ptrdiff_t>(last),
                             [&](const item& a, const item& b) { return place(a) < place(b); });
            add(items, first, middle);
            add(items, middle, last);
        }
        n.behind = static_cast<std::uint32_t>(nodes_.size());
        nodes_[at] = n;
    }

    distance_scale scale_{};
    std::vector<winding_node> nodes_;
    std::vector<winding_piece> pieces_;
    std::vector<rim_edge> rims_;
    std::vector<snapped_position> corners_;
};

// The largest side of a voxel.
[[nodiscard]] inline double largest_side(const glm::dvec3& voxel_size) {
    return std::max({voxel_size.x, voxel_size.y, voxel_size.z});
}

} // namespace voxelpipe::core
