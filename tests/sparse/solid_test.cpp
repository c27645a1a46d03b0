// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Solids in sparse framebuffers: made dense they are the dense solid, bit for bit, with the same status: every fill
// rule, extent, choice of bodies and repair, shaded and constant, cleared and loaded, whole grids and crops.

#include "api_model.hpp"
#include "box_mesh.hpp"
#include "triangles.hpp"

#include <voxelpipe/sparse/sparse.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using backend_type = vp::cpu_backend;
using unit::small_mesh;

// Overlapping boxes, some inside out, some beyond the grid; the last body lacks a triangle.
std::vector<small_mesh> bodies(std::uint64_t seed, const glm::ivec3& extent) {
    oracle::splitmix64 random(seed);
    std::vector<small_mesh> all(3);
    for (small_mesh& m : all)
        for (int i = 0; i < 5; ++i) {
            glm::vec3 low, high;
            for (int a = 0; a < 3; ++a) {
                low[a] = static_cast<float>(random.between(-8, std::int64_t{2} * extent[a] - 4)) * 0.5f;
                high[a] = low[a] + static_cast<float>(random.between(1, std::int64_t{2} * extent[a])) * 0.5f;
            }
            unit::add_box(m, low, high);
            if (random.between(0, 2) == 0) // its fronts inward
                for (std::size_t t = m.triangles.size() - 12; t < m.triangles.size(); ++t)
                    std::swap(m.triangles[t].y, m.triangles[t].z);
        }
    all.back().triangles.pop_back();
    return all;
}

struct shader {
    std::uint32_t seed = 0;
    auto operator()(const vp::solid_fragment& f) const {
        const std::uint64_t m = unit::mark(f.draw * 7 + seed + static_cast<std::uint32_t>(f.winding), f.voxel);
        const float value = static_cast<float>(static_cast<std::int32_t>(m)) * 0x1p-10f;
        return vp::outputs((m >> 20 & 3u) != 0, static_cast<std::uint32_t>(m), value,
                           glm::vec3(value, -value, static_cast<float>(f.winding)), static_cast<std::int16_t>(m))
            .discard_if(m % 5 == 0);
    }
};
template <template <class...> class Framebuffer>
using image =
    Framebuffer<backend_type, vp::target<vp::bit, blend::bit_xor, vp::layout::tiled>,
                vp::target<std::uint32_t, blend::replace>, vp::target<float, blend::add>,
                vp::target<glm::vec3, blend::max, vp::layout::planar>, vp::target<std::int16_t, blend::add_saturate>>;
constexpr std::size_t num_targets = 5;

struct both {
    backend_type backend = unit::make_backend(2);
    image<vp::framebuffer> dense;
    image<vp::sparse_framebuffer> sparse;
    explicit both(const glm::ivec3& extent) : dense(backend, extent), sparse(backend, extent) {}

    template <class F>
    void prepare(const F& f) {
        f(dense);
        f(sparse);
    }
    template <class Shade>
    // Returns the voxels that have fragments.
    std::uint64_t draw(const std::vector<small_mesh>& meshes, const vp::grid& g, const vp::solid_options& options,
                       const Shade& shade, const std::string& what) {
        std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, decltype(shade(0u))>> draws;
        draws.reserve(meshes.size());
        for (const small_mesh& m : meshes)
            draws.push_back({m.view(), {}, shade(static_cast<std::uint32_t>(draws.size()))});
        const vp::status a = vp::voxelize_solid(backend, draws, g, dense, options);
        const vp::status b = vp::voxelize_solid(backend, draws, g, sparse, options);
        EXPECT_TRUE(a.ok() && b.ok()) << what << ": " << a.message() << "; " << b.message();
        EXPECT_EQ(a.counts, b.counts) << what;
        EXPECT_EQ(a.solid, b.solid) << what;
        vp::core::for_each_index<num_targets>([&]<std::size_t I>() {
            EXPECT_TRUE(unit::same_bytes(vp::get<I>(dense).to_host(backend),
                                         vp::get<I>(sparse).to_host_target(backend).elements))
                << what << ", target " << I;
        });
        return b.counts.voxels;
    }
};

std::string name(const vp::solid_options& o) {
    return "rule " + std::to_string(static_cast<int>(o.rule)) + ", bodies " +
           std::to_string(static_cast<int>(o.bodies)) + ", extent " + std::to_string(static_cast<int>(o.extent)) +
           ", repair " + std::to_string(static_cast<int>(o.repair));
}
// All of them, but in a slow build one in five.
template <class F>
void for_each_options(const F& use) {
    int number = 0;
    const auto f = [&](const vp::solid_options& o) {
        if (number++ % 5 == 0 || oracle::test_scale() >= 1) use(o);
    };
    for (const vp::bodies b : {vp::bodies::call, vp::bodies::draw}) {
        for (const auto rule : {vp::fill_rule::even_odd, vp::fill_rule::nonzero, vp::fill_rule::positive})
            for (const auto extent : {vp::solid_extent::centre, vp::solid_extent::outer, vp::solid_extent::inner})
                f(vp::solid_options{.rule = rule, .bodies = b, .extent = extent});
        for (const auto repair : {vp::repair::close_holes, vp::repair::exterior, vp::repair::vote})
            f(vp::solid_options{.bodies = b, .repair = repair});
    }
}
constexpr auto shaded = [](std::uint32_t draw) { return shader{draw}; };
constexpr auto constant = [](std::uint32_t) {
    return vp::constant(true, 7u, 0.1f, glm::vec3(1, 2, 3), std::int16_t{300});
};

} // namespace

TEST(SparseSolids, MadeDenseAreTheDenseSolids) {
    const glm::ivec3 extent{40, 35, 33};
    const vp::grid grid = unit::unit_grid(extent);
    const std::vector<small_mesh> first = bodies(1, extent), second = bodies(2, extent);
    for_each_options([&](const vp::solid_options& o) {
        both b(extent);
        EXPECT_GT(b.draw(first, grid, o, shaded, name(o)), 1000u) << name(o);
        b.prepare([](auto& fb) {
            vp::get<0>(fb).load();
            vp::get<1>(fb).off();
            vp::get<2>(fb).load();
            vp::get<3>(fb).clear(glm::vec3(1, 2, 3));
        });
        b.draw(second, grid, o, shaded, name(o) + ", loaded");
        both c(extent);
        c.draw(first, grid, o, constant, name(o) + ", constant");
        c.prepare(
            [](auto& fb) { vp::core::for_each_index<num_targets>([&]<std::size_t I>() { vp::get<I>(fb).load(); }); });
        c.draw(second, grid, o, constant, name(o) + ", constant, loaded");
    });
}

// Crops begin within tiles and bricks; crossings before them count.
TEST(SparseSolids, CropsAreTheDenseCrops) {
    const glm::ivec3 extent{70, 45, 41};
    const vp::grid whole = unit::unit_grid(extent);
    const vp::grid part = whole.crop({37, 5, 3}, {30, 37, 36}), far = whole.crop({66, 33, 8}, {4, 12, 33});
    const std::vector<small_mesh> meshes = bodies(3, extent);
    for_each_options([&](const vp::solid_options& o) {
        if (o.repair == vp::repair::exterior) return; // refuses crops
        for (const vp::grid& g : {part, far}) {
            both b(g.extent), c(g.extent);
            EXPECT_GT(b.draw(meshes, g, o, shaded, name(o)), 10u) << name(o);
            c.draw(meshes, g, o, constant, name(o) + ", constant");
        }
    });
}

// Sums are kept as sums of triangles are; numbers of threads change no byte; limits change nothing and tell the need.
TEST(SparseSolids, KeepSumsAndLimits) {
    const glm::ivec3 extent{40, 40, 40};
    const vp::grid grid = unit::unit_grid(extent);
    const std::vector<small_mesh> meshes = bodies(4, extent);
    std::vector<vp::draw<vp::mesh_view<>, vp::passthrough, shader>> draws;
    draws.reserve(meshes.size());
    for (const small_mesh& m : meshes) draws.push_back({m.view(), {}, {}});
    backend_type one = unit::make_backend(1), two = unit::make_backend(2);
    image<vp::sparse_framebuffer> a{one, extent}, b{two, extent};
    a.keep_sums<2>();
    b.keep_sums<2>();
    ASSERT_TRUE(vp::voxelize_solid(one, draws, grid, a, vp::each_draw));
    ASSERT_TRUE(vp::voxelize_solid(two, draws, grid, b, vp::each_draw));
    const auto ha = a.to_host(one), hb = b.to_host(two);
    EXPECT_TRUE(vp::same_contents(ha, hb));
    ASSERT_EQ(vp::get<2>(ha.sums).size(), a.num_voxels());
    EXPECT_TRUE(unit::same_bytes(vp::get<2>(ha.sums), vp::get<2>(hb.sums)));
    using traits = vp::target<float, blend::add>::traits;
    for (std::size_t i = 0; i < vp::get<2>(ha.sums).size(); ++i)
        ASSERT_EQ(traits::end(vp::get<2>(ha.sums)[i]), vp::get<2>(ha.values)[i]) << i;

    b.limit({a.num_bricks(), a.num_voxels() - 1});
    const vp::status s = vp::voxelize_solid(two, draws, grid, b, vp::each_draw);
    EXPECT_EQ(s.code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(s.required.voxels, a.num_voxels());
    EXPECT_TRUE(vp::same_contents(b.to_host(two), ha));
}
