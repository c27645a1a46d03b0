// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Targets that together take 75 to 95 KB of shared memory for the smallest tile, one that is in reach of some
// architectures: they are drawn in two passes over the same tiles, the first of them with more than 48 KB.

#include "cells.hpp"

using namespace device_test;
namespace blend = voxelpipe::blend;
namespace device = voxelpipe::device;

namespace {

template <class... Targets>
constexpr int tile_bytes = 512 / 8 *
                           (1 + (device::bits_per_voxel<Targets>() + ...)); // one bit a voxel is shared by all targets

template <class... Targets>
void compare_two_passes() {
    static_assert(tile_bytes<Targets...> > 75 * 1024 && tile_bytes<Targets...> <= 95 * 1024);
    using groups = device::target_groups<vp::framebuffer_view<Targets...>>;
    static_assert(groups::num_groups() == 2);
    static_assert(groups::max_bits() * 512 / 8 > 48 * 1024);
    compare_cells<Targets...>();
}

TEST(Cells, InTwoPassesOf76KilobytesAreTheCpus) {
    compare_two_passes<vp::target<glm::dvec4, blend::add>, vp::target<glm::vec4, blend::add>,
                       vp::target<glm::vec2, blend::add, vp::layout::planar>>();
}
TEST(Cells, InTwoPassesOf92KilobytesAreTheCpus) {
    compare_two_passes<vp::target<glm::dvec4, blend::add, vp::layout::tiled>, vp::target<glm::vec4, blend::add>,
                       vp::target<glm::dvec2, blend::max>, vp::target<glm::dvec2, blend::add>>();
}

} // namespace
