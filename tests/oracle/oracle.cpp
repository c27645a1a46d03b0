// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "oracle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>

namespace oracle {
namespace {

template <class Integer>
struct point {
    Integer x, y, z;
};

template <class Integer>
point<Integer> vertex(const snapped_triangle& t, int index) {
    return {Integer(t.v[index][0]), Integer(t.v[index][1]), Integer(t.v[index][2])};
}

template <class Integer>
point<Integer> operator-(const point<Integer>& a, const point<Integer>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class Integer>
Integer dot(const point<Integer>& a, const point<Integer>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class Integer>
point<Integer> cross(const point<Integer>& a, const point<Integer>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class Integer>
Integer magnitude(const Integer& value) {
    return value < Integer(0) ? -value : value;
}

template <class Integer>
struct interval {
    Integer lo, hi;
    void include(const Integer& value) {
        if (value < lo) lo = value;
        if (hi < value) hi = value;
    }
    bool apart(const interval& other) const { return hi < other.lo || other.hi < lo; } // closed: touching is not apart
};

// Box corners reach 2^24 units at most inside a grid (fraction_bits); halving the grid rounds it up to a power of two,
// which is still 2^24. Doubled, half-voxel centres stay below 2^26.
constexpr std::int64_t farthest_corner = std::int64_t{1} << 25;

// The narrowest integers in which no expression of this file can overflow.
// With |vertex| <= M, |normal and edge components| <= N: projections are sums of three products <= N * max(M, 2^25),
// and the depth's numerator is a sum of three products <= 2 N (M + 2^25), its denominator N * 2^17. 64 bits: 6 N (M +
// 2^25) < 2^62. 128 bits: M <= 2^40 gives edges <= 2^41, N <= 2^83, 6 N (M + 2^25) < 2^127.
arithmetic narrowest(const snapped_triangle& t) {
    int128 farthest = 0;
    for (const auto& position : t.v)
        for (const std::int64_t q : position) farthest = std::max(farthest, magnitude(int128{q}));
    if (farthest > farthest_position) return arithmetic::bits256;
    const point<int128> a = vertex<int128>(t, 1) - vertex<int128>(t, 0);
    const point<int128> b = vertex<int128>(t, 2) - vertex<int128>(t, 1);
    const point<int128> c = vertex<int128>(t, 0) - vertex<int128>(t, 2);
    int128 largest = 1;
    for (const point<int128>& p : {a, b, c, cross(a, b)})
        largest = std::max({largest, magnitude(p.x), magnitude(p.y), magnitude(p.z)});
    if (largest < (int128{1} << 62) && 6 * largest * (farthest + farthest_corner) < (int128{1} << 62))
        return arithmetic::bits64;
    return arithmetic::bits128;
}

// Calls decide(Integer{}) with an integer type that is wide enough for the triangle.
template <class Decide>
auto with_integers(const snapped_triangle& t, arithmetic with, Decide decide) {
    const arithmetic needed = narrowest(t);
    if (with == arithmetic::automatic) with = needed;
    if (with < needed) throw std::overflow_error("oracle: the named arithmetic is too narrow for this triangle");
    if (with == arithmetic::bits64) return decide(std::int64_t{});
    if (with == arithmetic::bits128) return decide(int128{});
    return decide(wide{});
}

// The thirteen axes on which two disjoint convex bodies, an axis-aligned box and a triangle, must come apart: the box's
// face normals, the triangle's normal, and each edge of the one crossed with each edge of the other. Where an axis is
// zero (degenerate triangle, parallel edges) everything projects on 0 and the axis separates nothing.
template <class Integer>
class separating_axes {
public:
    explicit separating_axes(const snapped_triangle& t) {
        const point<Integer> v[3] = {vertex<Integer>(t, 0), vertex<Integer>(t, 1), vertex<Integer>(t, 2)};
        const point<Integer> edges[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
        const Integer zero(0), one(1);
        const point<Integer> units[3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
        std::size_t count = 0;
        for (const point<Integer>& unit : units) axes_[count++] = unit;
        axes_[count++] = cross(edges[0], edges[1]);
        for (const point<Integer>& edge : edges)
            for (const point<Integer>& unit : units) axes_[count++] = cross(edge, unit);
        for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
            triangle_[axis] = {dot(axes_[axis], v[0]), dot(axes_[axis], v[0])};
            triangle_[axis].include(dot(axes_[axis], v[1]));
            triangle_[axis].include(dot(axes_[axis], v[2]));
        }
    }

    // Closed box in fixed-point units.
    bool meets(const std::int64_t (&lo)[3], const std::int64_t (&hi)[3]) const {
        for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
            const point<Integer>& a = axes_[axis];
            const Integer x[2] = {a.x * Integer(lo[0]), a.x * Integer(hi[0])};
            const Integer y[2] = {a.y * Integer(lo[1]), a.y * Integer(hi[1])};
            const Integer z[2] = {a.z * Integer(lo[2]), a.z * Integer(hi[2])};
            interval<Integer> box{x[0] + y[0] + z[0], x[0] + y[0] + z[0]};
            for (int corner = 1; corner < 8; ++corner)
                box.include(x[corner & 1] + y[(corner >> 1) & 1] + z[corner >> 2]);
            if (box.apart(triangle_[axis])) return false;
        }
        return true;
    }

private:
    std::array<point<Integer>, 13> axes_;
    std::array<interval<Integer>, 13> triangle_;
};

// The same in the plane: two square axes and the three edge normals of a triangle with area.
template <class Integer>
class separating_axes_2d {
public:
    separating_axes_2d(const snapped_triangle& t, int u, int v) {
        const Integer zero(0), one(1);
        axes_[0] = {one, zero};
        axes_[1] = {zero, one};
        for (int vertex = 0; vertex < 3; ++vertex) {
            const std::int64_t* from = t.v[vertex];
            const std::int64_t* to = t.v[(vertex + 1) % 3];
            axes_[static_cast<std::size_t>(vertex) + 2] = {Integer(from[v]) - Integer(to[v]),
                                                           Integer(to[u]) - Integer(from[u])};
        }
        for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
            for (int vertex = 0; vertex < 3; ++vertex) {
                const Integer at = axes_[axis].u * Integer(t.v[vertex][u]) + axes_[axis].v * Integer(t.v[vertex][v]);
                if (vertex == 0) triangle_[axis] = {at, at};
                triangle_[axis].include(at);
            }
        }
    }

    // Closed rectangle in fixed-point units.
    bool meets(std::int64_t lo_u, std::int64_t lo_v, std::int64_t hi_u, std::int64_t hi_v) const {
        for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
            const Integer u[2] = {axes_[axis].u * Integer(lo_u), axes_[axis].u * Integer(hi_u)};
            const Integer v[2] = {axes_[axis].v * Integer(lo_v), axes_[axis].v * Integer(hi_v)};
            interval<Integer> square{u[0] + v[0], u[0] + v[0]};
            for (int corner = 1; corner < 4; ++corner) square.include(u[corner & 1] + v[corner >> 1]);
            if (square.apart(triangle_[axis])) return false;
        }
        return true;
    }

private:
    struct axis_2d {
        Integer u, v;
    };
    std::array<axis_2d, 5> axes_;
    std::array<interval<Integer>, 5> triangle_;
};

// Halves a cube of 2^level voxels that meets the triangle until single voxels remain; closed children cover their
// closed parent, so nothing is lost.
template <class Integer>
void descend(const region& part, int fraction, const separating_axes<Integer>& axes, int i, int j, int k, int level,
             std::vector<voxel>& out) {
    const int width = 1 << level;
    if (i >= part.hi[0] || j >= part.hi[1] || k >= part.hi[2]) return;
    if (i + width <= part.lo[0] || j + width <= part.lo[1] || k + width <= part.lo[2]) return;
    const std::int64_t size = std::int64_t{1} << (level + fraction);
    const std::int64_t lo[3] = {std::int64_t{i} << fraction, std::int64_t{j} << fraction, std::int64_t{k} << fraction};
    const std::int64_t hi[3] = {lo[0] + size, lo[1] + size, lo[2] + size};
    if (!axes.meets(lo, hi)) return;
    if (level == 0) {
        out.push_back({i, j, k});
        return;
    }
    const int half = 1 << (level - 1);
    for (int child = 0; child < 8; ++child)
        descend(part, fraction, axes, i + (child & 1) * half, j + ((child >> 1) & 1) * half, k + (child >> 2) * half,
                level - 1, out);
}

struct column {
    int u, v;
};

template <class Integer>
void descend_2d(const int (&lo)[2], const int (&hi)[2], int fraction, const separating_axes_2d<Integer>& axes,
                column at, int level, std::vector<column>& out) {
    const int width = 1 << level;
    if (at.u >= hi[0] || at.v >= hi[1] || at.u + width <= lo[0] || at.v + width <= lo[1]) return;
    const std::int64_t size = std::int64_t{1} << (level + fraction);
    const std::int64_t u = std::int64_t{at.u} << fraction;
    const std::int64_t v = std::int64_t{at.v} << fraction;
    if (!axes.meets(u, v, u + size, v + size)) return;
    if (level == 0) {
        out.push_back(at);
        return;
    }
    const int half = 1 << (level - 1);
    for (int child = 0; child < 4; ++child)
        descend_2d(lo, hi, fraction, axes, {at.u + (child & 1) * half, at.v + (child >> 1) * half}, level - 1, out);
}

int ceil_log2(int value) {
    int log2 = 0;
    while ((std::int64_t{1} << log2) < value) ++log2;
    return log2;
}

region whole(const grid& g) { return {{0, 0, 0}, {g.extent[0], g.extent[1], g.extent[2]}}; }

int largest_extent(const grid& g) { return std::max({g.extent[0], g.extent[1], g.extent[2]}); }

template <class Integer>
struct fraction_of {
    Integer numerator, denominator;
};

// Depth in voxels over the centre of column (cu, cv), from n . (2 p - 2 v0) = 0 with everything doubled, so that the
// centre is an integer even where F = 0.
template <class Integer>
fraction_of<Integer> depth_over(const snapped_triangle& t, int fraction, int axis, int cu, int cv) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    const point<Integer> v0 = vertex<Integer>(t, 0);
    const point<Integer> n = cross(vertex<Integer>(t, 1) - v0, vertex<Integer>(t, 2) - v0);
    const Integer components[3] = {n.x, n.y, n.z};
    const Integer two(2);
    const Integer du = Integer((2 * std::int64_t{cu} + 1) << fraction) - two * Integer(t.v[0][u]);
    const Integer dv = Integer((2 * std::int64_t{cv} + 1) << fraction) - two * Integer(t.v[0][v]);
    return {components[axis] * (two * Integer(t.v[0][axis])) - components[u] * du - components[v] * dv,
            components[axis] * Integer(std::int64_t{1} << (fraction + 1))};
}

template <class Integer>
Integer floor_divide(const Integer& numerator, const Integer& denominator) {
    const Integer quotient = numerator / denominator; // towards zero
    const bool exact = quotient * denominator == numerator;
    const bool negative = (numerator < 0) != (denominator < 0);
    return !exact && negative ? quotient - 1 : quotient;
}

wide floor_divide(const wide& numerator, const wide& denominator) { return wide::floor_divide(numerator, denominator); }

// The floor as an index, or -1 where it is outside [0, extent).
template <class Integer>
int floor_inside(const fraction_of<Integer>& value, int extent) {
    const Integer floor = floor_divide(value.numerator, value.denominator);
    if (floor < Integer(0) || !(floor < Integer(extent))) return -1;
    if constexpr (std::is_same_v<Integer, wide>)
        return static_cast<int>(floor.to_int64());
    else
        return static_cast<int>(floor);
}

// Round half to even; |x| <= 2^40, so floor and the difference are exact.
std::int64_t round_half_even(double x) {
    const double below = std::floor(x);
    const double rest = x - below;
    const auto whole = static_cast<std::int64_t>(below);
    if (rest < 0.5) return whole;
    if (rest > 0.5) return whole + 1;
    return whole % 2 == 0 ? whole : whole + 1;
}

template <class Float>
Float nearest(const ratio& value) {
    if (value.numerator.sign() == 0) return Float{0};
    constexpr int digits = std::numeric_limits<Float>::digits;
    // Scale to a quotient with two or three bits more than the significand; what the division leaves is sticky.
    const int shift = digits + 2 - (value.numerator.bit_width() - value.denominator.bit_width());
    const wide numerator = shift > 0 ? value.numerator.shifted_left(shift) : value.numerator;
    const wide denominator = shift < 0 ? value.denominator.shifted_left(-shift) : value.denominator;
    const wide::division parts = wide::divide_magnitudes(numerator, denominator);
    auto significand = static_cast<std::uint64_t>(parts.quotient.to_int64());
    const int dropped = parts.quotient.bit_width() - digits;
    const std::uint64_t rest = significand & ((std::uint64_t{1} << dropped) - 1);
    const std::uint64_t half = std::uint64_t{1} << (dropped - 1);
    significand >>= dropped;
    const bool sticky = parts.remainder.sign() != 0;
    if (rest > half || (rest == half && (sticky || significand % 2 == 1))) ++significand;
    const double magnitude = std::ldexp(static_cast<double>(significand), dropped - shift); // exact
    if (magnitude > static_cast<double>(std::numeric_limits<Float>::max()) ||
        magnitude < static_cast<double>(std::numeric_limits<Float>::min()))
        throw std::overflow_error("oracle: ratio outside the normal numbers");
    const bool negative = value.numerator.sign() * value.denominator.sign() < 0;
    return static_cast<Float>(negative ? -magnitude : magnitude);
}

} // namespace

int fraction_bits(const grid& g) {
    for (const int extent : g.extent)
        if (extent < 1 || extent > (1 << 24)) throw std::invalid_argument("oracle: extent outside 1 to 2^24");
    return std::min(16, 24 - ceil_log2(largest_extent(g)));
}

snapped_triangle snap(const grid& g, const float v[3][3]) {
    snapped_triangle result{};
    const int fraction = fraction_bits(g);
    for (int vertex = 0; vertex < 3; ++vertex) {
        for (int axis = 0; axis < 3; ++axis) {
            const double scale = std::ldexp(1.0, fraction) / g.voxel_size[axis];
            const double offset = static_cast<double>(v[vertex][axis]) - g.origin[axis];
            const double scaled = offset * scale;
            if (!(std::fabs(scaled) <= static_cast<double>(farthest_position))) { // also NaN
                result = {};
                result.dropped = true;
                return result;
            }
            result.v[vertex][axis] = round_half_even(scaled);
        }
    }
    return result;
}

bool box_meets_triangle(int fraction_bits, const snapped_triangle& t, const std::array<int, 3>& lo,
                        const std::array<int, 3>& hi, arithmetic with) {
    std::int64_t from[3], to[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
        from[axis] = std::int64_t{lo[axis]} << fraction_bits;
        to[axis] = std::int64_t{hi[axis]} << fraction_bits;
        if (std::max(std::abs(from[axis]), std::abs(to[axis])) > farthest_corner) with = arithmetic::bits256;
    }
    return with_integers(t, with, [&]<class Integer>(Integer) { return separating_axes<Integer>(t).meets(from, to); });
}

bool covers_conservative(const grid& g, const snapped_triangle& t, int i, int j, int k, arithmetic with) {
    return box_meets_triangle(fraction_bits(g), t, {i, j, k}, {i + 1, j + 1, k + 1}, with);
}

std::vector<voxel> conservative(const grid& g, const snapped_triangle& t, arithmetic with) {
    return conservative(g, t, whole(g), with);
}

std::vector<voxel> conservative(const grid& g, const snapped_triangle& t, const region& part, arithmetic with) {
    std::vector<voxel> result;
    if (t.dropped) return result;
    const int fraction = fraction_bits(g);
    with_integers(t, with, [&]<class Integer>(Integer) {
        descend(part, fraction, separating_axes<Integer>(t), 0, 0, 0, ceil_log2(largest_extent(g)), result);
    });
    std::sort(result.begin(), result.end());
    return result;
}

std::array<wide, 3> normal(const snapped_triangle& t) {
    const point<wide> v0 = vertex<wide>(t, 0);
    const point<wide> n = cross(vertex<wide>(t, 1) - v0, vertex<wide>(t, 2) - v0);
    return {n.x, n.y, n.z};
}

int dominant_axis(const snapped_triangle& t) {
    return with_integers(t, arithmetic::automatic, [&]<class Integer>(Integer) {
        const point<Integer> v0 = vertex<Integer>(t, 0);
        const point<Integer> n = cross(vertex<Integer>(t, 1) - v0, vertex<Integer>(t, 2) - v0);
        const Integer x = magnitude(n.x), y = magnitude(n.y), z = magnitude(n.z);
        if (x == Integer(0) && y == Integer(0) && z == Integer(0)) return -1;
        if (x >= y && x >= z) return 0;
        return y >= z ? 1 : 2;
    });
}

std::vector<voxel> thin(const grid& g, const snapped_triangle& t, arithmetic with) {
    return thin(g, t, whole(g), with);
}

std::vector<voxel> thin(const grid& g, const snapped_triangle& t, const region& part, arithmetic with) {
    std::vector<voxel> result;
    if (t.dropped) return result;
    const int axis = dominant_axis(t);
    if (axis < 0) return result;
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    const int fraction = fraction_bits(g);
    with_integers(t, with, [&]<class Integer>(Integer) {
        std::vector<column> columns;
        const int lo[2] = {part.lo[u], part.lo[v]};
        const int hi[2] = {part.hi[u], part.hi[v]};
        descend_2d(lo, hi, fraction, separating_axes_2d<Integer>(t, u, v), {0, 0}, ceil_log2(std::max(hi[0], hi[1])),
                   columns);
        for (const column& at : columns) {
            const int w = floor_inside(depth_over<Integer>(t, fraction, axis, at.u, at.v), g.extent[axis]);
            if (w < part.lo[axis] || w >= part.hi[axis]) continue;
            int index[3];
            index[u] = at.u;
            index[v] = at.v;
            index[axis] = w;
            result.push_back({index[0], index[1], index[2]});
        }
    });
    std::sort(result.begin(), result.end());
    return result;
}

namespace {

// A segment meets a triangle that is not parallel to it iff its ends lie on different sides of the plane, or on it, and
// its line passes all edges on the same side. Everything doubled, so that centres are integers.
template <class Integer>
bool meets_an_arm(const snapped_triangle& t, int fraction, const voxel& at, std::span<const std::array<int, 3>> arms) {
    const Integer two(2), zero(0);
    const point<Integer> v0 = vertex<Integer>(t, 0);
    const point<Integer> n = cross(vertex<Integer>(t, 1) - v0, vertex<Integer>(t, 2) - v0);
    const point<Integer> centre{Integer((2 * std::int64_t{at.i} + 1) << fraction),
                                Integer((2 * std::int64_t{at.j} + 1) << fraction),
                                Integer((2 * std::int64_t{at.k} + 1) << fraction)};
    const auto doubled = [&](int k) {
        const point<Integer> p = vertex<Integer>(t, k % 3);
        return point<Integer>{two * p.x, two * p.y, two * p.z} - centre;
    };
    const auto dot = [](const point<Integer>& a, const point<Integer>& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    for (const auto& direction : arms) {
        const point<Integer> s{Integer(direction[0]), Integer(direction[1]), Integer(direction[2])};
        const Integer slope = dot(n, s), height = dot(n, doubled(0)), size(std::int64_t{1} << fraction);
        if (slope == zero) continue;
        int above = 0, below = 0;
        for (const Integer& end : {zero - size, size}) {
            const Integer side = end * slope - height;
            above += zero < side ? 1 : 0;
            below += side < zero ? 1 : 0;
        }
        if (above == 2 || below == 2) continue;
        bool left = false, right = false;
        for (int k = 0; k < 3; ++k) {
            const Integer side = dot(s, cross(doubled(k), doubled(k + 1)));
            left = left || zero < side;
            right = right || side < zero;
        }
        if (!left || !right) return true;
    }
    return false;
}

std::vector<voxel> by_arms(const grid& g, const snapped_triangle& t, const region& part, arithmetic with,
                           std::span<const std::array<int, 3>> arms) {
    std::vector<voxel> result;
    for (const voxel& at : conservative(g, t, part, with)) // which holds every point of an arm
        if (with_integers(t, with,
                          [&]<class Integer>(Integer) { return meets_an_arm<Integer>(t, fraction_bits(g), at, arms); }))
            result.push_back(at);
    return result;
}

} // namespace

std::vector<voxel> crosshair(const grid& g, const snapped_triangle& t, const region& part, arithmetic with) {
    static constexpr std::array<int, 3> arms[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    return by_arms(g, t, part, with, arms);
}

std::vector<voxel> diagonal(const grid& g, const snapped_triangle& t, const region& part, arithmetic with) {
    static constexpr std::array<int, 3> arms[] = {{1, 1, 1}, {-1, 1, 1}, {1, -1, 1}, {1, 1, -1}};
    return by_arms(g, t, part, with, arms);
}

std::array<ratio, 3> barycentrics(const grid& g, const snapped_triangle& t, const voxel& at) {
    const int axis = dominant_axis(t);
    if (axis < 0) throw std::invalid_argument("oracle: barycentrics of a triangle without area");
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    const int index[3] = {at.i, at.j, at.k};
    const int fraction = fraction_bits(g);
    // Everything doubled, so that the centre is an integer.
    const wide centre[2] = {wide((2 * std::int64_t{index[u]} + 1) << fraction),
                            wide((2 * std::int64_t{index[v]} + 1) << fraction)};
    const auto corner = [&](int vertex, int component) {
        return wide(2) * wide(t.v[vertex % 3][component == 0 ? u : v]);
    };
    const wide area = (corner(1, 0) - corner(0, 0)) * (corner(2, 1) - corner(0, 1)) -
                      (corner(1, 1) - corner(0, 1)) * (corner(2, 0) - corner(0, 0));
    std::array<ratio, 3> result;
    for (int vertex = 0; vertex < 3; ++vertex) { // twice the area of (centre, next vertex, the one after)
        const wide opposite = (corner(vertex + 1, 0) - centre[0]) * (corner(vertex + 2, 1) - centre[1]) -
                              (corner(vertex + 1, 1) - centre[1]) * (corner(vertex + 2, 0) - centre[0]);
        result[static_cast<std::size_t>(vertex)] = {opposite, area};
    }
    return result;
}

ratio depth(const grid& g, const snapped_triangle& t, const voxel& at) {
    const int axis = dominant_axis(t);
    if (axis < 0) throw std::invalid_argument("oracle: depth of a triangle without area");
    const int index[3] = {at.i, at.j, at.k};
    const auto exact = depth_over<wide>(t, fraction_bits(g), axis, index[(axis + 1) % 3], index[(axis + 2) % 3]);
    return {exact.numerator, exact.denominator};
}

float nearest_float(const ratio& value) { return nearest<float>(value); }
double nearest_double(const ratio& value) { return nearest<double>(value); }

} // namespace oracle
