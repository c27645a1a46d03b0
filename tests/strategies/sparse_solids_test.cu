// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Solids in sparse framebuffers on the device: the bytes of cpu_backend, tiles included, in calls that wait and in
// calls in memory of the caller.

#include "../sparse/merge_cases.hpp"
#include "../sparse/octree_cases.hpp"
#include "async_lists.hpp"
#include "device_test.hpp"
#include "sparse_pairs.hpp"

#include <gtest/gtest.h>

#include <span>
#include <vector>

namespace {

using namespace sparse_pairs;

} // namespace

TEST(DeviceSparseSolids, GiveTheBytesOfTheCpu) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid grid = unit::unit_grid(extent);
    // Open, as random triangles are: rows have windings of all kinds.
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(6, 12, extent), unit::make_mesh(7, 9, extent)};
    for (const vp::bodies bodies : {vp::bodies::call, vp::bodies::draw})
        for (const vp::solid_options& o :
             {vp::solid_options{.rule = vp::fill_rule::even_odd, .bodies = bodies},
              vp::solid_options{.bodies = bodies, .extent = vp::solid_extent::outer},
              vp::solid_options{
                  .rule = vp::fill_rule::positive, .bodies = bodies, .extent = vp::solid_extent::inner}}) {
            pair p(extent);
            p.draw_solid(meshes, grid, o, "cleared");
            EXPECT_GT(p.on_host.num_voxels(), 500u);
            p.prepare([](auto& fb) {
                vp::core::for_each_index<8>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
                vp::get<2>(fb).clear(1.5f);
                fb.template keep_sums<2>();
            });
            p.draw_solid({unit::make_mesh(8, 9, extent)}, grid, o, "loaded");
        }
    const vp::grid part = grid.crop({19, 5, 3}, {21, 27, 33});
    pair p(part.extent);
    p.draw_solid(meshes, part, {.extent = vp::solid_extent::outer}, "a crop");
}

// Solids of one value: tiles, by the rows' runs. Closed boxes, an open mesh whose rows reach the end of the grid,
// several bodies, every extent and repair, crops, grids with groups of nodes, and calls that load onto tiles.
TEST(DeviceSparseSolids, TilesAreTheCpus) {
    const glm::ivec3 extent{67, 40, 36};
    const vp::grid grid = unit::unit_grid(extent);
    std::vector<unit::small_mesh> meshes(2);
    add_box(meshes[0], {2.5f, 3, 0}, {66, 39, 34.7f});
    add_box(meshes[0], {40, 20, 20}, {47, 27, 31});
    add_box(meshes[1], {50.2f, -5, 9}, {140, 20, 90});
    meshes.push_back(unit::make_mesh(6, 4, extent));
    const auto bits_and_labels = [](auto& fb) {
        vp::get<2>(fb).clear(0.7f);
        vp::get<4>(fb).off();
        vp::get<6>(fb).clear(1u << 20);
    };
    for (const vp::solid_options& o :
         {vp::solid_options{.rule = vp::fill_rule::even_odd}, vp::solid_options{.extent = vp::solid_extent::outer},
          vp::solid_options{.extent = vp::solid_extent::inner, .repair = vp::repair::close_holes},
          vp::solid_options{.repair = vp::repair::vote}, vp::solid_options{.repair = vp::repair::winding}}) {
        constant_pair p(extent);
        p.prepare(bits_and_labels);
        p.draw_solid(meshes, grid, o, "one body", constant_shader);
        EXPECT_GT(p.on_host.num_tiles(), 5u);
    }
    constant_pair p(extent);
    p.draw_solid({meshes[0]}, grid, vp::each_draw, "a draw", constant_shader);
    const std::uint64_t tiles = p.on_host.num_tiles();
    EXPECT_GT(tiles, 5u);
    const auto tree = octree_cases::compare_nodes(p.device, p.on_device, p.on_host.to_host(p.host));
    octree_cases::compare_levels<3>(p.device, tree, p.on_device, p.on_host.to_host(p.host), vp::reduce::sum{}, "sum");
    octree_cases::compare_levels<5>(p.device, tree, p.on_device, p.on_host.to_host(p.host), vp::reduce::max{}, "max");
    p.prepare([](auto& fb) {
        vp::core::for_each_index<7>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
        vp::get<2>(fb).clear(1.5f);
        vp::get<0>(fb).off();
        fb.template keep_sums<2>();
    });
    p.draw({unit::make_mesh(13, 3, extent)}, grid, vp::coverage::thin, "a surface on tiles", constant_shader);
    EXPECT_GT(p.on_host.num_tiles(), 0u);
    unit::small_mesh small;
    add_box(small, {30, 18, 20}, {39, 27, 24});
    p.draw_solid({small}, grid, {}, "a solid on tiles", constant_shader);
    EXPECT_GT(p.on_host.num_tiles(), 0u);
    // Counts of bodies have no tiles.
    constant_pair counted(extent);
    counted.draw_solid(meshes, grid, vp::each_draw, "bodies", constant_shader);
    EXPECT_EQ(counted.on_host.num_tiles(), 0u);

    const vp::grid part = grid.crop({11, 5, 3}, {50, 34, 30});
    constant_pair q(part.extent);
    q.draw_solid(meshes, part, {.extent = vp::solid_extent::outer}, "a crop", constant_shader);
    EXPECT_GT(q.on_host.num_tiles(), 0u);
    for (unit::small_mesh& m : meshes)
        for (glm::vec3& v : m.positions) v += glm::vec3(1000000, 1900, 65500);
    const vp::grid far = unit::unit_grid(glm::ivec3(1 << 20)).crop({1000003, 1901, 65504}, {60, 36, 30});
    constant_pair r(far.extent);
    r.draw_solid(meshes, far, {}, "far away", constant_shader);
    EXPECT_GT(r.on_host.num_tiles(), 0u);
}

TEST(DeviceSparseSolids, MergedSlabsHaveTheTilesOfTheWhole) {
    vp::cuda_backend backend;
    merge_cases::slabs_are_the_whole(backend, 5); // 1, 7, 3 and 3 slabs
}

TEST(DeviceSparseSolids, OtherTilesStayWhenMerged) {
    vp::cuda_backend backend;
    merge_cases::other_tiles_stay(backend);
}

// Solids in memory of the caller: too little room first, then a graph that is replayed with moved vertices. Shaded and
// constant, with tiles, the bytes are those of a sparse framebuffer.
TEST(DeviceSparseSolids, InMemoryOfTheCaller) {
    const glm::ivec3 extent{45, 34, 37};
    const vp::grid grid = unit::unit_grid(extent);
    unit::small_mesh mesh = unit::make_mesh(6, 12, extent), other = unit::make_mesh(7, 9, extent);
    add_box(mesh, {3, 2, 4}, {38, 31, 30});
    for (const vp::solid_options& o :
         {vp::solid_options{}, vp::solid_options{.bodies = vp::bodies::draw, .extent = vp::solid_extent::outer}}) {
        const device_test::stream_owner stream;
        vp::cuda_backend be{stream.stream};
        const vp::mesh<vp::cuda_backend> a(be, mesh.positions, mesh.triangles), b(be, other.positions, other.triangles);
        const auto run = [&](auto& p, const auto& shade) {
            using shader_type = std::remove_cvref_t<decltype(shade)>;
            using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, shader_type>;
            const std::vector<draw_type> draws{{a.view(), {}, shade}, {b.view(), {}, shade}};
            const std::span<const draw_type> all(draws);
            typename result_of<std::remove_cvref_t<decltype(p.on_device)>>::type result;
            const auto expect_same = [&](const glm::vec3& by, const vp::status& s) {
                ASSERT_TRUE(s.ok()) << s.message();
                unit::small_mesh first = mesh;
                for (glm::vec3& v : first.positions) v += by;
                const std::vector<draw_type> here{{first.view(), {}, shade}, {other.view(), {}, shade}};
                const vp::status expected = vp::voxelize_solid(p.host, here, grid, p.on_host, o);
                ASSERT_TRUE(expected.ok()) << expected.message();
                EXPECT_EQ(s.counts, expected.counts);
                EXPECT_EQ(s.solid, expected.solid);
                const auto x = result.to_host(be);
                const auto y = p.on_host.to_host(p.host);
                EXPECT_GT(y.num_voxels(), 500u);
                EXPECT_EQ(x.num_voxels(), y.num_voxels());
                EXPECT_TRUE(vp::same_contents(x, y));
                EXPECT_EQ(x.is_tiled, y.is_tiled);
            };
            vp::workspace_limits limits{}, need{};
            limits.bricks = limits.voxels = 1;
            for (int tries = 0;; ++tries) {
                ASSERT_LT(tries, 8);
                const std::size_t bytes = vp::solid_workspace_bytes(all, grid, result, o, limits);
                ASSERT_GT(bytes, 0u);
                const device_test::guarded_memory memory(be, bytes);
                const vp::workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), bytes, limits};
                EXPECT_EQ(vp::voxelize_solid_async(be, all, grid, result, o, {workspace.memory, bytes - 1, limits})
                              .required.bytes,
                          bytes);
                ASSERT_TRUE(vp::voxelize_solid_async(be, all, grid, result, o, workspace).ok());
                const vp::status s = vp::read_status(be, workspace, &need);
                memory.expect_untouched_behind(be);
                if (s.ok()) {
                    EXPECT_GT(tries, 1);
                    expect_same(glm::vec3(0), s);
                    break;
                }
                ASSERT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
                EXPECT_EQ(result.to_host(be).num_voxels(), 0u);
                limits = need;
            }
            limits.bricks += 200;
            limits.voxels += 20000;
            limits.fragments *= 2;
            const std::size_t bytes = vp::solid_workspace_bytes(all, grid, result, o, limits);
            vp::cuda_backend::buffer<std::byte> memory(be, bytes);
            const vp::workspace_view workspace{memory.data(), bytes, limits};
            const device_test::captured_graph graph(
                be.stream, [&] { return vp::voxelize_solid_async(be, all, grid, result, o, workspace); });
            for (const glm::vec3& by : {glm::vec3(3, -2, 1), glm::vec3(0)}) {
                const unit::small_mesh moved = sparse_pairs::move_mesh(be, a, mesh, by);
                graph.launch(be.stream);
                expect_same(by, vp::read_status(be, workspace));
            }
        };
        pair p(extent);
        run(p, solid_shader{});
        constant_pair q(extent);
        run(q, constant_shader);
        EXPECT_EQ(q.on_host.num_tiles() != 0, o.bodies == vp::bodies::call); // counts of bodies have no tiles
    }
}
