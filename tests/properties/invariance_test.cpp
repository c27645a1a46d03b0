// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The result does not depend on the order of triangles or of a triangle's vertices, its winding, moving grid and mesh
// together, renaming axes, or mirroring. Two rules are asymmetric on purpose, and the tests state them exactly. Thin
// coverage floors a depth that is exactly an integer, so its mirror image is in the voxel on the other side. Ties of
// the dominant axis go to x before y before z, so renaming axes may choose another axis.

#include "properties.hpp"

#include <array>
#include <span>
#include <utility>

namespace properties {
namespace {

class Invariance : public ::testing::TestWithParam<vp::coverage> {};

struct seen {
    glm::vec3 barycentric, normal;
    std::uint32_t front;
};
struct record {
    vp::output<seen> operator()(const vp::fragment<>& f) const {
        return vp::outputs(seen{f.barycentric, f.normal, f.front_facing ? 1u : 0u});
    }
};

struct fragment_at {
    voxel at;
    seen value;
};

std::vector<std::vector<fragment_at>> library_fragments(const grid& g, const std::vector<world_triangle>& triangles,
                                                        vp::coverage rule) {
    const oracle::soup mesh(triangles);
    vp::cpu_backend be(2);
    vp::abuffer<vp::cpu_backend, seen> lists{be};
    vp::voxelize(be, mesh.view(), oracle::as_library(g), vp::passthrough{}, record{}, lists, rule).or_throw();
    std::vector<std::vector<fragment_at>> result(triangles.size());
    for (const auto& [at, fragments] : lists.to_host(be))
        for (const auto& [triangle, value] : fragments) result[triangle].push_back({{at.x, at.y, at.z}, value});
    return result;
}

bool ties_dominant_axis(const snapped_triangle& t) {
    const auto n = oracle::normal(t);
    const auto size = [](const oracle::wide& x) { return x.sign() < 0 ? -x : x; };
    const oracle::wide x = size(n[0]), y = size(n[1]), z = size(n[2]), largest = std::max({x, y, z});
    return (x == largest) + (y == largest) + (z == largest) > 1;
}

TEST_P(Invariance, VertexRotationTurnsTheBarycentricsAndNothingElse) {
    splitmix64 random(61);
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(120));
        auto rotated = triangles;
        for (world_triangle& t : rotated)
            for (int axis = 0; axis < 3; ++axis) {
                std::swap(t.v[0][axis], t.v[1][axis]);
                std::swap(t.v[1][axis], t.v[2][axis]);
            }
        const auto before = library_fragments(where.g, triangles, GetParam());
        const auto after = library_fragments(where.g, rotated, GetParam());
        for (std::size_t n = 0; n < triangles.size(); ++n) {
            ASSERT_EQ(before[n].size(), after[n].size()) << oracle::describe(where.g, triangles[n]);
            for (std::size_t f = 0; f < before[n].size(); ++f) {
                const seen &a = before[n][f].value, &b = after[n][f].value;
                ASSERT_EQ(before[n][f].at, after[n][f].at) << oracle::describe(where.g, triangles[n]);
                ASSERT_EQ(glm::vec3(a.barycentric.y, a.barycentric.z, a.barycentric.x), b.barycentric);
                ASSERT_EQ(a.normal, b.normal);
                ASSERT_EQ(a.front, b.front);
            }
        }
    }
}

TEST_P(Invariance, WindingTurnsTheNormalAndNothingElse) {
    splitmix64 random(62);
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(120));
        auto turned = triangles;
        for (world_triangle& t : turned) std::swap_ranges(t.v[1], t.v[1] + 3, t.v[2]);
        const auto before = library_fragments(where.g, triangles, GetParam());
        const auto after = library_fragments(where.g, turned, GetParam());
        for (std::size_t n = 0; n < triangles.size(); ++n) {
            ASSERT_EQ(before[n].size(), after[n].size()) << oracle::describe(where.g, triangles[n]);
            const bool has_area = oracle::dominant_axis(oracle::snap(where.g, triangles[n].v)) >= 0;
            for (std::size_t f = 0; f < before[n].size(); ++f) {
                const seen &a = before[n][f].value, &b = after[n][f].value;
                ASSERT_EQ(before[n][f].at, after[n][f].at) << oracle::describe(where.g, triangles[n]);
                ASSERT_EQ(glm::vec3(a.barycentric.x, a.barycentric.z, a.barycentric.y), b.barycentric);
                ASSERT_EQ(a.normal, -b.normal);
                ASSERT_EQ(a.front == b.front, !has_area);
            }
        }
    }
}

TEST_P(Invariance, OrderOfTrianglesNumbersThemAnew) {
    splitmix64 random(63);
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(120));
        std::vector<std::size_t> from(triangles.size());
        for (std::size_t n = 0; n < from.size(); ++n) from[n] = n;
        for (std::size_t n = from.size(); n > 1; --n) std::swap(from[n - 1], from[random.below(n)]);
        std::vector<world_triangle> shuffled;
        for (const std::size_t n : from) shuffled.push_back(triangles[n]);
        const auto before = library_sets(where.g, triangles, GetParam(), 1);
        const auto after = library_sets(where.g, shuffled, GetParam(), 3);
        for (std::size_t n = 0; n < from.size(); ++n) ASSERT_TRUE(after[n] == before[from[n]]);
    }
}

// Targets with order-free blends hold the same bytes for any order of the triangles.
TEST_P(Invariance, OrderOfTrianglesKeepsOrderFreeTargets) {
    splitmix64 random(64);
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.dense) continue;
        auto triangles = all_kinds(random, where, scaled(120));
        const vp::grid g = oracle::as_library(where.g);
        const image before = library_image(g, triangles, GetParam());
        for (std::size_t n = triangles.size(); n > 1; --n) std::swap(triangles[n - 1], triangles[random.below(n)]);
        const image after = library_image(g, triangles, GetParam());
        EXPECT_TRUE(before.occupied.elements == after.occupied.elements) << where.name;
        EXPECT_TRUE(before.places.elements == after.places.elements) << where.name;
        const auto bytes = [](const auto& target) { return std::as_bytes(std::span(target.elements)); };
        EXPECT_TRUE(std::ranges::equal(bytes(before.sums), bytes(after.sums))) << where.name;
        EXPECT_TRUE(before.counts == after.counts) << where.name;
    }
}

TEST_P(Invariance, SharedAndShuffledVerticesChangeNothing) {
    splitmix64 random(65);
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(120));
        const oracle::soup plain(triangles);
        std::vector<std::uint32_t> place(plain.positions.size());
        for (std::uint32_t n = 0; n < place.size(); ++n) place[n] = n;
        for (std::size_t n = place.size(); n > 1; --n) std::swap(place[n - 1], place[random.below(n)]);
        std::vector<glm::vec3> positions(plain.positions.size() + 1, glm::vec3(0.0f)); // one unused vertex
        for (std::size_t n = 0; n < place.size(); ++n) positions[place[n]] = plain.positions[n];
        std::vector<glm::uvec3> indices;
        for (const glm::uvec3& t : plain.triangles) {
            indices.emplace_back(place[t.x], place[t.y], place[t.z]);
            if (plain.positions[t.x] == plain.positions[t.y]) indices.back().y = indices.back().x; // equal: shared
        }
        vp::cpu_backend be(2);
        vp::abuffer<vp::cpu_backend, seen> lists{be};
        vp::voxelize(be, vp::mesh_view<>{positions, indices}, oracle::as_library(where.g), vp::passthrough{}, record{},
                     lists, GetParam())
            .or_throw();
        EXPECT_TRUE(oracle::voxels_by_triangle(lists.to_host(be), triangles.size(), oracle::whole_of(where.g)) ==
                    library_sets(where.g, triangles, GetParam()));
    }
}

TEST_P(Invariance, ScalingTheWorldByAPowerOfTwoChangesNothing) {
    splitmix64 random(66);
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(120));
        for (const float factor : {0x1p-20f, 0.5f, 0x1p31f}) {
            grid scaled = where.g;
            for (int axis = 0; axis < 3; ++axis) {
                scaled.origin[axis] *= static_cast<double>(factor);
                scaled.voxel_size[axis] *= static_cast<double>(factor);
            }
            auto larger = triangles;
            for (world_triangle& t : larger)
                for (auto& v : t.v)
                    for (float& x : v) x *= factor;
            EXPECT_TRUE(library_sets(scaled, larger, GetParam()) == library_sets(where.g, triangles, GetParam()))
                << where.name << ' ' << factor;
        }
    }
}

TEST_P(Invariance, MovingByWholeVoxelsMovesTheVoxels) {
    splitmix64 random(67);
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.exact || !where.dense) continue;
        const std::int64_t unit = std::int64_t{1} << oracle::fraction_bits(where.g);
        std::vector<world_triangle> here, there;
        std::vector<std::array<int, 3>> steps;
        for (world_triangle t : all_kinds(random, where, scaled(120))) {
            if (!make_exact(where.g, 1, t)) continue;
            const snapped_triangle s = oracle::snap(where.g, t.v);
            std::array<int, 3> step{};
            std::int64_t moved[3][3];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                step[axis] = static_cast<int>(random.between(-5, 5));
                for (int n = 0; n < 3; ++n) moved[n][axis] = s.v[n][axis] + step[axis] * unit;
            }
            const world_triangle w = from_units(where.g, moved);
            if (!same_units(oracle::snap(where.g, w.v), moved)) continue;
            here.push_back(t);
            there.push_back(w);
            steps.push_back(step);
        }
        EXPECT_GT(here.size(), 12u * static_cast<unsigned>(scaled(120)));
        const auto before = library_sets(where.g, here, GetParam());
        const auto after = library_sets(where.g, there, GetParam());
        const auto inside = [&](const voxel& v) {
            return v.i >= 0 && v.j >= 0 && v.k >= 0 && v.i < where.g.extent[0] && v.j < where.g.extent[1] &&
                   v.k < where.g.extent[2];
        };
        for (std::size_t n = 0; n < here.size(); ++n) {
            voxels expected, found; // voxels inside the grid before and after
            for (voxel v : before[n]) {
                v = {v.i + steps[n][0], v.j + steps[n][1], v.k + steps[n][2]};
                if (inside(v)) expected.push_back(v);
            }
            for (const voxel& v : after[n])
                if (inside({v.i - steps[n][0], v.j - steps[n][1], v.k - steps[n][2]})) found.push_back(v);
            ASSERT_TRUE(found == expected) << oracle::describe(where.g, here[n]);
        }
    }
}

TEST_P(Invariance, RenamingAxesRenamesTheVoxels) {
    splitmix64 random(68);
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(120));
        const auto before = library_sets(where.g, triangles, GetParam());
        std::size_t ties = 0;
        for (const std::array<std::size_t, 3>& to :
             {std::array<std::size_t, 3>{1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}}) {
            grid renamed = where.g;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                renamed.origin[to[axis]] = where.g.origin[axis];
                renamed.voxel_size[to[axis]] = where.g.voxel_size[axis];
                renamed.extent[to[axis]] = where.g.extent[axis];
            }
            auto turned = triangles;
            for (std::size_t n = 0; n < triangles.size(); ++n)
                for (std::size_t v = 0; v < 3; ++v)
                    for (std::size_t axis = 0; axis < 3; ++axis) turned[n].v[v][to[axis]] = triangles[n].v[v][axis];
            const auto after = library_sets(renamed, turned, GetParam());
            for (std::size_t n = 0; n < triangles.size(); ++n) {
                if (GetParam() == vp::coverage::thin) { // a tie of the dominant axis may choose another axis
                    const snapped_triangle t = oracle::snap(where.g, triangles[n].v);
                    if (!t.dropped && ties_dominant_axis(t)) {
                        ++ties;
                        continue;
                    }
                }
                voxels expected;
                for (const voxel& v : before[n]) {
                    const int from[3] = {v.i, v.j, v.k};
                    int index[3];
                    for (std::size_t axis = 0; axis < 3; ++axis) index[to[axis]] = from[axis];
                    expected.push_back({index[0], index[1], index[2]});
                }
                std::sort(expected.begin(), expected.end());
                ASSERT_TRUE(after[n] == expected) << oracle::describe(where.g, triangles[n]);
            }
        }
        EXPECT_LT(ties, 5 * triangles.size() / 2) << where.name; // most were compared
    }
}

TEST_P(Invariance, MirroringMirrorsTheVoxels) {
    splitmix64 random(69);
    std::size_t integer_depths = 0;
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.exact) continue;
        const std::int64_t unit = std::int64_t{1} << oracle::fraction_bits(where.g);
        for (int axis = 0; axis < 3; ++axis) {
            const int last = where.g.extent[axis] - 1;
            std::vector<world_triangle> here, there;
            for (world_triangle t : all_kinds(random, where, scaled(120))) {
                if (!make_exact(where.g, 1, t)) continue;
                std::int64_t mirrored[3][3];
                const snapped_triangle s = oracle::snap(where.g, t.v);
                for (int n = 0; n < 3; ++n) {
                    std::copy(s.v[n], s.v[n] + 3, mirrored[n]);
                    mirrored[n][axis] = where.g.extent[axis] * unit - s.v[n][axis];
                }
                const world_triangle w = from_units(where.g, mirrored);
                if (!same_units(oracle::snap(where.g, w.v), mirrored)) continue;
                here.push_back(t);
                there.push_back(w);
            }
            EXPECT_GT(here.size(), 12u * static_cast<unsigned>(scaled(120))) << where.name;
            const auto before = library_sets(where.g, here, GetParam());
            const auto after = library_sets(where.g, there, GetParam());
            for (std::size_t n = 0; n < here.size(); ++n) {
                const snapped_triangle t = oracle::snap(where.g, here[n].v);
                const bool along_depth = GetParam() == vp::coverage::thin && oracle::dominant_axis(t) == axis;
                voxels expected, found = after[n];
                for (voxel v : before[n]) {
                    int& w = axis == 0 ? v.i : (axis == 1 ? v.j : v.k);
                    if (along_depth) {
                        const oracle::ratio d = oracle::depth(where.g, t, v);
                        const auto parts = oracle::wide::divide_magnitudes(d.numerator, d.denominator);
                        if (parts.remainder.sign() == 0) { // a depth d is in voxel d, its mirror image n - d in n - d
                            ++integer_depths;
                            --w;
                        }
                    }
                    w = last - w;
                    if (w <= last) expected.push_back(v); // d = 0 goes to n, outside
                }
                if (along_depth) // conversely, a depth of n is outside before and 0 in the mirror
                    std::erase_if(found, [&](const voxel& v) {
                        const oracle::ratio d = oracle::depth(where.g, oracle::snap(where.g, there[n].v), v);
                        return d.numerator.sign() == 0;
                    });
                std::sort(expected.begin(), expected.end());
                ASSERT_TRUE(found == expected)
                    << where.name << " axis " << axis << ' ' << oracle::describe(where.g, here[n]);
            }
        }
    }
    if (GetParam() == vp::coverage::thin) {
        EXPECT_GT(integer_depths, 100u);
    }
}

INSTANTIATE_TEST_SUITE_P(AllRules, Invariance,
                         ::testing::Values(vp::coverage::conservative, vp::coverage::thin, vp::coverage::crosshair,
                                           vp::coverage::diagonal),
                         rule_of);

} // namespace
} // namespace properties
