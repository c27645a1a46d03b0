// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coverage of small triangles in 32 bits against the general path of coverage.hpp, which the oracle checks. Triangles
// of every size that the small path accepts: random, on voxel faces and edges, thin needles, without area.

#include "test_support.hpp"

#include <voxelpipe/core/brick_triangle.hpp>
#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/core/mask_triangle.hpp>
#include <voxelpipe/core/morton.hpp>
#include <voxelpipe/core/small_conservative.hpp>
#include <voxelpipe/core/small_thin.hpp>
#include <voxelpipe/core/thin_cube.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <random>
#include <set>
#include <tuple>

namespace {

using namespace voxelpipe::core;
using voxels = std::set<std::tuple<int, int, int>>;

struct kept_rows { // small_thin::columns
    std::uint32_t words[32] = {};
    void set(int i, std::uint32_t row) { words[i] = row; }
    std::uint32_t get(int i) const { return words[i]; }
};

struct generator {
    std::mt19937_64 random{20261121};
    int fraction = 14;

    std::int64_t number(std::int64_t lo, std::int64_t hi) { return std::uniform_int_distribution(lo, hi)(random); }

    // A vertex in a box of `size` units at `corner`; some coordinates lie on voxel faces.
    snapped_position vertex(const snapped_position& corner, std::int64_t size) {
        const auto one = [&](std::int64_t at) {
            std::int64_t q = at + number(0, size);
            if (number(0, 5) == 0) q = (q + (std::int64_t{1} << (fraction - 1))) >> fraction << fraction;
            return q;
        };
        return {one(corner.x), one(corner.y), one(corner.z)};
    }

    void triangle(snapped_position (&v)[3]) {
        const std::int64_t size = number(0, std::int64_t{1} << number(2, std::min(small_edge_bits - 1, fraction + 5)));
        const std::int64_t far = std::int64_t{1} << 24;
        const snapped_position corner{number(-far, far), number(-far, far), number(-far, far)};
        for (auto& p : v) p = vertex(corner, size);
        switch (number(0, 9)) {
        case 0: // a segment
            v[2] = v[0];
            break;
        case 1: // collinear
            v[2] = {v[0].x + 2 * (v[1].x - v[0].x), v[0].y + 2 * (v[1].y - v[0].y), v[0].z + 2 * (v[1].z - v[0].z)};
            break;
        case 2: // in an axis plane
            v[1].y = v[2].y = v[0].y;
            break;
        case 3: // a needle
            v[2] = {v[1].x + number(-1, 1), v[1].y + number(-1, 1), v[1].z + number(-1, 1)};
            break;
        case 4: // a point
            v[1] = v[2] = v[0];
            break;
        default:
            break;
        }
    }
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

voxel_box coarsen_box(const voxel_box& box) {
    voxel_box r{};
    for (int k = 0; k < 3; ++k) {
        r.lo[k] = box.lo[k] >> log2_raster_brick;
        r.hi[k] = box.hi[k] >> log2_raster_brick;
    }
    return r;
}

template <span_rule Rule>
voxels by_the_general_path(const snapped_position (&v)[3], int fraction, const voxel_box& clip) {
    voxels out;
    rasterize<Rule>(v[0], v[1], v[2], fraction, clip,
                    [&](const auto& t, std::int64_t u, std::int64_t w, std::int64_t w0, std::int64_t w1) {
                        for (std::int64_t d = w0; d <= w1; ++d) {
                            const auto p = to_xyz(t.axis, u, w, d);
                            out.insert({static_cast<int>(p[0]), static_cast<int>(p[1]), static_cast<int>(p[2])});
                        }
                    });
    return out;
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

TEST(BrickTriangle, BricksMakeTheGeneralSet) {
    generator g;
    std::uint64_t covered = 0, tested = 0, met = 0, runs = 0, long_runs = 0;
    for (const int fraction : {4, 8, 10, 12, 13, 14, 15, 16, 17, 19}) {
        g.fraction = fraction;
        for (int i = 0; i < unit::cases(600); ++i) {
            snapped_position v[3];
            g.triangle(v);
            const auto stretch = g.number(1, 5); // up to a hundred voxels and more
            for (auto& p : v) {
                p.x = v[0].x + (p.x - v[0].x) * stretch;
                p.y = v[0].y + (p.y - v[0].y) * g.number(1, 3);
                p.z = v[0].z + (p.z - v[0].z) * stretch;
            }
            if (!fits_narrow(v[0], v[1], v[2], fraction)) continue;
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            const brick_triangle t(v[0], v[1], v[2], box, fraction);
            const auto setup = setup_triangle<span_rule::thin, std::int64_t>(v[0], v[1], v[2], fraction);
            voxels found;
            const voxel_box bricks = coarsen_box(box);
            for (std::int64_t bz = bricks.lo[2]; bz <= bricks.hi[2]; ++bz)
                for (std::int64_t by = bricks.lo[1]; by <= bricks.hi[1]; ++by)
                    for (std::int64_t bx = bricks.lo[0]; bx <= bricks.hi[0]; ++bx) {
                        ++tested;
                        const int at[3] = {static_cast<int>(bx * raster_brick_size - box.lo[0]),
                                           static_cast<int>(by * raster_brick_size - box.lo[1]),
                                           static_cast<int>(bz * raster_brick_size - box.lo[2])};
                        if (!t.meets(at[0], at[1], at[2])) continue;
                        ++met;
                        const small_conservative s = t.at(at[0], at[1], at[2]);
                        int lo[3], hi[3];
                        for (int k = 0; k < 3; ++k) {
                            lo[k] = at[k] < 0 ? -at[k] : 0;
                            const int end = static_cast<int>(box.hi[k] - box.lo[k]) - at[k];
                            hi[k] = end < raster_brick_size ? end : raster_brick_size - 1;
                        }
                        const auto turned = to_uvw(setup.axis, at[0], at[1], at[2]);
                        double first = 0, last = 0;
                        t.depths(setup.axis, turned[0], turned[1], first, last);
                        for (int z = lo[2]; z <= hi[2]; ++z)
                            for (int y = lo[1]; y <= hi[1]; ++y) {
                                const std::uint32_t limit =
                                    s.limit_at_y(lo[0], hi[0], y) & s.limit_at_z(lo[0], hi[0], z);
                                const std::uint32_t bits = s.meets_row(y, z) ? s.plane_bits(lo[0], y, z, limit) : 0;
                                ASSERT_EQ(bits, s.row(lo[0], hi[0], y, z));
                                for (int x = 0; x < raster_brick_size; ++x) {
                                    if (((bits >> x) & 1u) == 0) continue;
                                    const int p[3] = {at[0] + lo[0] + x, at[1] + y, at[2] + z};
                                    ASSERT_GE(p[setup.axis], first);
                                    ASSERT_LE(p[setup.axis], last);
                                    found.insert({static_cast<int>(box.lo[0]) + p[0],
                                                  static_cast<int>(box.lo[1]) + p[1],
                                                  static_cast<int>(box.lo[2]) + p[2]});
                                }
                            }
                    }
            const voxels expected = by_the_general_path<span_rule::conservative>(v, fraction, box);
            covered += expected.size();
            ASSERT_EQ(found, expected) << "fraction " << fraction << ", triangle " << i;

            if (setup.zero_area) continue;
            voxel_box wide = box;
            for (int k = 0; k < 3; ++k) {
                wide.lo[k] -= 2;
                wide.hi[k] += 2;
            }
            const voxels expected_thin = by_the_general_path<span_rule::thin>(v, fraction, wide);
            for (const bool along_v : {false, true}) {
                const row_axes axes{setup.axis, along_v};
                const brick_thin thin(v[0], v[1], v[2], box, axes, fraction);
                const auto last = axes.to_rows(box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]);
                const auto origin = axes.to_rows(box.lo[0], box.lo[1], box.lo[2]);
                voxels columns;
                const auto before =
                    static_cast<int>(g.number(0, raster_brick_size - 1)); // distance of the box from the brick's begin
                for (int at_v = 0; at_v <= last[1]; ++at_v)
                    for (int at_u = -before; at_u <= last[0]; at_u += raster_brick_size) {
                        const int end = static_cast<int>(last[0]) - at_u;
                        brick_row row(thin, at_u, at_v, at_u < 0 ? before : 0,
                                      end < raster_brick_size ? end : raster_brick_size - 1);
                        if (row.columns == 0) continue;
                        ASSERT_TRUE(thin.meets_row(at_u, at_v));
                        const int lowest = row.first_column(), highest = row.last_column();
                        ASSERT_EQ(row.columns, (2u << highest) - (1u << lowest)); // no gaps
                        for (int u = lowest, end = 0; u <= highest; u = end + 1, ++runs) {
                            const std::int32_t depth = row.depth(thin, u);
                            end = row.last_of_depth(thin, depth, u, highest);
                            ASSERT_TRUE(u <= end && end <= highest);
                            ASSERT_TRUE(end == highest || row.depth(thin, end + 1) != depth);
                            long_runs += end - u > 3 ? 1 : 0;
                            for (int k = u; k <= end; ++k) {
                                const auto p = axes.from_rows(origin[0] + at_u + k, origin[1] + at_v,
                                                              origin[2] + row.base + depth);
                                columns.insert(
                                    {static_cast<int>(p[0]), static_cast<int>(p[1]), static_cast<int>(p[2])});
                            }
                        }
                    }
                ASSERT_EQ(columns, expected_thin) << "fraction " << fraction << ", triangle " << i << ", " << along_v;
            }
        }
    }
    EXPECT_GT(covered, static_cast<std::uint64_t>(150 * unit::cases(600)));
    EXPECT_LT(met, tested);
    EXPECT_GT(long_runs, static_cast<std::uint64_t>(unit::cases(600)));
    EXPECT_GT(runs, 2 * long_runs);
}

// Rows of triangles as large as the 64-bit path allows, some thousand voxels. There, depths in floats are relative to a
// base per row.
TEST(BrickTriangle, RowsOfTheLargestTrianglesAreTheGeneralSet) {
    generator g;
    std::uint64_t rows = 0, far_rows = 0;
    for (const int fraction : {12, 13, 14, 15, 16})
        for (int i = 0; i < unit::cases(300); ++i) {
            const std::int64_t max_size = (std::int64_t{1} << narrow_edge_bits(fraction)) - 1;
            const std::int64_t size[3] = {g.number(max_size / 2, max_size), g.number(max_size / 64, max_size),
                                          g.number(max_size / 2, max_size)};
            const snapped_position corner{g.number(-max_size, max_size), g.number(-max_size, max_size),
                                          g.number(-max_size, max_size)};
            snapped_position v[3];
            for (auto& p : v)
                p = {corner.x + g.number(0, size[0]), corner.y + g.number(0, size[1]), corner.z + g.number(0, size[2])};
            if (!fits_narrow(v[0], v[1], v[2], fraction)) continue;
            const auto setup = setup_triangle<span_rule::thin, std::int64_t>(v[0], v[1], v[2], fraction);
            if (setup.zero_area) continue;
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            for (const bool along_v : {false, true}) {
                const row_axes axes{setup.axis, along_v};
                const brick_thin thin(v[0], v[1], v[2], box, axes, fraction);
                const auto origin = axes.to_rows(box.lo[0], box.lo[1], box.lo[2]),
                           end = axes.to_rows(box.hi[0], box.hi[1], box.hi[2]);
                for (int k = 0; k < 20; ++k) {
                    const auto at_u = static_cast<int>(g.number(0, end[0] - origin[0])),
                               at_v = static_cast<int>(g.number(0, end[1] - origin[1]));
                    const std::int64_t left = end[0] - origin[0] - at_u;
                    const int last = left < raster_brick_size ? static_cast<int>(left) : raster_brick_size - 1;
                    const brick_row row(thin, at_u, at_v, 0, last);
                    voxels columns;
                    for (std::uint32_t rest = row.columns; rest != 0; rest &= rest - 1) {
                        const int u = voxelpipe::exact::lowest_one(rest);
                        const auto p = axes.from_rows(origin[0] + at_u + u, origin[1] + at_v,
                                                      origin[2] + row.base + row.depth(thin, u));
                        columns.insert({static_cast<int>(p[0]), static_cast<int>(p[1]), static_cast<int>(p[2])});
                    }
                    const voxel_box clip{axes.from_rows(origin[0] + at_u, origin[1] + at_v, origin[2] - 2),
                                         axes.from_rows(origin[0] + at_u + last, origin[1] + at_v, end[2] + 2)};
                    ASSERT_EQ(columns, by_the_general_path<span_rule::thin>(v, fraction, clip))
                        << "fraction " << fraction << ", triangle " << i << ", " << along_v;
                    rows += columns.empty() ? 0 : 1;
                    far_rows += !columns.empty() && row.base > 200 ? 1 : 0;
                }
            }
        }
    EXPECT_GT(rows, static_cast<std::uint64_t>(5 * unit::cases(300)));
    EXPECT_GT(far_rows, static_cast<std::uint64_t>(unit::cases(300)));
}

namespace {

// What rows of a brick leave, by the bits that go into its mask. `brick`: its first voxel.
voxels voxels_of_mask_brick(const mask_triangle& t, const voxel_box& box, const triple<std::int64_t>& brick) {
    const auto o = turn_to_row(t.row, static_cast<int>(brick[0] - box.lo[0]), static_cast<int>(brick[1] - box.lo[1]),
                               static_cast<int>(brick[2] - box.lo[2]));
    if (!meets_mask_brick(t, o)) return {};
    int from[3], to[3];
    for (int k = 0; k < 3; ++k) {
        from[k] = static_cast<int>(std::max<std::int64_t>(box.lo[k] - brick[k], 0));
        to[k] = static_cast<int>(std::min<std::int64_t>(box.hi[k] - brick[k], mask_brick_size - 1));
    }
    const auto lo = turn_to_row(t.row, from[0], from[1], from[2]), hi = turn_to_row(t.row, to[0], to[1], to[2]);
    const small_box part{{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
    const small_conservative s = in_mask_brick(t, o);
    const mask_rows rows(s, part);
    const near_plane plane(s.n, s.below, s.above, 0, true);
    std::uint64_t words[8] = {};
    for (std::uint64_t left = rows.met; left != 0; left &= left - 1) {
        const int at = std::countr_zero(left), across = at % 8, deep = at / 8;
        const auto limit = static_cast<std::uint32_t>(rows.by_across >> 8 * across & rows.by_deep >> 8 * deep & 255u);
        if (limit == 0) continue;
        place_mask_row(
            t.row, across, deep, s.plane_bits<true>(plane, 0, across, deep, limit),
            [&](unsigned word, std::uint32_t bits) { words[word / 2] |= std::uint64_t{bits} << (word % 2 * 32); });
    }
    voxels found;
    for (unsigned bit = 0; bit < 512; ++bit) {
        if ((words[bit / 64] >> bit % 64 & 1u) == 0) continue;
        const glm::ivec3 p = morton_position(bit);
        found.insert(
            {static_cast<int>(brick[0]) + p.x, static_cast<int>(brick[1]) + p.y, static_cast<int>(brick[2]) + p.z});
    }
    return found;
}

} // namespace

TEST(MaskTriangle, BricksMakeTheGeneralSet) {
    generator g;
    std::uint64_t covered = 0;
    for (const int fraction : {4, 8, 10, 12, 14, 16, 17})
        for (int i = 0; i < unit::cases(400); ++i) {
            g.fraction = fraction;
            snapped_position v[3];
            g.triangle(v);
            const auto stretch = g.number(1, 4);
            for (auto& p : v) {
                p.x = v[0].x + (p.x - v[0].x) * stretch;
                p.z = v[0].z + (p.z - v[0].z) * stretch;
            }
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            const mask_triangle t(v[0], v[1], v[2], box.lo, fraction);
            voxels found;
            const auto first = [&](int k) { return box.lo[k] & ~std::int64_t{mask_brick_size - 1}; };
            for (std::int64_t z = first(2); z <= box.hi[2]; z += mask_brick_size)
                for (std::int64_t y = first(1); y <= box.hi[1]; y += mask_brick_size)
                    for (std::int64_t x = first(0); x <= box.hi[0]; x += mask_brick_size)
                        found.merge(voxels_of_mask_brick(t, box, {{x, y, z}}));
            const voxels expected = by_the_general_path<span_rule::conservative>(v, fraction, box);
            covered += expected.size();
            ASSERT_EQ(found, expected) << "fraction " << fraction << ", triangle " << i;
        }
    EXPECT_GT(covered, static_cast<std::uint64_t>(80 * unit::cases(400)));
}

// Up to the largest edges that fit, 65,536 voxels and more: bricks about points of the triangle, which lie anywhere,
// and the range of depths that bricks are looked for in.
TEST(MaskTriangle, BricksOfTheLargestTrianglesAreTheGeneralSet) {
    generator g;
    std::uint64_t covered = 0, missed = 0;
    for (const int fraction : {8, 9, 11, 12, 14, 16})
        for (int i = 0; i < unit::cases(300); ++i) {
            g.fraction = fraction;
            const std::int64_t most = std::int64_t{1} << mask_triangle::max_edge_bits;
            const std::int64_t size[3] = {g.number(most / 2, most), g.number(0, most >> g.number(0, 20)),
                                          g.number(most / 2, most)};
            const auto axis = static_cast<int>(g.number(0, 2));
            const snapped_position corner{g.number(-most, most), g.number(-most, most), g.number(-most, most)};
            snapped_position v[3];
            for (auto& p : v) {
                const auto at =
                    to_xyz<std::int64_t>(axis, g.number(0, size[0]), g.number(0, size[1]), g.number(0, size[2]));
                p = {corner.x + at[0], corner.y + at[1], corner.z + at[2]};
            }
            ASSERT_TRUE(mask_triangle::fits(v[0], v[1], v[2]));
            const voxel_box box = bounds(v[0], v[1], v[2], fraction);
            const mask_triangle t(v[0], v[1], v[2], box.lo, fraction);
            for (int k = 0; k < 10; ++k) {
                const double a = static_cast<double>(g.number(0, 1000)) / 1000,
                             b = static_cast<double>(g.number(0, 1000)) / 1000 * (1 - a);
                const auto near = [&](std::int64_t p, std::int64_t q, std::int64_t r) {
                    return static_cast<std::int64_t>(static_cast<double>(p) + a * static_cast<double>(q - p) +
                                                     b * static_cast<double>(r - p)) >>
                           fraction;
                };
                triple<std::int64_t> brick{
                    {near(v[0].x, v[1].x, v[2].x), near(v[0].y, v[1].y, v[2].y), near(v[0].z, v[1].z, v[2].z)}};
                voxel_box clip{};
                for (int d = 0; d < 3; ++d) {
                    brick[d] = (brick[d] + g.number(-6, 6)) & ~std::int64_t{mask_brick_size - 1};
                    clip.lo[d] = brick[d];
                    clip.hi[d] = brick[d] + mask_brick_size - 1;
                }
                clip = intersect(clip, box);
                if (clip.empty()) continue;
                const voxels expected = by_the_general_path<span_rule::conservative>(v, fraction, clip),
                             found = voxels_of_mask_brick(t, box, brick);
                ASSERT_EQ(found, expected) << "fraction " << fraction << ", triangle " << i;
                covered += found.size();
                missed += found.empty() ? 1 : 0;
                const auto origin =
                    to_uvw<std::int64_t>(axis, brick[0] - box.lo[0], brick[1] - box.lo[1], brick[2] - box.lo[2]);
                double first = 0, last = 0;
                t.depths(axis, static_cast<int>(origin[0]), static_cast<int>(origin[1]), first, last);
                for (const auto& [x, y, z] : found) {
                    const auto at = to_uvw<std::int64_t>(axis, x - box.lo[0], y - box.lo[1], z - box.lo[2]);
                    ASSERT_GE(static_cast<double>(at[2]), first);
                    ASSERT_LE(static_cast<double>(at[2]), last);
                }
            }
        }
    EXPECT_GT(covered, static_cast<std::uint64_t>(500 * unit::cases(300)));
    EXPECT_GT(missed, static_cast<std::uint64_t>(unit::cases(300)));
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
