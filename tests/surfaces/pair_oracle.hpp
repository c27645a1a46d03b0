// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Whether the insides of two triangles meet, in exact rationals, by another way than the library's: where the planes
// differ, the two intervals on their common line; in one plane, the corners of what the triangles share. Products that
// do not fit 128 bits throw.

#include <voxelpipe/surfaces/core/place_vertex.hpp>
#include <voxelpipe/surfaces/surface.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

namespace surface_tests {

namespace vp = voxelpipe;

__extension__ using wide = __int128;
using wide_vector = std::array<wide, 3>;

[[nodiscard]] inline wide times(wide a, wide b) {
    wide r = 0;
    if (__builtin_mul_overflow(a, b, &r)) throw std::overflow_error("oracle");
    return r;
}
[[nodiscard]] inline wide_vector minus(const wide_vector& a, const wide_vector& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] inline wide_vector product(const wide_vector& a, const wide_vector& b) {
    return {times(a[1], b[2]) - times(a[2], b[1]), times(a[2], b[0]) - times(a[0], b[2]),
            times(a[0], b[1]) - times(a[1], b[0])};
}
[[nodiscard]] inline wide inner(const wide_vector& a, const wide_vector& b) {
    return times(a[0], b[0]) + times(a[1], b[1]) + times(a[2], b[2]);
}

struct ratio { // of numbers with a denominator above 0
    wide numerator, denominator;
    friend bool operator<(const ratio& a, const ratio& b) {
        return times(a.numerator, b.denominator) < times(b.numerator, a.denominator);
    }
};

// Coordinate k of the interval in which triangle t, whose heights over a plane are d, meets that plane. There are
// heights of both signs.
[[nodiscard]] inline std::pair<ratio, ratio> interval(const std::array<wide_vector, 3>& t, const std::array<wide, 3>& d,
                                                      std::size_t k) {
    std::vector<ratio> ends;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        if (d[i] == 0) ends.push_back({t[i][k], 1});
        if ((d[i] < 0 && d[j] > 0) || (d[i] > 0 && d[j] < 0)) {
            const wide numerator = times(t[j][k], d[i]) - times(t[i][k], d[j]), denominator = d[i] - d[j];
            ends.push_back(denominator > 0 ? ratio{numerator, denominator} : ratio{-numerator, -denominator});
        }
    }
    return ends[0] < ends[1] ? std::pair(ends[0], ends[1]) : std::pair(ends[1], ends[0]);
}

// Triangles in one plane, by two of their coordinates.
[[nodiscard]] inline bool share_area(const std::array<wide_vector, 3>& a, const std::array<wide_vector, 3>& b,
                                     std::size_t j, std::size_t k) {
    using point = std::array<wide, 3>; // x and y times w, and w
    const auto side = [&](const wide_vector& u, const wide_vector& v, const point& p) {
        return times(v[j] - u[j], p[1] - times(u[k], p[2])) - times(v[k] - u[k], p[0] - times(u[j], p[2]));
    };
    const auto contains = [&](const std::array<wide_vector, 3>& t, const point& p) {
        bool left = true, right = true;
        for (std::size_t i = 0; i < 3; ++i) {
            const wide s = side(t[i], t[(i + 1) % 3], p);
            left = left && s >= 0;
            right = right && s <= 0;
        }
        return left || right;
    };
    std::vector<point> shared;
    for (std::size_t i = 0; i < 3; ++i) {
        const point p{a[i][j], a[i][k], 1}, q{b[i][j], b[i][k], 1};
        if (contains(b, p)) shared.push_back(p);
        if (contains(a, q)) shared.push_back(q);
        for (std::size_t l = 0; l < 3; ++l) { // where the lines of edges i and l cross, in both triangles
            const wide_vector &u = a[i], &v = a[(i + 1) % 3], &s = b[l], &e = b[(l + 1) % 3];
            const wide w = times(v[j] - u[j], e[k] - s[k]) - times(v[k] - u[k], e[j] - s[j]);
            if (w == 0) continue;
            const wide along = times(s[j] - u[j], e[k] - s[k]) - times(s[k] - u[k], e[j] - s[j]);
            point x{times(u[j], w) + times(along, v[j] - u[j]), times(u[k], w) + times(along, v[k] - u[k]), w};
            if (w < 0) x = {-x[0], -x[1], -x[2]};
            if (contains(a, x) && contains(b, x)) shared.push_back(x);
        }
    }
    if (shared.size() < 3) return false;
    // What has no area lies on an edge of one of them.
    for (std::size_t i = 0; i < 6; ++i) {
        const std::array<wide_vector, 3>& t = i < 3 ? a : b;
        const auto is_on_edge = [&](const point& p) { return side(t[i % 3], t[(i + 1) % 3], p) == 0; };
        if (std::all_of(shared.begin(), shared.end(), is_on_edge)) return false;
    }
    return true;
}

[[nodiscard]] inline bool oracle_intersects(const vp::core::lattice_vertex (&a)[3],
                                            const vp::core::lattice_vertex (&b)[3]) {
    std::array<wide_vector, 3> t{}, u{};
    for (std::size_t i = 0; i < 3; ++i) {
        t[i] = {a[i].x - a[0].x, a[i].y - a[0].y, a[i].z - a[0].z};
        u[i] = {b[i].x - a[0].x, b[i].y - a[0].y, b[i].z - a[0].z};
    }
    const wide_vector n = product(minus(t[1], t[0]), minus(t[2], t[0])),
                      m = product(minus(u[1], u[0]), minus(u[2], u[0]));
    const wide_vector none{};
    if (n == none || m == none) return false;
    std::array<wide, 3> of_u{}, of_t{};
    int above[2]{}, below[2]{};
    for (std::size_t i = 0; i < 3; ++i) {
        of_u[i] = inner(n, minus(u[i], t[0]));
        of_t[i] = inner(m, minus(t[i], u[0]));
        above[0] += of_u[i] > 0 ? 1 : 0;
        below[0] += of_u[i] < 0 ? 1 : 0;
        above[1] += of_t[i] > 0 ? 1 : 0;
        below[1] += of_t[i] < 0 ? 1 : 0;
    }
    if (above[0] == 0 && below[0] == 0) {
        if (n[0] != 0) return share_area(t, u, 1, 2);
        return n[1] != 0 ? share_area(t, u, 0, 2) : share_area(t, u, 0, 1);
    }
    if (above[0] == 0 || below[0] == 0 || above[1] == 0 || below[1] == 0) return false;
    const wide_vector line = product(n, m);
    std::size_t k = 0;
    while (line[k] == 0) ++k;
    const auto [low, high] = interval(t, of_t, k);
    const auto [begin, end] = interval(u, of_u, k);
    return low < end && begin < high;
}

[[nodiscard]] inline vp::core::lattice_vertex lattice_of(const vp::surface_vertex& v) {
    return {65536 * std::int64_t{v.cell.x} + v.q[0], 65536 * std::int64_t{v.cell.y} + v.q[1],
            65536 * std::int64_t{v.cell.z} + v.q[2]};
}

// All pairs of a surface that intersect; on_pair(t, u) for each. Boxes that are apart are left out.
template <class OnPair>
std::uint64_t count_pairs(const std::vector<vp::surface_vertex>& vertices, const std::vector<glm::uvec3>& triangles,
                          const OnPair& on_pair) {
    struct placed {
        vp::core::lattice_vertex v[3];
        std::int64_t low[3], high[3];
    };
    std::vector<placed> all;
    for (const glm::uvec3& t : triangles) {
        placed p{{lattice_of(vertices[t.x]), lattice_of(vertices[t.y]), lattice_of(vertices[t.z])}, {}, {}};
        for (int k = 0; k < 3; ++k) {
            const auto at = [&](int i) { return k == 0 ? p.v[i].x : k == 1 ? p.v[i].y : p.v[i].z; };
            p.low[k] = std::min({at(0), at(1), at(2)});
            p.high[k] = std::max({at(0), at(1), at(2)});
        }
        all.push_back(p);
    }
    const auto are_apart = [](const placed& p, const placed& q) {
        for (int k = 0; k < 3; ++k)
            if (p.high[k] < q.low[k] || q.high[k] < p.low[k]) return true;
        return false;
    };
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            if (are_apart(all[i], all[j]) || !oracle_intersects(all[i].v, all[j].v)) continue;
            ++count;
            on_pair(triangles[i], triangles[j]);
        }
    return count;
}
[[nodiscard]] inline std::uint64_t count_pairs(const std::vector<vp::surface_vertex>& vertices,
                                               const std::vector<glm::uvec3>& triangles) {
    return count_pairs(vertices, triangles, [](const glm::uvec3&, const glm::uvec3&) {});
}

} // namespace surface_tests
