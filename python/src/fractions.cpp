// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "parts.hpp"

#include <voxelpipe/cells/cells.hpp>

#include <cstdint>
#include <vector>

namespace voxelpipe::python {
namespace {

// Fractions of all triangles together, into an array of the grid's shape.
nb::dict fractions_of(const position_array& positions, const triangle_array& triangles, const grid& g,
                      const array<float, 3>& out, unsigned threads) {
    expect_shape(out, g, "the result");
    using cell_draw = draw<mesh_view<>, passthrough, fraction>;
    const auto draws =
        draws_of_parts<cell_draw>(view_of(positions, triangles), std::vector<std::uint64_t>{0}, fraction{});
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        s = voxelize_cells(backend, draws, g,
                           framebuffer_view<target<float, blend::replace>>::on(g.extent, out.data()));
    }
    nb::dict d = report(s);
    d["cut_voxels"] = s.cells.cut_voxels;
    d["below_zero"] = s.cells.below_zero;
    d["above_one"] = s.cells.above_one;
    d["open_rows"] = s.cells.open_rows;
    d["open_edges"] = s.cells.open_edges;
    return d;
}

} // namespace

void bind_fractions(nb::module_& m) {
    m.def("fractions", &fractions_of, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"), nb::arg("out"),
          nb::arg("threads"));
}

} // namespace voxelpipe::python
