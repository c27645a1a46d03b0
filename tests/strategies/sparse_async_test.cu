// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Sparse calls that never wait: in memory of the caller, with too little of it at first, and in a CUDA graph, the bytes
// of cpu_backend.

#include "async_lists.hpp"
#include "device_test.hpp"
#include "sparse_pairs.hpp"

#include <gtest/gtest.h>

#include <span>
#include <vector>

namespace {

using namespace sparse_pairs;

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

TEST(DeviceSparseAsync, InMemoryOfTheCaller) {
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
TEST(DeviceSparseAsync, InMemoryOfTheCallerWithoutVoxels) {
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
