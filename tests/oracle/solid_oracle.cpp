// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "solid_oracle.hpp"

#include <cmath>
#include <stdexcept>

namespace oracle {
namespace {

using vector = std::array<wide, 3>;

vector cross(const vector& a, const vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
wide dot(const vector& a, const vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
vector minus(const vector& a, const vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

} // namespace

winding_oracle::plane winding_oracle::make_plane(const std::array<wide, 3>& c, const wide& constant) const {
    plane p{};
    p.constant = constant;
    p.narrow = constant.bit_width() <= 124;
    for (int i = 0; i < 3; ++i) {
        p.c[i] = c[static_cast<std::size_t>(i)];
        p.narrow = p.narrow && p.c[i].bit_width() <= 84; // times a centre of at most 40 bits
    }
    if (p.narrow) {
        p.constant128 = constant.to_int128();
        for (int i = 0; i < 3; ++i) p.c128[i] = p.c[i].to_int128();
    }
    for (const int axis : order_) {
        if (p.tie == 0) p.tie = p.c[axis].sign();
    }
    return p;
}

int winding_oracle::plane::sign(const std::int64_t (&p)[3]) const {
    if (narrow) {
        const int128 value = c128[0] * p[0] + c128[1] * p[1] + c128[2] * p[2] + constant128;
        return value > 0 ? 1 : value < 0 ? -1 : tie;
    }
    const wide value = c[0] * wide(p[0]) + c[1] * wide(p[1]) + c[2] * wide(p[2]) + constant;
    return value.sign() != 0 ? value.sign() : tie;
}

winding_oracle::winding_oracle(int fraction_bits, const std::vector<snapped_triangle>& mesh,
                               const std::array<int, 3>& direction, const std::array<int, 3>& order)
    : fraction_bits_(fraction_bits), order_(order) {
    if (fraction_bits < 1) throw std::invalid_argument("winding_oracle: centres must be whole units");
    const vector d{wide(direction[0]), wide(direction[1]), wide(direction[2])};
    for (const snapped_triangle& t : mesh) {
        if (t.dropped) continue;
        vector v[3];
        for (int n = 0; n < 3; ++n) v[n] = {wide(t.v[n][0]), wide(t.v[n][1]), wide(t.v[n][2])};
        const vector normal = cross(minus(v[1], v[0]), minus(v[2], v[0]));
        piece p{};
        p.front = dot(normal, d).sign();
        // A ray parallel to the plane does not meet it: the moved centre is not in the plane.
        if (p.front == 0) continue;
        for (int n = 0; n < 3; ++n) {
            // The volume of d, a - p and b - p: d . (a x b) + (d x (b - a)) . p.
            const vector &a = v[n], &b = v[(n + 1) % 3];
            p.edge[n] = make_plane(cross(d, minus(b, a)), dot(d, cross(a, b)));
        }
        // How far before the plane p is: n . (a - p).
        p.face = make_plane({-normal[0], -normal[1], -normal[2]}, dot(normal, v[0]));
        pieces_.push_back(p);
    }
}

std::int64_t winding_oracle::winding(const voxel& at) const {
    const std::int64_t half = std::int64_t{1} << (fraction_bits_ - 1);
    const std::int64_t p[3] = {(2 * std::int64_t{at.i} + 1) * half, (2 * std::int64_t{at.j} + 1) * half,
                               (2 * std::int64_t{at.k} + 1) * half};
    std::int64_t sum = 0;
    for (const piece& t : pieces_) {
        const int side = t.edge[0].sign(p);
        if (t.edge[1].sign(p) != side || t.edge[2].sign(p) != side) continue;
        // Ahead, if the plane is reached in the direction of d.
        if (t.face.sign(p) == t.front) sum += t.front;
    }
    return sum;
}

generalized_winding find_generalized_winding(int fraction_bits, const std::vector<snapped_triangle>& mesh,
                                             const std::array<double, 3>& voxel_size, const voxel& at) {
    using real = long double;
    const std::int64_t half = std::int64_t{1} << (fraction_bits - 1);
    const std::int64_t p[3] = {(2 * std::int64_t{at.i} + 1) * half, (2 * std::int64_t{at.j} + 1) * half,
                               (2 * std::int64_t{at.k} + 1) * half};
    const real full = 4.0L * std::acos(-1.0L);
    generalized_winding w{0.0L, 0.0L, false};
    for (const snapped_triangle& t : mesh) {
        if (t.dropped) continue;
        int128 q[3][3]; // vertices from the centre
        for (int n = 0; n < 3; ++n)
            for (int k = 0; k < 3; ++k) q[n][k] = t.v[n][k] - p[k];
        const auto cross = [&](int n, int m, int k) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            return q[n][u] * q[m][v] - q[n][v] * q[m][u];
        };
        int128 volume = 0;
        for (int k = 0; k < 3; ++k) volume += q[0][k] * cross(1, 2, k);
        if (volume == 0) {
            // In the plane: inside if no two of the three small triangles turn against each other.
            bool has_area = false, same = true;
            for (int k = 0; k < 3; ++k) {
                const int128 c[3] = {cross(0, 1, k), cross(1, 2, k), cross(2, 0, k)};
                has_area = has_area || c[0] + c[1] + c[2] != 0;
                same = same && ((c[0] >= 0 && c[1] >= 0 && c[2] >= 0) || (c[0] <= 0 && c[1] <= 0 && c[2] <= 0));
            }
            w.is_on_surface = w.is_on_surface || (has_area && same);
            continue;
        }
        real r[3][3], length[3];
        const real size[3] = {voxel_size[0], voxel_size[1], voxel_size[2]};
        for (int n = 0; n < 3; ++n) {
            for (int k = 0; k < 3; ++k) r[n][k] = static_cast<real>(q[n][k]) * size[k];
            length[n] = std::sqrt(r[n][0] * r[n][0] + r[n][1] * r[n][1] + r[n][2] * r[n][2]);
        }
        const auto dot_of = [&](int n, int m) { return r[n][0] * r[m][0] + r[n][1] * r[m][1] + r[n][2] * r[m][2]; };
        const real sine = static_cast<real>(volume) * size[0] * size[1] * size[2];
        const real all = length[0] * length[1] * length[2];
        const real cosine = all + dot_of(0, 1) * length[2] + dot_of(1, 2) * length[0] + dot_of(2, 0) * length[1];
        w.number += 2.0L * std::atan2(sine, cosine) / full;
        w.doubt += 0x1p-58L * all / std::hypot(sine, cosine);
    }
    return w;
}

} // namespace oracle
