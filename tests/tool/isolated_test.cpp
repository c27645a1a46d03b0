// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Work in a process of its own: what it gives comes back, and whatever becomes of it is a model_error.
#include "gltf_builder.hpp"

#include <model/model_error.hpp>
#include <read/isolated.hpp>

#include <gtest/gtest.h>

#include <csignal>
#include <new>
#include <stdexcept>

namespace {

using work = std::function<std::vector<std::byte>()>;

std::string error_of(const work& what, const voxelize::isolation_limits& limits = {}) {
    try {
        (void)voxelize::run_isolated(what, limits, "it");
    } catch (const voxelize::model_error& error) {
        return error.what();
    }
    return "no error";
}

TEST(Isolated, BytesComeBack) {
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{65536}, std::size_t{5000000}}) {
        const std::vector<std::byte> bytes = voxelize::run_isolated(
            [size] {
                std::vector<std::byte> result(size);
                for (std::size_t i = 0; i < size; ++i) result[i] = static_cast<std::byte>(i * 7);
                return result;
            },
            {}, "it");
        ASSERT_EQ(size, bytes.size());
        for (std::size_t i = 0; i < size; i += 997) ASSERT_EQ(static_cast<std::byte>(i * 7), bytes[i]) << i;
    }
}

TEST(Isolated, NothingOfThisProcessChanges) {
    int value = 1;
    (void)voxelize::run_isolated(
        [&value]() -> std::vector<std::byte> {
            value = 2;
            return {};
        },
        {}, "it");
    EXPECT_EQ(1, value);
}

TEST(Isolated, ExceptionsComeBackAsOneLine) {
    EXPECT_EQ("it: line?two", error_of([]() -> std::vector<std::byte> { throw std::runtime_error("line\ntwo"); }));
    EXPECT_EQ("it: the file cannot be read", error_of([]() -> std::vector<std::byte> { throw 3; }));
    EXPECT_EQ("it needs more than the 1024 MiB of memory that a file of this size gets",
              error_of([]() -> std::vector<std::byte> { throw std::bad_alloc(); }));
}

TEST(Isolated, ACrashIsAnError) {
    const std::string what_to_do = ": convert it to another format, such as .glb or .obj, with a program that opens it";
    EXPECT_EQ("it broke down on this file (signal " + std::to_string(SIGTERM) + ")" + what_to_do,
              error_of([]() -> std::vector<std::byte> {
                  raise(SIGTERM);
                  return {};
              }));
    EXPECT_EQ("it broke down on this file" + what_to_do, error_of([]() -> std::vector<std::byte> { _exit(0); }));
}

TEST(Isolated, OneThatIsKilledEarlyDidNotTakeTooLong) {
    EXPECT_EQ("it was killed on this file, as the kernel does where memory runs out",
              error_of([]() -> std::vector<std::byte> {
                  raise(SIGKILL);
                  return {};
              }));
}

TEST(Isolated, EndlessWorkIsEnded) {
    voxelize::isolation_limits limits;
    limits.seconds = 1;
    const work endless = []() -> std::vector<std::byte> {
        const volatile bool again = true;
        while (again) {
        }
        return {};
    };
    EXPECT_EQ("it needs more than the 1 s that a file of this size gets", error_of(endless, limits));
}

TEST(Isolated, MemoryIsBounded) {
    if (gltf_test::is_slow_build()) GTEST_SKIP() << "sanitizers reserve address space of their own";
    voxelize::isolation_limits limits;
    limits.memory = std::uint64_t{64} << 20;
    const auto take = [](std::size_t mebibytes) {
        return [mebibytes]() -> std::vector<std::byte> {
            const std::vector<std::byte> block(mebibytes << 20);
            return {block.front()};
        };
    };
    EXPECT_EQ("no error", error_of(take(32), limits));
    EXPECT_EQ("it needs more than the 64 MiB of memory that a file of this size gets", error_of(take(128), limits));
}

TEST(Isolated, WhatComesBackIsBounded) {
    voxelize::isolation_limits limits;
    limits.result = 1 << 20;
    EXPECT_EQ("it: the model takes more than the 1 MiB that a file of this size gets",
              error_of([] { return std::vector<std::byte>(2 << 20); }, limits));
}

} // namespace
