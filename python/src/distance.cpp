// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <bindings/nearest.hpp>
#include <bindings/parts.hpp>

#include <nanobind/stl/optional.h>

#include <cstdint>
#include <optional>
#include <string>

namespace voxelpipe::python {
namespace {

// Part i of the triangles begins with number first_triangles[i]. `nearest` may be none.
nb::dict distance_field(const position_array& positions, const triangle_array& triangles,
                        const std::vector<std::uint64_t>& first_triangles, const grid& g, double band,
                        const std::string& sign, const std::string& repair_name, const std::string& bodies_name,
                        std::optional<std::uint64_t> max_hole_edges, int closing, bool corners,
                        const array<float, 3>& out, const std::optional<array<std::int64_t, 3>>& nearest,
                        unsigned threads) {
    const distance_options options =
        distance_options_named(band, sign, repair_name, bodies_name, max_hole_edges, closing, corners);
    const grid samples = corners ? g.at_corners() : g;
    expect_shape(out, samples, "the result");
    if (nearest) expect_shape(*nearest, samples, "the array of triangles");
    const mesh_view<> mesh = view_of(positions, triangles);
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        if (nearest) {
            const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, distance_and_nearest>>(
                mesh, first_triangles, distance_and_nearest{});
            s = voxelize_distance(backend, draws, g,
                                  framebuffer_view<distances, numbers>::on(samples.extent, out.data(), nearest->data()),
                                  options);
        } else {
            const auto draws =
                draws_of_parts<draw<mesh_view<>, passthrough, distance>>(mesh, first_triangles, distance{});
            s = voxelize_distance(backend, draws, g, framebuffer_view<distances>::on(samples.extent, out.data()),
                                  options);
        }
    }
    return report_distance(s);
}

// Distances of (n, 3) points; the arrays have n elements.
nb::dict distance_at_points(const position_array& positions, const triangle_array& triangles,
                            const std::vector<std::uint64_t>& first_triangles, const grid& g,
                            const position_array& points, const std::string& sign, const std::string& repair_name,
                            const std::string& bodies_name, std::optional<std::uint64_t> max_hole_edges,
                            const array<float, 1>& out, const array<std::int64_t, 1>& nearest, unsigned threads) {
    const distance_options options =
        distance_options_named(0.0, sign, repair_name, bodies_name, max_hole_edges, 0, false);
    if (out.shape(0) != points.shape(0) || nearest.shape(0) != points.shape(0))
        throw nb::value_error("the arrays to write into do not have one element a point");
    const array_view<const glm::vec3> at(reinterpret_cast<const glm::vec3*>(points.data()), points.shape(0));
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, distance>>(view_of(positions, triangles),
                                                                                    first_triangles, distance{});
        s = distance_at(backend, std::span<const draw<mesh_view<>, passthrough, distance>>(draws), g, at,
                        {out.data(), nearest.data()}, options);
    }
    return report_distance(s);
}

} // namespace

void bind_distance(nb::module_& m) {
    m.def("distance_field", &distance_field, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("band"), nb::arg("sign"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("closing"), nb::arg("corners"), nb::arg("out"),
          nb::arg("nearest").none(), nb::arg("threads"));
    m.def("distance_at", &distance_at_points, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("points"), nb::arg("sign"), nb::arg("repair"), nb::arg("bodies"),
          nb::arg("max_hole_edges").none(), nb::arg("out"), nb::arg("nearest"), nb::arg("threads"));
}

} // namespace voxelpipe::python
