// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the API tests: the backend, small meshes, their fragments by the oracle in primitive order, and values that
// depend on primitive and voxel, so that a fragment in a wrong voxel or order changes the result.
//
// The same test files are compiled twice: by the C++ compiler for cpu_backend, and by nvcc for cuda_backend
// (tests/strategies).

#include "oracle.hpp"
#include "test_support.hpp"

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <cstring>
#include <vector>

namespace unit {

namespace vp = voxelpipe;

#if defined(__CUDACC__)
using backend_type = vp::cuda_backend;
inline constexpr unsigned thread_numbers[] = {0}; // the caller cannot choose
[[nodiscard]] inline backend_type make_backend(unsigned = 0) { return backend_type{}; }
#else
using backend_type = vp::cpu_backend;
inline constexpr unsigned thread_numbers[] = {1, 3};
[[nodiscard]] inline backend_type make_backend(unsigned threads = 2) { return backend_type{threads}; }
#endif

struct small_mesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    [[nodiscard]] vp::mesh_view<> view() const { return {positions, triangles}; } // in host memory

    // A copy in the backend's memory.
    [[nodiscard]] vp::mesh<backend_type> on(backend_type& backend) const { return {backend, positions, triangles}; }
};

// `count` triangles of all sizes in and around a grid of `extent` unit voxels at the origin.
inline small_mesh make_mesh(std::uint64_t seed, int count, glm::ivec3 extent) {
    splitmix64 random(seed);
    small_mesh m;
    for (int i = 0; i < count; ++i) {
        const double size = std::ldexp(1.0, static_cast<int>(random.between(-2, 5)));
        double centre[3];
        for (int a = 0; a < 3; ++a) centre[a] = random.uniform(-2.0, extent[a] + 2.0);
        for (int k = 0; k < 3; ++k) {
            glm::vec3 p;
            for (int a = 0; a < 3; ++a) p[a] = static_cast<float>(centre[a] + random.uniform(-size, size));
            m.positions.push_back(p);
        }
        const auto n = static_cast<std::uint32_t>(3 * i);
        m.triangles.emplace_back(n, n + 1, n + 2);
    }
    return m;
}

inline vp::grid unit_grid(glm::ivec3 extent) {
    vp::grid g;
    g.extent = extent;
    return g;
}

struct model_fragment {
    glm::ivec3 voxel; // in the whole grid
    std::uint32_t primitive, triangle, draw;
};

// Fragments of the whole grid in primitive order. Each mesh is one draw, its positions in world space.
inline std::vector<model_fragment> fragments_of(const vp::grid& g, vp::coverage rule,
                                                const std::vector<small_mesh>& draws) {
    oracle::grid og{};
    for (int a = 0; a < 3; ++a) {
        og.origin[a] = g.origin[a];
        og.voxel_size[a] = g.voxel_size[a];
        og.extent[a] = g.whole_extent()[a];
    }
    std::vector<model_fragment> out;
    std::uint32_t primitive = 0;
    for (std::uint32_t d = 0; d < draws.size(); ++d)
        for (std::uint32_t t = 0; t < draws[d].triangles.size(); ++t, ++primitive) {
            float p[3][3];
            for (int k = 0; k < 3; ++k)
                for (int a = 0; a < 3; ++a) p[k][a] = draws[d].positions[draws[d].triangles[t][k]][a];
            const oracle::snapped_triangle s = oracle::snap(og, p);
            const auto voxels = rule == vp::coverage::thin ? oracle::thin(og, s) : oracle::conservative(og, s);
            for (const oracle::voxel& v : voxels) out.push_back({{v.i, v.j, v.k}, primitive, t, d});
        }
    return out;
}

// A hash of primitive and voxel.
VOXELPIPE_HD inline std::uint64_t mark(std::uint32_t primitive, glm::ivec3 voxel) {
    std::uint64_t z = primitive * 0x9e3779b97f4a7c15u + static_cast<std::uint64_t>(voxel.x) * 0xbf58476d1ce4e5b9u +
                      static_cast<std::uint64_t>(voxel.y) * 0x94d049bb133111ebu +
                      static_cast<std::uint64_t>(voxel.z) * 0xd6e8feb86659fd93u;
    z = (z ^ (z >> 32)) * 0xd6e8feb86659fd93u;
    return z ^ (z >> 29);
}

// A barycentric of each fragment, or one constant that the library cannot know to be constant.
struct float_shader {
    float constant = 0;
    bool varies = true;
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(varies ? f.barycentric.y : constant);
    }
};

template <class T>
[[nodiscard]] bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
    static_assert(std::is_trivially_copyable_v<T>);
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

// Calls f(x, y, z) for every voxel.
template <class F>
void for_each_voxel(glm::ivec3 extent, F&& f) {
    for (int z = 0; z < extent.z; ++z)
        for (int y = 0; y < extent.y; ++y)
            for (int x = 0; x < extent.x; ++x) f(x, y, z);
}

[[nodiscard]] inline std::size_t linear(glm::ivec3 extent, glm::ivec3 v) {
    return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(extent.y) + static_cast<std::size_t>(v.y)) *
               static_cast<std::size_t>(extent.x) +
           static_cast<std::size_t>(v.x);
}

} // namespace unit
