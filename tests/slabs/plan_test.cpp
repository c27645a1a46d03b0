// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Plans of slabs against all possible cuts of small histograms.

#include "test_support.hpp"

#include <voxelpipe/slabs/plan.hpp>

#include <gtest/gtest.h>

#include <functional>

namespace {

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;

struct some_reaches {
    std::vector<vp::core::voxel_box> boxes;
    slabs::histogram counts;
};

some_reaches make_reaches(std::uint64_t seed, glm::ivec3 extent, int count) {
    oracle::splitmix64 random(seed);
    some_reaches r{{}, slabs::histogram(extent)};
    for (int i = 0; i < count; ++i) {
        vp::core::voxel_box box{};
        for (int a = 0; a < 3; ++a) {
            box.lo[a] = random.between(0, extent[a] - 1);
            // Most triangles are short, and the low layers have more of them.
            if (random.between(0, 2) != 0) box.lo[a] /= 3;
            box.hi[a] = std::min<std::int64_t>(extent[a] - 1, box.lo[a] + random.between(0, i % 7 == 0 ? 8 : 1));
        }
        r.boxes.push_back(box);
        r.counts.add(box);
    }
    return r;
}

std::uint64_t count_in(const some_reaches& r, int axis, const slabs::layer_range& s) {
    std::uint64_t n = 0;
    for (const auto& b : r.boxes) n += b.lo[axis] < s.end && b.hi[axis] >= s.begin ? 1 : 0;
    return s.size() == 0 ? 0 : n;
}

// The least bottleneck of all cuts into at most `parts` ranges.
std::uint64_t best_bottleneck(const some_reaches& r, int axis, int parts, const slabs::plan_options& how) {
    const int layers = r.counts.extent()[axis];
    const auto cost = [&](int begin, int end) {
        return count_in(r, axis, {begin, end}) * how.triangle_cost +
               static_cast<std::uint64_t>(end - begin) * how.layer_cost;
    };
    std::function<std::uint64_t(int, int)> best = [&](int begin, int left) {
        std::uint64_t least = cost(begin, layers);
        if (left == 1) return least;
        for (int end = begin + how.align; end < layers; end += how.align)
            least = std::min(least, std::max(cost(begin, end), best(end, left - 1)));
        return least;
    };
    return best(0, parts);
}

TEST(SlabPlan, BottleneckIsTheLeastOfAllCuts) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        const some_reaches r = make_reaches(seed, {9, 13, 17}, 60);
        for (const int align : {1, 4})
            for (const std::uint64_t layer_cost : {0u, 5u})
                for (int n = 1; n <= 4; ++n) {
                    slabs::plan_options how;
                    how.align = align;
                    how.triangle_cost = 3;
                    how.layer_cost = layer_cost;
                    how.may_turn = false;
                    const slabs::plan p = slabs::split(r.counts, n, how);
                    EXPECT_EQ(p.axis, 2);
                    EXPECT_EQ(p.bottleneck, best_bottleneck(r, 2, n, how)) << seed << ' ' << align << ' ' << n;
                    ASSERT_EQ(p.slabs.size(), static_cast<std::size_t>(n));
                    int at = 0;
                    std::uint64_t most = 0, sum = 0;
                    for (const slabs::layer_range& s : p.slabs) {
                        EXPECT_EQ(s.begin, at);
                        EXPECT_TRUE(s.begin % align == 0 || s.size() == 0);
                        at = s.end;
                        const std::uint64_t here = count_in(r, 2, s);
                        sum += here;
                        most = std::max(most, here * 3 + static_cast<std::uint64_t>(s.size()) * layer_cost);
                    }
                    EXPECT_EQ(at, 17);
                    EXPECT_EQ(most, p.bottleneck);
                    EXPECT_EQ(p.triangles, r.boxes.size());
                    EXPECT_EQ(p.triangles_cut, sum - r.boxes.size());
                }
    }
}

TEST(SlabPlan, AnotherAxisIsTakenOnlyIfItIsClearlyBetter) {
    // All triangles cross all of z and one layer of x.
    slabs::histogram flat({8, 8, 8});
    for (int i = 0; i < 64; ++i) flat.add({{{i % 8, 0, 0}}, {{i % 8, 7, 7}}});
    EXPECT_EQ(slabs::split(flat, 4).axis, 0);
    EXPECT_EQ(slabs::split(flat, 4).bottleneck, 16u);
    slabs::plan_options fixed;
    fixed.may_turn = false;
    EXPECT_EQ(slabs::split(flat, 4, fixed).axis, 2);
    // The same along every axis: z.
    slabs::histogram even({8, 8, 8});
    for (int i = 0; i < 64; ++i) even.add({{{i % 8, i % 8, i % 8}}, {{i % 8, i % 8, i % 8}}});
    EXPECT_EQ(slabs::split(even, 3).axis, 2);
    // x is better by 4 %: 24 of 25 triangles.
    slabs::histogram near({2, 2, 2});
    for (int i = 0; i < 48; ++i) near.add({{{i % 2, 0, i % 2}}, {{i % 2, 0, i % 2}}});
    near.add({{{0, 0, 0}}, {{0, 0, 1}}});
    near.add({{{1, 0, 0}}, {{1, 0, 1}}});
    EXPECT_EQ(slabs::split(near, 2).axis, 2);
    slabs::plan_options eager;
    eager.turn_gain = 1.03;
    EXPECT_EQ(slabs::split(near, 2, eager).axis, 0);
}

TEST(SlabPlan, CoverKeepsTheLimitWithTheFewestSlabs) {
    const some_reaches r = make_reaches(3, {6, 6, 40}, 300);
    const std::uint64_t limit = 40;
    const slabs::plan p = slabs::cover(r.counts, 2, limit);
    for (const auto& s : p.slabs) EXPECT_TRUE(count_in(r, 2, s) <= limit || s.size() == 1);
    for (std::size_t i = 0; i + 1 < p.slabs.size(); ++i)
        EXPECT_TRUE(p.slabs[i].size() == 0 || count_in(r, 2, {p.slabs[i].begin, p.slabs[i].end + 1}) > limit ||
                    count_in(r, 2, p.slabs[i]) > limit);
    EXPECT_EQ(p.slabs.back().end, 40);
}

TEST(SlabPlan, HistogramsOfPartsAddUp) {
    const some_reaches all = make_reaches(5, {7, 9, 11}, 50);
    slabs::histogram a({7, 9, 11}), b({7, 9, 11});
    for (std::size_t i = 0; i < all.boxes.size(); ++i) (i % 3 == 0 ? a : b).add(all.boxes[i]);
    for (std::size_t i = 0; i < a.words().size(); ++i) a.words()[i] += b.words()[i];
    EXPECT_TRUE(std::equal(a.words().begin(), a.words().end(), all.counts.words().begin()));
    const slabs::plan p = slabs::split(a, 3), q = slabs::split(all.counts, 3);
    EXPECT_EQ(p.slabs, q.slabs);
}

TEST(SlabPlan, MoreSlabsThanLayersLeaveEmptyOnes) {
    const some_reaches r = make_reaches(7, {4, 4, 3}, 20);
    slabs::plan_options how;
    how.may_turn = false;
    const slabs::plan p = slabs::split(r.counts, 5, how);
    ASSERT_EQ(p.slabs.size(), 5u);
    int layers = 0;
    for (const auto& s : p.slabs) layers += s.size();
    EXPECT_EQ(layers, 3);
    EXPECT_EQ(slabs::equal_layers(vp::grid{{}, {1, 1, 1}, {4, 4, 3}}, 2, 5).slabs.size(), 3u);
    // Nothing to draw: still a partition.
    const slabs::plan none = slabs::split(slabs::histogram({4, 4, 6}), 2, how);
    EXPECT_EQ(none.slabs.front().begin, 0);
    EXPECT_EQ(none.slabs.back().end, 6);
    EXPECT_EQ(none.bottleneck, 0u);
}

} // namespace
