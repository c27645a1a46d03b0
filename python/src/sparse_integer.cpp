// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse.hpp"

namespace voxelpipe::python {
namespace {

// Values of one column of 64-bit integers, one for each voxel.
nb::tuple bake_integers(const position_array& positions, const triangle_array& triangles, const grid& g,
                        const std::string& rule, const array<const std::int64_t, 2>& values, std::size_t column,
                        bool per_triangle, const std::string& blend_name, bool with_voxels, unsigned threads) {
    if (blend_name == "mean") throw nb::value_error("integers have no mean");
    const auto call =
        make_bake_call<std::int64_t>(positions, triangles, g, rule, values, {column, 1}, per_triangle, threads);
    auto drawn = with_blend(blend_name, [&]<class Blend>() {
        const nb::gil_scoped_release released;
        return draw_sparse_values<std::int64_t, 1, Blend>(call, false, with_voxels);
    });
    const std::size_t n = drawn.num_voxels;
    return give(std::move(drawn), {n}, with_voxels);
}

// The voxels alone.
nb::tuple list_voxels(const position_array& positions, const triangle_array& triangles, const grid& g,
                      const std::string& rule, unsigned threads) {
    const voxelize_options options{coverage_named(rule)};
    status s;
    std::vector<std::int32_t> coordinates;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        sparse_framebuffer<cpu_backend, target<bit, blend::bit_or>> fb{backend, g.extent};
        s = voxelize(backend, view_of(positions, triangles), g, passthrough{}, constant(true), fb, options);
        if (s.ok()) coordinates = coordinates_of(fb.view().table);
    }
    nb::dict counts = report(s);
    const std::size_t n = coordinates.size() / 3;
    return nb::make_tuple(to_numpy(std::move(coordinates), {n, 3}), counts);
}

} // namespace

void bind_sparse_integer(nb::module_& m) {
    m.def("sparse_integer", &bake_integers, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"),
          nb::arg("coverage"), nb::arg("values"), nb::arg("column"), nb::arg("per_triangle"), nb::arg("blend"),
          nb::arg("with_voxels"), nb::arg("threads"));
    m.def("sparse_voxels", &list_voxels, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"),
          nb::arg("coverage"), nb::arg("threads"));
}

} // namespace voxelpipe::python
