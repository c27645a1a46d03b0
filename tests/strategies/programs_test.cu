// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Instances, tessellation and geometry programs, points and lines on the device: the bytes of cpu_backend, for every
// strategy, in lists and in solids, for any chunk capacity. Levels of dense grids and rays through bits too.

#include "../programs/amplify_cases.hpp"
#include "../programs/elements_cases.hpp"
#include "../programs/field_cases.hpp"
#include "../programs/levels_cases.hpp"
#include "async_lists.hpp"

#include <gtest/gtest.h>

namespace programs_types { // named: nvcc warns of members of unnamed ones that the host does not use

namespace vp = voxelpipe;

// Copy i at place i, with or without a varying.
struct placed {
    VOXELPIPE_HD glm::vec3 operator()(const vp::vertex<>& v) const {
        const auto s = static_cast<float>(v.instance);
        return {vp::exact::fma(7.25f, s, v.position.x), vp::exact::fma(5.5f, s, v.position.y),
                vp::exact::fma(-3.0f, s, v.position.z)};
    }
};
struct spot {
    float along;
};
struct placed_spot {
    VOXELPIPE_HD auto operator()(const vp::vertex<>& v) const {
        return vp::vertex_output{placed{}(v), spot{vp::exact::mul(static_cast<float>(v.instance), v.position.x)}};
    }
};
struct shader {
    VOXELPIPE_HD auto operator()(const vp::fragment<spot>& f) const {
        return vp::outputs(glm::uvec4(f.instance, f.triangle, f.primitive, 1), f.varyings.along)
            .discard_if(f.primitive % 5 == 0);
    }
};

} // namespace programs_types

namespace programs_tests { // named for the same reason

namespace blend = voxelpipe::blend;
using namespace device_test;
using namespace programs_types;

using bits = vp::target<vp::bit, blend::bit_or>;
using ids = vp::target<glm::uvec4, blend::replace>;
using sums = vp::target<float, blend::add>;

const glm::ivec3 extent{45, 39, 50};

template <class T>
vp::array_view<const T> array_of(const std::vector<T>& v) {
    return {v.data(), v.size()};
}

// The same call on both backends, with `copies` instances of a mesh; compares targets and counts.
template <vp::coverage Rule, class... Targets, class VertexShader, class FragmentShader>
void expect_same_instances(const mesh_data& m, std::uint64_t copies, const VertexShader& vs, const FragmentShader& fs,
                           std::initializer_list<vp::strategy> strategies) {
    const vp::grid g = box_grid(extent);
    vp::cpu_backend cpu;
    vp::framebuffer<vp::cpu_backend, Targets...> a{cpu, g.extent};
    const vp::mesh<vp::cpu_backend> here(cpu, m.positions, m.triangles);
    const vp::status sa = vp::voxelize<Rule>(cpu, here.view(vp::instances{copies}), g, vs, fs, a);
    ASSERT_TRUE(sa.ok()) << sa.message();
    EXPECT_EQ(sa.counts.triangles_in, copies * m.triangles.size());
    for (const vp::strategy strategy : strategies) {
        SCOPED_TRACE(vp::to_string(strategy));
        vp::cuda_backend gpu;
        gpu.strategy = strategy;
        vp::framebuffer<vp::cuda_backend, Targets...> b{gpu, g.extent};
        const vp::mesh<vp::cuda_backend> there(gpu, m.positions, m.triangles);
        const vp::status sb = vp::voxelize<Rule>(gpu, there.view(vp::instances{copies}), g, vs, fs, b);
        ASSERT_TRUE(sb.ok()) << sb.message();
        expect_same_counts(sa.counts, sb.counts);
        vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), "target");
        });
    }
}

TEST(DeviceInstances, OfConstantsAreTheCpus) {
    const mesh_data m = mixed_triangles(150, 30.0f, 3);
    using vp::strategy;
    expect_same_instances<vp::coverage::conservative, bits>(m, 4, placed{}, vp::constant(true),
                                                            {strategy::occupancy_mask, strategy::immediate});
    expect_same_instances<vp::coverage::conservative, bits>(m, 3, vp::passthrough{}, vp::constant(true),
                                                            {strategy::occupancy_mask});
}

// More triangles than a pass takes: most of them have no area and lie in one voxel.
TEST(DeviceInstances, AreDrawnInPasses) {
    mesh_data m = mixed_triangles(64, 12.0f, 11);
    m.triangles.resize(vp::tuning::max_pass_triangles / 3, glm::uvec3(m.triangles[0].x));
    expect_same_instances<vp::coverage::conservative, bits>(m, 4, placed{}, vp::constant(true),
                                                            {vp::strategy::immediate});
}

TEST(DeviceInstances, OfShadersAreTheCpus) {
    const mesh_data m = mixed_triangles(100, 30.0f, 4);
    using vp::strategy;
    expect_same_instances<vp::coverage::thin, ids, sums>(m, 5, placed_spot{}, shader{},
                                                         {strategy::sorted_reduce, strategy::tiled});
}

TEST(DeviceInstances, InListsAreTheCpus) {
    const mesh_data m = mixed_triangles(100, 30.0f, 5);
    const vp::grid g = box_grid(extent);
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::abuffer<vp::cpu_backend> a{cpu};
    vp::abuffer<vp::cuda_backend> b{gpu};
    const vp::mesh<vp::cpu_backend> here(cpu, m.positions, m.triangles);
    const vp::mesh<vp::cuda_backend> there(gpu, m.positions, m.triangles);
    const vp::status s =
        vp::voxelize<vp::coverage::thin>(cpu, here.view(vp::instances{6}), g, placed{}, vp::constant(true), a);
    const vp::status t =
        vp::voxelize<vp::coverage::thin>(gpu, there.view(vp::instances{6}), g, placed{}, vp::constant(true), b);
    ASSERT_TRUE(s.ok() && t.ok()) << s.message() << t.message();
    expect_same_on_host(a.to_host(cpu), b.to_host(gpu));
}

TEST(DeviceInstances, CheckTheirIndices) {
    mesh_data m = mixed_triangles(20, 30.0f, 7);
    m.triangles[11].z = static_cast<std::uint32_t>(m.positions.size());
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cuda_backend, bits> b{gpu, extent};
    const vp::mesh<vp::cuda_backend> there(gpu, m.positions, m.triangles);
    const vp::status s = vp::voxelize<vp::coverage::conservative>(gpu, there.view(vp::instances{3}), box_grid(extent),
                                                                  placed{}, vp::constant(true), b);
    EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(s.triangle, 11u);
}

template <class Amplify>
void expect_same_programs(std::uint64_t seed, int triangles, const Amplify& amplify) {
    const unit::small_mesh m = unit::make_mesh(seed, triangles, extent);
    const vp::grid g = box_grid(extent).crop({3, 1, 5}, {40, 36, 41});
    constexpr vp::coverage rule = vp::coverage::thin; // the raster's tests have both
    vp::cpu_backend cpu;
    const programs::results expected = programs::draw_all<rule>(cpu, m, g, amplify, {rule});
    EXPECT_GT(expected.counts.voxels, 50u);
    const vp::program_options capacities[] = {{rule, 1 << 24}, {rule, 300}, {rule, 300, 60'000}};
    for (const vp::program_options& options : capacities) {
        vp::cuda_backend gpu;
        programs::expect_same(expected, programs::draw_all<rule>(gpu, m, g, amplify, options));
    }
}
TEST(DevicePrograms, TessellationIsTheCpus) {
    expect_same_programs(1, 20, vp::tessellate{programs::waves{2.3f, 1.5f}});
}
TEST(DevicePrograms, GeometryIsTheCpus) { expect_same_programs(2, 60, vp::geometry{programs::prism{0.8f}}); }
TEST(DevicePrograms, GeometryOfATessellationIsTheCpus) {
    expect_same_programs(3, 20, vp::tessellate{programs::waves{4.1f, 1.0f}} | vp::geometry{programs::prism{0.8f}});
}

constexpr vp::coverage async_rule = vp::coverage::thin;

// Memory that runs out.
struct limited_resource {
    std::uint64_t limit, used = 0, peak = 0;
    int refused = 0;
    void* allocate_async(std::size_t bytes, std::size_t, cudaStream_t stream) {
        if (used + bytes > limit) {
            ++refused;
            throw std::bad_alloc();
        }
        used += bytes;
        peak = used > peak ? used : peak;
        void* p = nullptr;
        EXPECT_EQ(cudaMallocAsync(&p, bytes, stream), cudaSuccess);
        return p;
    }
    void deallocate_async(void* p, std::size_t bytes, std::size_t, cudaStream_t stream) {
        used -= bytes;
        EXPECT_EQ(cudaFreeAsync(p, stream), cudaSuccess);
    }
};
// Fragments for which there is no memory at once are drawn in parts of the grid.
TEST(DevicePrograms, DrawInPartsIfMemoryRunsOut) {
    const unit::small_mesh m = unit::make_mesh(7, 200, extent);
    const vp::grid g = box_grid(extent);
    const vp::tessellate<programs::waves> amplify{{2.0f, 1.0f}};
    const auto draw = [&](limited_resource& resource) {
        stream_owner owner;
        vp::cuda_backend gpu{owner.stream, resource};
        gpu.use_graphs = false; // whose memory comes from elsewhere
        const vp::mesh<vp::cuda_backend> mesh(gpu, m.positions, m.triangles);
        programs::framebuffer_of<vp::cuda_backend> fb{gpu, g.extent};
        const vp::status s = vp::voxelize<async_rule>(gpu, mesh, g, programs::add_surface{}, amplify,
                                                      programs::shader{}, fb, vp::program_options(async_rule, 3000));
        EXPECT_TRUE(s.ok()) << s.message();
        return std::pair(vp::get<0>(fb).to_host(gpu), vp::get<1>(fb).to_host(gpu));
    };
    limited_resource all{~std::uint64_t{0}};
    const auto expected = draw(all);
    limited_resource less{all.peak - all.peak / 8};
    const auto found = draw(less);
    EXPECT_GT(less.refused, 0);
    expect_same_bytes(expected.first, found.first, "ids");
    expect_same_bytes(expected.second, found.second, "sums");
}

// ---- calls that do not wait -----------------------------------------------------------------------------------------

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
// Runs call(workspace) with limits that do not suffice, then with those that read_status asks for.
template <class Workspace, class Limits, class Bytes, class Call>
vp::status run_until_it_fits(vp::cuda_backend& gpu, Limits limits, const Bytes& bytes, const Call& call) {
    vp::status s;
    for (int tries = 0; tries < 6; ++tries) {
        const std::size_t n = bytes(limits);
        EXPECT_GT(n, 0u);
        const guarded_memory memory(gpu, n);
        const Workspace workspace{const_cast<unsigned char*>(memory.memory.data()), n, limits};
        s = call(workspace);
        EXPECT_TRUE(s.ok()) << s.message();
        s = vp::read_status(gpu, workspace, &limits);
        memory.expect_untouched_behind(gpu);
        EXPECT_TRUE(s.ok() ? tries > 0 : s.code == vp::status_code::capacity_exceeded) << s.message();
        if (s.ok()) break;
    }
    return s;
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
// In a CUDA graph, for two poses of a mesh.
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
// Drawn without lists: several draws, cleared and loaded targets that are blended or counted in place.
template <vp::coverage Rule, class... Targets, class View, class FragmentShader>
void expect_same_constants(const View& here, const View& there, const FragmentShader& fs) {
    const vp::grid g = box_grid(extent).crop({3, 1, 5}, {40, 36, 41});
    using draw_type = vp::draw<View, elements::place, FragmentShader>;
    const draw_type on_cpu[] = {{here, {}, fs}, {here, {}, fs}}, on_gpu[] = {{there, {}, fs}, {there, {}, fs}};
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, Targets...> a{cpu, g.extent};
    vp::framebuffer<vp::cuda_backend, Targets...> b{gpu, g.extent};
    for (const start how : {start::clear, start::load}) {
        if (how == start::load)
            vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                vp::get<I>(a).load();
                vp::get<I>(b).load();
            });
        const vp::status s = vp::voxelize<Rule>(cpu, std::span<const draw_type>(on_cpu), g, a);
        const vp::status t = vp::voxelize<Rule>(gpu, std::span<const draw_type>(on_gpu), g, b);
        ASSERT_TRUE(s.ok() && t.ok()) << s.message() << t.message();
        EXPECT_GT(s.counts.voxels, 100u);
        expect_same_counts(s.counts, t.counts);
        vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), "target");
        });
    }
}
TEST(DeviceElements, OfConstantsAreTheCpus) {
    const std::vector<glm::vec3> vertices = elements::make_vertices(9, 200, extent);
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i < 300; ++i) indices.push_back(i * 7 % 400);
    vp::cuda_backend gpu;
    const vp::cuda_backend::buffer<glm::vec3> there(gpu, array_of(vertices));
    const vp::cuda_backend::buffer<std::uint32_t> there_indices(gpu, array_of(indices));
    using vp::coverage;
    using counts = vp::target<std::uint32_t, blend::count>;
    using any_bits = vp::target<vp::bit, blend::bit_or>;
    const vp::lines_view<> here_lines{.positions = vertices, .indices = indices, .copies = {2}},
        there_lines{.positions = there.view(), .indices = there_indices.view(), .copies = {2}};
    expect_same_constants<coverage::conservative, counts, any_bits>(here_lines, there_lines, vp::constant(1u, true));
    expect_same_constants<coverage::thin, sums, bits>(here_lines, there_lines, vp::constant(0.1f, true));
    const vp::points_view<> here_points{.positions = vertices, .copies = {2}},
        there_points{.positions = there.view(), .copies = {2}};
    expect_same_constants<coverage::thin, counts>(here_points, there_points, vp::constant(1u));
    expect_same_constants<coverage::conservative, any_bits>(here_points, there_points, vp::constant(true));

    std::vector<std::uint32_t> bad = indices;
    bad[5] = 400;
    const vp::cuda_backend::buffer<std::uint32_t> bad_there(gpu, array_of(bad));
    vp::framebuffer<vp::cuda_backend, counts> fb{gpu, extent};
    const vp::lines_view<> bad_lines{.positions = there.view(), .indices = bad_there.view()};
    const vp::status s =
        vp::voxelize<coverage::thin>(gpu, bad_lines, box_grid(extent), elements::place{}, vp::constant(1u), fb);
    EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
}

TEST(DeviceElements, WithoutWaitsAreTheCpus) {
    const std::vector<glm::vec3> vertices = elements::make_vertices(4, 120, extent);
    vp::cuda_backend gpu;
    const vp::cuda_backend::buffer<glm::vec3> there(gpu, array_of(vertices));
    expect_same_async_elements(vp::lines_view<>{.positions = vertices, .copies = {2}},
                               vp::lines_view<>{.positions = there.view(), .copies = {2}});
    expect_same_async_elements(vp::points_view<>{.positions = vertices}, vp::points_view<>{.positions = there.view()});
}

TEST(DeviceElements, AreTheCpus) {
    const std::vector<glm::vec3> vertices = elements::make_vertices(4, 120, extent);
    const vp::grid g = box_grid(extent).crop({3, 1, 5}, {40, 36, 41});
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const vp::cuda_backend::buffer<glm::vec3> there(gpu, array_of(vertices));
    const vp::lines_view<> here_lines{.positions = vertices, .copies = {2}},
        there_lines{.positions = there.view(), .copies = {2}};
    const vp::points_view<> here_points{.positions = vertices, .copies = {2}},
        there_points{.positions = there.view(), .copies = {2}};
    for (const vp::coverage rule : both_rules) {
        elements::expect_same(elements::draw_all(cpu, here_lines, g, rule),
                              elements::draw_all(gpu, there_lines, g, rule));
        elements::expect_same(elements::draw_all(cpu, here_points, g, rule),
                              elements::draw_all(gpu, there_points, g, rule));
    }
}

TEST(DeviceField, GivesItsGoldenValues) {
    vp::cuda_backend gpu;
    const std::vector<glm::vec3> plane = fields::plane_texels();
    const std::vector<float> box = fields::box_texels();
    const vp::cuda_backend::buffer<glm::vec3> there_plane(gpu, array_of(plane));
    const vp::cuda_backend::buffer<float> there_box(gpu, array_of(box));
    vp::cuda_backend::buffer<glm::vec4> out(gpu, std::size_t{fields::num_samples});
    gpu.for_each(fields::num_samples, fields::make_sampler(there_plane.data(), there_box.data(), out.data()));
    EXPECT_EQ(fields::digest(out.to_host(gpu)), fields::golden);
}

TEST(DeviceLevels, AreTheCpus) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    EXPECT_EQ(levels::all_reduced(cpu), levels::all_reduced(gpu));
    const std::vector<std::byte> light = levels::all_light(gpu);
    EXPECT_EQ(levels::all_light(cpu), light);
    EXPECT_EQ(levels::digest(light), levels::golden_light);
}
TEST(DeviceLevels, RaysThroughBitsAreTheCpus) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    expect_same_bytes(levels::all_rays(cpu), levels::all_rays(gpu), "rays");
}

} // namespace programs_tests
