// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse framebuffers of constant shaders on the device, whose masks are drawn by a raster: the bytes of cpu_backend,
// in whole grids and in crops that begin anywhere, and the memory that a call takes.

#include "device_test.hpp"
#include "sparse_pairs.hpp"

#include <voxelpipe/slabs/devices.cuh>

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <span>
#include <vector>

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

// Constant shaders: masks by the raster. In whole grids, crops that begin on bricks, within them, and at the end; in
// grids that need nodes, or groups of them.
TEST(DeviceSparseMasks, GiveTheBytesOfTheCpu) {
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
TEST(DeviceSparseMasks, PartsThatCutNodesGiveTheBytesOfTheCpu) {
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
TEST(DeviceSparseMasks, NodesWithoutBricksLeaveNothing) {
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
TEST(DeviceSparseMasks, LargeTrianglesGiveTheBytesOfTheCpu) {
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
TEST(DeviceSparseMasks, TakeLittleMemoryBesideTheResult) {
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
