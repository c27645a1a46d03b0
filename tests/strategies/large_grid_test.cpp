// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Grids of more than 2^32 voxels, and slivers as long as a grid of 1024^3, give the CPU's bytes. A test is skipped, and
// recorded as skipped, if the machine has too little memory.

#include "device_test.hpp"

#include <unistd.h>

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

constexpr double gib = 1024.0 * 1024.0 * 1024.0;

[[nodiscard]] bool has_memory(double device_gib, double host_gib) {
    std::size_t free = 0, total = 0;
    cudaMemGetInfo(&free, &total);
    const double host = static_cast<double>(sysconf(_SC_AVPHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    return static_cast<double>(free) >= device_gib * gib && host >= host_gib * gib;
}

// One target on both backends. The CPU's memory is compared in place, because it is large.
template <class Target, class Shader>
void compare_in_place(const mesh_data& m, const vp::grid& g, const Shader& shader, vp::coverage rule) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::framebuffer<vp::cpu_backend, Target> a{cpu, g.extent};
    vp::framebuffer<vp::cuda_backend, Target> b{gpu, g.extent};
    const vp::mesh<vp::cpu_backend> ma(cpu, m.positions, m.triangles);
    const vp::mesh<vp::cuda_backend> mb(gpu, m.positions, m.triangles);
    const vp::status sa = vp::voxelize(cpu, ma, g, vp::passthrough{}, shader, a, rule);
    const vp::status sb = vp::voxelize(gpu, mb, g, vp::passthrough{}, shader, b, rule);
    ASSERT_TRUE(sa.ok()) << sa.message();
    ASSERT_TRUE(sb.ok()) << sb.message();
    expect_same_counts(sa.counts, sb.counts);
    EXPECT_GT(sa.counts.voxels, 0u);
    const auto actual = vp::get<0>(b).to_host(gpu);
    const auto* const expected = vp::get<0>(a).view().elements;
    ASSERT_EQ(actual.size(), Target::map::elements(g.extent));
    std::size_t first = 0;
    if (std::memcmp(expected, actual.data(), actual.size() * sizeof(actual[0])) != 0)
        while (std::memcmp(&expected[first], &actual[first], sizeof(actual[0])) == 0) ++first;
    else
        first = actual.size();
    EXPECT_EQ(first, actual.size()) << "the first element that differs";
}

// Triangles through the whole grid of 2048^3, including its last layers and its last corner.
mesh_data far_triangles() {
    mesh_data m = mixed_triangles(3000, 2048.0f, 80);
    append(m, translated(mixed_triangles(500, 40.0f, 81), glm::vec3(2010.0f)));
    add_triangle(m, {0.0f, 0.0f, 2047.5f}, {2048.0f, 0.0f, 2047.9f}, {0.0f, 2048.0f, 2047.1f});
    add_triangle(m, {-500.0f, -400.0f, -300.0f}, {5000.0f, 100.0f, 2500.0f}, {10.0f, 5000.0f, 2600.0f});
    return m;
}

struct by_voxel {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        return vp::outputs(static_cast<std::uint8_t>(f.triangle * 7u + static_cast<std::uint32_t>(f.voxel.x) + 1u));
    }
};

TEST(LargeGrid, BitsOf2048CubedAreTheCpus) {
    if (!has_memory(3, 8)) GTEST_SKIP() << "needs 3 GiB of GPU memory and 8 GiB of the host's";
    for (const vp::coverage rule : both_rules)
        compare_in_place<vp::target<vp::bit, blend::bit_or>>(far_triangles(), box_grid({2048, 2048, 2048}),
                                                             vp::constant(true), rule);
}

TEST(LargeGrid, ValuesOf2048CubedAreTheCpus) {
    if (!has_memory(12, 24)) GTEST_SKIP() << "needs 12 GiB of GPU memory and 24 GiB of the host's";
    compare_in_place<vp::target<std::uint8_t, blend::max>>(far_triangles(), box_grid({2048, 2048, 2048}), by_voxel{},
                                                           vp::coverage::conservative);
}

struct byte_chain {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::uint8_t identity() const { return 1; }
    VOXELPIPE_HD std::uint8_t combine(std::uint8_t a, std::uint8_t b) const {
        return static_cast<std::uint8_t>(a * 3u + b);
    }
};

// For a blend that depends on the order, the lists number voxels with 64 bits here.
TEST(LargeGrid, FoldsBeyond32BitsAreTheCpus) {
    if (!has_memory(8, 12)) GTEST_SKIP() << "needs 8 GiB of GPU memory and 12 GiB of the host's";
    mesh_data m = translated(mixed_triangles(400, 60.0f, 83), {2000.0f, 2000.0f, 990.0f});
    add_triangle(m, {0.0f, 0.0f, 0.0f}, {2048.0f, 10.0f, 1030.0f}, {10.0f, 2048.0f, 1039.9f});
    for (const vp::coverage rule : both_rules)
        compare_in_place<vp::target<std::uint8_t, byte_chain>>(m, box_grid({2048, 2048, 1040}), by_voxel{}, rule);
}

// 10^5 slivers from face to face, mostly along an axis.
mesh_data slivers(float size) {
    std::mt19937 random(82);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    mesh_data m;
    for (int i = 0; i < 100000; ++i) {
        glm::vec3 a(unit(random), unit(random), unit(random)), b(unit(random), unit(random), unit(random));
        if (i % 4 != 0) b = a;
        a[i % 3] = -0.1f;
        b[i % 3] = 1.1f;
        const glm::vec3 c = b + glm::vec3(0.001f * unit(random), 0.001f * unit(random), 0.001f * unit(random));
        add_triangle(m, a * size, b * size, c * size);
    }
    return m;
}

TEST(LargeGrid, SliversThrough1024CubedAreTheCpus) {
    if (!has_memory(12, 8)) GTEST_SKIP() << "needs 12 GiB of GPU memory and 8 GiB of the host's";
    const mesh_data m = slivers(1024.0f);
    for (const vp::coverage rule : both_rules)
        compare_in_place<vp::target<vp::bit, blend::bit_or>>(m, box_grid({1024, 1024, 1024}), vp::constant(true), rule);
    compare_in_place<vp::target<std::uint8_t, blend::max>>(m, box_grid({1024, 1024, 1024}), by_voxel{},
                                                           vp::coverage::conservative);
}

} // namespace
