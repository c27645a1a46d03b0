// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Compression in pieces on several threads, and the order that it keeps.

#include "../sanitized.hpp"
#include "model/parallel.hpp"
#include "test_volumes.hpp"
#include "write/formats/deflate.hpp"
#include "write/formats/formats.hpp"

#include <zlib.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <exception>
#include <fstream>
#include <stdexcept>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Deflate : public in_folder {};

std::string text_of(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string inflated(const std::string& packed, int window, std::size_t size) {
    z_stream z{};
    EXPECT_EQ(inflateInit2(&z, window), Z_OK);
    std::string out(size + 1, '?');
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    z.avail_in = static_cast<uInt>(packed.size());
    z.next_out = reinterpret_cast<Bytef*>(out.data());
    z.avail_out = static_cast<uInt>(out.size());
    EXPECT_EQ(inflate(&z, Z_FINISH), Z_STREAM_END);
    EXPECT_EQ(z.avail_in, 0u);
    const auto length = static_cast<std::size_t>(z.total_out);
    inflateEnd(&z);
    return out.substr(0, length);
}

} // namespace

TEST_F(Deflate, PiecesMakeOneStream) {
    volume v = make_volume({130, 70, 40});
    v.add("occupancy", scalar::bit);
    v.add("color", scalar::u8, 4);
    v.add("depth", scalar::f16, 3);
    for (std::size_t n = 0; n < 3; ++n) fill(v, n);
    std::fill_n(v.channels[1].data.begin(), 900000, std::byte{7}); // pieces of one value
    for (const channel& c : v.channels)
        for (const half_floats halves : {half_floats::keep, half_floats::widen}) {
            std::string expected = "head";
            stream_values(v, c, halves, [&](std::span<const std::byte> piece) { expected += text_of(piece); });
            std::string first;
            for (const int threads : {1, 4}) {
                piece_compressor compressor(piece_compressor::form::stream_part, 1);
                std::string packed;
                running_crc whole;
                compress_channel(v, c, halves, std::as_bytes(std::span{"head", 4}), 10007, threads, compressor,
                                 [&](const compressed_piece& piece) {
                                     packed += text_of(piece.bytes);
                                     whole.add(piece);
                                 });
                packed += text_of(deflate_end);
                EXPECT_TRUE(inflated(packed, -15, expected.size()) == expected) << c.name;
                EXPECT_EQ(whole.size, expected.size());
                EXPECT_EQ(whole.crc, crc32(0, reinterpret_cast<const Bytef*>(expected.data()),
                                           static_cast<uInt>(expected.size())));
                if (threads == 1) first = packed;
                EXPECT_TRUE(first == packed) << "threads change the bytes";
            }
        }
}

TEST_F(Deflate, RepeatedValuesAreCompressedOnce) {
    piece_compressor compressor(piece_compressor::form::zlib, 1);
    const std::vector<std::byte> zeros(100000), other(50000, std::byte{1});
    EXPECT_EQ(compressor.compress(zeros, 4), compressor.compress(zeros, 4));
    EXPECT_NE(compressor.compress(zeros, 4), compressor.compress(other, 4));
    EXPECT_EQ(inflated(text_of(compressor.compress(other, 4)->bytes), 15, 50000), text_of(other));
    std::vector<std::byte> mixed = zeros;
    mixed[99999] = std::byte{1};
    EXPECT_EQ(inflated(text_of(compressor.compress(mixed, 4)->bytes), 15, 100000), text_of(mixed));
}

// Any piece of any channel is that part of the whole stream.
TEST_F(Deflate, PiecesBeginAndEndAnywhere) {
    volume v = make_volume({37, 5, 3});
    v.add("occupancy", scalar::bit);
    v.add("half", scalar::f16, 3);
    v.add("double", scalar::f64, 1);
    for (std::size_t n = 0; n < 3; ++n) fill(v, n);
    for (const channel& c : v.channels) {
        std::string all;
        stream_values(v, c, half_floats::widen, [&](std::span<const std::byte> piece) { all += text_of(piece); });
        ASSERT_EQ(all.size(), streamed_bytes(v, c, half_floats::widen));
        std::vector<std::byte> room;
        for (std::size_t begin = 0; begin < all.size(); begin += 13)
            for (const std::size_t size : {std::size_t{1}, std::size_t{40}, all.size() - begin})
                if (begin + size <= all.size()) {
                    ASSERT_EQ(text_of(streamed_piece(v, c, half_floats::widen, begin, size, room)),
                              all.substr(begin, size))
                        << c.name << ' ' << begin << ' ' << size;
                }
    }
}

TEST(OrderedFor, UsesResultsInOrderOnTheCallingThread) {
    for (const int threads : {1, 2, 7})
        for (const std::size_t count : {0u, 1u, 5u, 1000u}) {
            const auto caller = std::this_thread::get_id();
            std::size_t next = 0;
            std::atomic<std::size_t> made{0};
            ordered_for(
                count, threads,
                [&](std::size_t n) {
                    ++made;
                    return 3 * n;
                },
                [&](std::size_t n, std::size_t result) {
                    EXPECT_EQ(next++, n);
                    EXPECT_EQ(3 * n, result);
                    EXPECT_EQ(caller, std::this_thread::get_id());
                    EXPECT_LE(made, n + 1 + 5 * static_cast<std::size_t>(threads)); // not far ahead
                });
            EXPECT_EQ(next, count);
        }
}

// The machine grants some threads or none: address space runs out, of which each stack takes some megabytes.
TEST(OrderedFor, DoesWithoutThreads) {
    if (tool_test::sanitized) GTEST_SKIP() << "a sanitizer needs all address space";
    for (const std::uint64_t room : {2u << 20, 12u << 20, 30u << 20}) {
        const pid_t child = fork();
        if (child == 0) {
            alarm(30); // which ends a process that waits for ever
            std::ifstream statm("/proc/self/statm");
            std::uint64_t pages = 0;
            statm >> pages;
            const rlim_t most = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) + room;
            const rlimit bound{most, most};
            setrlimit(RLIMIT_AS, &bound);
            std::size_t next = 0;
            try {
                ordered_for(
                    500, 64, [](std::size_t n) { return n; },
                    [&](std::size_t n, std::size_t result) { next += n == next && result == n ? 1 : 0; });
            } catch (const std::exception&) {
                _exit(2);
            }
            _exit(next == 500 ? 0 : 1);
        }
        int status = -1;
        waitpid(child, &status, 0);
        EXPECT_EQ(status, 0) << room;
    }
}

TEST(OrderedFor, ThrowsWhatEitherThrows) {
    for (const int threads : {1, 4}) {
        const auto make = [](std::size_t n) {
            if (n == 50) throw std::runtime_error("make");
            return n;
        };
        std::size_t used = 0;
        EXPECT_THROW(ordered_for(100, threads, make, [&](std::size_t, std::size_t) { ++used; }), std::runtime_error);
        EXPECT_LE(used, 50u);
        EXPECT_THROW(ordered_for(40, threads, make,
                                 [](std::size_t n, std::size_t) {
                                     if (n == 10) throw std::logic_error("use");
                                 }),
                     std::logic_error);
    }
}
