// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse framebuffers on the device: the bytes of cpu_backend, for every blend, clear and load and off, kept sums,
// crops, several draws, and grids beyond 32-bit cells; lookups and octrees over them.

#include "../sparse/octree_cases.hpp"
#include "device_test.hpp"
#include "sparse_pairs.hpp"
#include "subset_meshes.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <gtest/gtest.h>

#include <random>
#include <span>
#include <vector>

namespace {

using namespace sparse_pairs;

} // namespace

TEST(DeviceSparse, GivesTheBytesOfTheCpu) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid grid = unit::unit_grid(extent);
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(1, 25, extent), unit::make_mesh(2, 15, extent)};
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative, vp::coverage::crosshair}) {
        pair p(extent);
        p.draw(meshes, grid, rule, "cleared");
        EXPECT_GT(p.on_host.num_voxels(), 500u);
        const std::vector<unit::small_mesh> more{unit::make_mesh(3, 20, extent)};
        p.prepare([](auto& fb) { vp::core::for_each_index<8>([&]<std::size_t I>() { vp::get<I>(fb).load(); }); });
        p.draw(more, grid, rule, "loaded");
        p.prepare([](auto& fb) {
            vp::get<2>(fb).off();
            vp::get<1>(fb).clear(7u);
            vp::get<0>(fb).clear(true);
            vp::get<3>(fb).clear({2.5, -1.0});
            fb.template keep_sums<2>();
            fb.template keep_sums<3>();
        });
        p.draw(meshes, grid, rule, "cleared, loaded, off, sums kept");
        p.prepare([](auto& fb) { vp::core::for_each_index<8>([&]<std::size_t I>() { vp::get<I>(fb).load(); }); });
        p.draw(more, grid, rule, "sums kept, loaded");
        p.prepare([](auto& fb) { vp::get<4>(fb).clear(3); });
        p.draw({}, grid, rule, "no draws");
        p.prepare([](auto& fb) { vp::core::for_each_index<8>([&]<std::size_t I>() { vp::get<I>(fb).clear({}); }); });
        EXPECT_TRUE(vp::clear(p.device, p.on_device));
        EXPECT_TRUE(vp::clear(p.host, p.on_host));
        p.compare("nothing");
        EXPECT_EQ(p.on_device.num_voxels(), 0u);
    }
}

// Voxels of more fragments than a thread folds alone: two neighbours, so that a block shares two.
TEST(DeviceSparse, VoxelsOfVeryManyFragmentsGiveTheBytesOfTheCpu) {
    const glm::ivec3 extent{12, 9, 10};
    const vp::grid grid = unit::unit_grid(extent);
    unit::small_mesh mesh = unit::make_mesh(41, 12, extent), more = unit::make_mesh(42, 12, extent);
    std::mt19937 random{43};
    std::uniform_real_distribution<float> inside(0.1f, 0.9f);
    for (unit::small_mesh* m : {&mesh, &more})
        for (int i = 0; i < 3600; ++i) {
            const auto first = static_cast<std::uint32_t>(m->positions.size());
            for (int k = 0; k < 3; ++k)
                m->positions.emplace_back(5.0f + static_cast<float>(i % 2) + inside(random), 4.0f + inside(random),
                                          4.0f + inside(random));
            m->triangles.emplace_back(first, first + 1, first + 2);
        }
    pair p(extent);
    p.draw({mesh}, grid, vp::coverage::conservative, "cleared");
    p.prepare([](auto& fb) {
        vp::core::for_each_index<8>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
        vp::get<3>(fb).clear({2.5, -1.0});
        fb.template keep_sums<2>();
        fb.template keep_sums<3>();
    });
    p.draw({more}, grid, vp::coverage::conservative, "loaded, sums kept");
}

// mesh_view::part: shaders see the numbers of the whole; masks have none.
TEST(DeviceSparse, SubsetsGiveTheBytesOfTheCpu) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid grid = unit::unit_grid(extent);
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(1, 75, extent), unit::make_mesh(2, 45, extent)};
    pair p(extent);
    constant_pair constants(extent);
    p.draws_some = constants.draws_some = true;
    p.draw(meshes, grid, vp::coverage::conservative, "computed");
    constants.draw(meshes, grid, vp::coverage::thin, "constant", constant_shader);
    EXPECT_GT(p.on_host.num_voxels(), 500u);
    const device_test::some_triangles some(constants.device, meshes[0].triangles, {7, 7});
    const vp::mesh<vp::cuda_backend> mesh(constants.device, meshes[0].positions, meshes[0].triangles);
    EXPECT_EQ(vp::voxelize(constants.device, some.of(mesh.view()), grid, vp::passthrough{}, constant_shader,
                           constants.on_device, vp::coverage::thin)
                  .code,
              vp::status_code::bad_subset);
    constants.compare("a call that was refused");
}

TEST(DeviceSparse, GivesTheBytesOfTheCpuInPartsOfLargeGrids) {
    unit::small_mesh mesh = unit::make_mesh(4, 15, {40, 40, 40}), more = unit::make_mesh(9, 9, {45, 40, 40});
    for (glm::vec3& p : mesh.positions) p += glm::vec3(65000, 30001, 20007);
    for (glm::vec3& p : more.positions) p += glm::vec3(65000, 30001, 20007);
    for (const int side : {65536, 1 << 20}) { // the second has groups of nodes
        const vp::grid whole = unit::unit_grid({side, side, side});
        const vp::grid part = whole.crop({64990, 29999, 20003}, {45, 41, 46});
        pair p(part.extent);
        p.draw({mesh}, part, vp::coverage::conservative, "a crop");
        EXPECT_GT(p.on_host.num_voxels(), 300u);
        pair all(whole.extent);
        all.draw({mesh}, whole, vp::coverage::conservative, "the whole");
        EXPECT_GT(all.on_host.num_voxels(), p.on_host.num_voxels());
        all.prepare([](auto& fb) { vp::core::for_each_index<8>([&]<std::size_t I>() { vp::get<I>(fb).load(); }); });
        all.draw({more}, whole, vp::coverage::thin, "the whole, loaded");
    }
}

TEST(DeviceSparse, LimitsChangeNothing) {
    const glm::ivec3 extent{30, 30, 30};
    const vp::grid grid = unit::unit_grid(extent);
    const unit::small_mesh mesh = unit::make_mesh(5, 10, extent);
    pair p(extent);
    p.draw({mesh}, grid, vp::coverage::thin, "drawn");
    const std::uint64_t bricks = p.on_device.num_bricks(), voxels = p.on_device.num_voxels();
    p.on_device.limit({bricks, voxels - 1});
    const vp::mesh<vp::cuda_backend> there(p.device, mesh.positions, mesh.triangles);
    const vp::status s =
        vp::voxelize(p.device, there, grid, vp::passthrough{}, shader{}, p.on_device, vp::coverage::thin);
    EXPECT_EQ(s.code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(s.required.bricks, bricks);
    EXPECT_EQ(s.required.voxels, voxels);
    p.compare("limited");
}

__global__ void find_by_hash(const vp::brick_lookup lookup, const vp::brick_table table, std::uint64_t* ranks) {
    const int x = static_cast<int>(threadIdx.x), y = static_cast<int>(blockIdx.x);
    for (int z = 0; z < table.extent.z; ++z)
        if (x < table.extent.x) ranks[(z * table.extent.y + y) * table.extent.x + x] = lookup.find(table, {x, y, z});
}

TEST(DeviceSparse, LookupsByHashFindTheRanks) {
    const glm::ivec3 extent{40, 33, 29};
    pair p(extent);
    p.draw({unit::make_mesh(21, 12, extent)}, unit::unit_grid(extent), vp::coverage::thin, "drawn");
    const vp::brick_slots slots{p.device, p.on_device};
    vp::cuda_backend::buffer<std::uint64_t> ranks(p.device, static_cast<std::size_t>(40 * 33 * 29));
    find_by_hash<<<33, 64, 0, p.device.stream>>>(slots.lookup(), p.on_device.view().table, ranks.data());
    const std::vector<std::uint64_t> found = ranks.to_host(p.device);
    const auto host = p.on_host.to_host(p.host);
    unit::for_each_voxel(extent, [&](int x, int y, int z) {
        ASSERT_EQ(found[unit::linear(extent, {x, y, z})], host.table().find({x, y, z}));
    });
}

// Nodes, graphs, values of levels by every reducer, and rays.
TEST(DeviceSparse, OctreesAreTheCpus) {
    const glm::ivec3 extent{45, 34, 37};
    pair p(extent);
    static_cast<void>(octree_cases::compare_nodes(p.device, p.on_device, p.on_host.to_host(p.host)));
    p.prepare([](auto& fb) { fb.template keep_sums<2>(); });
    p.draw({unit::make_mesh(1, 25, extent)}, unit::unit_grid(extent), vp::coverage::conservative, "drawn");
    const auto host = p.on_host.to_host(p.host);
    const auto tree = octree_cases::compare_nodes(p.device, p.on_device, host);
    const auto compare = [&]<std::size_t I, class Reducer>(const Reducer& reducer, const char* what) {
        octree_cases::compare_levels<I>(p.device, tree, p.on_device, host, reducer, what);
    };
    compare.template operator()<0>(vp::reduce::bit_or{}, "or of bits");
    compare.template operator()<1>(vp::reduce::max{}, "max");
    compare.template operator()<1>(octree_cases::middle{}, "the caller's");
    compare.template operator()<2>(vp::reduce::sum{}, "sum of kept sums");
    compare.template operator()<2>(vp::reduce::mean<6>{}, "mean of kept sums");
    compare.template operator()<3>(vp::reduce::mean_of_voxels{}, "mean of voxels, of planes of doubles");
    compare.template operator()<4>(vp::reduce::mean_of_volume{}, "mean of the volume, of integers");
    compare.template operator()<5>(vp::reduce::min{}, "min of halfs");
    compare.template operator()<4>(vp::reduce::majority{}, "majority");

    // Twenty levels.
    unit::small_mesh mesh = unit::make_mesh(4, 15, {40, 40, 40});
    for (glm::vec3& v : mesh.positions) v += glm::vec3(65000, 30001, 20007);
    const vp::grid far = unit::unit_grid({1 << 20, 1 << 20, 1 << 20}).crop({64990, 29999, 20003}, {45, 41, 46});
    pair q(far.extent);
    q.draw({mesh}, far, vp::coverage::conservative, "a crop");
    EXPECT_EQ(octree_cases::compare_nodes(q.device, q.on_device, q.on_host.to_host(q.host)).num_levels(), 20);
}

// Slabs of several GPUs (slabs/devices.cuh), joined: of surfaces and of solids.
TEST(DeviceSparse, SlabsOfSeveralGpusAreTheCpus) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid grid = unit::unit_grid(extent);
    const unit::small_mesh mesh = unit::make_mesh(14, 25, extent);
    for (const bool is_solid : {false, true}) {
        SCOPED_TRACE(is_solid ? "solid" : "surface");
        vp::slabs::devices gpus({0, 0, 0}, false);
        vp::slabs::device_options options;
        options.is_solid = is_solid;
        vp::slabs::device_slabs slabs(gpus, grid, mesh.view(), vp::passthrough{}, options);
        auto parts = slabs.make([](vp::cuda_backend& gpu, glm::ivec3 part) {
            return framebuffer<vp::cuda_backend>{gpu, part};
        });
        vp::cpu_backend host{2};
        const vp::mesh<vp::cpu_backend> on_host{host, mesh.positions, mesh.triangles};
        framebuffer<vp::cpu_backend> expected{host, extent};
        const vp::status a = is_solid ? slabs.draw_solid(solid_shader{}, parts) : slabs.draw(shader{}, parts);
        const vp::status b = is_solid
                                 ? vp::voxelize_solid(host, on_host, grid, vp::passthrough{}, solid_shader{}, expected)
                                 : vp::voxelize(host, on_host, grid, vp::passthrough{}, shader{}, expected);
        ASSERT_TRUE(a.ok() && b.ok()) << a.message() << "; " << b.message();
        EXPECT_EQ(a.counts, b.counts);
        std::vector<decltype(expected.to_host(host))> on_gpus;
        for (std::size_t i = 0; i < parts.size(); ++i) on_gpus.push_back(parts[i].to_host(gpus.backend(i)));
        EXPECT_TRUE(vp::same_contents(vp::merge(std::span<const decltype(expected.to_host(host))>(on_gpus)),
                                      expected.to_host(host)));
        EXPECT_GT(expected.num_voxels(), 500u);
    }
    vp::slabs::devices gpus({0}, false);
    vp::slabs::device_slabs surfaces(gpus, grid, mesh.view(), vp::passthrough{});
    std::vector<framebuffer<vp::cuda_backend>> none;
    EXPECT_EQ(surfaces.draw_solid(solid_shader{}, none).code, vp::status_code::bad_solid_options);
    vp::slabs::device_options for_solids;
    for_solids.is_solid = true;
    vp::slabs::device_slabs solids(gpus, grid, mesh.view(), vp::passthrough{}, for_solids);
    EXPECT_EQ(solids.draw(shader{}, none).code, vp::status_code::bad_solid_options);
}
