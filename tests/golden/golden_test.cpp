// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "golden.hpp"
#include "hashes/inflate.hpp"

#include <glm/gtc/type_precision.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace golden {

std::vector<golden_case>& registry() {
    static std::vector<golden_case> cases;
    return cases;
}

// How GoogleTest shows a case.
void PrintTo(const golden_case& c, std::ostream* out) { *out << c.name; }

namespace {

constexpr const char* golden_file = VOXELPIPE_GOLDEN_FILE;

// name -> hash; lines that start with # are comments.
std::map<std::string, std::string> read_golden() {
    std::ifstream in(golden_file);
    std::map<std::string, std::string> hashes;
    for (std::string line; std::getline(in, line);) {
        if (line.empty() || line[0] == '#') continue;
        std::istringstream words(line);
        std::string name, hash;
        words >> name >> hash;
        hashes[name] = hash;
    }
    return hashes;
}

std::string hash_of(const golden_case& c, unsigned threads) {
    digest d;
    c.run(d, threads);
    return d.hex();
}

class GoldenHash : public ::testing::TestWithParam<golden_case> {};

TEST_P(GoldenHash, IsTheRecordedOneForAnyNumberOfThreads) {
    const auto hashes = read_golden();
    const auto expected = hashes.find(GetParam().name);
    ASSERT_NE(expected, hashes.end()) << "no hash for " << GetParam().name << " in " << golden_file;
    EXPECT_EQ(hash_of(GetParam(), 1), expected->second);
    EXPECT_EQ(hash_of(GetParam(), 3), expected->second) << "with three threads";
}

INSTANTIATE_TEST_SUITE_P(Cases, GoldenHash, ::testing::ValuesIn(registry()));

// A recorded hash whose case is gone would never be compared again.
TEST(GoldenFile, HasACaseForEveryHash) {
    for (const auto& recorded : read_golden())
        EXPECT_TRUE(std::any_of(registry().begin(), registry().end(),
                                [&](const golden_case& c) { return c.name == recorded.first; }))
            << recorded.first << " is recorded, but no case has that name";
}

TEST(GoldenFile, NamesEveryCaseOnce) {
    std::map<std::string, int> seen;
    for (const golden_case& c : registry()) EXPECT_EQ(++seen[c.name], 1) << c.name;
}

TEST(GoldenDigest, DependsOnEveryByteAndOnLengths) {
    digest one, two, three;
    one.add(std::vector<std::uint8_t>{1, 2});
    two.add(std::vector<std::uint8_t>{1, 3});
    three.add(std::vector<std::uint8_t>{1});
    three.add(std::vector<std::uint8_t>{2});
    EXPECT_NE(one.value(), two.value());
    EXPECT_NE(one.value(), three.value());
    EXPECT_EQ(digest{}.hex(), "cbf29ce484222325");
}

std::string from_hex(std::string_view digits) {
    std::string bytes;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
        bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
    return bytes;
}

// Streams of zlib: a block that is stored, one with the fixed codes, one with codes of its own.
TEST(GoldenInflate, ReadsEveryKindOfBlock) {
    EXPECT_EQ(inflater::inflate(from_hex("010600f9ff73746f726564")), "stored");
    std::string text;
    for (int i = 0; i < 12; ++i) text += "voxel " + std::to_string(i * i % 97) + " of " + std::to_string(i) + "; ";
    EXPECT_EQ(inflater::inflate(from_hex(
                  "2bcbaf48cd513050c84f5330b0562803f30c413c4318cf04c43382f12c413c63b84a3310d704c6353205714d615c63b0ac19"
                  "dc20b05e7318d70c6cb0058c6b01b6d512ae17ec06b8938cc08a0d818e0200")),
              text);
    text.clear();
    for (int i = 0; i < 200; ++i) text += static_cast<char>((i * i * i + i * 7) % 211 % 17 % 6 + 97);
    const std::string coded =
        from_hex("1d8ecb1500210c026b257cfa2f61c73df8343810e4f9ee5645b3adf0da8dab7284e2b493dc048de182da6b1ebfebb0e26138"
                 "5ddec98f5fa67366dce55fec39820114f748c0012b6d7b427ea8237aa114158c86c9258aa17fd53e3254fb3bc2f903");
    EXPECT_EQ(inflater::inflate(coded), text);
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}, coded.size() / 2, coded.size() - 2})
        EXPECT_THROW(inflater::inflate(std::string_view(coded).substr(0, n)), std::runtime_error) << n;
    EXPECT_THROW(inflater::inflate("\x07"), std::runtime_error) << "a block of a kind that there is not";
}

// The form of numbers that the hash takes is the same on every machine.
TEST(GoldenDigest, TakesNumbersFromTheLowestByteOn) {
    digest bytes, number, vector, floats;
    bytes.add(std::vector<std::uint8_t>{1, 2, 3, 4, 0, 0, 128, 63});
    number.add(std::uint64_t{0x3f80000004030201u});
    vector.add(std::vector<glm::u16vec4>{{0x0201u, 0x0403u, 0x0000u, 0x3f80u}});
    floats.add(std::vector<float>{voxelpipe::core::bit_cast<float>(0x04030201u), 1.0f});
    EXPECT_EQ(bytes.hex(), number.hex());
    EXPECT_EQ(bytes.hex(), vector.hex());
    EXPECT_EQ(bytes.hex(), floats.hex());
}

} // namespace

// Writes golden.txt from the current results. The hashes for 1 and for 3 threads must agree.
int update_golden() {
    std::ostringstream text;
    text << "# SPDX-FileCopyrightText: 2026 The VoxelPipe authors\n"
            "# SPDX-License-Identifier: Apache-2.0\n"
            "#\n"
            "# case, FNV-1a hash of its bytes; written by VOXELPIPE_UPDATE_GOLDEN=1 golden_test\n";
    std::vector<std::string> lines;
    for (const golden_case& c : registry()) {
        const std::string hash = hash_of(c, 1);
        if (hash_of(c, 3) != hash) {
            std::fprintf(stderr, "%s depends on the number of threads; nothing was written\n", c.name.c_str());
            return 1;
        }
        lines.push_back(c.name + " " + hash);
    }
    std::sort(lines.begin(), lines.end());
    for (const std::string& line : lines) text << line << '\n';
    std::ofstream out(golden_file);
    out << text.str();
    if (!out.flush()) {
        std::fprintf(stderr, "cannot write %s\n", golden_file);
        return 1;
    }
    std::printf("%zu hashes written to %s\n", lines.size(), golden_file);
    return 0;
}

} // namespace golden

int main(int argc, char** argv) {
    ::testing::InitGoogleTest(&argc, argv);
    if (std::getenv("VOXELPIPE_UPDATE_GOLDEN") != nullptr) return golden::update_golden();
    return RUN_ALL_TESTS();
}
