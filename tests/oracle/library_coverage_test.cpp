// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The library's coverage against the oracle: every class of triangle, every test grid, both rules, whole grids and
// crops. The voxel set of each single triangle must be the same to the voxel; counters, A-buffer and framebuffer too.
// VOXELPIPE_ORACLE_TRIANGLES sets their number, VOXELPIPE_ORACLE_SEED chooses them.

#include "library.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace oracle {
namespace {

// The share of one class. A triangle of `large` costs as much as ten thousand small ones.
double share(triangle_class kind) {
    switch (kind) {
    case triangle_class::large:
    case triangle_class::powers_of_two:
    case triangle_class::far_away:
        return 0.004;
    case triangle_class::medium:
    case triangle_class::partly_outside:
        return 0.01;
    case triangle_class::wholly_outside:
        return 0.03;
    case triangle_class::sliver:
        return 0.03;
    case triangle_class::dropped:
        return 0.01;
    case triangle_class::small:
    case triangle_class::lattice:
        return 0.14;
    default:
        return 0.05;
    }
}

struct totals {
    std::uint64_t triangles = 0, fragments = 0, dropped = 0;
};

// One voxelize call against the oracle, triangle by triangle.
void compare(const test_grid& where, const std::vector<world_triangle>& triangles, vp::coverage rule, const part& p,
             unsigned threads, totals& sums) {
    const grid& g = where.g;
    const soup mesh(triangles);
    const vp::grid library_grid = as_library(g, p);
    vp::cpu_backend be(threads);
    vp::abuffer<vp::cpu_backend> lists{be};
    const vp::status s =
        vp::voxelize(be, mesh.view(), library_grid, vp::passthrough{}, vp::constant(true), lists, rule);
    ASSERT_TRUE(s.ok()) << s.message();
    const vp::host_abuffer<void> on_host = lists.to_host(be);
    const auto found = voxels_by_triangle(on_host, triangles.size(), p);

    vp::counters expected;
    std::vector<voxel> covered; // of all triangles
    for (std::size_t n = 0; n < triangles.size(); ++n) {
        const snapped_triangle t = snap(g, triangles[n].v);
        const std::vector<voxel> voxels = expected_voxels(g, t, rule, p);
        if (found[n] != voxels) {
            std::vector<voxel> missing, extra;
            std::set_difference(voxels.begin(), voxels.end(), found[n].begin(), found[n].end(),
                                std::back_inserter(missing));
            std::set_difference(found[n].begin(), found[n].end(), voxels.begin(), voxels.end(),
                                std::back_inserter(extra));
            missing.resize(std::min<std::size_t>(missing.size(), 5));
            extra.resize(std::min<std::size_t>(extra.size(), 5));
            FAIL() << where.name << " " << vp::name(rule) << " " << describe(g, triangles[n]) << "\nlibrary "
                   << found[n].size() << " voxels, oracle " << voxels.size() << "; missing "
                   << ::testing::PrintToString(missing) << ", too many " << ::testing::PrintToString(extra);
        }
        expected.fragments += voxels.size();
        covered.insert(covered.end(), voxels.begin(), voxels.end());
        if (t.dropped) {
            bool finite = true;
            for (const auto& v : triangles[n].v)
                for (const float x : v) finite = finite && std::isfinite(x);
            ++(finite ? expected.triangles_too_far : expected.triangles_nonfinite);
        }
    }
    std::sort(covered.begin(), covered.end());
    covered.erase(std::unique(covered.begin(), covered.end()), covered.end());

    EXPECT_EQ(s.counts.triangles_in, triangles.size());
    EXPECT_EQ(s.counts.triangles_nonfinite, expected.triangles_nonfinite);
    EXPECT_EQ(s.counts.triangles_too_far, expected.triangles_too_far);
    EXPECT_EQ(s.counts.fragments, expected.fragments);
    EXPECT_EQ(s.counts.fragments_discarded, 0u);
    EXPECT_EQ(s.counts.voxels, covered.size());
    EXPECT_EQ(on_host.voxels.size(), covered.size());
    EXPECT_EQ(s.counts.triangles_dropped() + s.counts.triangles_zero_area + s.counts.triangles_outside +
                  s.counts.triangles_drawn,
              triangles.size());
    if (rule == vp::coverage::conservative) {
        EXPECT_EQ(s.counts.triangles_zero_area, 0u);
    }

    // The framebuffer has another code path: the same voxels, each counted once for each of its triangles.
    if (std::int64_t{p.size[0]} * p.size[1] * p.size[2] <= 64 * 64 * 64) {
        using occupancy = vp::target<vp::bit, vp::blend::bit_or>;
        using count = vp::target<std::uint32_t, vp::blend::count>;
        vp::framebuffer<vp::cpu_backend, occupancy, count> fb{be, library_grid.extent};
        const vp::status drawn = vp::voxelize(be, mesh.view(), library_grid, vp::passthrough{},
                                              vp::constant(true, std::uint32_t{1}), fb, rule);
        ASSERT_TRUE(drawn.ok()) << drawn.message();
        EXPECT_TRUE(drawn.counts == s.counts);
        const auto bits = vp::get<0>(fb).to_host_target(be);
        const auto counts = vp::get<1>(fb).to_host_target(be);
        std::vector<voxel> set;
        std::uint64_t fragments = 0;
        for (int z = 0; z < p.size[2]; ++z)
            for (int y = 0; y < p.size[1]; ++y)
                for (int x = 0; x < p.size[0]; ++x) {
                    ASSERT_EQ(bits(x, y, z), counts(x, y, z) != 0);
                    if (bits(x, y, z)) set.push_back({x + p.begin[0], y + p.begin[1], z + p.begin[2]});
                    fragments += counts(x, y, z);
                }
        EXPECT_TRUE(set == covered);
        EXPECT_EQ(fragments, expected.fragments);
    }
    sums.triangles += triangles.size();
    sums.fragments += expected.fragments;
    sums.dropped += expected.triangles_too_far + expected.triangles_nonfinite;
}

class LibraryCoverage : public ::testing::TestWithParam<triangle_class> {};

TEST_P(LibraryCoverage, IsTheOraclesToTheVoxel) {
    const triangle_class kind = GetParam();
    const auto wanted = static_cast<std::uint64_t>(static_cast<double>(triangle_budget(1200000)) * share(kind)) + 1;
    splitmix64 random(seed(1000 + static_cast<std::uint64_t>(kind)));
    totals sums, of_arms[2];
    std::set<std::string_view> grids_seen;
    for (std::uint64_t round = 0; sums.triangles < 2 * wanted; ++round) {
        test_grid where = test_grids()[round % test_grids().size()];
        part p = random.one_in(3) ? random_part(random, where.g, 4096) : whole_of(where.g);
        if (covers_much(kind) && !where.dense) { // a small part anywhere in the large grid
            p = random_part(random, where.g, 40);
            where = focused(where, p.as_region());
        }
        // From a handful to thousands in one call.
        const auto max_count = std::min<std::uint64_t>(covers_much(kind) ? 40 : 4000, wanted / test_grids().size() + 1);
        std::vector<world_triangle> triangles;
        for (std::uint64_t n = 1 + random.below(max_count); n > 0; --n)
            triangles.push_back(make_triangle(random, where, kind));
        const auto threads = static_cast<unsigned>(1 + random.below(3));
        for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin}) {
            compare(where, triangles, rule, p, threads, sums);
            if (HasFailure()) return;
        }
        if (round % 3 == 0) compare(where, triangles, vp::coverage::crosshair, p, threads, of_arms[0]);
        if (round % 3 == 1) compare(where, triangles, vp::coverage::diagonal, p, threads, of_arms[1]);
        if (HasFailure()) return;
        grids_seen.insert(where.name);
    }
    RecordProperty("triangles", std::to_string(sums.triangles / 2));
    RecordProperty("fragments", std::to_string(sums.fragments));
    if (kind == triangle_class::dropped) {
        EXPECT_EQ(sums.dropped, sums.triangles);
    } else {
        EXPECT_GT(sums.fragments, 0u);
        const bool meets_arms = kind == triangle_class::small || kind == triangle_class::large ||
                                kind == triangle_class::half_lattice || kind == triangle_class::diagonal_plane;
        for (const totals& by_arms : of_arms) EXPECT_TRUE(by_arms.fragments > 0 || !meets_arms);
    }
    EXPECT_EQ(grids_seen.size(), test_grids().size());
}

INSTANTIATE_TEST_SUITE_P(EveryClass, LibraryCoverage, ::testing::ValuesIn(all_triangle_classes),
                         [](const auto& info) { return std::string(name(info.param)); });

// One mesh of all classes, shuffled, so that they share tiles.
TEST(LibraryCoverage, HoldsForAllClassesInOneMesh) {
    splitmix64 random(seed(77));
    totals sums;
    for (const test_grid& where : test_grids()) {
        if (!where.dense) continue;
        std::vector<world_triangle> triangles;
        for (const triangle_class kind : all_triangle_classes) {
            const bool big =
                share(kind) < 0.01 || kind == triangle_class::medium || kind == triangle_class::partly_outside;
            for (int n = 0; n < (big ? 4 : 40); ++n) triangles.push_back(make_triangle(random, where, kind));
        }
        for (std::size_t n = triangles.size(); n > 1; --n) std::swap(triangles[n - 1], triangles[random.below(n)]);
        for (const vp::coverage rule :
             {vp::coverage::conservative, vp::coverage::thin, vp::coverage::crosshair, vp::coverage::diagonal})
            compare(where, triangles, rule, whole_of(where.g), 2, sums);
    }
    EXPECT_GT(sums.fragments, 100000u);
}

} // namespace
} // namespace oracle
