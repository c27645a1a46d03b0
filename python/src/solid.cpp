// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "parts.hpp"

#include <voxelpipe/solid/diagnose_repair.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <optional>

#include <nanobind/stl/optional.h>

namespace voxelpipe::python {
namespace {

using mask = target<std::uint8_t, blend::replace>;

// Part i of the triangles begins with number first_triangles[i].
nb::dict solid_mask(const position_array& positions, const triangle_array& triangles,
                    const std::vector<std::uint64_t>& first_triangles, const grid& g, const std::string& fill,
                    const std::string& extent, const std::string& repair_name, const std::string& bodies_name,
                    std::optional<std::uint64_t> max_hole_edges, int closing, const array<std::uint8_t, 3>& out,
                    unsigned threads) {
    expect_shape(out, g);
    const solid_options options = solid_options_named(fill, extent, repair_name, bodies_name, max_hole_edges, closing);
    using shader = decltype(constant(std::uint8_t{1}));
    const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, shader>>(
        view_of(positions, triangles), first_triangles, constant(std::uint8_t{1}));
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        s = voxelize_solid(backend, draws, g, framebuffer_view<mask>::on(g.extent, out.data()), options);
    }
    return report_solid(s);
}

// What the flood of repair "exterior" does, whether or not the solid was drawn so.
nb::dict diagnose_repair_of(const position_array& positions, const triangle_array& triangles,
                            const std::vector<std::uint64_t>& first_triangles, const grid& g,
                            const std::string& bodies_name, int closing, unsigned threads) {
    const solid_options options =
        solid_options_named("nonzero", "outer", "exterior", bodies_name, std::nullopt, closing);
    using shader = decltype(constant(true));
    const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, shader>>(view_of(positions, triangles),
                                                                              first_triangles, constant(true));
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        s = diagnose_repair(backend, draws, g, options);
    }
    return report_flood(s);
}

} // namespace

void bind_solid(nb::module_& m) {
    m.def("solid_mask", &solid_mask, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("fill"), nb::arg("extent"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("closing"), nb::arg("out"), nb::arg("threads"));
    m.def("diagnose_repair", &diagnose_repair_of, nb::arg("positions"), nb::arg("triangles"),
          nb::arg("first_triangles"), nb::arg("grid"), nb::arg("bodies"), nb::arg("closing"), nb::arg("threads"));
}

} // namespace voxelpipe::python
