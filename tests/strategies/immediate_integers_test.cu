// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// All order-free blends of 32-bit integers without tiles, against cpu_backend byte for byte.

#include "immediate_cases.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace {

using namespace device_test;

TEST(Immediate, Unsigned32IsTheCpus) { compare_integers<std::uint32_t>(0x9234567u); }
TEST(Immediate, Signed32IsTheCpus) { compare_integers<std::int32_t>(-7654321); }

} // namespace
