// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The counting sort of listed fragments: voxels ascending, and within each voxel primitives ascending.

#include "device_test.hpp"

#include <voxelpipe/device/fragments/counting_sort.cuh>

#include <algorithm>
#include <numeric>

using namespace device_test;
namespace device = voxelpipe::device;

namespace {

__global__ void zero_counting_kernel(device::counting_memory m) {
    m.zero(std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x, std::uint64_t{gridDim.x} * blockDim.x);
}

template <class T>
vp::cuda_backend::buffer<T> on_device(vp::cuda_backend& gpu, const std::vector<T>& values) {
    return {gpu, vp::array_view<const T>(values.data(), values.size())};
}

// A call's memory from one vector, filled with a pattern wherever zeros are not required.
struct call_memory {
    device::sort_pairs pairs;
    device::counting_memory counting;
    device::order_memory order;

    [[nodiscard]] static call_memory take(device::arena& arena, std::uint64_t capacity, std::uint64_t num_voxels) {
        call_memory m;
        m.counting = device::counting_memory::take(arena, capacity, num_voxels);
        m.pairs = device::sort_pairs::take(arena, capacity);
        m.order = device::order_memory::take(arena, capacity);
        return m;
    }
};

struct counted {
    vp::cuda_backend gpu;
    device::pipeline_state state{};
    std::vector<std::uint32_t> primitives, narrow;
    std::vector<std::uint64_t> first, wide;

    // The first num_fragments of the list. room: capacity for voxels; nothing may be written beyond it.
    counted(const std::vector<std::uint32_t>& voxels, const std::vector<std::uint32_t>& listed,
            std::uint64_t num_fragments, std::uint64_t num_voxels, std::uint64_t num_primitives, bool is_wide,
            std::uint64_t room, std::uint64_t longest = ~0ull) {
        const std::uint64_t capacity = voxels.size();
        state.list_fragments = num_fragments;
        device::arena plan;
        (void)call_memory::take(plan, capacity, num_voxels);
        auto memory = on_device(gpu, std::vector<std::byte>(plan.used(), std::byte{0xa5}));
        device::arena arena(memory.data());
        const call_memory m = call_memory::take(arena, capacity, num_voxels);
        const auto copy = [&](std::uint32_t* to, const std::vector<std::uint32_t>& from) {
            ASSERT_EQ(cudaMemcpyAsync(to, from.data(), from.size() * sizeof(*to), cudaMemcpyDefault, gpu.stream),
                      cudaSuccess);
        };
        copy(m.pairs.keys[0], voxels);
        copy(m.pairs.values[0], listed);
        (void)::emulation::launch([=](const auto&... a) { zero_counting_kernel(a...); }, 64, 256, 0, gpu.stream, m.counting);
        auto d_state = on_device(gpu, std::vector{state});
        auto d_to = on_device(gpu, std::vector<std::uint32_t>(capacity, 42));
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
        device::order_by_counting({nullptr, m.pairs.values[1], m.pairs.keys[0], outputs.data(),
                                   is_wide ? none : pointers, m.order.tiles, m.order.lists.with(d_state.data())},
                                  {m.pairs.keys[0], m.pairs.values[0]}, m.counting, num_primitives, d_state.data(),
                                  {0, 0, capacity, 0, longest}, gpu.stream, nullptr);
        primitives = d_to.to_host(gpu);
        narrow = d_narrow.to_host(gpu);
        wide = d_wide.to_host(gpu);
        first = d_first.to_host(gpu);
        state = d_state.to_host(gpu)[0];
    }
};

// Sorts a list of the given voxels with distinct primitives in random order, and compares with std::sort.
void expect_counted(const std::vector<std::uint32_t>& voxels, std::uint64_t num_voxels, std::uint32_t seed,
                    std::uint32_t spread = 3) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::uint64_t n = voxels.size();
    std::vector<std::uint32_t> listed(n);
    for (std::uint64_t i = 0; i < n; ++i)
        listed[i] = spread * static_cast<std::uint32_t>(i) + static_cast<std::uint32_t>(random()) % spread;
    std::shuffle(listed.begin(), listed.end(), random);
    const std::uint64_t num_primitives = spread * n + 1;
    std::vector<std::uint32_t> order(n);
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(voxels[a], listed[a]) < std::pair(voxels[b], listed[b]);
    });
    std::vector<std::uint64_t> first, list;
    for (std::uint64_t i = 0; i < n; ++i)
        if (i == 0 || voxels[order[i]] != list.back()) {
            first.push_back(i);
            list.push_back(voxels[order[i]]);
        }
    if (n != 0) first.push_back(n);
    const auto padded = [&](std::vector<std::uint32_t> v, std::uint32_t filler) { // more capacity than fragments
        v.resize(n + 100, filler);
        return v;
    };
    const bool is_wide = seed % 2 == 0;
    const counted result(padded(voxels, 0), padded(listed, 7), n, num_voxels, num_primitives, is_wide, list.size());
    ASSERT_EQ(result.state.list_voxels, list.size());
    if (n != 0) EXPECT_TRUE(result.first == first);
    if (is_wide)
        EXPECT_TRUE(result.wide == list);
    else
        EXPECT_TRUE(std::equal(list.begin(), list.end(), result.narrow.begin()));
    for (std::uint64_t i = 0; i < n; ++i) ASSERT_EQ(result.primitives[i], listed[order[i]]) << i << " of " << n;
    for (std::uint64_t i = n; i < n + 100; ++i) ASSERT_EQ(result.primitives[i], 42u);
}

// The same number of fragments for each voxel, in a list that is shuffled or in runs of neighbours.
std::vector<std::uint32_t> of_lengths(const std::vector<std::uint32_t>& lengths, std::uint32_t step, bool shuffled) {
    std::vector<std::uint32_t> voxels;
    for (std::uint32_t v = 0; v < lengths.size(); ++v) voxels.insert(voxels.end(), lengths[v], v * step);
    if (shuffled) std::shuffle(voxels.begin(), voxels.end(), std::mt19937(step));
    return voxels;
}

TEST(CountingSort, SortsInGridsOfEverySize) {
    constexpr std::uint32_t tile = device::counting_memory::tile;
    for (const std::uint32_t num_voxels : {1u, 2u, 5u, 4095u, tile - 1, tile, tile + 1, 33 * tile + 7, 1u << 21})
        for (const std::uint64_t n : {0u, 1u, 31u, 32u, 33u, 191u, 192u, 193u, 255u, 257u, 2048u, 50000u}) {
            std::mt19937 random(num_voxels + static_cast<std::uint32_t>(n));
            std::vector<std::uint32_t> voxels(n);
            for (auto& v : voxels) v = static_cast<std::uint32_t>(random()) % num_voxels;
            expect_counted(voxels, num_voxels, static_cast<std::uint32_t>(n) + num_voxels);
            for (auto& v : voxels) v = num_voxels - 1;
            expect_counted(voxels, num_voxels, static_cast<std::uint32_t>(n) + num_voxels + 1);
        }
}

TEST(CountingSort, OrdersVoxelsOfEveryLength) {
    std::vector<std::uint32_t> lengths;
    for (const std::uint32_t limit : {vp::tuning::window_length, vp::tuning::max_of_window, 512u, device::max_of_warp,
                                      vp::tuning::max_of_block, 2 * vp::tuning::max_of_block})
        for (const std::uint32_t length : {limit - 1, limit, limit + 1}) lengths.insert(lengths.end(), 3, length);
    for (std::uint32_t length = 1; length < 300; ++length) lengths.push_back(length);
    for (const bool shuffled : {false, true}) {
        expect_counted(of_lengths(lengths, 7, shuffled), 3000, 1 + shuffled);
        // Primitives far apart, so that no voxel is dense.
        expect_counted(of_lengths(lengths, 5000, shuffled), 1u << 21, 3 + shuffled, 20000);
    }
    expect_counted(of_lengths(std::vector<std::uint32_t>(40, vp::tuning::window_length), 1, true), 40, 5);
    // All voxels of a tile are long, and all long voxels are in one tile.
    expect_counted(of_lengths(std::vector<std::uint32_t>(3000, 258), 1, true), 1u << 17, 6);
    for (std::uint32_t rest = 1; rest < 40; ++rest)
        expect_counted(of_lengths({1, vp::tuning::window_length - 2, rest}, 3, false), 9, 7 + rest);
}

TEST(CountingSort, SortsMillionsOfFragments) {
    std::mt19937 random(9);
    std::vector<std::uint32_t> voxels(3'000'000);
    std::uint32_t at = 0;
    for (auto& v : voxels) { // neighbours in the list are near each other in space
        if (random() % 20 == 0) at = static_cast<std::uint32_t>(random()) % (1u << 21);
        v = (at + static_cast<std::uint32_t>(random() % 3)) % (1u << 21);
    }
    expect_counted(voxels, 1u << 21, 10);
}

// A list without capacity for all voxels still counts them, and nothing is written beyond its end.
TEST(CountingSort, CountsVoxelsBeyondTheCapacityWithoutWriting) {
    std::vector<std::uint32_t> voxels(5000), listed(5000);
    for (std::uint32_t i = 0; i < 5000; ++i) {
        voxels[i] = 3 * ((4999 - i) / 2);
        listed[i] = i;
    }
    for (const bool is_wide : {false, true}) {
        const counted result(voxels, listed, 5000, 8000, 5001, is_wide, 2000);
        EXPECT_EQ(result.state.list_voxels, 2500u);
        for (std::uint32_t i = 0; i < 2000; ++i) {
            ASSERT_EQ(is_wide ? result.wide[i] : result.narrow[i], 3 * i);
            ASSERT_EQ(result.first[i], 2 * i);
        }
        EXPECT_EQ(result.first[2000], 42u);
    }
}

// Long voxels in a call without the kernels that order them: they are counted, and all other voxels are sorted.
TEST(CountingSort, CountsLongVoxelsThatWereNotExpected) {
    const std::vector<std::uint32_t> voxels = of_lengths({5, 400, 7}, 1, true);
    std::vector<std::uint32_t> listed(voxels.size());
    std::iota(listed.begin(), listed.end(), 0u);
    const counted result(voxels, listed, voxels.size(), 3, voxels.size(), true, 3, 0);
    EXPECT_TRUE(device::has_failed(result.state, {0, 0, voxels.size(), 0, 0}));
    EXPECT_FALSE(device::has_failed(result.state, {0, 0, voxels.size(), 0}));
    EXPECT_EQ(result.state.list_voxels, 3u);
    EXPECT_TRUE(result.first == (std::vector<std::uint64_t>{0, 5, 405, 412}));
}

TEST(CountingSort, WritesNothingIfTheCallHasFailed) {
    const std::vector<std::uint32_t> fill(500, 41);
    const counted result(fill, fill, 1000, 42, 42, true, 500); // more fragments than room
    EXPECT_EQ(result.state.list_voxels, 0u);
    EXPECT_TRUE(std::all_of(result.primitives.begin(), result.primitives.end(), [](auto p) { return p == 42; }));
    EXPECT_TRUE(std::all_of(result.first.begin(), result.first.end(), [](std::uint64_t i) { return i == 42; }));
    EXPECT_TRUE(std::all_of(result.wide.begin(), result.wide.end(), [](std::uint64_t i) { return i == 42; }));
}

} // namespace
