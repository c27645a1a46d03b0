// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coverage of small triangles in 32 bits against the general path of coverage.hpp, which the oracle checks. Triangles
// of every size that the small path accepts: random, on voxel faces and edges, thin needles, without area.

#include "random_triangles.hpp"

#include <voxelpipe/core/small_conservative.hpp>
#include <voxelpipe/core/small_thin.hpp>
#include <voxelpipe/core/thin_cube.hpp>

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <random>

namespace {

using namespace random_triangles;

struct kept_rows { // small_thin::columns
    std::uint32_t words[32] = {};
    void set(int i, std::uint32_t row) { words[i] = row; }
    std::uint32_t get(int i) const { return words[i]; }
};

bool make_small(const snapped_position (&v)[3], int fraction, const voxel_box& box, small_triangle& t) {
    const int max_extent = small_voxels(fraction);
    for (int k = 0; k < 3; ++k)
        if (box.hi[k] - box.lo[k] >= max_extent) return false;
    for (int i = 0; i < 3; ++i) {
        const std::int64_t q[3] = {v[i].x, v[i].y, v[i].z};
        for (int k = 0; k < 3; ++k) t.p[i][k] = static_cast<std::int32_t>(q[k] - (box.lo[k] << fraction));
    }
    return true;
}

TEST(SmallTriangle, ConservativeRowsAreTheGeneralSet) {
    generator g;
    std::uint64_t limits_clipped = 0, sure_limits = 0, whole_limits = 0;
    int compared = 0, tiny = 0, sixteens = 0;
    std::uint64_t covered = 0;
    for (const int fraction : {4, 8, 10, 12, 13, 14, 15, 16, 17, 19}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(40000); ++i) {
            snapped_position v[3];
            g.triangle(v);
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            small_triangle t{};
            if (!make_small(v, fraction, box, t)) continue;
            ++compared;
            const small_conservative s(t, fraction);
            voxels rows;
            const int last = static_cast<int>(box.hi[0] - box.lo[0]);
            const int from = static_cast<int>(g.number(0, last)); // a query for a part of a row returns that part
            for (int z = 0; z <= box.hi[2] - box.lo[2]; ++z)
                for (int y = 0; y <= box.hi[1] - box.lo[1]; ++y) {
                    const std::uint32_t whole = s.row(0, last, y, z);
                    ASSERT_EQ(s.row(from, last, y, z), whole >> from);
                    for (int x = 0; x < 32; ++x)
                        if (((whole >> x) & 1u) != 0)
                            rows.insert({static_cast<int>(box.lo[0]) + x, static_cast<int>(box.lo[1]) + y,
                                         static_cast<int>(box.lo[2]) + z});
                }
            const voxels expected = by_the_general_path<span_rule::conservative>(v, fraction, box);
            const small_box all{
                {0, 0, 0}, {last, static_cast<int>(box.hi[1] - box.lo[1]), static_cast<int>(box.hi[2] - box.lo[2])}};
            if (max3(all.hi[0], all.hi[1], all.hi[2]) < 8) {
                ++tiny;
                voxels again;
                const auto into_again = [&](int y, int z, std::uint32_t bits) {
                    for (int x = 0; x < 32; ++x)
                        if (((bits >> x) & 1u) != 0)
                            again.insert({static_cast<int>(box.lo[0]) + x, static_cast<int>(box.lo[1]) + y,
                                          static_cast<int>(box.lo[2]) + z});
                };
                s.rows<false>(all, into_again);
                ASSERT_EQ(again, expected) << "fraction " << fraction << ", triangle " << i;
                again.clear();
                s.rows<true>(all, into_again);
                ASSERT_EQ(again, expected) << "fraction " << fraction << ", triangle " << i;
            }
            voxels longer;
            s.long_rows(all, [&](int y, int z, std::uint32_t bits) {
                for (int x = 0; x < 32; ++x)
                    if (((bits >> x) & 1u) != 0)
                        longer.insert({static_cast<int>(box.lo[0]) + x, static_cast<int>(box.lo[1]) + y,
                                       static_cast<int>(box.lo[2]) + z});
            });
            ASSERT_EQ(longer, expected) << "fraction " << fraction << ", triangle " << i;
            struct {
                std::array<std::uint32_t, 16> words{};
                void set(int at, std::uint32_t word) { words.at(static_cast<std::size_t>(at)) = word; }
                std::uint32_t get(int at) const { return words.at(static_cast<std::size_t>(at)); }
            } limits;
            if (max3(all.hi[0], all.hi[1], all.hi[2]) < 16) {
                ++sixteens;
                voxels again;
                s.rows_of_16<false>(all, limits, [&](int y, int z, std::uint32_t bits) {
                    for (int x = 0; x < 32; ++x)
                        if (((bits >> x) & 1u) != 0)
                            again.insert({static_cast<int>(box.lo[0]) + x, static_cast<int>(box.lo[1]) + y,
                                          static_cast<int>(box.lo[2]) + z});
                });
                ASSERT_EQ(again, expected) << "fraction " << fraction << ", triangle " << i;
                // A query for a part of the box returns that part of the set.
                const small_box part{{static_cast<int>(g.number(0, all.hi[0])),
                                      static_cast<int>(g.number(0, all.hi[1])),
                                      static_cast<int>(g.number(0, all.hi[2]))},
                                     {all.hi[0], all.hi[1], all.hi[2]}};
                voxels by_rows, by_sixteen, wanted;
                const auto into = [&](voxels& to) {
                    return [&](int y, int z, std::uint32_t bits) {
                        for (int x = 0; x < 32; ++x)
                            if (((bits >> x) & 1u) != 0)
                                to.insert({static_cast<int>(box.lo[0]) + part.lo[0] + x,
                                           static_cast<int>(box.lo[1]) + y, static_cast<int>(box.lo[2]) + z});
                    };
                };
                for (const auto& [x, y, z] : expected)
                    if (x >= box.lo[0] + part.lo[0] && y >= box.lo[1] + part.lo[1] && z >= box.lo[2] + part.lo[2])
                        wanted.insert({x, y, z});
                s.rows_of_16<true>(part, limits, into(by_sixteen));
                ASSERT_EQ(by_sixteen, wanted) << "fraction " << fraction << ", triangle " << i;
                by_sixteen.clear();
                for (small_conservative::row_walk_16 walk(s, part, true, limits); !walk.is_done();)
                    walk.next<true>(s, limits, into(by_sixteen));
                ASSERT_EQ(by_sixteen, wanted) << "fraction " << fraction << ", triangle " << i;
                if (max3(all.hi[0], all.hi[1], all.hi[2]) < 8) {
                    for (auto walk = small_conservative::row_walk_8::of(s, part, true); !walk.is_done();)
                        walk.next<true>(s, into(by_rows));
                    ASSERT_EQ(by_rows, wanted) << "fraction " << fraction << ", triangle " << i;
                    by_rows.clear();
                }
                if (part.hi[0] - part.lo[0] < 8) {
                    s.rows<true>(part, into(by_rows));
                    ASSERT_EQ(by_rows, wanted) << "fraction " << fraction << ", triangle " << i;
                }
            }
            // A box outside the grid gives nothing.
            const small_box none{{1, 0, 0}, {0, all.hi[1], all.hi[2]}};
            s.rows<true>(none, [&](int, int, std::uint32_t) { ADD_FAILURE(); });
            s.rows_of_16<true>(none, limits, [&](int, int, std::uint32_t) { ADD_FAILURE(); });
            ASSERT_TRUE(small_conservative::row_walk_8::of(s, none, true).is_done());
            ASSERT_TRUE(small_conservative::row_walk_16(s, none, true, limits).is_done());
            const near_plane plane(s.n, s.below, s.above, from, true), as_it_is(s.n, s.below, s.above, from, false);
            for (int y = 0; y <= all.hi[1]; ++y)
                for (int z = 0; z <= all.hi[2]; ++z) {
                    const std::uint32_t limit = s.limit_at_y(from, last, y) & s.limit_at_z(from, last, z);
                    ASSERT_EQ(s.meets_row(y, z) ? s.plane_bits(from, y, z, limit) : 0u, s.row(from, last, y, z));
                    if (limit == 0) continue;
                    // Floats that say they are certain are right, and they mostly are certain.
                    const std::uint32_t left = s.plane_bits(from, y, z, limit);
                    const int begin = voxelpipe::exact::lowest_one(limit), end = voxelpipe::exact::highest_one(limit);
                    bool sure = false;
                    const std::uint32_t clipped = plane.clip(begin, end, y, z, sure);
                    ++limits_clipped;
                    if (sure) {
                        ++sure_limits;
                        ASSERT_EQ(clipped, left) << "fraction " << fraction << ", triangle " << i;
                    }
                    ASSERT_EQ(plane.meets(begin, end, y, z), as_it_is.meets(begin, end, y, z));
                    if (plane.meets(begin, end, y, z)) {
                        ++whole_limits;
                        ASSERT_EQ(left, limit) << "fraction " << fraction << ", triangle " << i;
                    }
                }
            covered += expected.size();
            ASSERT_EQ(rows, expected) << "fraction " << fraction << ", triangle " << i;
        }
    }
    EXPECT_GT(compared, unit::cases(100000));
    EXPECT_GT(covered, static_cast<std::uint64_t>(compared));
    EXPECT_GT(tiny, compared / 4);
    EXPECT_GT(sixteens, tiny);
    EXPECT_GT(whole_limits, limits_clipped / 10);
    EXPECT_GT(sure_limits, whole_limits);
    EXPECT_GT(sure_limits, limits_clipped * 7 / 10);
}

TEST(SmallTriangle, ThinColumnsAreTheGeneralSet) {
    generator g;
    int compared = 0, cubes = 0, beyond = 0;
    for (const int fraction : {4, 8, 10, 12, 13, 14, 15, 16, 17, 19}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(40000); ++i) {
            snapped_position v[3];
            g.triangle(v);
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            small_triangle t{};
            if (!make_small(v, fraction, box, t)) continue;
            const auto setup = setup_triangle<span_rule::thin, std::int64_t>(v[0], v[1], v[2], fraction);
            const triple<std::int64_t> normal = small_normal(t),
                                       turned = to_uvw(setup.axis, normal[0], normal[1], normal[2]);
            for (int k = 0; k < 3; ++k) ASSERT_EQ(turned[k], setup.normal[k]);
            ASSERT_EQ(small_axis(normal), setup.zero_area ? -1 : setup.axis);
            if (setup.zero_area) continue;
            ++compared;
            const small_thin s(t, normal, setup.axis, fraction);
            const auto last = to_uvw(s.axis, box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
            const auto origin = to_uvw(s.axis, box.lo[0], box.lo[1], box.lo[2]);
            const int from = static_cast<int>(g.number(0, last[0]));
            voxel_box wide = box; // the depth may lie outside the bounding box
            for (int k = 0; k < 3; ++k) {
                wide.lo[k] -= 2;
                wide.hi[k] += 2;
            }
            const voxels rows = by_the_general_path<span_rule::thin>(v, fraction, wide);
            const auto width = static_cast<int>(last[0]) + 1, height = static_cast<int>(last[1]) + 1;
            const auto by_columns = [&](bool swapped, int begin, int step) {
                voxels again;
                small_thin turned_round = s;
                if (swapped) turned_round.swap_uv();
                kept_rows kept;
                for (int first = 0; first < step; ++first) {
                    int v = 0;
                    turned_round.columns(
                        begin, (swapped ? height : width) - 1, first, (swapped ? width : height) - 1, step, kept,
                        [&](int row) {
                            EXPECT_EQ(row % step, first);
                            v = row;
                        },
                        [&](int u, int w) {
                            const auto p = to_xyz(s.axis, origin[0] + (swapped ? v : u), origin[1] + (swapped ? u : v),
                                                  origin[2] + w);
                            again.insert({static_cast<int>(p[0]), static_cast<int>(p[1]), static_cast<int>(p[2])});
                        });
                }
                return again;
            };
            for (const bool swapped : {false, true})
                for (const int step : {1, 8})
                    ASSERT_EQ(by_columns(swapped, 0, step), rows) << "fraction " << fraction << ", triangle " << i;
            std::uint32_t count = 0;
            kept_rows kept;
            (void)s.find_columns(0, width - 1, 0, height - 1, 1, kept, count);
            ASSERT_EQ(count, rows.size()) << "fraction " << fraction << ", triangle " << i;
            ASSERT_TRUE(by_columns(false, width, 1).empty()); // a part of the box without columns
            voxels part = rows;
            std::erase_if(part, [&](const auto& p) {
                return to_uvw<std::int64_t>(s.axis, std::get<0>(p), std::get<1>(p), std::get<2>(p))[0] <
                       origin[0] + from;
            });
            ASSERT_EQ(by_columns(false, from, 1), part) << "fraction " << fraction << ", triangle " << i;
            if (max3(last[0], last[1], last[2]) < 2) { // all columns at once
                ++cubes;
                voxels again;
                const int reach[3] = {static_cast<int>(box.hi[0] - box.lo[0]), static_cast<int>(box.hi[1] - box.lo[1]),
                                      static_cast<int>(box.hi[2] - box.lo[2])};
                const thin_cube cube = thin_cube_by_integers(t, reach, fraction);
                ASSERT_EQ(cube.axis, s.axis);
                for (int at = 0; at < 4; ++at) {
                    if ((cube.columns >> at & 1u) == 0) continue;
                    beyond += static_cast<int>(cube.depth(at) < 0 || cube.depth(at) > last[2]);
                    const auto p = cube.voxel(at);
                    again.insert({static_cast<int>(box.lo[0]) + p[0], static_cast<int>(box.lo[1]) + p[1],
                                  static_cast<int>(box.lo[2]) + p[2]});
                }
                ASSERT_EQ(again, rows) << "fraction " << fraction << ", triangle " << i;
            }
        }
    }
    EXPECT_GT(compared, unit::cases(80000));
    EXPECT_GT(cubes, unit::cases(5000));
    EXPECT_GT(beyond, unit::cases(100));
}

TEST(SmallTriangle, NearPositionsSnapAsAllDo) {
    generator g;
    snap_transform t{
        {-1.25, 3.5, 0.1}, {16384.0 / 0.013, 16384.0 / 0.017, 16384.0 / 0.3}, {0, 5 << 14, 900 << 14}, 14, {}};
    for (int k = 0; k < 3; ++k) t.shift[k] = voxelpipe::exact::rounding_shift(t.offset[k]);
    std::uniform_real_distribution<float> place(-40.0f, 40.0f);
    for (int i = 0; i < unit::cases(100000); ++i) {
        const float x = place(g.random), y = place(g.random), z = place(g.random) * 20;
        std::int32_t q[3];
        ASSERT_TRUE(snap_int32(t, x, y, z, q));
        const snapped_position p = snap(t, x, y, z);
        ASSERT_EQ(q[0], p.x);
        ASSERT_EQ(q[1], p.y);
        ASSERT_EQ(q[2], p.z);
    }
    std::int32_t q[3];
    EXPECT_FALSE(snap_int32(t, std::numeric_limits<float>::quiet_NaN(), 0, 0, q));
    EXPECT_FALSE(snap_int32(t, 0, std::numeric_limits<float>::infinity(), 0, q));
    EXPECT_FALSE(snap_int32(t, 0, 0, -1e30f, q));
    EXPECT_FALSE(snap_int32(t, 1000.0f, 0, 0, q)); // 1.26e9 units
}

} // namespace
