// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "generated_on_device.hpp"

#include <glm/vec3.hpp>

#include <cmath>

namespace bench::gpu {

namespace {

constexpr int threads_per_block = 256;

[[nodiscard]] unsigned blocks_for(std::uint64_t count) {
    return static_cast<unsigned>((count + threads_per_block - 1) / threads_per_block);
}
__device__ std::uint64_t thread_number() { return std::uint64_t{blockIdx.x} * threads_per_block + threadIdx.x; }

// Numbers that depend on (seed, i) only: splitmix64.
class hashed_numbers {
public:
    __device__ hashed_numbers(std::uint64_t seed, std::uint64_t i) : state_(seed * 0x9e3779b97f4a7c15u + i * 64) {}
    __device__ float unit() { // in [0, 1), a multiple of 2^-24
        state_ += 1;
        std::uint64_t z = state_ * 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return static_cast<float>((z ^ (z >> 31)) >> 40) * 0x1p-24f;
    }
    __device__ glm::vec3 in_cube() { // in [-1, 1)^3
        const float x = unit(), y = unit(), z = unit();
        return {2 * x - 1, 2 * y - 1, 2 * z - 1};
    }
    __device__ glm::vec3 direction() { // unit, every direction alike
        for (;;) {
            const glm::vec3 p = in_cube();
            const float square = p.x * p.x + p.y * p.y + p.z * p.z;
            if (square > 1 || square < 1e-4f) continue;
            const float r = rsqrtf(square);
            return {p.x * r, p.y * r, p.z * r};
        }
    }

private:
    std::uint64_t state_;
};

[[nodiscard]] __device__ glm::vec3 cross_product(const glm::vec3& a, const glm::vec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Corner k of an equilateral triangle of this circumradius.
__device__ void put_triangle(glm::vec3* d_positions, glm::uvec3* d_triangles, std::uint64_t i, const glm::vec3& centre,
                             float circumradius, hashed_numbers& random) {
    const glm::vec3 normal = random.direction();
    glm::vec3 u = cross_product(normal, random.direction());
    const float square = u.x * u.x + u.y * u.y + u.z * u.z;
    u = square > 1e-8f ? u * rsqrtf(square) : glm::vec3(normal.y, -normal.x, 0.0f);
    const glm::vec3 v = cross_product(normal, u);
    constexpr float s = 0.8660254f;
    const glm::vec3 corners[3] = {u, u * -0.5f + v * s, u * -0.5f - v * s};
    for (std::uint64_t k = 0; k < 3; ++k) d_positions[3 * i + k] = centre + corners[k] * circumradius;
    const auto first = static_cast<std::uint32_t>(3 * i);
    d_triangles[i] = {first, first + 1, first + 2};
}

__global__ void sphere_positions(std::uint64_t m, float radius, float centre, glm::vec3* d_positions) {
    const std::uint64_t i = thread_number(), side = (m + 1) * (m + 1);
    if (i >= 6 * side) return;
    const auto face = static_cast<int>(i / side);
    const auto at = [&](std::uint64_t j) {
        // Even angles, not even steps along the cube: triangles of about one size.
        return tanf(0.78539816f * (2 * static_cast<float>(j) / static_cast<float>(m) - 1));
    };
    const float u = at(i % side % (m + 1)), v = at(i % side / (m + 1)), w = face < 3 ? 1.0f : -1.0f;
    const float r = radius * rsqrtf(u * u + v * v + 1);
    const int axis = face % 3;
    const glm::vec3 p = axis == 0 ? glm::vec3(w, u, v) : axis == 1 ? glm::vec3(v, w, u) : glm::vec3(u, v, w);
    d_positions[i] = p * r + glm::vec3(centre);
}

__global__ void sphere_triangles(std::uint64_t m, glm::uvec3* d_triangles) {
    const std::uint64_t i = thread_number(), quads = m * m;
    if (i >= 6 * quads) return;
    const std::uint64_t face = i / quads, x = i % quads % m, y = i % quads / m;
    const auto corner = static_cast<std::uint32_t>(face * (m + 1) * (m + 1) + y * (m + 1) + x);
    const auto row = static_cast<std::uint32_t>(m + 1);
    d_triangles[2 * i] = {corner, corner + 1, corner + row + 1};
    d_triangles[2 * i + 1] = {corner, corner + row + 1, corner + row};
}

__global__ void scatter(std::uint64_t count, float circumradius, float n, std::uint64_t seed, glm::vec3* d_positions,
                        glm::uvec3* d_triangles) {
    const std::uint64_t i = thread_number();
    if (i >= count) return;
    hashed_numbers random(seed, i);
    const glm::vec3 centre = random.in_cube() * (0.5f * n - circumradius) + glm::vec3(0.5f * n);
    put_triangle(d_positions, d_triangles, i, centre, circumradius, random);
}

__global__ void stack(std::uint64_t voxels, std::uint64_t depth, std::uint64_t side, std::uint64_t step, int n,
                      std::uint64_t seed, glm::vec3* d_positions, glm::uvec3* d_triangles) {
    const std::uint64_t i = thread_number();
    if (i >= voxels * depth) return;
    hashed_numbers random(seed, i);
    const std::uint64_t voxel = i / depth;
    glm::vec3 corner;
    if (side != 0) {
        const auto first = static_cast<float>((static_cast<std::uint64_t>(n) - side) / 2);
        corner = glm::vec3(static_cast<float>(voxel % side), static_cast<float>(voxel / side % side),
                           static_cast<float>(voxel / (side * side))) +
                 glm::vec3(first);
    } else {
        const std::uint64_t id = voxel * step, row = static_cast<std::uint64_t>(n);
        corner = {static_cast<float>(id % row), static_cast<float>(id / row % row),
                  static_cast<float>(id / (row * row))};
    }
    constexpr float circumradius = 0.15f;
    const glm::vec3 centre = random.in_cube() * 0.3f + corner + glm::vec3(0.5f);
    put_triangle(d_positions, d_triangles, i, centre, circumradius, random);
}

[[nodiscard]] resident_mesh allocate(const char* name, std::uint64_t positions, std::uint64_t triangles) {
    const std::uint64_t bytes = positions * sizeof(glm::vec3) + triangles * sizeof(glm::uvec3);
    std::size_t free = 0, all = 0;
    check(cudaMemGetInfo(&free, &all), "memory");
    if (bytes > free || positions > 0xffffffffu)
        throw out_of_device_memory("a mesh of " + std::to_string(bytes >> 20) + " MiB, " + std::to_string(free >> 20) +
                                   " MiB are free");
    return {name, "generated", device_array<glm::vec3>(positions), device_array<glm::uvec3>(triangles)};
}

void finish(const char* what) {
    check(cudaGetLastError(), what);
    check(cudaDeviceSynchronize(), what);
}

} // namespace

voxelpipe::grid unit_grid(int n) {
    voxelpipe::grid g;
    g.extent = glm::ivec3(n);
    return g;
}

std::uint64_t quads_for(std::uint64_t triangles) {
    const auto m = static_cast<std::uint64_t>(std::lround(std::sqrt(static_cast<double>(triangles) / 12.0)));
    return m < 1 ? 1 : m;
}

resident_mesh sphere_of_quads(std::uint64_t m, int n) {
    const std::uint64_t positions = 6 * (m + 1) * (m + 1), quads = 6 * m * m;
    resident_mesh mesh = allocate("sphere", positions, 2 * quads);
    const float half = 0.5f * static_cast<float>(n);
    sphere_positions<<<blocks_for(positions), threads_per_block>>>(m, 0.99f * half, half, mesh.positions.data());
    sphere_triangles<<<blocks_for(quads), threads_per_block>>>(m, mesh.triangles.data());
    finish("sphere");
    return mesh;
}

resident_mesh scattered_triangles(std::uint64_t count, double edge, int n, std::uint64_t seed) {
    resident_mesh mesh = allocate("scattered", 3 * count, count);
    const auto circumradius = static_cast<float>(edge / std::sqrt(3.0));
    scatter<<<blocks_for(count), threads_per_block>>>(count, circumradius, static_cast<float>(n), seed,
                                                      mesh.positions.data(), mesh.triangles.data());
    finish("scattered triangles");
    return mesh;
}

resident_mesh stacked_triangles(std::uint64_t voxels, std::uint64_t depth, placement where, int n, std::uint64_t seed) {
    resident_mesh mesh = allocate("stacked", 3 * voxels * depth, voxels * depth);
    const auto cells = static_cast<std::uint64_t>(n) * static_cast<std::uint64_t>(n) * static_cast<std::uint64_t>(n);
    std::uint64_t side = 1;
    while (side * side * side < voxels) ++side;
    if (voxels > cells) throw std::invalid_argument("stacked_triangles: more voxels than the grid has");
    stack<<<blocks_for(voxels * depth), threads_per_block>>>(voxels, depth, where == placement::together ? side : 0,
                                                             cells / voxels, n, seed, mesh.positions.data(),
                                                             mesh.triangles.data());
    finish("stacked triangles");
    return mesh;
}

} // namespace bench::gpu
