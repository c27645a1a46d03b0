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

// Fractions of all triangles together, into an array of the grid's shape, by rows along an axis; and of the voxels'
// faces across that axis their fractions inside, and the component of the mesh's area vector, into arrays of zeros.
nb::dict fractions_of(const position_array& positions, const triangle_array& triangles, const grid& g, int axis,
                      const array<float, 3>& out, const std::optional<array<double, 3>>& apertures,
                      const std::optional<array<double, 4>>& areas, unsigned threads) {
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
    using cell_draw = draw<mesh_view<>, passthrough, fraction_and_faces>;
    const auto draws = draws_of_parts<cell_draw>(view_of(positions, triangles), std::vector<std::uint64_t>{0}, shader);
    cell_options options;
    options.axis = axis;
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        s = voxelize_cells(backend, draws, g, framebuffer_view<target<float, blend::replace>>::on(g.extent, out.data()),
                           options);
    }
    nb::dict d = report(s);
    d["cut_voxels"] = s.cells.cut_voxels;
    d["below_zero"] = s.cells.below_zero;
    d["above_one"] = s.cells.above_one;
    d["open_rows"] = s.cells.open_rows;
    d["open_edges"] = s.cells.open_edges;
    return d;
}

} // namespace

void bind_fractions(nb::module_& m) {
    m.def("fractions", &fractions_of, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"), nb::arg("axis"),
          nb::arg("out"), nb::arg("apertures").none(), nb::arg("areas").none(), nb::arg("threads"));
}

} // namespace voxelpipe::python
