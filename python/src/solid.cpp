// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "sparse.hpp"

#include <bindings/bits.hpp>
#include <bindings/parts.hpp>
#include <voxelpipe/solid/diagnose_repair.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <nanobind/stl/optional.h>

#include <optional>

namespace voxelpipe::python {
namespace {

using bits = target<bit, blend::bit_or>;
using shader = decltype(constant(true));
using solid_draw = draw<mesh_view<>, passthrough, shader>;

// Part i of the triangles begins with number first_triangles[i]. Either of the results may be none.
nb::dict solid_dense(const position_array& positions, const triangle_array& triangles,
                     const std::vector<std::uint64_t>& first_triangles, const grid& g, const std::string& fill,
                     const std::string& extent, const std::string& repair_name, const std::string& bodies_name,
                     std::optional<std::uint64_t> max_hole_edges, int closing,
                     const std::optional<array<std::uint8_t, 3>>& mask,
                     const std::optional<array<std::uint32_t, 3>>& words, unsigned threads) {
    const auto nx = static_cast<std::size_t>(g.extent.x);
    if (mask) expect_shape(*mask, g, "the result");
    if (words) expect_shape(*words, g, "the result", {}, (nx + 31) / 32);
    const solid_options options = solid_options_named(fill, extent, repair_name, bodies_name, max_hole_edges, closing);
    const auto draws = draws_of_parts<solid_draw>(view_of(positions, triangles), first_triangles, constant(true));
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        std::vector<std::uint32_t> own;
        if (!words)
            own.resize((nx + 31) / 32 * static_cast<std::size_t>(g.extent.y) * static_cast<std::size_t>(g.extent.z));
        std::uint32_t* const drawn = words ? words->data() : own.data();
        s = voxelize_solid(backend, draws, g, framebuffer_view<bits>::on(g.extent, drawn), options);
        if (mask && s.ok()) expand(drawn, mask->data(), g.extent, threads);
    }
    return report_solid(s);
}

// (voxels (n, 3), tiles (m, 4), counters). A tile is a cube of voxels: its first one, and its side. Voxels of tiles are
// listed, too, unless they are asked for as tiles.
nb::tuple solid_list(const position_array& positions, const triangle_array& triangles,
                     const std::vector<std::uint64_t>& first_triangles, const grid& g, const std::string& fill,
                     const std::string& extent, const std::string& repair_name, const std::string& bodies_name,
                     std::optional<std::uint64_t> max_hole_edges, int closing, bool as_tiles, unsigned threads) {
    const solid_options options = solid_options_named(fill, extent, repair_name, bodies_name, max_hole_edges, closing);
    const auto draws = draws_of_parts<solid_draw>(view_of(positions, triangles), first_triangles, constant(true));
    status s;
    std::vector<std::int32_t> voxels, tiles;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        sparse_framebuffer<cpu_backend, bits> fb{backend, g.extent};
        s = voxelize_solid(backend, draws, g, fb, options);
        if (s.ok()) {
            const brick_table table = fb.view().table;
            if (as_tiles) tiles = cubes_of(table);
            voxels = coordinates_of(table, !as_tiles);
        }
    }
    nb::dict counts = report_solid(s);
    const std::size_t n = voxels.size() / 3, m = tiles.size() / 4;
    return nb::make_tuple(to_numpy(std::move(voxels), {n, 3}), to_numpy(std::move(tiles), {m, 4}), counts);
}

// What the flood of repair "exterior" does, whether or not the solid was drawn so.
nb::dict diagnose_repair_of(const position_array& positions, const triangle_array& triangles,
                            const std::vector<std::uint64_t>& first_triangles, const grid& g,
                            const std::string& bodies_name, int closing, unsigned threads) {
    const solid_options options =
        solid_options_named("nonzero", "outer", "exterior", bodies_name, std::nullopt, closing);
    const auto draws = draws_of_parts<solid_draw>(view_of(positions, triangles), first_triangles, constant(true));
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
    m.def("solid_dense", &solid_dense, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("fill"), nb::arg("extent"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("closing"), nb::arg("mask").none(), nb::arg("words").none(),
          nb::arg("threads"));
    m.def("solid_list", &solid_list, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("fill"), nb::arg("extent"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("closing"), nb::arg("as_tiles"), nb::arg("threads"));
    m.def("diagnose_repair", &diagnose_repair_of, nb::arg("positions"), nb::arg("triangles"),
          nb::arg("first_triangles"), nb::arg("grid"), nb::arg("bodies"), nb::arg("closing"), nb::arg("threads"));
}

} // namespace voxelpipe::python
