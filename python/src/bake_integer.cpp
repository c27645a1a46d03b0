// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "values.hpp"

namespace voxelpipe::python {
namespace {

template <class Blend>
status draw(const bake_call<std::int64_t>& call, std::int64_t* out, std::uint32_t* counts) {
    cpu_backend backend{call.threads};
    const auto fb =
        framebuffer_view<target<std::int64_t, Blend>, number_of_fragments>::on(call.where.extent, out, counts);
    return voxelize(backend, call.mesh, call.where, passthrough{}, counted_value_shader<std::int64_t, 1>{call.rows}, fb,
                    voxelize_options{call.rule});
}

// Draws one column of 64-bit integers.
nb::dict bake(const position_array& positions, const triangle_array& triangles, const grid& g, const std::string& rule,
              const array<const std::int64_t, 2>& values, std::size_t column, bool per_triangle,
              const std::string& blend_name, std::int64_t fill, const array<std::int64_t, 3>& out,
              const array<std::uint32_t, 3>& counts, unsigned threads) {
    expect_shape(out, g);
    expect_shape(counts, g);
    if (blend_name == "mean") throw nb::value_error("integers have no mean");
    const auto call =
        make_bake_call<std::int64_t>(positions, triangles, g, rule, values, {column, 1}, per_triangle, threads);
    return report(with_blend(blend_name, [&]<class Blend>() {
        const nb::gil_scoped_release released;
        const status s = draw<Blend>(call, out.data(), counts.data());
        if (s.ok()) finish(out.data(), counts.data(), counts.size(), 1, false, fill, threads);
        return s;
    }));
}

} // namespace

void bind_bake_integer(nb::module_& m) {
    m.def("bake_integer", &bake, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"), nb::arg("coverage"),
          nb::arg("values"), nb::arg("column"), nb::arg("per_triangle"), nb::arg("blend"), nb::arg("fill"),
          nb::arg("out"), nb::arg("counts"), nb::arg("threads"));
}

} // namespace voxelpipe::python
