// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "link_oracle.hpp"

#include <algorithm>
#include <cstddef>

namespace oracle {
namespace {

// c[0] + c[1] e + c[2] e^2 + c[3] e^3; products beyond e^3 do not occur.
using polynomial = std::array<link_int, 4>;
using vector = std::array<polynomial, 3>;

// The sign for all small e > 0.
int sign(const polynomial& p) {
    for (const link_int& c : p)
        if (c.sign() != 0) return c.sign();
    return 0;
}
polynomial constant(const link_int& a) { return {a, link_int(0), link_int(0), link_int(0)}; }

// u . (v x w) for constant u and w, which keeps the degree.
polynomial volume(const std::array<link_int, 3>& u, const vector& v, const std::array<link_int, 3>& w) {
    polynomial sum = constant(link_int(0));
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        for (std::size_t d = 0; d < 4; ++d) sum[d] = sum[d] + u[i] * (v[j][d] * w[k] - v[k][d] * w[j]);
    }
    return sum;
}

} // namespace

link_hit cross_link(const lattice_triangle& t, int fraction_bits, const std::array<int, 3>& voxel,
                    const std::array<int, 3>& direction) {
    const std::int64_t one = std::int64_t{1} << fraction_bits;
    lattice_point centre{};
    for (std::size_t a = 0; a < 3; ++a) {
        centre[a] = voxel[a] * one + one / 2;
        const std::int64_t end = centre[a] + direction[a] * one;
        // Boxes that do not meet, with room for the offset.
        if (std::min({t[0][a], t[1][a], t[2][a]}) > std::max(centre[a], end) + 1) return {};
        if (std::max({t[0][a], t[1][a], t[2][a]}) < std::min(centre[a], end) - 1) return {};
    }
    std::array<link_int, 3> d;
    for (std::size_t a = 0; a < 3; ++a) d[a] = link_int(direction[a] * one);
    // Vertex i as seen from the moved start of the link.
    const auto seen = [&](std::size_t i) {
        vector v;
        for (std::size_t a = 0; a < 3; ++a) {
            v[a] = constant(link_int(t[i][a] - centre[a]));
            v[a][a + 1] = link_int(-1);
        }
        return v;
    };
    const auto edge = [&](std::size_t i, std::size_t j) {
        std::array<link_int, 3> v;
        for (std::size_t a = 0; a < 3; ++a) v[a] = link_int(t[j][a] - t[i][a]);
        return v;
    };
    // The line passes all three edges on the same side: p x q = p x (q - p).
    const int turn = sign(volume(d, seen(0), edge(0, 1)));
    if (turn == 0 || sign(volume(d, seen(1), edge(1, 2))) != turn || sign(volume(d, seen(2), edge(2, 0))) != turn)
        return {};
    // The start and the end lie on different sides of the plane: (p0 - start) . n and that less d . n.
    const std::array<link_int, 3> u = edge(0, 1), w = edge(0, 2);
    std::array<link_int, 3> n;
    for (std::size_t i = 0; i < 3; ++i) n[i] = u[(i + 1) % 3] * w[(i + 2) % 3] - u[(i + 2) % 3] * w[(i + 1) % 3];
    const vector first = seen(0);
    polynomial start = constant(link_int(0));
    link_int along(0);
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t k = 0; k < 4; ++k) start[k] = start[k] + n[a] * first[a][k];
        along = along + n[a] * d[a];
    }
    polynomial end = start;
    end[0] = end[0] - along;
    if (sign(start) * sign(end) >= 0) return {};
    const bool turned = along.sign() < 0;
    return {true, turned ? -start[0] : start[0], turned ? -along : along};
}

} // namespace oracle
