// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cells of 8- and 16-bit integers and of bits.

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

TEST(Cells, OfUnsigned8AreTheCpus) { compare_integer<std::uint8_t>(); }
TEST(Cells, OfUnsigned16AreTheCpus) { compare_integer<std::uint16_t>(); }
TEST(Cells, OfSigned16AreTheCpus) { compare_integer<std::int16_t>(); }
TEST(Cells, OfBitsAreTheCpus) { compare_integer<vp::bit>(); }

} // namespace
