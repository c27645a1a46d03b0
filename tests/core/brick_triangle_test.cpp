// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coverage of large triangles by bricks in 32 bits (brick_triangle.hpp, mask_triangle.hpp) against the general path of
// coverage.hpp, which the oracle checks.

#include "random_triangles.hpp"

#include <voxelpipe/core/brick_triangle.hpp>
#include <voxelpipe/core/mask_triangle.hpp>
#include <voxelpipe/core/morton.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <random>

namespace {

using namespace random_triangles;

voxel_box coarsen_box(const voxel_box& box) {
    voxel_box r{};
    for (int k = 0; k < 3; ++k) {
        r.lo[k] = box.lo[k] >> log2_raster_brick;
        r.hi[k] = box.hi[k] >> log2_raster_brick;
    }
    return r;
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

// The triangle's part of a brick by rows, as the bits that go into its mask. `brick`: its first voxel.
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

} // namespace
