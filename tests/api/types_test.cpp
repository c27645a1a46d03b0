// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Eight more types of render target in one pass of cpu_backend, beside those of targets_test: narrow and wide integers,
// doubles, and vectors of every layout, against folds over the oracle's fragments. tests/core/blend_test.cpp checks
// each blend alone; here they go through the pipeline together.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::mark;

using u8vec4 = glm::vec<4, std::uint8_t>;
using i64vec2 = glm::vec<2, std::int64_t>;
using u64vec2 = glm::vec<2, std::uint64_t>;
using hvec3 = glm::vec<3, vp::half>;

const glm::ivec3 extent{45, 34, 37};

// ---- values of a fragment, from its mark ----

// Some with bits below the quantum of the sum, 2^-64.
double double_of(std::uint64_t m) {
    return std::ldexp(static_cast<double>(static_cast<std::int64_t>(m)), -60 - static_cast<int>(m & 15u));
}
// Sometimes NaN, which min keeps only if there is no number.
glm::dvec2 pair_of(std::uint64_t m) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {m % 3 == 0 ? -nan : double_of(m), static_cast<double>(static_cast<std::int8_t>(m >> 8))};
}
u8vec4 bytes_of(std::uint64_t m) {
    return {static_cast<std::uint8_t>(m), static_cast<std::uint8_t>(m >> 8), static_cast<std::uint8_t>(m >> 16),
            static_cast<std::uint8_t>(m >> 24)};
}
i64vec2 signed_of(std::uint64_t m) { return {static_cast<std::int64_t>(m), -static_cast<std::int64_t>(m >> 5)}; }
u64vec2 unsigned_of(std::uint64_t m) { return {m, m * m}; }
// The maximum of the last component is NaN if any term is.
hvec3 halves_of(std::uint64_t m) {
    const auto of = [](std::uint64_t bits) {
        return vp::half(static_cast<float>(static_cast<std::int16_t>(bits)) * 0x1p-7f);
    };
    return {of(m), of(m >> 16), m % 11 == 0 ? vp::half::from_bits(0xfe01) : of(m >> 32)};
}

struct mark_shader {
    auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = mark(f.primitive, f.voxel);
        return vp::outputs(static_cast<std::uint8_t>(m), static_cast<std::uint16_t>(m | (m >> 16)), double_of(m),
                           pair_of(m), bytes_of(m), signed_of(m), halves_of(m), unsigned_of(m))
            .discard_if(m % 7 == 0);
    }
};

using framebuffer =
    vp::framebuffer<vp::cpu_backend, vp::target<std::uint8_t, blend::add>, vp::target<std::uint16_t, blend::bit_and>,
                    vp::target<double, blend::add>, vp::target<glm::dvec2, blend::min>,
                    vp::target<u8vec4, blend::replace>, vp::target<i64vec2, blend::add, vp::layout::planar>,
                    vp::target<hvec3, blend::max>, vp::target<u64vec2, blend::add, vp::layout::tiled>>;

// The expected values, voxel by voxel, without the library's folds. Sums of integers are exact, then truncated.
struct model_voxel {
    unsigned sum = 0;
    std::uint16_t common = 0xffff;
    unit::wide doubles; // 2^-64
    double low[2] = {HUGE_VAL, HUGE_VAL};
    bool has_low[2] = {false, false};
    u8vec4 last{0, 0, 0, 0};
    oracle::int128 signed_sum[2] = {0, 0};
    float high[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
    bool high_is_nan = false;
    oracle::uint128 unsigned_sum[2] = {0, 0};

    void add(std::uint64_t m) {
        sum += static_cast<unsigned>(m & 0xffu);
        common = static_cast<std::uint16_t>(common & (m | (m >> 16)));
        doubles = doubles + unit::round_to_integer(unit::exact(std::ldexp(double_of(m), 64)));
        for (int c = 0; c < 2; ++c) {
            const double d = pair_of(m)[c];
            if (std::isnan(d)) continue;
            low[c] = std::min(low[c], d);
            has_low[c] = true;
        }
        last = bytes_of(m);
        for (int c = 0; c < 2; ++c) {
            signed_sum[c] += signed_of(m)[c];
            unsigned_sum[c] += unsigned_of(m)[c];
        }
        for (int c = 0; c < 3; ++c) {
            const auto h = static_cast<float>(halves_of(m)[c]);
            if (std::isnan(h))
                high_is_nan = true;
            else
                high[c] = std::max(high[c], h);
        }
    }
};

class TargetTypes : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(TargetTypes, EightMoreInOnePassAreTheFoldsOfTheOraclesFragments) {
    const unit::small_mesh mesh = unit::make_mesh(7, 120, extent);
    const vp::grid grid = unit::unit_grid(extent);
    vp::cpu_backend backend(2);
    framebuffer fb{backend, extent};
    const vp::status s = vp::voxelize(backend, mesh.view(), grid, vp::passthrough{}, mark_shader{}, fb, GetParam());
    ASSERT_TRUE(s.ok()) << s.message();

    std::vector<model_voxel> expected(static_cast<std::size_t>(extent.x * extent.y * extent.z));
    std::uint64_t fragments = 0;
    for (const auto& f : unit::fragments_of(grid, GetParam(), {mesh})) {
        const std::uint64_t m = mark(f.primitive, f.voxel);
        if (m % 7 == 0) continue;
        ++fragments;
        expected[unit::linear(extent, f.voxel)].add(m);
    }
    EXPECT_EQ(s.counts.fragments, fragments);
    EXPECT_GT(fragments, 1000u);

    const auto sum = vp::get<0>(fb).to_host_target(backend);
    const auto common = vp::get<1>(fb).to_host_target(backend);
    const auto doubles = vp::get<2>(fb).to_host_target(backend);
    const auto low = vp::get<3>(fb).to_host_target(backend);
    const auto last = vp::get<4>(fb).to_host_target(backend);
    const auto signed_sum = vp::get<5>(fb).to_host_target(backend);
    const auto high = vp::get<6>(fb).to_host_target(backend);
    const auto unsigned_sum = vp::get<7>(fb).to_host_target(backend);
    std::uint64_t no_numbers = 0;
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        const model_voxel& v = expected[unit::linear(extent, {x, y, z})];
        ASSERT_EQ(sum(x, y, z), static_cast<std::uint8_t>(v.sum)) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(common(x, y, z), v.common) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(std::bit_cast<std::uint64_t>(doubles(x, y, z)),
                  unit::nearest_bits({v.doubles, unit::power_of_two(64)}, 52, 11));
        for (int c = 0; c < 2; ++c) {
            ASSERT_EQ(std::bit_cast<std::uint64_t>(low(x, y, z)[c]),
                      v.has_low[c] ? std::bit_cast<std::uint64_t>(v.low[c]) : 0x7ff8000000000000u);
            ASSERT_EQ(signed_sum(x, y, z)[c], static_cast<std::int64_t>(v.signed_sum[c]));
            ASSERT_EQ(unsigned_sum(x, y, z)[c], static_cast<std::uint64_t>(v.unsigned_sum[c]));
        }
        ASSERT_EQ(last(x, y, z), v.last);
        for (int c = 0; c < 3; ++c) {
            const bool nan = c == 2 && v.high_is_nan;
            no_numbers += nan ? 1 : 0;
            ASSERT_EQ(high(x, y, z)[c].bits, nan ? 0x7e00u : vp::half(v.high[c]).bits);
        }
    });
    EXPECT_GT(no_numbers, 100u);
}

INSTANTIATE_TEST_SUITE_P(Both, TargetTypes, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         [](const auto& p) { return p.param == vp::coverage::thin ? "thin" : "conservative"; });

} // namespace
