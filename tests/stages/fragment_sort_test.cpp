// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The radix sort of fragments by voxel: stable, by the bits that keys use, for the number of pairs in the state.

#include "device_test.hpp"

#include <voxelpipe/device/fragments/radix_sort.cuh>

#include <algorithm>
#include <numeric>

using namespace device_test;
namespace device = voxelpipe::device;

namespace {

__global__ void zero_kernel(device::sort_memory m, std::uint64_t n) {
    m.zero(n, std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x, std::uint64_t{gridDim.x} * blockDim.x);
}

struct sorted {
    std::vector<std::uint32_t> keys, values;
};

// Sorts the first num keys, in memory that was not zeroed. Values are numbered.
sorted sort_on_device(std::vector<std::uint32_t> keys, std::uint64_t num, int bits, int items) {
    vp::cuda_backend gpu;
    const std::uint64_t capacity = keys.size();
    const auto upload = [&](const auto& v) {
        using element = std::remove_cvref_t<decltype(v[0])>;
        return vp::cuda_backend::buffer<element>(gpu, vp::array_view<const element>(v.data(), v.size()));
    };
    std::vector<std::uint32_t> values(capacity);
    std::iota(values.begin(), values.end(), 0u);
    device::arena pair_plan;
    (void)device::sort_pairs::take(pair_plan, capacity);
    auto pair_memory = upload(std::vector<std::byte>(pair_plan.used(), std::byte{0xcc}));
    device::arena pair_arena(pair_memory.data());
    const auto pairs = device::sort_pairs::take(pair_arena, capacity);
    const auto copy = [&](std::uint32_t* to, const std::uint32_t* from) {
        ASSERT_EQ(cudaMemcpyAsync(to, from, capacity * sizeof(*to), cudaMemcpyDefault, gpu.stream), cudaSuccess);
    };
    copy(pairs.keys[0], keys.data());
    copy(pairs.values[0], values.data());
    device::pipeline_state state{};
    state.list_fragments = num;
    const auto d_state = upload(std::vector{state});
    device::arena plan;
    (void)device::sort_memory::take(plan, capacity, bits, items);
    auto memory = upload(std::vector<std::byte>(plan.used(), std::byte{0xa5}));
    device::arena arena(memory.data());
    const auto m = device::sort_memory::take(arena, capacity, bits, items);
    (void)::emulation::launch([=](const auto&... a) { zero_kernel(a...); }, 64, 256, 0, gpu.stream, m, num);
    const int at =
        device::sort_fragments(pairs, device::sort_count{d_state.data(), {0, 0, capacity, 0}}, capacity, m, gpu.stream);
    EXPECT_EQ(cudaStreamSynchronize(gpu.stream), cudaSuccess);
    EXPECT_EQ(at, m.plan.passes % 2);
    copy(keys.data(), pairs.keys[at]);
    copy(values.data(), pairs.values[at]);
    EXPECT_EQ(cudaStreamSynchronize(gpu.stream), cudaSuccess);
    return {std::move(keys), std::move(values)};
}

// Keys by a function of their position, in an array with some spare capacity.
template <class Key>
void expect_sorted(std::uint64_t num, int bits, const Key& key) {
    std::vector<std::uint32_t> keys(num + 77, 5);
    for (std::uint64_t i = 0; i < num; ++i) keys[i] = key(i);
    std::vector<std::uint32_t> order(num);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return keys[a] < keys[b]; });
    for (const int items : {vp::tuning::few_sort_items, vp::tuning::sort_items}) {
        const sorted s = sort_on_device(keys, num, bits, items);
        for (std::uint64_t i = 0; i < num; ++i) {
            ASSERT_EQ(s.values[i], order[i]) << i << " of " << num << ", " << bits << " bits, " << items;
            ASSERT_EQ(s.keys[i], keys[order[i]]) << i << " of " << num << ", " << bits << " bits, " << items;
        }
    }
}

[[nodiscard]] std::uint32_t below(std::uint32_t random, int bits) { return bits == 0 ? 0 : random >> (32 - bits); }

TEST(FragmentSort, IsStableForEveryNumberOfBits) {
    for (int bits = 0; bits <= 32; ++bits) {
        const device::digit_plan plan(bits);
        EXPECT_GE(plan.passes * plan.bits, bits);
        EXPECT_LE(plan.passes, device::max_digit_passes);
        EXPECT_LE(plan.bits, vp::tuning::max_digit_bits);
        std::mt19937 random(static_cast<unsigned>(bits) + 1);
        expect_sorted(20000, bits, [&](auto) { return below(static_cast<std::uint32_t>(random()), bits); });
    }
}

TEST(FragmentSort, HandlesLengthsAroundTileBorders) {
    for (const std::uint64_t tiles : {0, 1, 2, 7})
        for (const std::int64_t more : {-33, -1, 0, 1, 2, 31, 511}) {
            const std::int64_t num =
                static_cast<std::int64_t>(tiles * device::sort_tile(vp::tuning::sort_items)) + more;
            if (num < 0) continue;
            std::mt19937 random(static_cast<unsigned>(num));
            for (const int bits : {5, 21, 27, 30})
                expect_sorted(static_cast<std::uint64_t>(num), bits,
                              [&](auto) { return below(static_cast<std::uint32_t>(random()), bits); });
        }
}

// All equal, two alternating, the largest key, runs, descending.
TEST(FragmentSort, IsStableForEqualAndAlternatingKeys) {
    constexpr std::uint64_t num = 5 * device::sort_tile(vp::tuning::sort_items) + 1000;
    for (const int bits : {9, 21, 27, 30, 32}) {
        const std::uint32_t largest = below(~0u, bits);
        expect_sorted(num, bits, [&](auto) { return largest; });
        expect_sorted(num, bits, [](auto) { return 0u; });
        expect_sorted(num, bits, [&](auto i) { return i % 2 == 0 ? largest : 0u; });
        expect_sorted(num, bits, [&](auto i) { return static_cast<std::uint32_t>(i / 700) & largest; });
        expect_sorted(num, bits, [&](auto i) { return (largest - static_cast<std::uint32_t>(i)) & largest; });
    }
}

// Many tiles: most look back at predecessors that are still working.
TEST(FragmentSort, LooksBackOverManyTiles) {
    std::mt19937 random(3);
    const auto near = [&](std::uint64_t i) { // neighbours in the list are near each other in space
        return (static_cast<std::uint32_t>(i * 37 % 4000000) + static_cast<std::uint32_t>(random() % 5000)) & 0x7ffffff;
    };
    expect_sorted(12'000'000, 27, near);
    expect_sorted(3'000'001, 30, [&](auto) { return below(static_cast<std::uint32_t>(random()), 30); });
}

TEST(FragmentSort, WritesNothingIfTheCallHasFailed) {
    std::vector<std::uint32_t> keys(20000);
    for (std::uint32_t i = 0; i < keys.size(); ++i) keys[i] = 20000 - i;
    const sorted s = sort_on_device(keys, keys.size() + 1, 18, vp::tuning::sort_items); // two passes
    EXPECT_TRUE(s.keys == keys);
}

} // namespace
