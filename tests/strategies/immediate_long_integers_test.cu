// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// All order-free blends of 64-bit integers without tiles, against cpu_backend byte for byte.

#include "immediate_cases.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace {

using namespace device_test;

TEST(Immediate, Unsigned64IsTheCpus) { compare_integers<std::uint64_t>(0x923456789abcdef1u); }
TEST(Immediate, Signed64IsTheCpus) { compare_integers<std::int64_t>(-765432123456789); }

} // namespace
