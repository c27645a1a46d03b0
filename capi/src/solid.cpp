// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <bindings/parts.hpp>
#include <bindings/sparse_values.hpp>

#include <cpu_ref/backend.hpp>

#include <memory>

using namespace voxelpipe;
using namespace voxelpipe::capi;

namespace {

using solid_bits = target<bit, blend::bit_or>;
using solid_draw = draw<mesh_view<>, passthrough, decltype(constant(true))>;

std::vector<solid_draw> solid_draws(const vp_mesh& m) {
    return bindings::draws_of_parts<solid_draw>(m.view(), m.parts, constant(true));
}

} // namespace

extern "C" {

vp_code vp_solid(vp_context* context, const vp_mesh* mesh, const vp_grid* grid, const vp_solid_options* options,
                 const vp_array* out, vp_counters* counters) {
    return guarded([&] {
        const unsigned threads = checked_handle(context, "context").threads;
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const solid_options o = solid_options_of(options_of(options));
        check_counters(counters);
        const auto draws = solid_draws(m);
        finish(draw_bits_into(out, g, threads,
                              [&](std::uint32_t* words) {
                                  cpu_backend backend{threads};
                                  return voxelize_solid(backend, draws, g,
                                                        framebuffer_view<solid_bits>::on(g.extent, words), o);
                              }),
               counters);
    });
}

vp_code vp_solid_list(vp_context* context, const vp_mesh* mesh, const vp_grid* grid, const vp_solid_options* options,
                      vp_list** list, vp_counters* counters) {
    return guarded([&] {
        const unsigned threads = checked_handle(context, "context").threads;
        const vp_mesh& m = checked_handle(mesh, "mesh");
        check_pointer(list, "list");
        const voxelpipe::grid g = grid_of(grid);
        const solid_options o = solid_options_of(options_of(options));
        check_counters(counters);
        cpu_backend backend{threads};
        sparse_framebuffer<cpu_backend, solid_bits> fb{backend, g.extent};
        const status s = voxelize_solid(backend, solid_draws(m), g, fb, o);
        auto made = std::make_unique<vp_list>();
        if (s.ok()) made->coordinates = bindings::coordinates_of(fb.view().table);
        finish(s, counters);
        *list = made.release();
    });
}

} // extern "C"
