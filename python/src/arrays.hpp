// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the module's functions: arrays of NumPy as the library's views, and results that NumPy owns.

#include "report.hpp"

#include <cpu_ref/backend.hpp>

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelpipe::python {

// Arrays in host memory, C order.
template <class T, std::size_t Dimensions>
using array = nb::ndarray<T, nb::ndim<Dimensions>, nb::c_contig, nb::device::cpu>;

// A mesh as voxelpipe/_mesh.py prepares it: (v, 3) float32 and (f, 3) uint32.
using position_array = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using triangle_array = nb::ndarray<const std::uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

// Refers to the arrays.
[[nodiscard]] inline mesh_view<> view_of(const position_array& positions, const triangle_array& triangles) {
    static_assert(sizeof(glm::vec3) == 3 * sizeof(float) && sizeof(glm::uvec3) == 3 * sizeof(std::uint32_t));
    return {array_view<const glm::vec3>(reinterpret_cast<const glm::vec3*>(positions.data()), positions.shape(0)),
            array_view<const glm::uvec3>(reinterpret_cast<const glm::uvec3*>(triangles.data()), triangles.shape(0))};
}

// Throws ValueError unless a (nz, ny, nx, ...) array has the grid's shape, and rows of `columns` values. `what` names
// the argument.
template <class Array>
void expect_shape(const Array& a, const grid& g, const char* what, std::initializer_list<std::size_t> tail = {},
                  std::size_t last_axis = 0) {
    std::vector<std::size_t> wanted{static_cast<std::size_t>(g.extent.z), static_cast<std::size_t>(g.extent.y),
                                    last_axis != 0 ? last_axis : static_cast<std::size_t>(g.extent.x)};
    wanted.insert(wanted.end(), tail);
    expect_shape(std::vector<std::size_t>(a.shape_ptr(), a.shape_ptr() + a.ndim()), wanted, what);
}

// An array of NumPy that owns `values`.
template <class Container>
[[nodiscard]] nb::object to_numpy(Container&& values, std::initializer_list<std::size_t> shape) {
    using owned = std::remove_cvref_t<Container>;
    using element = std::remove_cvref_t<decltype(*values.data())>;
    auto* const kept = new owned(std::forward<Container>(values));
    nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<owned*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, element>(kept->data(), shape, owner));
}

void bind_grid(nb::module_& m);
void bind_surface(nb::module_& m);
void bind_solid(nb::module_& m);
void bind_distance(nb::module_& m);
void bind_remesh(nb::module_& m);
void bind_fractions(nb::module_& m);
void bind_label(nb::module_& m);
void bind_links(nb::module_& m);
void bind_sparse_float(nb::module_& m);
void bind_sparse_fractions(nb::module_& m);
void bind_sparse_integer(nb::module_& m);
void bind_files(nb::module_& m);
void bind_lists(nb::module_& m);
void bind_octree(nb::module_& m);
void bind_scene(nb::module_& m);

} // namespace voxelpipe::python
