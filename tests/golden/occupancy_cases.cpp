// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Coverage only: bits and counts.

#include "case_support.hpp"

namespace {

using namespace golden;

void occupancy(digest& digest, unsigned threads, const mesh_data& m, const vp::grid& grid, vp::coverage rule) {
    draw<vp::target<vp::bit, vp::blend::bit_or>>(digest, threads, vp::mesh_view<>{m.positions, m.triangles}, grid,
                                                 vp::passthrough{}, vp::constant(true), rule);
}

} // namespace

GOLDEN_CASE("small_soup.occupancy.conservative") {
    occupancy(digest, threads, small_soup(), unit_grid({96, 96, 96}), conservative);
}
GOLDEN_CASE("small_soup.occupancy.thin") { occupancy(digest, threads, small_soup(), unit_grid({96, 96, 96}), thin); }
GOLDEN_CASE("large_soup.occupancy.conservative") {
    occupancy(digest, threads, large_soup(), unit_grid({80, 64, 70}), conservative);
}
GOLDEN_CASE("large_soup.occupancy.thin") { occupancy(digest, threads, large_soup(), unit_grid({80, 64, 70}), thin); }
GOLDEN_CASE("box.occupancy.conservative") { occupancy(digest, threads, box(), odd_grid(), conservative); }
GOLDEN_CASE("box.occupancy.thin") { occupancy(digest, threads, box(), odd_grid(), thin); }
GOLDEN_CASE("odd_shapes.occupancy.conservative") {
    occupancy(digest, threads, odd_shapes(), unit_grid({16, 16, 16}), conservative);
}
GOLDEN_CASE("odd_shapes.occupancy.thin") { occupancy(digest, threads, odd_shapes(), unit_grid({16, 16, 16}), thin); }
