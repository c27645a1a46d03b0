// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "segment_oracle.hpp"

#include <algorithm>

namespace oracle {

namespace {

[[nodiscard]] wide of(std::int64_t n) { return wide(n); }

// a / b <= c / d, for positive b and d.
[[nodiscard]] bool at_most(const ratio& x, const ratio& y) {
    return x.numerator * y.denominator <= y.numerator * x.denominator;
}
[[nodiscard]] ratio make_ratio(const wide& n, const wide& d) { return d.sign() < 0 ? ratio{-n, -d} : ratio{n, d}; }

} // namespace

int dominant_axis(const segment& s) {
    std::int64_t d[3];
    for (int i = 0; i < 3; ++i) d[i] = s.b[i] < s.a[i] ? s.a[i] - s.b[i] : s.b[i] - s.a[i];
    return d[0] >= d[1] && d[0] >= d[2] ? 0 : d[1] >= d[2] ? 1 : 2;
}

ratio parameter(const grid& g, const segment& s, const voxel& at) {
    const int w = dominant_axis(s);
    const int layer = w == 0 ? at.i : w == 1 ? at.j : at.k;
    // ((2 layer + 1) 2^F - 2 a) / (2 (b - a))
    const wide centre = of(2 * std::int64_t{layer} + 1).shifted_left(fraction_bits(g));
    return make_ratio(centre - of(2 * s.a[w]), of(2 * (s.b[w] - s.a[w])));
}

std::vector<voxel> thin(const grid& g, const segment& s) {
    std::vector<voxel> found;
    const int f = fraction_bits(g), w = dominant_axis(s), u = (w + 1) % 3, v = (w + 2) % 3;
    const std::int64_t unit = std::int64_t{1} << f;
    const auto add = [&](int at_u, int at_v, int at_w) {
        int p[3];
        p[u] = at_u;
        p[v] = at_v;
        p[w] = at_w;
        found.push_back({p[0], p[1], p[2]});
    };
    const bool is_point = s.a[0] == s.b[0] && s.a[1] == s.b[1] && s.a[2] == s.b[2];
    for (int k = 0; k < g.extent[w]; ++k) {
        const std::int64_t lo = k * unit, hi = lo + unit;
        if (is_point ? s.a[w] < lo || s.a[w] >= hi : std::max(s.a[w], s.b[w]) < lo || std::min(s.a[w], s.b[w]) > hi)
            continue;
        // The voxel along `axis` that holds a + t (b - a): compared with every voxel's faces.
        const auto voxel_along = [&](int axis) {
            ratio t{wide(0), wide(1)};
            if (!is_point) {
                int p[3]{};
                p[w] = k;
                t = parameter(g, s, {p[0], p[1], p[2]});
            }
            const ratio at{of(s.a[axis]) * t.denominator + of(s.b[axis] - s.a[axis]) * t.numerator, t.denominator};
            for (int i = 0; i < g.extent[axis]; ++i)
                if (at_most({of(i * unit), wide(1)}, at) && !at_most({of((i + 1) * unit), wide(1)}, at)) return i;
            return -1;
        };
        const int at_u = voxel_along(u), at_v = voxel_along(v);
        if (at_u >= 0 && at_v >= 0) add(at_u, at_v, k);
    }
    std::sort(found.begin(), found.end());
    return found;
}

std::vector<voxel> conservative(const grid& g, const segment& s) {
    std::vector<voxel> found;
    const std::int64_t unit = std::int64_t{1} << fraction_bits(g);
    for (int k = 0; k < g.extent[2]; ++k)
        for (int j = 0; j < g.extent[1]; ++j)
            for (int i = 0; i < g.extent[0]; ++i) {
                const int p[3] = {i, j, k};
                ratio first{wide(0), wide(1)}, last{wide(1), wide(1)}; // parameters within all slabs so far
                bool is_empty = false;
                for (int a = 0; a < 3; ++a) {
                    const std::int64_t lo = p[a] * unit, hi = lo + unit, d = s.b[a] - s.a[a];
                    if (d == 0) {
                        is_empty = is_empty || s.a[a] < lo || s.a[a] > hi;
                        continue;
                    }
                    ratio enter = make_ratio(of(lo - s.a[a]), of(d)), leave = make_ratio(of(hi - s.a[a]), of(d));
                    if (d < 0) std::swap(enter, leave);
                    if (at_most(first, enter)) first = enter;
                    if (at_most(leave, last)) last = leave;
                }
                if (!is_empty && at_most(first, last)) found.push_back({i, j, k});
            }
    std::sort(found.begin(), found.end());
    return found;
}

} // namespace oracle
