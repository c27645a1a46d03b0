// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The sort of pairs by keys of 32 and 64 bits, the prefix sum of counts, and the selection of each voxel's first
// fragment, at lengths around the borders of tiles.

#include "device_test.hpp"

#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>

#include <algorithm>
#include <numeric>
#include <random>

using namespace device_test;
namespace device = voxelpipe::device;

namespace {

template <class T>
using device_array = vp::cuda_backend::buffer<T>;

template <class T>
[[nodiscard]] device_array<T> upload(vp::cuda_backend& gpu, const std::vector<T>& v) {
    return device_array<T>(gpu, vp::array_view<const T>(v.data(), v.size()));
}
template <class T>
[[nodiscard]] std::vector<T> download(vp::cuda_backend& gpu, const device_array<T>& from, std::size_t count) {
    std::vector<T> v(count);
    EXPECT_EQ(cudaMemcpyAsync(v.data(), from.data(), count * sizeof(T), cudaMemcpyDefault, gpu.stream), cudaSuccess);
    EXPECT_EQ(cudaStreamSynchronize(gpu.stream), cudaSuccess);
    return v;
}
// Storage that was not zeroed.
[[nodiscard]] device_array<std::byte> dirty_storage(vp::cuda_backend& gpu, std::size_t bytes) {
    return upload(gpu, std::vector<std::byte>(std::max<std::size_t>(bytes, 1), std::byte{0xa5}));
}

// Sorts keys, with numbered values, by their lowest `bits` bits, and compares with std::stable_sort.
template <class Key>
void expect_sorted(const std::vector<Key>& keys, int bits) {
    vp::cuda_backend gpu;
    const std::size_t n = keys.size();
    std::vector<std::uint32_t> order(n);
    std::iota(order.begin(), order.end(), 0u);
    device_array<Key> d_keys[2] = {upload(gpu, keys), upload(gpu, std::vector<Key>(n, 7))};
    device_array<std::uint32_t> d_values[2] = {upload(gpu, order), upload(gpu, std::vector<std::uint32_t>(n, 7))};
    Key* const k[2] = {d_keys[0].data(), d_keys[1].data()};
    std::uint32_t* const v[2] = {d_values[0].data(), d_values[1].data()};
    const std::size_t bytes = device::sort_bytes<Key>(n, bits);
    const auto storage = dirty_storage(gpu, bytes);
    const int at = device::sort_by_cell<Key>(k, v, n, bits, const_cast<std::byte*>(storage.data()), bytes,
                                             vp::stage::tile_sort, gpu.stream);
    const auto low = [&](std::uint32_t i) { return bits == 64 ? keys[i] : keys[i] & ((std::uint64_t{1} << bits) - 1); };
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return low(a) < low(b); });
    const std::vector<Key> sorted = download(gpu, d_keys[at], n);
    const std::vector<std::uint32_t> values = download(gpu, d_values[at], n);
    for (std::size_t i = 0; i < n; ++i) {
        ASSERT_EQ(values[i], order[i]) << i << " of " << n << ", " << bits << " bits";
        ASSERT_EQ(sorted[i], keys[order[i]]) << i << " of " << n << ", " << bits << " bits";
    }
}

template <class Key>
[[nodiscard]] std::vector<Key> random_keys(std::size_t n, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<Key> keys(n);
    for (Key& k : keys) k = static_cast<Key>(random());
    return keys;
}

template <class Key>
class KeySort : public testing::Test {};
using key_types = testing::Types<std::uint32_t, std::uint64_t>;
TYPED_TEST_SUITE(KeySort, key_types);

// Bits of the keys above those in use are random, and must not count.
TYPED_TEST(KeySort, IsStableAndUsesTheBitsInUseAlone) {
    for (const int bits : {0, 1, 8, 9, 10, 18, 19, 27, 28, 32, 33, 36, 37, 45, 55, 63, 64})
        if (bits <= 8 * static_cast<int>(sizeof(TypeParam)))
            expect_sorted(random_keys<TypeParam>(9000, static_cast<std::uint64_t>(bits)), bits);
}

TYPED_TEST(KeySort, HandlesLengthsAroundTileBorders) {
    constexpr std::size_t tile = vp::tuning::key_sort_threads * vp::tuning::key_sort_items;
    for (const std::size_t n : {std::size_t{1}, std::size_t{2}, std::size_t{31}, tile - 1, tile, tile + 1, 3 * tile})
        for (const int bits : {5, 18, 32}) expect_sorted(random_keys<TypeParam>(n, n), bits);
}

// All equal, two alternating, the largest key, runs, and fillers at the end.
TYPED_TEST(KeySort, IsStableForEqualKeys) {
    constexpr std::size_t n = 10000;
    constexpr auto largest = static_cast<TypeParam>(~TypeParam{0});
    std::vector<TypeParam> keys(n, largest);
    expect_sorted(keys, 20);
    for (std::size_t i = 0; i < n; ++i) keys[i] = i % 2 == 0 ? largest : 0;
    expect_sorted(keys, 8 * static_cast<int>(sizeof(TypeParam)));
    for (std::size_t i = 0; i < n; ++i) keys[i] = i < n / 3 ? static_cast<TypeParam>((n - i) / 70) : largest;
    expect_sorted(keys, 11);
}

// Many tiles: on a device most look back at predecessors that are still working.
TYPED_TEST(KeySort, LooksBackOverManyTiles) { expect_sorted(random_keys<TypeParam>(700'001, 3), 30); }

TEST(KeySortOfNoPairs, DoesNothing) {
    std::uint32_t* const none[2] = {nullptr, nullptr};
    vp::cuda_backend gpu;
    EXPECT_EQ(device::sort_by_cell<std::uint32_t>(none, none, 0, 9, nullptr, 0, vp::stage::tile_sort, gpu.stream), 0);
}

TEST(PrefixSum, AddsCountsWhoseSumsNeed64Bits) {
    vp::cuda_backend gpu;
    for (const std::uint32_t n : {1u, 255u, 1023u, 1024u, 1025u, 70'001u}) {
        std::mt19937 random(n);
        std::vector<std::uint32_t> counts(n);
        for (auto& c : counts) c = static_cast<std::uint32_t>(random());
        const auto d_counts = upload(gpu, counts);
        auto d_offsets = upload(gpu, std::vector<unsigned long long>(n, 7));
        const std::size_t bytes = device::cell_scan_bytes(n);
        auto storage = dirty_storage(gpu, bytes);
        device::sum_counts(d_counts.data(), d_offsets.data(), n, storage.data(), bytes, vp::stage::tile_sort,
                           gpu.stream);
        const auto offsets = download(gpu, d_offsets, n);
        unsigned long long sum = 0;
        for (std::uint32_t i = 0; i < n; ++i) {
            ASSERT_EQ(offsets[i], sum) << i << " of " << n;
            sum += counts[i];
        }
    }
}

// Selects the first of each run of `num` keys in memory for `capacity`.
template <class Key>
void expect_selected(std::vector<Key> keys, std::uint64_t num, bool fails) {
    vp::cuda_backend gpu;
    const std::uint64_t capacity = fails ? num - 1 : keys.size();
    device::pipeline_state state{};
    state.list_fragments = num;
    state.list_voxels = 12345;
    auto d_state = upload(gpu, std::vector{state});
    const auto d_keys = upload(gpu, keys);
    auto d_first = upload(gpu, std::vector<std::uint64_t>(keys.size() + 1, 7));
    const std::size_t bytes = device::select_bytes(capacity);
    auto storage = dirty_storage(gpu, bytes);
    device::select_voxels({d_keys.data(), sizeof(Key) == 8}, d_first.data(), d_state.data(), {0, 0, capacity, 0},
                          storage.data(), bytes, gpu.stream);
    std::vector<std::uint64_t> expected;
    for (std::uint64_t i = 0; i < num && !fails; ++i)
        if (i == 0 || keys[i] != keys[i - 1]) expected.push_back(i);
    ASSERT_EQ(download(gpu, d_state, 1)[0].list_voxels, expected.size()) << num;
    const auto first = download(gpu, d_first, expected.size() + 1);
    for (std::size_t v = 0; v < expected.size(); ++v) ASSERT_EQ(first[v], expected[v]) << v << " of " << num;
    EXPECT_EQ(first[expected.size()], 7u) << "written beyond the last voxel";
}

TYPED_TEST(KeySort, SelectsTheFirstFragmentOfEachVoxel) {
    for (const std::size_t n : {0, 1, 31, 32, 33, 2047, 2048, 2049, 4096, 50'000})
        for (const std::size_t run : {1, 3, 40, 5000}) {
            std::vector<TypeParam> keys(n + 100, static_cast<TypeParam>(~TypeParam{0}));
            for (std::size_t i = 0; i < n; ++i) keys[i] = static_cast<TypeParam>((i + run / 2) / run * 0x10001);
            expect_selected(keys, n, false);
        }
    expect_selected(std::vector<TypeParam>(5000, 1), 5000, true);
}

} // namespace
