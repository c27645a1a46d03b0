// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Calls in a CUDA graph, replayed with changed vertices, and on several streams at once, against cpu_backend: drawing
// without tiles, lists of constant and of shaded fragments, several draws, grids beyond 32 bits, list capacities that
// are too small, and omitted kernels.

#include "async_lists.hpp"
#include "cells.hpp"

#include <functional>
#include <span>
#include <string>

namespace {

using namespace device_test;
namespace blend = voxelpipe::blend;

// Meshes with the same triangles and different vertices. The first is on the device.
struct moving_mesh {
    std::vector<mesh_data> poses;
    vp::cuda_backend::buffer<glm::vec3> positions;
    vp::cuda_backend::buffer<glm::uvec3> triangles;

    moving_mesh(vp::cuda_backend& be, int count, float size, std::uint32_t seed)
        : poses{mixed_triangles(count, size, seed), mixed_triangles(count, size, seed + 1)},
          positions(be, vp::array_view<const glm::vec3>(poses[0].positions)),
          triangles(be, vp::array_view<const glm::uvec3>(poses[0].triangles)) {
        poses[1].triangles = poses[0].triangles;
        poses.push_back(poses[0]);
    }
    [[nodiscard]] vp::mesh_view<> view() const { return {positions.view(), triangles.view(), {}}; }
    void pose(vp::cuda_backend& be, const mesh_data& m) {
        ASSERT_EQ(cudaMemcpyAsync(positions.data(), m.positions.data(), m.positions.size() * sizeof(glm::vec3),
                                  cudaMemcpyHostToDevice, be.stream),
                  cudaSuccess);
    }
};

// Targets that are all drawn without tiles.
using bits = vp::target<vp::bit, blend::bit_or>;
using hits = vp::target<std::uint32_t, blend::count>;
using sums = vp::target<float, blend::add>;
using raster_draw_call = vp::draw<vp::mesh_view<>, vp::passthrough, decltype(vp::constant(true, 1u, 1.0f))>;
template <class Backend>
using immediate_framebuffer = vp::framebuffer<Backend, bits, hits, sums>;

void expect_direct(const mesh_data& m, const vp::grid& g, const call_options& options, vp::cuda_backend& be,
                   immediate_framebuffer<vp::cuda_backend>& fb, const vp::status& s, float value) {
    vp::cpu_backend cpu;
    immediate_framebuffer<vp::cpu_backend> expected{cpu, g.extent};
    vp::mesh<vp::cpu_backend> mesh(cpu, m.positions, m.triangles);
    const vp::status reference =
        vp::voxelize(cpu, mesh, g, vp::passthrough{}, vp::constant(true, 1u, value), expected, options);
    ASSERT_TRUE(reference.ok()) << reference.message();
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_GT(s.counts.voxels, 0u);
    expect_same_counts(reference.counts, s.counts);
    expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(be), "bits");
    expect_same_bytes(vp::get<1>(expected).to_host(cpu), vp::get<1>(fb).to_host(be), "hits");
    expect_same_bytes(vp::get<2>(expected).to_host(cpu), vp::get<2>(fb).to_host(be), "sums");
}

void replay_without_tiles(float value) {
    const vp::grid g = box_grid({64, 57, 71});
    for (const vp::coverage rule : both_rules) {
        stream_owner owner;
        vp::cuda_backend be{owner.stream};
        vp::stage_times times;
        be.times = &times; // for voxelize; an asynchronous call has no stage times and captures no events
        moving_mesh mesh(be, 3000, 60.0f, 91);
        immediate_framebuffer<vp::cuda_backend> fb{be, g.extent};
        const raster_draw_call d{mesh.view(), {}, vp::constant(true, 1u, value)};
        const std::span<const raster_draw_call> draws(&d, 1);
        const vp::workspace_limits limits{}; // without lists nothing can overflow
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {rule}, limits);
        ASSERT_GT(bytes, 0u);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        const captured_graph graph(be.stream,
                                   [&] { return vp::voxelize_async(be, draws, g, fb.view(), {rule}, workspace); });
        for (const mesh_data& m : mesh.poses) {
            mesh.pose(be, m);
            graph.launch(be.stream);
            expect_direct(m, g, rule, be, fb, vp::read_status(be, workspace), value);
        }
        EXPECT_EQ(times, vp::stage_times{});
    }
}

TEST(Graph, WithoutTilesIsReplayedWithChangedVertices) {
    replay_without_tiles(1.0f);
    replay_without_tiles(0.1f); // the sums are counted
}

TEST(Graph, TwoStreamsAtOnceWithoutTilesAreIndependent) {
    const vp::grid g = box_grid({64, 57, 71});
    stream_owner streams[2];
    vp::cuda_backend first{streams[0].stream}, second{streams[1].stream};
    vp::cuda_backend* const backends[2] = {&first, &second};
    std::vector<moving_mesh> meshes;
    std::vector<immediate_framebuffer<vp::cuda_backend>> fbs;
    std::vector<vp::cuda_backend::buffer<std::byte>> memory;
    std::vector<vp::workspace_view> views;
    std::vector<raster_draw_call> draws;
    for (std::uint32_t k = 0; k < 2; ++k) {
        meshes.emplace_back(*backends[k], 4000, 60.0f, 93 + 2 * k);
        fbs.emplace_back(*backends[k], g.extent);
        draws.push_back({meshes[k].view(), {}, vp::constant(true, 1u, 0.1f)});
        const std::size_t bytes =
            vp::workspace_bytes(std::span<const raster_draw_call>(&draws[k], 1), g, fbs[k].view(), {}, {});
        ASSERT_GT(bytes, 0u);
        memory.emplace_back(*backends[k], bytes);
        views.push_back({memory[k].data(), bytes, {}});
    }
    for (int round = 0; round < 5; ++round)
        for (std::size_t k = 0; k < 2; ++k) {
            const vp::status s = vp::voxelize_async(*backends[k], std::span<const raster_draw_call>(&draws[k], 1), g,
                                                    fbs[k].view(), {}, views[k]);
            ASSERT_TRUE(s.ok()) << s.message();
        }
    for (std::size_t k = 0; k < 2; ++k)
        expect_direct(meshes[k].poses[0], g, {}, *backends[k], fbs[k], vp::read_status(*backends[k], views[k]), 0.1f);
}

// ---- fragment lists -------------------------------------------------------------------------------------------------

template <class Payload, class FragmentShader>
void compare_replayed_lists(const FragmentShader& fs, std::uint32_t seed) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    const vp::grid g = box_grid({40, 33, 47});
    for (const vp::coverage rule : both_rules) {
        stream_owner owner;
        vp::cuda_backend be{owner.stream};
        moving_mesh mesh(be, 2000, 40.0f, seed);
        const draw_type d{mesh.view(), {}, fs};
        const std::span<const draw_type> draws(&d, 1);
        const vp::workspace_limits limits{0, 0, 1 << 21, 1 << 16};
        vp::abuffer_view<Payload> lists;
        const std::size_t bytes = vp::workspace_bytes(draws, g, lists, {rule}, limits);
        ASSERT_GT(bytes, 0u);
        const guarded_memory memory(be, bytes);
        const vp::workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), bytes, limits};
        const captured_graph graph(be.stream,
                                   [&] { return vp::voxelize_async(be, draws, g, lists, {rule}, workspace); });
        for (const mesh_data& m : mesh.poses) {
            mesh.pose(be, m);
            graph.launch(be.stream);
            const vp::status s = vp::read_status(be, workspace);
            expect_lists<Payload>({m}, g, fs, rule, lists.to_host(be), s);
        }
        memory.expect_untouched_behind(be);
    }
}

TEST(Graph, ListsOfConstantFragmentsAreReplayedWithChangedVertices) {
    compare_replayed_lists<void>(vp::constant(true), 101);
}
TEST(Graph, ListsWithPayloadsAreReplayedWithChangedVertices) { compare_replayed_lists<double>(any_double{}, 103); }

template <class Payload, class FragmentShader>
void compare_overflowing_lists(const FragmentShader& fs, std::uint32_t seed) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    vp::cuda_backend be;
    const mesh_data m = mixed_triangles(2000, 150.0f, seed);
    const vp::grid g = box_grid({150, 150, 150});
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    const draw_type d{mesh.view(), {}, fs};
    const std::span<const draw_type> draws(&d, 1);
    vp::workspace_limits limits{0, 0, 10, 1};
    vp::abuffer_view<Payload> lists;
    EXPECT_EQ(vp::voxelize_async(be, draws, g, lists, {}, {nullptr, 0, limits}).code,
              vp::status_code::capacity_exceeded);
    EXPECT_EQ(lists.counts, nullptr);
    int failures = 0;
    for (bool done = false; !done; ++failures) {
        ASSERT_LT(failures, 4);
        const std::size_t bytes = vp::workspace_bytes(draws, g, lists, {}, limits);
        ASSERT_GT(bytes, 0u);
        const guarded_memory memory(be, bytes);
        const vp::workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), bytes, limits};
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, lists, {}, workspace).ok());
        const vp::status s = vp::read_status(be, workspace, &limits);
        done = s.ok();
        if (done) {
            expect_lists<Payload>({m}, g, fs, {}, lists.to_host(be), s);
        } else {
            ASSERT_EQ(s.code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(s.where, vp::stage::abuffer_emit);
            EXPECT_GT(s.required.fragments, 10u);
            EXPECT_EQ(lists.to_host(be).voxels.size(), 0u);
            EXPECT_EQ(lists.to_host(be).primitives.size(), 0u);
        }
        memory.expect_untouched_behind(be);
    }
    EXPECT_GT(failures, 1); // including the last attempt
}

TEST(Graph, ListsThatDoNotFitSayWhatIsNeeded) {
    compare_overflowing_lists<void>(vp::constant(true), 105);
    compare_overflowing_lists<double>(any_double{}, 106);
}

// Without the kernels for long voxels: the same lists if there are no long voxels; otherwise no lists, and a status
// that asks for these kernels.
template <class Payload, class FragmentShader>
void compare_without_long_voxels(const FragmentShader& fs, bool lists_fragments) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    const vp::grid g = box_grid({40, 33, 47});
    for (const bool is_long : {false, true}) {
        vp::cuda_backend be;
        mesh_data m = triangles_at_faces(g.extent, 300, true, 107);
        append(m, triangles_in_voxel(is_long ? 400 : 200, {3, 4, 5}, 108)); // a shader may discard some of these
        const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
        const draw_type d{mesh.view(), {}, fs};
        const std::span<const draw_type> draws(&d, 1);
        vp::workspace_limits limits{0, 0, 1 << 17, 1 << 16, lists_fragments, false};
        vp::abuffer_view<Payload> lists;
        for (bool fails = is_long;; fails = false) {
            const std::size_t bytes = vp::workspace_bytes(draws, g, lists, {}, limits);
            ASSERT_GT(bytes, 0u);
            const guarded_memory memory(be, bytes);
            const vp::workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), bytes, limits};
            for (int round = 0; round < 2; ++round)
                ASSERT_TRUE(vp::voxelize_async(be, draws, g, lists, {}, workspace).ok());
            const vp::status s = vp::read_status(be, workspace, &limits);
            EXPECT_EQ(limits.orders_long_voxels, is_long);
            memory.expect_untouched_behind(be);
            if (!fails) {
                expect_lists<Payload>({m}, g, fs, {}, lists.to_host(be), s);
                break;
            }
            ASSERT_EQ(s.code, vp::status_code::capacity_exceeded);
            EXPECT_EQ(s.where, vp::stage::abuffer_emit);
            EXPECT_EQ(lists.to_host(be).voxels.size(), 0u);
            EXPECT_EQ(lists.to_host(be).primitives.size(), 0u);
        }
    }
}

TEST(Graph, ListsNeedNoKernelsForLongVoxelsIfThereAreNone) {
    compare_without_long_voxels<void>(vp::constant(true), false);
    compare_without_long_voxels<double>(vp::constant(0.5), false);
    compare_without_long_voxels<double>(any_double{}, true);
}

// Checked by the number of launches: kernels for long voxels, for dense ones and for merges of more than 2^12 fragments
// are omitted if they are not asked for or cannot be needed; a counting sort is three kernels, a radix sort of ten bits
// two.
TEST(Graph, ListsLaunchWhatTheyNeed) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, decltype(vp::constant(true))>;
    stream_owner owner;
    vp::cuda_backend be{owner.stream};
    const mesh_data m = mixed_triangles(2000, 10.0f, 110);
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    const draw_type d{mesh.view(), {}, vp::constant(true)};
    const std::span<const draw_type> draws(&d, 1);
    const auto num_nodes = [&](const vp::grid& g, std::uint64_t fragments, bool orders_long_voxels) {
        const vp::workspace_limits limits{0, 0, fragments, 1 << 10, false, orders_long_voxels};
        vp::abuffer_view<> lists;
        const std::size_t bytes = vp::workspace_bytes(draws, g, lists, {}, limits);
        const vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{const_cast<std::byte*>(memory.data()), bytes, limits};
        return captured_graph(be.stream, [&] { return vp::voxelize_async(be, draws, g, lists, {}, workspace); })
            .num_nodes();
    };
    const vp::grid g = box_grid({10, 10, 10});
    const std::uint64_t counted = 2 * m.triangles.size(), block = vp::tuning::max_of_block;
    EXPECT_EQ(num_nodes(g, counted, false), num_nodes(g, counted + 1, false) + 1);
    EXPECT_EQ(num_nodes(g, block, true), num_nodes(g, block, false) + 1);
    EXPECT_EQ(num_nodes(g, block + 1, true), num_nodes(g, block + 1, false) + 3);
    EXPECT_EQ(num_nodes(g, vp::tuning::max_of_window, true), num_nodes(g, vp::tuning::max_of_window, false));
}

// Without the kernel for larger triangles: the same voxels by a launch less where there are few of these; otherwise,
// with `fails`, that it is wanted, and then, by a call that does not clear, a target that stays as it was. Without
// `fails`: a call that has the kernel anyway.
template <class Target, class Shader>
void compare_without_larger(const Shader& shader, bool fails, int num_draws, bool loads, indices known) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    const vp::grid g = box_grid({41, 33, 47});
    for (const vp::coverage rule : both_rules)
        for (const float longest : {2.6f, 30.0f}) {
            SCOPED_TRACE(longest);
            const bool is_large = longest > 3.0f;
            stream_owner owner;
            vp::cuda_backend be{owner.stream};
            const mesh_data m = fine_triangles(1500, 20, longest);
            const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
            const std::vector<draw_type> list(static_cast<std::size_t>(num_draws),
                                              draw_type{view_of(mesh, known), {}, shader});
            const std::span<const draw_type> draws(list);
            const vp::voxelize_options options{rule, false};
            const auto start = [&](auto& fb) {
                std::vector<unsigned char> pattern(vp::get<0>(fb).to_host(be).size() *
                                                   sizeof(*vp::get<0>(fb).view().elements));
                for (std::size_t i = 0; i < pattern.size(); ++i) pattern[i] = i % 4 == 1 ? 0x21 : 0;
                // In the stream of the calls: cudaMemcpy may return before the device has the data.
                ASSERT_EQ(cudaMemcpyAsync(const_cast<void*>(static_cast<const void*>(vp::get<0>(fb).view().elements)),
                                          pattern.data(), pattern.size(), cudaMemcpyHostToDevice, be.stream),
                          cudaSuccess);
                ASSERT_EQ(cudaStreamSynchronize(be.stream), cudaSuccess);
                if (loads) vp::get<0>(fb).load();
            };
            vp::framebuffer<vp::cuda_backend, Target> expected{be, g.extent}, fb{be, g.extent};
            start(expected);
            const auto untouched = vp::get<0>(expected).to_host(be);
            ASSERT_TRUE(vp::voxelize(be, draws, g, expected, options).ok());
            vp::workspace_limits limits = vp::workspace_limits::for_triangles(draws.size() * m.triangles.size());
            limits.lists_fragments = true;
            std::size_t nodes[2] = {};
            for (const bool defers : {false, true}) {
                limits.expects_deferred = defers;
                start(fb);
                const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), options, limits);
                ASSERT_GT(bytes, 0u);
                vp::cuda_backend::buffer<std::byte> memory(be, bytes);
                const vp::workspace_view workspace{memory.data(), bytes, limits};
                const captured_graph graph(
                    be.stream, [&] { return vp::voxelize_async(be, draws, g, fb.view(), options, workspace); });
                graph.launch(be.stream);
                vp::workspace_limits need = limits;
                const vp::status s = vp::read_status(be, workspace, &need);
                nodes[defers ? 1 : 0] = graph.num_nodes();
                if (fails && is_large && !defers) {
                    EXPECT_EQ(s.code, vp::status_code::capacity_exceeded);
                    EXPECT_EQ(s.where, vp::stage::fine_raster);
                    EXPECT_TRUE(need.expects_deferred);
                    expect_same_bytes(untouched, vp::get<0>(fb).to_host(be), "as it was");
                } else {
                    ASSERT_TRUE(s.ok()) << s.message();
                    EXPECT_TRUE(need.expects_deferred || !defers);
                    if (fails) EXPECT_EQ(need.expects_deferred, defers);
                    if (!fails && is_large) EXPECT_TRUE(need.expects_deferred); // quicker, for blocks left much
                    expect_same_bytes(vp::get<0>(expected).to_host(be), vp::get<0>(fb).to_host(be), "target");
                }
            }
            EXPECT_EQ(nodes[0] + (fails ? 1 : 0), nodes[1]);
        }
}

TEST(Graph, MayOmitTheKernelForLargerTriangles) {
    using occupied = vp::target<vp::bit, blend::bit_or>;
    using parity = vp::target<vp::bit, blend::bit_xor>;
    for (const indices known : {indices::checked, indices::unknown}) {
        // Indices that need a look are what a mask pays for. Otherwise, and for parities and sums, fragments go
        // straight into the target, and no kernel may be missing.
        compare_without_larger<occupied>(vp::constant(true), known == indices::unknown, 1, false, known);
        compare_without_larger<parity>(vp::constant(true), false, 1, false, known);
        compare_without_larger<parity>(vp::constant(true), false, 1, true, known);
        compare_without_larger<parity>(vp::constant(true), false, 2, false, known);
        compare_without_larger<sums>(vp::constant(1.0f), false, 1, false, known);
    }
    compare_without_larger<occupied>(vp::constant(true), true, 1, true, indices::unknown); // of which touched are known
    compare_without_larger<vp::target<float, blend::replace>>(vp::constant(2.0f), true, 1, true, indices::unknown);
    compare_without_larger<sums>(any_values<sums>{}, true, 1, true, indices::unknown); // listed
    compare_without_larger<sums>(any_values<sums>{}, false, 2, true, indices::unknown);
}

template <class Payload, class Shader>
void compare_lists_without_larger(const Shader& shader) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    const vp::grid g = box_grid({41, 33, 47});
    for (const vp::coverage rule : both_rules)
        for (const float longest : {2.6f, 30.0f}) {
            SCOPED_TRACE(longest);
            vp::cuda_backend be;
            const mesh_data m = fine_triangles(1500, 20, longest);
            const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
            const draw_type d{mesh.view(), {}, shader};
            const std::span<const draw_type> draws(&d, 1);
            vp::workspace_limits limits{0, 0, 1 << 17, 1 << 16, true, true, false};
            vp::abuffer_view<Payload> lists;
            for (bool fails = longest > 3.0f;; fails = false) {
                const std::size_t bytes = vp::workspace_bytes(draws, g, lists, {rule}, limits);
                ASSERT_GT(bytes, 0u);
                const guarded_memory memory(be, bytes);
                const vp::workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), bytes, limits};
                for (int round = 0; round < 2; ++round)
                    ASSERT_TRUE(vp::voxelize_async(be, draws, g, lists, {rule}, workspace).ok());
                const vp::status s = vp::read_status(be, workspace, &limits);
                EXPECT_EQ(limits.expects_deferred, longest > 3.0f);
                memory.expect_untouched_behind(be);
                if (!fails) {
                    expect_lists<Payload>({m}, g, shader, rule, lists.to_host(be), s);
                    break;
                }
                ASSERT_EQ(s.code, vp::status_code::capacity_exceeded);
                EXPECT_EQ(lists.to_host(be).voxels.size(), 0u);
                EXPECT_EQ(lists.to_host(be).primitives.size(), 0u);
            }
        }
}

TEST(Graph, ListsMayOmitTheKernelForLargerTriangles) {
    compare_lists_without_larger<void>(vp::constant(true));
    compare_lists_without_larger<double>(any_double{});
}

// An ordered blend with long voxels but without the kernels for them: the target is unchanged.
TEST(Graph, AnOrderedTargetIsUnchangedIfLongVoxelsCannotBeOrdered) {
    using target = vp::target<std::uint32_t, chain>;
    using shader = decltype(vp::constant(std::uint32_t{5}));
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, shader>;
    vp::cuda_backend be;
    const vp::grid g = box_grid({20, 20, 20});
    const mesh_data m = triangles_in_voxel(257, {3, 4, 5}, 109);
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    vp::framebuffer<vp::cuda_backend, target> fb(be, g.extent), expected(be, g.extent);
    const draw_type d{mesh.view(), {}, vp::constant(std::uint32_t{5})};
    const std::span<const draw_type> draws(&d, 1);
    ASSERT_TRUE(vp::voxelize(be, draws, g, expected, {}).ok());
    ASSERT_EQ(cudaMemset(const_cast<std::uint32_t*>(vp::get<0>(fb).view().elements), 0x5a, 20 * 20 * 20 * 4),
              cudaSuccess);
    vp::workspace_limits limits{0, 0, 1 << 16, 1 << 16, true, false};
    for (const bool fails : {true, false}) {
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
        ASSERT_GT(bytes, 0u);
        vp::cuda_backend::buffer<std::byte> memory(be, bytes);
        const vp::workspace_view workspace{memory.data(), bytes, limits};
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
        const vp::status s = vp::read_status(be, workspace, &limits);
        EXPECT_TRUE(limits.orders_long_voxels);
        if (fails) {
            EXPECT_EQ(s.code, vp::status_code::capacity_exceeded);
            for (const std::uint32_t v : vp::get<0>(fb).to_host(be)) ASSERT_EQ(v, 0x5a5a5a5au);
        } else {
            ASSERT_TRUE(s.ok()) << s.message();
            expect_same_bytes(vp::get<0>(expected).to_host(be), vp::get<0>(fb).to_host(be), "with them");
        }
    }
}

template <class Payload, class FragmentShader>
void compare_list_calls(const FragmentShader& fs, std::uint32_t seed) {
    // The last voxel of the far corner is number 2^33 - 1.
    const glm::vec3 corner(1960.0f, 1970.0f, 1980.0f);
    std::vector<mesh_data> far{translated(mixed_triangles(150, 100.0f, seed), corner),
                               translated(mixed_triangles(200, 60.0f, seed + 1), corner)};
    add_triangle(far[1], {2047.2f, 2047.3f, 2047.9f}, {2047.8f, 2047.1f, 2047.2f}, {2047.4f, 2047.9f, 2047.5f});
    const std::vector<mesh_data> several{mixed_triangles(500, 40.0f, seed + 2), mixed_triangles(1, 40.0f, seed + 3),
                                         mixed_triangles(900, 40.0f, seed + 4)};
    for (const vp::coverage rule : both_rules) {
        list_call<Payload, FragmentShader> small(several, box_grid({40, 33, 47}), fs, rule);
        list_call<Payload, FragmentShader> one_far({far[1]}, box_grid({2048, 2048, 2048}), fs, rule);
        list_call<Payload, FragmentShader> all_far(far, box_grid({2048, 2048, 2048}), fs, rule);
        // Three streams at once, repeatedly.
        for (int round = 0; round < 5; ++round)
            for (auto* call : {&small, &one_far, &all_far}) call->launch();
        for (auto* call : {&small, &one_far, &all_far}) call->expect_the_cpus();
    }
}

TEST(Graph, ListsOfSeveralDrawsAndLargeGridsAreIndependentOnStreams) {
    compare_list_calls<void>(vp::constant(true), 120);
    compare_list_calls<double>(any_double{}, 130);
}

TEST(Lists, AConstantPayloadTakesMemoryOnceTheListsAreDone) {
    vp::cuda_backend be;
    const mesh_data m = mixed_triangles(500, 20.0f, 108);
    const vp::grid g = box_grid({20, 20, 20});
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    const vp::workspace_limits limits{0, 0, 1 << 16, 0};
    const auto bytes = [&]<class Payload>(const vp::abuffer_view<Payload>& lists, const auto& fs) {
        const vp::draw<vp::mesh_view<>, vp::passthrough, std::remove_cvref_t<decltype(fs)>> d{mesh.view(), {}, fs};
        return vp::workspace_bytes(std::span(&d, 1), g, lists, {}, limits);
    };
    const std::size_t without = bytes(vp::abuffer_view<void>{}, vp::constant(true));
    ASSERT_GT(without, 0u);
    EXPECT_EQ(bytes(vp::abuffer_view<double>{}, vp::constant(0.5)), without + limits.fragments * sizeof(double));
}

TEST(Lists, NoMemoryForTheCopyIsInTheStatus) {
    counting_resource resource;
    vp::cuda_backend be{nullptr, resource};
    const mesh_data m = mixed_triangles(500, 20.0f, 107);
    const vp::grid g = box_grid({20, 20, 20}), other = box_grid({19, 20, 20});
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    vp::abuffer<vp::cuda_backend> first{be}, second{be};
    ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), first).ok());
    const auto before = first.to_host(be);
    resource.limit = resource.live; // the workspace exists already
    for (auto* lists : {&first, &second}) {
        const vp::status s = vp::voxelize(be, mesh, other, vp::passthrough{}, vp::constant(true), *lists);
        EXPECT_EQ(s.code, vp::status_code::out_of_memory);
        EXPECT_EQ(s.where, vp::stage::abuffer_emit);
    }
    expect_same_on_host(before, first.to_host(be));
    EXPECT_EQ(second.num_voxels(), 0u);
    EXPECT_EQ(second.num_fragments(), 0u);
}

} // namespace
