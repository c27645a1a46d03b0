// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Memory is proportional to the work: peak resident memory of whole calls, measured by the process itself. ctest runs
// each test in a separate process. The peak is reset at the start of a test, so they can also run in one process.

#include "generated_meshes.hpp"

#include <cpu_ref/backend.hpp>
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <string>

namespace {

namespace vp = voxelpipe;

constexpr std::uint64_t MiB = std::uint64_t{1} << 20;

// A field of /proc/self/status in bytes; 0 if there is none.
std::uint64_t own_memory(const std::string& field) {
    std::ifstream in("/proc/self/status");
    for (std::string line; std::getline(in, line);)
        if (line.starts_with(field + ":")) return std::stoull(line.substr(field.size() + 1)) * 1024;
    return 0;
}

class Memory : public ::testing::Test {
protected:
    void SetUp() override {
        std::ofstream("/proc/self/clear_refs") << "5"; // VmHWM restarts from the memory that is resident now
        ASSERT_GT(own_memory("VmHWM"), 0u) << "this system does not say how much memory a process takes";
    }
};

TEST_F(Memory, BitGridOf2048CubedAndAMillionTrianglesFitsIn1536MiB) {
    const bench::mesh_data mesh = bench::icosphere(224);
    ASSERT_GE(mesh.triangles.size(), 1'000'000u);
    vp::cpu_backend backend{2};
    const vp::grid grid = vp::fit(mesh.positions, glm::ivec3(2048));
    vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{backend, grid.extent};
    const vp::mesh_view<> view{mesh.positions, mesh.triangles};
    const vp::status s = vp::voxelize(backend, view, grid, vp::passthrough{}, vp::constant(true), fb);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_GT(s.counts.voxels, 19'000'000u); // the grid is in memory
    const std::uint64_t peak = own_memory("VmHWM");
    EXPECT_GT(peak, 1024 * MiB);
    EXPECT_LT(peak, 1536 * MiB);
    RecordProperty("peak_MiB", static_cast<int>(peak / MiB));
}

struct abuffer_use {
    std::uint64_t fragments, voxels, bytes; // bytes: peak minus the memory that was resident before the call
};

template <class Payload, class Shader>
abuffer_use draw_abuffer(const bench::mesh_data& mesh, int extent, const Shader& shader) {
    vp::cpu_backend backend{2};
    const vp::grid grid = vp::fit(mesh.positions, glm::ivec3(extent));
    const vp::mesh_view<> view{mesh.positions, mesh.triangles};
    vp::abuffer<vp::cpu_backend, Payload> lists{backend};
    const std::uint64_t before = own_memory("VmRSS");
    const vp::status s = vp::voxelize(backend, view, grid, vp::passthrough{}, shader, lists);
    EXPECT_TRUE(s.ok()) << s.message();
    return {s.counts.fragments, s.counts.voxels, own_memory("VmHWM") - before};
}

// The result takes 4 bytes a fragment and 16 a voxel. During the call, buckets and rows to sort take as much again. A
// dense 2048^3 grid of counts alone would take 32 GiB.
constexpr std::uint64_t bytes_per_fragment = 64;

TEST_F(Memory, AbufferIsInProportionToItsFragments) {
    const bench::mesh_data mesh = bench::icosphere(100);
    const abuffer_use r = draw_abuffer<void>(mesh, 2048, vp::constant());
    ASSERT_GT(r.fragments, 15'000'000u);
    EXPECT_LT(r.bytes, bytes_per_fragment * r.fragments + 64 * MiB)
        << r.fragments << " fragments, " << r.voxels << " voxels, " << r.bytes / MiB << " MiB";
}

TEST_F(Memory, AbufferOfAHugeGridWithFewFragmentsIsSmall) {
    const bench::mesh_data mesh = bench::triangle_soup(1000, 1e-5, 5);
    const abuffer_use r = draw_abuffer<void>(mesh, 1 << 20, vp::constant());
    ASSERT_GT(r.fragments, 1000u);
    EXPECT_LT(r.bytes, bytes_per_fragment * r.fragments + 64 * MiB)
        << r.fragments << " fragments, " << r.voxels << " voxels, " << r.bytes / MiB << " MiB";
}

TEST_F(Memory, AbufferWithPayloadIsInProportionToItsFragments) {
    struct payload {
        float value[4];
    };
    const bench::mesh_data mesh = bench::icosphere(50);
    const abuffer_use r = draw_abuffer<payload>(mesh, 1024, vp::constant(payload{}));
    ASSERT_GT(r.fragments, 4'000'000u);
    EXPECT_LT(r.bytes, (bytes_per_fragment + 3 * sizeof(payload)) * r.fragments + 64 * MiB)
        << r.fragments << " fragments, " << r.voxels << " voxels, " << r.bytes / MiB << " MiB";
}

} // namespace
