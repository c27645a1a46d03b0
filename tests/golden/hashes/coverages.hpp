// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Occupancy: every coverage in grids of three sizes, of every mesh, and in a part of a grid.

#include "cases.hpp"

namespace golden {

template <class Backend>
void add_coverages(case_table<Backend>& cases) {
    struct sized {
        const char* name;
        vp::grid grid;
    };
    const std::array<sized, 4> grids{{{"16", grid_of({16, 16, 16})},
                                      {"45x33x52", odd_grid()},
                                      {"96x64x80", grid_of({96, 64, 80})},
                                      {"crop", crop_of_odd_grid()}}};
    for (const named_coverage& c : coverages)
        for (const named_mesh& m : hashed_meshes())
            for (const sized& g : grids)
                cases.push_back({std::string("coverage.") + c.name + '.' + m.name + '.' + g.name,
                                 [rule = c.rule, mesh = &m.data, grid = g.grid](Backend& backend, digest& d) {
                                     using bits = vp::target<vp::bit, vp::blend::bit_or>;
                                     vp::framebuffer<Backend, bits> fb{backend, grid.extent};
                                     const auto drawn = upload(backend, *mesh);
                                     add_counts(d, vp::voxelize(backend, drawn, grid, vp::passthrough{},
                                                                vp::constant(true), fb, rule));
                                     d.add(vp::get<0>(fb).to_host(backend));
                                 }});
}

} // namespace golden
