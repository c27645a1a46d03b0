// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Tessellated closed meshes stay closed, whatever the levels of their edges, the displacement, and where each triangle
// begins: no edge of the snapped triangles is left over, no row of the solid is open, and thin coverage and the
// crosshair stop every 6-connected path. VOXELPIPE_TEST_SCALE sets the number of meshes: 1 draws 10,000 patches.

#include "amplify_cases.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace {

using namespace programs;
using unit::backend_type;

const glm::ivec3 extent{24, 24, 24};

VOXELPIPE_HD std::uint32_t hash_of(const glm::vec3& p, std::uint32_t seed) {
    std::uint32_t h = seed;
    for (int k = 0; k < 3; ++k) { // -0 is +0
        h ^= vp::core::bit_cast<std::uint32_t>(p[k] == 0.0f ? 0.0f : p[k]);
        h = (h ^ h >> 16) * 0x85ebca6bu;
        h = (h ^ h >> 13) * 0xc2b2ae35u;
    }
    return h ^ h >> 16;
}
// Levels and heights at random, from what an edge, or a point, alone says.
struct rough {
    static constexpr int max_level = 9;
    std::uint32_t seed;
    float amount;
    VOXELPIPE_HD int edge_level(const vp::vertex_output<>& a, const vp::vertex_output<>& b) const {
        return 1 + static_cast<int>((hash_of(a.position, seed) + 3 * hash_of(b.position, seed)) % max_level);
    }
    VOXELPIPE_HD glm::vec3 operator()(const vp::patch_point<vp::no_varyings>& p) const {
        const glm::vec3 at = p.position();
        const float height = static_cast<float>(hash_of(at, seed + 1) >> 8) * 0x1p-24f;
        return vp::exact::along(at, {0.8f, -0.4f, 0.6f}, vp::exact::mul(amount, height));
    }
};

// A closed mesh: a tetrahedron whose triangles are split at random points again and again. Each triangle begins at a
// random corner, and every vertex is doubled for each triangle, with -0 for +0 here and there.
unit::small_mesh closed_mesh(unit::splitmix64& random, int splits) {
    std::vector<glm::vec3> p;
    p.reserve(4 + static_cast<std::size_t>(splits));
    const auto coordinate = [&] { return static_cast<float>(random.uniform(-9.0, 9.0)); };
    for (int i = 0; i < 4; ++i)
        p.emplace_back(coordinate(), random.between(0, 3) == 0 ? 0.0f : coordinate(), coordinate());
    std::vector<glm::uvec3> t{{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    for (int i = 0; i < splits; ++i) {
        const auto at = static_cast<std::size_t>(random.between(0, static_cast<std::int64_t>(t.size()) - 1));
        const glm::uvec3 old = t[at];
        const auto n = static_cast<std::uint32_t>(p.size());
        p.emplace_back(coordinate(), coordinate(), coordinate());
        t[at] = {old.x, old.y, n};
        t.push_back({old.y, old.z, n});
        t.push_back({old.z, old.x, n});
    }
    unit::small_mesh m;
    for (const glm::uvec3& o : t) {
        const auto first = static_cast<std::uint32_t>(m.positions.size());
        const auto turn = static_cast<glm::length_t>(random.between(0, 2));
        for (glm::length_t k = 0; k < 3; ++k) {
            glm::vec3 v = p[o[(k + turn) % 3]];
            if (v.y == 0.0f && random.between(0, 1) == 0) v.y = -0.0f;
            m.positions.push_back(v);
        }
        m.triangles.emplace_back(first, first + 1, first + 2);
    }
    return m;
}

vp::grid centred_grid() {
    vp::grid g = unit::unit_grid(extent);
    g.origin = {-12.0, -12.0, -12.0};
    return g;
}

TEST(Watertight, ClosedPatchesHaveNoOpenEdge) {
    unit::splitmix64 random(11);
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>> fb{backend, extent};
    vp::solid_options options;
    options.rule = vp::fill_rule::nonzero;
    options.repair = vp::repair::close_holes;
    const auto patches = unit::cases(10000);
    std::uint64_t triangles = 0;
    for (std::int64_t drawn = 0; drawn < patches;) {
        const unit::small_mesh m = closed_mesh(random, static_cast<int>(random.between(0, 12)));
        drawn += static_cast<std::int64_t>(m.triangles.size());
        const auto seed = static_cast<std::uint32_t>(random.between(0, 1 << 30));
        const float amount = seed % 3 == 0 ? 0.0f : 0.7f * static_cast<float>(seed % 5);
        const auto mesh = m.on(backend);
        const vp::status s = vp::voxelize_solid(backend, mesh, centred_grid(), vp::passthrough{},
                                                vp::tessellate{rough{seed, amount}}, vp::constant(true), fb, options);
        ASSERT_TRUE(s.ok()) << s.message();
        ASSERT_EQ(s.solid.hole_edges, 0u) << "seed " << seed;
        ASSERT_EQ(s.solid.open_rows, 0u) << "seed " << seed;
        triangles += s.counts.triangles_in;
    }
    EXPECT_GT(triangles, static_cast<std::uint64_t>(20 * patches));
}

// A doubled vertex with another position would leave edges: the test above can fail.
TEST(Watertight, ACrackIsFound) {
    unit::splitmix64 random(12);
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>> fb{backend, extent};
    vp::solid_options options;
    options.repair = vp::repair::close_holes;
    unit::small_mesh m = closed_mesh(random, 3);
    m.positions[1].x += 0.25f;
    const auto mesh = m.on(backend);
    const vp::status s = vp::voxelize_solid(backend, mesh, centred_grid(), vp::passthrough{},
                                            vp::tessellate{rough{5, 1.0f}}, vp::constant(true), fb, options);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_GT(s.solid.hole_edges, 0u);
}

// From voxels of the inside no path of empty face neighbours leads to the outside.
TEST(Watertight, ThinAndCrosshairStopEveryPath) {
    unit::splitmix64 random(13);
    backend_type backend = unit::make_backend();
    for (int i = 0; i < 30; ++i) {
        const vp::coverage rule = i % 2 == 0 ? vp::coverage::thin : vp::coverage::crosshair;
        const unit::small_mesh m = closed_mesh(random, 2);
        const auto seed = static_cast<std::uint32_t>(random.between(0, 1 << 30));
        const auto mesh = m.on(backend);
        const vp::tessellate program{rough{seed, 1.5f}};
        const vp::grid g = centred_grid();
        vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>> walls{backend, extent},
            inside{backend, extent};
        ASSERT_TRUE(vp::voxelize(backend, mesh, g, vp::passthrough{}, program, vp::constant(true), walls, rule).ok());
        vp::solid_options options;
        options.rule = vp::fill_rule::nonzero;
        ASSERT_TRUE(
            vp::voxelize_solid(backend, mesh, g, vp::passthrough{}, program, vp::constant(true), inside, options).ok());
        const auto wall = vp::get<0>(walls).to_host_target(backend), solid = vp::get<0>(inside).to_host_target(backend);
        std::vector<std::uint8_t> seen(static_cast<std::size_t>(extent.x * extent.y * extent.z));
        std::vector<glm::ivec3> open{{0, 0, 0}};
        ASSERT_FALSE(wall(0, 0, 0));
        seen[0] = 1;
        while (!open.empty()) {
            const glm::ivec3 at = open.back();
            open.pop_back();
            // A centre inside is reached only through a wall.
            ASSERT_FALSE(solid(at.x, at.y, at.z)) << "seed " << seed;
            for (int k = 0; k < 6; ++k) {
                glm::ivec3 next = at;
                next[k / 2] += k % 2 == 0 ? 1 : -1;
                bool is_in = true;
                for (int a = 0; a < 3; ++a) is_in = is_in && next[a] >= 0 && next[a] < extent[a];
                if (!is_in || wall(next.x, next.y, next.z)) continue;
                auto& mark = seen[unit::linear(extent, next)];
                if (mark == 0) open.push_back(next);
                mark = 1;
            }
        }
    }
}

} // namespace
