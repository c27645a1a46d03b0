// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Programs, points and lines drawn into a sparse grid that holds something: a second call into the same sparse
// framebuffer, or one that never waits and goes on from an earlier result. Both have the bytes of cpu_backend, and
// these, made dense, are its framebuffer after the same calls.

#include "programs_support.hpp"

#include <gtest/gtest.h>

#include <span>
#include <vector>

namespace programs_goes_on_tests { // named: nvcc warns of members of unnamed ones that the host does not use

using namespace device_test;
using namespace programs_support;

using grid_ids = elements::ids;
using grid_sums = elements::sums;
using grid_bits = elements::bits;
template <class Backend>
using sparse_of = vp::sparse_framebuffer<Backend, grid_ids, grid_sums, grid_bits>;
using result_type = vp::sparse_result<grid_ids, grid_sums, grid_bits>;

// What the second call does: the sums begin again, all else stays.
template <class Output>
void go_on(Output& out) {
    vp::get<0>(out).load();
    vp::get<1>(out).clear(0.75f);
    vp::get<2>(out).load();
}
template <class Host>
void expect_same_sparse(const Host& a, const Host& b, const char* what) {
    EXPECT_TRUE(vp::same_contents(a, b)) << what;
    EXPECT_TRUE(unit::same_bytes(vp::get<1>(a.sums), vp::get<1>(b.sums))) << what;
}

// Two calls one after the other: call(backend, number, output) waits; bytes(number, result, limits) and async(backend,
// number, result, workspace) do not. Limits: with room for both.
template <class Workspace, class Limits, class Call, class Bytes, class Async>
void expect_second_calls_go_on(const vp::grid& g, const Limits& limits, const Call& call, const Bytes& bytes,
                               const Async& async) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, grid_ids, grid_sums, grid_bits> dense{cpu, g.extent};
    sparse_of<vp::cpu_backend> on_cpu(cpu, g.extent);
    sparse_of<vp::cuda_backend> on_gpu(gpu, g.extent);
    on_cpu.template keep_sums<1>();
    on_gpu.template keep_sums<1>();
    result_type results[2];
    std::vector<vp::cuda_backend::buffer<unsigned char>> memories;
    std::uint64_t before = 0;
    for (int number = 0; number < 2; ++number) {
        result_type& r = results[number];
        r.template keep_sums<1>();
        if (number == 1) {
            go_on(dense);
            go_on(on_cpu);
            go_on(on_gpu);
            r.load(results[0]);
            r.loads[1] = vp::load_operation::clear;
            vp::get<1>(r.clear_values) = 0.75f;
            before = on_cpu.num_voxels();
        }
        const vp::status expected = call(cpu, number, dense);
        ASSERT_TRUE(expected.ok()) << expected.message();
        for (const vp::status& s : {call(cpu, number, on_cpu), call(gpu, number, on_gpu)}) {
            ASSERT_TRUE(s.ok()) << s.message();
            expect_same_counts(expected.counts, s.counts);
        }
        const auto contents = on_cpu.to_host(cpu);
        expect_same_sparse(on_gpu.to_host(gpu), contents, "a sparse framebuffer");
        const std::size_t n = bytes(number, r, limits);
        ASSERT_GT(n, 0u);
        memories.emplace_back(gpu, n);
        const Workspace workspace{memories.back().data(), n, limits};
        const vp::status launched = async(gpu, number, r, workspace);
        ASSERT_TRUE(launched.ok()) << launched.message();
        const vp::status s = vp::read_status(gpu, workspace);
        ASSERT_TRUE(s.ok()) << s.message();
        expect_same_counts(expected.counts, s.counts);
        expect_same_sparse(r.to_host(gpu), contents, "a result");
        if (number == 0) continue;
        EXPECT_GT(before, 50u);
        EXPECT_GT(contents.num_voxels(), before + 50); // some stay, some are new
        vp::core::for_each_index<3>([&]<std::size_t I>() {
            expect_same_bytes(vp::get<I>(dense).to_host(cpu), vp::get<I>(contents).to_dense().elements, "made dense");
        });
    }
}

// Call 0 draws one mesh, call 1 another.
template <class Amplify>
void expect_programs_go_on(const Amplify& amplify) {
    using draw_type = vp::draw<vp::mesh_view<>, programs::add_surface, programs::shader, Amplify>;
    const vp::grid g = box_grid(extent).crop({3, 1, 5}, {40, 36, 41});
    const unit::small_mesh meshes[] = {unit::make_mesh(1, 20, extent), unit::make_mesh(2, 30, extent)};
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    std::vector<vp::mesh<vp::cpu_backend>> here;
    std::vector<vp::mesh<vp::cuda_backend>> there;
    for (const unit::small_mesh& m : meshes) {
        here.emplace_back(cpu, m.positions, m.triangles);
        there.emplace_back(gpu, m.positions, m.triangles);
    }
    const draw_type on_cpu[] = {{here[0].view(), {}, amplify, {}}, {here[1].view(), {}, amplify, {}}};
    const draw_type on_gpu[] = {{there[0].view(), {}, amplify, {}}, {there[1].view(), {}, amplify, {}}};
    vp::program_limits limits = vp::program_limits::for_triangles(1 << 14);
    limits.fragments = 1 << 17;
    limits.bricks = 500;
    limits.voxels = 1 << 17;
    const auto one = [](const draw_type* draws, int number) { return std::span<const draw_type>(draws + number, 1); };
    expect_second_calls_go_on<vp::program_workspace_view>(
        g, limits,
        [&](auto& be, int number, auto& out) {
            constexpr bool is_cpu = std::is_same_v<std::remove_reference_t<decltype(be)>, vp::cpu_backend>;
            return vp::voxelize<async_rule>(be, one(is_cpu ? on_cpu : on_gpu, number), g, out);
        },
        [&](int number, const auto& out, const auto& l) {
            return vp::program_workspace_bytes(one(on_gpu, number), g, out, {async_rule}, l);
        },
        [&](auto& be, int number, auto& out, const auto& w) {
            return vp::voxelize_async<async_rule>(be, one(on_gpu, number), g, out, {async_rule}, w);
        });
}
TEST(DevicePrograms, TessellationsGoOnInSparseGrids) {
    expect_programs_go_on(vp::tessellate{programs::waves{2.3f, 1.5f}});
}
TEST(DevicePrograms, GeometryGoesOnInSparseGrids) { expect_programs_go_on(vp::geometry{programs::prism{0.8f}}); }

// Call 0 draws some elements, call 1 others.
template <class View>
void expect_elements_go_on(const View (&here)[2], const View (&there)[2]) {
    using draw_type = vp::draw<View, elements::place, elements::shader>;
    const vp::grid g = box_grid(extent).crop({3, 1, 5}, {40, 36, 41});
    const vp::voxelize_options options{vp::coverage::conservative};
    const draw_type on_cpu[] = {{here[0], {}, {}}, {here[1], {}, {}}},
                    on_gpu[] = {{there[0], {}, {}}, {there[1], {}, {}}};
    vp::workspace_limits limits{};
    limits.fragments = 1 << 16;
    limits.bricks = 500;
    limits.voxels = 1 << 16;
    const auto one = [](const draw_type* draws, int number) { return std::span<const draw_type>(draws + number, 1); };
    expect_second_calls_go_on<vp::workspace_view>(
        g, limits,
        [&](auto& be, int number, auto& out) {
            constexpr bool is_cpu = std::is_same_v<std::remove_reference_t<decltype(be)>, vp::cpu_backend>;
            return vp::voxelize(be, one(is_cpu ? on_cpu : on_gpu, number), g, out, options);
        },
        [&](int number, const auto& out, const auto& l) {
            return vp::workspace_bytes(one(on_gpu, number), g, out, options, l);
        },
        [&](auto& be, int number, auto& out, const auto& w) {
            return vp::voxelize_async(be, one(on_gpu, number), g, out, options, w);
        });
}
TEST(DeviceElements, GoOnInSparseGrids) {
    const std::vector<glm::vec3> some = elements::make_vertices(4, 40, extent),
                                 more = elements::make_vertices(9, 60, extent),
                                 points = elements::make_vertices(5, 300, extent),
                                 more_points = elements::make_vertices(8, 400, extent);
    vp::cuda_backend gpu;
    std::vector<vp::cuda_backend::buffer<glm::vec3>> there;
    for (const std::vector<glm::vec3>* v : {&some, &more, &points, &more_points}) there.emplace_back(gpu, array_of(*v));
    const vp::lines_view<> lines_here[] = {{.positions = some, .copies = {2}}, {.positions = more, .copies = {2}}};
    const vp::lines_view<> lines_there[] = {{.positions = there[0].view(), .copies = {2}},
                                            {.positions = there[1].view(), .copies = {2}}};
    expect_elements_go_on(lines_here, lines_there);
    const vp::points_view<> points_here[] = {{.positions = points}, {.positions = more_points}};
    const vp::points_view<> points_there[] = {{.positions = there[2].view()}, {.positions = there[3].view()}};
    expect_elements_go_on(points_here, points_there);
}

} // namespace programs_goes_on_tests
