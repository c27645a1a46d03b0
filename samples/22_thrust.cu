// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A mesh that Thrust makes and keeps on a GPU, voxelized where it lies, into a target that is a thrust::device_vector
// too. Thrust then counts and lists its voxels and finds the one that most triangles meet. Nothing goes through the
// host but the few numbers that are printed. Exits with 0 when they are those of vp::status and of the CPU, with 1 when
// not, and with 77 where there is no GPU.
#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <thrust/copy.h>
#include <thrust/count.h>
#include <thrust/device_vector.h>
#include <thrust/execution_policy.h>
#include <thrust/extrema.h>
#include <thrust/host_vector.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/reduce.h>
#include <thrust/tabulate.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <vector>

namespace vp = voxelpipe;

namespace {

// A ribbon that winds around a torus: vertex i of `count` pairs, and the triangles between them.
struct ribbon_vertex {
    unsigned count;
    __host__ __device__ glm::vec3 operator()(unsigned i) const {
        const float along = 6.2831853f * static_cast<float>(i / 2) / static_cast<float>(count),
                    around = 24 * along + (i % 2 == 0 ? 0.0f : 0.12f), r = 0.7f + 0.25f * cosf(around);
        return {r * cosf(along), r * sinf(along), 0.25f * sinf(around)};
    }
};
struct ribbon_triangle {
    unsigned vertices;
    __host__ __device__ glm::uvec3 operator()(unsigned i) const {
        const unsigned a = i, b = (i + 1) % vertices, c = (i + 2) % vertices;
        return i % 2 == 0 ? glm::uvec3(a, b, c) : glm::uvec3(b, a, c);
    }
};
struct is_drawn {
    __host__ __device__ bool operator()(std::uint32_t triangles) const { return triangles != 0; }
};

int run() {
    constexpr unsigned pairs = 50'000, vertices = 2 * pairs;
    // snippet: thrust
    thrust::device_vector<glm::vec3> positions(vertices);
    thrust::device_vector<glm::uvec3> triangles(vertices);
    thrust::tabulate(positions.begin(), positions.end(), ribbon_vertex{pairs});
    thrust::tabulate(triangles.begin(), triangles.end(), ribbon_triangle{vertices});

    // The target counts the triangles of each voxel, in Thrust's memory; the views name what the vectors hold.
    using count = vp::target<std::uint32_t, vp::blend::count>;
    const vp::grid grid = vp::fit(vp::bounding_box{{-1, -1, -0.3f}, {1, 1, 0.3f}}, {256, 256, 80});
    thrust::device_vector<std::uint32_t> voxels(count::map::elements(grid.extent));
    const vp::mesh_view<> mesh{{thrust::raw_pointer_cast(positions.data()), positions.size()},
                               {thrust::raw_pointer_cast(triangles.data()), triangles.size()}};
    const auto target = vp::framebuffer_view<count>::on(grid.extent, thrust::raw_pointer_cast(voxels.data()));
    vp::cuda_backend gpu; // its stream is the default one, in which Thrust works
    const vp::status drawn = vp::voxelize(gpu, mesh, grid, vp::passthrough{}, vp::constant(1U), target).or_throw();

    const auto occupied = static_cast<std::uint64_t>(thrust::count_if(voxels.begin(), voxels.end(), is_drawn{}));
    const std::uint64_t fragments = thrust::reduce(voxels.begin(), voxels.end(), std::uint64_t{0});
    const auto fullest = thrust::max_element(voxels.begin(), voxels.end());
    thrust::device_vector<std::uint32_t> listed(occupied); // numbers of the drawn voxels, ascending
    thrust::copy_if(thrust::counting_iterator<std::uint32_t>(0),
                    thrust::counting_iterator<std::uint32_t>(static_cast<std::uint32_t>(voxels.size())), voxels.begin(),
                    listed.begin(), is_drawn{});
    // snippet end

    const std::uint32_t most = *fullest;
    const auto at = static_cast<std::uint64_t>(fullest - voxels.begin());
    const auto nx = static_cast<std::uint64_t>(grid.extent.x), ny = static_cast<std::uint64_t>(grid.extent.y);
    std::printf("%llu voxels, %llu fragments; voxel (%llu, %llu, %llu) meets %u triangles\n",
                static_cast<unsigned long long>(occupied), static_cast<unsigned long long>(fragments),
                static_cast<unsigned long long>(at % nx), static_cast<unsigned long long>(at / nx % ny),
                static_cast<unsigned long long>(at / nx / ny), most);

    // The same on the CPU, of the vertices that the GPU has computed.
    const thrust::host_vector<glm::vec3> host_positions = positions;
    const thrust::host_vector<glm::uvec3> host_triangles = triangles;
    vp::cpu_backend cpu;
    std::vector<std::uint32_t> expected(voxels.size());
    (void)vp::voxelize(
        cpu,
        vp::mesh_view<>{{host_positions.data(), host_positions.size()}, {host_triangles.data(), host_triangles.size()}},
        grid, vp::passthrough{}, vp::constant(1U), vp::framebuffer_view<count>::on(grid.extent, expected.data()))
        .or_throw();
    const thrust::host_vector<std::uint32_t> counted = voxels, numbers = listed;
    bool good = fragments == drawn.counts.fragments && occupied == drawn.counts.voxels;
    std::size_t next = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        good = good && counted[i] == expected[i] && expected[i] <= most;
        if (expected[i] != 0) good = good && next < numbers.size() && numbers[next++] == i;
    }
    return good && next == occupied && expected[at] == most ? 0 : 1;
}

} // namespace

int main() {
    int devices = 0;
    if (cudaGetDeviceCount(&devices) != cudaSuccess || devices == 0) {
        std::puts("no GPU here");
        return 77;
    }
    try {
        return run();
    } catch (const std::exception& e) {
        std::fprintf(stderr, "22_thrust: %s\n", e.what());
        return 1;
    }
}
