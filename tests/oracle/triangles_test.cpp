// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The generator: triangles of every class have the property of its name.

#include "triangles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace oracle {
namespace {

constexpr int per_grid = 400;

struct sample {
    const test_grid& where;
    world_triangle world;
    snapped_triangle t;
    std::int64_t unit; // fixed-point units in a voxel
};

template <class Check>
void for_each(triangle_class kind, bool exact_grids_only, Check check) {
    splitmix64 random(100 + static_cast<std::uint64_t>(kind));
    for (const test_grid& where : test_grids()) {
        if (exact_grids_only && !where.exact) continue;
        for (int n = 0; n < per_grid; ++n) {
            const world_triangle world = make_triangle(random, where, kind);
            check(sample{where, world, snap(where.g, world.v), std::int64_t{1} << fraction_bits(where.g)});
        }
    }
}

int on_faces(const sample& s, int vertex) { // how many coordinates are multiples of a voxel
    return static_cast<int>(
        std::count_if(s.t.v[vertex], s.t.v[vertex] + 3, [&](std::int64_t q) { return q % s.unit == 0; }));
}

bool has_area(const snapped_triangle& t) { return dominant_axis(t) >= 0; }

bool equal(const snapped_triangle& t, int a, int b) { return std::equal(t.v[a], t.v[a] + 3, t.v[b]); }

TEST(Triangles, SameSeedSameTriangles) {
    splitmix64 a(9), b(9), other(10);
    int differ = 0;
    for (const triangle_class kind : all_triangle_classes)
        for (const test_grid& where : test_grids()) {
            const world_triangle first = make_triangle(a, where, kind);
            const world_triangle second = make_triangle(b, where, kind);
            const world_triangle third = make_triangle(other, where, kind);
            EXPECT_EQ(std::memcmp(&first, &second, sizeof first), 0) << name(kind);
            differ += std::memcmp(&first, &third, sizeof first) != 0;
        }
    EXPECT_GT(differ, 150);
}

TEST(Triangles, OnlyThoseOfTheDroppedClassAreDropped) {
    for (const triangle_class kind : all_triangle_classes)
        for_each(kind, false, [&](const sample& s) {
            ASSERT_EQ(s.t.dropped, kind == triangle_class::dropped) << name(kind) << " in " << s.where.name;
        });
}

TEST(Triangles, ExactGridsSnapLatticePositionsToThemselves) {
    splitmix64 random(12);
    for (const test_grid& where : test_grids()) {
        if (!where.exact) continue;
        for (int n = 0; n < 1000; ++n) {
            std::array<double, 3> units[3];
            float v[3][3];
            for (int vertex = 0; vertex < 3; ++vertex) {
                for (std::size_t axis = 0; axis < 3; ++axis)
                    units[vertex][axis] = static_cast<double>(
                        random.between(0, std::int64_t{where.g.extent[axis]} << fraction_bits(where.g)));
                const auto world = to_world(where.g, units[vertex]);
                std::copy(world.begin(), world.end(), v[vertex]);
            }
            const snapped_triangle t = snap(where.g, v);
            for (int vertex = 0; vertex < 3; ++vertex)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    ASSERT_EQ(static_cast<double>(t.v[vertex][axis]), units[vertex][axis]) << where.name;
        }
    }
}

TEST(Triangles, ZeroAreaClassesHaveNoArea) {
    for_each(triangle_class::point, true, [](const sample& s) { ASSERT_TRUE(equal(s.t, 0, 1) && equal(s.t, 1, 2)); });
    for_each(triangle_class::segment, false, [](const sample& s) {
        ASSERT_TRUE(equal(s.t, 0, 1) || equal(s.t, 1, 2) || equal(s.t, 0, 2));
        ASSERT_FALSE(has_area(s.t));
    });
    int all = 0, flat = 0; // a few lie outside, where floats are coarser than the lattice
    for_each(triangle_class::collinear, true, [&](const sample& s) {
        ++all;
        flat += !has_area(s.t) && !equal(s.t, 0, 1);
    });
    EXPECT_GT(flat, all * 8 / 10);
}

TEST(Triangles, BoundaryClassesAreOnTheBoundary) {
    const auto share = [](triangle_class kind, auto what) {
        int all = 0, yes = 0;
        for_each(kind, true, [&](const sample& s) {
            ++all;
            yes += what(s) ? 1 : 0;
        });
        return static_cast<double>(yes) / all;
    };
    const auto every_vertex = [](int coordinates) {
        return [coordinates](const sample& s) {
            return on_faces(s, 0) >= coordinates && on_faces(s, 1) >= coordinates && on_faces(s, 2) >= coordinates;
        };
    };
    const auto vertices_in_one_face = [](int wanted) {
        return [wanted](const sample& s) {
            for (int axis = 0; axis < 3; ++axis)
                for (int vertex = 0; vertex < 3; ++vertex) {
                    const std::int64_t plane = s.t.v[vertex][axis];
                    if (plane % s.unit != 0) continue;
                    int in = 0;
                    for (const auto& v : s.t.v) in += v[axis] == plane;
                    if (in >= wanted) return true;
                }
            return false;
        };
    };
    EXPECT_GT(share(triangle_class::corner_vertices, every_vertex(3)), 0.95);
    EXPECT_GT(share(triangle_class::edge_vertices, every_vertex(2)), 0.9);
    EXPECT_GT(share(triangle_class::face_vertices, every_vertex(1)), 0.9);
    EXPECT_GT(share(triangle_class::edge_in_face, vertices_in_one_face(2)), 0.95);
    EXPECT_GT(share(triangle_class::face_plane, vertices_in_one_face(3)), 0.95);
    EXPECT_GT(share(triangle_class::grazing,
                    [&](const sample& s) { // exactly touches a box that it hardly enters
                        return !conservative(s.where.g, s.t).empty();
                    }),
              0.8);
}

TEST(Triangles, DiagonalPlanesTieTheDominantAxis) {
    int ties = 0, all = 0;
    for_each(triangle_class::diagonal_plane, true, [&](const sample& s) {
        const auto n = normal(s.t);
        const auto size = [](const wide& x) { return x.sign() < 0 ? -x : x; };
        const wide x = size(n[0]), y = size(n[1]), z = size(n[2]);
        const wide largest = std::max({x, y, z});
        ++all;
        ties += has_area(s.t) && (x == largest) + (y == largest) + (z == largest) >= 2;
    });
    EXPECT_GT(ties, all / 2);
}

TEST(Triangles, HalfLatticeReachesExactIntegerDepths) {
    int exact = 0;
    for_each(triangle_class::half_lattice, true, [&](const sample& s) {
        if (!has_area(s.t) || s.where.g.extent[0] == 1) return;
        for (const voxel& at : thin(s.where.g, s.t)) {
            const ratio d = depth(s.where.g, s.t, at);
            if (wide::divide_magnitudes(d.numerator, d.denominator).remainder.sign() == 0) {
                ++exact;
                return;
            }
        }
    });
    EXPECT_GT(exact, 300);
}

TEST(Triangles, SlenderClassesAreSlender) {
    for (const triangle_class kind : {triangle_class::sliver, triangle_class::needle}) {
        int slender = 0, all = 0;
        for_each(kind, false, [&](const sample& s) {
            double longest = 0;
            double n2 = 0;
            for (int a = 0; a < 3; ++a) {
                double length = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const auto d = static_cast<double>(s.t.v[a][axis] - s.t.v[(a + 1) % 3][axis]);
                    length += d * d;
                }
                longest = std::max(longest, length);
            }
            for (const wide& c : normal(s.t))
                n2 += static_cast<double>(c.to_int128()) * static_cast<double>(c.to_int128());
            ++all;
            slender += std::sqrt(n2) <= 0.25 * longest; // height below a quarter of the length
        });
        EXPECT_GT(slender, all * 7 / 10) << name(kind);
    }
}

TEST(Triangles, ScalesRunFromAThousandthVoxelToAThousandGrids) {
    double smallest = 1e30, largest = 0, farthest = 0;
    const auto measure = [&](const sample& s) {
        double size = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const auto [lo, hi] = std::minmax({s.t.v[0][axis], s.t.v[1][axis], s.t.v[2][axis]});
            size = std::max(size, static_cast<double>(hi - lo) / static_cast<double>(s.unit));
            farthest =
                std::max(farthest, std::max(std::fabs(static_cast<double>(lo)), std::fabs(static_cast<double>(hi))));
        }
        smallest = std::min(smallest, size);
        largest = std::max(largest, size / std::max({s.where.g.extent[0], s.where.g.extent[1], s.where.g.extent[2]}));
    };
    for_each(triangle_class::small, true, measure);
    for_each(triangle_class::large, true, measure);
    EXPECT_LT(smallest, 2e-3);
    EXPECT_GT(largest, 5e2);
    for_each(triangle_class::far_away, false, measure);
    EXPECT_GT(farthest, 0x1p39);
}

TEST(Triangles, PowersOfTwoHaveBoundingBoxesOfPowersOfTwo) {
    int powers = 0, all = 0;
    for_each(triangle_class::powers_of_two, true, [&](const sample& s) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto [lo, hi] = std::minmax({s.t.v[0][axis], s.t.v[1][axis], s.t.v[2][axis]});
            const std::int64_t size = hi - lo;
            std::int64_t power = 1;
            while (power + 2 < size) power *= 2;
            ++all;
            powers += std::abs(power - size) <= 2;
        }
    });
    EXPECT_GT(powers, all / 2); // beyond the grid floats are coarser
}

TEST(Triangles, OfAFocusLieInThatPart) {
    splitmix64 random(13);
    const test_grid where = focused(test_grids()[8], {{600, 10, 300}, {640, 30, 340}});
    EXPECT_TRUE(where.dense);
    int hits = 0;
    for (int n = 0; n < 300; ++n) {
        const world_triangle w = make_triangle(random, where, triangle_class::medium);
        hits += !conservative(where.g, snap(where.g, w.v), where.focus).empty();
    }
    EXPECT_GT(hits, 250);
}

TEST(Triangles, OutsideClassesLieOutside) {
    int inside_and_out = 0, all = 0, far_hits = 0;
    for_each(triangle_class::partly_outside, false, [&](const sample& s) {
        bool in = false, out = false;
        for (const auto& v : s.t.v)
            for (int axis = 0; axis < 3; ++axis)
                (v[axis] < 0 || v[axis] > s.where.g.extent[axis] * s.unit ? out : in) = true;
        ++all;
        inside_and_out += in && out;
    });
    EXPECT_GT(inside_and_out, all / 2);
    for_each(triangle_class::wholly_outside, true, [&](const sample& s) {
        const bool beside = [&] { // some axis separates it from the open grid
            for (int axis = 0; axis < 3; ++axis) {
                const auto [lo, hi] = std::minmax({s.t.v[0][axis], s.t.v[1][axis], s.t.v[2][axis]});
                if (hi <= 0 || lo >= s.where.g.extent[axis] * s.unit) return true;
            }
            return false;
        }();
        ASSERT_TRUE(beside) << s.where.name;
    });
    for_each(triangle_class::far_away, false, [&](const sample& s) {
        if (s.where.dense) far_hits += !conservative(s.where.g, s.t).empty();
    });
    EXPECT_GT(far_hits, 500);
}

} // namespace
} // namespace oracle
