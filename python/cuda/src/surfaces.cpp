// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "../../src/surface_options.hpp"
#include "arguments.hpp"
#include "surface_calls.hpp"

// Functions that make surfaces and components of voxels.

namespace voxelpipe::python {
namespace {

// Sizes of a surface that is on the device, until copy() has put it into the caller's arrays.
class kept_arrays {
public:
    explicit kept_arrays(surface_result&& made) : made_(std::move(made)) {}
    [[nodiscard]] const surface_result& made() const { return made_; }
    [[nodiscard]] nb::dict counts() const { return report_surface(made_.result); }
    // The addresses of vertices, faces, cells, sheets and sources; of floats and integers with their columns, 0
    // without.
    void copy(const std::array<std::uintptr_t, 5>& arrays, bool wide, const device_array& floats,
              const device_array& integers) const {
        surface_arrays to;
        to.vertices = pointer<double>(arrays[0]);
        if (wide)
            to.wide_faces = pointer<std::int64_t>(arrays[1]);
        else
            to.faces = pointer<std::uint32_t>(arrays[1]);
        to.cells = pointer<std::int32_t>(arrays[2]);
        to.sheets = pointer<std::uint8_t>(arrays[3]);
        to.sources = pointer<std::int64_t>(arrays[4]);
        to.floats = pointer<float>(std::get<0>(floats));
        to.num_floats = std::get<1>(floats);
        to.integers = pointer<std::int64_t>(std::get<0>(integers));
        to.num_integers = std::get<1>(integers);
        const nb::gil_scoped_release released;
        made_.copy(to);
    }

private:
    surface_result made_;
};

class kept_labels {
public:
    explicit kept_labels(label_result&& made) : made_(std::move(made)) {}
    [[nodiscard]] std::uint64_t count() const {
        (void)report(made_.result); // throws where the call failed
        return made_.result.label.components;
    }
    void copy(std::uintptr_t names, std::uintptr_t voxels, std::uintptr_t lowest, std::uintptr_t highest) const {
        const nb::gil_scoped_release released;
        made_.copy(pointer<std::int64_t>(names), pointer<std::int64_t>(voxels), pointer<std::int32_t>(lowest),
                   pointer<std::int32_t>(highest));
    }

private:
    label_result made_;
};

template <class F>
kept_arrays keep(const F& f) {
    const nb::gil_scoped_release released;
    return kept_arrays(f());
}

// Addresses and columns of values of vertices and of triangles.
using value_arrays = std::tuple<device_array, device_array>;
template <class T>
value_columns<T> columns_of(const value_arrays& arrays, std::size_t most) {
    const auto& [vertices, triangles] = arrays;
    const value_columns<T> made{pointer<const T>(std::get<0>(vertices)), pointer<const T>(std::get<0>(triangles)),
                                std::get<1>(vertices), std::get<1>(triangles)};
    if (made.num_of_vertices > most || made.num_of_triangles > most - made.num_of_vertices)
        throw nb::value_error("too many columns of values");
    return made;
}

void bind_remesh_there(nb::module_& m) {
    nb::class_<kept_arrays>(m, "Surface")
        .def_prop_ro("num_vertices", [](const kept_arrays& k) { return k.made().num_vertices; })
        .def_prop_ro("num_faces", [](const kept_arrays& k) { return k.made().num_faces; })
        .def_prop_ro("num_corners", [](const kept_arrays& k) { return k.made().num_corners; })
        .def_prop_ro("counts", &kept_arrays::counts)
        .def("copy", &kept_arrays::copy);
    m.def("remesh", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                       const std::vector<std::uint64_t>& first_triangles, const grid_state& g, const grid_state& world,
                       bool corners, const std::string& sign, const std::string& repair_name,
                       const std::string& bodies_name, std::optional<std::uint64_t> max_hole_edges, int closing,
                       const std::string& place_name, double level, bool open, bool quads, std::uint32_t min_component,
                       bool embedded, const value_arrays& floats, const value_arrays& integers) {
        const call c = make_call(on, positions, triangles, g);
        const remesh_options options =
            remesh_options_named(sign, repair_name, bodies_name, max_hole_edges, closing, place_name, level, corners,
                                 open, quads, min_component, embedded);
        const grid placed = corners ? grid_of(world).at_corners() : grid_of(world);
        const surface_columns values{columns_of<float>(floats, most_floats),
                                     columns_of<std::int64_t>(integers, most_integers)};
        return keep([&] {
            if (values.floats.count() == 0 && values.integers.count() == 0)
                return make_surface(c.on, c.mesh, first_triangles, c.where, options, placed);
            return values.floats.count() <= 4 && values.integers.count() == 0
                       ? make_surface_of_floats(c.on, c.mesh, first_triangles, c.where, options, placed, values)
                       : make_surface_of_columns(c.on, c.mesh, first_triangles, c.where, options, placed, values);
        });
    });
}

// The grid of an array's samples; throws ValueError where that has another shape.
grid samples_of(const grid_state& state, bool corners, const std::vector<std::size_t>& shape) {
    const grid g = corners ? grid_of(state).at_corners() : grid_of(state);
    expect_shape(shape,
                 {static_cast<std::size_t>(g.extent.z), static_cast<std::size_t>(g.extent.y),
                  static_cast<std::size_t>(g.extent.x)},
                 "the array");
    return g;
}

void bind_extract_there(nb::module_& m) {
    m.def("extract_bits", [](const stream_of& on, std::uintptr_t values, const std::vector<std::size_t>& shape,
                             const grid_state& state, bool corners, const std::string& place_name, bool open,
                             bool quads, std::uint32_t min_component, bool embedded) {
        const grid g = samples_of(state, corners, shape);
        const extract_options options = extract_options_named(place_name, 0.0, open, quads, min_component, embedded);
        const device_stream where{std::get<0>(on), std::get<1>(on)};
        return keep([&] { return extract_mask(where, pointer<const std::uint8_t>(values), g, options); });
    });
    m.def("extract_field", [](const stream_of& on, std::uintptr_t values, const std::vector<std::size_t>& shape,
                              const grid_state& state, bool corners, const std::string& place_name, double level,
                              bool open, bool quads, std::uint32_t min_component, bool embedded) {
        const grid g = samples_of(state, corners, shape);
        const extract_options options = extract_options_named(place_name, level, open, quads, min_component, embedded);
        const device_stream where{std::get<0>(on), std::get<1>(on)};
        return keep([&] { return extract_field(where, pointer<const float>(values), g, options); });
    });
}

void bind_label_there(nb::module_& m) {
    nb::class_<kept_labels>(m, "Components").def_prop_ro("count", &kept_labels::count).def("copy", &kept_labels::copy);
    m.def("label", [](const stream_of& on, std::uintptr_t values, const triple_of_int& shape, int connectivity,
                      bool wants_list, std::uintptr_t labels, bool wide) {
        label_arrays out;
        if (wide)
            out.wide_labels = pointer<std::int64_t>(labels);
        else
            out.labels = pointer<std::int32_t>(labels);
        const device_stream where{std::get<0>(on), std::get<1>(on)};
        const nb::gil_scoped_release released;
        return kept_labels(
            label_mask(where, pointer<const std::uint8_t>(values), extent_of(shape), connectivity, wants_list, out));
    });
}

} // namespace

void bind_surfaces(nb::module_& m) {
    bind_remesh_there(m);
    bind_extract_there(m);
    bind_label_there(m);
}

} // namespace voxelpipe::python
