// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cells of half, float and double.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

template <class T>
void compare_float() {
    compare_cells<vp::target<T, blend::replace>, vp::target<T, blend::add>, vp::target<T, blend::min>,
                  vp::target<T, blend::max>>();
}

TEST(Cells, OfHalfAreTheCpus) { compare_float<vp::half>(); }
TEST(Cells, OfFloatAreTheCpus) { compare_float<float>(); }
TEST(Cells, OfDoubleAreTheCpus) { compare_float<double>(); }
TEST(Cells, OfFloatWithOtherQuantaAreTheCpus) {
    compare_cells<vp::target<float, blend::add_quantum<-20>>, vp::target<float, blend::add_quantum<0>>,
                  vp::target<vp::bit, blend::bit_or>>();
}
TEST(Cells, OfOneBitAreTheCpus) { compare_cells<vp::target<vp::bit, blend::bit_or>>(); }

} // namespace
