// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The call that voxelpipe.voxelize makes, from C++: reads vertices and triangles as raw float32 and uint32, draws into
// a byte a voxel, and prints the medians of so many runs in milliseconds, of time and of processor time on all cores,
// with the number of voxels. Used by compare.py.
#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace vp = voxelpipe;

template <class T>
std::vector<T> read_file(const char* path) {
    std::ifstream in(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
    std::vector<T> values(bytes.size() / sizeof(T));
    std::copy_n(bytes.data(), values.size() * sizeof(T), reinterpret_cast<char*>(values.data()));
    return values;
}

int main(int argc, char** argv) {
    if (argc != 5) return std::fputs("call VERTICES TRIANGLES RESOLUTION RUNS\n", stderr), 1;
    const auto positions = read_file<glm::vec3>(argv[1]);
    const auto triangles = read_file<glm::uvec3>(argv[2]);
    const int runs = std::atoi(argv[4]);
    const vp::grid grid = vp::fit_longest(vp::bounds(positions), std::atoi(argv[3]));
    vp::cpu_backend backend;
    std::vector<double> times, processor_times;
    unsigned long long voxels = 0;
    for (int run = 0; run < runs; ++run) {
        const auto start = std::chrono::steady_clock::now();
        const std::clock_t processor_start = std::clock();
        // Memory of the result is new in each call, as it is in Python.
        const std::size_t n = static_cast<std::size_t>(grid.extent.x) * static_cast<std::size_t>(grid.extent.y) *
                              static_cast<std::size_t>(grid.extent.z);
        const auto out = std::make_unique_for_overwrite<std::uint8_t[]>(n);
        using mask = vp::target<std::uint8_t, vp::blend::replace>;
        voxels = vp::voxelize(backend, vp::mesh_view<>{positions, triangles}, grid, vp::passthrough{},
                              vp::constant(std::uint8_t{1}), vp::framebuffer_view<mask>::on(grid.extent, out.get()))
                     .or_throw()
                     .counts.voxels;
        times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
        processor_times.push_back(1000.0 * static_cast<double>(std::clock() - processor_start) / CLOCKS_PER_SEC);
    }
    std::sort(times.begin(), times.end());
    std::sort(processor_times.begin(), processor_times.end());
    std::printf("%.4f %.4f %llu\n", times[times.size() / 2], processor_times[times.size() / 2], voxels);
}
