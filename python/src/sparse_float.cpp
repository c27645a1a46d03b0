// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse.hpp"

namespace voxelpipe::python {
namespace {

// Values of columns [first_column, first_column + num_columns), one row for each voxel.
nb::tuple bake(const position_array& positions, const triangle_array& triangles, const grid& g, const std::string& rule,
               const array<const float, 2>& values, std::size_t first_column, std::size_t num_columns,
               bool per_triangle, const std::string& blend_name, unsigned threads) {
    const auto call = make_bake_call<float>(positions, triangles, g, rule, values, {first_column, num_columns},
                                            per_triangle, threads);
    auto drawn = with_components(num_columns, [&]<int Components>() {
        return with_blend(blend_name, [&]<class Blend>() {
            const nb::gil_scoped_release released;
            return draw_sparse_values<float, Components, Blend>(call, blend_name == "mean");
        });
    });
    nb::dict counts = report(drawn.result);
    return nb::make_tuple(to_numpy(std::move(drawn.values), {drawn.num_voxels, num_columns}), counts);
}

} // namespace

void bind_sparse_float(nb::module_& m) {
    m.def("sparse_float", &bake, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"), nb::arg("coverage"),
          nb::arg("values"), nb::arg("first_column"), nb::arg("num_columns"), nb::arg("per_triangle"), nb::arg("blend"),
          nb::arg("threads"));
}

} // namespace voxelpipe::python
