// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Targets on the host: whole or a region of them, for every layout; iteration over voxels; own memory as targets; and
// in builds with assertions, accesses out of range.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <stdexcept>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::backend_type;

const glm::ivec3 extent{71, 19, 21};

struct numbers { // values that name their voxel
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        const auto n = static_cast<std::uint32_t>(f.voxel.x + 100 * (f.voxel.y + 100 * f.voxel.z)) + 1u;
        return vp::outputs(n, glm::u16vec3(f.voxel + 1), n % 3 != 0);
    }
};

template <class Layout>
using framebuffer =
    vp::framebuffer<backend_type, vp::target<std::uint32_t, blend::max, Layout>,
                    vp::target<glm::u16vec3, blend::max, Layout>, vp::target<vp::bit, blend::bit_or, Layout>>;

template <class Layout>
framebuffer<Layout> drawn(backend_type& backend) {
    framebuffer<Layout> fb{backend, extent};
    const vp::mesh mesh = unit::make_mesh(7, 60, extent).on(backend);
    vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::passthrough{}, numbers{}, fb).or_throw();
    return fb;
}

template <class T>
class Regions : public ::testing::Test {};
using layouts = ::testing::Types<vp::layout::linear, vp::layout::planar, vp::layout::tiled>;
TYPED_TEST_SUITE(Regions, layouts);

TYPED_TEST(Regions, HoldTheVoxelsOfTheWhole) {
    backend_type backend = unit::make_backend();
    const framebuffer<TypeParam> fb = drawn<TypeParam>(backend);
    struct box {
        glm::ivec3 begin, size;
    };
    std::uint64_t occupied = 0;
    for (const box& b : {box{{0, 0, 0}, extent}, box{{33, 7, 8}, {1, 1, 1}}, box{{70, 18, 20}, {1, 1, 1}},
                         box{{5, 3, 6}, {40, 13, 9}}, box{{32, 8, 8}, {32, 8, 8}}, box{{31, 0, 0}, {40, 19, 21}}}) {
        const auto check = [&](const auto& whole, const auto& part) {
            EXPECT_EQ(part.first(), b.begin);
            EXPECT_EQ(part.last(), b.begin + b.size);
            std::uint64_t n = 0;
            vp::for_each_voxel(part, [&](glm::ivec3 v, const auto& value) {
                ASSERT_EQ(value, whole(v.x, v.y, v.z)) << v.x << ' ' << v.y << ' ' << v.z;
                ++n;
            });
            EXPECT_EQ(n, static_cast<std::uint64_t>(b.size.x) * static_cast<std::uint64_t>(b.size.y) *
                             static_cast<std::uint64_t>(b.size.z));
            vp::for_each_occupied(part, [&](glm::ivec3, const auto&) { ++occupied; });
        };
        check(vp::get<0>(fb).to_host_target(backend), vp::get<0>(fb).to_host_region(backend, b.begin, b.size));
        check(vp::get<1>(fb).to_host_target(backend), vp::get<1>(fb).to_host_region(backend, b.begin, b.size));
        check(vp::get<2>(fb).to_host_target(backend), vp::get<2>(fb).to_host_region(backend, b.begin, b.size));
    }
    EXPECT_GT(occupied, 1000u);
    const auto empty = vp::get<0>(fb).to_host_region(backend, {3, 3, 3}, {0, 4, 4});
    vp::for_each_voxel(empty, [](glm::ivec3, std::uint32_t) { FAIL(); });
    EXPECT_THROW((void)vp::get<0>(fb).to_host_region(backend, {70, 0, 0}, {2, 1, 1}), std::out_of_range);
    EXPECT_THROW((void)vp::get<2>(fb).to_host_region(backend, {-1, 0, 0}, {2, 1, 1}), std::out_of_range);
    const auto check = [&](const auto& target) { // into memory that is there
        const auto whole = target.to_host(backend);
        auto kept = whole;
        std::memset(kept.data(), 0xa5, kept.size() * sizeof(kept[0]));
        target.to_host(backend, kept);
        EXPECT_TRUE(unit::same_bytes(kept, whole));
        kept.pop_back();
        EXPECT_THROW(target.to_host(backend, kept), std::invalid_argument);
    };
    check(vp::get<0>(fb));
    check(vp::get<1>(fb));
    check(vp::get<2>(fb));
}

TEST(Occupied, AreTheVoxelsThatTheCallCounts) {
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<float, blend::max>, vp::target<float, blend::min>,
                    vp::target<glm::vec2, blend::add>, vp::target<vp::half, blend::replace>,
                    vp::target<vp::bit, blend::bit_or>>
        fb{backend, extent};
    const vp::mesh mesh = unit::make_mesh(8, 30, extent).on(backend);
    const auto draw = [&] {
        return vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::passthrough{},
                            vp::constant(2.0f, 2.0f, glm::vec2(0, 1), vp::half(1.0f), true), fb)
            .or_throw()
            .counts.voxels;
    };
    const std::uint64_t voxels = draw();
    EXPECT_GT(voxels, 100u);
    const auto count = [&](const auto& host, const auto&... empty) {
        std::uint64_t n = 0;
        vp::for_each_occupied(
            host,
            [&](glm::ivec3 v, const auto& value) {
                ++n;
                EXPECT_EQ(value, host(v.x, v.y, v.z));
            },
            empty...);
        return n;
    };
    EXPECT_EQ(count(vp::get<0>(fb).to_host_target(backend)), voxels); // the identity is -infinity
    EXPECT_EQ(count(vp::get<1>(fb).to_host_target(backend)), voxels); // NaN
    EXPECT_EQ(count(vp::get<2>(fb).to_host_target(backend)), voxels);
    EXPECT_EQ(count(vp::get<3>(fb).to_host_target(backend)), voxels);
    EXPECT_EQ(count(vp::get<4>(fb).to_host_target(backend)), voxels);
    vp::get<0>(fb).clear(-5.0f);
    EXPECT_EQ(draw(), voxels);
    EXPECT_EQ(count(vp::get<0>(fb).to_host_target(backend), -5.0f), voxels);
}

TEST(Views, OfOwnMemoryNameTheExtentOnce) {
    backend_type backend = unit::make_backend();
    const vp::mesh mesh = unit::make_mesh(9, 30, extent).on(backend);
    const framebuffer<vp::layout::linear> expected = drawn<vp::layout::linear>(backend);
    using ids = vp::target<std::uint32_t, blend::max>;
    using flags = vp::target<vp::bit, blend::bit_or>;
    backend_type::buffer<std::uint32_t> memory(backend, ids::map::elements(extent));
    const auto view = vp::framebuffer_view<ids, flags>::on(extent, memory.data(), nullptr);
    EXPECT_EQ(vp::get<0>(view.targets).extent, extent);
    EXPECT_EQ(vp::get<1>(view.targets).load, vp::load_operation::off);
    vp::voxelize(backend, mesh, unit::unit_grid(extent), vp::passthrough{}, vp::constant(1u, true), view).or_throw();
    std::uint64_t ones = 0;
    for (const std::uint32_t v : memory.to_host(backend)) ones += v;
    EXPECT_GT(ones, 100u);
}

#if !defined(NDEBUG)
TEST(AccessorsDeathTest, CheckTheirArgumentsInDebugBuilds) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, vp::target<float, blend::max>, vp::target<std::uint32_t, blend::add>> fb{
        backend, {8, 8, 8}, 0b01};
    ASSERT_TRUE(vp::clear(backend, fb).ok());
    const auto whole = vp::get<0>(fb).to_host_target(backend);
    EXPECT_DEATH((void)whole(8, 0, 0), "extent");
    EXPECT_DEATH((void)whole(0, -1, 0), "extent");
    const auto off = vp::get<1>(fb).to_host_target(backend);
    EXPECT_DEATH((void)off(0, 0, 0), "elements");
    const auto part = vp::get<0>(fb).to_host_region(backend, {1, 1, 1}, {2, 2, 2});
    EXPECT_DEATH((void)part(3, 1, 1), "last");
    std::vector<float> memory(8);
    const vp::target_view<vp::target<float, blend::max>> view{memory.data(), {2, 2, 2}};
    EXPECT_DEATH((void)view(0, 0, 2), "has");
    EXPECT_DEATH(view.store(2, 0, 0, 1.0f), "has");
    const vp::array_view<float> few(memory.data(), 2);
    EXPECT_DEATH((void)few[2], "count");
}
#endif

} // namespace
