// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "distance_oracle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace oracle {
namespace {

using vector = std::array<distance_int, 3>;

vector minus(const vector& a, const vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
vector cross(const vector& a, const vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
distance_int dot(const vector& a, const vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void take(exact_square& least, const exact_square& other) {
    if (least.denominator.sign() == 0 || is_less(other, least)) least = other;
}

} // namespace

bool is_less(const exact_square& a, const exact_square& b) {
    return a.numerator * b.denominator < b.numerator * a.denominator;
}

distance_oracle::distance_oracle(const std::array<double, 3>& voxel_size, int fraction_bits) {
    std::array<std::int64_t, 3> mantissa{};
    std::array<int, 3> exponent{};
    exponent_ = std::numeric_limits<int>::max();
    for (std::size_t i = 0; i < 3; ++i) {
        mantissa[i] = static_cast<std::int64_t>(std::ldexp(std::frexp(voxel_size[i], &exponent[i]), 53));
        exponent[i] -= 53 + fraction_bits;
        while (mantissa[i] % 2 == 0) {
            mantissa[i] /= 2;
            ++exponent[i];
        }
        exponent_ = std::min(exponent_, exponent[i]);
    }
    for (std::size_t i = 0; i < 3; ++i) length_[i] = distance_int(mantissa[i]).shifted_left(exponent[i] - exponent_);
}

exact_square distance_oracle::square(const lattice_triangle& t, const lattice_point& p) const {
    // Vertices from the sample, in world space.
    std::array<vector, 3> v;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) v[i][k] = length_[k] * distance_int(t[i][k] - p[k]);
    exact_square least;
    for (std::size_t i = 0; i < 3; ++i) {
        const vector &a = v[i], &b = v[(i + 1) % 3];
        take(least, {dot(a, a), distance_int(1)});
        const vector e = minus(b, a);
        const distance_int square = dot(e, e), along = -dot(a, e);
        if (along.sign() > 0 && along < square) {
            const vector c = cross(a, b);
            take(least, {dot(c, c), square});
        }
    }
    const vector n = cross(minus(v[1], v[0]), minus(v[2], v[0]));
    const distance_int area = dot(n, n);
    if (area.sign() == 0) return least;
    bool inside = true;
    for (std::size_t i = 0; i < 3; ++i) inside = inside && dot(cross(v[i], v[(i + 1) % 3]), n).sign() >= 0;
    if (inside) {
        const distance_int h = dot(n, v[0]);
        take(least, {h * h, area});
    }
    return least;
}

int distance_oracle::compare(const distance_int& mantissa, int exponent, const exact_square& square) const {
    distance_int left = mantissa * square.denominator, right = square.numerator;
    const int shift = exponent - 2 * exponent_;
    if (shift >= 0)
        left = left.shifted_left(shift);
    else
        right = right.shifted_left(-shift);
    return left < right ? -1 : right < left ? 1 : 0;
}

bool distance_oracle::is_nearest_float(const exact_square& square, float root) const {
    if (square.numerator.sign() == 0) return root == 0.0f;
    // The middles between the float and its neighbours are doubles.
    const auto middle = [](float a, float b) { return 0.5 * (static_cast<double>(a) + static_cast<double>(b)); };
    const auto compare_square = [&](double a) {
        int exponent = 0;
        const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(a, &exponent), 53));
        return compare(distance_int(mantissa) * distance_int(mantissa), 2 * (exponent - 53), square);
    };
    const float inf = std::numeric_limits<float>::infinity();
    return root > 0.0f && compare_square(middle(root, std::nextafterf(root, 0.0f))) <= 0 &&
           compare_square(middle(root, std::nextafterf(root, inf))) >= 0;
}

bool distance_oracle::is_close(double a, const exact_square& b, int bits) const {
    if (b.numerator.sign() == 0) return a == 0.0;
    int exponent = 0;
    const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(a, &exponent), 53));
    const distance_int one = distance_int(1).shifted_left(bits);
    const exact_square low{b.numerator * (one - distance_int(1)), b.denominator * one},
        high{b.numerator * (one + distance_int(1)), b.denominator * one};
    return compare(distance_int(mantissa), exponent - 53, low) >= 0 &&
           compare(distance_int(mantissa), exponent - 53, high) <= 0;
}

} // namespace oracle
