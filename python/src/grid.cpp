// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "grid_state.hpp"

#include <nanobind/operators.h>

#include <algorithm>
#include <new>
#include <sstream>
#include <tuple>

namespace voxelpipe::python {
namespace {

std::tuple<double, double, double> to_tuple(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

std::tuple<int, int, int> shape_of(const glm::ivec3& extent) { return {extent.z, extent.y, extent.x}; }

bounding_box box_of(const triple_of_double& low, const triple_of_double& high) {
    return {to_vector(low), to_vector(high)};
}

std::string describe(const grid& g) {
    std::ostringstream text;
    text.precision(10);
    const glm::dvec3 corner = g.part_origin();
    text << "Grid(origin=(" << corner.x << ", " << corner.y << ", " << corner.z << "), voxel_size=(" << g.voxel_size.x
         << ", " << g.voxel_size.y << ", " << g.voxel_size.z << "), shape=(" << g.extent.z << ", " << g.extent.y << ", "
         << g.extent.x << "))";
    return text.str();
}

} // namespace

void bind_grid(nb::module_& m) {
    nb::class_<grid>(m, "Grid",
                     "Where the voxels lie. Voxel [k, j, i] of an array is the closed box from\n"
                     "``origin + (i, j, k) * voxel_size`` to ``origin + (i + 1, j + 1, k + 1) * voxel_size``.\n"
                     "Grids do not change, and compare by value.")
        .def(
            "__init__",
            [](grid* self, const triple_of_double& origin, const triple_of_double& voxel_size,
               const triple_of_int& shape) { new (self) grid(make_grid(origin, voxel_size, shape)); },
            nb::arg("origin"), nb::arg("voxel_size"), nb::arg("shape"),
            "origin: world position (x, y, z) of the low corner. voxel_size: world units along x, y and z.\n"
            "shape: (nz, ny, nx), each from 1 to 2^20. Raises ValueError.")
        .def_prop_ro(
            "origin", [](const grid& g) { return to_tuple(g.part_origin()); },
            "World position (x, y, z) of the low corner.")
        .def_prop_ro(
            "voxel_size", [](const grid& g) { return to_tuple(g.voxel_size); }, "World units along x, y and z.")
        .def_prop_ro(
            "shape", [](const grid& g) { return shape_of(g.extent); },
            "(nz, ny, nx): the shape of arrays on this grid.")
        .def_prop_ro(
            "offset", [](const grid& g) { return shape_of(g.offset); },
            "(z, y, x): the first voxel's index in the grid that this one was cropped from; zeros otherwise.")
        .def(
            "crop",
            [](const grid& g, const triple_of_int& begin, const triple_of_int& shape) {
                grid part = checked(g.crop(extent_of(begin), extent_of(shape)));
                if (part.extent == part.whole) part.whole = glm::ivec3(0); // all of it: equal to the whole
                return part;
            },
            nb::arg("begin"), nb::arg("shape"),
            "The part of `shape` (nz, ny, nx) that begins at voxel `begin` (z, y, x). What is drawn into a crop is, "
            "bit\n"
            "for bit, that part of what is drawn into the whole. Raises ValueError where it is not within the grid.")
        .def(
            "voxel_center",
            [](const grid& g, const triple_of_int& voxel) {
                return to_tuple(
                    g.to_world(to_vector({static_cast<double>(voxel[0]) + 0.5, static_cast<double>(voxel[1]) + 0.5,
                                          static_cast<double>(voxel[2]) + 0.5})));
            },
            nb::arg("voxel"), "World position of the centre of voxel (i, j, k), counted along x, y and z.")
        .def(
            "_relative_to_origin",
            [](const grid& g) {
                grid moved = g;
                moved.origin = glm::dvec3(0.0);
                return moved;
            },
            "The same grid where its whole grid's low corner is 0: for positions from which that was taken away.")
        .def_prop_ro("_whole_origin", [](const grid& g) { return to_tuple(g.origin); })
        .def(
            "__eq__", [](const grid& a, const grid& b) { return a == b; }, nb::is_operator())
        .def("__hash__",
             [](const grid& g) {
                 return nb::hash(nb::make_tuple(g.origin.x, g.origin.y, g.origin.z, g.voxel_size.x, g.voxel_size.y,
                                                g.voxel_size.z, g.extent.x, g.extent.y, g.extent.z, g.offset.x,
                                                g.offset.y, g.offset.z));
             })
        .def("__getstate__",
             [](const grid& g) {
                 const grid all = g.uncropped();
                 return std::make_tuple(to_tuple(g.origin), to_tuple(g.voxel_size), shape_of(all.extent),
                                        shape_of(g.offset), shape_of(g.extent));
             })
        .def("__setstate__", [](grid& g, const grid_state& state) { new (&g) grid(grid_of(state)); })
        .def("__repr__", &describe);

    m.def(
        "fit_longest",
        [](const triple_of_double& low, const triple_of_double& high, std::int64_t n) {
            return checked(fit_longest(box_of(low, high), static_cast<int>(std::clamp<std::int64_t>(n, -1, 1 << 30))));
        },
        nb::arg("low"), nb::arg("high"), nb::arg("n"));
    m.def(
        "fit_shape",
        [](const triple_of_double& low, const triple_of_double& high, const triple_of_int& shape) {
            return checked(fit(box_of(low, high), extent_of(shape)));
        },
        nb::arg("low"), nb::arg("high"), nb::arg("shape"));
    m.def(
        "fit_voxel_size",
        [](const triple_of_double& low, const triple_of_double& high, const triple_of_double& size, int padding) {
            return checked(fit_voxel_size(box_of(low, high), to_vector(size), padding));
        },
        nb::arg("low"), nb::arg("high"), nb::arg("voxel_size"), nb::arg("padding"));
}

} // namespace voxelpipe::python
