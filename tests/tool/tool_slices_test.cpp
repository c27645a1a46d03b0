// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Pictures of layers: `-o slices/{z}.png`.
#include "fraction_support.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

using namespace tool_test;
using namespace fraction_test;

namespace {

// Bytes of a PNG file from its header on: width, height, bits, colours.
std::array<std::uint32_t, 4> picture_header(const std::filesystem::path& file) {
    const auto bytes = read_file(file);
    const auto at = [&](std::size_t n) { return static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[n])); };
    const auto word = [&](std::size_t n) { return at(n) << 24U | at(n + 1) << 16U | at(n + 2) << 8U | at(n + 3); };
    if (bytes.size() < 33) return {};
    return {word(16), word(20), at(24), at(25)};
}

TEST(Slices, AreAPictureOfEachLayer) {
    const scratch_folder folder;
    builder file;
    add(file, box({-3, -3, -3.9F}, {3, 2.9F, 3}));
    std::filesystem::create_directories(folder / "s");
    const outcome drawn = draw(folder, file, "s/a{z}.png", {"-t", "fraction"});
    ASSERT_EQ(0, drawn.code) << drawn.err;
    EXPECT_EQ(16, std::distance(std::filesystem::directory_iterator(folder / "s"), {}));
    for (const char* const name : {"s/a0000.png", "s/a0015.png"})
        EXPECT_EQ((std::array<std::uint32_t, 4>{16, 16, 16, 0}), picture_header(folder / name)) << name;
    EXPECT_EQ(0, draw(folder, file, "s/a{z}.png", {"-t", "fraction", "--slice-bits", "8"}).code);
    EXPECT_EQ((std::array<std::uint32_t, 4>{16, 16, 8, 0}), picture_header(folder / "s/a0003.png"));
    // Of solids, dense and sparse, the same.
    EXPECT_EQ(0, draw(folder, file, "s/d{z}.png", {"--solid", "nonzero", "--dense"}).code);
    EXPECT_EQ(0, draw(folder, file, "s/e{z}.png", {"--solid", "nonzero", "--sparse"}).code);
    EXPECT_EQ((std::array<std::uint32_t, 4>{16, 16, 8, 0}), picture_header(folder / "s/d0003.png"));
    for (const char* const layer : {"0000", "0007", "0015"})
        EXPECT_TRUE(read_file(folder / ("s/d" + std::string(layer) + ".png")) ==
                    read_file(folder / ("s/e" + std::string(layer) + ".png")))
            << layer;
}

TEST(Slices, HoldOneTargetAndAreNoOtherFormat) {
    const scratch_folder folder;
    builder file;
    add(file, box({-3, -3, -3}, {3, 3, 3}));
    const auto refused = [&](const std::string& output, const std::vector<std::string>& arguments, const char* why) {
        const outcome drawn = draw(folder, file, output, arguments);
        EXPECT_EQ(1, drawn.code) << output;
        EXPECT_NE(std::string::npos, drawn.err.find(why)) << drawn.err;
    };
    refused("{z}.png", {"-t", "fraction,occupancy"}, "slices hold one target");
    refused("{z}.png", {"-t", "color"}, "slices hold one target");
    refused("{z}.png", {"--distance"}, "slices hold one target");
    refused("{z}.npy", {"-t", "fraction"}, "only .png is a file for each layer");
    refused("a.npy", {"-t", "fraction", "--slice-bits", "8"}, "{z}.png has");
    refused("{z}.png", {"-t", "fraction", "--slice-bits", "12"}, "--slice-bits: 8 or 16, not \"12\"");
    // Nor do they replace what the run reads, or another output.
    std::filesystem::create_directories(folder / "m");
    std::filesystem::create_symlink(folder / "m.glb", folder / "m/0003.png");
    refused("m/{z}.png", {"-t", "fraction"}, "is the model");
    std::filesystem::create_directories(folder / "n");
    refused("n/{z}.png", {"-t", "occupancy", "-o", folder / "n/0015.png"}, "name another output");
}

} // namespace
