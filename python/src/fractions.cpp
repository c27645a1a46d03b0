// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <bindings/parts.hpp>
#include <voxelpipe/cells/cells.hpp>

#include <nanobind/stl/optional.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace voxelpipe::python {
namespace {

// Arrays of doubles beside the fractions, null where nobody asked: every element is that of one voxel, which writes it.
struct face_arrays {
    double* apertures = nullptr; // of the grid's extent, and one more along the axis
    double* areas = nullptr;     // three a voxel
    double face = 1;             // the area of a voxel's face across the axis, in world units
    glm::ivec3 extent{};
    glm::ivec3 offset{}; // of the grid in the whole one
    int axis = 0;
};

// Cell shader that returns the fraction, and puts the voxel's faces along the axis into their arrays.
struct fraction_and_faces {
    face_arrays to;

    output<float> operator()(const cell_fragment& f) const {
        constexpr double unit = 0x1p-44;
        const glm::ivec3 p = f.voxel - to.offset;
        const auto index = [&](glm::ivec3 extent) {
            return (static_cast<std::int64_t>(p.z) * extent.y + p.y) * extent.x + p.x;
        };
        if (to.apertures != nullptr) {
            glm::ivec3 extent = to.extent;
            ++extent[to.axis];
            double* const lower = to.apertures + index(extent);
            *lower = static_cast<double>(f.aperture) * unit;
            const std::int64_t step = to.axis == 0   ? 1
                                      : to.axis == 1 ? extent.x
                                                     : static_cast<std::int64_t>(extent.x) * extent.y;
            if (p[to.axis] + 1 == to.extent[to.axis]) lower[step] = static_cast<double>(f.next_aperture) * unit;
        }
        // The units' difference is exact; in double, one rounding for the voxel's size.
        if (to.areas != nullptr)
            to.areas[3 * index(to.extent) + to.axis] =
                static_cast<double>(f.aperture - f.next_aperture) * unit * to.face;
        return outputs(f.fraction);
    }
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

// The same shader with what is measured within the voxel.
struct measuring : fraction_and_faces {
    using fragment = measured_cell<cell_value::centroid, cell_value::area, cell_value::sheets>;
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
// what is measured within voxels. close_holes: repair::close_holes, of holes of at most max_hole_edges.
nb::dict fractions_of(const position_array& positions, const triangle_array& triangles, const grid& g, int axis,
                      const array<float, 3>& out, const std::optional<array<double, 3>>& apertures,
                      const std::optional<array<double, 4>>& areas, const std::optional<array<float, 4>>& centroids,
                      const std::optional<array<double, 3>>& sizes,
                      const std::optional<array<float, 4>>& area_centroids,
                      const std::optional<array<bool, 3>>& multi_cuts, bool close_holes,
                      std::optional<std::uint64_t> max_hole_edges, unsigned threads) {
    cell_options options;
    options.axis = axis;
    if (close_holes) options.repair = repair::close_holes;
    if (max_hole_edges) options.max_hole_edges = *max_hole_edges;
    expect_shape(out, g, "the result");
    fraction_and_faces shader{{nullptr, nullptr, 1, g.extent, g.offset, axis}};
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
    const status s = inner.any()
                         ? draw_cells(positions, triangles, g, options, out.data(), measuring{shader, inner}, threads)
                         : draw_cells(positions, triangles, g, options, out.data(), shader, threads);
    return report_cells(s);
}

} // namespace

void bind_fractions(nb::module_& m) {
    m.def("fractions", &fractions_of, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"), nb::arg("axis"),
          nb::arg("out"), nb::arg("apertures").none(), nb::arg("areas").none(), nb::arg("centroids").none(),
          nb::arg("sizes").none(), nb::arg("area_centroids").none(), nb::arg("multi_cuts").none(),
          nb::arg("close_holes"), nb::arg("max_hole_edges").none(), nb::arg("threads"));
}

} // namespace voxelpipe::python
