// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the bindings of the module for GPUs: arrays, streams, meshes and grids as voxelpipe/_device.py gives them.

#include "../../src/grid_state.hpp"
#include "device_calls.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstdint>
#include <tuple>

namespace voxelpipe::python {

// (address, rows) of an array in the device's memory, as voxelpipe/_device.py takes it from the caller's array, which
// lives longer than the call.
using device_array = std::tuple<std::uintptr_t, std::size_t>;

template <class T>
[[nodiscard]] T* pointer(std::uintptr_t address) {
    return reinterpret_cast<T*>(address);
}

// The mesh, grid and stream of a call.
struct call {
    device_stream on;
    mesh_view<> mesh;
    grid where;
};
using stream_of = std::tuple<int, std::uintptr_t>; // device, cudaStream_t

[[nodiscard]] inline call make_call(const stream_of& on, const device_array& positions, const device_array& triangles,
                                    const grid_state& state) {
    const auto [positions_at, num_positions] = positions;
    const auto [triangles_at, num_triangles] = triangles;
    return {{std::get<0>(on), std::get<1>(on)},
            {array_view<const glm::vec3>(pointer<const glm::vec3>(positions_at), num_positions),
             array_view<const glm::uvec3>(pointer<const glm::uvec3>(triangles_at), num_triangles)},
            grid_of(state)};
}

// Runs a call without Python's lock; f returns its status.
template <class F>
[[nodiscard]] status unlocked(const F& f) {
    const nb::gil_scoped_release released;
    return f();
}

// The same; returns the counters.
template <class F>
[[nodiscard]] nb::dict run(const F& f) {
    return report(unlocked(f));
}

void bind_fields(nb::module_& m);
void bind_surfaces(nb::module_& m);

} // namespace voxelpipe::python
