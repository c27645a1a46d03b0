// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "polygon.hpp"

#include <cmath>
#include <cstddef>

namespace voxelize {
namespace {

// a b - c d, the same with every compiler and flag.
double difference_of_products(double a, double b, double c, double d) { return std::fma(a, b, -(c * d)); }

// Twice the area of a triangle; positive where it runs counter-clockwise.
double area(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
    return difference_of_products(b.x - a.x, c.y - a.y, c.x - a.x, b.y - a.y);
}

// The corners in the plane of two axes in which the polygon's area is greatest, turned so that it is positive.
void project(std::span<const glm::dvec3> corners, std::vector<glm::dvec2>& flat) {
    glm::dvec3 normal(0);
    const glm::dvec3& base = corners[0];
    for (std::size_t i = 2; i < corners.size(); ++i) {
        const glm::dvec3 a = corners[i - 1] - base, b = corners[i] - base;
        normal.x += difference_of_products(a.y, b.z, a.z, b.y);
        normal.y += difference_of_products(a.z, b.x, a.x, b.z);
        normal.z += difference_of_products(a.x, b.y, a.y, b.x);
    }
    const glm::dvec3 size(std::abs(normal.x), std::abs(normal.y), std::abs(normal.z));
    glm::length_t up = size.x > size.y ? 0 : 1;
    if (!(size[up] > size.z)) up = 2;
    glm::length_t u = (up + 1) % 3, v = (up + 2) % 3;
    if (normal[up] < 0) std::swap(u, v);
    flat.clear();
    for (const glm::dvec3& p : corners) flat.emplace_back(p[u] - base[u], p[v] - base[v]);
}

} // namespace

std::span<const glm::uvec3> polygon_cutter::cut(std::span<const glm::dvec3> corners) {
    triangles_.clear();
    const auto n = static_cast<std::uint32_t>(corners.size());
    if (n == 3) triangles_.emplace_back(0U, 1U, 2U);
    if (n <= 3) return triangles_;
    project(corners, flat_);
    const auto turn = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        return area(flat_[a], flat_[b], flat_[c]);
    };
    reflex_.clear();
    for (std::uint32_t i = 0; i < n; ++i)
        if (!(turn((i + n - 1) % n, i, (i + 1) % n) >= 0)) reflex_.push_back(i);
    if (n == 4 || reflex_.empty()) {
        // A quadrilateral's only reflex corner is an end of its inner diagonal.
        const std::uint32_t first = reflex_.size() == 1 ? reflex_[0] : 0;
        for (std::uint32_t i = 2; i < n; ++i) triangles_.emplace_back(first, (first + i - 1) % n, (first + i) % n);
        return triangles_;
    }
    cut_ears(n);
    return triangles_;
}

void polygon_cutter::cut_ears(std::uint32_t n) {
    const auto turn = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        return area(flat_[a], flat_[b], flat_[c]);
    };
    next_.resize(n);
    previous_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
        next_[i] = (i + 1) % n;
        previous_[i] = (i + n - 1) % n;
    }
    // The work is bounded: what is left then is a fan.
    std::uint64_t steps = (std::uint64_t{1} << 26) + 64 * std::uint64_t{n};
    const auto is_ear = [&](std::uint32_t i) {
        const std::uint32_t a = previous_[i], b = next_[i];
        if (!(turn(a, i, b) > 0)) return false;
        for (const std::uint32_t r : reflex_) {
            if (next_[r] == r || r == a || r == i || r == b) continue;
            const glm::dvec2& p = flat_[r];
            if (p == flat_[a] || p == flat_[i] || p == flat_[b]) continue;
            if (turn(a, i, r) >= 0 && turn(i, b, r) >= 0 && turn(b, a, r) >= 0) return false;
        }
        return true;
    };
    std::uint32_t left = n, at = 0, tried = 0;
    bool takes_flat = false; // corners of a straight line, once there is no ear
    while (left > 3 && steps > reflex_.size()) {
        const std::uint32_t a = previous_[at], b = next_[at];
        steps -= 1 + reflex_.size();
        if (is_ear(at) || (takes_flat && turn(a, at, b) == 0)) {
            triangles_.emplace_back(a, at, b);
            next_[a] = b;
            previous_[b] = a;
            next_[at] = at; // which marks it as gone
            --left;
            tried = 0;
            takes_flat = false;
            at = b;
            continue;
        }
        at = b;
        if (++tried <= left) continue;
        if (takes_flat) break;
        takes_flat = true;
        tried = 0;
    }
    for (std::uint32_t i = next_[at]; next_[i] != at; i = next_[i]) triangles_.emplace_back(at, i, next_[i]);
}

} // namespace voxelize
