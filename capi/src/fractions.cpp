// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <voxelpipe/cells/cells.hpp>

#include <cpu_ref/backend.hpp>

using namespace voxelpipe;
using namespace voxelpipe::capi;

extern "C" vp_code vp_fractions(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                                const vp_fraction_options* options, const vp_array* out, vp_counters* counters) {
    return guarded([&] {
        const unsigned threads = checked_handle(context, "context").threads;
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const vp_fraction_options o = options_of(options);
        check_enum(o.axis, 2, "axis");
        check_counters(counters);
        const array_place to = place_of(out, "out", {VP_TYPE_FLOAT32}, g.extent);
        cell_options cells;
        cells.axis = o.axis;
        finish(draw_into<float>(to, threads,
                                [&](float* f) {
                                    cpu_backend backend{threads};
                                    return voxelize_cells(
                                        backend, m.view(), g, passthrough{}, fraction{},
                                        framebuffer_view<target<float, blend::replace>>::on(g.extent, f), cells);
                                }),
               counters);
    });
}
