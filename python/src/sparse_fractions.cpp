// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse.hpp"

#include <voxelpipe/cells/sparse_cells.hpp>

#include <nanobind/stl/optional.h>

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::python {
namespace {

template <class T>
using cell_target = target<T, blend::replace>;
// In the order of `cell_names`.
using cell_bricks = sparse_framebuffer<cpu_backend, cell_target<float>, cell_target<glm::vec3>, cell_target<double>,
                                       cell_target<glm::vec3>, cell_target<std::uint8_t>>;
using cell_outputs = output<float, glm::vec3, double, glm::vec3, std::uint8_t>;
constexpr const char* cell_names[] = {"fraction", "centroid", "area", "area_centroid", "multi_cut"};
constexpr std::size_t num_cell_names = std::size(cell_names);

// Cell shaders whose untouched voxels become tiles: of the fraction alone, and of all that is measured in a voxel.
struct listed_fraction {
    static constexpr bool ignores_voxel = true;
    cell_outputs operator()(const cell_fragment& f) const {
        return outputs(f.fraction, glm::vec3(0), 0.0, glm::vec3(0), std::uint8_t{0});
    }
};
struct listed_measures {
    static constexpr bool ignores_voxel = true;
    using fragment = measured_cell<cell_value::centroid, cell_value::area, cell_value::sheets>;
    cell_outputs operator()(const fragment& f) const {
        return outputs(f.fraction, f.centroid, f.area, f.area_centroid, std::uint8_t{f.is_multi_cut});
    }
};

template <class Shader>
status draw_cells_into(cell_bricks& fb, cpu_backend& backend, const mesh_view<>& m, const grid& g,
                       const cell_options& options) {
    const std::vector<draw<mesh_view<>, passthrough, Shader>> draws{{m, {}, {}}};
    return voxelize_cells(backend, draws, g, fb, options);
}

// A target's values from the number `first` to `last`, as an array of NumPy.
template <class T>
nb::object values_between(const T* values, std::size_t first, std::size_t last) {
    std::vector<T> part(values + first, values + last);
    if constexpr (std::is_same_v<T, glm::vec3>) {
        std::vector<float> numbers(3 * part.size());
        if (!part.empty()) std::memcpy(numbers.data(), part.data(), numbers.size() * sizeof(float));
        return to_numpy(std::move(numbers), {part.size(), 3});
    } else {
        const std::size_t n = part.size();
        return to_numpy(std::move(part), {n});
    }
}

// (voxels (n, 3), their values by name, cubes (m, 4), their values by name, counters) of all triangles together. A cube
// is its first voxel and its side. `wanted` are some of cell_names.
nb::tuple list_fractions(const position_array& positions, const triangle_array& triangles, const grid& g,
                         const std::vector<std::string>& wanted, bool close_holes,
                         std::optional<std::uint64_t> max_hole_edges, unsigned threads) {
    cell_options options;
    if (close_holes) options.repair = repair::close_holes;
    if (max_hole_edges) options.max_hole_edges = *max_hole_edges;
    std::bitset<num_cell_names> enabled;
    for (const std::string& name : wanted) {
        std::size_t i = 0;
        while (i < num_cell_names && name != cell_names[i]) ++i;
        if (i == num_cell_names) throw nb::value_error(("nothing in a voxel is called '" + name + "'").c_str());
        enabled[i] = true;
    }
    const bool measures = (enabled >> 1).any();
    if (enabled.none()) enabled[0] = true; // one target there has to be
    cpu_backend backend{threads};
    cell_bricks fb{backend, g.extent, enabled};
    status s;
    std::vector<std::int32_t> voxels, cubes;
    {
        const nb::gil_scoped_release released;
        const mesh_view<> m = view_of(positions, triangles);
        s = measures ? draw_cells_into<listed_measures>(fb, backend, m, g, options)
                     : draw_cells_into<listed_fraction>(fb, backend, m, g, options);
        if (s.ok()) {
            const brick_table table = fb.view().table;
            voxels = coordinates_of(table, false);
            cubes = cubes_of(table);
        }
    }
    nb::dict counts = report_cells(s);
    const std::size_t n = voxels.size() / 3, m = cubes.size() / 4;
    nb::dict of_voxels, of_cubes;
    core::for_each_index<num_cell_names>([&]<std::size_t I>() {
        if (!enabled[I]) return;
        const auto* const values = get<I>(fb.contents().values).data();
        of_voxels[cell_names[I]] = values_between(values, 0, n);
        of_cubes[cell_names[I]] = values_between(values, n, n + m);
    });
    return nb::make_tuple(to_numpy(std::move(voxels), {n, 3}), of_voxels, to_numpy(std::move(cubes), {m, 4}), of_cubes,
                          counts);
}

} // namespace

void bind_sparse_fractions(nb::module_& m) {
    m.def("sparse_fractions", &list_fractions, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"),
          nb::arg("of"), nb::arg("close_holes"), nb::arg("max_hole_edges").none(), nb::arg("threads"));
}

} // namespace voxelpipe::python
