// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Lists of constant shaders, which have their own kernels: with a payload, with vertex shaders that run in the raster
// and one that runs before it, with triangles of every size and voxels of many fragments.

#include "cells.hpp"

#include <algorithm>
#include <random>

using namespace device_test;

namespace {

template <class Payload, class FragmentShader>
void compare(const FragmentShader& shader, std::uint32_t seed) {
    const mesh_data m = mixed_triangles(3000, 50.0f, seed);
    vp::grid crop = box_grid({31, 40, 22});
    crop.offset = {9, 0, 13};
    crop.whole = {50, 43, 47};
    vp::transform turned;
    turned.matrix =
        glm::mat4(0.0f, 0.9f, 0.0f, 0.0f, 0.0f, 0.0f, 1.1f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.5f, 0.0f, -2.0f, 1.0f);
    for (const vp::coverage rule : every_coverage)
        for (const vp::grid& g : {box_grid({50, 43, 47}), crop}) {
            expect_same_lists<Payload>(m, g, vp::passthrough{}, shader, rule);
            expect_same_lists<Payload>(m, g, turned, shader, rule);
            expect_same_lists<Payload>(m, g, shift{2.5f}, shader, rule);
        }
}

TEST(Lists, WithoutPayloadAreTheCpus) { compare<void>(vp::constant(true), 120); }

TEST(Lists, WithAConstantPayloadAreTheCpus) { compare<float>(vp::constant(0.5f), 121); }

// More than a warp, a block and a run of a block hold.
TEST(Lists, OfVoxelsWithManyFragmentsAreTheCpus) {
    std::mt19937 random(122);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    mesh_data m;
    for (const int count : {20, 200, 700, 2000, 9000}) {
        const glm::vec3 corner(static_cast<float>(3 * (count % 7)), static_cast<float>(count % 11), 5.0f);
        for (int i = 0; i < count; ++i) {
            const auto point = [&] { return corner + 0.9f * glm::vec3(unit(random), unit(random), unit(random)); };
            add_triangle(m, point(), point(), point());
        }
    }
    std::shuffle(m.triangles.begin(), m.triangles.end(), random);
    for (const vp::coverage rule : every_coverage)
        expect_same_lists<float>(m, box_grid({24, 20, 16}), vp::passthrough{}, vp::constant(2.0f), rule);
}

// A call with the same arguments as an earlier one uses its sizes. The mesh changes: the same, then meshes with the
// same number of triangles and more voxels, fewer fragments, none, and more of both.
template <class Payload, class FragmentShader>
void compare_repeated(const FragmentShader& shader) {
    vp::cuda_backend gpu;
    vp::cpu_backend cpu;
    vp::abuffer<vp::cuda_backend, Payload> gpu_lists{gpu};
    vp::abuffer<vp::cpu_backend, Payload> cpu_lists{cpu};
    const vp::grid g = box_grid({64, 48, 40});
    mesh_data m = mixed_triangles(3000, 40.0f, 123);
    const std::vector<glm::vec3> positions = m.positions;
    for (const float scale : {1.0f, 1.0f, 0.3f, 0.3f, 1.0f, 1.1f, 0.01f, -1.0f, 1.2f, 1.2f, 2.0f}) {
        for (std::size_t i = 0; i < positions.size(); ++i) m.positions[i] = scale * positions[i];
        const vp::mesh<vp::cuda_backend> gpu_mesh{gpu, m.positions, m.triangles};
        const vp::mesh<vp::cpu_backend> cpu_mesh{cpu, m.positions, m.triangles};
        const vp::status gpu_status =
            vp::voxelize(gpu, gpu_mesh, g, vp::passthrough{}, shader, gpu_lists, vp::coverage::conservative);
        const vp::status cpu_status =
            vp::voxelize(cpu, cpu_mesh, g, vp::passthrough{}, shader, cpu_lists, vp::coverage::conservative);
        ASSERT_TRUE(gpu_status.ok() && cpu_status.ok()) << gpu_status.message() << scale;
        SCOPED_TRACE(scale);
        expect_same_counts(cpu_status.counts, gpu_status.counts);
        expect_same_on_host(cpu_lists.to_host(cpu), gpu_lists.to_host(gpu));
    }
}

TEST(Lists, OfRepeatedCallsWithoutPayloadAreTheCpus) { compare_repeated<void>(vp::constant(true)); }
TEST(Lists, OfRepeatedCallsWithAConstantPayloadAreTheCpus) { compare_repeated<float>(vp::constant(0.5f)); }
TEST(Lists, OfRepeatedCallsWithAComputedPayloadAreTheCpus) { compare_repeated<double>(any_double{}); }

// Arrays allocated beforehand are larger than the lists. If memory suffices only for exact arrays, a repeated call uses
// these. If it does not suffice for them, the call fails and leaves the lists unchanged.
TEST(Lists, OfRepeatedCallsFitInExactMemoryOrFail) {
    counting_resource memory;
    const stream_owner s;
    vp::cuda_backend gpu{s.stream, memory};
    const mesh_data m = mixed_triangles(3000, 40.0f, 124);
    const vp::mesh<vp::cuda_backend> mesh{gpu, m.positions, m.triangles};
    vp::abuffer<vp::cuda_backend> lists{gpu};
    const auto draw = [&] {
        return vp::voxelize(gpu, mesh, box_grid({64, 48, 40}), vp::passthrough{}, vp::constant(true), lists,
                            vp::coverage::conservative);
    };
    ASSERT_TRUE(draw().ok());
    ASSERT_TRUE(draw().ok());
    const auto first = lists.to_host(gpu);
    const std::size_t bytes =
        (2 * lists.num_voxels() + 1) * sizeof(std::uint64_t) + lists.num_fragments() * sizeof(std::uint32_t);
    memory.limit = memory.live + bytes;
    const vp::status exact = draw();
    EXPECT_TRUE(exact.ok()) << exact.message();
    expect_same_on_host(first, lists.to_host(gpu));
    memory.limit = memory.live + bytes - 1;
    EXPECT_EQ(draw().code, vp::status_code::out_of_memory);
    expect_same_on_host(first, lists.to_host(gpu));
}

// Many work items of each triangle, more than the device has warps.
TEST(Lists, OfLargeTrianglesWithManyWorkItemsAreTheCpus) {
    const glm::ivec3 extent(400, 390, 380);
    for (const vp::coverage rule : every_coverage)
        expect_same_lists<void>(long_triangles(extent, 1200, 125), box_grid(extent), vp::passthrough{},
                                vp::constant(true), rule);
}

// A thin fragment may lie one voxel beyond its triangle's box, so a warp with a triangle at the grid's end does not
// work in rounds. There are enough triangles to fill a device with one thread each.
void expect_same_lists_at_faces(bool upper) {
    const glm::ivec3 extent(80, 70, 60);
    for (const vp::coverage rule : every_coverage)
        expect_same_lists<void>(triangles_at_faces(extent, 25000, upper, 126), box_grid(extent), vp::passthrough{},
                                vp::constant(true), rule);
}
TEST(Lists, OfTrianglesAtTheGridsUpperFacesAreTheCpus) { expect_same_lists_at_faces(true); }
TEST(Lists, OfTrianglesAtTheGridsLowerFacesAreTheCpus) { expect_same_lists_at_faces(false); }

// Only slivers across the grid and triangles without area.
TEST(Lists, OfSliversAndZeroAreaTrianglesAreTheCpus) {
    mesh_data m;
    for (int i = 0; i < 400; ++i) {
        const float at = 0.1f * static_cast<float>(i);
        add_triangle(m, {-3.0f, at, 0.3f * at}, {70.0f, 0.7f * at, at}, {70.0f, 0.7f * at + 1e-3f, at});
        add_triangle(m, {at, at, at}, {at + 1.0f, at + 1.0f, at + 1.0f}, {at + 0.5f, at + 0.5f, at + 0.5f});
        add_triangle(m, {at, 5.0f, 6.0f}, {at, 5.0f, 6.0f}, {at, 5.0f, 6.0f});
    }
    for (const vp::coverage rule : every_coverage)
        expect_same_lists<void>(m, box_grid({64, 48, 40}), vp::passthrough{}, vp::constant(true), rule);
}

} // namespace
