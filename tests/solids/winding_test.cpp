// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// repair::winding: its formula against libm in long double, and every sample of open meshes against an oracle that sums
// the solid angles of the given triangles and knows of no cones.

#include "winding_meshes.hpp"

#include <voxelpipe/solid/core/winding_bricks.hpp>
#include <voxelpipe/solid/core/winding_lids.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

namespace solids {
namespace {

namespace core = voxelpipe::core;
using real = long double;

// ---- the formula ----------------------------------------------------------------------------------------------------

TEST(SolidAngles, TheArctangentIsThatOfTheLibraryToFourUnits) {
    splitmix64 random(1);
    for (int i = 0; i < 20000; ++i) {
        const double angle = random.uniform(-3.2, 3.2),
                     length = std::ldexp(1.0, static_cast<int>(random.between(-200, 200)));
        double y = std::sin(angle) * length, x = std::cos(angle) * length;
        if (i % 16 == 0) y *= std::ldexp(1.0, -static_cast<int>(random.below(300)));
        if (i % 16 == 1) x *= std::ldexp(1.0, -static_cast<int>(random.below(300)));
        if (i % 16 == 2) x = y;
        const real exact = std::atan2(static_cast<real>(y), static_cast<real>(x));
        ASSERT_NEAR(static_cast<double>(core::written_atan2(y, x) - exact), 0.0, 0x1p-51) << y << " " << x;
    }
    EXPECT_EQ(core::written_atan2(0.0, 1.0), 0.0);
    EXPECT_EQ(core::written_atan2(2.0, 0.0), 0.5 * core::pi_as_double);
    EXPECT_EQ(core::written_atan2(-1.0, 0.0), -0.5 * core::pi_as_double);
    EXPECT_EQ(core::written_atan2(3.0, -3.0), 0.75 * core::pi_as_double);
}

// Half the solid angle by the sphere's triangle, in long double from exact integers.
real half_angle(const core::snapped_position (&v)[3], const core::snapped_position& p, const glm::dvec3& size) {
    vp::int128 q[3][3];
    for (int n = 0; n < 3; ++n) {
        q[n][0] = v[n].x - p.x;
        q[n][1] = v[n].y - p.y;
        q[n][2] = v[n].z - p.z;
    }
    real cross[3][3], length[3];
    vp::int128 volume = 0;
    for (int n = 0; n < 3; ++n) {
        real square = 0;
        for (int k = 0; k < 3; ++k) {
            const int u = (k + 1) % 3, w = (k + 2) % 3, m = (n + 1) % 3;
            const vp::int128 c = q[n][u] * q[m][w] - q[n][w] * q[m][u];
            cross[n][k] = static_cast<real>(c) * static_cast<real>(size[u]) * static_cast<real>(size[w]);
            if (n == 1) volume += c * q[0][k];
            const real x = static_cast<real>(q[n][k]) * static_cast<real>(size[k]);
            square += x * x;
        }
        length[n] = std::sqrt(square);
    }
    const real det =
        static_cast<real>(volume) * static_cast<real>(size.x) * static_cast<real>(size.y) * static_cast<real>(size.z);
    real sum = -std::acos(-1.0L);
    for (int n = 0; n < 3; ++n) {
        const int before = (n + 2) % 3;
        real along = 0;
        for (int k = 0; k < 3; ++k) along -= cross[n][k] * cross[before][k];
        sum += std::atan2(length[n] * std::abs(det), along);
    }
    return det < 0 ? -sum / 2 : sum / 2;
}

TEST(SolidAngles, AnglesAreThoseOfLongDoubleAlsoBesideEdgesAndVertices) {
    splitmix64 random(2);
    const glm::dvec3 sizes[] = {{1.0, 1.0, 1.0}, {0.3, 1.0, 7.0}, {1e-20, 3e-20, 2e-20}};
    int beside_edges = 0;
    for (int i = 0; i < 30000; ++i) {
        const glm::dvec3 size = sizes[i % 3];
        const int fraction = 8;
        const std::int64_t most = i % 2 == 0 ? 1 << 12 : std::int64_t{1} << (i % 7 == 0 ? 38 : 23);
        core::snapped_position v[3];
        for (auto& p : v) p = {random.between(0, most), random.between(0, most), random.between(0, most)};
        core::snapped_position p{random.between(0, most), random.between(0, most), random.between(0, most)};
        if (i % 4 == 1) { // a unit or two off an edge
            const auto along = [&](std::int64_t a, std::int64_t b) { return (a + b) / 2 + random.between(-1, 1); };
            p = {along(v[0].x, v[1].x), along(v[0].y, v[1].y), along(v[0].z, v[1].z)};
            ++beside_edges;
        }
        if (i % 4 == 2)
            p = {v[2].x + random.between(-1, 1), v[2].y + random.between(-1, 1), v[2].z + random.between(-1, 1)};
        const core::distance_scale scale = core::make_distance_scale(size, fraction);
        const core::seen_angle wide = core::find_angle(core::see_wide(v[0], v[1], v[2], p), scale);
        const core::seen_triangle seen = core::see_corners(
            v[0], v[1], v[2], p, core::is_narrow_in_grid(v[0], v[1], v[2]) && core::is_narrow_in_grid(p, p, p));
        const core::seen_angle angle = core::find_angle(seen, scale);
        ASSERT_EQ(angle.half, wide.half) << "both forms of the integers";
        if (seen.volume == 0.0) continue;
        ASSERT_NEAR(static_cast<double>(angle.half - half_angle(v, p, size)), 0.0, 0x1p-45) << i;
        // Turned triangles and exchanged vertices.
        const core::seen_angle turned = core::find_angle(core::see_wide(v[1], v[2], v[0], p), scale),
                               swapped = core::find_angle(core::see_wide(v[1], v[0], v[2], p), scale);
        ASSERT_NEAR(turned.half, angle.half, 0x1p-44);
        ASSERT_NEAR(swapped.half, -angle.half, 0x1p-44);
    }
    EXPECT_GT(beside_edges, 7000);
}

TEST(SolidAngles, APointOfTheClosedTriangleIsOnItAndOthersOfItsPlaneSeeNothing) {
    const core::distance_scale scale = core::make_distance_scale(glm::dvec3(1.0), 4);
    const core::snapped_position a{0, 0, 0}, b{8, 0, 4}, c{0, 8, 4};
    const auto see = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
        return core::find_angle(core::see_wide(a, b, c, {x, y, z}), scale);
    };
    for (const auto& on : {a, b, c, core::snapped_position{2, 2, 2}, core::snapped_position{4, 4, 4}}) {
        EXPECT_TRUE(see(on.x, on.y, on.z).is_on);
        EXPECT_EQ(see(on.x, on.y, on.z).half, 0.0);
    }
    EXPECT_FALSE(see(8, 8, 8).is_on);
    EXPECT_EQ(see(8, 8, 8).half, 0.0);
    EXPECT_FALSE(see(-2, 0, -1).is_on);
    EXPECT_FALSE(see(2, 2, 3).is_on);
    EXPECT_NE(see(2, 2, 3).half, 0.0);
    const auto flat = core::find_angle(core::see_wide(a, b, {16, 0, 8}, {4, 0, 2}), scale);
    EXPECT_FALSE(flat.is_on) << "a triangle without area";
    EXPECT_EQ(flat.half, 0.0);
}

TEST(SolidAngles, SumsOfClosedMeshesAreWholeToTheirFixedPoint) {
    const vp::grid g = unit_grid(glm::ivec3(32));
    const mesh m = sphere(glm::vec3(16.1f, 15.7f, 16.3f), 11.0f, 3);
    const core::distance_scale scale = core::make_distance_scale(g.voxel_size, g.fraction());
    const auto n = static_cast<std::uint32_t>(m.triangles.size());
    const int bits = core::angle_bits(n);
    EXPECT_EQ(core::angle_bits(1023), 52);
    EXPECT_EQ(core::angle_bits(1024), 51);
    EXPECT_EQ(core::angle_bits(1), 52);
    EXPECT_EQ(core::angle_bits(~0u), 30);
    splitmix64 random(3);
    const auto snapped = snap(m, g);
    for (int i = 0; i < 50; ++i) {
        const auto any = [&] { return (2 * random.between(0, 31) + 1) << (g.fraction() - 1); };
        const core::snapped_position p{any(), any(), any()};
        std::int64_t sum = 0;
        for (const auto& t : snapped)
            sum += core::angle_units(
                core::find_angle(core::see_wide({t.v[0][0], t.v[0][1], t.v[0][2]}, {t.v[1][0], t.v[1][1], t.v[1][2]},
                                                {t.v[2][0], t.v[2][1], t.v[2][2]}, p),
                                 scale)
                    .half,
                bits);
        const double w = std::ldexp(static_cast<double>(sum), -bits);
        EXPECT_NEAR(w, std::round(w), n * 0x1p-47);
        EXPECT_TRUE(std::round(w) == 0.0 || std::round(w) == 1.0);
    }
}

TEST(SolidAngles, AHalfIsInsideToTheLastBit) {
    constexpr auto nonzero = vp::fill_rule::nonzero, positive = vp::fill_rule::positive;
    constexpr std::int64_t half = std::int64_t{1} << 39; // of 40 bits
    for (std::int64_t k = -3; k <= 3; ++k)
        for (std::int64_t n = -8; n <= 8; ++n)
            for (std::int64_t off = -1; off <= 1; ++off) {
                const std::int64_t sum = n * half + off;
                const real w = static_cast<real>(k) - static_cast<real>(sum) / static_cast<real>(2 * half);
                EXPECT_EQ(core::is_inside_by_sum(positive, k, sum, 40), w >= 0.5L) << k << " " << n << " " << off;
                EXPECT_EQ(core::is_inside_by_sum(nonzero, k, sum, 40), std::abs(w) >= 0.5L)
                    << k << " " << n << " " << off;
            }
}

// ---- sets -----------------------------------------------------------------------------------------------------------

struct comparison {
    std::size_t samples = 0, left_out = 0, on_surface = 0, wrong = 0, flipped = 0;
};

// Compares every sample. `flipped` counts those at which the cones alone decide otherwise.
void compare(const mesh& m, const vp::grid& g, vp::fill_rule rule, comparison& sum) {
    vp::solid_options o = by_winding;
    o.rule = rule;
    const voxel_set found = library_solid(m, g, o).voxels;
    o.repair = vp::repair::close_holes;
    const voxel_set closed = library_solid(m, g, o).voxels;
    const auto triangles = snap(m, g);
    for (int z = 0; z < g.extent.z; ++z)
        for (int y = 0; y < g.extent.y; ++y)
            for (int x = 0; x < g.extent.x; ++x) {
                const auto w = oracle::find_generalized_winding(
                    g.fraction(), triangles, {g.voxel_size.x, g.voxel_size.y, g.voxel_size.z}, {x, y, z});
                const std::size_t i = index(g.extent, x, y, z);
                ++sum.samples;
                sum.on_surface += w.is_on_surface ? 1 : 0;
                const real size = rule == vp::fill_rule::nonzero ? std::abs(w.number) : w.number;
                if (w.is_on_surface || std::abs(size - 0.5L) < 1e-9L + w.doubt) {
                    ++sum.left_out;
                    continue;
                }
                if ((found[i] != 0) != (size > 0.5L)) ++sum.wrong;
                if (found[i] != closed[i]) ++sum.flipped;
            }
}

TEST(Winding, EverySampleOfOpenSpheresIsThatOfTheSolidAngles) {
    splitmix64 random(11);
    comparison sum;
    for (int i = 0; i < 6; ++i) {
        const auto at = [&] { return static_cast<float>(random.uniform(7.0, 9.0)); };
        const mesh whole = sphere({at(), at(), at()}, static_cast<float>(random.uniform(4.0, 7.0)), 2);
        const mesh open =
            i < 3 ? less_triangles(whole, random, 20 + 30 * i) : below(whole, 6.0f + 2.0f * static_cast<float>(i - 3));
        compare(i % 2 == 0 ? open : open.inside_out(), unit_grid(glm::ivec3(17, 16, 15)),
                i % 3 == 2 ? vp::fill_rule::positive : vp::fill_rule::nonzero, sum);
    }
    EXPECT_EQ(sum.wrong, 0u) << "of " << sum.samples;
    EXPECT_LT(sum.left_out, sum.samples / 100);
    EXPECT_GT(sum.flipped, 100u) << "cones would do";
}

TEST(Winding, EverySampleOfSoupsIsThatOfTheSolidAngles) {
    splitmix64 random(12);
    comparison sum;
    for (int i = 0; i < 8; ++i) {
        mesh m = soup(random, 3 + 12 * i, 14.0f);
        if (i % 2 == 1) m.add(sphere(glm::vec3(7.0f), 5.0f, 1)).add(below(sphere(glm::vec3(8.0f), 5.0f, 1), 8.0f));
        compare(m, unit_grid(glm::ivec3(14)), i % 4 < 2 ? vp::fill_rule::nonzero : vp::fill_rule::positive, sum);
    }
    EXPECT_EQ(sum.wrong, 0u) << "of " << sum.samples;
    EXPECT_LT(sum.left_out, sum.samples / 100);
    EXPECT_GT(sum.flipped, 100u);
}

TEST(Winding, EverySampleOfOpenBoxesIsThatOfTheSolidAngles) {
    comparison sum;
    for (std::size_t face = 0; face < 6; ++face)
        compare(less_faces(sides, {face}), unit_grid(glm::ivec3(15)), vp::fill_rule::nonzero, sum);
    EXPECT_EQ(sum.wrong, 0u) << "of " << sum.samples;
    EXPECT_GT(sum.on_surface, 100u) << "faces through centres";
    EXPECT_LT(sum.left_out - sum.on_surface, sum.samples / 50) << "in the plane of a missing face the number is 1/2";
    EXPECT_EQ(sum.flipped, 0u) << "which is that of the cone";
    for (std::size_t face = 0; face < 4; ++face)
        compare(less_faces(sides, {face, face == 3 ? 5 : face + 2}), unit_grid(glm::ivec3(15)), vp::fill_rule::nonzero,
                sum);
    EXPECT_EQ(sum.wrong, 0u) << "of " << sum.samples;
    EXPECT_GT(sum.flipped, 50u);
}

TEST(Winding, AnglesAreThoseOfTheWorldNotOfTheVoxels) {
    comparison sum;
    const vp::grid g = {{0, 0, 0}, {0.25, 1.0, 0.5}, {60, 14, 28}};
    compare(less_faces(sides, {1, 4}), g, vp::fill_rule::nonzero, sum);
    compare(less_faces(sides, {2, 5}), g, vp::fill_rule::positive, sum);
    EXPECT_EQ(sum.wrong, 0u);
    EXPECT_GT(sum.flipped, 100u);
}

TEST(Winding, ClosedMeshesKeepTheirVoxelsAndExtentsAddTheCoverOfTheMeshAlone) {
    const vp::grid g = unit_grid(glm::ivec3(16));
    splitmix64 random(13);
    const mesh closed = random_bodies(random, 16, 4);
    EXPECT_EQ(library_solid(closed, g, by_winding).voxels, library_solid(closed, g).voxels);
    const mesh open = below(sphere(glm::vec3(8.0f), 6.0f, 2), 9.0f);
    const voxel_set centre = library_solid(open, g, by_winding).voxels, cover = library_cover(open, g);
    vp::solid_options o = by_winding;
    o.extent = vp::solid_extent::outer;
    EXPECT_EQ(library_solid(open, g, o).voxels, united(centre, cover));
    o.extent = vp::solid_extent::inner;
    EXPECT_EQ(library_solid(open, g, o).voxels, without(centre, cover));
    EXPECT_NE(centre, united(centre, cover));
    EXPECT_NE(centre, without(centre, cover));
}

TEST(Winding, ASampleOnACapTakesTheVerdictOfItsRow) {
    const vp::grid g = unit_grid(glm::ivec3(16));
    for (const float lid : {10.5f, 10.0f}) { // through centres, and between them
        mesh m = box({3, 3, 3}, {13, 13, lid});
        const voxel_set closed = library_solid(m, g).voxels; // the cone lies in the plane of the lid
        std::erase_if(m.triangles, [&](const glm::uvec3& t) {
            return m.positions[t.x].z == lid && m.positions[t.y].z == lid && m.positions[t.z].z == lid;
        });
        ASSERT_EQ(m.triangles.size(), 10u);
        const voxel_set found = library_solid(m, g, by_winding).voxels;
        // The number is 1/2 in the plane of the lid, and more below.
        EXPECT_EQ(found, closed);
        EXPECT_EQ(closed[index(g.extent, 8, 8, 9)], 1);
    }
}

TEST(Winding, BodiesDrawsAndCountsAreThoseOfClosedHoles) {
    const vp::grid g = unit_grid(glm::ivec3(20, 18, 16));
    const std::vector<mesh> draws{below(sphere(glm::vec3(8.0f), 6.0f, 2), 9.0f), box({9, 9, 2}, {15, 15, 9}),
                                  below(sphere({13.0f, 8.0f, 8.0f}, 5.0f, 1).inside_out(), 8.0f)};
    voxel_set all(count(voxel_set(index(g.extent, 0, 0, g.extent.z), 1)), 0);
    for (const mesh& m : draws) all = united(all, library_solid(m, g, by_winding).voxels);
    vp::solid_options o = by_winding;
    o.bodies = vp::bodies::draw;
    const solid apart = library_solid(draws, g, o);
    EXPECT_EQ(apart.voxels, all);
    vp::solid_options closing = o;
    closing.repair = vp::repair::close_holes;
    const vp::solid_counters expected = library_solid(draws, g, closing).status.solid;
    EXPECT_EQ(apart.status.solid, expected);
    EXPECT_EQ(expected.holes, 2u);
    EXPECT_EQ(apart.status.counts.triangles_in,
              expected.cones == 2 ? draws[0].triangles.size() + 12 + draws[2].triangles.size() : 0);
    EXPECT_EQ(library_solid(draws, g, o, 1).voxels, all) << "one thread";
}

TEST(Winding, CropsAreCropsOfTheWhole) {
    const vp::grid g = unit_grid(glm::ivec3(45, 20, 18));
    splitmix64 random(14);
    mesh m = less_triangles(sphere({20.0f, 9.0f, 9.0f}, 8.0f, 2), random, 60);
    m.add(below(sphere({30.0f, 10.0f, 9.0f}, 7.0f, 2), 10.0f));
    const voxel_set whole = library_solid(m, g, by_winding).voxels;
    const glm::ivec3 crops[][2] = {{{0, 0, 7}, {45, 20, 5}}, {{13, 3, 2}, {19, 11, 16}}, {{33, 0, 0}, {12, 20, 18}}};
    for (const auto& [offset, extent] : crops) {
        const vp::grid part = g.crop(offset, extent);
        const voxel_set found = library_solid(m, part, by_winding).voxels;
        std::size_t inside = 0;
        for (int z = 0; z < extent.z; ++z)
            for (int y = 0; y < extent.y; ++y)
                for (int x = 0; x < extent.x; ++x) {
                    const auto expected = whole[index(g.extent, x + offset.x, y + offset.y, z + offset.z)];
                    inside += expected;
                    ASSERT_EQ(found[index(extent, x, y, z)], expected) << x << " " << y << " " << z;
                }
        EXPECT_GT(inside, 0u);
    }
}

TEST(Winding, HolesOfMoreEdgesThanAskedForStayOpen) {
    const vp::grid g = unit_grid(glm::ivec3(16));
    const mesh m = below(sphere(glm::vec3(8.0f), 6.0f, 2), 9.0f);
    vp::solid_options o = by_winding;
    o.max_hole_edges = 3;
    const solid s = library_solid(m, g, o);
    EXPECT_EQ(s.status.solid.holes, 1u);
    EXPECT_EQ(s.status.solid.cones, 0u);
    EXPECT_EQ(s.voxels, library_solid(m, g).voxels) << "shadows of rows";
}

TEST(Winding, RulesAndVoxelSizesThatItDoesNotHaveAreRefused) {
    vp::cpu_backend backend;
    const mesh m = box({1, 1, 1}, {3, 3, 3});
    const auto code = [&](const vp::grid& g, const vp::solid_options& o) {
        vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{backend, g.extent};
        return vp::voxelize_solid(backend, m.view(), g, vp::passthrough{}, vp::constant(true), fb, o).code;
    };
    vp::solid_options o = by_winding;
    EXPECT_EQ(code(unit_grid(glm::ivec3(4)), o), vp::status_code::ok);
    o.rule = vp::fill_rule::even_odd;
    EXPECT_EQ(code(unit_grid(glm::ivec3(4)), o), vp::status_code::bad_solid_options);
    o.rule = vp::fill_rule::positive;
    EXPECT_EQ(code(unit_grid(glm::ivec3(4)), o), vp::status_code::ok);
    EXPECT_EQ(code({{0, 0, 0}, {1e-40, 1.0, 1.0}, {4, 4, 4}}, o), vp::status_code::bad_voxel_size);
}

} // namespace
} // namespace solids
