// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// .vdb files, read back by OpenVDB.

#include "test_volumes.hpp"

#include <model/srgb.hpp>
#include <write/formats/formats.hpp>
#include <write/sparse_formats.hpp>

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Diagnostics.h>

#include <algorithm>
#include <cmath>
#include <map>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Vdb : public in_folder {};

using grids = std::map<std::string, openvdb::GridBase::Ptr>;

grids read(const std::filesystem::path& file) {
    openvdb::initialize();
    openvdb::io::File in(file.string());
    in.open(false);
    grids found;
    for (const openvdb::GridBase::Ptr& grid : *in.getGrids()) found[grid->getName()] = grid;
    return found;
}

// Counts of small numbers, but the last voxel's, which is `most`.
volume with_all_types(std::uint32_t most) {
    volume v = make_volume({21, 13, 18});
    v.origin = {-3, 0.5, 10};
    v.voxel_size = {0.5, 0.25, 2};
    v.add("occupancy", scalar::bit);
    v.add("color", scalar::u8, 4);
    v.add("count", scalar::u32);
    v.add("material", scalar::i32);
    v.add("depth", scalar::f32);
    v.add("normal", scalar::f32, 3);
    v.add("fraction", scalar::f32);
    for (std::size_t c = 0; c < v.channels.size(); ++c) fill(v, c);
    channel& count = *v.find("count");
    for (std::int64_t i = 0; i < v.num_voxels(); ++i)
        store(count.data.data() + 4 * i, static_cast<std::uint32_t>(i % 100 + 1));
    v.set_bit(*v.find("occupancy"), 20, 12, 17);
    store(count.data.data() + 4 * v.index(20, 12, 17), most);
    return v;
}

// VALUE(i) is what the grid holds at voxel i of the volume, where that is occupied; elsewhere nothing is active.
template <class Grid, class Value>
void expect_values(const grids& found, const std::string& name, const volume& v, const Value& value) {
    ASSERT_TRUE(found.contains(name)) << name;
    const auto grid = openvdb::gridPtrCast<Grid>(found.at(name));
    ASSERT_TRUE(grid != nullptr) << name << " is a " << found.at(name)->type();
    const auto accessor = grid->getConstAccessor();
    for (int z = -1; z <= v.extent[2]; ++z)
        for (int y = -1; y <= v.extent[1]; ++y)
            for (int x = -1; x <= v.extent[0]; ++x) {
                const bool inside = x >= 0 && y >= 0 && z >= 0 && x < v.extent[0] && y < v.extent[1] && z < v.extent[2];
                const openvdb::Coord at(x, y, z);
                const bool is_there = inside && v.occupied(x, y, z);
                ASSERT_EQ(is_there, accessor.isValueOn(at)) << name << at;
                if (!is_there) continue;
                ASSERT_EQ(value(static_cast<std::size_t>(v.index(x, y, z))), accessor.getValue(at)) << name << at;
            }
    const openvdb::Vec3d centre = grid->transform().indexToWorld(openvdb::Vec3d(4, 5, 6));
    EXPECT_EQ(openvdb::Vec3d(-3 + 4.5 * 0.5, 0.5 + 5.5 * 0.25, 10 + 6.5 * 2), centre);
}

template <class T>
T value_at(const volume& v, const char* name, std::size_t i, std::size_t component = 0, std::size_t components = 1) {
    T value;
    std::memcpy(&value, v.find(name)->data.data() + (i * components + component) * sizeof(T), sizeof(T));
    return value;
}

TEST_F(Vdb, HoldsEveryChannelWhereThereAreVoxels) {
    const volume v = with_all_types(100);
    ASSERT_EQ(std::vector<std::filesystem::path>{folder_ / "a.vdb"}, write(v, folder_ / "a.vdb"));
    const grids found = read(folder_ / "a.vdb");
    EXPECT_EQ(8U, found.size());
    EXPECT_EQ(openvdb::GRID_FOG_VOLUME, found.at("fraction")->getGridClass());
    EXPECT_EQ(openvdb::GRID_UNKNOWN, found.at("depth")->getGridClass());
    const color_tables tables = make_color_tables();
    const auto byte = [&](std::size_t i, std::size_t c) { return value_at<std::uint8_t>(v, "color", i, c, 4); };
    expect_values<openvdb::MaskGrid>(found, "occupancy", v, [](std::size_t) { return true; });
    expect_values<openvdb::Vec3SGrid>(found, "color", v, [&](std::size_t i) {
        return openvdb::Vec3s(tables.linear[byte(i, 0)], tables.linear[byte(i, 1)], tables.linear[byte(i, 2)]);
    });
    expect_values<openvdb::FloatGrid>(found, "color.alpha", v,
                                      [&](std::size_t i) { return tables.fraction[byte(i, 3)]; });
    expect_values<openvdb::Int32Grid>(found, "count", v, [&](std::size_t i) {
        return static_cast<std::int32_t>(value_at<std::uint32_t>(v, "count", i));
    });
    expect_values<openvdb::Int32Grid>(found, "material", v,
                                      [&](std::size_t i) { return value_at<std::int32_t>(v, "material", i); });
    expect_values<openvdb::FloatGrid>(found, "depth", v, [&](std::size_t i) { return value_at<float>(v, "depth", i); });
    expect_values<openvdb::FloatGrid>(found, "fraction", v,
                                      [&](std::size_t i) { return value_at<float>(v, "fraction", i); });
    expect_values<openvdb::Vec3SGrid>(found, "normal", v, [&](std::size_t i) {
        return openvdb::Vec3s(value_at<float>(v, "normal", i, 0, 3), value_at<float>(v, "normal", i, 1, 3),
                              value_at<float>(v, "normal", i, 2, 3));
    });
}

// A brick, and tiles of 128, 8 and 16 voxels a side, each with values of its own; and the dense volume of them.
std::pair<sparse_volume, volume> with_tiles() {
    using voxelpipe::brick_tile;
    using voxelpipe::core::morton_key;
    std::pair<sparse_volume, volume> both;
    auto& [v, dense] = both;
    v.shape.extent = dense.extent = {160, 128, 128};
    v.shape.origin = dense.origin = {-3, 0.5, 10};
    v.shape.voxel_size = dense.voxel_size = {0.5, 0.25, 2};
    v.tiles = {brick_tile::of(morton_key(0, 0, 0), 4), brick_tile::of(morton_key(17, 0, 0), 0),
               brick_tile::of(morton_key(18, 2, 0), 1)};
    v.keys = {morton_key(16, 1, 3)};
    v.masks.resize(1);
    v.masks[0].words[0] = 0x11;
    v.masks[0].words[7] = std::uint64_t{1} << 63;
    v.offsets = {0, 3};
    const auto count_of = [](std::size_t rank) { return static_cast<std::uint32_t>(rank * rank + 1); };
    const auto color_of = [](std::size_t rank) { return static_cast<std::uint32_t>(0xff804020U + 3 * rank); };
    v.channels = {{"occupancy", scalar::bit, 1, {}}, {"color", scalar::u8, 4, {}}, {"count", scalar::u32, 1, {}}};
    v.channels[1].data.resize(4 * v.num_values());
    v.channels[2].data.resize(4 * v.num_values());
    for (std::size_t rank = 0; rank < v.num_values(); ++rank) {
        store(v.channels[1].data.data() + 4 * rank, color_of(rank));
        store(v.channels[2].data.data() + 4 * rank, count_of(rank));
    }
    dense.add("occupancy", scalar::bit);
    dense.add("color", scalar::u8, 4);
    dense.add("count", scalar::u32);
    const auto fill_box = [&dense = dense, &count_of, &color_of](const glm::ivec3& low, int side, std::size_t rank) {
        for (int z = low.z; z < low.z + side; ++z)
            for (int y = low.y; y < low.y + side; ++y)
                for (int x = low.x; x < low.x + side; ++x) {
                    const auto at = 4 * static_cast<std::size_t>(dense.index(x, y, z));
                    dense.set_bit(*dense.find("occupancy"), x, y, z);
                    store(dense.find("color")->data.data() + at, color_of(rank));
                    store(dense.find("count")->data.data() + at, count_of(rank));
                }
    };
    fill_box({128, 8, 24}, 1, 0); // bits 0, 4 and 511 of the brick
    fill_box({128, 8, 25}, 1, 1);
    fill_box({135, 15, 31}, 1, 2);
    fill_box({0, 0, 0}, 128, 3);
    fill_box({136, 0, 0}, 8, 4);
    fill_box({144, 16, 0}, 16, 5);
    return both;
}

TEST_F(Vdb, TilesOfSolidsAreTheVoxelsOfTheDenseGrid) {
    const auto both = with_tiles();
    const sparse_volume& v = both.first;
    const volume& dense = both.second;
    ASSERT_EQ(static_cast<std::int64_t>(v.num_voxels()), dense.popcount(*dense.occupancy()));
    write_sparse(v, folder_ / "a.vdb", {});
    const grids found = read(folder_ / "a.vdb");
    EXPECT_EQ(3U, found.size());
    const color_tables tables = make_color_tables();
    expect_values<openvdb::MaskGrid>(found, "occupancy", dense, [](std::size_t) { return true; });
    expect_values<openvdb::Vec3SGrid>(found, "color", dense, [&](std::size_t i) {
        const auto byte = [&](std::size_t c) { return value_at<std::uint8_t>(dense, "color", i, c, 4); };
        return openvdb::Vec3s(tables.linear[byte(0)], tables.linear[byte(1)], tables.linear[byte(2)]);
    });
    expect_values<openvdb::Int32Grid>(found, "count", dense, [&](std::size_t i) {
        return static_cast<std::int32_t>(value_at<std::uint32_t>(dense, "count", i));
    });
    // In the file they are tiles too: one of 128, and 1 + 8 of 8 voxels a side. The brick is the leaf.
    for (const auto& [name, grid] : found) {
        EXPECT_EQ(1U, grid->baseTree().leafCount()) << name;
        EXPECT_EQ(10U, grid->baseTree().activeTileCount()) << name;
        EXPECT_EQ(v.num_voxels(), grid->activeVoxelCount()) << name;
    }
    EXPECT_GT(100'000U, std::filesystem::file_size(folder_ / "a.vdb"));
}

TEST_F(Vdb, CountsBeyond31BitsTake64) {
    const volume v = with_all_types(0x80000000U);
    write(v, folder_ / "a.vdb");
    expect_values<openvdb::Int64Grid>(read(folder_ / "a.vdb"), "count", v, [&](std::size_t i) {
        return static_cast<std::int64_t>(value_at<std::uint32_t>(v, "count", i));
    });
}

TEST_F(Vdb, TheSameVolumeIsTheSameBytes) {
    write(with_all_types(100), folder_ / "a.vdb");
    write(with_all_types(100), folder_ / "b.vdb");
    write(with_all_types(101), folder_ / "c.vdb");
    EXPECT_TRUE(read_file(folder_ / "a.vdb") == read_file(folder_ / "b.vdb"));
    const auto id = [&](const char* name) {
        openvdb::io::File in((folder_ / name).string());
        in.open(false);
        return in.getUniqueTag();
    };
    EXPECT_EQ(id("a.vdb"), id("b.vdb"));
    EXPECT_NE(id("a.vdb"), id("c.vdb")); // by which OpenVDB tells files apart
    EXPECT_EQ(36U, id("a.vdb").size());
}

// A ball of distances: what OpenVDB's own tools expect of a level set, and its values at every voxel.
TEST_F(Vdb, DistancesAreALevelSet) {
    constexpr std::int64_t n = 72;
    constexpr float band = 1.5F;
    volume v = make_volume({n, n, n});
    v.voxel_size = {0.5, 0.5, 0.5};
    v.distances = distance_field{band, true};
    v.add("distance", scalar::f32);
    v.add("nearest", scalar::i64);
    const auto expected = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
        const double a = static_cast<double>(x) - 35.5, b = static_cast<double>(y) - 35.5,
                     c = static_cast<double>(z) - 35.5;
        return std::clamp(static_cast<float>(0.5 * std::sqrt(a * a + b * b + c * c) - 14), -band, band);
    };
    for (std::int64_t z = 0; z < n; ++z)
        for (std::int64_t y = 0; y < n; ++y)
            for (std::int64_t x = 0; x < n; ++x) {
                store(v.channels[0].data.data() + 4 * v.index(x, y, z), expected(x, y, z));
                store(v.channels[1].data.data() + 8 * v.index(x, y, z), v.index(x, y, z));
            }
    write(v, folder_ / "ball.vdb");
    const grids found = read(folder_ / "ball.vdb");
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(found.at("distance"));
    ASSERT_TRUE(grid != nullptr);
    EXPECT_EQ(openvdb::GRID_LEVEL_SET, grid->getGridClass());
    EXPECT_EQ(band, grid->background());
    EXPECT_EQ("", openvdb::tools::checkLevelSet(*grid, 6)); // class, cubes, background, active values within the band
    const auto values = grid->getConstAccessor();
    std::uint64_t active = 0;
    for (std::int64_t z = 0; z < n; ++z)
        for (std::int64_t y = 0; y < n; ++y)
            for (std::int64_t x = 0; x < n; ++x) {
                const openvdb::Coord at(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
                ASSERT_EQ(expected(x, y, z), values.getValue(at)) << at;
                const bool is_active = std::abs(expected(x, y, z)) < band;
                ASSERT_EQ(is_active, values.isValueOn(at)) << at;
                active += is_active ? 1 : 0;
            }
    EXPECT_EQ(active, grid->activeVoxelCount());
    EXPECT_EQ(band, values.getValue(openvdb::Coord(-1, 200, 3)));
    const auto numbers = openvdb::gridPtrCast<openvdb::Int64Grid>(found.at("nearest"));
    ASSERT_TRUE(numbers != nullptr);
    EXPECT_EQ(-1, numbers->background());
    EXPECT_EQ(active, numbers->activeVoxelCount());
}

} // namespace
