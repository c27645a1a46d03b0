// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// core/layout.hpp and core/tile_grid.hpp: every layout stores each voxel at the documented address, and no two voxels
// share one; tiles cover the extent.

#include "test_support.hpp"

#include <voxelpipe/core/tile_grid.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <gtest/gtest.h>

#include <cstring>
#include <set>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace layout = voxelpipe::layout;

const glm::ivec3 extents[] = {{1, 1, 1}, {31, 3, 2},  {32, 8, 8},  {33, 9, 7},
                              {8, 8, 8}, {7, 17, 23}, {100, 1, 5}, {64, 16, 1}};

template <class F>
void for_each_voxel(glm::ivec3 e, F&& f) {
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y)
            for (int x = 0; x < e.x; ++x) f(x, y, z);
}

// Storing one voxel changes that voxel and no other, and loading returns the stored value.
template <class T, class Layout>
void check_bijection() {
    using map = vp::core::storage_map<T, Layout>;
    for (const glm::ivec3& e : extents) {
        std::vector<typename map::element> data(map::elements(e));
        std::memset(static_cast<void*>(data.data()), 0, data.size() * sizeof(data[0]));
        std::uint32_t n = 0;
        const auto value = [](std::uint32_t i) {
            if constexpr (map::is_bit) {
                return (i * 2654435761u >> 16 & 1u) != 0;
            } else if constexpr (map::components > 1) {
                typename map::value v;
                for (int c = 0; c < map::components; ++c)
                    // a value that every element type can hold
                    v[c] = static_cast<typename vp::core::vector_traits<T>::element>(
                        static_cast<float>((i * 4 + static_cast<std::uint32_t>(c)) % 251));
                return v;
            } else {
                return static_cast<typename map::value>(i + 1);
            }
        };
        for_each_voxel(e, [&](int x, int y, int z) { map::store(data.data(), e, x, y, z, value(n++)); });
        n = 0;
        for_each_voxel(e, [&](int x, int y, int z) {
            ASSERT_LT(map::cell(e, x, y, z), map::cells(e));
            ASSERT_TRUE(map::load(data.data(), e, x, y, z) == value(n++)) << x << ' ' << y << ' ' << z;
        });
    }
}

TEST(StorageMap, NoTwoVoxelsShareAnAddress) {
    check_bijection<std::uint32_t, layout::linear>();
    check_bijection<std::uint32_t, layout::tiled>();
    check_bijection<std::uint32_t, layout::planar>();
    check_bijection<std::uint64_t, layout::tiled>();
    check_bijection<vp::bit, layout::linear>();
    check_bijection<vp::bit, layout::tiled>();
    check_bijection<vp::bit, layout::planar>();
    check_bijection<glm::vec3, layout::linear>();
    check_bijection<glm::vec3, layout::planar>();
    check_bijection<glm::vec3, layout::tiled>();
    check_bijection<glm::vec<4, vp::half>, layout::planar>();
    check_bijection<glm::vec<2, std::uint8_t>, layout::linear>();
}

TEST(StorageMap, LinearIsXFastestThenYThenZ) {
    const glm::ivec3 e{5, 7, 3};
    using scalar = vp::core::storage_map<float, layout::linear>;
    EXPECT_EQ(scalar::elements(e), 105u);
    std::size_t next = 0;
    for_each_voxel(e, [&](int x, int y, int z) { EXPECT_EQ(scalar::cell(e, x, y, z), next++); });
    // RGBRGB
    using vector = vp::core::storage_map<glm::vec3, layout::linear>;
    static_assert(std::is_same_v<vector::element, glm::vec3>);
    EXPECT_EQ(vector::elements(e), 105u);
}

TEST(StorageMap, PlanarIsOnePlaneAComponent) {
    const glm::ivec3 e{5, 7, 3};
    using map = vp::core::storage_map<glm::vec3, layout::planar>;
    static_assert(std::is_same_v<map::element, float>);
    ASSERT_EQ(map::elements(e), 315u);
    std::vector<float> data(315);
    map::store(data.data(), e, 2, 3, 1, {1, 2, 3});
    const std::size_t at = (1 * 7 + 3) * 5 + 2;
    EXPECT_EQ(data[at], 1);
    EXPECT_EQ(data[at + 105], 2);
    EXPECT_EQ(data[at + 210], 3);
}

TEST(StorageMap, BitRowsArePaddedToWords) {
    using map = vp::core::storage_map<vp::bit, layout::linear>;
    EXPECT_EQ(map::elements({1, 1, 1}), 1u);
    EXPECT_EQ(map::elements({32, 2, 2}), 4u);
    EXPECT_EQ(map::elements({33, 2, 2}), 8u);
    std::vector<std::uint32_t> data(8);
    map::store(data.data(), {33, 2, 2}, 32, 1, 1, true);
    map::store(data.data(), {33, 2, 2}, 5, 0, 1, true);
    EXPECT_EQ(data, (std::vector<std::uint32_t>{0, 0, 0, 0, 32, 0, 0, 1}));
    map::store(data.data(), {33, 2, 2}, 5, 0, 1, false);
    EXPECT_EQ(data[4], 0u);
}

TEST(StorageMap, TiledIsBricksOfEight) {
    using map = vp::core::storage_map<std::uint16_t, layout::tiled>;
    const glm::ivec3 e{17, 9, 8}; // 3 x 2 x 1 bricks
    EXPECT_EQ(map::elements(e), 6u * 512);
    EXPECT_EQ(map::cell(e, 0, 0, 0), 0u);
    EXPECT_EQ(map::cell(e, 7, 0, 0), 7u);
    EXPECT_EQ(map::cell(e, 0, 1, 0), 8u);
    EXPECT_EQ(map::cell(e, 0, 0, 1), 64u);
    EXPECT_EQ(map::cell(e, 8, 0, 0), 512u);
    EXPECT_EQ(map::cell(e, 16, 8, 7), 5u * 512 + 7 * 64);
    using bits = vp::core::storage_map<vp::bit, layout::tiled>;
    EXPECT_EQ(bits::elements({33, 9, 8}), 4u * 64); // bricks of 32 x 8 x 8
    EXPECT_EQ(bits::cell({33, 9, 8}, 32, 8, 7), 3u * 64 + 56);
}

// In a grid of more than 2^32 voxels, addresses exceed 32 bits.
TEST(StorageMap, AddressesMayExceed32Bits) {
    const glm::ivec3 e{4096, 4096, 4096};
    using bytes = vp::core::storage_map<std::uint8_t, layout::linear>;
    EXPECT_EQ(bytes::elements(e), std::size_t{1} << 36);
    EXPECT_EQ(bytes::cell(e, 4095, 4095, 4095), (std::size_t{1} << 36) - 1);
    using tiled = vp::core::storage_map<float, layout::tiled>;
    EXPECT_EQ(tiled::cell(e, 4095, 4095, 4095), (std::size_t{1} << 36) - 1);
    using bits = vp::core::storage_map<vp::bit, layout::linear>;
    EXPECT_EQ(bits::cell(e, 4095, 4095, 4095), (std::size_t{1} << 31) - 1);
    EXPECT_TRUE((vp::fits_memory<vp::target<double, vp::blend::add>>(e)));
    const glm::ivec3 huge(1 << 20);
    EXPECT_TRUE((vp::fits_memory<vp::target<std::uint8_t, vp::blend::add>>(huge)));
    EXPECT_FALSE((vp::fits_memory<vp::target<double, vp::blend::add>>(huge))); // 2^63 bytes
}

TEST(TileGrid, CoversTheExtentOnceAndNumbersBothWays) {
    for (const glm::ivec3& e : extents)
        for (int log2 = 0; log2 <= 5; ++log2) {
            const vp::core::tile_grid tiles(e, log2);
            std::set<std::uint64_t> seen;
            for_each_voxel(tiles.tiles, [&](int x, int y, int z) {
                const std::uint64_t i = tiles.index(x, y, z);
                ASSERT_LT(i, tiles.count());
                ASSERT_EQ(tiles.position(i), glm::ivec3(x, y, z));
                seen.insert(i);
            });
            ASSERT_EQ(seen.size(), tiles.count());
            for (int a = 0; a < 3; ++a) {
                ASSERT_GE(tiles.tiles[a] << log2, e[a]);
                ASSERT_LT((tiles.tiles[a] - 1) << log2, e[a]);
            }
        }
}

// ---- core/change_log.hpp --------------------------------------------------------------------------------------------

TEST(ChangeLog, HasABitForEachChunk) {
    const auto rows = [](glm::ivec3 e) { return vp::core::chunk_rows(e); };
    const vp::core::chunk_rows one = rows({1, 1, 1}), exact = rows({1024, 8, 16}), more = rows({1025, 9, 17});
    EXPECT_EQ(one.num_words(), 1u);
    EXPECT_EQ(exact.words, 1);
    EXPECT_EQ(exact.count(), 2u);
    EXPECT_EQ(more.words, 2);
    EXPECT_EQ(more.y, 2);
    EXPECT_EQ(more.z, 3);
    EXPECT_EQ(more.num_words(), 12u);
    EXPECT_EQ(rows({2147483647, 1, 1}).words, 1 << 21);
    EXPECT_EQ(rows({0, -5, 7}).num_words(), 0u);
    EXPECT_EQ(vp::change_words({1024, 1024, 1024}), vp::core::change_log::header_words + 128u * 128u);
}

TEST(ChangeLog, KnowsValuesByTheirBytes) {
    using known = vp::core::change_log::known;
    const auto same = [](const known& a, const known& b) {
        return std::memcmp(a.words, b.words, sizeof(a.words)) == 0;
    };
    EXPECT_TRUE(same(known(1.5f), known(1.5f)));
    EXPECT_FALSE(same(known(0.0f), known(-0.0f)));
    EXPECT_FALSE(same(known(0.0f), known())); // a known value, though all its bytes are zero
    EXPECT_FALSE(same(known(glm::dvec4(1, 2, 3, 4)), known(glm::dvec4(1, 2, 3, 5))));
    std::vector<std::uint32_t> words(vp::change_words({40, 9, 9}), ~0u);
    vp::core::change_log::forget(words.data());
    EXPECT_EQ(words[vp::core::change_log::header_words - 1], 0u);
    EXPECT_EQ(words[vp::core::change_log::header_words], ~0u); // the marks stay; without a header they are not used
}

} // namespace
