// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse.hpp"

namespace voxelpipe::python {
namespace {

// Values of columns [first_column, first_column + num_columns), one row for each voxel; 1 to 3 columns.
nb::tuple bake_floats(const position_array& positions, const triangle_array& triangles, const grid& g,
                      const std::string& rule, const array<const float, 2>& values, std::size_t first_column,
                      std::size_t num_columns, bool per_triangle, const std::string& blend_name, bool with_voxels,
                      unsigned threads) {
    if (num_columns < 1 || num_columns > 3) throw nb::value_error("a pass takes 1 to 3 columns");
    const auto call = make_bake_call<float>(positions, triangles, g, rule, values, {first_column, num_columns},
                                            per_triangle, threads);
    auto drawn = with_blend(blend_name, [&]<class Blend>() {
        const nb::gil_scoped_release released;
        if constexpr (std::is_same_v<Blend, blend::add>)
            if (num_columns == 1) return draw_sparse_values<float, 1, Blend>(call, blend_name == "mean", with_voxels);
        return first_columns(draw_sparse_values<float, 3, Blend>(call, blend_name == "mean", with_voxels), num_columns);
    });
    const std::size_t n = drawn.num_voxels;
    return give(std::move(drawn), {n, num_columns}, with_voxels);
}

} // namespace

void bind_sparse_float(nb::module_& m) {
    m.def("sparse_float", &bake_floats, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"),
          nb::arg("coverage"), nb::arg("values"), nb::arg("first_column"), nb::arg("num_columns"),
          nb::arg("per_triangle"), nb::arg("blend"), nb::arg("with_voxels"), nb::arg("threads"));
}

} // namespace voxelpipe::python
