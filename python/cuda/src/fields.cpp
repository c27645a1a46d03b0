// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arguments.hpp"

// Functions that fill arrays of samples or points.

namespace voxelpipe::python {

void bind_fields(nb::module_& m) {
    m.def("distance_field", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                               const std::vector<std::uint64_t>& first_triangles, const grid_state& g, double band,
                               const std::string& sign, const std::string& repair_name, const std::string& bodies_name,
                               std::optional<std::uint64_t> max_hole_edges, int closing, bool corners,
                               std::uintptr_t out, std::uintptr_t nearest) {
        const call c = make_call(on, positions, triangles, g);
        const distance_options options =
            distance_options_named(band, sign, repair_name, bodies_name, max_hole_edges, closing, corners);
        return report_distance(unlocked([&] {
            return draw_distance(c.on, c.mesh, first_triangles, c.where, options, pointer<float>(out),
                                 pointer<std::int64_t>(nearest));
        }));
    });
    m.def("distance_at",
          [](const stream_of& on, const device_array& positions, const device_array& triangles,
             const std::vector<std::uint64_t>& first_triangles, const grid_state& g, const device_array& points,
             const std::string& sign, const std::string& repair_name, const std::string& bodies_name,
             std::optional<std::uint64_t> max_hole_edges, std::uintptr_t out, std::uintptr_t nearest) {
              const call c = make_call(on, positions, triangles, g);
              const distance_options options =
                  distance_options_named(0.0, sign, repair_name, bodies_name, max_hole_edges, 0, false);
              const auto [address, num_points] = points;
              const array_view<const glm::vec3> at(pointer<const glm::vec3>(address), num_points);
              const distance_arrays to{pointer<float>(out), pointer<std::int64_t>(nearest)};
              return report_distance(
                  unlocked([&] { return measure_points(c.on, c.mesh, first_triangles, c.where, at, options, to); }));
          });
}

} // namespace voxelpipe::python
