// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "test_volumes.hpp"

using namespace voxelize;
using namespace voxelize::testing;

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
