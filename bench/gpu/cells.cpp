// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "cell_factories.hpp"

namespace bench::gpu {

std::unique_ptr<prepared_cell> prepare(session& s, const resident_mesh& mesh, const vp::grid& grid, gpu_cell cell) {
    const vp::coverage rule = is_thin(cell) ? vp::coverage::thin : vp::coverage::conservative;
    switch (cell) {
    case gpu_cell::bit_conservative:
    case gpu_cell::bit_thin:
        return make_bits(s, mesh, grid, rule);
    case gpu_cell::float_add_conservative:
        return make_float_add(s, mesh, grid, rule);
    case gpu_cell::float_add_unordered_conservative:
        return make_float_add_unordered(s, mesh, grid, rule);
    case gpu_cell::float_add_varying_conservative:
        return make_float_add_varying(s, mesh, grid, rule);
    case gpu_cell::abuffer_thin:
    case gpu_cell::abuffer_conservative:
        return make_abuffer(s, mesh, grid, rule);
    }
    throw std::invalid_argument("no such cell");
}

} // namespace bench::gpu
