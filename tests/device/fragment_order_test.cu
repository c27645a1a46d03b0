// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The order of fragments within voxels, for voxels of every size: by a thread, a warp, a block and merged runs.

#include "device_test.hpp"

#include <voxelpipe/device/fragment_order.cuh>

#include <algorithm>
#include <numeric>

using namespace device_test;
namespace device = voxelpipe::device;

namespace {

// Lists of the given lengths, each of different primitives in any order; compares what comes back with std::sort.
void expect_ordered(const std::vector<std::uint64_t>& lengths, std::uint32_t seed, std::uint32_t largest = ~0u) {
    std::mt19937 random(seed);
    std::vector<unsigned long long> first;
    std::vector<std::uint32_t> primitives, sorted;
    for (const std::uint64_t length : lengths) {
        first.push_back(primitives.size());
        std::vector<std::uint32_t> voxel(length);
        const std::uint32_t step = std::max<std::uint32_t>(1, largest / static_cast<std::uint32_t>(length));
        for (std::uint64_t i = 0; i < length; ++i)
            voxel[i] = largest - static_cast<std::uint32_t>(i) * step - (step > 1 ? random() % step : 0);
        if (random() % 4 != 0) std::shuffle(voxel.begin(), voxel.end(), random);
        primitives.insert(primitives.end(), voxel.begin(), voxel.end());
        std::sort(voxel.begin(), voxel.end());
        sorted.insert(sorted.end(), voxel.begin(), voxel.end());
    }
    vp::cuda_backend gpu;
    const std::uint64_t capacity = primitives.size() + 100; // more room than fragments
    primitives.resize(capacity, 0);
    device::pipeline_state host{};
    host.list_fragments = sorted.size();
    host.list_voxels = first.size();
    device::arena plan;
    (void)device::order_lists::take(plan, capacity);
    vp::cuda_backend::buffer<std::byte> memory(gpu, plan.used());
    device::arena arena(memory.data());
    const device::order_lists lists = device::order_lists::take(arena, capacity);
    vp::cuda_backend::buffer<device::pipeline_state> state(gpu, vp::array_view<const device::pipeline_state>(&host, 1));
    const vp::cuda_backend::buffer<unsigned long long> d_first(
        gpu, vp::array_view<const unsigned long long>(first.data(), first.size()));
    vp::cuda_backend::buffer<std::uint32_t> from(
        gpu, vp::array_view<const std::uint32_t>(primitives.data(), primitives.size()));
    // Set, what lies behind the fragments too: all of it is copied back.
    vp::cuda_backend::buffer<std::uint32_t> to(
        gpu, vp::array_view<const std::uint32_t>(primitives.data(), primitives.size()));
    vp::cuda_backend::buffer<std::uint32_t> spare(gpu, capacity);
    device::order_fragments({d_first.data(), from.data(), to.data(), spare.data(), lists.with(state.data())},
                            state.data(), {0, 0, capacity, 0}, gpu.stream);
    std::vector<std::uint32_t> result = to.to_host(gpu);
    result.resize(sorted.size());
    EXPECT_TRUE(result == sorted);
}

TEST(FragmentOrder, EveryLengthOfAThreadAndAWarp) {
    std::vector<std::uint64_t> lengths(1100);
    std::iota(lengths.begin(), lengths.end(), 1);
    expect_ordered(lengths, 1);
    expect_ordered(lengths, 2, 1200); // neighbouring numbers
}

TEST(FragmentOrder, AtTheLimits) {
    std::vector<std::uint64_t> lengths;
    for (const std::uint64_t limit : {std::uint64_t{device::most_of_thread}, std::uint64_t{128}, std::uint64_t{512},
                                      std::uint64_t{device::most_of_warp}, std::uint64_t{device::most_of_block},
                                      std::uint64_t{2 * device::most_of_block}})
        for (const std::uint64_t length : {limit - 1, limit, limit + 1}) lengths.insert(lengths.end(), 3, length);
    expect_ordered(lengths, 3);
}

TEST(FragmentOrder, FewAndMany) {
    std::mt19937 random(4);
    std::vector<std::uint64_t> lengths(20000);
    for (std::uint64_t& length : lengths) length = 1 + random() % (random() % 50 == 0 ? 3000 : 10);
    expect_ordered(lengths, 5);
}

// One, two and three merges: runs of 2^12, 2^18 and 2^24 fragments.
TEST(FragmentOrder, MergedRuns) {
    expect_ordered({10000, 3, 262144, 5000, 1}, 6);
    expect_ordered({262145, 7, 3000000}, 7);
    expect_ordered({2, (std::uint64_t{1} << 24) + 12345, 9}, 8);
}

TEST(FragmentOrder, NothingWhereTheCallHasFailed) {
    vp::cuda_backend gpu;
    device::pipeline_state host{};
    host.list_fragments = 1000;
    host.list_voxels = 1;
    device::arena plan;
    (void)device::order_lists::take(plan, 500);
    vp::cuda_backend::buffer<std::byte> memory(gpu, plan.used());
    device::arena arena(memory.data());
    const device::order_lists lists = device::order_lists::take(arena, 500);
    vp::cuda_backend::buffer<device::pipeline_state> state(gpu, vp::array_view<const device::pipeline_state>(&host, 1));
    const std::vector<std::uint32_t> fill(500, 42);
    vp::cuda_backend::buffer<std::uint32_t> to(gpu, vp::array_view<const std::uint32_t>(fill.data(), fill.size()));
    vp::cuda_backend::buffer<std::uint32_t> from(gpu, 500), spare(gpu, 500);
    device::order_fragments({nullptr, from.data(), to.data(), spare.data(), lists.with(state.data())}, state.data(),
                            {0, 0, 500, 0}, gpu.stream);
    EXPECT_TRUE(to.to_host(gpu) == fill);
}

} // namespace
