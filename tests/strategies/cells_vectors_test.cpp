// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Cells of vectors, in every layout, and sets of targets that need several passes.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;

namespace {

using hvec2 = glm::vec<2, vp::half>;
using u8vec4 = glm::vec<4, std::uint8_t>;
using i16vec3 = glm::vec<3, std::int16_t>;
using u64vec2 = glm::vec<2, std::uint64_t>;
using vp::layout::planar;
using vp::layout::tiled;

TEST(Cells, OfVectorsAreTheCpus) {
    compare_cells<vp::target<glm::vec3, blend::add, planar>, vp::target<glm::vec3, blend::max>,
                  vp::target<u8vec4, blend::add_saturate, tiled>, vp::target<glm::dvec2, blend::add>,
                  vp::target<glm::vec4, blend::replace, planar>, vp::target<i16vec3, blend::min, tiled>,
                  vp::target<hvec2, blend::add>, vp::target<u64vec2, blend::bit_xor, planar>>();
}
TEST(Cells, OfTiledBitsAndWinnersAreTheCpus) {
    compare_cells<vp::target<vp::bit, blend::bit_or, tiled>, vp::target<vp::bit, blend::replace, tiled>,
                  vp::target<std::uint32_t, blend::replace, tiled>, vp::target<u64vec2, blend::count>>();
}
TEST(Cells, InSeveralPassesAreTheCpus) {
    compare_cells<vp::target<glm::dvec4, blend::add>, vp::target<glm::dvec4, blend::add, planar>,
                  vp::target<glm::dvec4, blend::add, tiled>, vp::target<glm::dvec4, blend::replace>>();
}

} // namespace
