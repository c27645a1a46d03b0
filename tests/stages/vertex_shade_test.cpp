// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Vertex shade: snapped positions, in 64 bits and for positions near the grid in 32, equal the CPU's.

#include "stage_scene.hpp"

using namespace stage_test;

namespace {

TEST(VertexShade, SnapsAsTheCpuDoes) {
    stages s(mixed_triangles(3000, 50.0f, 70), box_grid({50, 40, 30}), vp::constant(true));
    const auto snap = vp::core::make_snap_transform(s.g);
    const auto expected = vp::cpu::vertex_shade(s.how, s.on_host(), snap);
    vp::cuda_backend::buffer<vp::core::snapped_position> positions(s.gpu, s.data.positions.size());
    vp::cuda_backend::buffer<device::int32_position> near(s.gpu, s.data.positions.size());
    device::vertex_shade<vp::mesh_view<>, vp::passthrough, vp::no_varyings>(
        s.d_draw.mesh, {}, snap, 0, device::vertex_positions{positions.data(), near.data()}, nullptr, s.gpu.stream);
    const auto actual = positions.to_host(s.gpu);
    const std::vector<vp::core::snapped_position> reference(expected[0].positions.get(),
                                                            expected[0].positions.get() + actual.size());
    expect_same_bytes(reference, actual, "snapped positions");
    std::size_t num_far = 0;
    const auto in_32_bits = near.to_host(s.gpu);
    for (std::size_t i = 0; i < actual.size(); ++i) {
        const vp::core::snapped_position& p = actual[i];
        bool is_near = true;
        constexpr std::int64_t limit = std::int64_t{1} << 30;
        for (const std::int64_t q : {p.x, p.y, p.z}) is_near = is_near && q >= -limit && q <= limit; // and not a mark
        ASSERT_EQ(in_32_bits[i].fits_int32 != 0, is_near) << i;
        num_far += !is_near;
        if (!is_near) continue;
        EXPECT_EQ(in_32_bits[i].q[0], p.x);
        EXPECT_EQ(in_32_bits[i].q[1], p.y);
        EXPECT_EQ(in_32_bits[i].q[2], p.z);
    }
    EXPECT_GT(num_far, 0u);
}

} // namespace
