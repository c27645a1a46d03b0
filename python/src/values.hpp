// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Attributes that are baked into voxels by the CPU.

#include "arrays.hpp"

#include <bindings/sparse_values.hpp>

namespace voxelpipe::python {

struct column_range {
    std::size_t first = 0, count = 1;
};

// Throws ValueError where the values are not one row for each vertex, or each triangle, or lack such columns.
template <class T>
[[nodiscard]] bake_call<T> make_bake_call(const position_array& positions, const triangle_array& triangles,
                                          const grid& g, const std::string& rule, const array<const T, 2>& values,
                                          column_range columns, bool per_triangle, unsigned threads) {
    bake_call<T> call{view_of(positions, triangles), g, coverage_named(rule), {}, threads};
    const std::size_t rows = per_triangle ? call.mesh.triangles.size() : call.mesh.positions.size();
    if (values.shape(0) != rows) throw nb::value_error("values need one row for each vertex, or for each triangle");
    if (columns.first > values.shape(1) || columns.count > values.shape(1) - columns.first)
        throw nb::value_error("values have no such columns");
    call.rows = {values.data() + columns.first, values.shape(1), static_cast<int>(columns.count),
                 per_triangle ? nullptr : call.mesh.triangles.data()};
    return call;
}

// How a voxel's fragments become one value: "mean", "sum", "min", "max" or "last". A mean is a sum that is divided.
// Calls f.template operator()<Blend>(). Throws ValueError for another name.
template <class F>
auto with_blend(std::string_view name, F&& f) {
    if (name == "sum" || name == "mean") return f.template operator()<blend::add>();
    if (name == "min") return f.template operator()<blend::min>();
    if (name == "max") return f.template operator()<blend::max>();
    if (name == "last") return f.template operator()<blend::replace>();
    throw nb::value_error(("blend is 'mean', 'sum', 'min', 'max' or 'last', not '" + std::string(name) + "'").c_str());
}

} // namespace voxelpipe::python
