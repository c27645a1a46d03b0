// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Fragment lists of an A-buffer: sorted by voxel and primitive, they equal the CPU's fragments.

#include "stage_scene.hpp"

using namespace stage_test;

namespace {

template <vp::coverage Rule>
void compare_lists(stages<marked>& s) {
    // One tile for all.
    constexpr int log2_size = 8;
    const auto pairs = reference::sorted_tile_pairs(reference::tile_pairs(s.on_host(), s.g, Rule, log2_size).pairs);
    const auto fragments = fragments_of(s, Rule, log2_size, pairs, reference::tile_ranges(pairs));
    ASSERT_GT(fragments.size(), 1000u);

    const device::capacities limits{0, 0, fragments.size() + 100, 100000};
    stage_memory m(s.gpu, {});
    const stages<marked>::scene_memory buffers(m.memory, s.on_device());
    const auto lists = device::take_lists<std::uint32_t, float>(m.memory, device::num_voxels(s.g), limits.fragments);
    const device::list_memory share(m.memory, s.num_triangles(), limits.fragment_records);
    const auto scene = buffers.shade(s.on_device(), s.g, s.gpu.stream);
    const auto sorted = device::build_lists<Rule, device::first_value>(scene, lists, share.with(m.state), m.state,
                                                                       limits, true, s.gpu.stream, nullptr);
    const device::pipeline_state end = m.end(s.gpu);

    const std::size_t n = fragments.size();
    ASSERT_EQ(end.list_fragments, n);
    EXPECT_GT(end.discarded, 0u);
    std::vector<std::uint32_t> voxels, primitives;
    std::vector<float> payloads;
    std::vector<std::uint64_t> first_of_voxel;
    for (std::size_t i = 0; i < n; ++i) {
        voxels.push_back(static_cast<std::uint32_t>(fragments[i].voxel));
        primitives.push_back(fragments[i].primitive);
        payloads.push_back(vp::get<0>(marked::of(fragments[i].primitive).values));
        if (i == 0 || fragments[i].voxel != fragments[i - 1].voxel) first_of_voxel.push_back(i);
    }
    ASSERT_EQ(end.list_voxels, first_of_voxel.size());
    expect_same_bytes(voxels, copy_back(sorted.keys, n), "voxels of the sorted fragments");
    expect_same_bytes(first_of_voxel, copy_back(sorted.first_of_voxel, first_of_voxel.size()), "first of each voxel");
    const auto places = copy_back(sorted.values, n);
    const auto primitive_at = copy_back(sorted.primitives, n);
    const auto payload_at = copy_back(sorted.payloads, n);
    std::vector<std::uint32_t> found_primitives;
    std::vector<float> found_payloads;
    for (const std::uint32_t place : places) {
        ASSERT_LT(place, n);
        found_primitives.push_back(primitive_at[place]);
        found_payloads.push_back(payload_at[place]);
    }
    expect_same_bytes(primitives, found_primitives, "primitives of the sorted fragments");
    expect_same_bytes(payloads, found_payloads, "payloads of the sorted fragments");
}

TEST(FragmentLists, AreTheCpusFragments) {
    stages s(mixed_triangles(1500, 45.0f, 73), box_grid({45, 37, 50}), marked{});
    compare_lists<vp::coverage::thin>(s);
    compare_lists<vp::coverage::conservative>(s);
}

} // namespace
