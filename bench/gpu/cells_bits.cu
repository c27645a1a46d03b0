// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_factories.hpp"
#include "framebuffer_cell.cuh"

namespace bench::gpu {

cell_pointer make_bits(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                       bool count_voxels) {
    using cell = framebuffer_cell<vp::target<vp::bit, vp::blend::bit_or>, vp::passthrough, vp::constant_output<bool>>;
    return std::make_unique<cell>(s, mesh, grid, rule, vp::constant(true), baseline_output::bits, count_voxels);
}

} // namespace bench::gpu
