// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Instances of a mesh: what as many draws give, in every kind of output; their numbers; and their limits.

#include "api_model.hpp"

#include <voxelpipe/core/instances.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::backend_type;

const glm::ivec3 extent{37, 29, 41};
constexpr std::uint32_t copies = 5;

struct spot {
    vp::flat<std::uint32_t> instance;
    float along;
};
// Puts copy i at place i; the copy is the instance, or the draw.
struct placed {
    bool by_draw;
    VOXELPIPE_HD auto operator()(const vp::vertex<>& v) const {
        const std::uint32_t i = by_draw ? v.draw : v.instance;
        const float s = static_cast<float>(i);
        const glm::vec3 p = 0.5f * v.position + glm::vec3(3.0f * s, 1.25f * s, 4.0f * s - 2.0f);
        return vp::vertex_output{p, spot{{i}, vp::exact::mul(s, v.position.x)}};
    }
};
struct shader {
    bool by_draw;
    VOXELPIPE_HD auto operator()(const vp::fragment<spot>& f) const {
        const std::uint32_t i = by_draw ? f.draw : f.instance;
        return vp::outputs(glm::uvec4(i, f.triangle, f.primitive, f.varyings.instance.value), f.varyings.along)
            .discard_if(f.primitive % 5 == 0);
    }
};
using ids = vp::target<glm::uvec4, blend::replace>;
using sums = vp::target<float, blend::add>;
using draw = vp::draw<vp::mesh_view<>, placed, shader>;

std::vector<draw> as_draws(const vp::mesh_view<>& mesh) { return std::vector<draw>(copies, {mesh, {true}, {true}}); }
std::vector<draw> as_instances(vp::mesh_view<> mesh) {
    mesh.copies = {copies};
    return {{mesh, {false}, {false}}};
}

TEST(Instances, GiveWhatDrawsGive) {
    const unit::small_mesh m = unit::make_mesh(1, 60, extent);
    const vp::grid whole = unit::unit_grid(extent), part = whole.crop({5, 0, 9}, {30, 25, 20});
    for (const vp::grid& grid : {whole, part})
        for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
            backend_type backend = unit::make_backend();
            const auto mesh = m.on(backend);
            vp::framebuffer<backend_type, ids, sums> a{backend, grid.extent}, b{backend, grid.extent};
            const vp::status s = vp::voxelize(backend, as_draws(mesh.view()), grid, a, rule);
            const vp::status t = vp::voxelize(backend, as_instances(mesh.view()), grid, b, rule);
            ASSERT_TRUE(s.ok() && t.ok()) << s.message() << t.message();
            EXPECT_EQ(s.counts, t.counts);
            EXPECT_GT(s.counts.voxels, 500u);
            EXPECT_TRUE(unit::same_bytes(vp::get<0>(a).to_host(backend), vp::get<0>(b).to_host(backend)));
            EXPECT_TRUE(unit::same_bytes(vp::get<1>(a).to_host(backend), vp::get<1>(b).to_host(backend)));
        }
}

TEST(Instances, GiveTheListsAndBricksOfDraws) {
    const unit::small_mesh m = unit::make_mesh(2, 40, extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    const auto mesh = m.on(backend);
    vp::abuffer<backend_type> a(backend), b(backend);
    EXPECT_TRUE(vp::voxelize(backend, as_draws(mesh.view()), grid, a).ok());
    EXPECT_TRUE(vp::voxelize(backend, as_instances(mesh.view()), grid, b).ok());
    EXPECT_EQ(a.voxels.to_host(backend), b.voxels.to_host(backend));
    EXPECT_EQ(a.primitives.to_host(backend), b.primitives.to_host(backend));
    const auto draws = as_instances(mesh.view());
    const vp::primitive_map map(draws);
    EXPECT_EQ(map.size(), 200u);
    EXPECT_EQ(map(87), (vp::draw_triangle{0, 7}));
    EXPECT_EQ(map.instance(87), 2u);

    vp::sparse_framebuffer<backend_type, ids, sums> c(backend, extent), d(backend, extent);
    EXPECT_TRUE(vp::voxelize(backend, as_draws(mesh.view()), grid, c).ok());
    EXPECT_TRUE(vp::voxelize(backend, as_instances(mesh.view()), grid, d).ok());
    EXPECT_EQ(c.to_host(backend).keys, d.to_host(backend).keys);
    EXPECT_TRUE(unit::same_bytes(vp::get<1>(c.to_host(backend).values), vp::get<1>(d.to_host(backend).values)));
}

// Boxes that overlap in part; a missing side is a hole of each.
TEST(Instances, OfSolidsAreClosedAndCountedAlike) {
    unit::small_mesh box;
    for (int i = 0; i < 8; ++i)
        box.positions.emplace_back(i % 2 == 0 ? 2.1f : 17.4f, i / 2 % 2 == 0 ? 1.4f : 14.1f, i / 4 == 0 ? 3.3f : 21.2f);
    box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}};
    struct moved {
        bool by_draw;
        VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const {
            return v.position + 5.5f * static_cast<float>(by_draw ? v.draw : v.instance);
        }
    };
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    const auto mesh = box.on(backend);
    using solid_draw = vp::draw<vp::mesh_view<>, moved, vp::constant_output<bool>>;
    const std::vector<solid_draw> many(3, {mesh.view(), {true}, {{true}}});
    const std::vector<solid_draw> one{{mesh.view(vp::instances{3}), {false}, {{true}}}};
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes, vp::repair::exterior, vp::repair::vote})
        for (const vp::fill_rule rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero}) {
            vp::solid_options options;
            if ((repair == vp::repair::exterior || repair == vp::repair::vote) && rule != options.rule) continue;
            options.repair = repair;
            options.rule = rule;
            vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>> a{backend, extent}, b{backend, extent};
            const vp::status s = vp::voxelize_solid(backend, many, grid, a, options);
            const vp::status t = vp::voxelize_solid(backend, one, grid, b, options);
            ASSERT_TRUE(s.ok() && t.ok()) << s.message() << t.message();
            EXPECT_EQ(s.counts, t.counts);
            EXPECT_EQ(s.solid, t.solid);
            EXPECT_GT(s.counts.voxels, 1000u);
            EXPECT_TRUE(unit::same_bytes(vp::get<0>(a).to_host(backend), vp::get<0>(b).to_host(backend)));
        }
}

TEST(Instances, HaveLimitsAndCheckedIndices) {
    unit::small_mesh m = unit::make_mesh(3, 10, extent);
    const vp::grid grid = unit::unit_grid(extent);
    backend_type backend = unit::make_backend();
    vp::framebuffer<backend_type, ids, sums> fb{backend, extent};
    const auto run = [&](std::uint64_t count) {
        const auto mesh = m.on(backend);
        return vp::voxelize(backend, mesh.view(vp::instances{count}), grid, placed{false}, shader{false}, fb);
    };
    EXPECT_TRUE(run(0).nothing_drawn());
    const vp::status s = run(500'000'000);
    EXPECT_EQ(s.code, vp::status_code::too_many_triangles);
    EXPECT_EQ(s.counts.triangles_in, 5'000'000'000u);
    EXPECT_EQ(run(~std::uint64_t{0}).code, vp::status_code::too_many_triangles);
    EXPECT_EQ(run(420'000'000).code, vp::status_code::size_overflow); // 30 vertices each
    // An index beyond one instance's vertices is no index into the next one's.
    m.triangles[4].y = static_cast<std::uint32_t>(m.positions.size());
    const vp::status bad = run(3);
    EXPECT_EQ(bad.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(bad.triangle, 4u);
}

// The quotient is estimated from below: numbers around multiples of the divisor show a wrong step.
TEST(Instances, RemainderWithoutADivision) {
    const std::vector<std::uint32_t> edges{
        0, 1, 2, 3, 7, 255, 256, 65535U, 65536U, 0x7fffffffU, 0x80000000U, 0x80000001U, 0xfffffffeU, 0xffffffffU};
    const auto check = [](std::uint32_t n, std::uint32_t divisor) {
        if (divisor == 0) return;
        EXPECT_EQ(n % divisor, vp::core::remainder_by(divisor).of(n)) << n << " by " << divisor;
    };
    for (const std::uint32_t n : edges)
        for (const std::uint32_t divisor : edges) check(n, divisor);
    std::mt19937 random(1);
    for (int i = 0; i < 100000; ++i) {
        const auto n = static_cast<std::uint32_t>(random()), divisor = static_cast<std::uint32_t>(random()) >> (i % 32);
        check(n, divisor);
        if (divisor != 0) check(n / divisor * divisor, divisor);
        if (divisor != 0) check(n / divisor * divisor - 1, divisor);
    }
    EXPECT_EQ(0U, vp::core::remainder_by(0).of(5)); // a mesh without triangles
}

} // namespace
