// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Affine maps in double: where an instance stands in the world. Every product feeds an fma, so that all compilers and
// flags give the same bits.

#include <glm/glm.hpp>

#include <array>
#include <cmath>

namespace voxelize {

// Maps p to (row r) m[r][0] p.x + m[r][1] p.y + m[r][2] p.z + m[r][3].
struct affine {
    std::array<std::array<double, 4>, 3> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

    [[nodiscard]] double row(std::size_t r, double x, double y, double z, double w) const {
        return std::fma(m[r][0], x, std::fma(m[r][1], y, std::fma(m[r][2], z, m[r][3] * w)));
    }

    [[nodiscard]] glm::dvec3 operator()(const glm::dvec3& p) const {
        return {row(0, p.x, p.y, p.z, 1), row(1, p.x, p.y, p.z, 1), row(2, p.x, p.y, p.z, 1)};
    }

    // First INNER, then this.
    [[nodiscard]] affine after(const affine& inner) const {
        affine product;
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 4; ++c)
                product.m[r][c] = row(r, inner.m[0][c], inner.m[1][c], inner.m[2][c], c == 3 ? 1 : 0);
        return product;
    }

    // True if it turns right hands into left hands.
    [[nodiscard]] bool mirrors() const {
        const auto minor = [&](std::size_t a, std::size_t b) {
            return std::fma(m[1][a], m[2][b], -(m[1][b] * m[2][a]));
        };
        return std::fma(m[0][0], minor(1, 2), std::fma(m[0][1], minor(2, 0), m[0][2] * minor(0, 1))) < 0;
    }

    [[nodiscard]] bool is_finite() const {
        for (const auto& line : m)
            for (const double entry : line)
                if (!std::isfinite(entry)) return false;
        return true;
    }

    [[nodiscard]] static affine scaling(double factor) {
        affine result;
        for (std::size_t i = 0; i < 3; ++i) result.m[i][i] = factor;
        return result;
    }

    // translation * rotation (a unit quaternion x, y, z, w) * scale
    [[nodiscard]] static affine from_parts(const std::array<double, 3>& t, const std::array<double, 4>& q,
                                           const std::array<double, 3>& s) {
        const auto [x, y, z, w] = q;
        const auto diagonal = [](double a, double b) { return std::fma(-2, std::fma(a, a, b * b), 1); };
        const auto mixed = [](double a, double b, double c, double d) { return 2 * std::fma(a, b, c * d); };
        affine result;
        result.m[0] = {diagonal(y, z) * s[0], mixed(x, y, -z, w) * s[1], mixed(x, z, y, w) * s[2], t[0]};
        result.m[1] = {mixed(x, y, z, w) * s[0], diagonal(x, z) * s[1], mixed(y, z, -x, w) * s[2], t[1]};
        result.m[2] = {mixed(x, z, -y, w) * s[0], mixed(y, z, x, w) * s[1], diagonal(x, y) * s[2], t[2]};
        return result;
    }
};

} // namespace voxelize
