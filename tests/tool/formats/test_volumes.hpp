// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Volumes with known values for the tests of the writers, and small helpers to read files back as bytes.
// The value of channel c at voxel (i,j,k), component m is a function of pattern(i,j,k,c,m) alone; read_back.py has the
// same function, so that a reader in Python is compared with values that no file carried over.

#include "model/volume.hpp"
#include "write/formats/output_file.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <iterator>
#include <string>
#include <vector>

namespace voxelize::testing {

// 32 well-mixed bits.
inline std::uint32_t pattern(std::int64_t i, std::int64_t j, std::int64_t k, std::uint32_t c, std::uint32_t m) {
    std::uint32_t h = static_cast<std::uint32_t>(i) * 73856093u ^ static_cast<std::uint32_t>(j) * 19349663u ^
                      static_cast<std::uint32_t>(k) * 83492791u ^ (c * 4 + m + 1) * 2654435761u;
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    return h;
}

// binary16 of n / 4 for |n| < 2048 / 4: exact.
inline std::uint16_t half_of_quarters(int n) {
    if (n == 0) return 0;
    const float f = static_cast<float>(n) / 4;
    std::uint32_t bits;
    std::memcpy(&bits, &f, 4);
    return static_cast<std::uint16_t>((bits >> 16 & 0x8000u) | ((bits >> 23 & 0xffu) - 112) << 10 |
                                      (bits >> 13 & 0x3ffu));
}

template <class T>
void store(std::byte* at, T value) {
    std::memcpy(at, &value, sizeof(T));
}

// Writes the value that a pattern stands for; small fractions, so that every type holds it exactly.
inline void store_pattern(std::byte* at, scalar type, std::uint32_t h) {
    const auto n = static_cast<std::int64_t>(h);
    switch (type) {
    case scalar::bit:
        break;
    case scalar::u8:
        return store(at, static_cast<std::uint8_t>(h));
    case scalar::u16:
        return store(at, static_cast<std::uint16_t>(h));
    case scalar::u32:
        return store(at, h);
    case scalar::u64:
        return store(at, static_cast<std::uint64_t>(h) * 0x100000001u);
    case scalar::i32:
        return store(at, static_cast<std::int32_t>(h));
    case scalar::i64:
        return store(at, (n - 0x80000000ll) * 0x10001ll);
    case scalar::f16:
        return store(at, half_of_quarters(static_cast<int>(n % 801) - 400));
    case scalar::f32:
        return store(at, static_cast<float>(n % 20001 - 10000) / 8);
    case scalar::f64:
        return store(at, static_cast<double>(n % 2000001 - 1000000) / 1024);
    }
}

// Fills the channel from its own index in the volume; a bit is set for one in `density`.
inline void fill(volume& v, std::size_t which, std::uint32_t density = 5) {
    channel& c = v.channels[which];
    const auto id = static_cast<std::uint32_t>(which);
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i) {
                if (c.type == scalar::bit) {
                    if (pattern(i, j, k, id, 0) % density == 0) v.set_bit(c, i, j, k);
                    continue;
                }
                for (int m = 0; m < c.components; ++m)
                    store_pattern(c.data.data() + (v.index(i, j, k) * c.components + m) *
                                                      static_cast<std::int64_t>(size_of(c.type)),
                                  c.type, pattern(i, j, k, id, static_cast<std::uint32_t>(m)));
            }
}

inline volume make_volume(std::array<std::int64_t, 3> extent) {
    volume v;
    v.extent = extent;
    v.origin = {-1.5, 0.25, 10};
    v.voxel_size = {0.125, 0.125, 0.125};
    return v;
}

// Occupancy alone, or with a colour for every voxel.
inline volume make_occupancy(std::array<std::int64_t, 3> extent, std::uint32_t density = 5) {
    volume v = make_volume(extent);
    v.add("occupancy", scalar::bit);
    fill(v, 0, density);
    return v;
}
inline volume make_colored(std::array<std::int64_t, 3> extent, std::uint32_t density = 5) {
    volume v = make_occupancy(extent, density);
    v.add("color", scalar::u8, 4);
    fill(v, 1);
    return v;
}

inline std::string read_file(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    EXPECT_TRUE(in) << path;
    return {std::istreambuf_iterator<char>(in), {}};
}

template <class T>
T read_value(const std::string& bytes, std::size_t at) {
    T value{};
    EXPECT_LE(at + sizeof(T), bytes.size());
    if (at + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

// Calls f in a process none of whose files may have more bytes: what a disk without room says comes from write() too.
inline void expect_full_disk(std::uint64_t bytes, const std::function<void()>& f) {
    const pid_t child = fork();
    if (child == 0) {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit bound{bytes, bytes};
        setrlimit(RLIMIT_FSIZE, &bound);
        int code = 1;
        try {
            f();
        } catch (const write_error& e) {
            code = std::string(e.what()).find("File too large") != std::string::npos ? 0 : 2;
        } catch (...) {
            code = 3;
        }
        _exit(code);
    }
    int status = -1;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

// An empty folder of its own for each test, removed at the end.
class in_folder : public ::testing::Test {
protected:
    void SetUp() override {
        const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
        folder_ = std::filesystem::path(::testing::TempDir()) /
                  ("voxelize_" + std::string(info->test_suite_name()) + "_" + info->name());
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    [[nodiscard]] std::vector<std::string> names() const {
        std::vector<std::string> out;
        for (const auto& entry : std::filesystem::directory_iterator(folder_))
            out.push_back(entry.path().filename().string());
        std::sort(out.begin(), out.end());
        return out;
    }

    std::filesystem::path folder_;
};

} // namespace voxelize::testing
