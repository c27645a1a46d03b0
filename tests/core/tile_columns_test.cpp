// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// cpu_ref/tile_columns.hpp and cpu_ref/small_box.hpp: columns and rows of bits are the voxels of coverage.hpp's spans,
// for every class of triangle, in boxes of every shape up to 32 voxels a side.

#include "test_support.hpp"

#include <cpu_ref/small_box.hpp>
#include <cpu_ref/tile_columns.hpp>
#include <voxelpipe/grid.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace core = voxelpipe::core;
using unit::splitmix64;

using voxel_list = std::vector<std::array<std::int64_t, 3>>; // in the box's order of discovery, from its lowest corner

struct snapped_triangle {
    core::snapped_position a, b, c;
    int fraction;
};

// A triangle of any class on any of the oracle's test grids; nothing if it would be dropped.
bool make_snapped(splitmix64& random, snapped_triangle& out) {
    const auto& grids = oracle::test_grids();
    const oracle::test_grid& where = grids[random.below(grids.size())];
    const auto kind = oracle::all_triangle_classes[random.below(oracle::all_triangle_classes.size())];
    const oracle::world_triangle world = oracle::make_triangle(random, where, kind);
    vp::grid g;
    for (int a = 0; a < 3; ++a) {
        g.extent[a] = where.g.extent[a];
        g.origin[a] = where.g.origin[a];
        g.voxel_size[a] = where.g.voxel_size[a];
    }
    const core::snap_transform t = core::make_snap_transform(g);
    core::snapped_position p[3];
    for (int k = 0; k < 3; ++k) {
        p[k] = core::snap(t, world.v[k][0], world.v[k][1], world.v[k][2]);
        if (!core::is_drawable(p[k])) return false;
    }
    out = {p[0], p[1], p[2], t.fraction};
    return true;
}

// A box of up to 32 voxels a side that touches the triangle's bounding box in most cases.
core::voxel_box make_box(splitmix64& random, const snapped_triangle& t) {
    const core::voxel_box all = core::bounds(t.a, t.b, t.c, t.fraction);
    core::voxel_box box{};
    for (int a = 0; a < 3; ++a) {
        const std::int64_t size = random.one_in(2) ? 32 : random.between(1, 32);
        box.lo[a] = random.between(all.lo[a] - size, all.hi[a] + 1);
        // Mostly near a corner, because large triangles have most of their area elsewhere.
        if (random.one_in(2)) box.lo[a] = all.lo[a] - random.between(0, size - 1);
        box.hi[a] = box.lo[a] + size - 1;
    }
    return box;
}

template <core::span_rule Rule, class Int>
voxel_list by_spans(const snapped_triangle& t, const core::voxel_box& box) {
    voxel_list out;
    const auto setup = core::setup_triangle<Rule, Int>(t.a, t.b, t.c, t.fraction);
    core::for_each_span<Rule>(setup, box, [&](std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
        for (std::int64_t w = w0; w <= w1; ++w) {
            const auto p = core::to_xyz(setup.axis, u, v, w);
            out.push_back({p[0] - box.lo[0], p[1] - box.lo[1], p[2] - box.lo[2]});
        }
    });
    std::sort(out.begin(), out.end());
    return out;
}

template <core::span_rule Rule, class Int>
voxel_list by_columns(const snapped_triangle& t, const core::voxel_box& box) {
    voxel_list out;
    const auto setup = core::setup_triangle<Rule, Int>(t.a, t.b, t.c, t.fraction);
    core::for_each_column<Rule>(setup, box, [&](int u, int v, std::uint32_t bits) {
        EXPECT_NE(bits, 0u);
        for (; bits != 0; bits &= bits - 1) {
            const auto p = core::to_xyz<std::int64_t>(setup.axis, u, v, std::countr_zero(bits));
            out.push_back({p[0], p[1], p[2]});
        }
    });
    std::sort(out.begin(), out.end());
    EXPECT_TRUE(std::adjacent_find(out.begin(), out.end()) == out.end()) << "a voxel came twice";
    return out;
}

voxel_list by_slab_rows(const snapped_triangle& t, int axis, const core::voxel_box& box) {
    voxel_list out;
    const core::voxel_box all = core::bounds(t.a, t.b, t.c, t.fraction);
    const std::int64_t level = all.lo[axis] - box.lo[axis];
    core::for_each_slab_row<vp::int128>(t.a, t.b, t.c, t.fraction, axis, all, box, [&](int q, std::uint32_t bits) {
        for (; bits != 0; bits &= bits - 1) {
            const std::int64_t p = std::countr_zero(bits);
            if (axis == 0)
                out.push_back({level, p, q});
            else if (axis == 1)
                out.push_back({p, level, q});
            else
                out.push_back({p, q, level});
        }
    });
    std::sort(out.begin(), out.end());
    return out;
}

// Empty, with `declined` set, if the function declines the triangle.
template <int Size, class Lanes, class WideLanes>
voxel_list by_small_rows(const snapped_triangle& t, const core::voxel_box& box, bool& declined) {
    voxel_list out;
    const core::voxel_box all = core::bounds(t.a, t.b, t.c, t.fraction);
    declined = !core::for_each_small_row<Size, Lanes, WideLanes>(t.a, t.b, t.c, t.fraction, all, box,
                                                                 [&](int y, int z, std::uint32_t bits) {
                                                                     for (; bits != 0; bits &= bits - 1)
                                                                         out.push_back({std::countr_zero(bits), y, z});
                                                                 });
    std::sort(out.begin(), out.end());
    return out;
}

// A triangle in a box of `size` voxels a side near the grid's origin: anywhere in the box, with coordinates at its
// ends or on voxel faces, or flat along an axis.
snapped_triangle make_boxed(splitmix64& random, std::int64_t size) {
    const auto fraction = static_cast<int>(random.one_in(3) ? 16 : random.between(1, 16));
    const std::int64_t unit = std::int64_t{1} << fraction, end = size * unit - 1;
    snapped_triangle t{};
    t.fraction = fraction;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t origin = random.between(-40, 40) * unit;
        const bool flat = random.one_in(12);
        std::int64_t p[3]{};
        for (int k = 0; k < 3; ++k) {
            std::int64_t& c = p[k];
            c = random.between(1, end);
            if (random.one_in(4)) c = random.one_in(2) ? 1 : end;
            if (random.one_in(8)) c = random.between(0, size) * unit;
            if (k > 0 && (flat || random.one_in(8))) c = p[0];
        }
        const auto set = [&](core::snapped_position& v, std::int64_t c) {
            (axis == 0 ? v.x : axis == 1 ? v.y : v.z) = origin + c;
        };
        set(t.a, p[0]);
        set(t.b, p[1]);
        set(t.c, p[2]);
    }
    return t;
}

std::string describe(const snapped_triangle& t, const core::voxel_box& box) {
    std::ostringstream s;
    s << "F " << t.fraction;
    for (const auto& p : {t.a, t.b, t.c}) s << " (" << p.x << ' ' << p.y << ' ' << p.z << ')';
    s << " box from";
    for (int a = 0; a < 3; ++a) s << ' ' << box.lo[a];
    s << " to";
    for (int a = 0; a < 3; ++a) s << ' ' << box.hi[a];
    return s.str();
}

TEST(TileColumns, AreTheSpansOfEveryTriangle) {
    splitmix64 random(1);
    std::size_t voxels = 0;
    for (std::int64_t i = 0; i < unit::cases(150'000); ++i) {
        snapped_triangle t{};
        if (!make_snapped(random, t)) continue;
        const core::voxel_box box = make_box(random, t);
        const auto conservative = by_spans<core::span_rule::conservative, vp::int128>(t, box);
        const auto thin = by_spans<core::span_rule::thin, vp::int128>(t, box);
        voxels += conservative.size() + thin.size();
        ASSERT_EQ((by_columns<core::span_rule::conservative, vp::int128>(t, box)), conservative) << describe(t, box);
        ASSERT_EQ((by_columns<core::span_rule::thin, vp::int128>(t, box)), thin) << describe(t, box);
        if (!core::fits_narrow(t.a, t.b, t.c, t.fraction)) continue;
        ASSERT_EQ((by_columns<core::span_rule::conservative, std::int64_t>(t, box)), conservative) << describe(t, box);
        ASSERT_EQ((by_columns<core::span_rule::thin, std::int64_t>(t, box)), thin) << describe(t, box);
    }
    EXPECT_GT(voxels, static_cast<std::size_t>(unit::cases(150'000)));
}

TEST(TileColumns, OfASlabAreItsRows) {
    splitmix64 random(2);
    std::int64_t slabs = 0;
    for (std::int64_t i = 0; i < unit::cases(200'000); ++i) {
        snapped_triangle t{};
        if (!make_snapped(random, t)) continue;
        core::voxel_box all = core::bounds(t.a, t.b, t.c, t.fraction);
        if (core::slab_axis(all) < 0) {
            // Flatten it into one layer of voxels, strictly inside or along a face of the next.
            const std::int64_t unit = std::int64_t{1} << t.fraction;
            const auto axis = random.below(3);
            for (core::snapped_position* p : {&t.a, &t.b, &t.c}) {
                std::int64_t& c = axis == 0 ? p->x : axis == 1 ? p->y : p->z;
                c = 5 * unit + 1 + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(unit) - 1));
            }
            all = core::bounds(t.a, t.b, t.c, t.fraction);
        }
        const int axis = core::slab_axis(all);
        ASSERT_GE(axis, 0);
        ++slabs;
        const core::voxel_box box = make_box(random, t);
        ASSERT_EQ(by_slab_rows(t, axis, box), (by_spans<core::span_rule::conservative, vp::int128>(t, box)))
            << describe(t, box) << " axis " << axis;
    }
    EXPECT_GT(slabs, unit::cases(200'000) / 2);
}

TEST(TileColumns, OfBoxesAtTheEndOf32BitsAreTheSpans) {
    splitmix64 random(5);
    for (std::int64_t i = 0; i < unit::cases(60'000); ++i) {
        const snapped_triangle t = make_boxed(random, random.between(60, 65));
        const core::voxel_box box = make_box(random, t);
        ASSERT_EQ((by_columns<core::span_rule::conservative, std::int64_t>(t, box)),
                  (by_spans<core::span_rule::conservative, vp::int128>(t, box)))
            << describe(t, box);
        ASSERT_EQ((by_columns<core::span_rule::thin, std::int64_t>(t, box)),
                  (by_spans<core::span_rule::thin, vp::int128>(t, box)))
            << describe(t, box);
    }
}

TEST(SmallBox, RowsAreTheSpans) {
    using plain32 = core::plain_lanes<std::int32_t>;
    using plain64 = core::plain_lanes<std::int64_t>;
    splitmix64 random(6);
    std::int64_t within_4 = 0, within_8 = 0;
    for (std::int64_t i = 0; i < unit::cases(200'000); ++i) {
        const snapped_triangle t = make_boxed(random, random.between(1, 8));
        const core::voxel_box all = core::bounds(t.a, t.b, t.c, t.fraction);
        if (!core::is_within(all, 8)) continue; // a coordinate on a face touches one more voxel
        const core::voxel_box box = make_box(random, t);
        const auto normal = core::setup_triangle<core::span_rule::thin, vp::int128>(t.a, t.b, t.c, t.fraction).normal;
        const bool flat = normal[0] == 0 || normal[1] == 0 || normal[2] == 0;
        const auto spans = flat ? voxel_list{} : by_spans<core::span_rule::conservative, vp::int128>(t, box);
        bool declined = false;
        ASSERT_EQ((by_small_rows<8, core::lanes32, core::lanes64>(t, box, declined)), spans) << describe(t, box);
        ASSERT_EQ(declined, flat) << describe(t, box);
        ASSERT_EQ((by_small_rows<8, plain32, plain64>(t, box, declined)), spans) << describe(t, box);
        ASSERT_EQ(declined, flat);
        if (!flat) ++within_8;
        if (!core::is_within(all, 4)) continue;
        ASSERT_EQ((by_small_rows<4, core::lanes32, core::lanes64>(t, box, declined)), spans) << describe(t, box);
        ASSERT_EQ(declined, flat);
        ASSERT_EQ((by_small_rows<4, plain32, plain64>(t, box, declined)), spans) << describe(t, box);
        ASSERT_EQ(declined, flat);
        if (!flat) ++within_4;
    }
    EXPECT_GT(within_4, unit::cases(200'000) / 20);
    EXPECT_GT(within_8, unit::cases(200'000) / 10);
}

TEST(TileColumns, SmallRowsOfBitsAreTheHalfPlanes) {
    splitmix64 random(7);
    for (std::int64_t i = 0; i < unit::cases(50'000); ++i) {
        core::row_lines<std::int64_t> h{};
        const int n = static_cast<int>(random.between(1, 32)), rows = static_cast<int>(random.between(1, 32));
        const std::int64_t size = std::int64_t{1} << random.below(23);
        std::int64_t step[3]{};
        for (int k = 0; k < 3; ++k) {
            h.k[k] = random.one_in(4) ? 0 : random.between(-size, size);
            h.r[k] = random.between(-64 * size, 64 * size);
            step[k] = random.between(-size, size);
        }
        std::uint32_t lanes[32], plain[32];
        core::row_bits_of(h, step, rows, n, true, lanes);
        core::row_bits_of<core::plain_lanes<std::int32_t>>(h, step, rows, n, true, plain);
        for (int row = 0; row < rows; ++row, h.step(step)) {
            ASSERT_EQ(lanes[row], core::row_bits(h, n));
            ASSERT_EQ(plain[row], core::row_bits(h, n));
        }
    }
}

TEST(TileColumns, RowsOfBitsAreTheHalfPlanes) {
    splitmix64 random(3);
    for (std::int64_t i = 0; i < unit::cases(200'000); ++i) {
        core::row_lines<std::int64_t> h{};
        const int n = static_cast<int>(random.between(1, 32));
        const std::int64_t size = std::int64_t{1} << random.below(40);
        for (int k = 0; k < 3; ++k) {
            h.k[k] = random.one_in(4) ? 0 : random.between(-size, size);
            h.r[k] = random.between(-16 * size, 16 * size);
        }
        std::uint32_t expected = 0;
        for (int x = 0; x < n; ++x)
            if (h.k[0] * x + h.r[0] >= 0 && h.k[1] * x + h.r[1] >= 0 && h.k[2] * x + h.r[2] >= 0) expected |= 1u << x;
        ASSERT_EQ(core::row_bits(h, n), expected);
    }
}

TEST(TileColumns, FloorLinesStepAsFloorDivides) {
    splitmix64 random(4);
    for (std::int64_t i = 0; i < unit::cases(50'000); ++i) {
        const std::int64_t divisor = random.between(1, std::int64_t{1} << random.below(45));
        const std::int64_t delta =
            random.one_in(5) ? (random.one_in(2) ? divisor : -divisor) : random.between(-divisor, divisor);
        std::int64_t numerator = random.between(-(std::int64_t{1} << 50), std::int64_t{1} << 50);
        const core::floor_step<std::int64_t> step(delta, divisor);
        core::floor_line<std::int64_t> at(numerator, divisor);
        for (int k = 0; k < 40; ++k) {
            ASSERT_EQ(at.quotient, vp::exact::floor_div(numerator, divisor));
            ASSERT_EQ(at.remainder, numerator - at.quotient * divisor);
            numerator += delta;
            step(at);
        }
    }
}

} // namespace
