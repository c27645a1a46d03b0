// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "solid_oracle.hpp"

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

} // namespace oracle
