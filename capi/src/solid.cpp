// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "backend_calls.hpp"

#include <memory>

using namespace voxelpipe;
using namespace voxelpipe::capi;

extern "C" {

vp_code vp_solid(vp_context* context, const vp_mesh* mesh, const vp_grid* grid, const vp_solid_options* options,
                 const vp_array* out, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const solid_options o = solid_options_of(options_of(options));
        check_counters(counters);
        finish(
            draw_bits_into(out, g, c.threads, [&](std::uint32_t* words) { return c.on.solids->solid(m, g, o, words); }),
            counters);
    });
}

vp_code vp_solid_list(vp_context* context, const vp_mesh* mesh, const vp_grid* grid, const vp_solid_options* options,
                      vp_list** list, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        check_pointer(list, "list");
        const voxelpipe::grid g = grid_of(grid);
        const solid_options o = solid_options_of(options_of(options));
        check_counters(counters);
        auto made = std::make_unique<vp_list>();
        finish(c.on.solids->list(m, g, o, *made), counters);
        *list = made.release();
    });
}

} // extern "C"
