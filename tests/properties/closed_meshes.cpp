// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "closed_meshes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace properties {
namespace {

double length(const point& p) { return std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z); }
point scaled(const point& p, double s) { return {p.x * s, p.y * s, p.z * s}; }

// Twice the signed area of (a, b, p + (e, e^2)) for an infinitely small e > 0. It is never zero for a != b. The point
// p + (e, e^2) is the same for every edge, so that each p lies on exactly one side of a closed polygon.
int side_of_moved_point(const std::int64_t (&a)[2], const std::int64_t (&b)[2], const std::int64_t (&p)[2]) {
    const oracle::int128 dx = b[0] - a[0], dy = b[1] - a[1];
    const oracle::int128 area = dx * (p[1] - a[1]) - dy * (p[0] - a[0]);
    if (area != 0) return area > 0 ? 1 : -1;
    if (dy != 0) return dy < 0 ? 1 : -1; // the term of e
    return dx > 0 ? 1 : (dx < 0 ? -1 : 0);
}

} // namespace

void closed_mesh::add_shell(const closed_mesh& other) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    shells.push_back(triangles.size());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const auto& t : other.triangles) triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

closed_mesh box(point half_size) {
    closed_mesh m{"box", {}, {}, {0}};
    for (int corner = 0; corner < 8; ++corner)
        m.vertices.push_back({(corner & 1) != 0 ? half_size.x : -half_size.x,
                              (corner & 2) != 0 ? half_size.y : -half_size.y,
                              (corner & 4) != 0 ? half_size.z : -half_size.z});
    m.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return m;
}

closed_mesh tetrahedron(double radius) {
    closed_mesh m{"tetrahedron", {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {}, {0}};
    for (point& p : m.vertices) p = scaled(p, radius);
    m.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    return m;
}

closed_mesh sphere(double radius, int subdivisions) {
    closed_mesh m{"sphere", {}, {}, {0}};
    const double g = (1.0 + std::sqrt(5.0)) / 2.0;
    m.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                  {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    m.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                   {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                   {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (int level = 0; level < subdivisions; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [found, added] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(m.vertices.size()));
            if (added) {
                const point p = m.vertices[a], q = m.vertices[b];
                m.vertices.push_back({p.x + q.x, p.y + q.y, p.z + q.z});
            }
            return found->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : m.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        m.triangles = std::move(finer);
        for (point& p : m.vertices) p = scaled(p, 1.0 / length(p));
    }
    for (point& p : m.vertices) p = scaled(p, radius / length(p));
    return m;
}

closed_mesh torus(double radius, double tube, int around, int across) {
    closed_mesh m{"torus", {}, {}, {0}};
    const double full = 2.0 * std::acos(-1.0);
    for (int i = 0; i < around; ++i)
        for (int j = 0; j < across; ++j) {
            const double a = full * i / around, b = full * j / across;
            const double r = radius + tube * std::cos(b);
            m.vertices.push_back({r * std::cos(a), r * std::sin(a), tube * std::sin(b)});
        }
    const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i % around * across + j % across); };
    for (int i = 0; i < around; ++i)
        for (int j = 0; j < across; ++j) {
            m.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            m.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return m;
}

closed_mesh star(oracle::splitmix64& random, double inner, double outer, int subdivisions) {
    closed_mesh m = sphere(1.0, subdivisions);
    m.name = "star";
    for (point& p : m.vertices) p = scaled(p, random.uniform(inner, outer));
    return m;
}

closed_mesh hull(double radius, double thickness, int subdivisions) {
    closed_mesh m = sphere(radius, subdivisions);
    m.name = "hull";
    closed_mesh within = sphere(radius - thickness, subdivisions);
    for (auto& t : within.triangles) std::swap(t[1], t[2]);
    m.add_shell(within);
    return m;
}

void turn(closed_mesh& m, oracle::splitmix64& random) {
    double q[4]{};
    double norm = 0;
    while (norm < 0.1) {
        norm = 0;
        for (double& x : q) {
            x = random.uniform(-1.0, 1.0);
            norm += x * x;
        }
    }
    for (double& x : q) x /= std::sqrt(norm);
    const auto [w, x, y, z] = q;
    for (point& p : m.vertices)
        p = {(1 - 2 * (y * y + z * z)) * p.x + 2 * (x * y - w * z) * p.y + 2 * (x * z + w * y) * p.z,
             2 * (x * y + w * z) * p.x + (1 - 2 * (x * x + z * z)) * p.y + 2 * (y * z - w * x) * p.z,
             2 * (x * z - w * y) * p.x + 2 * (y * z + w * x) * p.y + (1 - 2 * (x * x + y * y)) * p.z};
}

void move(closed_mesh& m, point by) {
    for (point& p : m.vertices) p = {p.x + by.x, p.y + by.y, p.z + by.z};
}

bool is_closed(const closed_mesh& m) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : m.triangles)
        for (std::size_t n = 0; n < 3; ++n) ++edges[{t[n], t[(n + 1) % 3]}];
    return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
        const auto back = edges.find({edge.first.second, edge.first.first});
        return edge.second == 1 && back != edges.end() && back->second == 1;
    });
}

std::vector<oracle::world_triangle> place(const closed_mesh& m, const oracle::grid& g) {
    std::vector<oracle::world_triangle> placed;
    for (const auto& t : m.triangles) {
        oracle::world_triangle w{};
        for (std::size_t n = 0; n < 3; ++n) {
            const point& p = m.vertices[t[n]];
            const double voxels[3] = {p.x, p.y, p.z};
            for (int axis = 0; axis < 3; ++axis)
                w.v[n][axis] =
                    static_cast<float>(g.origin[axis] + (0.5 * g.extent[axis] + voxels[axis]) * g.voxel_size[axis]);
        }
        placed.push_back(w);
    }
    return placed;
}

std::vector<std::uint32_t> inside_of(const closed_mesh& m, const oracle::grid& g,
                                     const std::vector<oracle::world_triangle>& placed) {
    const int fraction = oracle::fraction_bits(g);
    const std::int64_t unit = std::int64_t{1} << fraction, half = unit / 2;
    const auto nx = static_cast<std::size_t>(g.extent[0]), ny = static_cast<std::size_t>(g.extent[1]);
    std::vector<std::uint32_t> inside(nx * ny * static_cast<std::size_t>(g.extent[2]), 0);
    std::size_t shell = 0;
    for (std::size_t n = 0; n < placed.size(); ++n) {
        while (shell + 1 < m.shells.size() && m.shells[shell + 1] <= n) ++shell;
        const std::uint32_t bit = std::uint32_t{1} << shell;
        const oracle::snapped_triangle t = oracle::snap(g, placed[n].v);
        std::int64_t flat[3][2], lo[2], hi[2];
        for (int axis = 0; axis < 2; ++axis) {
            for (int v = 0; v < 3; ++v) flat[v][axis] = t.v[v][axis];
            lo[axis] = std::min({flat[0][axis], flat[1][axis], flat[2][axis]});
            hi[axis] = std::max({flat[0][axis], flat[1][axis], flat[2][axis]});
        }
        for (int j = 0; j < g.extent[1]; ++j) {
            const std::int64_t y = j * unit + half;
            if (y < lo[1] || y > hi[1]) continue;
            for (int i = 0; i < g.extent[0]; ++i) {
                const std::int64_t x = i * unit + half;
                if (x < lo[0] || x > hi[0]) continue;
                const std::int64_t p[2] = {x, y};
                const int s = side_of_moved_point(flat[0], flat[1], p);
                if (s == 0 || s != side_of_moved_point(flat[1], flat[2], p) ||
                    s != side_of_moved_point(flat[2], flat[0], p))
                    continue;
                // The line through (x, y) along z crosses the triangle; centres above the crossing change sides. Its
                // height: z0 - (nx (x - x0) + ny (y - y0)) / nz.
                const auto normal = oracle::normal(t);
                const oracle::wide numerator = oracle::wide(t.v[0][2]) * normal[2] -
                                               normal[0] * oracle::wide(x - t.v[0][0]) -
                                               normal[1] * oracle::wide(y - t.v[0][1]);
                const oracle::wide floor = oracle::wide::floor_divide(numerator, normal[2]);
                const std::int64_t height = std::clamp<std::int64_t>(floor.to_int64(), -1, g.extent[2] * unit);
                for (int k = 0; k < g.extent[2]; ++k)
                    if (k * unit + half > height)
                        inside[(static_cast<std::size_t>(k) * ny + static_cast<std::size_t>(j)) * nx +
                               static_cast<std::size_t>(i)] ^= bit;
            }
        }
    }
    return inside;
}

} // namespace properties
