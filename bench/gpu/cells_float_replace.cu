// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_factories.hpp"
#include "framebuffer_cell.cuh"

namespace bench::gpu {

cell_pointer make_float_replace(session& s, const resident_mesh& mesh, const vp::grid& grid, vp::coverage rule,
                                bool tracks) {
    using cell = framebuffer_cell<vp::target<float, vp::blend::replace>, vp::passthrough, vp::constant_output<float>>;
    return std::make_unique<cell>(s, mesh, grid, rule, vp::constant(0.5f), std::nullopt, false, tracks);
}

} // namespace bench::gpu
