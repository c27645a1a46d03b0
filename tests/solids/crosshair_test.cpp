// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Crosshair coverage beside what is inside: theorems, closed formulas, and that its fragments are those of conservative
// coverage. Which voxels it has is tested against the oracle in tests/oracle, separation and crops in
// tests/properties.

#include "solid_support.hpp"

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

TEST(Crosshair, OneOfTwoNeighboursOfDifferentWindingIsCovered) {
    splitmix64 random(31);
    std::size_t steps = 0;
    for (int round = 0; round < 60; ++round) {
        const glm::ivec3 e(10, 9, 8);
        const vp::grid g = unit_grid(e);
        const mesh m = random_bodies(random, 9, 1 + static_cast<int>(random.below(5)));
        const auto windings = oracle_windings(m, g, skew);
        const voxel_set covered = surface(m, g, vp::coverage::crosshair);
        for (int z = 0; z < e.z; ++z)
            for (int y = 0; y < e.y; ++y)
                for (int x = 0; x < e.x; ++x)
                    for (const glm::ivec3 to : {glm::ivec3(x + 1, y, z), {x, y + 1, z}, {x, y, z + 1}}) {
                        if (to.x == e.x || to.y == e.y || to.z == e.z) continue;
                        const std::size_t a = index(e, x, y, z), b = index(e, to.x, to.y, to.z);
                        if (windings[a] == windings[b]) continue;
                        ++steps;
                        ASSERT_TRUE(covered[a] != 0 || covered[b] != 0)
                            << "round " << round << ": " << x << ' ' << y << ' ' << z;
                    }
    }
    EXPECT_GT(steps, 10000u);
}

TEST(Crosshair, CuttingFacesAtLatticePointsChangesNothing) {
    splitmix64 random(32);
    for (int round = 0; round < 40; ++round) {
        const mesh m = random_bodies(random, 12, 3);
        const vp::grid g = unit_grid(glm::ivec3(13));
        ASSERT_EQ(surface(split_at_lattice_points(m), g, vp::coverage::crosshair),
                  surface(m, g, vp::coverage::crosshair))
            << "round " << round;
    }
}

TEST(Crosshair, ARectangleCoversTheCentresThatItHoldsAndBothSidesOfATie) {
    const vp::grid g = unit_grid(glm::ivec3(12));
    for (int axis = 0; axis < 3; ++axis)
        for (const float at : {3.0f, 3.25f, 3.5f, 4.0f}) {
            mesh m;
            // From 2.5 to 7.5 and from 1.25 to 9: centres 2.5 .. 7.5 and 1.5 .. 8.5.
            for (const auto& [u, v] : {std::pair{2.5f, 1.25f}, {7.5f, 1.25f}, {7.5f, 9.0f}, {2.5f, 9.0f}}) {
                glm::vec3 p{};
                p[axis] = at;
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                m.positions.push_back(p);
            }
            m.triangles = {{0, 1, 2}, {0, 2, 3}};
            const std::size_t layers = at == 3.0f || at == 4.0f ? 2 : 1;
            EXPECT_EQ(count(surface(m, g, vp::coverage::crosshair)), layers * 6 * 8) << axis << ' ' << at;
        }
}

TEST(Crosshair, TrianglesWithoutAreaHaveNoFragments) {
    mesh m;
    m.positions = {{1, 1, 1}, {3, 4, 5}, {5, 7, 9}, {2, 2, 2}};
    m.triangles = {{0, 1, 2}, {3, 3, 3}, {0, 1, 1}};
    vp::counters counts;
    EXPECT_EQ(count(surface(m, unit_grid(glm::ivec3(12)), vp::coverage::crosshair, &counts)), 0u);
    EXPECT_EQ(counts.triangles_zero_area, 3u);
    EXPECT_EQ(counts.triangles_drawn, 0u);
}

// The coverage as an option, or known at compile time; each fragment shaded as the conservative one.
TEST(Crosshair, ItsFragmentsAreSomeOfTheConservativeOnes) {
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
    vp::voxelize<vp::coverage::crosshair>(backend, m.view(), g, vp::passthrough{}, barycentrics{}, known).or_throw();
    const auto some = lists(vp::coverage::crosshair), all = lists(vp::coverage::conservative);
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
    EXPECT_LT(found, all.primitives.size() / 2);
}

} // namespace
} // namespace solids
