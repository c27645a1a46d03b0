// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "geometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace demo_model {
namespace {

// Nearest multiple of 1/4096: a quarter of a millimetre, far above the error of any math library.
float on_lattice(double v) { return static_cast<float>(std::round(v * 4096) / 4096); }

vec3 cross(vec3 a, vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double length(vec3 a) { return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }

vec3 to_vec3(const std::array<float, 3>& p) {
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

// Value of a lattice point in [-1, 1].
double lattice_value(std::int64_t x, std::int64_t y, std::int64_t z) {
    auto h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^ static_cast<std::uint32_t>(y) * 0xd8163841u ^
             static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    h ^= h >> 16;
    return h / 2147483647.5 - 1;
}

} // namespace

rgba mix(rgba a, rgba b, double t) {
    t = std::clamp(t, 0.0, 1.0);
    rgba out{};
    for (std::size_t c = 0; c < 4; ++c) out[c] = static_cast<std::uint8_t>(std::lround(a[c] + (b[c] - a[c]) * t));
    return out;
}

double noise(vec3 p) {
    const std::array<double, 3> at{p.x, p.y, p.z};
    std::array<std::int64_t, 3> base{};
    std::array<double, 3> fade{};
    for (std::size_t a = 0; a < 3; ++a) {
        const double floor = std::floor(at[a]);
        const double t = at[a] - floor;
        base[a] = static_cast<std::int64_t>(floor);
        fade[a] = t * t * (3 - 2 * t);
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        std::array<std::int64_t, 3> point = base;
        for (std::size_t a = 0; a < 3; ++a) {
            const bool high = (corner >> a & 1) != 0;
            weight *= high ? fade[a] : 1 - fade[a];
            if (high) ++point[a];
        }
        sum += weight * lattice_value(point[0], point[1], point[2]);
    }
    return sum;
}

double rough_noise(vec3 p) {
    double sum = 0, height = 0.5;
    for (int octave = 0; octave < 4; ++octave, height /= 2) {
        sum += height * noise(p);
        p = p * 2.03 + vec3{17.1, 5.3, 11.7}; // not a multiple, so that lattices do not line up
    }
    return sum;
}

void mesh::add_patch(int nu, int nv, const std::function<vertex(double u, double v)>& f) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    const auto index = [&](int i, int j) { return first + static_cast<std::uint32_t>(j * (nu + 1) + i); };
    for (int j = 0; j <= nv; ++j)
        for (int i = 0; i <= nu; ++i) {
            const vertex v = f(static_cast<double>(i) / nu, static_cast<double>(j) / nv);
            positions.push_back({on_lattice(v.position.x), on_lattice(v.position.y), on_lattice(v.position.z)});
            uvs.push_back({on_lattice(v.uv.x), on_lattice(v.uv.y)});
            colors.push_back(v.color);
        }
    // A patch that closes on itself along u shares its normals across the seam.
    const bool closed = [&] {
        for (int j = 0; j <= nv; ++j)
            if (positions[index(0, j)] != positions[index(nu, j)]) return false;
        return true;
    }();
    std::vector<vec3> sums(positions.size() - first);
    const auto add_triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        const vec3 pa = to_vec3(positions[a]), pb = to_vec3(positions[b]), pc = to_vec3(positions[c]);
        const vec3 area = cross(pb - pa, pc - pa);
        if (length(area) < 1e-9) return;
        for (const std::uint32_t corner : {a, b, c}) {
            indices.push_back(corner);
            sums[corner - first] = sums[corner - first] + area;
        }
    };
    for (int j = 0; j < nv; ++j)
        for (int i = 0; i < nu; ++i) {
            add_triangle(index(i, j), index(i + 1, j), index(i + 1, j + 1));
            add_triangle(index(i, j), index(i + 1, j + 1), index(i, j + 1));
        }
    if (closed)
        for (int j = 0; j <= nv; ++j) {
            vec3& left = sums[index(0, j) - first];
            vec3& right = sums[index(nu, j) - first];
            left = right = left + right;
        }
    // The vertices of a row that is a single point share theirs likewise.
    for (const int j : {0, nv}) {
        vec3 sum;
        bool point = true;
        for (int i = 0; i <= nu; ++i) {
            point = point && positions[index(i, j)] == positions[index(0, j)];
            sum = sum + sums[index(i, j) - first];
        }
        if (point)
            for (int i = 0; i <= nu; ++i) sums[index(i, j) - first] = sum;
    }
    for (const vec3& sum : sums) {
        const double l = length(sum);
        const vec3 n = l > 0 ? sum * (1 / l) : vec3{0, 1, 0};
        normals.push_back({on_lattice(n.x), on_lattice(n.y), on_lattice(n.z)});
    }
}

void mesh::add_lathe(std::span<const vec2> profile, int segments, double u_repeat, double v_low, double v_high,
                     rgba color) {
    double total = 0;
    for (std::size_t n = 1; n < profile.size(); ++n)
        total += std::hypot(profile[n].x - profile[n - 1].x, profile[n].y - profile[n - 1].y);
    double done = 0;
    for (std::size_t n = 1; n < profile.size(); ++n) {
        const vec2 a = profile[n - 1], b = profile[n];
        const double piece = std::hypot(b.x - a.x, b.y - a.y);
        const double from = v_low + (v_high - v_low) * done / total;
        done += piece;
        const double to = v_low + (v_high - v_low) * done / total;
        add_patch(segments, 1, [&](double u, double v) {
            const double angle = 2 * std::numbers::pi * u;
            const double r = a.x + (b.x - a.x) * v;
            return vertex{{r * std::sin(angle), a.y + (b.y - a.y) * v, r * std::cos(angle)},
                          {u * u_repeat, 1 - (from + (to - from) * v)},
                          color};
        });
    }
}

void mesh::add_quad(vec3 a, vec3 b, vec3 c, vec3 d, rgba color) {
    add_patch(1, 1, [&](double u, double v) {
        return vertex{(a * (1 - u) + b * u) * (1 - v) + (d * (1 - u) + c * u) * v, {u, 1 - v}, color};
    });
}

void mesh::add_box(vec3 low, vec3 high, double scale, rgba color) {
    const vec3 size = high - low;
    const auto face = [&](vec3 corner, vec3 u_edge, vec3 v_edge) {
        const double u_size = length(u_edge) * scale, v_size = length(v_edge) * scale;
        add_patch(1, 1, [&](double u, double v) {
            return vertex{corner + u_edge * u + v_edge * v, {u * u_size, (1 - v) * v_size}, color};
        });
    };
    const vec3 x{size.x, 0, 0}, y{0, size.y, 0}, z{0, 0, size.z};
    face(low + z, x, y);              // front
    face(low + x, vec3{} - x, y);     // back
    face(low + x + z, vec3{} - z, y); // right
    face(low, z, y);                  // left
    face(low + y + z, x, vec3{} - z); // top
    face(low, x, z);                  // bottom
}

} // namespace demo_model
