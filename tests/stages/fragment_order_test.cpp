// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The order of fragments within voxels, and the list of voxels. Voxels of every size: ordered by a window, a warp, a
// block and merged runs.

#include "device_test.hpp"

#include <voxelpipe/device/fragments/order_voxels.cuh>

#include <algorithm>
#include <numeric>

using namespace device_test;
namespace device = voxelpipe::device;

namespace {

template <class T>
vp::cuda_backend::buffer<T> on_device(vp::cuda_backend& gpu, const std::vector<T>& values) {
    return {gpu, vp::array_view<const T>(values.data(), values.size())};
}

// Fragments in device memory, sorted by voxel, and the result of order_fragments. All arrays are initialised, so that
// they can be copied back whole. room: capacity for voxels.
struct ordered {
    vp::cuda_backend gpu;
    std::uint64_t capacity;
    device::pipeline_state state{};
    std::vector<std::uint32_t> primitives, narrow;
    std::vector<std::uint64_t> first, wide;

    ordered(std::vector<std::uint32_t> keys, std::vector<std::uint32_t> from, std::uint64_t num_fragments,
            std::uint64_t num_primitives, bool is_wide, std::uint64_t room)
        : capacity(keys.size()) {
        state.list_fragments = num_fragments;
        device::arena plan;
        (void)device::order_memory::take(plan, capacity);
        const std::vector<std::byte> zeros(plan.used());
        auto memory = on_device(gpu, zeros);
        device::arena arena(memory.data());
        const device::order_memory order = device::order_memory::take(arena, capacity);
        auto d_state = on_device(gpu, std::vector{state});
        auto d_keys = on_device(gpu, keys), d_from = on_device(gpu, from), d_to = on_device(gpu, from);
        auto d_narrow = on_device(gpu, std::vector<std::uint32_t>(room, 42));
        auto d_wide = on_device(gpu, std::vector<std::uint64_t>(room, 42));
        auto d_first = on_device(gpu, std::vector<std::uint64_t>(room + 1, 42));
        device::csr_pointers pointers, none;
        pointers.voxels = is_wide ? d_wide.data() : nullptr;
        pointers.narrow_voxels = d_narrow.data();
        pointers.offsets = d_first.data();
        pointers.voxel_capacity = room;
        pointers.primitives = d_to.data();
        const auto outputs = on_device(gpu, std::vector{is_wide ? pointers : none});
        device::order_fragments({d_keys.data(), d_from.data(), d_keys.data(), outputs.data(), is_wide ? none : pointers,
                                 order.tiles, order.lists.with(d_state.data())},
                                num_primitives, d_state.data(), {0, 0, capacity, 0}, gpu.stream);
        primitives = d_to.to_host(gpu);
        narrow = d_narrow.to_host(gpu);
        wide = d_wide.to_host(gpu);
        first = d_first.to_host(gpu);
        state = d_state.to_host(gpu)[0];
    }
};

// Voxels of the given lengths with distinct primitives in random order; compares the result with std::sort.
void expect_ordered(const std::vector<std::uint64_t>& lengths, std::uint32_t seed, std::uint32_t largest = 0xfffffffe) {
    std::mt19937 random(seed);
    std::vector<std::uint64_t> first, voxels;
    std::vector<std::uint32_t> keys, primitives, sorted;
    std::uint32_t id = random() % 3;
    for (const std::uint64_t length : lengths) {
        first.push_back(primitives.size());
        voxels.push_back(id);
        keys.insert(keys.end(), length, id);
        id += 1 + random() % 3;
        std::vector<std::uint32_t> voxel(length);
        const std::uint32_t step = std::max<std::uint32_t>(1, largest / static_cast<std::uint32_t>(length));
        for (std::uint64_t i = 0; i < length; ++i)
            voxel[i] = largest - static_cast<std::uint32_t>(i) * step - (step > 1 ? random() % step : 0);
        if (random() % 4 != 0) std::shuffle(voxel.begin(), voxel.end(), random);
        primitives.insert(primitives.end(), voxel.begin(), voxel.end());
        std::sort(voxel.begin(), voxel.end());
        sorted.insert(sorted.end(), voxel.begin(), voxel.end());
    }
    first.push_back(primitives.size());
    const std::uint64_t n = primitives.size(), num_voxels = voxels.size();
    keys.resize(n + 100, ~0u); // more capacity than fragments
    primitives.resize(n + 100, 0);
    const bool is_wide = seed % 2 == 0;
    const ordered result(keys, primitives, n, std::uint64_t{largest} + 1, is_wide, num_voxels);
    EXPECT_EQ(result.state.list_voxels, num_voxels);
    EXPECT_TRUE(std::equal(sorted.begin(), sorted.end(), result.primitives.begin()));
    EXPECT_TRUE(std::all_of(result.primitives.begin() + static_cast<std::ptrdiff_t>(n), result.primitives.end(),
                            [](std::uint32_t p) { return p == 0; }));
    EXPECT_TRUE(result.first == first);
    if (is_wide)
        EXPECT_TRUE(result.wide == voxels);
    else
        EXPECT_TRUE(std::equal(voxels.begin(), voxels.end(), result.narrow.begin()));
}

constexpr std::uint32_t few_primitives = 1u << device::narrow_primitive_bits;

TEST(FragmentOrder, OrdersEveryLengthOfAWindowAndAWarp) {
    std::vector<std::uint64_t> lengths(1100);
    std::iota(lengths.begin(), lengths.end(), 1);
    for (int turn = 0; turn < 2; ++turn) {
        expect_ordered(lengths, 1 + 2 * turn);
        expect_ordered(lengths, 2 + 2 * turn, 1200); // neighbouring numbers
        expect_ordered(lengths, 11 + turn, few_primitives - 1);
        expect_ordered(lengths, 13 + turn, few_primitives);
        std::shuffle(lengths.begin(), lengths.end(), std::mt19937(14));
    }
}

TEST(FragmentOrder, OrdersVoxelsAtTheLimitsOfEveryClass) {
    std::vector<std::uint64_t> lengths;
    for (const std::uint32_t limit :
         {vp::tuning::window_length, vp::tuning::max_of_window, 512u, device::max_of_warp, vp::tuning::max_of_block,
          device::tile_counts::length, 2 * vp::tuning::max_of_block, 32 * 32 * 32u})
        for (const std::uint32_t length : {limit - 1, limit, limit + 1}) lengths.insert(lengths.end(), 3, length);
    expect_ordered(lengths, 3);
    expect_ordered(lengths, 4, few_primitives - 1);
    // Voxels that begin and end at borders of windows and tiles, and last voxels of every length.
    expect_ordered(std::vector<std::uint64_t>(20, vp::tuning::window_length), 15);
    expect_ordered(std::vector<std::uint64_t>(3, device::tile_counts::length), 16);
    for (std::uint32_t rest = 1; rest < 40; ++rest) {
        expect_ordered({1, vp::tuning::window_length - 2, rest}, 17 + rest, few_primitives - 1);
        expect_ordered({rest}, 18 + rest);
    }
}

TEST(FragmentOrder, OrdersDenseVoxels) {
    const std::uint32_t part = vp::tuning::dense_part, most = part * vp::tuning::max_dense_parts;
    const std::uint64_t block = vp::tuning::max_of_block;
    // Nearly all primitives, one more than a block handles, and lengths around a part's border.
    for (const std::uint32_t num : {std::uint32_t{block} + 1, part - 1, part, part + 1, 3 * part + 17})
        for (const std::uint32_t seed : {1u, 2u})
            expect_ordered({7, num, block + 1, 300, num - 1, 2, num}, seed, num - 1);
    // The smallest dense voxel, and one fragment less, which is cut into runs.
    for (const std::uint32_t num : {most, most - 1, most + 1}) {
        const std::uint64_t least = num / vp::tuning::min_dense;
        expect_ordered({least - 1, least, 1, least + 1, 3 * least}, num, num - 1);
    }
    expect_ordered(std::vector<std::uint64_t>(70, 5000), 5, 100000); // more parts than blocks
}

// One voxel of primitives far apart that fills the capacity exactly.
TEST(FragmentOrder, NeedsNoMoreCapacityThanFragments) {
    for (const std::uint32_t n : {vp::tuning::max_of_window + 1, vp::tuning::max_of_block, vp::tuning::max_of_block + 1,
                                  vp::tuning::max_of_block + 2, 2 * vp::tuning::max_of_block + 1}) {
        std::vector<std::uint32_t> primitives(n);
        for (std::uint32_t i = 0; i < n; ++i) primitives[i] = 1000 * (n - i);
        const ordered result(std::vector<std::uint32_t>(n, 3), primitives, n, 1000 * std::uint64_t{n} + 1, false, 1);
        std::sort(primitives.begin(), primitives.end());
        EXPECT_TRUE(result.primitives == primitives) << n;
        EXPECT_EQ(result.state.list_voxels, 1u);
    }
}

TEST(FragmentOrder, OrdersFewAndManyFragments) {
    std::mt19937 random(4);
    std::vector<std::uint64_t> lengths(20000);
    for (std::uint64_t& length : lengths) length = 1 + random() % (random() % 50 == 0 ? 3000 : 10);
    expect_ordered(lengths, 5);
    // Windows that are exactly filled by the voxels that begin in them.
    for (std::uint64_t& length : lengths) length = 1 + random() % (random() % 8 == 0 ? vp::tuning::max_of_window : 60);
    expect_ordered(lengths, 6);
    expect_ordered(lengths, 7, few_primitives - 1);
    // Many tiles.
    lengths.assign(1'000'000, 1);
    for (std::uint64_t& length : lengths) length += random() % 4;
    expect_ordered(lengths, 8, few_primitives - 1);
    expect_ordered(std::vector<std::uint64_t>(300'000, 1), 9);
}

// A list without capacity for all voxels still counts them, and nothing is written beyond its end.
TEST(FragmentOrder, CountsVoxelsBeyondTheCapacityWithoutWriting) {
    std::vector<std::uint32_t> keys(5000), primitives(5000);
    for (std::uint32_t i = 0; i < 5000; ++i) {
        keys[i] = i / 2;
        primitives[i] = 5000 - i;
    }
    for (const bool is_wide : {false, true}) {
        // All voxels within the capacity are there, and nothing behind them is touched; the array of offsets is one
        // longer.
        const ordered result(keys, primitives, keys.size(), 5001, is_wide, 2000);
        EXPECT_EQ(result.state.list_voxels, 2500u);
        for (std::uint32_t i = 0; i < 2000; ++i) {
            ASSERT_EQ(is_wide ? result.wide[i] : result.narrow[i], i);
            ASSERT_EQ(result.first[i], 2 * i);
        }
        EXPECT_EQ(result.first[2000], 42u);
    }
}

// One, two and three merges: runs of 2^12, 2^18 and 2^24 fragments.
TEST(FragmentOrder, MergesRunsOfMillionsOfFragments) {
    expect_ordered({10000, 3, 262144, 5000, 1}, 6);
    expect_ordered({262145, 7, 3000000}, 7);
    expect_ordered({2, (std::uint64_t{1} << 24) + 12345, 9}, 8);
}

TEST(FragmentOrder, WritesNothingIfTheCallHasFailed) {
    const std::vector<std::uint32_t> fill(500, 41);
    const ordered result(fill, fill, 1000, 42, true, 500); // more fragments than room
    EXPECT_TRUE(result.primitives == fill);
    EXPECT_EQ(result.state.list_voxels, 0u);
    EXPECT_TRUE(std::all_of(result.first.begin(), result.first.end(), [](std::uint64_t i) { return i == 42; }));
    EXPECT_TRUE(std::all_of(result.wide.begin(), result.wide.end(), [](std::uint64_t i) { return i == 42; }));
}

} // namespace
