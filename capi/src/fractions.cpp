// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "backend_calls.hpp"

using namespace voxelpipe;
using namespace voxelpipe::capi;

extern "C" vp_code vp_fractions(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                                const vp_fraction_options* options, const vp_array* out, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const vp_fraction_options o = options_of(options);
        check_enum(o.axis, 2, "axis");
        check_counters(counters);
        const array_place to = place_of(out, "out", {VP_TYPE_FLOAT32}, g.extent);
        finish(draw_into<float>(to, c.threads, [&](float* f) { return c.on.fields->fractions(m, g, o.axis, f); }),
               counters);
    });
}
