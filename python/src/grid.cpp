// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "grid_state.hpp"

#include <nanobind/operators.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <new>
#include <string>
#include <tuple>

namespace voxelpipe::python {
namespace {

std::tuple<double, double, double> to_tuple(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

std::tuple<int, int, int> shape_of(const glm::ivec3& extent) { return {extent.z, extent.y, extent.x}; }

bounding_box box_of(const triple_of_double& low, const triple_of_double& high) {
    return {to_vector(low), to_vector(high)};
}

// The shortest text that reads back as the same number.
std::string shortest(double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof(text), value).ptr;
    return {text, end};
}
std::string tuple_text(const glm::dvec3& v) {
    return '(' + shortest(v.x) + ", " + shortest(v.y) + ", " + shortest(v.z) + ')';
}
std::string shape_text(const glm::ivec3& extent) {
    return '(' + std::to_string(extent.z) + ", " + std::to_string(extent.y) + ", " + std::to_string(extent.x) + ')';
}

// An expression that gives the grid.
std::string describe(const grid& g) {
    const grid all = g.uncropped();
    std::string text = "Grid(origin=" + tuple_text(all.part_origin()) + ", voxel_size=" + tuple_text(g.voxel_size) +
                       ", shape=" + shape_text(all.extent) + ')';
    if (g.extent != all.extent) text += ".crop(" + shape_text(g.offset) + ", " + shape_text(g.extent) + ')';
    return text;
}

// Conversions of arrays are written in Python.
struct conversion {
    const char *name, *signature;
};
constexpr conversion zyx_call{"zyx", "def zyx(self, ijk: typing.Any) -> tuple[typing.Any, typing.Any, typing.Any]"};
constexpr conversion index_call{"index", "def index(self, ijk: typing.Any) -> typing.Any"};
constexpr conversion to_xyz_call{"to_xyz", "def to_xyz(self, ijk: typing.Any) -> typing.Any"};
constexpr conversion to_ijk_call{"to_ijk", "def to_ijk(self, xyz: typing.Any) -> typing.Any"};
constexpr conversion ijk_call{"ijk", "def ijk(self, dense: typing.Any) -> typing.Any"};

nb::object convert(const conversion& how, const grid& g, const nb::object& what) {
    return nb::module_::import_("voxelpipe._axes").attr(how.name)(g, what);
}

// Three numbers. Raises TypeError with the argument's name and what it is for anything else.
template <class Triple>
Triple three_numbers(const nb::object& value, const char* name, const char* what) {
    if (Triple t; nb::try_cast(value, t)) return t;
    throw nb::type_error((std::string(name) + " is " + what + ", not " + nb::repr(value).c_str()).c_str());
}

// A number of voxels along an axis that no grid has is refused by its name.
void check_resolution(std::int64_t n) {
    if (n < 1 || n > grid::max_extent)
        throw nb::value_error(
            ("resolution is 1 to 2^20 voxels along the longest side, not " + std::to_string(n)).c_str());
}
void check_shape(const triple_of_int& shape, const char* what) {
    for (const std::int64_t n : shape)
        if (n < 1 || n > grid::max_extent)
            throw nb::value_error((std::string(what) + " is (nz, ny, nx), each from 1 to 2^20, not (" +
                                   std::to_string(shape[0]) + ", " + std::to_string(shape[1]) + ", " +
                                   std::to_string(shape[2]) + ')')
                                      .c_str());
}
void check_voxel_size(const triple_of_double& size) {
    for (const double s : size)
        if (!(s > 0) || !std::isfinite(s))
            throw nb::value_error(
                ("voxel_size is above 0 and finite, not " + shortest(s) + ": a bad voxel size").c_str());
}

} // namespace

void bind_grid(nb::module_& m) {
    nb::class_<grid>(m, "Grid",
                     "Where the voxels lie. Voxel [k, j, i] of an array is the closed box from\n"
                     "``origin + (i, j, k) * voxel_size`` to ``origin + (i + 1, j + 1, k + 1) * voxel_size``.\n"
                     "Grids do not change, and compare by value.")
        .def(
            "__init__",
            [](grid* self, const nb::object& origin, const nb::object& voxel_size, const nb::object& shape) {
                const auto low = three_numbers<triple_of_double>(origin, "origin", "three numbers (x, y, z)");
                const auto size =
                    three_numbers<triple_of_double>(voxel_size, "voxel_size", "three numbers, along x, y and z");
                const auto counts = three_numbers<triple_of_int>(shape, "shape", "three whole numbers (nz, ny, nx)");
                check_voxel_size(size);
                check_shape(counts, "shape");
                new (self) grid(make_grid(low, size, counts));
            },
            nb::arg("origin").none(), nb::arg("voxel_size").none(), nb::arg("shape").none(),
            nb::sig("def __init__(self, origin: collections.abc.Sequence[float], voxel_size: "
                    "collections.abc.Sequence[float], shape: collections.abc.Sequence[int]) -> None"),
            "origin: world position (x, y, z) of the low corner. voxel_size: world units along x, y and z.\n"
            "shape: (nz, ny, nx), each from 1 to 2^20. Raises TypeError for what is not three numbers, ValueError for\n"
            "numbers that no grid has.")
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
            [](const grid& g, const nb::object& begin, const nb::object& shape) {
                const auto first = three_numbers<triple_of_int>(begin, "begin", "three whole numbers (z, y, x)");
                const auto counts = three_numbers<triple_of_int>(shape, "shape", "three whole numbers (nz, ny, nx)");
                grid part = checked(g.crop(extent_of(first), extent_of(counts)));
                if (part.extent == part.whole) part.whole = glm::ivec3(0); // all of it: equal to the whole
                return part;
            },
            nb::arg("begin").none(), nb::arg("shape").none(),
            nb::sig(
                "def crop(self, begin: collections.abc.Sequence[int], shape: collections.abc.Sequence[int]) -> Grid"),
            "The part of `shape` (nz, ny, nx) that begins at voxel `begin` (z, y, x). What is drawn into a crop is, "
            "bit\n"
            "for bit, that part of what is drawn into the whole. Raises ValueError where it is not within the grid.")
        .def(
            "voxel_center",
            [](const grid& g, const nb::object& voxel) {
                const auto at = three_numbers<triple_of_int>(voxel, "voxel", "three whole numbers (i, j, k)");
                return to_tuple(
                    g.to_world(to_vector({static_cast<double>(at[0]) + 0.5, static_cast<double>(at[1]) + 0.5,
                                          static_cast<double>(at[2]) + 0.5})));
            },
            nb::arg("voxel").none(),
            nb::sig("def voxel_center(self, voxel: collections.abc.Sequence[int]) -> tuple[float, float, float]"),
            "World position of the centre of voxel (i, j, k), counted along x, y and z.")
        .def(
            "zyx", [](const grid& g, const nb::object& ijk) { return convert(zyx_call, g, ijk); }, nb::arg("ijk"),
            nb::sig(zyx_call.signature),
            "The index of voxels into an array of the grid: for voxels (n, 3) with columns x, y, z the columns z, y, "
            "x.\n"
            "Raises IndexError for a voxel outside of the grid, which numpy would take for one at the other end.\n"
            "Example: ``occupied[grid.zyx(voxels)] = True``")
        .def(
            "index", [](const grid& g, const nb::object& ijk) { return convert(index_call, g, ijk); }, nb::arg("ijk"),
            nb::sig(index_call.signature),
            "The place of voxels (n, 3), columns x, y, z, in the memory of an array of the grid: (k * ny + j) * nx + "
            "i,\n"
            "int64. Raises IndexError for a voxel outside of the grid.\n"
            "Example: ``values.reshape(-1)[grid.index(voxels)]``")
        .def(
            "to_xyz", [](const grid& g, const nb::object& ijk) { return convert(to_xyz_call, g, ijk); }, nb::arg("ijk"),
            nb::sig(to_xyz_call.signature),
            "World positions (n, 3) of the centres of voxels (n, 3), columns x, y, z: float64.\n"
            "Example: ``points = grid.to_xyz(voxels)``")
        .def(
            "to_ijk", [](const grid& g, const nb::object& xyz) { return convert(to_ijk_call, g, xyz); }, nb::arg("xyz"),
            nb::sig(to_ijk_call.signature),
            "The voxels (n, 3), columns x, y, z, in which world positions (n, 3) lie: int32; of two that share a face "
            "the\n"
            "upper one. A position outside of the grid gives a voxel outside of it. Raises ValueError for one that is "
            "not\n"
            "finite or more than 2^31 voxels away.\n"
            "Example: ``voxels = grid.to_ijk(points)``")
        .def(
            "ijk", [](const grid& g, const nb::object& dense) { return convert(ijk_call, g, dense); }, nb::arg("dense"),
            nb::sig(ijk_call.signature),
            "The voxels (n, 3), columns x, y, z, of an array (nz, ny, nx) that are not zero: int32, in the order of "
            "the\n"
            "array.\n"
            "Example: ``voxels = grid.ijk(vp.voxelize(mesh, grid))``")
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
            check_resolution(n);
            return checked(fit_longest(box_of(low, high), static_cast<int>(std::clamp<std::int64_t>(n, -1, 1 << 30))));
        },
        nb::arg("low"), nb::arg("high"), nb::arg("n"));
    m.def(
        "fit_shape",
        [](const triple_of_double& low, const triple_of_double& high, const triple_of_int& shape) {
            check_shape(shape, "resolution");
            return checked(fit(box_of(low, high), extent_of(shape)));
        },
        nb::arg("low"), nb::arg("high"), nb::arg("shape"));
    m.def(
        "fit_voxel_size",
        [](const triple_of_double& low, const triple_of_double& high, const triple_of_double& size, int padding) {
            check_voxel_size(size);
            return checked(fit_voxel_size(box_of(low, high), to_vector(size), padding));
        },
        nb::arg("low"), nb::arg("high"), nb::arg("voxel_size"), nb::arg("padding"));
}

} // namespace voxelpipe::python
