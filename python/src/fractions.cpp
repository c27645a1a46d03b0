// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <bindings/parts.hpp>
#include <voxelpipe/cells/cells.hpp>

#include <nanobind/stl/optional.h>

#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::python {
namespace {

// Arrays of doubles beside the fractions, null where nobody asked: every element is that of one voxel, which writes it.
struct face_arrays {
    double* apertures = nullptr; // of the grid's extent, and one more along the axis
    double* areas = nullptr;     // three a voxel
    float* centroids = nullptr;  // three a face, in the order of the apertures
    double face = 1;             // the area of a voxel's face across the axis, in world units
    glm::ivec3 extent{};
    glm::ivec3 offset{}; // of the grid in the whole one
    int axis = 0;
};

// Cell shader that returns the fraction, and puts the voxel's faces along the axis into their arrays.
struct fraction_and_faces {
    face_arrays to;

    template <class Fragment>
    output<float> operator()(const Fragment& f) const {
        constexpr double unit = 0x1p-44;
        const glm::ivec3 p = f.voxel - to.offset;
        const auto index = [&](glm::ivec3 extent) {
            return (static_cast<std::int64_t>(p.z) * extent.y + p.y) * extent.x + p.x;
        };
        glm::ivec3 faces = to.extent;
        ++faces[to.axis];
        const std::int64_t lower = index(faces);
        const std::int64_t step = to.axis == 0   ? 1
                                  : to.axis == 1 ? faces.x
                                                 : static_cast<std::int64_t>(faces.x) * faces.y;
        const bool is_last = p[to.axis] + 1 == to.extent[to.axis]; // whose upper face no other voxel has as its lower
        if (to.apertures != nullptr) {
            to.apertures[lower] = static_cast<double>(f.aperture) * unit;
            if (is_last) to.apertures[lower + step] = static_cast<double>(f.next_aperture) * unit;
        }
        if constexpr (std::is_base_of_v<core::value_of_cell<cell_value::faces>, Fragment>)
            for (int i = 0; i < 3 && to.centroids != nullptr; ++i) {
                to.centroids[3 * lower + i] = f.aperture_centroid[i];
                if (is_last) to.centroids[3 * (lower + step) + i] = f.next_aperture_centroid[i];
            }
        // The units' difference is exact; in double, one rounding for the voxel's size.
        if (to.areas != nullptr)
            to.areas[3 * index(to.extent) + to.axis] =
                static_cast<double>(f.aperture - f.next_aperture) * unit * to.face;
        return outputs(f.fraction);
    }
};

// The same with the faces' centroids.
struct measuring_faces : fraction_and_faces {
    using fragment = measured_cell<cell_value::faces>;
};

// Arrays of what is measured within a voxel, null where nobody asked.
struct inner_arrays {
    float* centroids = nullptr; // three a voxel
    double* areas = nullptr;
    float* area_centroids = nullptr; // three a voxel
    bool* multi_cuts = nullptr;

    [[nodiscard]] bool any() const {
        return centroids != nullptr || areas != nullptr || area_centroids != nullptr || multi_cuts != nullptr;
    }
};

// The same with what is measured within the voxel, too.
struct measuring : fraction_and_faces {
    using fragment = measured_cell<cell_value::centroid, cell_value::area, cell_value::sheets, cell_value::faces>;
    inner_arrays inner;

    output<float> operator()(const fragment& f) const {
        const glm::ivec3 p = f.voxel - to.offset;
        const std::int64_t voxel = (static_cast<std::int64_t>(p.z) * to.extent.y + p.y) * to.extent.x + p.x;
        for (int i = 0; i < 3; ++i) {
            if (inner.centroids != nullptr) inner.centroids[3 * voxel + i] = f.centroid[i];
            if (inner.area_centroids != nullptr) inner.area_centroids[3 * voxel + i] = f.area_centroid[i];
        }
        if (inner.areas != nullptr) inner.areas[voxel] = f.area;
        if (inner.multi_cuts != nullptr) inner.multi_cuts[voxel] = f.is_multi_cut;
        return fraction_and_faces::operator()(f);
    }
};

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
    cell_options options;
    options.axis = axis;
    if (close_holes) options.repair = repair::close_holes;
    if (max_hole_edges) options.max_hole_edges = *max_hole_edges;
    expect_shape(out, g, "the result");
    fraction_and_faces shader{{nullptr, nullptr, nullptr, 1, g.extent, g.offset, axis}};
    if (apertures) {
        grid faces = g;
        ++faces.extent[axis];
        expect_shape(*apertures, faces, "the array of apertures");
        shader.to.apertures = apertures->data();
    }
    if (areas) {
        expect_shape(*areas, g, "the array of area vectors", {3});
        shader.to.areas = areas->data();
        shader.to.face = g.voxel_size[(axis + 1) % 3] * g.voxel_size[(axis + 2) % 3];
    }
    if (face_centroids) {
        grid faces = g;
        ++faces.extent[axis];
        expect_shape(*face_centroids, faces, "the array of the faces' centroids", {3});
        shader.to.centroids = face_centroids->data();
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
    const status s =
        inner.any()      ? draw_cells(positions, triangles, g, options, out.data(), measuring{shader, inner}, threads)
        : face_centroids ? draw_cells(positions, triangles, g, options, out.data(), measuring_faces{shader}, threads)
                         : draw_cells(positions, triangles, g, options, out.data(), shader, threads);
    return report_cells(s);
}

// (voxels (n, 3), offsets (n + 1), bodies and fractions (m), counters): of each voxel the bodies that it has a part of,
// ascending. Part i of the triangles begins with number first_triangles[i].
nb::tuple list_bodies(const position_array& positions, const triangle_array& triangles,
                      const std::vector<std::uint64_t>& first_triangles, const grid& g, bool close_holes,
                      std::optional<std::uint64_t> max_hole_edges, unsigned threads) {
    cell_options options;
    options.bodies = bodies::draw;
    if (close_holes) options.repair = repair::close_holes;
    if (max_hole_edges) options.max_hole_edges = *max_hole_edges;
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
