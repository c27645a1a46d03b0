// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The tree that repair::winding asks, and its bricks: against the whole sum of the solid angles.

#include "winding_meshes.hpp"

#include <voxelpipe/solid/core/winding_bricks.hpp>
#include <voxelpipe/solid/core/winding_lids.hpp>

#include <cmath>
#include <cstdlib>
#include <vector>

namespace solids {
namespace {

namespace core = voxelpipe::core;

// An open mesh on a grid, its cones, and what the definition says of a sample.
struct open_mesh {
    vp::grid g;
    std::vector<core::snapped_position> positions;
    core::hole_cones cones;
    core::winding_tree tree;

    open_mesh(const mesh& m, const vp::grid& grid, std::uint64_t max_hole_edges = ~std::uint64_t{0}) : g(grid) {
        std::vector<glm::uvec3> corners;
        for (const auto& t : snap(m, g)) {
            const auto first = static_cast<std::uint32_t>(positions.size());
            for (const auto& v : t.v) positions.push_back({v[0], v[1], v[2]});
            corners.push_back({first, first + 1, first + 2});
        }
        const auto n = static_cast<std::uint32_t>(corners.size());
        cones =
            core::close_holes({{positions.data(), positions.size(), {corners.data(), n, 3 * n}, n}}, max_hole_edges);
        tree = core::winding_tree(cones, core::make_distance_scale(g.voxel_size, g.fraction()));
    }
    [[nodiscard]] core::snapped_position at(int x, int y, int z) const {
        const auto centre = [&](int i) { return (2 * std::int64_t{i} + 1) << (g.fraction() - 1); };
        return {centre(x), centre(y), centre(z)};
    }
    [[nodiscard]] core::winding_sample sample(const core::snapped_position& p) const {
        core::winding_sample s{0, 0, false};
        for (std::size_t i = 0; i < positions.size(); i += 3)
            s.k += core::crossing_below(positions[i], positions[i + 1], positions[i + 2], p);
        for (const glm::uvec3& t : cones.triangles) {
            const core::snapped_position &a = cones.positions[t.x], &b = cones.positions[t.y],
                                         &c = cones.positions[t.z];
            s.k_cones += core::crossing_below(a, b, c, p);
            s.is_on_cone = s.is_on_cone || core::is_on_triangle(a, b, c, p);
        }
        s.k += s.k_cones;
        return s;
    }
    [[nodiscard]] bool is_inside(const core::snapped_position& p, std::int64_t k, vp::fill_rule rule) const {
        const core::winding_view view = tree.view();
        const int bits = core::angle_bits(view.num_triangles);
        bool is_on = false;
        const std::int64_t sum = core::sum_angles(view, p, bits, 0, view.num_triangles, is_on);
        return is_on ? core::is_inside(rule, k) : core::is_inside_by_sum(rule, k, sum, bits);
    }
};
mesh bitten_sphere(splitmix64& random, float middle, float radius) {
    const mesh m = sphere(glm::vec3(middle), radius, 4);
    mesh r{m.positions, {}};
    for (const glm::uvec3& t : m.triangles) {
        const glm::vec3 p = (m.positions[t.x] + m.positions[t.y] + m.positions[t.z]) / 3.0f - middle;
        if (p.x + p.y + 0.5f * p.z < radius * static_cast<float>(random.uniform(0.7, 0.9))) r.triangles.push_back(t);
    }
    return r;
}

TEST(WindingTree, SamplesHaveTheVerdictsOfTheWholeSum) {
    splitmix64 random(15);
    const vp::grid g = unit_grid(glm::ivec3(24));
    const open_mesh many(less_triangles(sphere(glm::vec3(12.0f), 9.0f, 4), random, 100), g),
        one(bitten_sphere(random, 12.0f, 9.0f), g),
        flat(less_faces(box({3.5f, 3.5f, 3.5f}, {11.5f, 12.5f, 10.5f}), {0}), unit_grid(glm::ivec3(16)));
    for (const open_mesh* m : {&many, &one, &flat}) {
        const core::winding_view view = m->tree.view();
        std::size_t on_cones = 0;
        for (int i = 0; i < 1500; ++i) {
            const auto any = [&] { return static_cast<int>(random.between(0, m->g.extent.x - 1)); };
            const core::snapped_position p = m->at(any(), any(), any());
            core::winding_sample s = m->sample(p);
            on_cones += s.is_on_cone ? 1 : 0;
            s.k += random.between(-1, 1); // as if there were closed bodies around it
            const vp::fill_rule rule = i % 2 == 0 ? vp::fill_rule::nonzero : vp::fill_rule::positive;
            ASSERT_EQ(core::is_inside_by_winding(view, p, s, rule, i % 3 == 0), m->is_inside(p, s.k, rule)) << i;
            const core::lid_angles lids = core::find_lid_angles(view, p, 0.0, 0x1p-10);
            if (!lids.is_known || s.is_on_cone) continue;
            bool is_on = false;
            const int bits = core::angle_bits(view.num_triangles);
            const double sum =
                std::ldexp(static_cast<double>(core::sum_angles(view, p, bits, 0, view.num_triangles, is_on)), -bits);
            ASSERT_NEAR(static_cast<double>(core::lids_below(view, p, s.k_cones) - s.k_cones) - lids.turns + sum, 0.0,
                        lids.error)
                << "lids and cones close the same holes";
        }
        EXPECT_EQ(on_cones > 0, m == &flat);
    }
}

// The shadow of a hole that is left open begins and ends where no triangle is.
TEST(WindingTree, ShadowsOfHolesThatStayOpenAreThoseOfRows) {
    splitmix64 random(18);
    const vp::grid g = unit_grid(glm::ivec3(33, 28, 28));
    const mesh m = less_triangles(bitten_sphere(random, 14.0f, 11.0f).inside_out(), random, 40);
    vp::solid_options o = by_winding;
    for (const std::uint64_t most : {3u, 12u}) {
        o.max_hole_edges = most;
        const open_mesh expected(m, g, most);
        ASSERT_GT(expected.cones.cones, 5u);
        ASSERT_LT(expected.cones.cones, expected.cones.holes);
        const voxel_set found = library_solid(m, g, o).voxels;
        std::size_t shadows = 0;
        for (int i = 0; i < 6000; ++i) {
            const int x = static_cast<int>(random.below(33)), y = static_cast<int>(random.below(28)),
                      z = static_cast<int>(random.below(28));
            const core::snapped_position p = expected.at(x, y, z);
            const bool is_in = expected.is_inside(p, expected.sample(p).k, vp::fill_rule::nonzero);
            ASSERT_EQ(found[index(g.extent, x, y, z)], is_in ? 1 : 0) << x << " " << y << " " << z;
            shadows += is_in && x > 26 ? 1 : 0;
        }
        EXPECT_GT(shadows, 0u);
    }
}

TEST(WindingTree, BricksDecideTheirSamplesAsTheWholeSumDoes) {
    splitmix64 random(16);
    using verdict = core::winding_verdict;
    std::size_t of_kind[6] = {}, by_near_holes = 0, by_rows = 0;
    const vp::grid g = unit_grid(glm::ivec3(64));
    const mesh whole = sphere(glm::vec3(32.0f), 28.0f, 4);
    const open_mesh flat(below(whole, 34.0f), g), bitten(bitten_sphere(random, 32.0f, 28.0f), g),
        pierced(less_triangles(sphere(glm::vec3(24.0f), 18.0f, 4), random, 250), g),
        both(less_triangles(below(whole, 40.0f), random, 150), g);
    for (const open_mesh* m : {&flat, &bitten, &pierced, &both}) {
        const core::winding_view view = m->tree.view();
        const core::triple<std::int64_t> extent{{64, 64, 64}};
        std::vector<unsigned> marks(512);
        const auto mark = [&](const core::snapped_position& a, const core::snapped_position& b,
                              const core::snapped_position& c, unsigned bit) {
            core::visit_bricks(a, b, c, extent, m->g.fraction(), 0, 1,
                               [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                                   marks[static_cast<std::size_t>((z * 8 + y) * 8 + x)] |= bit;
                               });
        };
        for (std::size_t i = 0; i < m->positions.size(); i += 3)
            mark(m->positions[i], m->positions[i + 1], m->positions[i + 2], core::meets_mesh);
        for (const glm::uvec3& t : m->cones.triangles)
            mark(m->cones.positions[t.x], m->cones.positions[t.y], m->cones.positions[t.z], core::meets_cones);
        for (int i = 0; i < 512; ++i) {
            const int x0 = i % 8 * 8, y0 = i / 8 % 8 * 8, z0 = i / 64 * 8;
            // Some bricks are cut.
            core::winding_samples samples{m->at(x0, y0, z0), {8, 8, 8}, std::int64_t{1} << m->g.fraction()};
            if (i % 5 == 0) samples.count[i % 3] = 1 + static_cast<int>(random.below(7));
            const auto known = [&](int x, int y, int z) { return m->sample(samples.at(x, y, z)); };
            const core::winding_sample middle = known(samples.middle(0), samples.middle(1), samples.middle(2));
            const vp::fill_rule rule = i % 2 == 0 ? vp::fill_rule::nonzero : vp::fill_rule::positive;
            std::uint32_t near[core::near_holes::most];
            const verdict brick = core::judge_brick(view, samples, middle.k, middle.k_cones,
                                                    marks[static_cast<std::size_t>(i)], rule, near);
            const auto& holes = brick.near;
            if (m == &flat || m == &bitten)
                ++of_kind[brick.kind];
            else if (brick.kind == verdict::unknown && holes.count <= core::near_holes::most)
                ++by_near_holes;
            const int box = i % 3 == 0 ? core::large_winding_box : core::small_winding_box;
            const int first[3] = {x0 / box * box, y0 / box * box, z0 / box * box}, extent_of_grid[3] = {64, 64, 64};
            const bool is_of_rows =
                core::is_below_half(view, core::winding_samples::of_box(first, box, extent_of_grid, m->g.fraction()));
            by_rows += is_of_rows ? 1 : 0;
            const bool is_rare = brick.kind != verdict::outside && brick.kind != verdict::inside &&
                                 !(brick.kind == verdict::beyond && brick.whole == 0);
            for (int n = 0; n < (is_rare ? 12 : 2); ++n) {
                int q[3];
                for (int k = 0; k < 3; ++k)
                    q[k] = static_cast<int>(random.below(static_cast<std::uint64_t>(samples.count[k])));
                const core::winding_sample s = known(q[0], q[1], q[2]);
                const bool expected = m->is_inside(samples.at(q[0], q[1], q[2]), s.k, rule);
                ASSERT_EQ(core::judge_sample(view, samples, brick, near, q[0], q[1], q[2], s, rule), expected)
                    << i << " kind " << brick.kind;
                ASSERT_TRUE(!is_of_rows || core::is_inside(rule, s.k) == expected) << i << " box " << box;
            }
        }
    }
    for (const auto kind : {verdict::outside, verdict::inside, verdict::beyond, verdict::number, verdict::unknown})
        EXPECT_GT(of_kind[kind], 0u) << kind;
    EXPECT_LT(of_kind[verdict::unknown], 512u) << "of 1024";
    EXPECT_GT(by_near_holes, 300u);
    EXPECT_GT(by_rows, 100u);
}

TEST(WindingTree, MarksOfBricksMissNoTriangleAndSamplesOnTrianglesAreAllFound) {
    splitmix64 random(17);
    constexpr int fraction = 3, n = 20; // three bricks along each axis, the last one cut
    const core::triple<std::int64_t> extent{{n, n, n}};
    std::size_t on = 0, met = 0, marked = 0;
    for (int i = 0; i < 300; ++i) {
        core::snapped_position v[3];
        // Many planes through samples; every third triangle reaches far beyond the grid.
        const auto any = [&] { return 4 * random.between(i % 3 == 0 ? -200 : -3, i % 3 == 0 ? 240 : 43); };
        for (auto& p : v) p = {any(), any(), any()};
        if (i % 4 == 0) v[1].z = v[2].z = v[0].z;
        if (i % 7 == 0) v[2] = v[1]; // no area
        std::vector<std::uint8_t> found(n * n * n), bricks(27);
        for (int lane = 0; lane < 4; ++lane) {
            core::visit_samples_on(v[0], v[1], v[2], extent, fraction, lane, 4,
                                   [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                                       found[static_cast<std::size_t>((z * n + y) * n + x)] = 1;
                                   });
            core::visit_bricks(v[0], v[1], v[2], extent, fraction, lane, 4,
                               [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                                   bricks[static_cast<std::size_t>((z * 3 + y) * 3 + x)] = 1;
                               });
        }
        for (int s = 0; s < n * n * n; ++s) {
            const int x = s % n, y = s / n % n, z = s / n / n;
            const core::snapped_position p{8 * x + 4, 8 * y + 4, 8 * z + 4};
            const bool is_on = core::is_on_triangle(v[0], v[1], v[2], p);
            ASSERT_EQ(found[static_cast<std::size_t>(s)], is_on ? 1 : 0);
            on += is_on ? 1 : 0;
            ASSERT_TRUE(!is_on || bricks[static_cast<std::size_t>((z / 8 * 3 + y / 8) * 3 + x / 8)] == 1);
        }
        // Points of the triangle, within the box of a brick's samples.
        if (i % 7 == 0) continue;
        for (int s = 0; s < 200; ++s) {
            double a = random.uniform(0.0, 1.0), b = random.uniform(0.0, 1.0);
            if (a + b > 1.0) {
                a = 1.0 - a;
                b = 1.0 - b;
            }
            int brick = 0;
            bool is_met = true;
            for (int k = 2; k >= 0; --k) {
                const auto c = [&](int j) { return static_cast<double>(k == 0 ? v[j].x : k == 1 ? v[j].y : v[j].z); };
                const double at = c(0) + a * (c(1) - c(0)) + b * (c(2) - c(0)), first = std::floor(at / 64.0);
                is_met =
                    is_met && first >= 0.0 && first <= 2.0 && at - 64.0 * first >= 4.0 && at - 64.0 * first <= 60.0;
                brick = 3 * brick + static_cast<int>(std::clamp(first, 0.0, 2.0));
            }
            if (!is_met) continue;
            ++met;
            ASSERT_EQ(bricks[static_cast<std::size_t>(brick)], 1) << i;
        }
        for (const std::uint8_t b : bricks) marked += b;
    }
    EXPECT_GT(on, 1000u);
    EXPECT_GT(met, 5000u);
    EXPECT_LT(marked, 300u * 27u / 2u);
}

} // namespace
} // namespace solids
