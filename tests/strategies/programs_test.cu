// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Instances, tessellation and geometry programs, points and lines on the device: the bytes of cpu_backend, for every
// strategy, in lists and in solids, for any chunk capacity. Levels of dense grids and rays through bits too.

#include "../programs/amplify_cases.hpp"
#include "../programs/elements_cases.hpp"
#include "../programs/field_cases.hpp"
#include "../programs/levels_cases.hpp"
#include "device_test.hpp"

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
    for (const std::uint64_t chunk : {std::uint64_t{1} << 24, std::uint64_t{300}}) {
        vp::cuda_backend gpu;
        programs::expect_same(expected, programs::draw_all<rule>(gpu, m, g, amplify, {rule, chunk}));
    }
}
TEST(DevicePrograms, TessellationIsTheCpus) {
    expect_same_programs(1, 20, vp::tessellate{programs::waves{2.3f, 1.5f}});
}
TEST(DevicePrograms, GeometryIsTheCpus) { expect_same_programs(2, 60, vp::geometry{programs::prism{0.8f}}); }
TEST(DevicePrograms, GeometryOfATessellationIsTheCpus) {
    expect_same_programs(3, 20, vp::tessellate{programs::waves{4.1f, 1.0f}} | vp::geometry{programs::prism{0.8f}});
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
