// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cells of 32- and 64-bit integers, and counts of every width.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

template <class T>
void compare_integer() {
    compare_cells<vp::target<T, blend::replace>, vp::target<T, blend::add>, vp::target<T, blend::add_saturate>,
                  vp::target<T, blend::min>, vp::target<T, blend::max>, vp::target<T, blend::bit_and>,
                  vp::target<T, blend::bit_or>, vp::target<T, blend::bit_xor>>();
}

TEST(Cells, OfUnsigned32AreTheCpus) { compare_integer<std::uint32_t>(); }
TEST(Cells, OfUnsigned64AreTheCpus) { compare_integer<std::uint64_t>(); }
TEST(Cells, OfSigned32AreTheCpus) { compare_integer<std::int32_t>(); }
TEST(Cells, OfSigned64AreTheCpus) { compare_integer<std::int64_t>(); }
TEST(Cells, OfCountsAreTheCpus) {
    compare_cells<vp::target<std::uint8_t, blend::count>, vp::target<std::uint16_t, blend::count>,
                  vp::target<std::uint32_t, blend::count>, vp::target<std::uint64_t, blend::count>,
                  vp::target<std::int32_t, blend::count>, vp::target<std::int64_t, blend::count>,
                  vp::target<vp::bit, blend::count>>();
}

} // namespace
