// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The A-buffer holds every fragment once, in order. Folding a voxel's list with a blend gives that voxel of a
// framebuffer. The folds here follow each blend's definition and use nothing of the library.

#include "properties.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <tuple>

namespace properties {
namespace {

// The fragment shader's values. Every bit depends on triangle, voxel and sample point.
struct payload {
    float level;
    std::uint32_t word;
    std::int64_t large;
    friend bool operator==(const payload&, const payload&) = default;
};

// `primitive`: that of the fragment, or 0 to ignore it.
payload value_of(const vp::fragment<>& f, std::uint32_t primitive) {
    const auto mix = [](std::uint32_t h) {
        h = (h ^ (h >> 16)) * 0x7feb352du;
        h = (h ^ (h >> 15)) * 0x846ca68bu;
        return h ^ (h >> 16);
    };
    const std::uint32_t h =
        mix(mix(mix(primitive) + static_cast<std::uint32_t>(f.voxel.x)) + static_cast<std::uint32_t>(f.voxel.y) * 31u +
            static_cast<std::uint32_t>(f.voxel.z) * 977u);
    // Floats of all sizes and signs, a few of them zero.
    const float level = h % 16 == 0 ? 0.0f
                                    : std::ldexp(static_cast<float>(static_cast<std::int32_t>(h)),
                                                 static_cast<int>(h % 53) - 50 + (f.barycentric.x > 0.5f ? 1 : 0));
    return {level, h, static_cast<std::int64_t>(h * 0x100000001ull - 7)};
}

bool discards(const payload& p) { return p.word % 11 == 3; }

struct to_payload {
    bool keep_all = false;
    vp::output<payload> operator()(const vp::fragment<>& f) const {
        const payload p = value_of(f, f.primitive);
        return vp::outputs(p).discard_if(!keep_all && discards(p));
    }
};

// A user's blend that depends on the order.
struct chain {
    static constexpr bool order_free = false;
    std::uint32_t identity() const { return 17; }
    std::uint32_t combine(std::uint32_t a, std::uint32_t b) const { return a * 33u + b; }
};

using replace_target = vp::target<std::uint32_t, vp::blend::replace>;
using add_target = vp::target<std::uint32_t, vp::blend::add>;
using min_target = vp::target<float, vp::blend::min>;
using max_target = vp::target<std::int64_t, vp::blend::max>;
using xor_target = vp::target<std::uint32_t, vp::blend::bit_xor>;
using float_target = vp::target<float, vp::blend::add>;
using chain_target = vp::target<std::uint32_t, chain>;
using count_target = vp::target<std::uint32_t, vp::blend::count>;

struct to_targets {
    bool with_primitive = true;
    vp::output<std::uint32_t, std::uint32_t, float, std::int64_t, std::uint32_t, float, std::uint32_t, std::uint32_t>
    operator()(const vp::fragment<>& f) const {
        const payload p = value_of(f, with_primitive ? f.primitive : 0);
        return vp::outputs(p.word, p.word, p.level, p.large, p.word, p.level, p.word, 0u).discard_if(discards(p));
    }
};

// -0 < +0 and otherwise as numbers; the payloads hold no NaN.
bool below(float a, float b) { return a < b || (a == b && std::signbit(a) && !std::signbit(b)); }

// The reproducible sum by its definition: terms are rounded to multiples of 2^-32 (from 2^31 on they are infinite), the
// sum is exact, and it is rounded once.
float exact_sum(const std::vector<float>& terms) {
    oracle::wide sum = 0;
    bool up = false, down = false;
    for (const float t : terms) {
        if (std::fabs(t) >= 0x1p31f) {
            (t > 0 ? up : down) = true;
            continue;
        }
        sum = sum + oracle::wide(static_cast<oracle::int128>(std::nearbyint(std::ldexp(double{t}, 32))));
    }
    constexpr float infinity = std::numeric_limits<float>::infinity();
    if (up || down) return up && down ? std::numeric_limits<float>::quiet_NaN() : (up ? infinity : -infinity);
    return oracle::nearest_float({sum, oracle::wide(1).shifted_left(32)});
}

using framebuffer = vp::framebuffer<vp::cpu_backend, replace_target, add_target, min_target, max_target, xor_target,
                                    float_target, chain_target, count_target>;

class ABuffer : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(ABuffer, HoldsEveryPairOnceInOrder) {
    splitmix64 random(81);
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(60));
        const oracle::soup mesh(triangles);
        const vp::grid g = oracle::as_library(where.g);
        for (const unsigned threads : {1u, 3u}) {
            vp::cpu_backend be(threads);
            vp::abuffer<vp::cpu_backend, payload> lists{be};
            const vp::status s = vp::voxelize(be, mesh.view(), g, vp::passthrough{}, to_payload{}, lists, GetParam());
            ASSERT_TRUE(s.ok()) << s.message();
            const auto h = lists.to_host(be);
            ASSERT_EQ(h.offsets.size(), h.voxels.size() + 1);
            ASSERT_EQ(h.primitives.size(), s.counts.fragments);
            ASSERT_EQ(h.payloads.size(), s.counts.fragments);
            ASSERT_EQ(h.voxels.size(), s.counts.voxels);
            ASSERT_EQ(h.offsets.front(), 0u);
            ASSERT_EQ(h.offsets.back(), h.primitives.size());
            const std::uint64_t cells =
                std::uint64_t(g.extent.x) * std::uint64_t(g.extent.y) * std::uint64_t(g.extent.z);
            for (std::size_t n = 0; n < h.voxels.size(); ++n) {
                ASSERT_LT(h.voxels[n], cells);
                if (n > 0) {
                    ASSERT_LT(h.voxels[n - 1], h.voxels[n]);
                }
                ASSERT_LT(h.offsets[n], h.offsets[n + 1]); // no empty list
                for (std::uint64_t f = h.offsets[n] + 1; f < h.offsets[n + 1]; ++f)
                    ASSERT_LT(h.primitives[f - 1], h.primitives[f]); // ascending, hence unique
            }
            EXPECT_GT(s.counts.fragments_discarded, 0u);
        }
    }
}

// Discarding takes fragments away from a voxel and leaves the others as they were.
TEST_P(ABuffer, DiscardRemovesJustThoseFragments) {
    splitmix64 random(82);
    std::uint64_t discarded = 0;
    for (const test_grid& where : oracle::test_grids()) {
        const auto triangles = all_kinds(random, where, scaled(30));
        const oracle::soup mesh(triangles);
        const vp::grid g = oracle::as_library(where.g);
        vp::cpu_backend be(2);
        vp::abuffer<vp::cpu_backend, payload> all{be}, some{be};
        vp::voxelize(be, mesh.view(), g, vp::passthrough{}, to_payload{true}, all, GetParam()).or_throw();
        vp::voxelize(be, mesh.view(), g, vp::passthrough{}, to_payload{}, some, GetParam()).or_throw();
        struct entry {
            std::uint64_t voxel;
            std::uint32_t primitive;
            payload value;
            bool operator==(const entry&) const = default;
        };
        const auto entries = [&](const auto& lists, bool drop) {
            const auto h = lists.to_host(be);
            std::vector<entry> result;
            for (std::size_t n = 0; n < h.voxels.size(); ++n)
                for (std::uint64_t f = h.offsets[n]; f < h.offsets[n + 1]; ++f)
                    if (!drop || !discards(h.payloads[f]))
                        result.push_back({h.voxels[n], h.primitives[f], h.payloads[f]});
            return result;
        };
        EXPECT_TRUE(entries(all, true) == entries(some, false)) << where.name;
        discarded += all.num_fragments() - some.num_fragments();
    }
    EXPECT_GT(discarded, 0U);
}

TEST_P(ABuffer, FoldedWithABlendIsTheFramebuffer) {
    splitmix64 random(83);
    std::uint64_t deepest = 0;
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.dense) continue;
        const auto triangles = all_kinds(random, where, scaled(60));
        const oracle::soup mesh(triangles);
        const vp::grid g = oracle::as_library(where.g);
        vp::cpu_backend be(2);
        vp::abuffer<vp::cpu_backend, payload> lists{be};
        vp::voxelize(be, mesh.view(), g, vp::passthrough{}, to_payload{}, lists, GetParam()).or_throw();
        framebuffer fb{be, g.extent};
        vp::get<0>(fb).clear(123u);
        vp::get<5>(fb).clear(0.5f);
        const vp::status s = vp::voxelize(be, mesh.view(), g, vp::passthrough{}, to_targets{}, fb, GetParam());
        ASSERT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts.fragments, lists.num_fragments());
        const auto t0 = vp::get<0>(fb).to_host_target(be);
        const auto t1 = vp::get<1>(fb).to_host_target(be);
        const auto t2 = vp::get<2>(fb).to_host_target(be);
        const auto t3 = vp::get<3>(fb).to_host_target(be);
        const auto t4 = vp::get<4>(fb).to_host_target(be);
        const auto t5 = vp::get<5>(fb).to_host_target(be);
        const auto t6 = vp::get<6>(fb).to_host_target(be);
        const auto t7 = vp::get<7>(fb).to_host_target(be);
        const auto h = lists.to_host(be);
        std::size_t next = 0;
        for (int z = 0; z < g.extent.z; ++z)
            for (int y = 0; y < g.extent.y; ++y)
                for (int x = 0; x < g.extent.x; ++x) {
                    std::span<const payload> list;
                    if (next < h.voxels.size() && h.position(h.voxels[next]) == glm::ivec3(x, y, z)) {
                        list = std::span(h.payloads).subspan(h.offsets[next], h.offsets[next + 1] - h.offsets[next]);
                        ++next;
                    }
                    deepest = std::max<std::uint64_t>(deepest, list.size());
                    std::uint32_t last = 123, sum = 0, parity = 0, chained = 17;
                    float lowest = std::numeric_limits<float>::quiet_NaN(); // the greatest in the total order
                    std::int64_t highest = std::numeric_limits<std::int64_t>::min();
                    std::vector<float> terms = {0.5f};
                    for (const payload& p : list) {
                        last = p.word;
                        sum += p.word;
                        parity ^= p.word;
                        chained = chained * 33u + p.word;
                        if (std::isnan(lowest) || below(p.level, lowest)) lowest = p.level;
                        highest = std::max(highest, p.large);
                        terms.push_back(p.level);
                    }
                    ASSERT_EQ(t0(x, y, z), last);
                    ASSERT_EQ(t1(x, y, z), sum);
                    ASSERT_EQ(std::bit_cast<std::uint32_t>(t2(x, y, z)), std::bit_cast<std::uint32_t>(lowest));
                    ASSERT_EQ(t3(x, y, z), highest);
                    ASSERT_EQ(t4(x, y, z), parity);
                    ASSERT_EQ(std::bit_cast<std::uint32_t>(t5(x, y, z)), std::bit_cast<std::uint32_t>(exact_sum(terms)))
                        << x << ' ' << y << ' ' << z << " of " << where.name;
                    ASSERT_EQ(t6(x, y, z), chained);
                    ASSERT_EQ(t7(x, y, z), list.size());
                }
        ASSERT_EQ(next, h.voxels.size());
    }
    // Lists long enough for a wrong order to show; crosshair has fewer fragments.
    EXPECT_GT(deepest, GetParam() == vp::coverage::crosshair ? 5u : 20u);
}

// The whole mesh in one draw equals two draws in one call, and two calls of which the second loads.
TEST_P(ABuffer, TwoDrawsAndTwoCallsAreOne) {
    splitmix64 random(84);
    // The primitive number is not used, because it starts again with each call.
    const to_targets shader{false};
    for (const test_grid& where : oracle::test_grids()) {
        if (!where.dense) continue;
        const auto triangles = all_kinds(random, where, scaled(30));
        const oracle::soup mesh(triangles);
        const vp::grid g = oracle::as_library(where.g);
        vp::cpu_backend be(2);
        framebuffer whole{be, g.extent}, draws{be, g.extent}, calls{be, g.extent};
        const std::size_t half = triangles.size() / 2;
        const vp::array_view<const glm::uvec3> all(mesh.triangles.data(), mesh.triangles.size());
        const vp::mesh_view<> first{mesh.positions, {all.data(), half}};
        const vp::mesh_view<> second{mesh.positions, {all.data() + half, all.size() - half}};
        const vp::status in_one =
            vp::voxelize(be, mesh.view(), g, vp::passthrough{}, shader, whole, GetParam()).or_throw();
        using draw = vp::draw<vp::mesh_view<>, vp::passthrough, to_targets>;
        const draw both[] = {{first, {}, shader}, {second, {}, shader}};
        const vp::status in_two = vp::voxelize(be, std::span<const draw>(both), g, draws, GetParam()).or_throw();
        EXPECT_TRUE(in_one.counts == in_two.counts);
        const vp::status a = vp::voxelize(be, first, g, vp::passthrough{}, shader, calls, GetParam()).or_throw();
        vp::get<0>(calls).load();
        vp::get<1>(calls).load();
        vp::get<2>(calls).load();
        vp::get<3>(calls).load();
        vp::get<4>(calls).load();
        vp::get<6>(calls).load();
        vp::get<7>(calls).load();
        vp::get<5>(calls).off(); // a sum of floats is rounded at the end of each call
        const vp::status b = vp::voxelize(be, second, g, vp::passthrough{}, shader, calls, GetParam()).or_throw();
        EXPECT_EQ(a.counts.fragments + b.counts.fragments, in_one.counts.fragments);
        EXPECT_EQ(a.counts.fragments_discarded + b.counts.fragments_discarded, in_one.counts.fragments_discarded);
        const auto contents = [&](framebuffer& fb) {
            const auto lowest = vp::get<2>(fb).to_host(be);
            std::vector<std::uint32_t> lowest_bits(lowest.size()); // NaN where empty
            std::memcpy(lowest_bits.data(), lowest.data(), lowest.size() * sizeof(float));
            return std::tuple(vp::get<0>(fb).to_host(be), vp::get<1>(fb).to_host(be), lowest_bits,
                              vp::get<3>(fb).to_host(be), vp::get<4>(fb).to_host(be), vp::get<6>(fb).to_host(be),
                              vp::get<7>(fb).to_host(be));
        };
        EXPECT_TRUE(contents(whole) == contents(draws)) << where.name;
        EXPECT_TRUE(contents(whole) == contents(calls)) << where.name;
    }
}

INSTANTIATE_TEST_SUITE_P(AllRules, ABuffer,
                         ::testing::Values(vp::coverage::conservative, vp::coverage::thin, vp::coverage::crosshair,
                                           vp::coverage::diagonal),
                         rule_of);

} // namespace
} // namespace properties
