// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// voxelize_async of programs, instances, points and lines: the bytes of cpu_backend in targets, lists and bricks, with
// rooms that do not suffice at first, and in CUDA graphs.

#include "async_lists.hpp"
#include "programs_support.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <span>

namespace programs_async_tests { // named: nvcc warns of members of unnamed ones that the host does not use

namespace blend = voxelpipe::blend;
using namespace device_test;
using namespace programs_support;

// Two meshes through the same programs.
template <class Backend, class FragmentShader, class Amplify>
struct two_draws {
    using draw_type = vp::draw<vp::mesh_view<>, programs::add_surface, FragmentShader, Amplify>;
    vp::mesh<Backend> a, b;
    draw_type draws[2];

    two_draws(Backend& backend, const Amplify& amplify)
        : two_draws(backend, amplify, unit::make_mesh(1, 20, extent), unit::make_mesh(2, 30, extent)) {}
    two_draws(Backend& backend, const Amplify& amplify, const unit::small_mesh& m, const unit::small_mesh& n)
        : a(backend, m.positions, m.triangles),
          b(backend, n.positions, n.triangles), draws{{a, {}, amplify, {}}, {b, {}, amplify, {}}} {}
    [[nodiscard]] std::span<const draw_type> span() const { return draws; }
};
// Runs call(workspace) with limits that do not suffice, then with those that read_status asks for. look(status): after
// each call, while its memory is there.
template <class Workspace, class Limits, class Bytes, class Call, class Look>
vp::status run_until_it_fits(vp::cuda_backend& gpu, Limits limits, const Bytes& bytes, const Call& call,
                             const Look& look) {
    vp::status s;
    for (int tries = 0; tries < 8; ++tries) {
        const std::size_t n = bytes(limits);
        EXPECT_GT(n, 0u);
        const guarded_memory memory(gpu, n);
        const Workspace workspace{const_cast<unsigned char*>(memory.memory.data()), n, limits};
        s = call(workspace);
        EXPECT_TRUE(s.ok()) << s.message();
        s = vp::read_status(gpu, workspace, &limits);
        memory.expect_untouched_behind(gpu);
        EXPECT_TRUE(s.ok() ? tries > 0 : s.code == vp::status_code::capacity_exceeded) << s.message();
        look(s);
        if (s.ok()) break;
    }
    return s;
}
template <class Workspace, class Limits, class Bytes, class Call>
vp::status run_until_it_fits(vp::cuda_backend& gpu, const Limits& limits, const Bytes& bytes, const Call& call) {
    return run_until_it_fits<Workspace>(gpu, limits, bytes, call, [](const vp::status&) {});
}

// The bricks and values of a call that does not wait, after calls without room, are those of cpu_backend; made dense,
// they are its framebuffer. draw(out): the same call there; call(backend, result, workspace).
template <class Workspace, class... Targets, class Limits, class Draw, class Bytes, class Call>
void expect_same_bricks(const vp::grid& g, const Limits& too_few, const Draw& draw, const Bytes& bytes,
                        const Call& call) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, Targets...> dense{cpu, g.extent};
    vp::sparse_framebuffer<vp::cpu_backend, Targets...> sparse(cpu, g.extent);
    const vp::status expected = draw(cpu, dense);
    ASSERT_TRUE(expected.ok()) << expected.message();
    ASSERT_TRUE(draw(cpu, sparse).ok());
    vp::sparse_result<Targets...> result;
    vp::host_sparse<Targets...> found;
    const vp::status s = run_until_it_fits<Workspace>(
        gpu, too_few, [&](const auto& limits) { return bytes(result, limits); },
        [&](const Workspace& w) { return call(gpu, result, w); },
        [&](const vp::status& of_call) {
            found = result.to_host(gpu);
            if (!of_call.ok()) EXPECT_EQ(found.num_bricks() + found.num_voxels(), 0u);
        });
    expect_same_counts(expected.counts, s.counts);
    EXPECT_GT(found.num_voxels(), 50u);
    EXPECT_TRUE(vp::same_contents(sparse.to_host(cpu), found));
    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        expect_same_bytes(vp::get<I>(dense).to_host(cpu), vp::get<I>(found).to_dense().elements, "made dense");
    });
}

template <class Amplify>
void expect_same_async_programs(const Amplify& amplify) {
    const vp::grid g = box_grid(extent).crop({3, 1, 5}, {40, 36, 41});
    const vp::program_options options{async_rule};
    const vp::program_limits too_few = [] {
        vp::program_limits l;
        static_cast<vp::workspace_limits&>(l) = {1 << 16, 1 << 13, 1 << 16, 1 << 13};
        l.triangles = 3;
        return l;
    }();
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    {
        const two_draws<vp::cpu_backend, programs::shader, Amplify> here(cpu, amplify);
        const two_draws<vp::cuda_backend, programs::shader, Amplify> there(gpu, amplify);
        programs::framebuffer_of<vp::cpu_backend> expected{cpu, g.extent};
        programs::framebuffer_of<vp::cuda_backend> fb{gpu, g.extent};
        const vp::status s = vp::voxelize<async_rule>(cpu, here.span(), g, expected, options);
        ASSERT_TRUE(s.ok()) << s.message();
        ASSERT_TRUE(vp::clear(gpu, fb).ok());
        const std::vector<glm::uvec4> cleared = vp::get<0>(fb).to_host(gpu);
        const vp::status t = run_until_it_fits<vp::program_workspace_view>(
            gpu, too_few,
            [&](const auto& l) { return vp::program_workspace_bytes(there.span(), g, fb.view(), options, l); },
            [&](const auto& w) {
                EXPECT_TRUE(unit::same_bytes(vp::get<0>(fb).to_host(gpu), cleared)); // a call that fails writes nothing
                return vp::voxelize_async<async_rule>(gpu, there.span(), g, fb.view(), options, w);
            });
        expect_same_counts(s.counts, t.counts);
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(gpu), "ids");
        expect_same_bytes(vp::get<1>(expected).to_host(cpu), vp::get<1>(fb).to_host(gpu), "sums");
        expect_same_bytes(vp::get<2>(expected).to_host(cpu), vp::get<2>(fb).to_host(gpu), "bits");
        expect_same_bricks<vp::program_workspace_view, programs::ids, programs::sums, programs::bits>(
            g, too_few, [&](auto& be, auto& out) { return vp::voxelize<async_rule>(be, here.span(), g, out, options); },
            [&](const auto& out, const auto& l) {
                return vp::program_workspace_bytes(there.span(), g, out, options, l);
            },
            [&](auto& be, auto& out, const auto& w) {
                return vp::voxelize_async<async_rule>(be, there.span(), g, out, options, w);
            });
    }
    const two_draws<vp::cpu_backend, programs::ids_shader, Amplify> here(cpu, amplify);
    const two_draws<vp::cuda_backend, programs::ids_shader, Amplify> there(gpu, amplify);
    vp::abuffer<vp::cpu_backend, glm::uvec4> expected(cpu);
    ASSERT_TRUE(vp::voxelize<async_rule>(cpu, here.span(), g, expected, options).ok());
    vp::abuffer_view<glm::uvec4> lists;
    vp::host_abuffer<glm::uvec4> found;
    (void)run_until_it_fits<vp::program_workspace_view>(
        gpu, too_few, [&](const auto& l) { return vp::program_workspace_bytes(there.span(), g, lists, options, l); },
        [&](const auto& w) {
            const vp::status s = vp::voxelize_async<async_rule>(gpu, there.span(), g, lists, options, w);
            found = lists.to_host(gpu);
            return s;
        });
    expect_same_on_host(expected.to_host(cpu), found);
}
TEST(DevicePrograms, TessellationWithoutWaitsIsTheCpus) {
    expect_same_async_programs(vp::tessellate{programs::waves{2.3f, 1.5f}});
}
TEST(DevicePrograms, GeometryWithoutWaitsIsTheCpus) { expect_same_async_programs(vp::geometry{programs::prism{0.8f}}); }
TEST(DevicePrograms, BothWithoutWaitsAreTheCpus) {
    expect_same_async_programs(vp::tessellate{programs::waves{4.1f, 1.0f}} | vp::geometry{programs::prism{0.8f}});
}
// Constants go by masks.
TEST(DevicePrograms, ConstantsInBricksWithoutWaitsAreTheCpus) {
    const vp::grid g = box_grid(extent);
    using constants = decltype(vp::constant(true, 3u));
    using amplify = vp::geometry<programs::prism>;
    const auto make = [](auto& be) {
        using backend = std::remove_reference_t<decltype(be)>;
        using made = two_draws<backend, constants, amplify>;
        return std::make_unique<made>(be, amplify{{0.8f}});
    };
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const auto here = make(cpu);
    const auto there = make(gpu);
    vp::program_limits too_few;
    static_cast<vp::workspace_limits&>(too_few) = {0, 0, 0, 1 << 13};
    too_few.triangles = 3;
    expect_same_bricks<vp::program_workspace_view, bits, vp::target<std::uint32_t, vp::blend::count>>(
        g, too_few, [&](auto& be, auto& out) { return vp::voxelize<async_rule>(be, here->span(), g, out); },
        [&](const auto& out, const auto& l) {
            return vp::program_workspace_bytes(there->span(), g, out, {async_rule}, l);
        },
        [&](auto& be, auto& out, const auto& w) {
            return vp::voxelize_async<async_rule>(be, there->span(), g, out, {async_rule}, w);
        });
}
TEST(DeviceInstances, InBricksWithoutWaitsAreTheCpus) {
    const mesh_data m = mixed_triangles(100, 30.0f, 5);
    const vp::grid g = box_grid(extent);
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const vp::mesh<vp::cpu_backend> here(cpu, m.positions, m.triangles);
    const vp::mesh<vp::cuda_backend> there(gpu, m.positions, m.triangles);
    using draw_type = vp::draw<vp::mesh_view<>, placed_spot, shader>;
    const draw_type d{there.view(vp::instances{5}), {}, {}};
    const std::span<const draw_type> draws(&d, 1);
    vp::workspace_limits too_few;
    too_few.fragment_records = 1 << 13;
    expect_same_bricks<vp::workspace_view, ids, sums>(
        g, too_few,
        [&](auto& be, auto& out) {
            return vp::voxelize<async_rule>(be, here.view(vp::instances{5}), g, placed_spot{}, shader{}, out);
        },
        [&](const auto& out, const auto& l) { return vp::workspace_bytes(draws, g, out, {async_rule}, l); },
        [&](auto& be, auto& out, const auto& w) {
            return vp::voxelize_async<async_rule>(be, draws, g, out, {async_rule}, w);
        });
}
// In a CUDA graph, for two poses of a mesh, into targets and into bricks.
TEST(DevicePrograms, AreReplayedWithChangedVertices) {
    const vp::tessellate<programs::waves> amplify{{4.1f, 1.0f}};
    const vp::grid g = box_grid(extent);
    const unit::small_mesh poses[] = {unit::make_mesh(5, 20, extent), unit::make_mesh(6, 20, extent)};
    using draw_type =
        vp::draw<vp::mesh_view<>, programs::add_surface, programs::shader, vp::tessellate<programs::waves>>;
    stream_owner owner;
    vp::cuda_backend gpu{owner.stream};
    vp::cuda_backend::buffer<glm::vec3> positions(gpu, array_of(poses[0].positions));
    const vp::cuda_backend::buffer<glm::uvec3> triangles(gpu, array_of(poses[0].triangles));
    programs::framebuffer_of<vp::cuda_backend> fb{gpu, g.extent};
    const draw_type d{{positions.view(), triangles.view()}, {}, amplify, {}};
    const std::span<const draw_type> draws(&d, 1);
    vp::program_limits limits = vp::program_limits::for_triangles(1 << 14);
    limits.fragments = 1 << 18;
    const std::size_t bytes = vp::program_workspace_bytes(draws, g, fb.view(), {async_rule}, limits);
    ASSERT_GT(bytes, 0u);
    vp::cuda_backend::buffer<unsigned char> memory(gpu, bytes);
    const vp::program_workspace_view workspace{memory.data(), bytes, limits};
    const captured_graph graph(owner.stream, [&] {
        return vp::voxelize_async<async_rule>(gpu, draws, g, fb.view(), {async_rule}, workspace);
    });
    vp::sparse_result<programs::ids, programs::sums, programs::bits> bricks;
    vp::program_limits sparse_limits = limits;
    sparse_limits.bricks = 400;
    sparse_limits.voxels = 1 << 16;
    const std::size_t sparse_bytes = vp::program_workspace_bytes(draws, g, bricks, {async_rule}, sparse_limits);
    ASSERT_GT(sparse_bytes, 0u);
    vp::cuda_backend::buffer<unsigned char> sparse_memory(gpu, sparse_bytes);
    const vp::program_workspace_view sparse_workspace{sparse_memory.data(), sparse_bytes, sparse_limits};
    const captured_graph sparse_graph(owner.stream, [&] {
        return vp::voxelize_async<async_rule>(gpu, draws, g, bricks, {async_rule}, sparse_workspace);
    });
    vp::cpu_backend cpu;
    for (const int pose : {0, 1, 0}) {
        const std::vector<glm::vec3>& p = poses[pose].positions;
        ASSERT_EQ(cudaMemcpyAsync(positions.data(), p.data(), p.size() * sizeof(glm::vec3), cudaMemcpyHostToDevice,
                                  owner.stream),
                  cudaSuccess);
        graph.launch(owner.stream);
        programs::framebuffer_of<vp::cpu_backend> expected{cpu, g.extent};
        const draw_type same{{p, poses[0].triangles}, {}, amplify, {}};
        const vp::status s = vp::voxelize<async_rule>(cpu, std::span<const draw_type>(&same, 1), g, expected);
        const vp::status t = vp::read_status(gpu, workspace);
        ASSERT_TRUE(s.ok() && t.ok()) << s.message() << t.message();
        expect_same_counts(s.counts, t.counts);
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(gpu), "ids");
        expect_same_bytes(vp::get<1>(expected).to_host(cpu), vp::get<1>(fb).to_host(gpu), "sums");
        sparse_graph.launch(owner.stream);
        const vp::status u = vp::read_status(gpu, sparse_workspace);
        ASSERT_TRUE(u.ok()) << u.message();
        expect_same_counts(s.counts, u.counts);
        const auto found = bricks.to_host(gpu);
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(found).to_dense().elements, "ids");
        expect_same_bytes(vp::get<1>(expected).to_host(cpu), vp::get<1>(found).to_dense().elements, "sums");
    }
}
TEST(DevicePrograms, WithoutWaitsReportWhatIsWrong) {
    const auto amplify = vp::tessellate{programs::waves{2.3f, 1.5f}};
    const vp::grid g = box_grid(extent);
    vp::cuda_backend gpu;
    unit::small_mesh m = unit::make_mesh(1, 20, extent);
    m.triangles[3].y = 1'000'000;
    const two_draws<vp::cuda_backend, programs::shader, vp::tessellate<programs::waves>> there(gpu, amplify, m, m);
    programs::framebuffer_of<vp::cuda_backend> fb{gpu, g.extent};
    const vp::program_limits limits = vp::program_limits::for_triangles(1 << 14);
    const std::size_t bytes = vp::program_workspace_bytes(there.span(), g, fb.view(), {async_rule}, limits);
    const guarded_memory memory(gpu, bytes);
    const vp::program_workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), bytes, limits};
    ASSERT_TRUE(vp::voxelize_async<async_rule>(gpu, there.span(), g, fb.view(), {async_rule}, workspace).ok());
    EXPECT_EQ(vp::read_status(gpu, workspace).code, vp::status_code::index_out_of_range);
    vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_or>> constants{gpu, g.extent};
    const vp::status s =
        vp::voxelize<async_rule>(gpu, there.a, g, programs::add_surface{}, amplify, vp::constant(true), constants);
    EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(s.triangle, 3u);
    EXPECT_EQ(vp::voxelize_async<async_rule>(gpu, there.span(), g, fb.view(), {async_rule}, {nullptr, 0, limits}).code,
              vp::status_code::capacity_exceeded);
    // Limits that cannot be: nothing is launched.
    vp::sparse_result<programs::ids, programs::sums, programs::bits> bricks;
    vp::program_workspace_view too_many = workspace;
    too_many.limits.nodes = std::uint64_t{1} << 40;
    EXPECT_EQ(vp::voxelize_async<async_rule>(gpu, there.span(), g, bricks, {async_rule}, too_many).code,
              vp::status_code::size_overflow);
}

template <class View>
void expect_same_async_elements(const View& here, const View& there) {
    const vp::grid g = box_grid(extent).crop({3, 1, 5}, {40, 36, 41});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const vp::voxelize_options options{vp::coverage::conservative};
    const vp::workspace_limits too_few{0, 0, 100, 0};
    {
        using draw_type = vp::draw<View, elements::place, elements::shader>;
        const draw_type on_cpu[] = {{here, {}, {}}, {here, {}, {}}}, on_gpu[] = {{there, {}, {}}, {there, {}, {}}};
        const std::span<const draw_type> draws(on_gpu);
        vp::framebuffer<vp::cpu_backend, elements::ids, elements::sums, elements::bits> expected{cpu, g.extent};
        vp::framebuffer<vp::cuda_backend, elements::ids, elements::sums, elements::bits> fb{gpu, g.extent};
        const vp::status s = vp::voxelize(cpu, std::span<const draw_type>(on_cpu), g, expected, options);
        ASSERT_TRUE(s.ok()) << s.message();
        const vp::status t = run_until_it_fits<vp::workspace_view>(
            gpu, too_few, [&](const auto& l) { return vp::workspace_bytes(draws, g, fb.view(), options, l); },
            [&](const auto& w) { return vp::voxelize_async(gpu, draws, g, fb.view(), options, w); });
        expect_same_counts(s.counts, t.counts);
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(gpu), "ids");
        expect_same_bytes(vp::get<1>(expected).to_host(cpu), vp::get<1>(fb).to_host(gpu), "sums");
        expect_same_bytes(vp::get<2>(expected).to_host(cpu), vp::get<2>(fb).to_host(gpu), "bits");
        expect_same_bricks<vp::workspace_view, elements::ids, elements::sums, elements::bits>(
            g, too_few,
            [&](auto& be, auto& out) { return vp::voxelize(be, std::span<const draw_type>(on_cpu), g, out, options); },
            [&](const auto& out, const auto& l) { return vp::workspace_bytes(draws, g, out, options, l); },
            [&](auto& be, auto& out, const auto& w) { return vp::voxelize_async(be, draws, g, out, options, w); });
    }
    using draw_type = vp::draw<View, elements::place, elements::payload_shader>;
    const draw_type on_cpu[] = {{here, {}, {}}}, on_gpu[] = {{there, {}, {}}};
    const std::span<const draw_type> draws(on_gpu);
    vp::abuffer<vp::cpu_backend, elements::payload> expected(cpu);
    ASSERT_TRUE(vp::voxelize(cpu, std::span<const draw_type>(on_cpu), g, expected, options).ok());
    vp::abuffer_view<elements::payload> lists;
    vp::host_abuffer<elements::payload> found;
    (void)run_until_it_fits<vp::workspace_view>(
        gpu, too_few, [&](const auto& l) { return vp::workspace_bytes(draws, g, lists, options, l); },
        [&](const auto& w) {
            const vp::status s = vp::voxelize_async(gpu, draws, g, lists, options, w);
            found = lists.to_host(gpu);
            return s;
        });
    expect_same_on_host(expected.to_host(cpu), found);
}
TEST(DeviceElements, WithoutWaitsAreTheCpus) {
    const std::vector<glm::vec3> vertices = elements::make_vertices(4, 120, extent);
    vp::cuda_backend gpu;
    const vp::cuda_backend::buffer<glm::vec3> there(gpu, array_of(vertices));
    expect_same_async_elements(vp::lines_view<>{.positions = vertices, .copies = {2}},
                               vp::lines_view<>{.positions = there.view(), .copies = {2}});
    expect_same_async_elements(vp::points_view<>{.positions = vertices}, vp::points_view<>{.positions = there.view()});
}

} // namespace programs_async_tests
