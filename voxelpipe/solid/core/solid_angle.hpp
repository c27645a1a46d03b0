// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The solid angle of a closed triangle as seen from a sample (docs/design.md, "Solids"), by one written formula:
// integers first (core/seen_triangle.hpp), then operations of one rounding in a fixed order, an arctangent of our own,
// and a fixed-point number at the end. Sums of these are sums of integers: every backend gets the same, in any order.

#include <voxelpipe/core/exact.hpp>
#include <voxelpipe/core/seen_triangle.hpp>

#include <cstdint>

namespace voxelpipe::core {

inline constexpr double pi_as_double = 0x1.921fb54442d18p+1;

// The angle of the point (x, y) from the x axis in radians, from -pi to pi; not both are 0. Within 2^-51 of the exact
// one. The ratio q of the lesser magnitude to the greater one is turned by the nearest atan(i / 8) into t, at most
// 1/16, whose series has eight terms: the ninth is below 2^-72.
[[nodiscard]] VOXELPIPE_HD inline double written_atan2(double y, double x) {
    // atan(i / 8), each rounded once.
    constexpr double steps[9] = {0.0,
                                 0x1.fd5ba9aac2f6ep-4,
                                 0x1.f5b75f92c80ddp-3,
                                 0x1.6f61941e4def1p-2,
                                 0x1.dac670561bb4fp-2,
                                 0x1.1e00babdefeb4p-1,
                                 0x1.4978fa3269ee1p-1,
                                 0x1.700a7c5784634p-1,
                                 0x1.921fb54442d18p-1};
    // 1 / 3, 1 / 5 ... 1 / 15, with alternating signs.
    constexpr double series[7] = {-1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0, 1.0 / 9.0, -1.0 / 11.0, 1.0 / 13.0, -1.0 / 15.0};
    const double rise = magnitude_of(y), run = magnitude_of(x);
    const double low = lesser(rise, run), high = greater(rise, run);
    const auto i = static_cast<int>(exact::round_to_int64(exact::mul(8.0, exact::div(low, high))));
    const double step = exact::mul(0.125, static_cast<double>(i));
    const double t = exact::div(exact::fma(-step, high, low), exact::fma(step, low, high));
    const double square = exact::mul(t, t);
    double sum = series[6];
    for (int k = 5; k >= 0; --k) sum = exact::fma(sum, square, series[k]);
    double angle = add_doubles(steps[i], exact::fma(exact::mul(sum, square), t, t));
    if (rise > run) angle = add_doubles(0.5 * pi_as_double, -angle);
    if (x < 0.0) angle = add_doubles(pi_as_double, -angle);
    return y < 0.0 ? -angle : angle;
}

// Half the solid angle of a triangle, from -pi to pi: above 0 where its front faces away from the sample. `is_on`: the
// sample lies on the closed triangle, which has an area, and no angle is defined; it is 0 then, as that of any triangle
// in whose plane the sample lies.
struct seen_angle {
    double half;
    bool is_on;
};

// With lengths in world units, a, b, c from the sample to the vertices and V = det(a, b, c), half the solid angle is
// atan2(V, D), where D = |a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|. Each term of D has a relative error of a few units
// of 2^-53, so the angle's is below 20 * 2^-53 |a||b||c| / |(V, D)|: near the line through two vertices, where the
// products cancel, it would be large. There, below an eighth of |a||b||c|, the angle is that of the sphere's triangle,
// alpha + beta + gamma - pi, of angles between planes through the sample, each atan2(|a| V, (a x b).(a x c)), whose two
// parts are never both small beside |a x b||a x c|. So half the angle is within 2^-45 of the exact one everywhere.
[[nodiscard]] VOXELPIPE_HD inline seen_angle find_angle(const seen_triangle& t, const distance_scale& s) {
    if (!(t.volume < 0.0 || t.volume > 0.0)) {
        // The crosses are multiples of the normal; none is negative if the sample is in the triangle.
        for (int k = 0; k < 3; ++k) {
            if (!(t.normal[k] < 0.0 || t.normal[k] > 0.0)) continue;
            bool is_on = true;
            for (int i = 0; i < 3; ++i)
                is_on = is_on && (t.normal[k] > 0.0 ? t.cross[i][k] >= 0.0 : t.cross[i][k] <= 0.0);
            return {0.0, is_on};
        }
        return {0.0, false};
    }
    double length[3];
    for (int i = 0; i < 3; ++i) length[i] = exact::sqrt(scaled_dot(s.w, t.vertex[i], t.vertex[i]));
    const double two = exact::mul(length[0], length[1]), all = exact::mul(two, length[2]);
    const double volume = exact::mul(s.c, t.volume);
    const double products = ordered_sum(exact::mul(scaled_dot(s.w, t.vertex[0], t.vertex[1]), length[2]),
                                        exact::mul(scaled_dot(s.w, t.vertex[1], t.vertex[2]), length[0]),
                                        exact::mul(scaled_dot(s.w, t.vertex[2], t.vertex[0]), length[1]));
    const double other = exact::fma(two, length[2], products);
    if (greater(magnitude_of(volume), magnitude_of(other)) >= exact::mul(0.125, all))
        return {written_atan2(volume, other), false};
    double angle[3];
    for (int i = 0; i < 3; ++i) {
        // (a x b).(a x c) = -(a x b).(c x a)
        const double along = -scaled_dot(s.g, t.cross[i], t.cross[i == 0 ? 2 : i - 1]);
        angle[i] = written_atan2(exact::mul(length[i], magnitude_of(volume)), along);
    }
    const double half = exact::mul(0.5, add_doubles(ordered_sum(angle[0], angle[1], angle[2]), -pi_as_double));
    return {volume < 0.0 ? -half : half, false};
}

// The triangle as seen from a sample, by the narrow form where it serves all samples of a grid.
[[nodiscard]] VOXELPIPE_HD inline seen_triangle see_corners(const snapped_position& a, const snapped_position& b,
                                                            const snapped_position& c, const snapped_position& sample,
                                                            bool is_narrow) {
    return is_narrow ? see(make_narrow(a, b, c), static_cast<double>(sample.x), static_cast<double>(sample.y),
                           static_cast<double>(sample.z))
                     : see_wide(a, b, c, sample);
}

// True if the point lies on the closed triangle, and that has an area.
[[nodiscard]] VOXELPIPE_HD inline bool is_on_triangle(const snapped_position& a, const snapped_position& b,
                                                      const snapped_position& c, const snapped_position& p) {
    if (min3(a.x, b.x, c.x) > p.x || max3(a.x, b.x, c.x) < p.x || min3(a.y, b.y, c.y) > p.y ||
        max3(a.y, b.y, c.y) < p.y || min3(a.z, b.z, c.z) > p.z || max3(a.z, b.z, c.z) < p.z)
        return false;
    const seen_triangle seen = see_wide(a, b, c, p);
    return !(seen.volume < 0.0 || seen.volume > 0.0) && find_angle(seen, distance_scale{}).is_on;
}

// Bits behind the point of sums of n solid angles over 4 pi, each at most 1/2: no sum of theirs exceeds 2^61.
[[nodiscard]] VOXELPIPE_HD constexpr int angle_bits(std::uint32_t n) {
    int log2 = 0; // 2^log2 > n
    while (log2 < 32 && (std::uint64_t{1} << log2) <= n) ++log2;
    return log2 < 10 ? 52 : 62 - log2;
}
// The solid angle over 4 pi, in units of 2^-bits. half: of a seen_angle.
[[nodiscard]] VOXELPIPE_HD VOXELPIPE_INLINE std::int64_t angle_units(double half, int bits) {
    constexpr double turn = 0x1.45f306dc9c883p-3; // 1 / (2 pi)
    return exact::round_to_int64(exact::mul(exact::mul(half, turn), static_cast<double>(std::int64_t{1} << bits)));
}

} // namespace voxelpipe::core
