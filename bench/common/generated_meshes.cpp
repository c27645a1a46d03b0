// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "generated_meshes.hpp"

#include <array>
#include <cmath>
#include <stdexcept>

namespace bench {

namespace {

// Vectors of doubles whose every product feeds an fma, a division or a square root, never a bare + or -.
struct vec {
    double x, y, z;
};

vec operator+(const vec& a, const vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
vec operator-(const vec& a, const vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

// a + s * b
vec along(const vec& a, double s, const vec& b) {
    return {std::fma(s, b.x, a.x), std::fma(s, b.y, a.y), std::fma(s, b.z, a.z)};
}
double dot(const vec& a, const vec& b) { return std::fma(a.z, b.z, std::fma(a.y, b.y, a.x * b.x)); }
vec cross(const vec& a, const vec& b) {
    const auto minus = [](double p, double q, double r, double s) { return std::fma(p, q, -(r * s)); };
    return {minus(a.y, b.z, a.z, b.y), minus(a.z, b.x, a.x, b.z), minus(a.x, b.y, a.y, b.x)};
}
vec unit(const vec& a) {
    const double length = std::sqrt(dot(a, a));
    return {a.x / length, a.y / length, a.z / length};
}
glm::vec3 to_float(const vec& a) { return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)}; }

vec random_vec(random_numbers& random) {
    const double x = random.signed_unit(), y = random.signed_unit(), z = random.signed_unit();
    return {x, y, z};
}

// Two unit vectors that make a right-handed frame with d.
struct frame {
    vec n, b;
};
frame make_frame(const vec& d, const vec& hint) {
    const vec n = unit(along(hint, -dot(hint, d), d));
    return {n, cross(d, n)};
}

// A closed or open tube: rings of `sides` vertices, ring r from first + r * sides.
void connect_rings(mesh_data& m, std::uint32_t ring, std::uint32_t next, std::uint32_t sides) {
    for (std::uint32_t j = 0; j < sides; ++j) {
        const std::uint32_t a = ring + j, b = ring + (j + 1) % sides, c = next + j, d = next + (j + 1) % sides;
        m.triangles.emplace_back(a, b, d);
        m.triangles.emplace_back(a, d, c);
    }
}

// Points of the unit circle at t = 0 .. count - 1, evenly spaced in the rational parametrisation of each quarter.
struct circle_point {
    double c, s;
};
circle_point circle(int t, int count) {
    const int quarter = static_cast<int>(std::int64_t{4} * t / count);
    const double f = static_cast<double>(std::int64_t{4} * t - std::int64_t{count} * quarter) / count;
    const double d = std::fma(f, f, 1.0), c = std::fma(-f, f, 1.0) / d, s = 2.0 * f / d;
    switch (quarter) {
    case 0:
        return {c, s};
    case 1:
        return {-s, c};
    case 2:
        return {-c, -s};
    default:
        return {s, -c};
    }
}
circle_point turn(const circle_point& a, const circle_point& b) {
    return {std::fma(a.c, b.c, -(a.s * b.s)), std::fma(a.c, b.s, a.s * b.c)};
}

} // namespace

mesh_data icosphere(int frequency) {
    if (frequency < 1) throw std::invalid_argument("icosphere: frequency below 1");
    const double g = 0.5 * (1.0 + std::sqrt(5.0));
    const std::array<vec, 12> corner{{{-1, g, 0},
                                      {1, g, 0},
                                      {-1, -g, 0},
                                      {1, -g, 0},
                                      {0, -1, g},
                                      {0, 1, g},
                                      {0, -1, -g},
                                      {0, 1, -g},
                                      {g, 0, -1},
                                      {g, 0, 1},
                                      {-g, 0, -1},
                                      {-g, 0, 1}}};
    constexpr std::array<std::array<std::uint32_t, 3>, 20> face{
        {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
         {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
         {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
    const auto f = static_cast<std::uint32_t>(frequency);
    mesh_data m;
    m.name = "icosphere";
    m.note = "generated";

    // Points on an icosahedron's edge are made once, from the corner of the lower number.
    for (const vec& c : corner) m.positions.push_back(to_float(unit(c)));
    std::array<std::array<std::uint32_t, 12>, 12> edge_start{};
    const auto point_between = [&](const vec& a, const vec& b, const vec& c, std::uint32_t i, std::uint32_t j) {
        // ((f - i - j) a + i b + j c) / |...|
        const double s = f - i - j;
        const vec scaled{a.x * s, a.y * s, a.z * s};
        return to_float(unit(along(along(scaled, i, b), j, c)));
    };
    for (const auto& t : face)
        for (int e = 0; e < 3; ++e) {
            const std::uint32_t p = t[static_cast<std::size_t>(e)], q = t[static_cast<std::size_t>((e + 1) % 3)];
            if (p > q) continue;
            edge_start[p][q] = static_cast<std::uint32_t>(m.positions.size());
            for (std::uint32_t k = 1; k < f; ++k)
                m.positions.push_back(point_between(corner[p], corner[q], corner[q], k, 0));
        }
    // The k-th point from p to q.
    const auto on_edge = [&](std::uint32_t p, std::uint32_t q, std::uint32_t k) {
        if (k == 0) return p;
        if (k == f) return q;
        return p < q ? edge_start[p][q] + k - 1 : edge_start[q][p] + f - k - 1;
    };
    std::vector<std::uint32_t> row, next;
    for (const auto& t : face) {
        const std::uint32_t a = t[0], b = t[1], c = t[2];
        // Row j runs from edge a-c to edge b-c and has f - j + 1 points.
        const auto make_row = [&](std::uint32_t j, std::vector<std::uint32_t>& out) {
            out.clear();
            for (std::uint32_t i = 0; i + j <= f; ++i) {
                if (j == 0) {
                    out.push_back(on_edge(a, b, i));
                } else if (i == 0) {
                    out.push_back(on_edge(a, c, j));
                } else if (i + j == f) {
                    out.push_back(on_edge(b, c, j));
                } else {
                    out.push_back(static_cast<std::uint32_t>(m.positions.size()));
                    m.positions.push_back(point_between(corner[a], corner[b], corner[c], i, j));
                }
            }
        };
        make_row(0, row);
        for (std::uint32_t j = 0; j < f; ++j) {
            make_row(j + 1, next);
            for (std::uint32_t i = 0; i + j < f; ++i) {
                m.triangles.emplace_back(row[i], row[i + 1], next[i]);
                if (i + j + 1 < f) m.triangles.emplace_back(row[i + 1], next[i + 1], next[i]);
            }
            row.swap(next);
        }
    }
    return m;
}

mesh_data torus_knot(int segments, int sides) {
    if (segments < 4 || sides < 3) throw std::invalid_argument("torus_knot: too few segments or sides");
    mesh_data m;
    m.name = "torus_knot";
    m.note = "generated";
    // ((2 + cos 3t) cos 2t, (2 + cos 3t) sin 2t, sin 3t)
    const auto curve = [&](int i) {
        const circle_point t1 = circle((i + segments) % segments, segments), t2 = turn(t1, t1), t3 = turn(t2, t1);
        const double r = 2.0 + t3.c;
        return vec{r * t2.c, r * t2.s, t3.s};
    };
    constexpr double radius = 0.4;
    for (int i = 0; i < segments; ++i) {
        const vec p = curve(i), d = unit(curve(i + 1) - curve(i - 1));
        // The direction away from the vertical axis never lines up with the curve.
        const frame f = make_frame(d, {p.x, p.y, 4.0 * p.z});
        for (int j = 0; j < sides; ++j) {
            const circle_point a = circle(j, sides);
            m.positions.push_back(to_float(along(along(p, radius * a.c, f.n), radius * a.s, f.b)));
        }
    }
    const auto n = static_cast<std::uint32_t>(sides), rings = static_cast<std::uint32_t>(segments);
    for (std::uint32_t i = 0; i < rings; ++i) connect_rings(m, i * n, (i + 1) % rings * n, n);
    return m;
}

mesh_data triangle_soup(std::uint32_t count, double size, std::uint64_t seed) {
    mesh_data m;
    m.name = "soup";
    m.note = "generated";
    random_numbers random(seed);
    m.positions.reserve(std::size_t{3} * count);
    for (std::uint32_t i = 0; i < count; ++i) {
        const vec centre = random_vec(random);
        for (int k = 0; k < 3; ++k) m.positions.push_back(to_float(along(centre, size, random_vec(random))));
        m.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return m;
}

mesh_data hairball(int strands, int segments, std::uint64_t seed) {
    mesh_data m;
    m.name = "hairball_generated";
    m.note = "generated";
    random_numbers random(seed);
    constexpr double step = 1.0 / 40, thickness = 1.0 / 400;
    const double s = std::sqrt(0.75);
    const std::array<circle_point, 6> ring{{{1, 0}, {0.5, s}, {-0.5, s}, {-1, 0}, {-0.5, -s}, {0.5, -s}}};
    for (int strand = 0; strand < strands; ++strand) {
        vec d = unit(random_vec(random)), bend{0, 0, 0};
        vec p = along({0, 0, 0}, 0.1, random_vec(random));
        frame f = make_frame(d, random_vec(random));
        for (int k = 0; k <= segments; ++k) {
            const auto first = static_cast<std::uint32_t>(m.positions.size());
            for (const circle_point& c : ring)
                m.positions.push_back(to_float(along(along(p, thickness * c.c, f.n), thickness * c.s, f.b)));
            if (k > 0) connect_rings(m, first - 6, first, 6);
            bend = along({bend.x * 0.85, bend.y * 0.85, bend.z * 0.85}, 0.06, random_vec(random));
            const double r2 = dot(p, p); // pulls back what leaves the unit ball
            d = unit(along(d + bend, -0.4 * r2 * r2, p));
            p = along(p, step, d);
            f = make_frame(d, f.n);
        }
    }
    return m;
}

mesh_data room(std::uint32_t clutter, std::uint64_t seed) {
    mesh_data m;
    m.name = "room";
    m.note = "generated";
    const auto quad = [&](const vec& o, const vec& u, const vec& v) {
        const auto n = static_cast<std::uint32_t>(m.positions.size());
        for (const vec& p : {o, o + u, o + u + v, o + v}) m.positions.push_back(to_float(p));
        m.triangles.emplace_back(n, n + 1, n + 2);
        m.triangles.emplace_back(n, n + 2, n + 3);
    };
    quad({-3, -2, -1}, {6, 0, 0}, {0, 4, 0});
    quad({-3, -2, 1}, {6, 0, 0}, {0, 4, 0});
    quad({-3, -2, -1}, {6, 0, 0}, {0, 0, 2});
    quad({-3, 2, -1}, {6, 0, 0}, {0, 0, 2});
    quad({-3, -2, -1}, {0, 4, 0}, {0, 0, 2});
    quad({3, -2, -1}, {0, 4, 0}, {0, 0, 2});
    // Beams, neither parallel to an axis nor to each other.
    quad({-2.9, -1.9, -0.9}, {5.7, 3.6, 1.7}, {0.03, -0.02, 0.01});
    quad({2.7, -1.8, -0.8}, {-5.3, 3.5, 1.6}, {0.01, 0.04, -0.02});
    quad({-2.8, 1.7, -0.7}, {5.5, -3.3, 1.5}, {0.7, 0.9, 0.1});
    quad({-2.5, 0.1, 0.9}, {4.9, 0.3, -1.7}, {0.2, 1.1, 0.3});
    random_numbers random(seed);
    for (std::uint32_t i = 0; i < clutter; ++i) {
        const bool corner = random.below(4) != 0;
        const vec position = random_vec(random);
        const vec centre = corner ? vec{std::fma(position.x, 0.02, 2.5), std::fma(position.y, 0.02, 1.5),
                                        std::fma(position.z, 0.02, -0.8)}
                                  : vec{position.x * 2.9, position.y * 1.9, position.z * 0.9};
        const double size = corner ? 0.002 : 0.02;
        const auto n = static_cast<std::uint32_t>(m.positions.size());
        for (int k = 0; k < 3; ++k) m.positions.push_back(to_float(along(centre, size, random_vec(random))));
        m.triangles.emplace_back(n, n + 1, n + 2);
    }
    return m;
}

mesh_data one_triangle() {
    mesh_data m;
    m.name = "one_triangle";
    m.note = "generated";
    m.positions = {{0.0f, 0.0f, 0.0f}, {1.0f, 0.25f, 0.5f}, {0.125f, 1.0f, 0.875f}};
    m.triangles = {{0, 1, 2}};
    return m;
}

} // namespace bench
