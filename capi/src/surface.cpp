// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <cpu_ref/backend.hpp>

using namespace voxelpipe;
using namespace voxelpipe::capi;

extern "C" vp_code vp_surface(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                              const vp_surface_options* options, const vp_array* out, vp_counters* counters) {
    using bits = target<bit, blend::bit_or>;
    return guarded([&] {
        const unsigned threads = checked_handle(context, "context").threads;
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const voxelize_options o = surface_options_of(options);
        check_counters(counters);
        finish(draw_bits_into(out, g, threads,
                              [&](std::uint32_t* words) {
                                  cpu_backend backend{threads};
                                  return voxelize(backend, m.view(), g, passthrough{}, constant(true),
                                                  framebuffer_view<bits>::on(g.extent, words), o);
                              }),
               counters);
    });
}
