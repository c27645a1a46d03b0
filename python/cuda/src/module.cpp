// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arguments.hpp"

namespace voxelpipe::python {
namespace {

combine combine_named(const std::string& name) {
    return named<combine>("blend", name,
                          {{"mean", combine::mean},
                           {"sum", combine::sum},
                           {"min", combine::min},
                           {"max", combine::max},
                           {"last", combine::last}});
}

// (address, rows) and the number of columns of the values, then the first column and the number of a pass.
using columns_of = std::tuple<device_array, std::size_t, std::size_t, int>;

template <class T>
device_values<T> make_values(const call& c, const columns_of& values, bool per_triangle, const std::string& blend) {
    const auto& [array, columns, first, count] = values;
    const auto [address, rows] = array;
    if (rows != (per_triangle ? c.mesh.triangles.size() : c.mesh.positions.size()))
        throw nb::value_error("values need one row for each vertex, or for each triangle");
    if (count < 1 || count > (std::is_integral_v<T> ? 1 : 3) || first > columns ||
        static_cast<std::size_t>(count) > columns - first)
        throw nb::value_error("values have no such columns");
    const device_values<T> made{pointer<const T>(address), columns, first, count, per_triangle, combine_named(blend)};
    if (std::is_integral_v<T> && made.how == combine::mean) throw nb::value_error("integers have no mean");
    return made;
}

// Sizes of a list that is on the device, until copy() has put it into the caller's arrays.
template <class T>
class kept_sparse {
public:
    explicit kept_sparse(sparse_result<T>&& made) : made_(std::move(made)) {}
    [[nodiscard]] std::size_t num_voxels() const { return made_.num_voxels; }
    void copy(std::uintptr_t coordinates, std::uintptr_t values) const {
        const nb::gil_scoped_release released;
        if (coordinates != 0) made_.copy_voxels(pointer<std::int32_t>(coordinates));
        if (values != 0) made_.copy_values(pointer<T>(values));
    }
    [[nodiscard]] const status& result() const { return made_.result; }

private:
    sparse_result<T> made_;
};

template <class T>
void bind_sparse(nb::module_& m, const char* name) {
    nb::class_<kept_sparse<T>>(m, name)
        .def_prop_ro("num_voxels", &kept_sparse<T>::num_voxels)
        .def_prop_ro("counts", [](const kept_sparse<T>& kept) { return report(kept.result()); })
        .def("copy", &kept_sparse<T>::copy, nb::arg("coordinates"), nb::arg("values"));
}

template <class T, class F>
kept_sparse<T> run_sparse(const F& f) {
    const nb::gil_scoped_release released;
    return kept_sparse<T>(f());
}

void bind_dense(nb::module_& m) {
    m.def("voxelize_mask", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                              const grid_state& g, const std::string& rule, std::uintptr_t out) {
        const call c = make_call(on, positions, triangles, g);
        const coverage covered = coverage_named(rule);
        return run([&] { return draw_mask(c.on, c.mesh, c.where, covered, pointer<std::uint8_t>(out)); });
    });
    m.def("voxelize_bits", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                              const grid_state& g, const std::string& rule, std::uintptr_t out) {
        const call c = make_call(on, positions, triangles, g);
        const coverage covered = coverage_named(rule);
        return run([&] { return draw_bits(c.on, c.mesh, c.where, covered, pointer<std::uint32_t>(out)); });
    });
    m.def("solid_mask",
          [](const stream_of& on, const device_array& positions, const device_array& triangles,
             const std::vector<std::uint64_t>& first_triangles, const grid_state& g, const std::string& fill,
             const std::string& extent, const std::string& repair_name, const std::string& bodies_name,
             std::optional<std::uint64_t> max_hole_edges, int closing, std::uintptr_t out) {
              const call c = make_call(on, positions, triangles, g);
              const solid_options options =
                  solid_options_named(fill, extent, repair_name, bodies_name, max_hole_edges, closing);
              return report_solid(unlocked([&] {
                  return draw_solid(c.on, c.mesh, first_triangles, c.where, options, pointer<std::uint8_t>(out));
              }));
          });
    m.def("diagnose_repair", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                                const std::vector<std::uint64_t>& first_triangles, const grid_state& g,
                                const std::string& bodies_name, int closing) {
        const call c = make_call(on, positions, triangles, g);
        const solid_options options =
            solid_options_named("nonzero", "outer", "exterior", bodies_name, std::nullopt, closing);
        return report_flood(unlocked([&] { return examine_solid(c.on, c.mesh, first_triangles, c.where, options); }));
    });
    m.def("bake_float", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                           const grid_state& g, const std::string& rule, const columns_of& values, bool per_triangle,
                           const std::string& blend, float fill, std::uintptr_t out) {
        const call c = make_call(on, positions, triangles, g);
        const coverage covered = coverage_named(rule);
        const auto v = make_values<float>(c, values, per_triangle, blend);
        return run([&] { return bake(c.on, c.mesh, c.where, covered, v, fill, pointer<float>(out)); });
    });
    m.def("bake_integer", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                             const grid_state& g, const std::string& rule, const columns_of& values, bool per_triangle,
                             const std::string& blend, std::int64_t fill, std::uintptr_t out) {
        const call c = make_call(on, positions, triangles, g);
        const coverage covered = coverage_named(rule);
        const auto v = make_values<std::int64_t>(c, values, per_triangle, blend);
        return run([&] { return bake(c.on, c.mesh, c.where, covered, v, fill, pointer<std::int64_t>(out)); });
    });
}

void bind_lists(nb::module_& m) {
    bind_sparse<float>(m, "SparseFloats");
    bind_sparse<std::int64_t>(m, "SparseIntegers");
    m.def("sparse_voxels", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                              const grid_state& g, const std::string& rule) {
        const call c = make_call(on, positions, triangles, g);
        const coverage covered = coverage_named(rule);
        return run_sparse<float>([&] { return list_voxels(c.on, c.mesh, c.where, covered); });
    });
    m.def("sparse_float",
          [](const stream_of& on, const device_array& positions, const device_array& triangles, const grid_state& g,
             const std::string& rule, const columns_of& values, bool per_triangle, const std::string& blend) {
              const call c = make_call(on, positions, triangles, g);
              const coverage covered = coverage_named(rule);
              const auto v = make_values<float>(c, values, per_triangle, blend);
              return run_sparse<float>([&] { return bake_sparse(c.on, c.mesh, c.where, covered, v); });
          });
    m.def("sparse_integer",
          [](const stream_of& on, const device_array& positions, const device_array& triangles, const grid_state& g,
             const std::string& rule, const columns_of& values, bool per_triangle, const std::string& blend) {
              const call c = make_call(on, positions, triangles, g);
              const coverage covered = coverage_named(rule);
              const auto v = make_values<std::int64_t>(c, values, per_triangle, blend);
              return run_sparse<std::int64_t>([&] { return bake_sparse(c.on, c.mesh, c.where, covered, v); });
          });
    nb::class_<fragment_lists>(m, "FragmentLists")
        .def_ro("num_voxels", &fragment_lists::num_voxels)
        .def_ro("num_fragments", &fragment_lists::num_fragments)
        .def_prop_ro("counts", [](const fragment_lists& lists) { return report(lists.result); })
        .def("copy", [](const fragment_lists& lists, std::uintptr_t coordinates, std::uintptr_t offsets,
                        std::uintptr_t triangles, std::uintptr_t weights) {
            const nb::gil_scoped_release released;
            lists.copy(pointer<std::int32_t>(coordinates), pointer<std::int64_t>(offsets),
                       pointer<std::uint32_t>(triangles), pointer<float>(weights));
        });
    m.def("fragments", [](const stream_of& on, const device_array& positions, const device_array& triangles,
                          const grid_state& g, const std::string& rule) {
        const call c = make_call(on, positions, triangles, g);
        const coverage covered = coverage_named(rule);
        const nb::gil_scoped_release released;
        return list_fragments(c.on, c.mesh, c.where, covered);
    });
}

} // namespace
} // namespace voxelpipe::python

NB_MODULE(_cuda, m) {
    m.doc() = "The part of voxelpipe that runs on GPUs. voxelpipe/_device.py prepares its arrays; use voxelpipe.";
    voxelpipe::python::bind_dense(m);
    voxelpipe::python::bind_lists(m);
    voxelpipe::python::bind_fields(m);
    voxelpipe::python::bind_surfaces(m);
}
