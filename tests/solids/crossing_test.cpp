// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The crossings of core/ against the oracle: along each axis, with each order of the offset, in both widths of
// integers, on meshes full of exact ties.

#include "solid_support.hpp"

#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/solid/core/small_crossing.hpp>

#include <algorithm>
#include <string>

namespace solids {
namespace {

namespace core = vp::core;

struct snapped_mesh {
    std::vector<core::snapped_position> positions;
    const mesh& m;
    int fraction;

    snapped_mesh(const mesh& from, const vp::grid& g) : m(from), fraction(core::make_snap_transform(g).fraction) {
        const core::snap_transform t = core::make_snap_transform(g);
        for (const glm::vec3& p : from.positions) positions.push_back(core::snap(t, p.x, p.y, p.z));
    }
};

// Winding numbers from rows along one axis, with the offset in one order.
template <int Axis, class Offset>
std::vector<std::int64_t> windings(const mesh& m, const vp::grid& g) {
    const snapped_mesh s(m, g);
    const glm::ivec3 e = g.extent;
    const core::voxel_box whole{{{0, 0, 0}}, {{e.x - 1, e.y - 1, e.z - 1}}};
    std::vector<std::int64_t> all(index(e, 0, 0, e.z));
    for (const glm::uvec3& t : m.triangles) {
        const auto &a = s.positions[t.x], &b = s.positions[t.y], &c = s.positions[t.z];
        core::for_each_crossing<Axis, Offset>(
            a, b, c, s.fraction, core::rows_within<Axis>(a, b, c, s.fraction, whole),
            [&](std::int64_t u, std::int64_t v, std::int64_t first, int winding) {
                for (std::int64_t w = std::max<std::int64_t>(first, 0); w < e[Axis]; ++w) {
                    const auto p = core::to_xyz(Axis, static_cast<int>(u), static_cast<int>(v), static_cast<int>(w));
                    all[index(e, p[0], p[1], p[2])] += winding;
                }
            });
    }
    return all;
}

template <class Offset>
void expect_oracle(const mesh& m, const vp::grid& g, const std::array<int, 3>& order) {
    const auto expected = oracle_windings(m, g, skew, order);
    EXPECT_EQ((windings<0, Offset>(m, g)), expected) << "rows along x";
    EXPECT_EQ((windings<1, Offset>(m, g)), expected) << "rows along y";
    EXPECT_EQ((windings<2, Offset>(m, g)), expected) << "rows along z";
}

TEST(Crossings, ClosedMeshesHaveTheOraclesWindingsAlongEveryAxis) {
    splitmix64 random(1);
    for (int round = 0; round < 60; ++round) {
        const glm::ivec3 extent(1 + static_cast<int>(random.below(11)), 1 + static_cast<int>(random.below(11)),
                                1 + static_cast<int>(random.below(11)));
        const mesh m = random_bodies(random, 8, 1 + static_cast<int>(random.below(6)));
        SCOPED_TRACE("round " + std::to_string(round));
        expect_oracle<core::centre_offset<0, 1, 2>>(m, unit_grid(extent), {0, 1, 2});
        if (HasFailure()) return;
    }
}

TEST(Crossings, EveryOrderOfTheOffsetIsTheOraclesOfThatOrder) {
    splitmix64 random(2);
    bool differs = false;
    for (int round = 0; round < 20; ++round) {
        const mesh m = random_bodies(random, 8, 4);
        const vp::grid g = unit_grid({9, 8, 7});
        SCOPED_TRACE("round " + std::to_string(round));
        expect_oracle<core::centre_offset<1, 2, 0>>(m, g, {1, 2, 0});
        expect_oracle<core::centre_offset<2, 1, 0>>(m, g, {2, 1, 0});
        differs = differs || oracle_windings(m, g, skew, {0, 1, 2}) != oracle_windings(m, g, skew, {2, 1, 0});
        if (HasFailure()) return;
    }
    EXPECT_TRUE(differs) << "no tie in any mesh: the test is blind to the order";
}

TEST(Crossings, OpenMeshesAreTheOraclesRaysTowardsTheLowEndOfTheRow) {
    splitmix64 random(3);
    for (int round = 0; round < 40; ++round) {
        mesh m = random_bodies(random, 8, 3);
        while (m.triangles.size() > 1 && random.below(4) != 0)
            m.triangles.erase(m.triangles.begin() + static_cast<std::ptrdiff_t>(random.below(m.triangles.size())));
        const vp::grid g = unit_grid({8, 7, 9});
        EXPECT_EQ((windings<0, core::centre_offset<>>(m, g)), oracle_windings(m, g, along_rows)) << "round " << round;
        EXPECT_EQ((windings<1, core::centre_offset<>>(m, g)), oracle_windings(m, g, {0, -1, 0})) << "round " << round;
        EXPECT_EQ((windings<2, core::centre_offset<>>(m, g)), oracle_windings(m, g, {0, 0, -1})) << "round " << round;
        if (HasFailure()) return;
    }
}

TEST(Crossings, PermutedAxesWithThePermutedOffsetGiveThePermutedSet) {
    splitmix64 random(4);
    for (int round = 0; round < 20; ++round) {
        const mesh m = random_bodies(random, 7, 4);
        mesh turned = m; // x becomes y, y becomes z, z becomes x
        for (glm::vec3& p : turned.positions) p = {p.z, p.x, p.y};
        const glm::ivec3 e(7, 8, 9);
        const auto plain = windings<0, core::centre_offset<0, 1, 2>>(m, unit_grid(e));
        const auto other = windings<1, core::centre_offset<1, 2, 0>>(turned, unit_grid({e.z, e.x, e.y}));
        for (int z = 0; z < e.z; ++z)
            for (int y = 0; y < e.y; ++y)
                for (int x = 0; x < e.x; ++x)
                    ASSERT_EQ(plain[index(e, x, y, z)], other[index({e.z, e.x, e.y}, z, x, y)]) << "round " << round;
    }
}

// Rows along one axis as text, in either width.
template <int Axis, class Int>
std::string crossings(const snapped_mesh& s, const core::voxel_box& clip) {
    std::string text;
    for (const glm::uvec3& t : s.m.triangles) {
        const auto &a = s.positions[t.x], &b = s.positions[t.y], &c = s.positions[t.z];
        const core::row_box rows = core::rows_within<Axis>(a, b, c, s.fraction, clip);
        if (rows.empty()) continue;
        const auto setup = core::setup_crossings<Axis, core::centre_offset<>, Int>(a, b, c, s.fraction, true);
        if (setup.winding == 0) continue;
        for (std::int64_t v = rows.v.lo; v <= rows.v.hi; ++v)
            core::for_each_crossing_in_row(setup, v, rows.u, [&](std::int64_t u, std::int64_t first) {
                text += std::to_string(u) + " " + std::to_string(v) + " " + std::to_string(first) + " " +
                        std::to_string(setup.winding) + "\n";
            });
    }
    return text;
}

TEST(Crossings, BothWidthsOfIntegersAgreeUpToTheLastBitOfTheNarrowOne) {
    splitmix64 random(5);
    for (const int extent : {1 << 8, 1 << 12, 1 << 16, core::max_log2_extent > 19 ? 1 << 20 : 1 << 19}) {
        const int fraction = core::fraction_bits(extent);
        // The longest edge of the 64-bit path, in voxels, and a few voxels around the middle of it.
        const std::int64_t edge = std::int64_t{1} << core::narrow_edge_bits(fraction);
        const mesh none;
        snapped_mesh s(none, unit_grid(glm::ivec3(extent)));
        mesh m;
        for (int round = 0; round < 40; ++round) {
            const auto first = static_cast<std::uint32_t>(s.positions.size());
            for (int n = 0; n < 3; ++n) {
                const auto coordinate = [&] {
                    return random.one_in(3) ? (random.one_in(2) ? 0 : edge) : random.between(0, edge);
                };
                const std::int64_t x = coordinate(), y = coordinate(), z = coordinate();
                s.positions.push_back({x, y, z});
            }
            m.triangles.push_back(first + glm::uvec3(0, 1, 2));
        }
        const snapped_mesh all{m, unit_grid(glm::ivec3(extent))};
        snapped_mesh both = all;
        both.positions = s.positions;
        for (const auto& t : m.triangles)
            ASSERT_TRUE(core::fits_narrow(both.positions[t.x], both.positions[t.y], both.positions[t.z], fraction));
        const std::int64_t middle = (edge >> fraction) / 2;
        const core::voxel_box clip{{{middle, middle, middle}}, {{middle + 12, middle + 12, middle + 12}}};
        const std::string narrow = crossings<0, std::int64_t>(both, clip);
        EXPECT_FALSE(narrow.empty());
        EXPECT_EQ(narrow, (crossings<0, vp::int128>(both, clip))) << "extent " << extent;
        EXPECT_EQ((crossings<1, std::int64_t>(both, clip)), (crossings<1, vp::int128>(both, clip)));
        EXPECT_EQ((crossings<2, std::int64_t>(both, clip)), (crossings<2, vp::int128>(both, clip)));
    }
}

// Rows along x as text, of triangles in 32 bits, whose box has at most small_voxels.
std::string small_crossings(const snapped_mesh& s, const core::voxel_box& clip) {
    std::string text;
    for (const glm::uvec3& t : s.m.triangles) {
        const core::snapped_position p[3] = {s.positions[t.x], s.positions[t.y], s.positions[t.z]};
        const core::row_box rows = core::rows_within<0>(p[0], p[1], p[2], s.fraction, clip);
        if (rows.empty()) continue;
        const std::int64_t origin[3] = {core::min3(p[0].x, p[1].x, p[2].x) >> s.fraction,
                                        core::min3(p[0].y, p[1].y, p[2].y) >> s.fraction,
                                        core::min3(p[0].z, p[1].z, p[2].z) >> s.fraction};
        core::small_triangle at{};
        for (int v = 0; v < 3; ++v) {
            const std::int64_t q[3] = {p[v].x, p[v].y, p[v].z};
            for (int k = 0; k < 3; ++k) at.p[v][k] = static_cast<std::int32_t>(q[k] - (origin[k] << s.fraction));
        }
        const core::small_crossings c(at, s.fraction);
        core::for_each_small_crossing(c, static_cast<int>(rows.u.lo - origin[1]),
                                      static_cast<int>(rows.u.hi - origin[1]), static_cast<int>(rows.v.lo - origin[2]),
                                      static_cast<int>(rows.v.hi - origin[2]), [&](int y, int z, int x) {
                                          text += std::to_string(origin[1] + y) + " " + std::to_string(origin[2] + z) +
                                                  " " + std::to_string(origin[0] + x) + " " +
                                                  std::to_string(c.winding) + "\n";
                                      });
    }
    return text;
}

TEST(Crossings, SmallTrianglesAreThoseOfTheWidePathUpToTheLargestOnes) {
    splitmix64 random(7);
    std::size_t found = 0;
    for (const int extent : {1, 256, 512, 1024, 4096}) {
        const int fraction = core::fraction_bits(extent);
        const std::int64_t most = std::int64_t{core::small_voxels(fraction)} << fraction;
        ASSERT_GT(most, 0);
        for (int round = 0; round < 4000; ++round) {
            // From specks to the largest box, often with corners on centres and on faces; and slivers.
            const std::int64_t side = random.one_in(3) ? most : std::int64_t{1} << random.between(2, fraction + 3);
            const std::int64_t grain = random.one_in(2) ? std::int64_t{1} << (fraction - 1) : 1;
            std::int64_t corner[3];
            for (auto& c : corner) c = random.between(-3, 3) << fraction;
            mesh m;
            m.triangles.push_back({0, 1, 2});
            m.positions.resize(3);
            snapped_mesh s(m, unit_grid(glm::ivec3(extent)));
            for (int v = 0; v < 3; ++v) {
                std::int64_t q[3];
                for (int k = 0; k < 3; ++k) {
                    const std::int64_t end = side < most ? side : most;
                    const auto inside = static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(end)));
                    q[k] = corner[k] + (random.one_in(6) ? 0 : random.one_in(6) ? end - 1 : inside / grain * grain);
                }
                s.positions[static_cast<std::size_t>(v)] = {q[0], q[1], q[2]};
            }
            if (random.one_in(4)) { // all but collinear
                const auto &a = s.positions[0], &b = s.positions[1];
                s.positions[2] = {(a.x + b.x) / 2, (a.y + b.y) / 2, ((a.z + b.z) / 2) ^ 1};
            }
            const core::voxel_box clip{{{-40, -40, -40}}, {{40, 40, 40}}};
            const std::string wide = crossings<0, std::int64_t>(s, clip);
            ASSERT_EQ(small_crossings(s, clip), wide) << "extent " << extent << ", round " << round;
            found += wide.size();
        }
    }
    EXPECT_GT(found, 100000u);
}

TEST(Crossings, MeshesOfTheGreatestSizeHaveTheOraclesWindings) {
    splitmix64 random(6);
    std::size_t inside = 0;
    for (int round = 0; round < 30; ++round) {
        // Corners up to 2^24 voxels away, which is 2^40 units: the 128-bit path.
        mesh m = random_cycle(random, 4, -(1 << 23), 1 << 23, 1);
        m.add(random_cycle(random, 3, -4, 10, 2));
        const vp::grid g = unit_grid({7, 6, 5});
        SCOPED_TRACE("round " + std::to_string(round));
        expect_oracle<core::centre_offset<>>(m, g, {0, 1, 2});
        inside += count(accepted(oracle_windings(m, g, skew), vp::fill_rule::nonzero));
    }
    EXPECT_GT(inside, 0u);
}

} // namespace
} // namespace solids
