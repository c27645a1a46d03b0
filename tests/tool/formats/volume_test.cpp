// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "test_volumes.hpp"
#include "write/sparse_formats.hpp"

#include <voxelpipe/sparse/io/nanovdb_layout.hpp>

#include <algorithm>
#include <cstring>
#include <map>
#include <tuple>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Nvdb : public in_folder {
protected:
    // The bytes of each grid of a file behind its head, by name.
    [[nodiscard]] static std::map<std::string, std::string> grids_of(const std::filesystem::path& path) {
        namespace nanovdb = voxelpipe::io::nanovdb;
        const std::string file = read_file(path);
        const auto header = read_value<nanovdb::file_header>(file, 0);
        std::size_t at = sizeof(header);
        std::vector<std::pair<std::string, std::uint64_t>> entries;
        for (int n = 0; n < header.num_grids; ++n) {
            const auto entry = read_value<nanovdb::file_entry>(file, at);
            at += sizeof(entry) + entry.name_size;
            entries.emplace_back(file.substr(at - entry.name_size, entry.name_size - 1), entry.grid_size);
        }
        std::map<std::string, std::string> grids;
        for (const auto& [name, size] : entries) {
            grids[name] = file.substr(at + sizeof(nanovdb::grid_data), size - sizeof(nanovdb::grid_data));
            at += size;
        }
        EXPECT_EQ(at, file.size());
        return grids;
    }
};

} // namespace

TEST(Volume, BitsStandWhereTheWordsSay) {
    volume v = make_volume({70, 3, 2});
    channel& bits = v.add("occupancy", scalar::bit);
    EXPECT_EQ(v.words_per_row(), 3);
    EXPECT_EQ(bits.data.size(), 3u * 4 * 3 * 2);
    v.set_bit(bits, 0, 0, 0);
    v.set_bit(bits, 33, 1, 0);
    v.set_bit(bits, 69, 2, 1);
    EXPECT_EQ(v.word(bits, 0, 0, 0), 1u);
    EXPECT_EQ(v.word(bits, 1, 1, 0), 2u);
    EXPECT_EQ(v.word(bits, 2, 2, 1), 1u << 5);
    EXPECT_TRUE(v.occupied(33, 1, 0));
    EXPECT_FALSE(v.occupied(33, 1, 1));
    EXPECT_EQ(v.popcount(), 3);
    v.set_bit(bits, 33, 1, 0, false);
    EXPECT_EQ(v.popcount(), 2);
}

TEST(Volume, CheckNamesWhatIsWrong) {
    const auto message = [](const auto& spoil) {
        volume v = make_colored({5, 4, 3});
        spoil(v);
        try {
            v.check();
        } catch (const std::invalid_argument& e) {
            return std::string(e.what());
        }
        return std::string("no complaint");
    };
    EXPECT_EQ(message([](volume&) {}), "no complaint");
    EXPECT_NE(message([](volume& v) { v.extent[1] = 0; }).find("extent"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.extent = {1ll << 40, 1ll << 40, 2}; }).find("counted"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.voxel_size[2] = 0; }).find("voxel size"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.voxel_size[2] = std::nan(""); }).find("voxel size"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.channels[0].name = ""; }).find("no name"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.channels[0].name = "a/b"; }).find("letters"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.channels[0].name = "color"; }).find("two channels"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.channels[0].components = 2; }).find("components"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.channels[1].components = 5; }).find("components"), std::string::npos);
    EXPECT_NE(message([](volume& v) { v.channels[1].data.pop_back(); }).find("per voxel"), std::string::npos);
}

TEST(Volume, OccupancyMustBeThere) {
    volume v = make_volume({2, 2, 2});
    v.add("occupancy", scalar::u8);
    EXPECT_EQ(v.occupancy(), nullptr);
    EXPECT_THROW((void)v.popcount(), std::logic_error);
    EXPECT_THROW((void)v.occupied(0, 0, 0), std::logic_error);
}

// A slab's grid is the grid that its layers alone would have, but for the head, which counts the grids of the file.
TEST_F(Nvdb, ASlabIsTheGridOfItsLayers) {
    volume v = make_occupancy({40, 30, 44}, 9);
    for (const auto& [name, type, components] :
         {std::tuple{"color", scalar::u8, 4}, std::tuple{"count", scalar::u32, 1},
          std::tuple{"depth", scalar::f32, 1}}) {
        v.add(name, type, components);
        fill(v, v.channels.size() - 1);
    }
    write_options options;
    options.pieces = 2; // of 6 layers of bricks
    write_sparse(make_sparse(v, 1), folder_ / "slabs.nvdb", options);
    const auto slabs = grids_of(folder_ / "slabs.nvdb");
    ASSERT_EQ(slabs.size(), 8u);
    options = {};
    options.leaves_per_grid = 70; // 5 x 4 bricks a layer
    write_sparse(make_sparse(v, 1), folder_ / "bounded.nvdb", options);
    EXPECT_TRUE(slabs == grids_of(folder_ / "bounded.nvdb"));
    for (int n = 0; n < 2; ++n) {
        volume layers = v;
        for (std::int64_t at = 0; at < v.num_voxels(); ++at)
            if ((at / 1200 < 24) != (n == 0))
                layers.set_bit(layers.channels[0], at % 40, at / 40 % 30, at / 1200, false);
        write_sparse(make_sparse(layers, 1), folder_ / "alone.nvdb", {});
        for (const auto& [name, grid] : grids_of(folder_ / "alone.nvdb"))
            EXPECT_TRUE(grid == slabs.at(name + "." + std::to_string(n + 1))) << name << n;
    }
}

namespace {

// A brick, tiles of 8 and of 16 voxels a side, and a number for each.
sparse_volume volume_with_tiles() {
    sparse_volume v;
    v.shape.extent = {40, 32, 32};
    v.shape.voxel_size = {1, 1, 1};
    const auto key = [](int x, int y, int z) { return voxelpipe::core::morton_key(x, y, z); };
    v.tiles = {voxelpipe::brick_tile::of(key(1, 0, 0), 0), voxelpipe::brick_tile::of(key(2, 0, 0), 1)};
    v.keys = {key(0, 2, 0)};
    v.masks.resize(1);
    v.masks[0].words[3] = 0x8001;
    v.offsets = {0, 2};
    channel numbers{"count", scalar::u32, 1, {}};
    for (std::uint32_t n = 1; n <= 4; ++n)
        for (int byte = 0; byte < 4; ++byte) numbers.data.push_back(static_cast<std::byte>(byte == 0 ? n : 0));
    v.channels = {{"occupancy", scalar::bit, 1, {}}, numbers};
    return v;
}
std::uint32_t value_at(const sparse_volume& v, const glm::ivec3& p) {
    const std::uint64_t rank = v.table().find(p);
    std::uint32_t value = 0;
    if (rank != voxelpipe::brick_table::none) std::memcpy(&value, v.channels[1].data.data() + 4 * rank, 4);
    return value;
}

} // namespace

// Four tiles below and four above become one where their values are the same.
TEST_F(Nvdb, TilesOfSlabsAreThoseOfTheWhole) {
    const auto half = [](int z, std::uint32_t value) {
        sparse_volume v;
        v.shape.extent = {16, 16, 16};
        v.shape.voxel_size = {1, 1, 1};
        channel numbers{"count", scalar::u32, 1, {}};
        numbers.data.resize(16);
        for (int i = 0; i < 4; ++i) {
            v.tiles.push_back(voxelpipe::brick_tile::of(voxelpipe::core::morton_key(i & 1, i >> 1, z), 0));
            store(numbers.data.data() + 4 * i, value);
        }
        v.channels = {{"occupancy", scalar::bit, 1, {}}, numbers};
        return v;
    };
    const auto joined = [&](std::uint32_t above) {
        std::vector<sparse_volume> parts;
        parts.push_back(half(1, above));
        parts.push_back(half(0, 70));
        return join_slabs(std::move(parts));
    };
    const sparse_volume same = joined(70), other = joined(71);
    ASSERT_EQ(same.tiles.size(), 1u);
    EXPECT_EQ(same.tiles[0], voxelpipe::brick_tile::of(0, 1));
    EXPECT_EQ(same.channels[1].data.size(), 4u);
    EXPECT_EQ(value_at(same, {3, 4, 5}), 70u);
    ASSERT_EQ(other.tiles.size(), 8u);
    EXPECT_EQ(value_at(other, {15, 15, 7}), 70u);
    EXPECT_EQ(value_at(other, {0, 0, 8}), 71u);
}

TEST_F(Nvdb, TilesAreOpenedWhereBricksAreAskedFor) {
    const sparse_volume v = volume_with_tiles(), all = open_tiles(v);
    EXPECT_TRUE(all.tiles.empty());
    EXPECT_EQ(all.keys.size(), 1u + 1 + 8);
    EXPECT_TRUE(std::is_sorted(all.keys.begin(), all.keys.end()));
    EXPECT_EQ(all.num_voxels(), 2u + 9 * 512);
    const auto key = [](int x, int y, int z) { return voxelpipe::core::morton_key(x, y, z); };
    const std::vector<std::uint64_t> touched{key(0, 0, 0), key(3, 0, 0), key(2, 1, 1), key(0, 2, 0)};
    const sparse_volume some = open_tiles(v, &touched);
    EXPECT_EQ(some.keys.size(), 3u);
    EXPECT_EQ(some.tiles.size(), 1u + 6);
    EXPECT_EQ(some.num_voxels(), v.num_voxels());
    EXPECT_EQ(some.channels[1].data.size(), 4 * some.num_values());
    int wrong = 0, filled = 0;
    for (int z = 0; z < 32; ++z)
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 40; ++x) {
                const std::uint32_t is = value_at(v, {x, y, z});
                filled += is != 0 ? 1 : 0;
                wrong += value_at(all, {x, y, z}) == is && value_at(some, {x, y, z}) == is ? 0 : 1;
            }
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(static_cast<std::uint64_t>(filled), v.num_voxels());
    // Formats that name every voxel are those of the open volume; .nvdb keeps tiles, unless it is cut into slabs.
    for (const char* name : {"a.npz", "a.vti"}) {
        write_sparse(v, folder_ / name, {});
        const std::string bytes = read_file(folder_ / name);
        write_sparse(all, folder_ / name, {});
        EXPECT_TRUE(bytes == read_file(folder_ / name)) << name;
    }
    write_options slabs;
    slabs.pieces = 2;
    write_sparse(v, folder_ / "slabs.nvdb", slabs);
    const std::string cut = read_file(folder_ / "slabs.nvdb");
    write_sparse(all, folder_ / "slabs.nvdb", slabs);
    EXPECT_TRUE(cut == read_file(folder_ / "slabs.nvdb"));
    write_sparse(v, folder_ / "tiles.nvdb", {});
    write_sparse(all, folder_ / "open.nvdb", {});
    EXPECT_EQ(std::filesystem::file_size(folder_ / "open.nvdb") - std::filesystem::file_size(folder_ / "tiles.nvdb"),
              9 * (sizeof(voxelpipe::io::nanovdb::leaf_node<std::uint32_t>) +
                   sizeof(voxelpipe::io::nanovdb::leaf_node<voxelpipe::io::nanovdb::mask_value>)));
}
