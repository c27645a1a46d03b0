// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A mesh remembers the largest of its indices. A view that is changed afterwards must not use that number.

#include <cpu_ref/backend.hpp>

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace vp = voxelpipe;

namespace {

const std::vector<glm::vec3> positions(6);
const std::vector<glm::uvec3> triangles{{0, 1, 2}, {3, 5, 1}, {2, 2, 4}};

TEST(Mesh, KnowsItsLargestIndex) {
    vp::cpu_backend be;
    vp::mesh<vp::cpu_backend> m(be, positions, triangles);
    EXPECT_TRUE(m.view().has_checked_indices());
    EXPECT_EQ(m.view().checked.bound, 6u);
    const vp::mesh<vp::cpu_backend> moved = std::move(m);
    EXPECT_TRUE(moved.view().has_checked_indices());
    const std::vector<float> weights(6);
    const vp::mesh<vp::cpu_backend, float> weighed(be, positions, triangles, weights);
    EXPECT_TRUE(weighed.view().has_checked_indices());
    const vp::mesh<vp::cpu_backend> none(be, positions, std::vector<glm::uvec3>{});
    EXPECT_TRUE(none.view().has_checked_indices());
}

TEST(Mesh, KnowsNothingOfOtherTriangles) {
    vp::cpu_backend be;
    const vp::mesh<vp::cpu_backend> m(be, positions, triangles), same(be, positions, triangles);
    vp::mesh_view<> v = m.view();
    v.triangles = same.view().triangles;
    EXPECT_FALSE(v.has_checked_indices());
    v = m.view();
    v.triangles.count = 2; // a part with the same begin
    EXPECT_TRUE(v.has_checked_indices());
    v = m.view();
    v.triangles = {v.triangles.data() + 1, 2};
    EXPECT_FALSE(v.has_checked_indices());
    v = m.view();
    v.checked.count = 2;
    EXPECT_FALSE(v.has_checked_indices());
    const vp::mesh_view<> of_vectors{positions, triangles};
    EXPECT_FALSE(of_vectors.has_checked_indices());
}

TEST(Mesh, AnIndexOutOfRangeIsAnErrorOfTheCall) {
    vp::cpu_backend be;
    for (const std::uint32_t index : {6u, 0x80000000u, 0xffffffffu})
        for (int corner = 0; corner < 3; ++corner) {
            std::vector<glm::uvec3> bad = triangles;
            bad[1][corner] = index;
            const vp::mesh<vp::cpu_backend> m(be, positions, bad);
            EXPECT_FALSE(m.view().has_checked_indices());
            EXPECT_EQ(m.view().checked.bound, std::uint64_t{index} + 1);
            vp::grid g;
            g.extent = glm::ivec3(4);
            vp::framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>> fb{be, g.extent};
            EXPECT_EQ(vp::voxelize(be, m, g, vp::passthrough{}, vp::constant(true), fb).code,
                      vp::status_code::index_out_of_range);
        }
    const vp::mesh<vp::cpu_backend> m(be, positions, triangles);
    vp::mesh_view<> v = m.view();
    v.positions.count = 5; // the last vertex, which a triangle uses, is gone
    EXPECT_FALSE(v.has_checked_indices());
}

TEST(Mesh, KnowsNothingOfIndicesInForeignMemory) {
    vp::cpu_backend be;
    vp::mesh_view<> v{positions, triangles};
    v.checked = vp::check_indices(be, v.triangles);
    EXPECT_TRUE(v.has_checked_indices());
    EXPECT_EQ(v.checked.bound, 6u);
    EXPECT_EQ(vp::check_indices(be, {}).bound, 0u);
    EXPECT_EQ(vp::check_indices(be, {triangles.data(), 1}).bound, 3u);
}

} // namespace
