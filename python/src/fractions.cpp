// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "cell_shaders.hpp"

#include <bindings/parts.hpp>

#include <nanobind/stl/optional.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace voxelpipe::python {
namespace {

template <class Shader>
status draw_cells(const position_array& positions, const triangle_array& triangles, const grid& g,
                  const cell_options& options, float* out, const Shader& shader, unsigned threads) {
    using cell_draw = draw<mesh_view<>, passthrough, Shader>;
    const auto draws = draws_of_parts<cell_draw>(view_of(positions, triangles), std::vector<std::uint64_t>{0}, shader);
    const nb::gil_scoped_release released;
    cpu_backend backend{threads};
    return voxelize_cells(backend, draws, g, framebuffer_view<target<float, blend::replace>>::on(g.extent, out),
                          options);
}

// Fractions of all triangles together, into an array of the grid's shape, by rows along an axis; and of the voxels'
// faces across that axis their fractions inside, and the component of the mesh's area vector, into arrays of zeros; and
// the faces' centroids, and what is measured within voxels. close_holes: repair::close_holes, of holes of at most
// max_hole_edges.
nb::dict fractions_of(const position_array& positions, const triangle_array& triangles, const grid& g, int axis,
                      const array<float, 3>& out, const std::optional<array<double, 3>>& apertures,
                      const std::optional<array<double, 4>>& areas,
                      const std::optional<array<float, 4>>& face_centroids,
                      const std::optional<array<float, 4>>& centroids, const std::optional<array<double, 3>>& sizes,
                      const std::optional<array<float, 4>>& area_centroids,
                      const std::optional<array<bool, 3>>& multi_cuts, bool close_holes,
                      std::optional<std::uint64_t> max_hole_edges, unsigned threads) {
    const cell_options options = cell_options_of(axis, close_holes, max_hole_edges);
    expect_shape(out, g, "the result");
    face_arrays to;
    if (apertures) {
        grid faces = g;
        ++faces.extent[axis];
        expect_shape(*apertures, faces, "the array of apertures");
        to.apertures = apertures->data();
    }
    if (areas) {
        expect_shape(*areas, g, "the array of area vectors", {3});
        to.areas = areas->data();
    }
    if (face_centroids) {
        grid faces = g;
        ++faces.extent[axis];
        expect_shape(*face_centroids, faces, "the array of the faces' centroids", {3});
        to.centroids = face_centroids->data();
    }
    inner_arrays inner;
    if (centroids) {
        expect_shape(*centroids, g, "the array of centroids", {3});
        inner.centroids = centroids->data();
    }
    if (sizes) {
        expect_shape(*sizes, g, "the array of areas");
        inner.areas = sizes->data();
    }
    if (area_centroids) {
        expect_shape(*area_centroids, g, "the array of the areas' centroids", {3});
        inner.area_centroids = area_centroids->data();
    }
    if (multi_cuts) {
        expect_shape(*multi_cuts, g, "the array of marks");
        inner.multi_cuts = multi_cuts->data();
    }
    const fraction_and_faces shader{to.of(g, axis)};
    const status s =
        inner.any()
            ? draw_cells(positions, triangles, g, options, out.data(), fraction_and_measures{shader, inner}, threads)
        : face_centroids
            ? draw_cells(positions, triangles, g, options, out.data(), fraction_and_face_centroids{shader}, threads)
            : draw_cells(positions, triangles, g, options, out.data(), shader, threads);
    return report_cells(s);
}

// (voxels (n, 3), offsets (n + 1), bodies and fractions (m), counters): of each voxel the bodies that it has a part of,
// ascending. Part i of the triangles begins with number first_triangles[i].
nb::tuple list_bodies(const position_array& positions, const triangle_array& triangles,
                      const std::vector<std::uint64_t>& first_triangles, const grid& g, bool close_holes,
                      std::optional<std::uint64_t> max_hole_edges, unsigned threads) {
    cell_options options = cell_options_of(0, close_holes, max_hole_edges);
    options.bodies = bodies::draw;
    host_abuffer<float> lists;
    std::vector<std::int32_t> voxels;
    std::vector<std::int64_t> offsets;
    status s;
    {
        const nb::gil_scoped_release released;
        using cell_draw = draw<mesh_view<>, passthrough, fraction>;
        const auto draws = draws_of_parts<cell_draw>(view_of(positions, triangles), first_triangles, fraction{});
        cpu_backend backend{threads};
        abuffer<cpu_backend, float> on_backend{backend};
        s = voxelize_cells(backend, draws, g, on_backend, options);
        lists = on_backend.to_host(backend);
        voxels.reserve(3 * lists.size());
        for (const std::uint64_t id : lists.voxels) {
            const glm::ivec3 p = lists.position(id);
            voxels.insert(voxels.end(), {p.x, p.y, p.z});
        }
        offsets.assign(lists.offsets.begin(), lists.offsets.end());
        if (offsets.empty()) offsets.push_back(0);
    }
    nb::dict counts = report_cells(s);
    const std::size_t num_voxels = lists.voxels.size(), num_fragments = lists.primitives.size();
    return nb::make_tuple(to_numpy(std::move(voxels), {num_voxels, 3}), to_numpy(std::move(offsets), {num_voxels + 1}),
                          to_numpy(std::move(lists.primitives), {num_fragments}),
                          to_numpy(std::move(lists.payloads), {num_fragments}), counts);
}

} // namespace

void bind_fractions(nb::module_& m) {
    m.def("fractions", &fractions_of, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"), nb::arg("axis"),
          nb::arg("out"), nb::arg("apertures").none(), nb::arg("areas").none(), nb::arg("face_centroids").none(),
          nb::arg("centroids").none(), nb::arg("sizes").none(), nb::arg("area_centroids").none(),
          nb::arg("multi_cuts").none(), nb::arg("close_holes"), nb::arg("max_hole_edges").none(), nb::arg("threads"));
    m.def("fraction_lists", &list_bodies, nb::arg("positions"), nb::arg("triangles"), nb::arg("first_triangles"),
          nb::arg("grid"), nb::arg("close_holes"), nb::arg("max_hole_edges").none(), nb::arg("threads"));
}

} // namespace voxelpipe::python
