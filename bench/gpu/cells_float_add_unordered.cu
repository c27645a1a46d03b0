// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_factories.hpp"
#include "framebuffer_cell.cuh"

namespace bench::gpu {

cell_pointer make_float_add_unordered(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule) {
    using cell =
        framebuffer_cell<vp::target<float, vp::blend::add_unordered>, vp::passthrough, vp::constant_output<float>>;
    return std::make_unique<cell>(s, mesh, grid, rule, vp::constant(1.0f), baseline_output::sums);
}

} // namespace bench::gpu
