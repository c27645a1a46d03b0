// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Distance fields as .nvdb: every voxel as a reader of the nodes finds it, inside and outside of the band.

#include "test_volumes.hpp"

#include "write/formats/formats.hpp"
#include "write/level_set.hpp"

#include <voxelpipe/sparse/io/nanovdb_layout.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <utility>

using namespace voxelize;
using namespace voxelize::testing;
namespace nanovdb = voxelpipe::io::nanovdb;

namespace {

class LevelSet : public in_folder {};

// Distances from a ball in the middle, in a grid of N^3 voxels of 0.5.
volume ball(std::int64_t n, double radius, float band) {
    volume v;
    v.extent = {n, n, n};
    v.voxel_size = {0.5, 0.5, 0.5};
    v.distances = distance_field{band, true};
    channel& c = v.add("distance", scalar::f32);
    const double middle = static_cast<double>(n) / 2;
    for (std::int64_t z = 0; z < n; ++z)
        for (std::int64_t y = 0; y < n; ++y)
            for (std::int64_t x = 0; x < n; ++x) {
                const double a = static_cast<double>(x) + 0.5 - middle, b = static_cast<double>(y) + 0.5 - middle,
                             d = static_cast<double>(z) + 0.5 - middle;
                const double away = 0.5 * std::sqrt(a * a + b * b + d * d) - radius;
                store(c.data.data() + 4 * v.index(x, y, z), std::clamp(static_cast<float>(away), -band, band));
            }
    return v;
}

struct found {
    float value;
    bool is_active;
};

// A grid of floats, as readers walk it from the root down.
class reader {
public:
    explicit reader(const std::filesystem::path& file) : bytes_(read_file(file)) {
        nanovdb::file_entry entry{};
        std::memcpy(&entry, bytes_.data() + sizeof(nanovdb::file_header), sizeof(entry));
        grid_ = sizeof(nanovdb::file_header) + sizeof(entry) + entry.name_size;
        tree_ = at<nanovdb::tree_data>(grid_ + sizeof(nanovdb::grid_data));
    }
    [[nodiscard]] nanovdb::grid_data grid() const { return at<nanovdb::grid_data>(grid_); }
    [[nodiscard]] nanovdb::tree_data tree() const { return tree_; }
    [[nodiscard]] float background() const { return at<root>(root_at()).background; }
    [[nodiscard]] found operator()(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const auto r = at<root>(root_at());
        for (std::uint32_t t = 0; t < r.table_size; ++t) {
            const auto tile = at<root::tile>(root_at() + sizeof(root) + t * sizeof(root::tile));
            if (tile.key != (static_cast<std::uint64_t>(x >> 12) << 42 | static_cast<std::uint64_t>(y >> 12) << 21 |
                             static_cast<std::uint64_t>(z >> 12)))
                continue;
            if (tile.child == 0) return {tile.value, tile.state != 0};
            return in<5>(root_at() + static_cast<std::size_t>(tile.child), x, y, z);
        }
        return {r.background, false};
    }

private:
    using root = nanovdb::root_data<float>;
    [[nodiscard]] std::size_t root_at() const { return grid_ + sizeof(nanovdb::grid_data) + tree_.node_offset[3]; }
    template <class T>
    [[nodiscard]] T at(std::size_t offset) const {
        T value;
        std::memcpy(static_cast<void*>(&value), bytes_.data() + offset, sizeof(T));
        return value;
    }
    static std::string read_file(const std::filesystem::path& file) {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    template <int Log2>
    [[nodiscard]] found in(std::size_t node, std::int64_t x, std::int64_t y, std::int64_t z) const {
        using type = nanovdb::internal_node<float, Log2>;
        constexpr int below = Log2 == 5 ? 7 : 3;
        constexpr std::int64_t mask = (1 << Log2) - 1;
        const auto n = static_cast<std::size_t>(((x >> below & mask) << (2 * Log2)) | ((y >> below & mask) << Log2) |
                                                (z >> below & mask));
        const auto bit = [&](std::size_t masks) {
            return (at<std::uint64_t>(node + masks + 8 * (n / 64)) >> (n % 64) & 1) != 0;
        };
        const std::size_t entry = node + offsetof(type, table) + 8 * n;
        if (!bit(offsetof(type, child_mask))) return {at<float>(entry), bit(offsetof(type, value_mask))};
        const std::size_t child = node + static_cast<std::size_t>(at<std::int64_t>(entry));
        if constexpr (Log2 == 5) {
            return in<4>(child, x, y, z);
        } else {
            const auto leaf = at<nanovdb::leaf_node<float>>(child);
            const auto place = static_cast<std::size_t>(((x & 7) * 8 + (y & 7)) * 8 + (z & 7));
            return {leaf.values[place], (leaf.head.mask[place / 64] >> (place % 64) & 1) != 0};
        }
    }

    std::string bytes_;
    std::size_t grid_ = 0;
    nanovdb::tree_data tree_{};
};

TEST_F(LevelSet, EveryVoxelReadsAsItIsAndTheBandIsActive) {
    const float band = 1.5F;
    const volume v = ball(72, 14, band);
    write(v, folder_ / "ball.nvdb");
    const reader grid(folder_ / "ball.nvdb");
    EXPECT_EQ(nanovdb::grid_class::level_set, grid.grid().meaning);
    EXPECT_EQ(band, grid.background());
    std::uint64_t active = 0, tiles = 0;
    for (std::int64_t z = 0; z < 72; ++z)
        for (std::int64_t y = 0; y < 72; ++y)
            for (std::int64_t x = 0; x < 72; ++x) {
                float expected = 0;
                std::memcpy(&expected, v.channels[0].data.data() + 4 * v.index(x, y, z), 4);
                const found f = grid(x, y, z);
                ASSERT_EQ(expected, f.value) << x << ' ' << y << ' ' << z;
                ASSERT_EQ(std::abs(expected) < band, f.is_active) << x << ' ' << y << ' ' << z;
                active += f.is_active ? 1 : 0;
                tiles += expected == -band ? 1 : 0;
            }
    EXPECT_EQ(active, grid.tree().num_voxels);
    EXPECT_GT(tiles, 20000U);
    const found outside = grid(-1, 500, 3);
    EXPECT_EQ(band, outside.value);
    EXPECT_FALSE(outside.is_active);
    // No leaf for what lies beyond the band: these are fewer than a third of the bricks.
    EXPECT_LT(grid.tree().node_count[0], 9U * 9U * 9U / 2);
}

TEST_F(LevelSet, WholeFieldsAndLongVoxelsAreNone) {
    volume v = ball(16, 3, std::numeric_limits<float>::infinity());
    write(v, folder_ / "whole.nvdb");
    const reader whole(folder_ / "whole.nvdb");
    EXPECT_EQ(nanovdb::grid_class::unknown, whole.grid().meaning);
    EXPECT_EQ(16U * 16U * 16U, whole.tree().num_voxels);
    volume stretched = ball(16, 3, 1.0F);
    stretched.voxel_size[2] = 1;
    std::string warning;
    write_options options;
    options.warn = [&](const std::string& line) { warning = line; };
    write(stretched, folder_ / "long.nvdb", options);
    EXPECT_EQ(nanovdb::grid_class::unknown, reader(folder_ / "long.nvdb").grid().meaning);
    EXPECT_NE(std::string::npos, warning.find("cubic"));
}

TEST_F(LevelSet, SignsThatChangeBeyondTheBandAreKept) {
    volume v = ball(16, 3, 1.0F);
    for (std::int64_t i = 0; i < v.num_voxels(); ++i)
        store(v.channels[0].data.data() + 4 * i, i % 2 == 0 ? 1.0F : -1.0F);
    write(v, folder_ / "odd.nvdb");
    const reader grid(folder_ / "odd.nvdb");
    EXPECT_EQ(1.0F, grid(0, 0, 0).value);
    EXPECT_EQ(-1.0F, grid(1, 0, 0).value);
    EXPECT_FALSE(grid(1, 0, 0).is_active);
    EXPECT_EQ(0U, grid.tree().num_voxels);
}

// A field that is read eight layers at a time, with another channel before the distances.
TEST_F(LevelSet, FieldsThatAreReadPieceByPieceGiveTheSameFile) {
    for (const std::int64_t n : {40, 43}) {
        volume whole = ball(n, 9, 1.5F);
        channel numbers{"number", scalar::i64, 1, {}};
        numbers.data.resize(static_cast<std::size_t>(whole.num_voxels()) * 8);
        for (std::int64_t i = 0; i < whole.num_voxels(); ++i) store(numbers.data.data() + 8 * i, i);
        whole.channels.insert(whole.channels.begin(), numbers);
        volume pieces = whole;
        std::size_t most = 0;
        for (channel& c : pieces.channels) {
            const std::size_t size = size_of(c.type);
            c.read = [&most, size, data = std::move(c.data)](std::uint64_t first, std::span<std::byte> to) {
                most = std::max(most, to.size() / size);
                std::memcpy(to.data(), data.data() + first * size, to.size());
            };
            c.data = {};
        }
        write(whole, folder_ / "whole.nvdb");
        write(pieces, folder_ / "pieces.nvdb");
        EXPECT_TRUE(read_file(folder_ / "whole.nvdb") == read_file(folder_ / "pieces.nvdb"));
        EXPECT_EQ(static_cast<std::size_t>(8 * n * n), most) << "voxels at a time";
        EXPECT_EQ(find_band(whole, 2).is_cut, find_band(pieces, 2).is_cut);
    }
}

TEST_F(LevelSet, ABandThatTheGridCutsIsNoticed) {
    EXPECT_EQ("", cut_band_warning(find_band(ball(24, 3, 1.0F), 1)));
    EXPECT_NE("", cut_band_warning(find_band(ball(24, 5.5, 1.0F), 1)));
}

} // namespace
