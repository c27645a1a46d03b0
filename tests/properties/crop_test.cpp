// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A part of a grid gives exactly the crop of the whole: coverage, every fragment value, every blended byte. Slabs of a
// grid put together give the whole.

#include "properties.hpp"

#include <cstring>
#include <tuple>

namespace properties {
namespace {

template <class T>
bool same_bytes(const T& a, const T& b) {
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

void expect_crop(const image& whole, const image& part, const oracle::part& p) {
    for (int z = 0; z < p.size[2]; ++z)
        for (int y = 0; y < p.size[1]; ++y)
            for (int x = 0; x < p.size[0]; ++x) {
                const int i = x + p.begin[0], j = y + p.begin[1], k = z + p.begin[2];
                ASSERT_EQ(part.occupied(x, y, z), whole.occupied(i, j, k));
                ASSERT_EQ(part.last(x, y, z), whole.last(i, j, k));
                ASSERT_TRUE(same_bytes(part.sums(x, y, z), whole.sums(i, j, k)));
                ASSERT_EQ(part.places(x, y, z), whole.places(i, j, k));
                if (part.occupied(x, y, z)) {
                    ASSERT_EQ(part.places(x, y, z), glm::ivec3(i, j, k));
                }
            }
}

class Crop : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(Crop, OfAFramebufferIsTheFramebufferOfThePart) {
    splitmix64 random(71);
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.dense) continue;
        const auto triangles = all_kinds(random, where, scaled(60));
        const vp::grid g = oracle::as_library(where.g);
        const image whole = library_image(g, triangles, GetParam());
        for (int n = 0; n < 12; ++n) {
            const oracle::part p = n == 0 ? oracle::whole_of(where.g) : oracle::random_part(random, where.g, 4096);
            const image part = library_image(oracle::as_library(where.g, p), triangles, GetParam());
            expect_crop(whole, part, p);
            if (HasFatalFailure()) return;
        }
    }
}

TEST_P(Crop, OfACropIsACrop) {
    const test_grid& where = oracle::test_grids()[6];
    splitmix64 random(72);
    const auto triangles = all_kinds(random, where, scaled(40));
    const vp::grid g = oracle::as_library(where.g);
    const vp::grid once = g.crop({6, 4, 7}, {10, 9, 20}), twice = once.crop({2, 1, 5}, {7, 8, 11});
    EXPECT_TRUE(twice == g.crop({8, 5, 12}, {7, 8, 11}));
    expect_crop(library_image(g, triangles, GetParam()), library_image(twice, triangles, GetParam()),
                {{8, 5, 12}, {7, 8, 11}});
}

TEST_P(Crop, SlabsPutTogetherAreTheWhole) {
    splitmix64 random(73);
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.dense) continue;
        const auto triangles = all_kinds(random, where, scaled(40));
        const image whole = library_image(oracle::as_library(where.g), triangles, GetParam());
        for (int axis = 0; axis < 3; ++axis) {
            vp::counters sums;
            for (int begin = 0; begin < where.g.extent[axis];) {
                oracle::part p = oracle::whole_of(where.g);
                p.begin[axis] = begin;
                p.size[axis] = static_cast<int>(random.between(1, std::min(where.g.extent[axis] - begin, 17)));
                begin += p.size[axis];
                const image slab = library_image(oracle::as_library(where.g, p), triangles, GetParam());
                expect_crop(whole, slab, p);
                if (HasFatalFailure()) return;
                sums.fragments += slab.counts.fragments;
                sums.voxels += slab.counts.voxels;
            }
            EXPECT_EQ(sums.fragments, whole.counts.fragments);
            EXPECT_EQ(sums.voxels, whole.counts.voxels);
        }
    }
}

// Crops of grids that are too large for memory, against another crop that overlaps.
TEST_P(Crop, PartsOfAHugeGridAgreeWhereTheyOverlap) {
    const grid g = {{-3, 4, 5}, {0.25, 0.5, 0.125}, {1 << 20, 1 << 19, 70000}};
    splitmix64 random(74);
    for (int n = 0; n < 30; ++n) {
        oracle::part a{}, b{}, both{};
        for (int axis = 0; axis < 3; ++axis) {
            const int at = static_cast<int>(random.between(40, g.extent[axis] - 41));
            a.begin[axis] = at - static_cast<int>(random.between(1, 20));
            b.begin[axis] = at - static_cast<int>(random.between(1, 20));
            a.size[axis] = at - a.begin[axis] + static_cast<int>(random.between(1, 20));
            b.size[axis] = at - b.begin[axis] + static_cast<int>(random.between(1, 20));
            both.begin[axis] = std::max(a.begin[axis], b.begin[axis]);
            both.size[axis] = std::min(a.begin[axis] + a.size[axis], b.begin[axis] + b.size[axis]) - both.begin[axis];
        }
        const test_grid where = oracle::focused({g, "huge", false, false}, both.as_region());
        const auto triangles = all_kinds(random, where, 10);
        const image in_a = library_image(oracle::as_library(g, a), triangles, GetParam());
        const image in_b = library_image(oracle::as_library(g, b), triangles, GetParam());
        const image in_both = library_image(oracle::as_library(g, both), triangles, GetParam());
        for (const auto& [image, p] : {std::pair(&in_a, a), std::pair(&in_b, b)}) {
            oracle::part shifted = both;
            for (int axis = 0; axis < 3; ++axis) shifted.begin[axis] -= p.begin[axis];
            for (int z = 0; z < both.size[2]; ++z)
                for (int y = 0; y < both.size[1]; ++y)
                    for (int x = 0; x < both.size[0]; ++x) {
                        const int i = x + shifted.begin[0], j = y + shifted.begin[1], k = z + shifted.begin[2];
                        ASSERT_EQ(in_both.last(x, y, z), image->last(i, j, k));
                        ASSERT_EQ(in_both.places(x, y, z), image->places(i, j, k));
                        ASSERT_TRUE(same_bytes(in_both.sums(x, y, z), image->sums(i, j, k)));
                    }
        }
        EXPECT_GT(in_both.counts.fragments, 0u);
        // The oracle handles such a grid as well.
        std::vector<voxel> expected;
        for (const world_triangle& t : triangles) {
            const auto voxels = oracle::expected_voxels(g, oracle::snap(g, t.v), GetParam(), both);
            expected.insert(expected.end(), voxels.begin(), voxels.end());
        }
        EXPECT_EQ(in_both.counts.fragments, expected.size());
    }
}

INSTANTIATE_TEST_SUITE_P(AllRules, Crop,
                         ::testing::Values(vp::coverage::conservative, vp::coverage::thin, vp::coverage::crosshair,
                                           vp::coverage::diagonal),
                         rule_of);

} // namespace
} // namespace properties
