// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "floors.hpp"

#include <glm/vec3.hpp>

namespace bench::gpu {

namespace {

// Writes only what no mesh has, so that nothing can be left out.
__global__ void read_triangles(const glm::vec3* d_positions, const glm::uvec3* d_triangles, std::size_t count,
                               float* d_out) {
    const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count) return;
    const glm::uvec3 t = d_triangles[i];
    float least = 0;
    for (int k = 0; k < 3; ++k) {
        const glm::vec3 p = d_positions[t[k]];
        least = fminf(least, fminf(p.x, fminf(p.y, p.z)));
    }
    if (least < -1e30f) *d_out = least;
}

} // namespace

double copy_bandwidth(const session& s) {
    constexpr std::size_t bytes = std::size_t{1} << 30;
    const device_array<std::byte> from(bytes), to(bytes);
    check(cudaMemsetAsync(from.data(), 1, bytes, s.stream()), "memset");
    const sample t = time_calls(s, {}, [&] {
        check(cudaMemcpyAsync(to.data(), from.data(), bytes, cudaMemcpyDeviceToDevice, s.stream()), "copy");
    });
    return 2.0 * static_cast<double>(bytes) / (t.median * 1e-3);
}

double gather_ms(const session& s, const resident_mesh& mesh) {
    const device_array<float> d_out(1);
    const std::size_t count = mesh.triangles.size();
    const auto blocks = static_cast<unsigned>((count + 255) / 256);
    return time_calls(s, {},
                      [&] {
                          read_triangles<<<blocks, 256, 0, s.stream()>>>(mesh.positions.data(), mesh.triangles.data(),
                                                                         count, d_out.data());
                          check(cudaGetLastError(), "gather");
                      })
        .median;
}

double memset_ms(const session& s, std::uint64_t bytes) {
    if (bytes == 0) return 0;
    const device_array<std::byte> to(bytes);
    return time_calls(s, {}, [&] { check(cudaMemsetAsync(to.data(), 0, bytes, s.stream()), "memset"); }).median;
}

} // namespace bench::gpu
