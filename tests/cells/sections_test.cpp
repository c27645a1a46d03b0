// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Closed formulas of bodies that lie obliquely: apertures over a plane add up to the cross-section of tilted boxes and
// cylinders, and tori have the volume, the area and the sections of their polyhedron.
#include "cell_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

namespace {

using namespace cells;
using std::numbers::pi;

// The sums of the lower apertures of each plane across an axis, in faces, and how many of these are cut.
struct plane_sums {
    std::vector<double> area;
    std::vector<int> cut;
};
plane_sums sums_of_planes(const mesh& m, const vp::grid& g, int axis) {
    const cell_values c = library_cells(m, g, {.axis = axis});
    EXPECT_EQ(c.status.cells.open_edges, 0u);
    const auto planes = static_cast<std::size_t>(g.extent[axis]);
    std::vector<std::int64_t> units(planes);
    plane_sums sums{{}, std::vector<int>(planes)};
    for (int z = 0; z < g.extent.z; ++z)
        for (int y = 0; y < g.extent.y; ++y)
            for (int x = 0; x < g.extent.x; ++x) {
                const std::size_t at = c.index(x, y, z);
                const auto plane = static_cast<std::size_t>(axis == 0 ? x : axis == 1 ? y : z);
                units[plane] += c.apertures[at];
                sums.cut[plane] += c.apertures[at] % whole_cell != 0 ? 1 : 0;
            }
    for (const std::int64_t n : units) sums.area.push_back(std::ldexp(static_cast<double>(n), -44));
    return sums;
}

// A box with edges along any three vectors: the area of its section with a plane is its volume times the density of the
// sum of three uniform numbers, which is a spline of squares. All numbers are integers until the last quotient.
TEST(CellSections, OfTiltedBoxesHaveTheirArea) {
    splitmix64 random(83);
    constexpr int bits = 8;
    std::size_t planes = 0;
    for (int round = 0; round < 24; ++round) {
        std::array<std::array<std::int64_t, 3>, 3> edge{};
        for (auto& e : edge)
            for (auto& c : e) c = (random.one_in(2) ? 1 : -1) * random.between(100, 900);
        const auto minor = [&](std::size_t i, std::size_t j) {
            return edge[1][i] * edge[2][j] - edge[1][j] * edge[2][i];
        };
        std::int64_t det = edge[0][0] * minor(1, 2) + edge[0][1] * minor(2, 0) + edge[0][2] * minor(0, 1);
        if (det < 0) {
            std::swap(edge[0], edge[1]);
            det = -det;
        }
        if (det < 1'000'000) continue; // flat
        std::array<std::int64_t, 3> origin{};
        for (std::size_t i = 0; i < 3; ++i) {
            for (const auto& e : edge) origin[i] -= std::min<std::int64_t>(e[i], 0);
            origin[i] += random.between(0, 255);
        }
        mesh m = solids::box({0, 0, 0}, {1, 1, 1});
        for (glm::vec3& p : m.positions) {
            const glm::vec3 along = p;
            for (int i = 0; i < 3; ++i) {
                const auto a = static_cast<std::size_t>(i);
                std::int64_t at = origin[a];
                for (int e = 0; e < 3; ++e) at += along[e] != 0.0F ? edge[static_cast<std::size_t>(e)][a] : 0;
                p[i] = std::ldexp(static_cast<float>(at), -bits);
            }
        }
        const vp::grid g = solids::unit_grid(glm::ivec3(13));
        for (int axis = 0; axis < 3; ++axis) {
            const plane_sums found = sums_of_planes(m, g, axis);
            std::array<std::int64_t, 3> width{}; // of the edges along the axis
            std::int64_t low = origin[static_cast<std::size_t>(axis)];
            for (std::size_t e = 0; e < 3; ++e) {
                const std::int64_t w = edge[e][static_cast<std::size_t>(axis)];
                width[e] = std::abs(w);
                low += std::min<std::int64_t>(w, 0);
            }
            for (std::size_t plane = 0; plane < found.area.size(); ++plane) {
                std::int64_t spline = 0;
                for (unsigned subset = 0; subset < 8; ++subset) {
                    std::int64_t at = (static_cast<std::int64_t>(plane) << bits) - low;
                    bool is_odd = false;
                    for (std::size_t e = 0; e < 3; ++e)
                        if ((subset >> e & 1u) != 0) {
                            at -= width[e];
                            is_odd = !is_odd;
                        }
                    if (at > 0) spline += is_odd ? -at * at : at * at;
                }
                const long double area =
                    static_cast<long double>(det) * static_cast<long double>(spline) /
                    (2.0L * static_cast<long double>(width[0] * width[1]) * static_cast<long double>(width[2]));
                const double margin = face_bound * 12 * found.cut[plane] * 0x1p-44 + 1e-13;
                EXPECT_NEAR(found.area[plane], static_cast<double>(std::ldexp(area, -2 * bits)), margin)
                    << round << ' ' << axis << ' ' << plane;
                planes += found.cut[plane] > 4 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(planes, 200u);
}

// A cylinder with an oblique axis: planes that meet its sides alone cut it in its base's area times the ratio of the
// generator's components.
TEST(CellSections, OfTiltedCylindersHaveTheirArea) {
    constexpr int sides = 24, bits = 10;
    constexpr std::array<std::int64_t, 3> along{9 << bits, 2 << bits, (7 << bits) + 300};
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<std::array<std::int64_t, 3>> base;
        long double twice = 0.0L; // the base's area
        for (int i = 0; i < sides; ++i) {
            const double angle = 2 * pi * i / sides;
            base.push_back({std::llrint(std::ldexp(2.3 + 1.9 * std::cos(angle), bits)),
                            std::llrint(std::ldexp(4.4 + 1.9 * std::sin(angle), bits)), (1 << bits) + 77});
        }
        mesh m;
        const auto add = [&](std::array<std::int64_t, 3> p) {
            std::rotate(p.begin(), p.begin() + (3 - axis) % 3, p.end());
            m.positions.emplace_back(std::ldexp(static_cast<float>(p[0]), -bits),
                                     std::ldexp(static_cast<float>(p[1]), -bits),
                                     std::ldexp(static_cast<float>(p[2]), -bits));
        };
        for (std::uint32_t i = 0; i < sides; ++i) {
            const std::uint32_t next = (i + 1) % sides;
            const auto &p = base[i], &q = base[next];
            twice += static_cast<long double>(p[0] * q[1] - p[1] * q[0]);
            add(p);
            add({p[0] + along[0], p[1] + along[1], p[2] + along[2]});
            m.triangles.insert(m.triangles.end(), {{2 * i, 2 * next, 2 * next + 1}, {2 * i, 2 * next + 1, 2 * i + 1}});
            if (i >= 2) m.triangles.insert(m.triangles.end(), {{0, 2 * i, 2 * i - 2}, {1, 2 * i - 1, 2 * i + 1}});
        }
        const plane_sums found = sums_of_planes(m, solids::unit_grid(glm::ivec3(15)), axis);
        const long double area = std::ldexp(twice / 2.0L, -2 * bits) * static_cast<long double>(along[2]) /
                                 static_cast<long double>(along[0]);
        EXPECT_NEAR(static_cast<double>(area), pi * 1.9 * 1.9 * 7.3 / 9, 0.2); // the circle's
        for (std::size_t plane = 5; plane <= 9; ++plane) {                     // between the two ends
            EXPECT_GT(found.cut[plane], 8);
            const double margin = face_bound * static_cast<double>(m.triangles.size()) * found.cut[plane] * 0x1p-44;
            EXPECT_NEAR(found.area[plane], static_cast<double>(area), margin) << axis << ' ' << plane;
        }
    }
}

struct area_shader {
    using fragment = vp::measured_cell<vp::cell_value::area>;
    vp::output<double> operator()(const fragment& f) const { return vp::outputs(f.area); }
};

// A torus of `rings` meridians, each a regular polygon: between two meridians all sides are plane trapezoids.
TEST(CellSections, ToriHaveThoseOfTheirPolyhedron) {
    constexpr int rings = 40, sides = 18;
    constexpr double big = 4.7, small = 1.9;
    const double turn = 2 * pi / rings, step = 2 * pi / sides;
    const glm::dvec3 centre(7.13, 7.31, 7.27);
    for (int axis = 0; axis < 3; ++axis) { // that the torus goes round
        mesh m;
        for (int i = 0; i < rings; ++i)
            for (int k = 0; k < sides; ++k) {
                const double out = big + small * std::cos(step * k), up = small * std::sin(step * k);
                glm::dvec3 p(0);
                p[(axis + 1) % 3] = out * std::cos(turn * i);
                p[(axis + 2) % 3] = out * std::sin(turn * i);
                p[axis] = up;
                m.positions.emplace_back(p + centre);
            }
        const auto vertex = [](int i, int k) { return static_cast<std::uint32_t>(i % rings * sides + k % sides); };
        for (int i = 0; i < rings; ++i)
            for (int k = 0; k < sides; ++k) {
                m.triangles.push_back({vertex(i, k), vertex(i + 1, k), vertex(i + 1, k + 1)});
                m.triangles.push_back({vertex(i, k), vertex(i + 1, k + 1), vertex(i, k + 1)});
            }
        const vp::grid g = solids::unit_grid(glm::ivec3(15));
        const cell_values c = library_cells(m, g, {.axis = (axis + 1) % 3});
        EXPECT_EQ(c.status.cells.open_edges, 0u);
        EXPECT_EQ(c.status.cells.below_zero + c.status.cells.above_one, 0u);

        const double of_polygon = sides / 2.0 * small * small * std::sin(step);
        double area = 0;
        for (int k = 0; k < sides; ++k) {
            const double near = 2 * std::sin(turn / 2) * (big + small * std::cos(step * k)),
                         far = 2 * std::sin(turn / 2) * (big + small * std::cos(step * (k + 1))),
                         leg = 2 * small * std::sin(step / 2);
            area += rings * (near + far) / 2 * std::sqrt(leg * leg - (far - near) * (far - near) / 4);
        }
        const double volume = rings * std::sin(turn) * big * of_polygon;
        EXPECT_NEAR(volume, 2 * pi * pi * big * small * small, 0.04 * volume); // the smooth torus'
        const double snap = 0x1p-16; // vertices are off by less: each moves its triangles by as much
        EXPECT_NEAR(c.status.cells.volume(), volume, area * snap);

        vp::cpu_backend backend(2);
        vp::framebuffer<vp::cpu_backend, vp::target<double, vp::blend::replace>> fb(backend, g.extent);
        vp::voxelize_cells(backend, m.view(), g, vp::passthrough{}, area_shader{}, fb).or_throw();
        double found_area = 0;
        for (const double a : vp::get<0>(fb).to_host(backend)) found_area += a;
        EXPECT_NEAR(found_area, area, area * 0.1 * snap * rings);

        const plane_sums sections = sums_of_planes(m, g, axis);
        for (int plane = 0; plane < 15; ++plane) {
            const double height = plane - centre[axis];
            double half = 0; // of the polygon's width there
            for (int k = 0; k < sides; ++k) {
                const double from = small * std::sin(step * k), to = small * std::sin(step * (k + 1));
                if ((from <= height) == (to <= height)) continue;
                const double part = (height - from) / (to - from);
                half = std::max(half, small * ((1 - part) * std::cos(step * k) + part * std::cos(step * (k + 1))));
            }
            const double section = 2 * rings * std::sin(turn) * big * half;
            EXPECT_NEAR(sections.area[static_cast<std::size_t>(plane)], section, 100 * snap) << axis << ' ' << plane;
            EXPECT_EQ(section > 0, plane >= 6 && plane <= 9);
        }
    }
}

} // namespace
