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
    // The arrays' addresses: apertures, area vectors and centroids of faces; centroids, areas, their centroids and
    // marks. 0 where nobody asked.
    m.def("fractions",
          [](const stream_of& on, const device_array& positions, const device_array& triangles, const grid_state& g,
             int axis, bool close_holes, std::optional<std::uint64_t> max_hole_edges, std::uintptr_t out,
             const std::array<std::uintptr_t, 3>& faces, const std::array<std::uintptr_t, 4>& inner) {
              const call c = make_call(on, positions, triangles, g);
              const cell_options options = cell_options_of(axis, close_holes, max_hole_edges);
              face_arrays of_faces;
              of_faces.apertures = pointer<double>(faces[0]);
              of_faces.areas = pointer<double>(faces[1]);
              of_faces.centroids = pointer<float>(faces[2]);
              const inner_arrays within{pointer<float>(inner[0]), pointer<double>(inner[1]), pointer<float>(inner[2]),
                                        pointer<bool>(inner[3])};
              return report_cells(unlocked([&] {
                  return draw_fractions(c.on, c.mesh, c.where, options, pointer<float>(out), of_faces, within);
              }));
          });
}

} // namespace voxelpipe::python
