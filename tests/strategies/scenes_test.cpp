// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The cells of the paper's table on the benchmark scenes: one bit, reproducible float sum and A-buffer equal the CPU's
// byte for byte. Scenes are .vpm files in the folder VOXELPIPE_VPM_DIR; without it, generated meshes replace them.

#include "device_test.hpp"

#include <cmath>

using namespace device_test;

namespace {

// A closed wavy surface of about 2 * n * n triangles, used if the scenes are absent.
mesh_data wavy_sphere(int n) {
    mesh_data m;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
            const float u = 6.2831853f * static_cast<float>(j) / static_cast<float>(n);
            const float v = 3.1415927f * static_cast<float>(i) / static_cast<float>(n);
            const float r = 1.0f + 0.1f * std::sin(9.0f * u) * std::sin(7.0f * v);
            m.positions.emplace_back(r * std::cos(u) * std::sin(v), r * std::sin(u) * std::sin(v), r * std::cos(v));
        }
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const auto a = static_cast<std::uint32_t>(i * (n + 1) + j), b = a + static_cast<std::uint32_t>(n) + 1;
            m.triangles.emplace_back(a, b, a + 1);
            m.triangles.emplace_back(a + 1, b, b + 1);
        }
    return m;
}

using bits = vp::target<vp::bit, vp::blend::bit_or>;
using sum = vp::target<float, vp::blend::add>;

struct weight {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.normal.x + 0.25f); }
};

class Scenes : public testing::TestWithParam<std::tuple<const char*, int>> {
protected:
    void SetUp() override {
        static std::string loaded;
        const auto [name, n] = GetParam();
        if (loaded != name) {
            mesh() = load_scene(name);
            if (mesh().triangles.empty()) mesh() = wavy_sphere(400);
            loaded = name;
        }
        grid = vp::fit(mesh().positions, glm::ivec3(n));
    }
    static mesh_data& mesh() {
        static mesh_data m;
        return m;
    }
    vp::grid grid;
};

TEST_P(Scenes, BitsAreTheCpus) {
    for (const vp::coverage rule : both_rules)
        expect_same<bits>(mesh(), grid, vp::passthrough{}, vp::constant(true), rule);
}
TEST_P(Scenes, ReproducibleSumsAreTheCpus) {
    expect_same<sum>(mesh(), grid, vp::passthrough{}, weight{}, vp::coverage::conservative);
}
TEST_P(Scenes, ListsAreTheCpus) {
    for (const vp::coverage rule : both_rules)
        expect_same_lists<void>(mesh(), grid, vp::passthrough{}, vp::constant(true), rule);
}

INSTANTIATE_TEST_SUITE_P(All, Scenes,
                         testing::Combine(testing::Values("conference", "dragon", "blade", "hairball", "asiandragon"),
                                          testing::Values(128, 512, 1024)));

} // namespace
