// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Memory and launches: copies, the resource, streams, no wait in voxelize_async, graphs, workspaces, sizes of launches.

#include "computed_sum.hpp"

#include <algorithm>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

using bits = vp::target<vp::bit, blend::bit_or>;
using sum = vp::target<float, blend::add>;

// Copies of a target to the host: a box of it, and nothing more; and copies of page-locked memory to the device, whose
// owner may write to it as soon as the constructor returns.
TEST(Workspace, MemoryIsCopiedBothWays) {
    vp::cuda_backend be;
    const vp::grid g = box_grid({70, 20, 20});
    const mesh_data m = mixed_triangles(50, 20.0f, 31);
    const vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> sums{be, g.extent};
    vp::framebuffer<vp::cuda_backend, bits> words{be, g.extent};
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), sums).ok());
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), words).ok());
    const glm::ivec3 begin{3, 5, 7}, size{40, 9, 12};
    const auto check = [&](const auto& whole, const auto& part) {
        bool same = true;
        vp::for_each_voxel(part,
                           [&](glm::ivec3 v, const auto& value) { same = same && value == whole(v.x, v.y, v.z); });
        EXPECT_TRUE(same);
        EXPECT_EQ(part.last() - part.first(), size);
    };
    check(vp::get<0>(sums).to_host_target(be), vp::get<0>(sums).to_host_region(be, begin, size));
    check(vp::get<0>(words).to_host_target(be), vp::get<0>(words).to_host_region(be, begin, size));
    EXPECT_EQ(vp::bounds(be, mesh.view().positions), vp::bounds(m.positions));
    const std::vector<float> whole = vp::get<0>(sums).to_host(be);
    std::vector<float> kept(whole.size(), -1.0f);
    vp::get<0>(sums).to_host(be, kept);
    EXPECT_EQ(kept, whole);

    std::vector<float> source(std::size_t{1} << 22, 1.0f);
    ASSERT_EQ(cudaHostRegister(source.data(), source.size() * sizeof(float), 0), cudaSuccess);
    const vp::cuda_backend::buffer<float> copy(be, source);
    std::fill(source.begin(), source.end(), 2.0f);
    const std::vector<float> host = copy.to_host(be);
    EXPECT_EQ(std::count(host.begin(), host.end(), 1.0f), static_cast<std::ptrdiff_t>(host.size()));
    cudaHostUnregister(source.data());
    const vp::cuda_backend::buffer<float> again(be, copy.view()); // from device memory
    EXPECT_EQ(again.to_host(be), host);
}

TEST(Workspace, MemoryComesFromTheResource) {
    counting_resource resource;
    {
        vp::cuda_backend be{nullptr, resource};
        const mesh_data m = mixed_triangles(500, 20.0f, 32);
        const vp::grid g = box_grid({20, 20, 20});
        vp::mesh mesh{be, m.positions, m.triangles};
        vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
        EXPECT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb).ok());
        EXPECT_GT(resource.calls, 3);
        be.release();
        resource.limit = resource.live;
        const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb);
        EXPECT_EQ(s.code, vp::status_code::out_of_memory);
    }
    EXPECT_EQ(resource.live, 0u);
}

using one_draw = vp::draw<vp::mesh_view<>, vp::passthrough, computed>;

TEST(Workspace, TwoStreamsAtOnceAreIndependent) {
    const mesh_data m = mixed_triangles(4000, 60.0f, 37);
    const vp::grid g = box_grid({64, 64, 64});
    vp::counters counts;
    const auto expected = run_policy<vp::tuning::fine_raster_selector>(m, g, vp::coverage::conservative, counts);
    stream_owner streams[2];
    vp::cuda_backend first{streams[0].stream}, second{streams[1].stream};
    vp::cuda_backend* const backends[2] = {&first, &second};
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    std::vector<vp::framebuffer<vp::cuda_backend, sum>> fbs;
    std::vector<vp::cuda_backend::buffer<std::byte>> memory;
    std::vector<vp::workspace_view> views;
    auto limits = vp::workspace_limits::for_triangles(4 * m.triangles.size());
    for (vp::cuda_backend* be : backends) {
        limits.lists_fragments = be == &second;
        meshes.emplace_back(*be, m.positions, m.triangles);
        fbs.emplace_back(*be, g.extent);
        const one_draw d{meshes.back().view(), {}, computed{}};
        const std::size_t bytes =
            vp::workspace_bytes(std::span<const one_draw>(&d, 1), g, fbs.back().view(), {}, limits);
        ASSERT_GT(bytes, 0u);
        memory.emplace_back(*be, bytes);
        views.push_back({memory.back().data(), bytes, limits});
    }
    for (int round = 0; round < 5; ++round)
        for (int k = 0; k < 2; ++k) {
            const one_draw d{meshes[static_cast<std::size_t>(k)].view(), {}, computed{}};
            const vp::status s =
                vp::voxelize_async(*backends[k], std::span<const one_draw>(&d, 1), g,
                                   fbs[static_cast<std::size_t>(k)].view(), {}, views[static_cast<std::size_t>(k)]);
            ASSERT_TRUE(s.ok()) << s.message();
        }
    for (std::size_t k = 0; k < 2; ++k) {
        const vp::status s = vp::read_status(*backends[k], views[k]);
        ASSERT_TRUE(s.ok()) << s.message();
        expect_same_counts(counts, s.counts);
        expect_same_bytes(expected, vp::get<0>(fbs[k]).to_host(*backends[k]), "stream");
    }
}

void replay(bool lists) {
    stream_owner owner;
    vp::cuda_backend be{owner.stream};
    const mesh_data m = mixed_triangles(3000, 60.0f, 38), other = mixed_triangles(3000, 60.0f, 39);
    const vp::grid g = box_grid({64, 64, 64});
    vp::cuda_backend::buffer<glm::vec3> positions(be, vp::array_view<const glm::vec3>(m.positions));
    vp::cuda_backend::buffer<glm::uvec3> triangles(be, vp::array_view<const glm::uvec3>(m.triangles));
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const one_draw d{{positions.view(), triangles.view(), {}}, {}, computed{}};
    const std::span<const one_draw> draws(&d, 1);
    auto limits = vp::workspace_limits::for_triangles(4 * m.triangles.size());
    limits.lists_fragments = lists;
    limits.fragments *= 16; // some triangles are large
    const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
    vp::cuda_backend::buffer<std::byte> memory(be, bytes);
    const vp::workspace_view workspace{memory.data(), bytes, limits};

    cudaGraph_t graph = nullptr;
    cudaGraphExec_t instance = nullptr;
    ASSERT_EQ(cudaStreamBeginCapture(be.stream, cudaStreamCaptureModeGlobal), cudaSuccess);
    const vp::status captured = vp::voxelize_async(be, draws, g, fb.view(), {}, workspace);
    ASSERT_EQ(cudaStreamEndCapture(be.stream, &graph), cudaSuccess);
    ASSERT_TRUE(captured.ok()) << captured.message();
    ASSERT_EQ(cudaGraphInstantiate(&instance, graph, 0), cudaSuccess);
    for (const mesh_data* data : {&m, &other, &m}) {
        ASSERT_EQ(cudaMemcpyAsync(positions.data(), data->positions.data(), data->positions.size() * sizeof(glm::vec3),
                                  cudaMemcpyHostToDevice, be.stream),
                  cudaSuccess);
        ASSERT_EQ(cudaGraphLaunch(instance, be.stream), cudaSuccess);
        const vp::status s = vp::read_status(be, workspace);
        ASSERT_TRUE(s.ok()) << s.message();
        vp::counters counts;
        mesh_data expected{data->positions, m.triangles};
        const auto reference =
            run_policy<vp::tuning::fine_raster_selector>(expected, g, vp::coverage::conservative, counts);
        expect_same_counts(counts, s.counts);
        expect_same_bytes(reference, vp::get<0>(fb).to_host(be), "graph");
    }
    cudaGraphExecDestroy(instance);
    cudaGraphDestroy(graph);
}

TEST(Workspace, AGraphIsReplayedWithChangedVertices) {
    for (const bool lists : {false, true}) replay(lists);
}

void start_too_small(vp::workspace_limits limits) {
    vp::cuda_backend be;
    mesh_data m = mixed_triangles(3000, 60.0f, 40);
    const vp::grid g = box_grid({200, 200, 200});
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const one_draw d{mesh.view(), {}, computed{}};
    const std::span<const one_draw> draws(&d, 1);
    EXPECT_EQ(vp::voxelize_async(be, draws, g, fb.view(), {}, {nullptr, 0, limits}).code,
              vp::status_code::capacity_exceeded);
    cudaMemset(const_cast<float*>(vp::get<0>(fb).view().elements), 0x5a, 8000000 * sizeof(float));
    bool done = false;
    for (int tries = 0; tries < 5 && !done; ++tries) {
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
        const vp::status s = vp::read_status(be, workspace, &limits);
        done = s.ok();
        if (!done) {
            ASSERT_EQ(s.code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(s.where, limits.lists_fragments ? vp::stage::abuffer_emit : vp::stage::coarse_raster);
            EXPECT_GT(limits.lists_fragments ? s.required.fragments : s.required.tile_pairs, 10u);
            for (const float v : vp::get<0>(fb).to_host(be)) ASSERT_EQ(std::bit_cast<std::uint32_t>(v), 0x5a5a5a5au);
        }
    }
    ASSERT_TRUE(done);
    vp::counters counts;
    expect_same_bytes(run_policy<vp::tuning::fine_raster_selector>(m, g, vp::coverage::conservative, counts),
                      vp::get<0>(fb).to_host(be), "after retry");
}

TEST(Workspace, AWorkspaceThatIsTooSmallSaysWhatIsNeeded) {
    start_too_small({10, 1, 0, 0});
    start_too_small({}); // capacity 0: no kernel may be launched without blocks
    start_too_small({0, 0, 10, 0, true});
    start_too_small({0, 0, 0, 0, true});
}

TEST(Workspace, AWorkspaceBeyond32BitsIsRefused) {
    vp::cuda_backend be;
    const mesh_data m = mixed_triangles(5, 20.0f, 42);
    const vp::grid g = box_grid({20, 20, 20});
    vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, sum> fb{be, g.extent};
    const one_draw d{mesh.view(), {}, computed{}};
    const std::span<const one_draw> draws(&d, 1);
    for (const vp::workspace_limits limits : {vp::workspace_limits{std::uint64_t{1} << 32, 1, 0, 0},
                                              vp::workspace_limits{1, 1, std::uint64_t{1} << 40, 1}}) {
        EXPECT_EQ(vp::workspace_bytes(draws, g, fb.view(), {}, limits), 0u);
        EXPECT_EQ(vp::voxelize_async(be, draws, g, fb.view(), {}, {nullptr, 0, limits}).code,
                  vp::status_code::size_overflow);
    }
}

// The numbers of blocks for this device. tests/core/launch_size_test.cpp checks the arithmetic.
TEST(Workspace, LaunchesFillTheDevice) {
    int device = 0;
    cudaDeviceProp properties{};
    ASSERT_EQ(cudaGetDevice(&device), cudaSuccess);
    ASSERT_EQ(cudaGetDeviceProperties(&properties, device), cudaSuccess);
    const auto multiprocessors = static_cast<unsigned>(properties.multiProcessorCount);
    for (int bit = 32; bit < 64; ++bit) {
        const std::uint64_t items = std::uint64_t{1} << bit;
        EXPECT_EQ(vp::device::fill_device(items), 8 * multiprocessors) << bit;
        EXPECT_EQ(vp::device::fill_device(items, 4), 4 * multiprocessors) << bit;
    }
    EXPECT_EQ(vp::device::fill_device(0), 1u);
    EXPECT_EQ(vp::device::num_blocks(0), 1u);
    for (std::uint64_t bit = 0; bit <= 32; ++bit) {
        const auto items = static_cast<std::uint32_t>((std::uint64_t{1} << bit) - (bit == 32 ? 1 : 0));
        const std::uint64_t blocks = vp::device::raster_blocks(items, 8);
        const std::uint64_t in_round = blocks * vp::tuning::raster_threads;
        const std::uint64_t rounds = (items + in_round - 1) / in_round;
        EXPECT_LE(rounds, vp::device::warp_triangles::max_rounds) << bit;
        EXPECT_GE(blocks, std::min<std::uint64_t>(multiprocessors, (items + 127) / 128)) << bit;
        EXPECT_LT((blocks - 1) * vp::tuning::raster_threads, items) << bit; // no block without a triangle
        EXPECT_LE(blocks, static_cast<unsigned>(properties.maxGridSize[0])) << bit;
    }
}

// When blocks of the first pass draw what they would defer. Results are right either way, so no comparison could find a
// mistake.
TEST(Workspace, BlocksDrawWhatTheyWouldDeferForFineMeshesOnly) {
    using deferred = decltype(vp::device::pipeline_state::deferred);
    const std::uint64_t much = ~std::uint64_t{0};
    for (const vp::coverage rule : both_rules) {
        const bool thin = rule == vp::coverage::thin;
        EXPECT_EQ(deferred{}.num_deferred(rule), 0u);
        EXPECT_EQ((deferred{0, {5, 3, 0, 0}, 0, 0}.num_deferred(rule)), thin ? 3u : 8u);
        EXPECT_EQ((deferred{1, {5, 3, 0, 0}, 1, 0}.num_deferred(rule)), much);
        EXPECT_EQ((deferred{0, {5, 3, 1, 0}, 0, 0}.num_deferred(rule)), much);
        EXPECT_EQ((deferred{0, {0, 0, 0, 1}, 0, 0}.num_deferred(rule)), much);
    }
    const std::uint64_t each = vp::tuning::max_left_of_block;
    for (const std::size_t triangles : {1u, 128u, 129u, 1u << 30}) {
        SCOPED_TRACE(triangles);
        EXPECT_TRUE(vp::device::defers_few(triangles, 0));
        EXPECT_TRUE(vp::device::defers_few(triangles, each));
        EXPECT_FALSE(vp::device::defers_few(triangles, much));
    }
    EXPECT_FALSE(vp::device::defers_few(128, each + 1)); // a block's
    EXPECT_TRUE(vp::device::defers_few(129, each + 1));
    const auto at_once = static_cast<std::uint64_t>(vp::device::num_multiprocessors()) * vp::tuning::max_left_blocks;
    EXPECT_TRUE(vp::device::defers_few(1u << 30, each * at_once));
    EXPECT_FALSE(vp::device::defers_few(1u << 30, each * at_once + 1));
}

} // namespace
