// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "values.hpp"

namespace voxelpipe::python {
namespace {

template <int Components, class Blend>
status draw(const bake_call<float>& call, float* out, std::uint32_t* counts) {
    using value = value_of<float, Components>;
    static_assert(sizeof(value) == Components * sizeof(float));
    cpu_backend backend{call.threads};
    const auto fb = framebuffer_view<target<value, Blend>, number_of_fragments>::on(
        call.where.extent, reinterpret_cast<value*>(out), counts);
    return voxelize(backend, call.mesh, call.where, passthrough{}, counted_value_shader<float, Components>{call.rows},
                    fb, voxelize_options{call.rule});
}

// Draws columns [first_column, first_column + out.shape(3)) of the values.
nb::dict bake(const position_array& positions, const triangle_array& triangles, const grid& g, const std::string& rule,
              const array<const float, 2>& values, std::size_t first_column, bool per_triangle,
              const std::string& blend_name, float fill, const array<float, 4>& out,
              const array<std::uint32_t, 3>& counts, unsigned threads) {
    const std::size_t components = out.shape(3);
    expect_shape(out, g, {components});
    expect_shape(counts, g);
    const auto call =
        make_bake_call<float>(positions, triangles, g, rule, values, {first_column, components}, per_triangle, threads);
    return report(with_components(components, [&]<int Components>() {
        return with_blend(blend_name, [&]<class Blend>() {
            const nb::gil_scoped_release released;
            const status s = draw<Components, Blend>(call, out.data(), counts.data());
            if (s.ok())
                finish(out.data(), counts.data(), counts.size(), components, blend_name == "mean", fill, threads);
            return s;
        });
    }));
}

} // namespace

void bind_bake_float(nb::module_& m) {
    m.def("bake_float", &bake, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"), nb::arg("coverage"),
          nb::arg("values"), nb::arg("first_column"), nb::arg("per_triangle"), nb::arg("blend"), nb::arg("fill"),
          nb::arg("out"), nb::arg("counts"), nb::arg("threads"));
}

} // namespace voxelpipe::python
