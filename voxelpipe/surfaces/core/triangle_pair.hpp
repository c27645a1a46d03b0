// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Whether two triangles of a surface intersect: exact, in 64-bit integers.

#include <voxelpipe/surfaces/core/place_vertex.hpp>

#include <cstdint>

namespace voxelpipe::core {

// Two triangles whose vertices lie within 4 samples' spacings of each other, as those of quads that share a cell do.
// They intersect properly if their insides, without edges and vertices, have a point in common; a triangle without area
// has no inside. Each coordinate is below 2^18 then, each edge below 2^17 and each number here below 2^58.
class triangle_pair {
public:
    VOXELPIPE_HD triangle_pair(const lattice_vertex (&a)[3], const lattice_vertex (&b)[3]) {
        for (int i = 0; i < 3; ++i) {
            a_[i] = {{a[i].x - a[0].x, a[i].y - a[0].y, a[i].z - a[0].z}};
            b_[i] = {{b[i].x - a[0].x, b[i].y - a[0].y, b[i].z - a[0].z}};
        }
    }

    // The insides are apart if and only if there is a direction along which one triangle ends where the other one
    // begins, or before, and that is not across both. Such a direction, if there is any, is among the normals and the
    // products of two edges; of triangles in one plane, among the normals of the edges in it.
    [[nodiscard]] VOXELPIPE_HD bool intersects() const {
        for (int k = 0; k < 3; ++k) { // quickly, for most
            vector axis{};
            axis[k] = 1;
            if (separates(axis)) return false;
        }
        const vector n = normal(a_), m = normal(b_);
        if (is_zero(n) || is_zero(m)) return false;
        if (separates(n) || separates(m)) return false;
        if (dot(n, b_[0]) == 0 && dot(n, b_[1]) == 0 && dot(n, b_[2]) == 0) return overlaps(n);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (separates(cross(edge(a_, i), edge(b_, j)))) return false;
        return true;
    }

private:
    using vector = triple<std::int64_t>;

    [[nodiscard]] VOXELPIPE_HD static vector cross(const vector& u, const vector& v) {
        return {{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]}};
    }
    [[nodiscard]] VOXELPIPE_HD static std::int64_t dot(const vector& u, const vector& v) {
        return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    }
    [[nodiscard]] VOXELPIPE_HD static bool is_zero(const vector& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }
    [[nodiscard]] VOXELPIPE_HD static vector edge(const vector (&t)[3], int i) {
        const int j = i == 2 ? 0 : i + 1;
        return {{t[j][0] - t[i][0], t[j][1] - t[i][1], t[j][2] - t[i][2]}};
    }
    [[nodiscard]] VOXELPIPE_HD static vector normal(const vector (&t)[3]) { return cross(edge(t, 0), edge(t, 1)); }

    struct range {
        std::int64_t low, high;
    };
    [[nodiscard]] VOXELPIPE_HD static range along(const vector& direction, const vector (&t)[3]) {
        range r{dot(direction, t[0]), 0};
        r.high = r.low;
        for (int i = 1; i < 3; ++i) {
            const std::int64_t d = dot(direction, t[i]);
            r.low = d < r.low ? d : r.low;
            r.high = d > r.high ? d : r.high;
        }
        return r;
    }
    [[nodiscard]] VOXELPIPE_HD bool separates(const vector& direction) const {
        const range a = along(direction, a_), b = along(direction, b_);
        if (a.high > b.low && b.high > a.low) return false;
        return a.low != a.high || b.low != b.high || a.low != b.low;
    }
    // Whether triangles in the plane with normal n overlap: seen along an axis across which it does not lie.
    [[nodiscard]] VOXELPIPE_HD bool overlaps(const vector& n) const {
        const int drop = n[0] != 0 ? 0 : n[1] != 0 ? 1 : 2, j = drop == 0 ? 1 : 0, k = drop == 2 ? 1 : 2;
        for (int i = 0; i < 6; ++i) {
            const vector e = i < 3 ? edge(a_, i) : edge(b_, i - 3);
            vector across{};
            across[j] = -e[k];
            across[k] = e[j];
            if (separates(across)) return false;
        }
        return true;
    }

    vector a_[3], b_[3];
};

} // namespace voxelpipe::core
