// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Crosshair and diagonal coverage beside what is inside: theorems, closed formulas, and that their fragments are those
// of conservative coverage. Which voxels they have is tested against the oracle in tests/oracle, separation and crops
// in tests/properties.

#include "solid_support.hpp"

#include <cstdlib>
#include <string>
#include <utility>

namespace solids {
namespace {

struct barycentrics {
    template <class Fragment>
    vp::output<glm::vec3> operator()(const Fragment& f) const {
        return {{f.barycentric}};
    }
};

voxel_set surface(const mesh& m, const vp::grid& g, vp::coverage rule, vp::counters* counts = nullptr) {
    vp::cpu_backend backend{2};
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint8_t, vp::blend::bit_or>> fb{backend, g.extent};
    const vp::status s = vp::voxelize(backend, m.view(), g, vp::passthrough{}, vp::constant(std::uint8_t{1}), fb, rule);
    EXPECT_TRUE(s.ok()) << s.message();
    if (counts != nullptr) *counts = s.counts;
    return vp::get<0>(fb).to_host(backend);
}

constexpr vp::coverage by_arms[] = {vp::coverage::crosshair, vp::coverage::diagonal};

// Crosshair: neighbours by a face; diagonal: by a face, an edge or a corner.
TEST(Arms, OneOfTwoNeighboursOfDifferentWindingIsCovered) {
    splitmix64 random(31);
    std::size_t steps[2] = {};
    for (int round = 0; round < 60; ++round) {
        const glm::ivec3 e(10, 9, 8);
        const vp::grid g = unit_grid(e);
        const mesh m = random_bodies(random, 9, 1 + static_cast<int>(random.below(5)));
        const auto windings = oracle_windings(m, g, skew);
        for (const vp::coverage rule : by_arms) {
            const bool is_diagonal = rule == vp::coverage::diagonal;
            const voxel_set covered = surface(m, g, rule);
            const auto check = [&](const glm::ivec3& from, const glm::ivec3& to) {
                if (glm::min(to, glm::ivec3(0)) != glm::ivec3(0) || glm::min(to, e - 1) != to) return;
                const std::size_t a = index(e, from.x, from.y, from.z), b = index(e, to.x, to.y, to.z);
                if (windings[a] == windings[b]) return;
                ++steps[is_diagonal ? 1 : 0];
                ASSERT_TRUE(covered[a] != 0 || covered[b] != 0)
                    << "round " << round << ": " << from.x << ' ' << from.y << ' ' << from.z;
            };
            for (std::size_t i = 0; i < windings.size(); ++i) {
                const auto at = static_cast<int>(i);
                const glm::ivec3 from(at % e.x, at / e.x % e.y, at / (e.x * e.y));
                for (int step = 14; step < 27; ++step) { // one of each two opposite neighbours
                    const glm::ivec3 by(step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1);
                    if (is_diagonal || std::abs(by.x) + std::abs(by.y) + std::abs(by.z) == 1) check(from, from + by);
                }
            }
        }
    }
    EXPECT_GT(steps[0], 10000u);
    EXPECT_GT(steps[1], 40000u);
}

TEST(Arms, CuttingFacesAtLatticePointsChangesNothing) {
    splitmix64 random(32);
    for (int round = 0; round < 40; ++round) {
        const mesh m = random_bodies(random, 12, 3);
        const vp::grid g = unit_grid(glm::ivec3(13));
        for (const vp::coverage rule : by_arms)
            ASSERT_EQ(surface(split_at_lattice_points(m), g, rule), surface(m, g, rule)) << "round " << round;
    }
}

// A sliver of the plane x + z = 4 along two edges of voxel (1, 1, 2), whose diagonals there lie in the plane: the
// voxels below and above have a corner in it, and are the two ends of one column.
TEST(Diagonal, AColumnMayHaveAGap) {
    const vp::grid g = unit_grid(glm::ivec3(6));
    mesh m;
    m.positions = {{2, 2, 2}, {1, 2, 3}, {1.5f, 1.9375f, 2.5f}};
    m.triangles = {{0, 1, 2}};
    const voxel_set covered = surface(m, g, vp::coverage::diagonal);
    const glm::ivec3 e = g.extent;
    EXPECT_NE(covered[index(e, 1, 1, 1)], 0);
    EXPECT_EQ(covered[index(e, 1, 1, 2)], 0);
    EXPECT_NE(covered[index(e, 1, 1, 3)], 0);
    vp::cpu_backend backend{1};
    vp::abuffer<vp::cpu_backend, glm::vec3> lists{backend};
    vp::voxelize(backend, m.view(), g, vp::passthrough{}, barycentrics{}, lists, vp::coverage::diagonal).or_throw();
    EXPECT_EQ(lists.to_host(backend).primitives.size(), count(covered));
}

// Two triangles at `at` along an axis, from `low` to `high` along the next two.
mesh rectangle(int axis, float at, const glm::vec2& low, const glm::vec2& high) {
    mesh m;
    for (const glm::vec2& corner : {low, glm::vec2(high.x, low.y), high, glm::vec2(low.x, high.y)}) {
        glm::vec3 p{};
        p[axis] = at;
        p[(axis + 1) % 3] = corner.x;
        p[(axis + 2) % 3] = corner.y;
        m.positions.push_back(p);
    }
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    return m;
}

TEST(Crosshair, ARectangleCoversTheCentresThatItHoldsAndBothSidesOfATie) {
    const vp::grid g = unit_grid(glm::ivec3(12));
    for (int axis = 0; axis < 3; ++axis)
        for (const float at : {3.0f, 3.25f, 3.5f, 4.0f}) {
            // Centres 2.5 .. 7.5 and 1.5 .. 8.5.
            const mesh m = rectangle(axis, at, {2.5f, 1.25f}, {7.5f, 9.0f});
            const std::size_t layers = at == 3.0f || at == 4.0f ? 2 : 1;
            EXPECT_EQ(count(surface(m, g, vp::coverage::crosshair)), layers * 6 * 8) << axis << ' ' << at;
        }
}

// Diagonals meet a plane of constant w = at, 3 < at < 4, at their points of height at - 3 above the voxel's floor: in
// each unit square two on either diagonal, or at 3.5 the centre, four times.
TEST(Diagonal, ARectangleCoversTheDiagonalsThatItHolds) {
    const vp::grid g = unit_grid(glm::ivec3(12));
    for (int axis = 0; axis < 3; ++axis)
        for (const float at : {3.0f, 3.25f, 3.5f, 4.0f}) {
            const mesh m = rectangle(axis, at, {2.5f, 1.75f}, {7.5f, 9.0f});
            // Points along u: integers at 3 and 4, i + 0.25 and i + 0.75 at 3.25, i + 0.5 at 3.5. A voxel is covered if
            // it has one within the rectangle along u, and one along v. A corner belongs to two voxels a side.
            const std::size_t layers = at == 3.0f || at == 4.0f ? 2 : 1;
            const std::size_t along_u = 6;                              // voxels 2 .. 7
            const std::size_t along_v = layers == 2   ? 9               // corners 2 .. 9: voxels 1 .. 9
                                        : at == 3.25f ? 8               // 1.75 .. 8.75: voxels 1 .. 8
                                                      : std::size_t{7}; // 2.5 .. 8.5: voxels 2 .. 8
            EXPECT_EQ(count(surface(m, g, vp::coverage::diagonal)), layers * along_u * along_v) << axis << ' ' << at;
        }
}

TEST(Arms, TrianglesWithoutAreaHaveNoFragments) {
    mesh m;
    m.positions = {{1, 1, 1}, {3, 4, 5}, {5, 7, 9}, {2, 2, 2}};
    m.triangles = {{0, 1, 2}, {3, 3, 3}, {0, 1, 1}};
    for (const vp::coverage rule : by_arms) {
        vp::counters counts;
        EXPECT_EQ(count(surface(m, unit_grid(glm::ivec3(12)), rule, &counts)), 0u);
        EXPECT_EQ(counts.triangles_zero_area, 3u);
        EXPECT_EQ(counts.triangles_drawn, 0u);
    }
}

// The coverage as an option, or known at compile time; each fragment shaded as the conservative one.
template <vp::coverage Rule>
void expect_some_of_the_conservative_fragments(std::size_t most_percent) {
    splitmix64 random(33);
    const vp::grid g = unit_grid({24, 20, 16});
    mesh m = sphere({11.3f, 9.1f, 8.2f}, 7.5f, 3);
    m.add(random_bodies(random, 16, 3));
    vp::cpu_backend backend{2};
    const auto lists = [&](vp::coverage rule) {
        vp::abuffer<vp::cpu_backend, glm::vec3> made{backend};
        vp::voxelize(backend, m.view(), g, vp::passthrough{}, barycentrics{}, made, rule).or_throw();
        return made.to_host(backend);
    };
    vp::abuffer<vp::cpu_backend, glm::vec3> known{backend};
    vp::voxelize<Rule>(backend, m.view(), g, vp::passthrough{}, barycentrics{}, known).or_throw();
    const auto some = lists(Rule), all = lists(vp::coverage::conservative);
    EXPECT_EQ(known.to_host(backend).voxels, some.voxels);
    EXPECT_EQ(known.to_host(backend).primitives, some.primitives);
    std::size_t found = 0;
    for (const auto& [at, fragments] : some)
        for (const auto& f : fragments)
            for (const auto& other : all.find(at)) {
                if (other.primitive != f.primitive) continue;
                ++found;
                ASSERT_EQ(other.value, f.value);
            }
    EXPECT_EQ(found, some.primitives.size());
    EXPECT_GT(found, 500u);
    EXPECT_LT(found * 100, all.primitives.size() * most_percent);
}
TEST(Arms, TheirFragmentsAreSomeOfTheConservativeOnes) {
    expect_some_of_the_conservative_fragments<vp::coverage::crosshair>(50);
    expect_some_of_the_conservative_fragments<vp::coverage::diagonal>(100);
}

} // namespace
} // namespace solids
