// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse framebuffers on the device: the bytes of cpu_backend, for every blend, clear and load and off, kept sums,
// crops, several draws, and grids beyond 32-bit cells.

#include "../sparse/merge_cases.hpp"
#include "../sparse/octree_cases.hpp"
#include "api_model.hpp"
#include "async_lists.hpp"
#include "device_test.hpp"
#include "sparse_pairs.hpp"
#include "subset_meshes.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

namespace {

using namespace sparse_pairs;

// Notes the most bytes that were live.
struct peak_resource : device_test::counting_resource {
    std::size_t peak = 0;
    void* allocate_async(std::size_t bytes, std::size_t alignment, cudaStream_t stream) {
        void* const p = device_test::counting_resource::allocate_async(bytes, alignment, stream);
        peak = std::max(peak, live);
        return p;
    }
};

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

// Constant shaders: masks by the raster. In whole grids, crops that begin on bricks, within them, and at the end; in
// grids that need nodes, or groups of them.
TEST(DeviceSparse, ConstantShadersGiveTheBytesOfTheCpu) {
    const glm::ivec3 extent{61, 50, 53};
    const vp::grid whole = unit::unit_grid(extent);
    const std::vector<unit::small_mesh> meshes{unit::make_mesh(11, 60, extent), unit::make_mesh(12, 25, extent)};
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative})
        for (const vp::grid& g : {whole, whole.crop({8, 16, 24}, {40, 19, 21}), whole.crop({13, 5, 3}, {31, 45, 46}),
                                  whole.crop({52, 30, 0}, {9, 20, 53})}) {
            constant_pair p(g.extent);
            p.prepare([](auto& fb) {
                vp::get<2>(fb).clear(0.7f);
                vp::get<4>(fb).off();
                vp::get<6>(fb).clear(1u << 20);
            });
            p.draw(meshes, g, rule, "cleared", constant_shader);
            EXPECT_GT(p.on_host.num_voxels(), 10u);
            p.prepare([](auto& fb) { vp::get<2>(fb).load(); });
            p.draw({unit::make_mesh(13, 20, extent)}, g, rule, "loaded", constant_shader);
        }
    for (const int side : {4096, 65536, 1 << 17}) {
        const vp::grid large = unit::unit_grid({side, side, side});
        std::vector<unit::small_mesh> moved{unit::make_mesh(14, 25, {40, 40, 40}), unit::make_mesh(15, 3, {300, 9, 9})};
        for (unit::small_mesh& m : moved)
            for (glm::vec3& q : m.positions) q += glm::vec3(static_cast<float>(side - 400), 1920, 250);
        for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
            constant_pair all(large.extent);
            all.draw(moved, large, rule, "a large grid", constant_shader);
            EXPECT_GT(all.on_host.num_voxels(), 300u);
            const vp::grid part = large.crop({side - 411, 1901, 249}, {211, 133, 100});
            constant_pair few(part.extent);
            few.draw(moved, part, rule, "a crop of it", constant_shader);
            EXPECT_GT(few.on_host.num_voxels(), 100u);
        }
    }
}

// Nodes of 128^3 and groups of 2048^3 voxels, which parts of a grid cut anywhere: around a corner of eight of each, on
// bricks and within them, beginning or ending on the corner; then slabs of several GPUs, which are cut the same way.
TEST(DeviceSparse, PartsThatCutNodesGiveTheBytesOfTheCpu) {
    using bits = vp::target<vp::bit, blend::bit_or>;
    for (const int side : {4096, 65536, 1 << 17}) {
        SCOPED_TRACE(side);
        const vp::grid whole = unit::unit_grid({side, side, side});
        const glm::ivec3 corner{side / 2, 2048, side - 2048};
        unit::small_mesh mesh = unit::make_mesh(61, 25, {40, 40, 40});
        const unit::small_mesh large = unit::make_mesh(62, 3, {300, 30, 30});
        for (const glm::uvec3& t : large.triangles)
            mesh.triangles.push_back(t + static_cast<unsigned>(mesh.positions.size()));
        mesh.positions.insert(mesh.positions.end(), large.positions.begin(), large.positions.end());
        for (glm::vec3& p : mesh.positions) p += glm::vec3(corner - 20);
        struct {
            glm::ivec3 begin, extent; // from the corner on
        } const parts[]{{{-17, -13, -9}, {40, 31, 23}},
                        {{-24, -8, -16}, {40, 24, 48}},
                        {{-16, 0, -8}, {33, 17, 14}},
                        {{-128, -128, -128}, {200, 131, 137}},
                        {{3, -20, 0}, {37, 20, 19}}};
        for (const auto& part : parts) {
            const vp::grid g = whole.crop(corner + part.begin, part.extent);
            constant_pair p(g.extent);
            p.draw({mesh}, g, vp::coverage::conservative, "a part", constant_shader);
            EXPECT_GT(p.on_host.num_voxels(), 100u);
        }
        vp::cpu_backend host{2};
        const vp::mesh<vp::cpu_backend> on_host{host, mesh.positions, mesh.triangles};
        vp::sparse_framebuffer<vp::cpu_backend, bits> expected{host, whole.extent};
        const vp::status b = vp::voxelize(host, on_host, whole, vp::passthrough{}, vp::constant(true), expected);
        for (const int align : {1, 8, 128}) {
            vp::slabs::devices gpus({0, 0, 0}, false);
            vp::slabs::device_options options;
            options.align = align;
            vp::slabs::device_slabs slabs(gpus, whole, mesh.view(), vp::passthrough{}, options);
            auto parts_of = slabs.make([](vp::cuda_backend& gpu, glm::ivec3 part) {
                return vp::sparse_framebuffer<vp::cuda_backend, bits>{gpu, part};
            });
            EXPECT_GT(parts_of.size(), 1u);
            const vp::status a = slabs.draw(vp::constant(true), parts_of);
            ASSERT_TRUE(a.ok() && b.ok()) << a.message() << "; " << b.message();
            EXPECT_EQ(a.counts, b.counts);
            std::vector<vp::host_sparse<bits>> on_gpus;
            for (std::size_t i = 0; i < parts_of.size(); ++i) on_gpus.push_back(parts_of[i].to_host(gpus.backend(i)));
            EXPECT_TRUE(
                vp::same_contents(vp::merge(std::span<const vp::host_sparse<bits>>(on_gpus)), expected.to_host(host)));
        }
    }
}

// A node is marked because of a triangle beside the part of the grid, and has no brick.
TEST(DeviceSparse, NodesWithoutBricksLeaveNothing) {
    const vp::grid whole = unit::unit_grid({4096, 4096, 4096});
    const vp::grid g = whole.crop({2056, 2056, 2056}, {16, 19, 24});
    unit::small_mesh mesh = unit::make_mesh(63, 9, {30, 30, 30});
    for (glm::vec3& p : mesh.positions) p += glm::vec3(2100);
    constant_pair p(g.extent);
    p.draw({mesh}, g, vp::coverage::conservative, "beside the part", constant_shader);
    EXPECT_EQ(p.on_device.num_bricks(), 0u);

    vp::cuda_backend be;
    const vp::mesh<vp::cuda_backend> on_device(be, mesh.positions, mesh.triangles);
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, decltype(vp::constant(true))>;
    const draw_type one{on_device.view(), {}, vp::constant(true)};
    const std::span<const draw_type> draws(&one, 1);
    vp::sparse_result<vp::target<vp::bit, blend::bit_or>> result;
    vp::workspace_limits limits{}, need{};
    const vp::voxelize_options options{vp::coverage::conservative};
    const auto run = [&] {
        const std::size_t bytes = vp::workspace_bytes(draws, g, result, options, limits);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        EXPECT_TRUE(vp::voxelize_async(be, draws, g, result, options, workspace).ok());
        const vp::status s = vp::read_status(be, workspace, &need);
        EXPECT_EQ(result.to_host(be).num_bricks(), 0u);
        return s;
    };
    EXPECT_EQ(run().code, vp::status_code::capacity_exceeded);
    EXPECT_EQ(need.nodes, 1u);
    EXPECT_EQ(need.bricks, 0u);
    limits = need;
    EXPECT_TRUE(run().ok());
}

// Triangles that pass through a part of a large grid: longer than 64 bits hold, and longer than the grid's size twice,
// so that each is a floor, a wall or a slope there; with many small ones. The part begins on a brick.
TEST(DeviceSparse, LargeTrianglesGiveTheBytesOfTheCpu) {
    for (const int side : {4096, 65536, 1 << 17}) {
        const vp::grid whole = unit::unit_grid({side, side, side});
        const glm::ivec3 offset{side - 416, 1896, 248};
        const vp::grid part = whole.crop(offset, {88, 72, 61});
        unit::small_mesh mesh = unit::make_mesh(51, 40, {80, 60, 60});
        for (glm::vec3& q : mesh.positions) q += glm::vec3(offset);
        const glm::vec3 middle = glm::vec3(offset) + glm::vec3(40.3f, 33.1f, 29.7f);
        for (const float length : {60.0f, 1000.0f, static_cast<float>(side) * 0.9f, static_cast<float>(side) * 3.0f})
            for (int k = 0; k < 4; ++k) {
                const glm::vec3 slopes[4] = {{0.02f, 1.0f, 0.3f}, {1.0f, -0.7f, 0.01f}, {0.3f, 0.2f, -1.0f}, {1, 1, 1}};
                const glm::vec3 n = glm::normalize(slopes[k]),
                                a = glm::normalize(glm::cross(n, glm::vec3(0.1f, 0.7f, 0.2f))), b = glm::cross(n, a);
                const auto first = static_cast<std::uint32_t>(mesh.positions.size());
                mesh.positions.push_back(middle + length * (0.5f * a + 0.1f * b));
                mesh.positions.push_back(middle + length * (-0.3f * a + 0.4f * b));
                mesh.positions.push_back(middle + length * (-0.2f * a - 0.5f * b));
                mesh.triangles.emplace_back(first, first + 1, first + 2);
            }
        constant_pair p(part.extent);
        p.draw({mesh}, part, vp::coverage::conservative, "a part of a large grid", constant_shader);
        EXPECT_GT(p.on_host.num_voxels(), 10000u);
    }
}

// Beside the result a call takes 20 bytes a triangle and no setups.
TEST(DeviceSparse, ConstantShadersTakeLittleMemoryBesideTheResult) {
    const glm::ivec3 extent{256, 256, 256};
    const vp::grid grid = unit::unit_grid(extent);
    for (const float size : {1.0f, 5.0f}) {
        std::mt19937 random{7};
        std::uniform_real_distribution<float> place(1.0f, 250.0f), side(0.0f, size);
        unit::small_mesh mesh;
        constexpr std::uint32_t triangles = 9000;
        for (std::uint32_t i = 0; i < 3 * triangles; i += 3) {
            const glm::vec3 at(place(random), place(random), place(random));
            for (int k = 0; k < 3; ++k) mesh.positions.push_back(at + glm::vec3(side(random), side(random), size));
            mesh.triangles.emplace_back(i, i + 1, i + 2);
        }
        peak_resource memory;
        {
            device_test::stream_owner owner;
            vp::cuda_backend gpu{owner.stream, memory};
            const vp::mesh<vp::cuda_backend> on_device(gpu, mesh.positions, mesh.triangles);
            vp::sparse_framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_or>> fb(gpu, extent);
            const std::size_t before = memory.live;
            memory.peak = before;
            const vp::status s = vp::voxelize(gpu, on_device, grid, vp::passthrough{}, vp::constant(true), fb);
            ASSERT_TRUE(s.ok()) << s.message();
            EXPECT_GT(fb.num_voxels(), triangles);
            const std::size_t lists = 20 * triangles, index = std::size_t{1} << 14;
            EXPECT_LE(memory.peak - before, lists + fb.num_bytes() + 8 * fb.num_bricks() + index);
            EXPECT_GT(memory.peak - before, fb.num_bytes());
        }
        EXPECT_EQ(memory.live, 0u);
    }
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

namespace {

// Calls in the caller's memory: with too little room, until read_status has said what suffices; then captured, and
// replayed with other vertices. The CPU's bytes each time.
template <class Pair, std::size_t Targets, class Shader>
void expect_bounded(Pair& p, const unit::small_mesh& mesh, const unit::small_mesh& moved, const vp::grid& g,
                    vp::coverage rule, const Shader& shade) {
    const device_test::stream_owner stream;
    vp::cuda_backend be{stream.stream};
    vp::mesh<vp::cuda_backend> owner(be, mesh.positions, mesh.triangles);
    const auto view = owner.view();
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    const draw_type d{view, {}, shade};
    const std::span<const draw_type> draws(&d, 1);
    typename result_of<std::remove_cvref_t<decltype(p.on_device)>>::type result;
    const auto clear = [&](auto& values) { vp::get<2>(values) = 0.75f; };
    clear(result.clear_values);
    vp::get<2>(p.on_host).clear(0.75f);
    const auto compare = [&](const unit::small_mesh& m, const vp::status& s) {
        ASSERT_TRUE(s.ok()) << s.message();
        const vp::mesh<vp::cpu_backend> here(p.host, m.positions, m.triangles);
        const vp::status expected = vp::voxelize(p.host, here.view(), g, vp::passthrough{}, shade, p.on_host, rule);
        ASSERT_TRUE(expected.ok()) << expected.message();
        EXPECT_EQ(s.counts, expected.counts);
        const auto a = result.to_host(be);
        const auto b = p.on_host.to_host(p.host);
        EXPECT_GT(b.num_voxels(), 50u);
        EXPECT_EQ(a.keys, b.keys);
        EXPECT_TRUE(a.masks == b.masks);
        EXPECT_EQ(a.offsets, b.offsets);
        vp::core::for_each_index<Targets>([&]<std::size_t I>() {
            EXPECT_TRUE(unit::same_bytes(vp::get<I>(a.values), vp::get<I>(b.values))) << "target " << I;
        });
    };
    vp::workspace_limits limits{}, need{};
    limits.bricks = 1;
    vp::status s;
    int tries = 0;
    for (;; ++tries) {
        ASSERT_LT(tries, 8);
        const std::size_t bytes = vp::workspace_bytes(draws, g, result, {rule}, limits);
        ASSERT_GT(bytes, 0u);
        const device_test::guarded_memory memory(be, bytes);
        // What an earlier call left.
        ASSERT_EQ(cudaMemsetAsync(const_cast<unsigned char*>(memory.memory.data()), 0xa5, bytes, be.stream),
                  cudaSuccess);
        const vp::workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), bytes, limits};
        EXPECT_EQ(
            vp::voxelize_async(be, draws, g, result, {rule}, {workspace.memory, bytes - 1, limits}).required.bytes,
            bytes);
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, result, {rule}, workspace).ok());
        s = vp::read_status(be, workspace, &need);
        memory.expect_untouched_behind(be);
        if (s.ok()) {
            compare(mesh, s);
            break;
        }
        ASSERT_EQ(s.code, vp::status_code::capacity_exceeded) << s.message();
        const auto nothing = result.to_host(be);
        EXPECT_EQ(nothing.num_bricks(), 0u);
        EXPECT_EQ(nothing.num_voxels(), 0u);
        limits = need;
    }
    EXPECT_GT(tries, 1);
    EXPECT_EQ(limits.bricks, p.on_host.num_bricks());
    EXPECT_EQ(limits.voxels, p.on_host.num_voxels());
    limits.bricks += 300; // for the other pose
    limits.voxels += 30000;
    limits.nodes += 60;
    limits.fragment_records += 4000;
    limits.fragments = limits.fragments == 0 ? 0 : limits.fragments + 60000;
    const std::size_t bytes = vp::workspace_bytes(draws, g, result, {rule}, limits);
    vp::cuda_backend::buffer<std::byte> memory(be, bytes);
    const vp::workspace_view workspace{memory.data(), bytes, limits};
    const device_test::captured_graph graph(
        be.stream, [&] { return vp::voxelize_async(be, draws, g, result, {rule}, workspace); });
    for (const unit::small_mesh* m : {&moved, &mesh}) {
        ASSERT_EQ(cudaMemcpyAsync(const_cast<glm::vec3*>(view.positions.data()), m->positions.data(),
                                  m->positions.size() * sizeof(glm::vec3), cudaMemcpyDefault, be.stream),
                  cudaSuccess);
        graph.launch(be.stream);
        compare(*m, vp::read_status(be, workspace));
    }
}

} // namespace

TEST(DeviceSparse, InMemoryOfTheCaller) {
    struct {
        vp::grid whole;
        glm::vec3 by; // the meshes are moved
    } const grids[]{{unit::unit_grid({61, 50, 53}), glm::vec3(0)},
                    {unit::unit_grid({61, 50, 53}).crop({8, 16, 24}, {40, 19, 21}), glm::vec3(0)},
                    {unit::unit_grid({4096, 4096, 4096}), glm::vec3(3690, 1900, 250)},
                    {unit::unit_grid({4096, 4096, 4096}).crop({3696, 1904, 248}, {48, 40, 40}), {3690, 1900, 230}},
                    {unit::unit_grid({4096, 4096, 4096}).crop({3691, 1904, 249}, {57, 39, 46}), {3690, 1900, 230}},
                    {unit::unit_grid(glm::ivec3(1 << 17)), glm::vec3(130000, 1900, 65500)}};
    for (const auto& [g, by] : grids) {
        unit::small_mesh mesh = unit::make_mesh(31, 45, {61, 50, 53}), moved = unit::make_mesh(32, 45, {61, 50, 53});
        moved.triangles = mesh.triangles;
        moved.positions.resize(mesh.positions.size(), glm::vec3(3));
        for (unit::small_mesh* m : {&mesh, &moved})
            for (glm::vec3& q : m->positions) q += by;
        for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
            pair p(g.extent);
            expect_bounded<pair, 8>(p, mesh, moved, g, rule, shader{});
            constant_pair constants(g.extent);
            expect_bounded<constant_pair, 7>(constants, mesh, moved, g, rule, constant_shader);
        }
    }
}

// Without triangles, and with a mesh whose index names no vertex, nothing is left.
TEST(DeviceSparse, InMemoryOfTheCallerWithoutVoxels) {
    vp::cuda_backend be;
    const vp::grid g = unit::unit_grid({40, 40, 40});
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, decltype(vp::constant(true))>;
    vp::sparse_result<vp::target<vp::bit, blend::bit_or>> result;
    vp::workspace_limits limits{};
    limits.bricks = 200;
    limits.voxels = 20000;
    const auto run = [&](const draw_type& d) {
        const std::span<const draw_type> draws(&d, 1);
        const std::size_t bytes = vp::workspace_bytes(draws, g, result, {}, limits);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        EXPECT_TRUE(vp::voxelize_async(be, draws, g, result, {}, workspace).ok());
        const vp::status s = vp::read_status(be, workspace);
        EXPECT_EQ(result.to_host(be).num_bricks(), 0u);
        EXPECT_EQ(result.to_host(be).num_voxels(), 0u);
        return s;
    };
    EXPECT_TRUE(run({}).ok());
    unit::small_mesh mesh = unit::make_mesh(33, 20, g.extent);
    mesh.triangles[11].y = 100000;
    const vp::cuda_backend::buffer<glm::vec3> positions(be, vp::array_view<const glm::vec3>(mesh.positions));
    const vp::cuda_backend::buffer<glm::uvec3> triangles(be, vp::array_view<const glm::uvec3>(mesh.triangles));
    const draw_type bad{{positions.view(), triangles.view(), {}}, {}, vp::constant(true)};
    EXPECT_EQ(run(bad).code, vp::status_code::index_out_of_range);
}

TEST(DeviceSparse, SolidsGiveTheBytesOfTheCpu) {
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
TEST(DeviceSparse, TilesAreTheCpus) {
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
          vp::solid_options{.repair = vp::repair::vote}}) {
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

TEST(DeviceSparse, MergedSlabsHaveTheTilesOfTheWhole) {
    vp::cuda_backend backend;
    merge_cases::slabs_are_the_whole(backend, 5); // 1, 7, 3 and 3 slabs
}

TEST(DeviceSparse, OtherTilesStayWhenMerged) {
    vp::cuda_backend backend;
    merge_cases::other_tiles_stay(backend);
}

// Solids in memory of the caller: too little room first, then a graph that is replayed with moved vertices. Shaded and
// constant, with tiles, the bytes are those of a sparse framebuffer.
TEST(DeviceSparse, SolidsInMemoryOfTheCaller) {
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
}
