// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Calls of one backend with the same arguments, which it keeps as a CUDA graph from the third call on. The contents of
// meshes and targets may change between calls, and so may the arguments.

#include "cells.hpp"

#include <gtest/gtest.h>

#include <span>
#include <vector>

namespace {

using namespace device_test;
namespace blend = voxelpipe::blend;

// A mesh whose arrays can be written between calls.
struct open_mesh {
    vp::cuda_backend::buffer<glm::vec3> positions;
    vp::cuda_backend::buffer<glm::uvec3> triangles;

    open_mesh(vp::cuda_backend& gpu, const mesh_data& m)
        : positions(gpu, vp::array_view<const glm::vec3>(m.positions.data(), m.positions.size())),
          triangles(gpu, vp::array_view<const glm::uvec3>(m.triangles.data(), m.triangles.size())) {}
    void write(vp::cuda_backend& gpu, const mesh_data& m) {
        ASSERT_EQ(cudaMemcpyAsync(positions.data(), m.positions.data(), m.positions.size() * sizeof(glm::vec3),
                                  cudaMemcpyHostToDevice, gpu.stream),
                  cudaSuccess);
        ASSERT_EQ(cudaMemcpyAsync(triangles.data(), m.triangles.data(), m.triangles.size() * sizeof(glm::uvec3),
                                  cudaMemcpyHostToDevice, gpu.stream),
                  cudaSuccess);
    }
};

template <class... Targets, class Shader>
void repeat(vp::cuda_backend& gpu, const Shader& shader) {
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    vp::cpu_backend cpu;
    mesh_data m = mixed_triangles(1200, 40.0f, 220);
    const std::vector<glm::vec3> positions = m.positions;
    open_mesh on_gpu(gpu, m);
    const draw on_device{{on_gpu.positions.view(), on_gpu.triangles.view()}, {}, shader};
    vp::grid g = box_grid({40, 33, 47});
    vp::framebuffer<vp::cuda_backend, Targets...> gpu_fb{gpu, g.extent};
    vp::framebuffer<vp::cpu_backend, Targets...> cpu_fb{cpu, g.extent};
    for (int call = 0; call < 16; ++call) {
        SCOPED_TRACE(call);
        const bool is_bad = call == 5, is_other = call == 8 || call == 13;
        for (std::size_t i = 0; i < positions.size(); ++i)
            m.positions[i] = (call < 3 ? 1.0f : 1.0f + 0.1f * static_cast<float>(call % 4)) * positions[i];
        const glm::uvec3 first = m.triangles[0];
        if (is_bad) m.triangles[0].x = static_cast<std::uint32_t>(positions.size());
        on_gpu.write(gpu, m);
        const vp::voxelize_options options{is_other ? vp::coverage::thin : vp::coverage::conservative, call < 12};
        if (call == 10) gpu.release();
        if (call == 14) g.origin.x += 0.25f;
        const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
        const draw on_host{cpu_mesh.view(), {}, shader};
        const vp::status a = vp::voxelize(gpu, std::span<const draw>(&on_device, 1), g, gpu_fb, options);
        const vp::status b = vp::voxelize(cpu, std::span<const draw>(&on_host, 1), g, cpu_fb, options);
        m.triangles[0] = first;
        ASSERT_EQ(a.code, b.code) << a.message();
        ASSERT_EQ(a.ok(), !is_bad) << a.message();
        if (a.ok()) expect_same_counts(b.counts, a.counts);
        vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { // a failed call changes nothing
            expect_same_bytes(vp::get<I>(cpu_fb).to_host(cpu), vp::get<I>(gpu_fb).to_host(gpu),
                              ("target " + std::to_string(I)).c_str());
        });
    }
}

// Lists, in two sets of arrays that alternate. The vertices give as many fragments as before, more, fewer and none. An
// index out of range leaves the lists unchanged.
template <class Payload, class Shader>
void repeat_lists(vp::cuda_backend& gpu, const Shader& shader) {
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    vp::cpu_backend cpu;
    mesh_data m = mixed_triangles(1200, 40.0f, 222);
    const std::vector<glm::vec3> positions = m.positions;
    open_mesh on_gpu(gpu, m);
    const draw on_device{{on_gpu.positions.view(), on_gpu.triangles.view()}, {}, shader};
    const vp::grid g = box_grid({40, 33, 47});
    vp::abuffer<vp::cuda_backend, Payload> lists[2] = {vp::abuffer<vp::cuda_backend, Payload>{gpu},
                                                       vp::abuffer<vp::cuda_backend, Payload>{gpu}};
    vp::abuffer<vp::cpu_backend, Payload> expected[2] = {vp::abuffer<vp::cpu_backend, Payload>{cpu},
                                                         vp::abuffer<vp::cpu_backend, Payload>{cpu}};
    const float scales[] = {1.0f, 1.0f, 1.0f, 1.0f, 0.97f, 0.98f, 1.0f, 1.0f, 1.3f, 1.3f, 1.28f,
                            1.3f, 0.3f, 1.3f, 1.3f, -9.f,  1.2f,  1.2f, 1.2f, 1.2f, 1.2f};
    int call = 0;
    for (const float scale : scales) {
        SCOPED_TRACE(call);
        const bool is_bad = call == 6 || call == 18;
        const int which = call % 3 == 0 ? 0 : 1;
        for (std::size_t i = 0; i < positions.size(); ++i) m.positions[i] = scale * positions[i];
        const glm::uvec3 first = m.triangles[0];
        if (is_bad) m.triangles[0].x = static_cast<std::uint32_t>(positions.size());
        on_gpu.write(gpu, m);
        const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
        const draw on_host{cpu_mesh.view(), {}, shader};
        const vp::coverage rule = vp::coverage::conservative;
        const vp::status a = vp::voxelize(gpu, std::span<const draw>(&on_device, 1), g, lists[which], rule);
        const vp::status b = vp::voxelize(cpu, std::span<const draw>(&on_host, 1), g, expected[which], rule);
        m.triangles[0] = first;
        ASSERT_EQ(a.code, b.code) << a.message();
        ASSERT_EQ(a.ok(), !is_bad) << a.message();
        if (a.ok()) expect_same_counts(b.counts, a.counts);
        for (int k = 0; k < 2; ++k) expect_same_on_host(expected[k].to_host(cpu), lists[k].to_host(gpu));
        ++call;
    }
}

// On the legacy default stream, which cannot be captured, and on the caller's stream.
template <class... Targets, class Shader>
void repeat_everywhere(const Shader& shader) {
    for (const bool keeps : {true, false}) {
        SCOPED_TRACE(keeps);
        vp::cuda_backend on_default;
        on_default.use_graphs = keeps;
        repeat<Targets...>(on_default, shader);
        const stream_owner s;
        vp::cuda_backend on_own{s.stream};
        on_own.use_graphs = keeps;
        repeat<Targets...>(on_own, shader);
    }
}

TEST(KeptGraphs, WithoutTilesGiveTheCpusBytes) {
    repeat_everywhere<vp::target<vp::bit, blend::bit_or>, vp::target<float, blend::add>>(vp::constant(true, 0.1f));
}

// The host does not poll for counters, because its threads are set to sleep while they wait for the device.
TEST(KeptGraphs, OfSleepingThreadsGiveTheCpusBytes) {
    unsigned before = 0, now = 0;
    ASSERT_EQ(cudaGetDeviceFlags(&before), cudaSuccess);
    ASSERT_EQ(cudaSetDeviceFlags(cudaDeviceScheduleBlockingSync), cudaSuccess);
    ASSERT_EQ(cudaGetDeviceFlags(&now), cudaSuccess);
    EXPECT_NE(now & cudaDeviceScheduleBlockingSync, 0u);
    repeat_everywhere<vp::target<vp::bit, blend::bit_or>>(vp::constant(true));
    EXPECT_EQ(cudaSetDeviceFlags(before & cudaDeviceScheduleMask), cudaSuccess);
}

// Through tiles, and through lists for the ordered blend.
TEST(KeptGraphs, ThroughTilesAndListsGiveTheCpusBytes) {
    using first = vp::target<std::int32_t, blend::max>;
    using second = vp::target<float, blend::replace>;
    repeat_everywhere<first, second>(any_values<first, second>{});
}

TEST(KeptGraphs, OfListsGiveTheCpusBytes) {
    for (const bool keeps : {true, false}) {
        SCOPED_TRACE(keeps);
        vp::cuda_backend on_default;
        on_default.use_graphs = keeps;
        repeat_lists<void>(on_default, vp::constant(true));
        repeat_lists<float>(on_default, vp::constant(0.5f));
        const stream_owner s;
        vp::cuda_backend on_own{s.stream};
        on_own.use_graphs = keeps;
        repeat_lists<float>(on_own, vp::constant(0.5f));
        repeat_lists<double>(on_own, any_double{});
    }
}

// Framebuffers and lists of one backend alternate in the same memory.
TEST(KeptGraphs, OfListsAndFramebuffersGiveTheCpusBytes) {
    const mesh_data m = mixed_triangles(800, 30.0f, 223);
    const vp::grid g = box_grid({31, 30, 29});
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const vp::mesh<vp::cuda_backend> gpu_mesh{gpu, m.positions, m.triangles};
    const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_or>> fb{gpu, g.extent};
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, blend::bit_or>> expected_fb{cpu, g.extent};
    vp::abuffer<vp::cuda_backend, void> lists{gpu};
    vp::abuffer<vp::cpu_backend, void> expected{cpu};
    const vp::coverage rule = vp::coverage::conservative;
    ASSERT_TRUE(vp::voxelize(cpu, cpu_mesh, g, vp::passthrough{}, vp::constant(true), expected_fb, rule).ok());
    ASSERT_TRUE(vp::voxelize(cpu, cpu_mesh, g, vp::passthrough{}, vp::constant(true), expected, rule).ok());
    for (const char which :
         {'f', 'l', 'f', 'l', 'l', 'l', 'l', 'f', 'f', 'f', 'f', 'l', 'l', 'r', 'l', 'l', 'l', 'f'}) {
        if (which == 'f') {
            ASSERT_TRUE(vp::voxelize(gpu, gpu_mesh, g, vp::passthrough{}, vp::constant(true), fb, rule).ok());
            expect_same_bytes(vp::get<0>(expected_fb).to_host(cpu), vp::get<0>(fb).to_host(gpu), "bits");
            ASSERT_EQ(cudaMemset(vp::get<0>(fb.view().targets).elements, 0x5a, 64), cudaSuccess);
        } else if (which == 'l') {
            ASSERT_TRUE(vp::voxelize(gpu, gpu_mesh, g, vp::passthrough{}, vp::constant(true), lists, rule).ok());
            expect_same_on_host(expected.to_host(cpu), lists.to_host(gpu));
        } else {
            gpu.release();
        }
    }
}

// A kernel that earlier calls did not need is omitted, and the next call needs it. Meshes with `count` triangles
// alternate: each triangle in its own voxel, all over many voxels if `large`, or all in one voxel.
mesh_data spread_triangles(int count, bool large) {
    mesh_data m;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 corner(0.2f + static_cast<float>(i % 40), 0.3f + static_cast<float>(i / 40 % 40),
                               0.3f + static_cast<float>(i / 1600 % 40));
        const float size = large && i % 50 == 0 ? 1.0f + static_cast<float>(i % 7) * 4.0f : 0.5f;
        add_triangle(m, corner, corner + glm::vec3(size, 0.1f, 0.0f), corner + glm::vec3(0.1f, size, 0.7f * size));
    }
    return m;
}

// Meshes with the same number of triangles, in the given sequence, into one target. It is cleared each time, or with
// `loads` the first time only.
template <class Target, class Shader>
void draw_in_turn(const std::vector<mesh_data>& meshes, const std::vector<int>& sequence, const Shader& shader,
                  const call_options& options, indices known, bool loads = false) {
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const vp::grid g = box_grid({47, 46, 45});
    open_mesh on_gpu(gpu, meshes[0]);
    draw on_device{{on_gpu.positions.view(), on_gpu.triangles.view()}, {}, shader};
    if (known == indices::checked) on_device.mesh.checked = vp::check_indices(gpu, on_device.mesh.triangles);
    vp::framebuffer<vp::cuda_backend, Target> gpu_fb{gpu, g.extent};
    vp::framebuffer<vp::cpu_backend, Target> cpu_fb{cpu, g.extent};
    for (std::size_t i = 0; i < sequence.size(); ++i) {
        SCOPED_TRACE(testing::Message() << "call " << i << ", mesh " << sequence[i]);
        const mesh_data& m = meshes[static_cast<std::size_t>(sequence[i])];
        on_gpu.write(gpu, m);
        const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
        const draw on_host{cpu_mesh.view(), {}, shader};
        auto to_gpu = gpu_fb.view();
        auto to_cpu = cpu_fb.view();
        if (loads && i != 0)
            vp::get<0>(to_gpu.targets).load = vp::get<0>(to_cpu.targets).load = vp::load_operation::load;
        const vp::status a = vp::voxelize(gpu, std::span<const draw>(&on_device, 1), g, to_gpu, options);
        const vp::status b = vp::voxelize(cpu, std::span<const draw>(&on_host, 1), g, to_cpu, options);
        ASSERT_TRUE(a.ok() && b.ok()) << a.message();
        expect_same_counts(b.counts, a.counts);
        expect_same_bytes(vp::get<0>(cpu_fb).to_host(cpu), vp::get<0>(gpu_fb).to_host(gpu), "target");
    }
}

TEST(KeptGraphs, MayNeedTheSecondKernelOrNot) {
    const std::vector<mesh_data> meshes{spread_triangles(3000, false), spread_triangles(3000, true)};
    for (const bool loads : {false, true})
        draw_in_turn<vp::target<float, blend::add>>(meshes, {0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 0, 1},
                                                    vp::constant(1.0f), {vp::coverage::conservative, false},
                                                    indices::unknown, loads);
}

// Fine meshes with few larger triangles. From the second call on, the first kernel draws these too.
enum : int { none_left, few_left, many_left, large_left };
std::vector<mesh_data> fine_meshes() {
    constexpr int count = 2000;
    return {fine_triangles(count, 0, 0.0f), fine_triangles(count, 20, 2.8f), fine_triangles(count, 2, 2.8f),
            fine_triangles(count, 20, 30.0f)};
}
const std::vector<int> fine_sequence{few_left, few_left,  few_left, few_left, none_left,  many_left,
                                     few_left, none_left, few_left, few_left, large_left, few_left};
const std::vector<int> fine_sequence_from_none{none_left,  none_left, few_left, few_left,
                                               large_left, few_left,  few_left};

TEST(KeptGraphs, OfAFineMeshWithAFewLargerTrianglesGiveTheCpusBytes) {
    const std::vector<mesh_data> meshes = fine_meshes();
    for (const vp::coverage rule : both_rules)
        for (const auto& sequence : {fine_sequence, fine_sequence_from_none}) {
            using bits = vp::target<vp::bit, blend::bit_or>;
            const vp::voxelize_options uncounted{rule, false}, counted{rule, true};
            draw_in_turn<bits>(meshes, sequence, vp::constant(true), uncounted, indices::checked);
            draw_in_turn<bits>(meshes, sequence, vp::constant(true), uncounted, indices::checked, true);
            draw_in_turn<bits>(meshes, sequence, vp::constant(true), counted, indices::unknown);
            draw_in_turn<bits>(meshes, sequence, vp::constant(true), counted, indices::unknown, true);
            draw_in_turn<vp::target<vp::bit, blend::bit_xor>>(meshes, sequence, vp::constant(true), counted,
                                                              indices::unknown);
            draw_in_turn<vp::target<float, blend::replace>>(meshes, sequence, vp::constant(2.5f), counted,
                                                            indices::unknown);
        }
}

TEST(KeptGraphs, OfAFineMeshWithAFewLargerTrianglesShadedGiveTheCpusBytes) {
    using sum = vp::target<float, blend::add>;
    using last = vp::target<double, blend::replace>;
    const std::vector<mesh_data> meshes = fine_meshes();
    for (const vp::coverage rule : both_rules) {
        draw_in_turn<sum>(meshes, fine_sequence, any_values<sum>{}, rule, indices::unknown);
        draw_in_turn<last>(meshes, fine_sequence, any_values<last>{}, rule, indices::unknown, true);
    }
}

// The same into lists, which each call allocates: mesh_of(i) for the numbers i of the sequence.
template <class Payload, class Shader, class MeshOf>
void list_in_turn(const MeshOf& mesh_of, const std::vector<int>& sequence, const vp::grid& g, const Shader& shader,
                  vp::coverage rule) {
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    open_mesh on_gpu(gpu, mesh_of(sequence[0]));
    const draw on_device{{on_gpu.positions.view(), on_gpu.triangles.view()}, {}, shader};
    vp::abuffer<vp::cuda_backend, Payload> lists{gpu};
    vp::abuffer<vp::cpu_backend, Payload> expected{cpu};
    for (std::size_t i = 0; i < sequence.size(); ++i) {
        SCOPED_TRACE(testing::Message() << "call " << i << ", mesh " << sequence[i]);
        const mesh_data m = mesh_of(sequence[i]);
        on_gpu.write(gpu, m);
        const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
        const draw on_host{cpu_mesh.view(), {}, shader};
        const vp::status a = vp::voxelize(gpu, std::span<const draw>(&on_device, 1), g, lists, rule);
        const vp::status b = vp::voxelize(cpu, std::span<const draw>(&on_host, 1), g, expected, rule);
        ASSERT_TRUE(a.ok() && b.ok()) << a.message();
        expect_same_counts(b.counts, a.counts);
        expect_same_on_host(expected.to_host(cpu), lists.to_host(gpu));
    }
}

TEST(KeptGraphs, OfAFineMeshWithAFewLargerTrianglesGiveTheCpusLists) {
    const std::vector<mesh_data> meshes = fine_meshes();
    const auto mesh_of = [&](int which) { return meshes[static_cast<std::size_t>(which)]; };
    const vp::grid g = box_grid({47, 46, 45});
    for (const vp::coverage rule : both_rules) {
        list_in_turn<void>(mesh_of, fine_sequence, g, vp::constant(true), rule);
        list_in_turn<double>(mesh_of, fine_sequence, g, any_double{}, rule); // some fragments are discarded
    }
}

// Voxels of one fragment; for a window and a warp; for a block; dense ones, by bits; and merged runs, which need many
// more triangles.
TEST(KeptGraphs, MayHaveLongVoxelsOrNot) {
    // The first `inside` triangles lie in one voxel.
    const auto meshes_of = [](bool is_many) {
        return [is_many](int inside) {
            constexpr int count = 9000;
            mesh_data m = spread_triangles(count, false);
            if (is_many) append(m, spread_triangles(64 * count, false));
            const mesh_data one = triangles_in_voxel(inside, {3, 4, 5}, 7);
            std::copy(one.positions.begin(), one.positions.end(), m.positions.begin());
            return m;
        };
    };
    const vp::grid g = box_grid({41, 41, 41});
    const vp::coverage rule = vp::coverage::conservative;
    const std::vector<int> sequence{0, 0, 0, 0, 0, 700, 0, 0, 0, 0, 3000, 0, 8000, 4000, 1, 8000, 300};
    list_in_turn<void>(meshes_of(false), sequence, g, vp::constant(true), rule);
    list_in_turn<double>(meshes_of(false), sequence, g, any_double{}, rule); // shaded in place
    list_in_turn<void>(meshes_of(true), {0, 0, 8000}, g, vp::constant(true), rule);
}

// Many fragments a voxel, which are sorted by counting, and few, which are not. The earlier call decides, and the
// memory then holds other data.
TEST(KeptGraphs, MayHaveManyFragmentsAVoxelOrFew) {
    constexpr int count = 6400;
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, decltype(vp::constant(true))>;
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const vp::grid g = box_grid({41, 41, 41});
    const mesh_data few = spread_triangles(count, false);
    mesh_data many;
    for (int i = 0; i < 100; ++i)
        append(many, triangles_in_voxel(count / 100, {i % 10, 3 * (i / 10), i % 7}, static_cast<std::uint32_t>(i)));
    ASSERT_EQ(few.triangles.size(), many.triangles.size());
    ASSERT_EQ(few.positions.size(), many.positions.size());
    open_mesh on_gpu(gpu, few);
    const draw on_device{{on_gpu.positions.view(), on_gpu.triangles.view()}, {}, vp::constant(true)};
    vp::abuffer<vp::cuda_backend> lists{gpu};
    vp::abuffer<vp::cpu_backend> expected{cpu};
    for (const bool is_many :
         {false, false, false, false, true, true, true, true, true, false, true, false, false, true}) {
        const mesh_data& m = is_many ? many : few;
        on_gpu.write(gpu, m);
        const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
        const draw on_host{cpu_mesh.view(), {}, vp::constant(true)};
        for (const vp::coverage rule : both_rules) {
            const vp::status a = vp::voxelize(gpu, std::span<const draw>(&on_device, 1), g, lists, rule);
            const vp::status b = vp::voxelize(cpu, std::span<const draw>(&on_host, 1), g, expected, rule);
            ASSERT_TRUE(a.ok() && b.ok()) << a.message();
            expect_same_counts(b.counts, a.counts);
            expect_same_on_host(expected.to_host(cpu), lists.to_host(gpu));
        }
        for (int i = 0; i < 3; ++i) // as a graph
            ASSERT_TRUE(vp::voxelize(gpu, std::span<const draw>(&on_device, 1), g, lists, vp::coverage::thin).ok());
        ASSERT_TRUE(vp::voxelize(cpu, std::span<const draw>(&on_host, 1), g, expected, vp::coverage::thin).ok());
        expect_same_on_host(expected.to_host(cpu), lists.to_host(gpu));
    }
}

TEST(KeptGraphs, WithAlternatingArgumentsGiveTheCpusBytes) {
    const mesh_data m = mixed_triangles(800, 30.0f, 221);
    const vp::grid g = box_grid({31, 30, 29});
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    const vp::mesh<vp::cuda_backend> gpu_mesh{gpu, m.positions, m.triangles};
    const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
    using framebuffer_of_gpu = vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_or>>;
    framebuffer_of_gpu a{gpu, g.extent}, b{gpu, g.extent};
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, blend::bit_or>> expected{cpu, g.extent};
    for (const char which : {'a', 'b', 'a', 'b', 'a', 'a', 'a', 'a', 'b', 'b', 'b', 'b', 'a', 'b'}) {
        framebuffer_of_gpu& fb = which == 'a' ? a : b;
        const vp::coverage rule = which == 'a' ? vp::coverage::thin : vp::coverage::conservative;
        ASSERT_TRUE(vp::voxelize(gpu, gpu_mesh, g, vp::passthrough{}, vp::constant(true), fb, rule).ok());
        ASSERT_TRUE(vp::voxelize(cpu, cpu_mesh, g, vp::passthrough{}, vp::constant(true), expected, rule).ok());
        expect_same_bytes(vp::get<0>(expected).to_host(cpu), vp::get<0>(fb).to_host(gpu), "bits");
        ASSERT_EQ(cudaMemset(vp::get<0>(fb.view().targets).elements, 0x5a, 64), cudaSuccess);
    }
}

} // namespace
