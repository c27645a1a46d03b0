// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "golden.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace golden {

std::vector<golden_case>& registry() {
    static std::vector<golden_case> cases;
    return cases;
}

// How GoogleTest shows a case.
void PrintTo(const golden_case& c, std::ostream* out) { *out << c.name; }

namespace {

constexpr const char* golden_file = VOXELPIPE_GOLDEN_FILE;

std::string hex(std::uint64_t value) {
    char text[17];
    std::snprintf(text, sizeof text, "%016" PRIx64, value);
    return text;
}

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
    return hex(d.value());
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
    EXPECT_EQ(hex(digest{}.value()), "cbf29ce484222325");
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
