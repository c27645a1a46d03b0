// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Render targets on a backend: many types and blends in one pass, clear, load, off, discard, user types, against
// folds over the oracle's fragments.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <array>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::backend_type;
using unit::mark;

const glm::ivec3 extent{45, 34, 37};

// ---- a fragment's values, by shader and by model --------------------------------------------------------------------

struct record { // a user's struct whose hash chain changes with the order
    std::uint64_t chain;
    std::uint32_t fragments;
    std::uint32_t last;
};
struct chain {
    static constexpr bool order_free = false;
    VOXELPIPE_HD record identity() const { return {0xcbf29ce484222325u, 0, 0xffffffffu}; }
    VOXELPIPE_HD record combine(record a, record b) const {
        return {(a.chain ^ b.chain) * 0x100000001b3u, a.fragments + b.fragments, b.last};
    }
};

VOXELPIPE_HD bool bit_of(std::uint64_t m) { return (m >> 20 & 3u) != 0; }
VOXELPIPE_HD float float_of(std::uint64_t m) { return static_cast<float>(static_cast<std::int32_t>(m)) * 0x1p-10f; }
VOXELPIPE_HD glm::vec3 vector_of(std::uint64_t m) { return {float_of(m), float_of(m >> 8), float_of(m >> 16)}; }
VOXELPIPE_HD vp::half half_of(std::uint64_t m) { return vp::half(float_of(m) * 0x1p-14f); }

struct mark_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const std::uint64_t m = mark(f.primitive, f.voxel);
        return vp::outputs(bit_of(m), f.primitive, float_of(m), vector_of(m), static_cast<std::int16_t>(m), half_of(m),
                           static_cast<std::uint64_t>(m), record{m, 1, f.primitive})
            .discard_if(m % 7 == 0);
    }
};

using framebuffer =
    vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_xor>, vp::target<std::uint32_t, blend::replace>,
                    vp::target<float, blend::add>, vp::target<glm::vec3, blend::max, vp::layout::planar>,
                    vp::target<std::int16_t, blend::min, vp::layout::tiled>, vp::target<vp::half, blend::add>,
                    vp::target<std::uint64_t, blend::count>, vp::target<record, chain>>;

// The expected values, voxel by voxel, without the library's folds.
struct model_voxel {
    bool odd = false;
    std::uint32_t last = 0;
    unit::wide sum, half_sum; // 2^-32, 2^-24
    glm::vec3 high{-HUGE_VALF};
    std::int16_t low = 32767;
    std::uint64_t count = 0;
    record r = chain{}.identity();
    std::uint64_t kept = 0;
};

struct model {
    std::vector<model_voxel> voxels;
    std::uint64_t fragments = 0, discarded = 0, occupied = 0;

    model(const std::vector<unit::model_fragment>& list, glm::ivec3 e)
        : voxels(static_cast<std::size_t>(e.x) * static_cast<std::size_t>(e.y) * static_cast<std::size_t>(e.z)) {
        for (const auto& f : list) {
            const std::uint64_t m = mark(f.primitive, f.voxel);
            if (m % 7 == 0) {
                ++discarded;
                continue;
            }
            ++fragments;
            model_voxel& v = voxels[unit::linear(e, f.voxel)];
            occupied += v.kept++ == 0 ? 1 : 0;
            v.odd = v.odd != bit_of(m);
            v.last = f.primitive;
            v.sum = v.sum + unit::round_to_integer({unit::exact(std::ldexp(double{float_of(m)}, 32))});
            v.half_sum = v.half_sum +
                         unit::round_to_integer({unit::exact(std::ldexp(double{static_cast<float>(half_of(m))}, 24))});
            for (int a = 0; a < 3; ++a) v.high[a] = std::max(v.high[a], vector_of(m)[a]);
            v.low = std::min(v.low, static_cast<std::int16_t>(m));
            ++v.count;
            v.r = {(v.r.chain ^ m) * 0x100000001b3u, v.r.fragments + 1, f.primitive};
        }
    }
};

class Targets : public ::testing::TestWithParam<vp::coverage> {};

TEST_P(Targets, EightInOnePassAreTheFoldsOfTheOraclesFragments) {
    const unit::small_mesh mesh = unit::make_mesh(1, 120, extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    framebuffer fb{backend, extent};
    const vp::status s =
        vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, mark_shader{}, fb, GetParam());
    ASSERT_TRUE(s.ok()) << s.message();
    const model expected(unit::fragments_of(grid, GetParam(), {mesh}), extent);
    EXPECT_EQ(s.counts.fragments, expected.fragments);
    EXPECT_EQ(s.counts.fragments_discarded, expected.discarded);
    EXPECT_EQ(s.counts.voxels, expected.occupied);
    EXPECT_GT(expected.fragments, 1000u);
    EXPECT_GT(expected.discarded, 100u);

    const auto odd = vp::get<0>(fb).to_host_target(backend);
    const auto last = vp::get<1>(fb).to_host_target(backend);
    const auto sum = vp::get<2>(fb).to_host_target(backend);
    const auto high = vp::get<3>(fb).to_host_target(backend);
    const auto low = vp::get<4>(fb).to_host_target(backend);
    const auto half_sum = vp::get<5>(fb).to_host_target(backend);
    const auto count = vp::get<6>(fb).to_host_target(backend);
    const auto chained = vp::get<7>(fb).to_host_target(backend);
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        const model_voxel& v = expected.voxels[unit::linear(extent, {x, y, z})];
        ASSERT_EQ(odd(x, y, z), v.odd) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(last(x, y, z), v.last) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(std::bit_cast<std::uint32_t>(sum(x, y, z)),
                  unit::nearest_bits({v.sum, unit::power_of_two(32)}, 23, 8));
        ASSERT_EQ(high(x, y, z), v.high);
        ASSERT_EQ(low(x, y, z), v.low);
        ASSERT_EQ(half_sum(x, y, z).bits, unit::nearest_bits({v.half_sum, unit::power_of_two(24)}, 10, 5));
        ASSERT_EQ(count(x, y, z), v.count);
        ASSERT_EQ(chained(x, y, z).chain, v.r.chain) << "triangle order";
        ASSERT_EQ(chained(x, y, z).fragments, v.r.fragments);
        ASSERT_EQ(chained(x, y, z).last, v.r.last);
    });
}

INSTANTIATE_TEST_SUITE_P(Both, Targets, ::testing::Values(vp::coverage::conservative, vp::coverage::thin),
                         [](const auto& p) { return p.param == vp::coverage::thin ? "thin" : "conservative"; });

// ---- load operations ------------------------------------------------------------------------------------------------

struct two_values {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(f.triangle + 1u, static_cast<float>(f.triangle));
    }
};
using two = vp::framebuffer<backend_type, vp::target<std::uint32_t, blend::add>, vp::target<float, blend::add>>;

TEST(LoadOperation, ClearSetsEveryVoxelAndCountsAsAFirstTerm) {
    const unit::small_mesh mesh = unit::make_mesh(2, 40, extent);
    backend_type backend = unit::make_backend();
    two fb{backend, extent};
    vp::get<0>(fb).clear(1000u);
    vp::get<1>(fb).clear(0.5f);
    const auto grid = unit::unit_grid(extent);
    vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, two_values{}, fb).or_throw();
    std::vector<std::uint32_t> sums(static_cast<std::size_t>(extent.x * extent.y * extent.z), 1000u);
    std::vector<float> floats(sums.size(), 0.5f); // small numbers: a plain sum is exact
    for (const auto& f : unit::fragments_of(grid, vp::coverage::conservative, {mesh})) {
        sums[unit::linear(extent, f.voxel)] += f.triangle + 1;
        floats[unit::linear(extent, f.voxel)] += static_cast<float>(f.triangle);
    }
    EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(backend), sums));
    EXPECT_TRUE(unit::same_bytes(vp::get<1>(fb).to_host(backend), floats));

    // Load blends onto the stored values: the same triangles once more.
    vp::get<0>(fb).load();
    vp::get<1>(fb).load();
    vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, two_values{}, fb).or_throw();
    for (std::size_t i = 0; i < sums.size(); ++i) {
        sums[i] = 2 * sums[i] - 1000;
        floats[i] = 2 * floats[i] - 0.5f;
    }
    EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(backend), sums));
    EXPECT_TRUE(unit::same_bytes(vp::get<1>(fb).to_host(backend), floats));

    // Off: neither read nor written.
    vp::get<0>(fb).off();
    vp::get<1>(fb).clear(-1.0f);
    vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, two_values{}, fb).or_throw();
    EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(backend), sums));
    EXPECT_FALSE(unit::same_bytes(vp::get<1>(fb).to_host(backend), floats));
}

TEST(LoadOperation, DisabledTargetsNeedNoMemory) {
    const unit::small_mesh mesh = unit::make_mesh(3, 40, extent);
    backend_type backend = unit::make_backend();
    two both{backend, extent}, second{backend, extent, 0b10};
    EXPECT_EQ(vp::get<0>(second).view().elements, nullptr);
    EXPECT_EQ(vp::get<0>(second).to_host(backend).size(), 0u);
    const auto grid = unit::unit_grid(extent);
    for (two* fb : {&both, &second})
        vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, two_values{}, *fb).or_throw();
    EXPECT_TRUE(unit::same_bytes(vp::get<1>(both).to_host(backend), vp::get<1>(second).to_host(backend)));
}

TEST(LoadOperation, UntouchedVoxelsKeepTheirBits) {
    // A non-canonical NaN and -0 keep their bits in voxels without fragments, under clear and under load.
    const float odd_nan = std::bit_cast<float>(0xffc12345u);
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<float, blend::add>> fb{backend, extent};
    unit::small_mesh one;
    one.positions = {{1.5f, 1.5f, 1.5f}, {1.6f, 1.5f, 1.5f}, {1.5f, 1.6f, 1.5f}};
    one.triangles = {{0, 1, 2}};
    const auto grid = unit::unit_grid(extent);
    for (const float start : {odd_nan, -0.0f}) {
        vp::get<0>(fb).clear(start);
        for (int pass = 0; pass < 2; ++pass) {
            vp::voxelize(backend, one.on(backend), grid, vp::passthrough{}, vp::constant(1.0f), fb).or_throw();
            const auto values = vp::get<0>(fb).to_host(backend);
            for (std::size_t i = 0; i < values.size(); ++i) {
                if (i == unit::linear(extent, {1, 1, 1})) continue;
                ASSERT_EQ(std::bit_cast<std::uint32_t>(values[i]), std::bit_cast<std::uint32_t>(start));
            }
            vp::get<0>(fb).load();
        }
    }
}

// A framebuffer that tracks its changes holds the same values. tests/strategies/tracked_changes_test.cu has targets
// that are large enough for partial clears.
TEST(LoadOperation, TrackedChangesMakeNoDifference) {
    backend_type backend = unit::make_backend();
    two plain{backend, extent}, tracked{backend, extent};
    EXPECT_EQ(tracked.view().changes, nullptr);
    tracked.track_changes(backend);
    EXPECT_NE(tracked.view().changes, nullptr);
    const auto grid = unit::unit_grid(extent);
    for (const unsigned seed : {3u, 4u, 5u}) {
        const unit::small_mesh mesh = unit::make_mesh(seed, 40, extent);
        for (two* fb : {&plain, &tracked}) {
            vp::get<1>(*fb).clear(seed == 5 ? 1.0f : 2.0f);
            vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, two_values{}, *fb).or_throw();
        }
        EXPECT_TRUE(unit::same_bytes(vp::get<0>(plain).to_host(backend), vp::get<0>(tracked).to_host(backend)));
        EXPECT_TRUE(unit::same_bytes(vp::get<1>(plain).to_host(backend), vp::get<1>(tracked).to_host(backend)));
        if (seed == 4) tracked.forget_changes(backend);
    }
}

TEST(LoadOperation, BitsClearToOneUpToTheExtentAndPaddingToZero) {
    backend_type backend = unit::make_backend();
    unit::small_mesh far;
    far.positions = {{1000, 0, 0}, {1001, 0, 0}, {1000, 1, 0}};
    far.triangles = {{0, 1, 2}};
    for (const int nx : {1, 31, 32, 33, 70}) {
        const glm::ivec3 e{nx, 3, 9};
        vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_and>,
                        vp::target<vp::bit, blend::bit_and, vp::layout::tiled>>
            fb{backend, e};
        vp::get<0>(fb).clear(true);
        vp::get<1>(fb).clear(true);
        vp::voxelize(backend, far.on(backend), unit::unit_grid(e), vp::passthrough{}, vp::constant(false, false), fb)
            .or_throw();
        for (const auto& words : {vp::get<0>(fb).to_host(backend), vp::get<1>(fb).to_host(backend)}) {
            int bits = 0;
            for (const std::uint32_t w : words) bits += std::popcount(w);
            EXPECT_EQ(bits, nx * 3 * 9);
        }
        const auto linear = vp::get<0>(fb).to_host_target(backend);
        const auto tiled = vp::get<1>(fb).to_host_target(backend);
        unit::for_each_voxel(e, [&](int x, int y, int z) {
            ASSERT_TRUE(linear(x, y, z));
            ASSERT_TRUE(tiled(x, y, z));
        });
    }
}

struct layout_shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const glm::vec3 v = vector_of(mark(f.primitive, f.voxel));
        return vp::outputs(v, v, v, v.x > 0, v.x > 0);
    }
};

TEST(Layouts, HoldTheSameValues) {
    const unit::small_mesh mesh = unit::make_mesh(4, 100, extent);
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<glm::vec3, blend::min>,
                    vp::target<glm::vec3, blend::min, vp::layout::planar>,
                    vp::target<glm::vec3, blend::min, vp::layout::tiled>, vp::target<vp::bit, blend::bit_or>,
                    vp::target<vp::bit, blend::bit_or, vp::layout::tiled>>
        fb{backend, extent};
    vp::voxelize(backend, mesh.on(backend), unit::unit_grid(extent), vp::passthrough{}, layout_shader{}, fb).or_throw();
    const auto a = vp::get<0>(fb).to_host_target(backend);
    const auto b = vp::get<1>(fb).to_host_target(backend);
    const auto c = vp::get<2>(fb).to_host_target(backend);
    const auto linear = vp::get<3>(fb).to_host_target(backend);
    const auto tiled = vp::get<4>(fb).to_host_target(backend);
    int set = 0;
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        const glm::vec3 va = a(x, y, z), vb = b(x, y, z), vc = c(x, y, z);
        ASSERT_EQ(std::memcmp(&va, &vb, sizeof va), 0);
        ASSERT_EQ(std::memcmp(&va, &vc, sizeof va), 0);
        ASSERT_EQ(linear(x, y, z), tiled(x, y, z));
        set += linear(x, y, z) ? 1 : 0;
    });
    EXPECT_GT(set, 100);
}

TEST(FramebufferView, WritesIntoTheCallersMemory) {
    const unit::small_mesh mesh = unit::make_mesh(5, 30, extent);
    using target = vp::target<std::uint32_t, blend::add>;
    const std::size_t n = target::map::elements(extent);
    backend_type backend = unit::make_backend();
    const std::vector<std::uint32_t> before(n + 2, 0xabababab);
    backend_type::buffer<std::uint32_t> buffer{backend, before};
    vp::framebuffer_view<target> fb{extent, {}};
    vp::get<0>(fb.targets) = {buffer.data() + 1, extent, vp::load_operation::clear, 0u};
    const vp::status s =
        vp::voxelize(backend, mesh.on(backend), unit::unit_grid(extent), vp::passthrough{}, vp::constant(1u), fb);
    ASSERT_TRUE(s.ok());
    const auto memory = buffer.to_host(backend);
    std::uint64_t sum = 0;
    for (std::size_t i = 1; i <= n; ++i) sum += memory[i];
    EXPECT_EQ(sum, s.counts.fragments);
    EXPECT_EQ(memory.front(), 0xababababu); // memory beside the target is unchanged
    EXPECT_EQ(memory.back(), 0xababababu);
}

TEST(CountVoxels, CanBeSwitchedOffWithoutChangingAnything) {
    const unit::small_mesh mesh = unit::make_mesh(6, 80, extent);
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>> a{backend, extent}, b{backend, extent};
    const auto grid = unit::unit_grid(extent);
    const auto with = vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, vp::constant(true), a,
                                   {vp::coverage::conservative, true});
    const auto without = vp::voxelize(backend, mesh.on(backend), grid, vp::passthrough{}, vp::constant(true), b,
                                      {vp::coverage::conservative, false});
    EXPECT_TRUE(unit::same_bytes(vp::get<0>(a).to_host(backend), vp::get<0>(b).to_host(backend)));
    std::uint64_t bits = 0;
    for (const std::uint32_t w : vp::get<0>(a).to_host(backend)) bits += static_cast<unsigned>(std::popcount(w));
    EXPECT_EQ(with.counts.voxels, bits);
    EXPECT_EQ(without.counts.voxels, 0u);
    EXPECT_EQ(with.counts.fragments, without.counts.fragments);
}

} // namespace
