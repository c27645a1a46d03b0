// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A shoal of spheres, voxelized by all GPUs of the host, or by one GPU that works for two: each draws a slab of the
// grid of about equal work. The slabs are gathered on the first GPU and compared with what that GPU draws alone; then
// the lists of triangles in each voxel, which stay in their slabs. Exits with 77 where there is no GPU. Another
// resolution: 16_gpus 512.
#include <voxelpipe/slabs/devices.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;

namespace {

void add_sphere(std::vector<glm::vec3>& positions, std::vector<glm::uvec3>& triangles, glm::vec3 center, float radius) {
    constexpr unsigned around = 96, up = 48;
    const auto first = static_cast<unsigned>(positions.size());
    for (unsigned j = 0; j <= up; ++j)
        for (unsigned i = 0; i <= around; ++i) {
            const double a = 6.283185307179586 * i / around, b = 3.141592653589793 * j / up;
            const glm::vec3 d(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
            positions.push_back(center + radius * d);
        }
    for (unsigned j = 0; j < up; ++j)
        for (unsigned i = 0; i < around; ++i) {
            const unsigned at = first + j * (around + 1) + i;
            triangles.emplace_back(at, at + 1, at + around + 1);
            triangles.emplace_back(at + 1, at + around + 2, at + around + 1);
        }
}

using sums = vp::framebuffer<vp::cuda_backend, vp::target<float, vp::blend::add>>;

} // namespace

int main(int argc, char** argv) {
    std::vector<int> ordinals = slabs::devices::all();
    if (ordinals.empty()) return 77;
    if (ordinals.size() == 1) ordinals.push_back(ordinals[0]);
    const int n = argc > 1 ? std::atoi(argv[1]) : 256;
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    for (int i = 0; i < 60; ++i) {
        const double a = 2.399963229728653 * i, h = (i + 0.5) / 60;
        add_sphere(positions, triangles, {0.3 * std::cos(a), 0.3 * std::sin(a), h * h}, 0.02f + 0.05f * float(h));
    }
    const vp::grid grid = vp::fit(vp::bounding_box{{-0.5, -0.5, -0.1}, {0.5, 0.5, 1.1}}, {n, n, n});

    // snippet: devices
    slabs::devices gpus(ordinals);
    slabs::device_options options;
    options.voxel_bytes = sizeof(float);
    options.may_turn = false; // along z, to be gathered
    slabs::device_slabs shoal(gpus, grid, vp::mesh_view<>{positions, triangles}, vp::passthrough{}, options);
    auto parts = shoal.make([](vp::cuda_backend& gpu, glm::ivec3 extent) { return sums{gpu, extent}; });
    const vp::status s = shoal.draw(vp::constant(0.5f), parts);
    sums whole{gpus.backend(0), grid.extent};
    if (s.ok()) shoal.gather<0>(parts, whole.view()).or_throw();
    // end snippet
    for (std::size_t i = 0; i < shoal.size(); ++i)
        std::printf("GPU %d: layers %d to %d, %llu voxels\n", gpus.ordinal(i), shoal.slabs()[i].where.offset.z,
                    shoal.slabs()[i].where.offset.z + shoal.slabs()[i].where.extent.z,
                    static_cast<unsigned long long>(shoal.slabs()[i].drawn.counts.voxels));
    std::printf("%s: %llu triangles, %llu voxels\n", s.message().c_str(),
                static_cast<unsigned long long>(s.counts.triangles_in),
                static_cast<unsigned long long>(s.counts.voxels));

    vp::cuda_backend& one = gpus.backend(0);
    const vp::mesh mesh{one, positions, triangles};
    sums alone{one, grid.extent};
    const vp::status expected = vp::voxelize(one, mesh, grid, vp::passthrough{}, vp::constant(0.5f), alone);
    const bool same = expected.counts == s.counts && vp::get<0>(alone).to_host(one) == vp::get<0>(whole).to_host(one);

    auto lists = shoal.make([](vp::cuda_backend& gpu, glm::ivec3) { return vp::abuffer<vp::cuda_backend>{gpu}; });
    shoal.draw(vp::constant(true), lists).or_throw();
    for (std::size_t i = 0; i < lists.size(); ++i)
        std::printf("slab %zu: lists from voxel %llu and fragment %llu on\n", i,
                    static_cast<unsigned long long>(shoal.slabs()[i].voxels_before),
                    static_cast<unsigned long long>(shoal.slabs()[i].fragments_before));
    return s.ok() && same ? 0 : 1;
}
