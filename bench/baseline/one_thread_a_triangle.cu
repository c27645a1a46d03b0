// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "one_thread_a_triangle.hpp"

#include "session.hpp"

#include <voxelpipe/core/coverage.hpp>
#include <voxelpipe/core/primitive.hpp>

#include <algorithm>

namespace bench::gpu {

namespace vp = voxelpipe;
namespace core = voxelpipe::core;

namespace {

constexpr int threads_per_block = 256;

template <vp::coverage Rule, baseline_output Output>
__global__ void draw_triangles(vp::mesh_view<> mesh, core::snap_transform snap, glm::ivec3 extent,
                               std::uint32_t* d_words) {
    const std::size_t i = std::size_t{blockIdx.x} * threads_per_block + threadIdx.x;
    if (i >= mesh.triangles.size()) return;
    const glm::uvec3 index = mesh.triangles[i];
    core::snapped_position p[3];
    for (int k = 0; k < 3; ++k) {
        const glm::vec3 v = mesh.positions[index[k]];
        p[k] = core::snap(snap, v.x, v.y, v.z);
    }
    const core::voxel_box whole{{{0, 0, 0}}, {{extent.x - 1, extent.y - 1, extent.z - 1}}};
    core::voxel_box reach{};
    if (core::classify<Rule>(p[0], p[1], p[2], snap.fraction, whole, reach) != core::triangle_class::drawn) return;
    core::rasterize<core::to_rule(Rule)>(
        p[0], p[1], p[2], snap.fraction, whole,
        [&](const auto& t, std::int64_t u, std::int64_t v, std::int64_t w0, std::int64_t w1) {
            for (std::int64_t w = w0; w <= w1; ++w) {
                const auto voxel = core::to_xyz(t.axis, u, v, w);
                const std::int64_t row = voxel[2] * extent.y + voxel[1];
                if constexpr (Output == baseline_output::bits)
                    atomicOr(d_words + row * ((extent.x + 31) / 32) + (voxel[0] >> 5), 1u << (voxel[0] & 31));
                else
                    atomicAdd(reinterpret_cast<float*>(d_words) + row * extent.x + voxel[0], 1.0f);
            }
        });
}

template <vp::coverage Rule>
void launch(cudaStream_t stream, const vp::mesh_view<>& mesh, const vp::grid& grid, baseline_output output,
            std::uint32_t* d_words) {
    const auto blocks = static_cast<unsigned>((mesh.triangles.size() + threads_per_block - 1) / threads_per_block);
    const core::snap_transform snap = core::make_snap_transform(grid);
    if (output == baseline_output::bits)
        draw_triangles<Rule, baseline_output::bits>
            <<<blocks, threads_per_block, 0, stream>>>(mesh, snap, grid.extent, d_words);
    else
        draw_triangles<Rule, baseline_output::sums>
            <<<blocks, threads_per_block, 0, stream>>>(mesh, snap, grid.extent, d_words);
    check(cudaGetLastError(), "baseline");
}

__global__ void count_different_words(const std::uint32_t* d_a, const std::uint32_t* d_b, std::size_t count,
                                      unsigned long long* d_different) {
    unsigned long long different = 0;
    for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count;
         i += std::size_t{gridDim.x} * blockDim.x)
        different += d_a[i] != d_b[i];
    if (different != 0) atomicAdd(d_different, different);
}

} // namespace

void voxelize_baseline(cudaStream_t stream, const vp::mesh_view<>& mesh, const vp::grid& grid, vp::coverage rule,
                       baseline_output output, std::uint32_t* d_words, std::size_t count) {
    check(cudaMemsetAsync(d_words, 0, count * sizeof(std::uint32_t), stream), "baseline");
    if (rule == vp::coverage::thin)
        launch<vp::coverage::thin>(stream, mesh, grid, output, d_words);
    else
        launch<vp::coverage::conservative>(stream, mesh, grid, output, d_words);
}

std::uint64_t count_differences(cudaStream_t stream, const std::uint32_t* d_a, const std::uint32_t* d_b,
                                std::size_t count) {
    const device_array<unsigned long long> d_different(1);
    check(cudaMemsetAsync(d_different.data(), 0, d_different.bytes(), stream), "comparison");
    const auto blocks = static_cast<unsigned>(std::min<std::size_t>((count + 255) / 256, 4096));
    count_different_words<<<blocks, 256, 0, stream>>>(d_a, d_b, count, d_different.data());
    check(cudaGetLastError(), "comparison");
    unsigned long long different = 0;
    check(cudaMemcpyAsync(&different, d_different.data(), sizeof(different), cudaMemcpyDeviceToHost, stream),
          "comparison");
    check(cudaStreamSynchronize(stream), "comparison");
    return different;
}

} // namespace bench::gpu
