// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Instances, tessellation and geometry programs, points and lines on the device: the bytes of cpu_backend, for every
// strategy, in lists and in solids, for any chunk capacity. Levels of dense grids and rays through bits too.

#include "../programs/field_cases.hpp"
#include "../programs/levels_cases.hpp"
#include "programs_support.hpp"

#include <gtest/gtest.h>

#include <tuple>

namespace programs_tests { // named: nvcc warns of members of unnamed ones that the host does not use

namespace blend = voxelpipe::blend;
using namespace device_test;
using namespace programs_support;

// The same call on both backends, with `copies` instances of a mesh; compares targets and counts.
template <vp::coverage Rule, class... Targets, class VertexShader, class FragmentShader>
void expect_same_instances(const mesh_data& m, std::uint64_t copies, const VertexShader& vs, const FragmentShader& fs,
                           std::initializer_list<vp::strategy> strategies, const glm::ivec3& size = extent) {
    const vp::grid g = box_grid(size);
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

// More triangles than a pass takes in a grid of long sides: most of them have no area and lie in one voxel.
TEST(DeviceInstances, AreDrawnInPasses) {
    mesh_data m = mixed_triangles(64, 12.0f, 11);
    m.triangles.resize(vp::tuning::min_pass_triangles / 3, glm::uvec3(m.triangles[0].x));
    expect_same_instances<vp::coverage::conservative, bits>(m, 4, placed{}, vp::constant(true),
                                                            {vp::strategy::immediate}, {1 << 14, 1 << 14, 1});
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
// Targets are drawn in parts of the grid, whose lists take less memory at once.
TEST(DeviceElements, ListsAreBounded) {
    const std::vector<glm::vec3> vertices = elements::make_vertices(8, 12000, extent);
    const auto draw = [&](limited_resource& resource, std::uint64_t list_bytes) {
        stream_owner owner;
        vp::cuda_backend gpu{owner.stream, resource};
        const vp::cuda_backend::buffer<glm::vec3> there(gpu, array_of(vertices));
        vp::framebuffer<vp::cuda_backend, elements::ids, elements::sums, elements::bits> fb{gpu, extent};
        const vp::status s =
            vp::voxelize(gpu, vp::lines_view<>{.positions = there.view()}, box_grid(extent), elements::place{},
                         elements::shader{}, fb, vp::program_options(vp::coverage::conservative, 1 << 20, list_bytes));
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_GT(s.counts.fragments, 40000u);
        return std::tuple(s.counts, vp::get<0>(fb).to_host(gpu), vp::get<1>(fb).to_host(gpu));
    };
    limited_resource all{~std::uint64_t{0}}, less{~std::uint64_t{0}};
    const auto [counts, ids, sums] = draw(all, 0);
    const auto [less_counts, less_ids, less_sums] = draw(less, 500'000);
    expect_same_counts(counts, less_counts);
    expect_same_bytes(ids, less_ids, "ids");
    expect_same_bytes(sums, less_sums, "sums");
    EXPECT_LT(less.peak + 1'000'000, all.peak);
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
