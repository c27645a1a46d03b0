// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A landscape in a grid that does not fit into the memory that the program allows itself: the mesh is made strip by
// strip and never there as a whole, slabs of the grid are drawn one at a time, and terrain.raw gets one byte a voxel,
// the number of triangles in it, x fastest. terrain.ppm shows the slabs in colours of their own. Another resolution,
// and another budget in MiB: 14_stream 512 64.
#include "picture.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/slabs/stream.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

namespace vp = voxelpipe;
namespace slabs = voxelpipe::slabs;

struct strip { // one row of squares along x
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    strip(int n, int row) {
        for (int j = row; j <= row + 1; ++j)
            for (int i = 0; i <= n; ++i) {
                const double x = static_cast<double>(i) / n, y = static_cast<double>(j) / n;
                const double height = 0.2 + 0.1 * std::sin(9 * x + 4 * y) + 0.05 * std::sin(31 * y - 17 * x);
                positions.emplace_back(x, y, height + 0.01 * std::sin(140 * x) * std::cos(120 * y));
            }
        for (unsigned i = 0, up = static_cast<unsigned>(n) + 1; i + 1 < up; ++i) {
            triangles.emplace_back(i, i + 1, i + up);
            triangles.emplace_back(i + 1, i + up + 1, i + up);
        }
    }
};

int main(int argc, char** argv) {
    const int n = argc > 1 ? std::atoi(argv[1]) : 1024;
    const std::uint64_t budget = std::uint64_t(argc > 2 ? std::atoi(argv[2]) : 256) << 20;
    vp::cpu_backend backend;
    const vp::grid grid = vp::fit(vp::bounding_box{{0, 0, 0}, {1, 1, 0.4}}, {n, n, n * 2 / 5});
    // A quarter of the resolution, to be shown: numbers of slabs.
    const int side = n / 4, height = grid.extent.z / 4;
    std::vector<std::uint8_t> slab_at(static_cast<std::size_t>(std::int64_t{side} * side * height));
    std::uint8_t drawn = 0;
    const auto place = [&](int x, int y, int z) {
        return static_cast<std::size_t>((std::int64_t{z} * side + y) * side + x);
    };
    // snippet: stream
    slabs::stream stream(backend, grid, vp::passthrough{}, {.memory = budget, .num_slabs = 8});
    for (int row = 0; row < 2 * n; ++row) {
        const strip triangles(2 * n, row);
        stream.add({triangles.positions, triangles.triangles}).or_throw();
    }
    std::ofstream file("terrain.raw", std::ios::binary);
    std::uint64_t occupied = 0;
    using counts = vp::framebuffer<vp::cpu_backend, vp::target<std::uint8_t, vp::blend::add_saturate>>;
    const vp::status s = stream.draw(
        vp::constant(std::uint8_t{1}),
        [&](glm::ivec3 extent) {
            return counts{backend, extent};
        },
        [&](const slabs::slab& part, const counts& voxels) {
            vp::for_each_voxel(vp::get<0>(voxels).to_host_target(backend),
                               [&](const glm::ivec3& v, std::uint8_t count) {
                                   file.put(static_cast<char>(count));
                                   if (count == 0) return;
                                   ++occupied;
                                   const glm::ivec3 at = (v + part.where.offset) / 4;
                                   if (at.x < side && at.y < side && at.z < height)
                                       slab_at[place(at.x, at.y, at.z)] = drawn + 1;
                               });
            ++drawn;
            std::printf("layers %d to %d: %llu voxels\n", part.where.offset.z,
                        part.where.offset.z + part.where.extent.z,
                        static_cast<unsigned long long>(part.drawn.counts.voxels));
        });
    // end snippet
    picture::write("terrain.ppm", {side, height, side},
                   [&](int x, int y, int z) {
                       const int slab = slab_at[place(x, z, y)]; // y points up there
                       const float up = static_cast<float>(slab) / static_cast<float>(drawn);
                       const glm::vec3 low(0.10f, 0.34f, 0.24f), high(0.95f, 0.90f, 0.80f);
                       return slab == 0 ? glm::vec3(-1.0f) : glm::mix(low, high, up) * (slab % 2 == 0 ? 1.0f : 0.7f);
                   },
                   {.along = {-0.45f, -0.75f, -0.7f}, .zoom = 0.98f, .aspect = 1.6f});
    std::printf("%s: %llu triangles, %llu voxels\n", s.message().c_str(),
                static_cast<unsigned long long>(s.counts.triangles_in), static_cast<unsigned long long>(occupied));
    return s.ok() && file && occupied == s.counts.voxels &&
                   s.counts.triangles_drawn == 8ULL * static_cast<unsigned>(n) * static_cast<unsigned>(n)
               ? 0
               : 1;
}
