// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Every kernel of fragment lists on small loads, quick enough for compute-sanitizer.

#include "async_lists.hpp"
#include "cells.hpp"
#include "subset_meshes.hpp"

#include <algorithm>
#include <span>

using namespace device_test;

namespace {

TEST(SmallLists, OfConstantAndComputedPayloadsAreTheCpus) {
    const mesh_data m = mixed_triangles(300, 30.0f, 62);
    const vp::grid g = box_grid({30, 21, 33});
    for (const vp::coverage rule : both_rules) {
        expect_same_lists<void>(m, g, vp::passthrough{}, vp::constant(true), rule);
        expect_same_lists<float>(m, g, shift{0.5f}, vp::constant(0.5f), rule);
        expect_same_lists<double>(m, g, vp::passthrough{}, any_double{}, rule);
    }
}

struct shaded_late {
    std::uint32_t discards = 0; // one fragment in this many is discarded; 0: none

    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h = mix_bits(f.primitive * 7u + static_cast<std::uint32_t>(f.voxel.x + f.voxel.z));
        return vp::outputs(vp::exact::add(f.barycentric.y, f.normal.z)).discard_if(discards != 0 && h % discards == 0);
    }
};

// Lists are shaded in place as long as nothing is discarded. One backend gets calls that discard and calls that do not,
// the first often enough to become a graph, with voxels of one fragment and of thousands.
template <class Payload>
void list_late(vp::coverage rule) {
    mesh_data m = mixed_triangles(400, 30.0f, 63);
    append(m, triangles_in_voxel(9000, {3.0f, 2.0f, 4.0f}, 64));
    append(m, triangles_in_voxel(600, {9.0f, 2.0f, 4.0f}, 65));
    const vp::grid g = box_grid({30, 21, 33});
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const vp::mesh<vp::cpu_backend> on_cpu(cpu, m.positions, m.triangles);
    const vp::mesh<vp::cuda_backend> on_gpu(gpu, m.positions, m.triangles);
    vp::abuffer<vp::cpu_backend, Payload> expected{cpu};
    vp::abuffer<vp::cuda_backend, Payload> lists{gpu};
    for (const std::uint32_t discards : {0u, 0u, 0u, 0u, 0u, 3u, 3u, 0u, 1u}) {
        SCOPED_TRACE(discards);
        const vp::status a = vp::voxelize(cpu, on_cpu, g, vp::passthrough{}, shaded_late{discards}, expected, rule);
        const vp::status b = vp::voxelize(gpu, on_gpu, g, vp::passthrough{}, shaded_late{discards}, lists, rule);
        ASSERT_TRUE(a.ok() && b.ok()) << b.message();
        EXPECT_EQ(b.counts.fragments_discarded != 0, discards != 0);
        expect_same_counts(a.counts, b.counts);
        expect_same_on_host(expected.to_host(cpu), lists.to_host(gpu));
    }
}

TEST(SmallLists, ShadedInPlaceAreTheCpus) {
    for (const vp::coverage rule : both_rules) {
        list_late<float>(rule);
        list_late<void>(rule);
    }
}

// The last voxel of this grid is number 2^33 - 1.
const vp::grid large_grid = box_grid({2048, 2048, 2048});
mesh_data far_triangles(std::uint32_t seed) { return translated(mixed_triangles(80, 25.0f, seed), glm::vec3(2020.0f)); }

TEST(SmallLists, OfVoxelNumbersBeyond32BitsAreTheCpus) {
    for (const vp::coverage rule : both_rules) {
        expect_same_lists<void>(far_triangles(68), large_grid, vp::passthrough{}, vp::constant(true), rule);
        expect_same_lists<double>(far_triangles(69), large_grid, vp::passthrough{}, any_double{}, rule);
    }
}

template <class Payload, class FragmentShader>
void compare_without_a_wait(const std::vector<mesh_data>& parts, const vp::grid& g, const FragmentShader& fs,
                            vp::coverage rule) {
    for (const bool lists_fragments : {false, true}) {
        list_call<Payload, FragmentShader> call(parts, g, fs, rule, lists_fragments);
        call.launch();
        call.expect_the_cpus();
    }
}

TEST(SmallLists, OfAsynchronousCallsAreTheCpus) {
    const vp::grid g = box_grid({30, 21, 33});
    for (const vp::coverage rule : both_rules) {
        compare_without_a_wait<void>({mixed_triangles(300, 30.0f, 70)}, g, vp::constant(true), rule);
        compare_without_a_wait<double>({mixed_triangles(200, 30.0f, 71), mixed_triangles(100, 30.0f, 72)}, g,
                                       any_double{}, rule);
        compare_without_a_wait<double>({mixed_triangles(300, 30.0f, 74)}, g, any_double{}, rule);
        compare_without_a_wait<double>({far_triangles(73)}, large_grid, any_double{}, rule);
    }
}

// A mesh, two instances of a third of another, and the first again; or the middle one alone, once, which goes through
// other kernels.
template <class Backend, class FragmentShader>
struct subset_draws {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    mesh_data a = mixed_triangles(150, 30.0f, 75), b = mixed_triangles(300, 30.0f, 76);
    vp::mesh<Backend> first, second;
    some_triangles<Backend> some;
    std::vector<draw_type> draws;
    subset_draws(Backend& backend, const FragmentShader& fs, bool alone)
        : first(backend, a.positions, a.triangles), second(backend, b.positions, b.triangles),
          some(backend, b.triangles) {
        if (!alone) draws.push_back({first.view(), {}, fs});
        draws.push_back({some.of(second.view(), alone ? 1 : 2), {}, fs});
        if (!alone) draws.push_back({first.view(), {}, fs});
    }
};
template <class Payload, class FragmentShader>
void list_subsets(const FragmentShader& fs, bool is_async) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    const vp::grid g = box_grid({30, 21, 33});
    for (const bool alone : {false, true}) {
        SCOPED_TRACE(alone ? "alone" : "among others");
        const subset_draws<vp::cpu_backend, FragmentShader> here(cpu, fs, alone);
        const subset_draws<vp::cuda_backend, FragmentShader> there(gpu, fs, alone);
        const std::span draws(there.draws);
        vp::abuffer<vp::cpu_backend, Payload> expected{cpu};
        ASSERT_TRUE(vp::voxelize(cpu, std::span(here.draws), g, expected).ok());
        const auto lists_of_cpu = expected.to_host(cpu);
        // More than are drawn.
        EXPECT_GT(*std::max_element(lists_of_cpu.primitives.begin(), lists_of_cpu.primitives.end()),
                  there.draws.size() * 200);
        if (!is_async) {
            vp::abuffer<vp::cuda_backend, Payload> lists{gpu};
            const vp::status s = vp::voxelize(gpu, draws, g, lists);
            ASSERT_TRUE(s.ok()) << s.message();
            expect_same_on_host(lists_of_cpu, lists.to_host(gpu));
            continue;
        }
        const vp::workspace_limits limits{0, 0, 1 << 17, 1 << 16, alone};
        vp::abuffer_view<Payload> lists;
        const guarded_memory memory(gpu, vp::workspace_bytes(draws, g, lists, {}, limits));
        const vp::workspace_view workspace{const_cast<unsigned char*>(memory.memory.data()), memory.bytes, limits};
        ASSERT_TRUE(vp::voxelize_async(gpu, draws, g, lists, {}, workspace).ok());
        const vp::status s = vp::read_status(gpu, workspace);
        ASSERT_TRUE(s.ok()) << s.message();
        expect_same_on_host(lists_of_cpu, lists.to_host(gpu));
        memory.expect_untouched_behind(gpu);
    }
}

TEST(SmallLists, OfSubsetsAreTheCpus) {
    list_subsets<void>(vp::constant(true), false);
    list_subsets<float>(shaded_late{}, false);
    list_subsets<float>(shaded_late{3}, false);
    list_subsets<void>(vp::constant(true), true);
    list_subsets<double>(any_double{}, true);
}

// One draw of a constant shader is listed by the raster; for several draws, vertices are shaded first.
TEST(SmallLists, StageTimesAddUpToTheCall) {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<bool>>;
    const mesh_data m = mixed_triangles(300, 30.0f, 65);
    const vp::grid g = box_grid({30, 21, 33});
    vp::cuda_backend be;
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    for (const std::size_t num_draws : {std::size_t{1}, std::size_t{2}}) {
        SCOPED_TRACE(std::to_string(num_draws) + " draws");
        const std::vector<draw_type> draws(num_draws, draw_type{mesh.view(), {}, vp::constant(true)});
        vp::abuffer<vp::cuda_backend, void> timed{be}, plain{be};
        const auto draw = [&](vp::abuffer<vp::cuda_backend, void>& lists) {
            return vp::voxelize(be, std::span<const draw_type>(draws), g, lists);
        };
        ASSERT_TRUE(draw(plain).ok());
        const vp::stage_times times = time_stages(be, [&] { return draw(timed); });
        for (const double some : {times.fine_raster, times.tile_sort, times.abuffer_emit}) EXPECT_GT(some, 0.0);
        EXPECT_EQ(times.vertex_shade > 0.0, num_draws > 1);
        EXPECT_EQ(times.coarse_raster, 0.0);
        expect_same_on_host(plain.to_host(be), timed.to_host(be));
    }
}

} // namespace
