// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "backend_calls.hpp"

using namespace voxelpipe;
using namespace voxelpipe::capi;

extern "C" vp_code vp_surface(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                              const vp_surface_options* options, const vp_array* out, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const voxelize_options o = surface_options_of(options);
        check_counters(counters);
        finish(draw_bits_into(out, g, c.threads,
                              [&](std::uint32_t* words) { return c.on.surfaces->surface(m, g, o.rule, words); }),
               counters);
    });
}
