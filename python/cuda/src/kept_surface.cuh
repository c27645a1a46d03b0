// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces on the device, and the kernels that put them into the caller's arrays.

#include "on_device.cuh"
#include "surface_calls.hpp"

#include <bindings/parts.hpp>
#include <voxelpipe/surfaces/device/sparse_surfaces.cuh>

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

namespace voxelpipe::python {

struct put_vertices {
    const surface_vertex* from;
    grid world;
    double* positions;
    std::int32_t* cells;
    std::uint8_t* sheets;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const surface_vertex v = from[i];
        const glm::dvec3 p = position(world, v);
        positions[3 * i] = p.x;
        positions[3 * i + 1] = p.y;
        positions[3 * i + 2] = p.z;
        cells[3 * i] = v.cell.x;
        cells[3 * i + 1] = v.cell.y;
        cells[3 * i + 2] = v.cell.z;
        sheets[i] = static_cast<std::uint8_t>(v.sheet);
    }
};

template <class From, class To>
struct put_numbers {
    const From* from;
    To* to;
    VOXELPIPE_HD void operator()(std::size_t i) const { to[i] = static_cast<To>(from[i]); }
};

// `from`: null where the surface has no sources.
struct put_sources {
    const std::uint32_t* from;
    std::int64_t* to;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const std::uint32_t source = from == nullptr ? ~std::uint32_t{0} : from[i];
        to[i] = source == ~std::uint32_t{0} ? std::int64_t{-1} : std::int64_t{source};
    }
};

template <class Surface>
struct kept_surface {
    call_backend own;
    Surface made;
    explicit kept_surface(const device_stream& on) : own(on), made(own.backend) {}
};

// Queues the copies of what every surface has.
inline void put_surface(const device_stream& on, const surface<cuda_backend>& made, const grid& world,
                        const surface_arrays& to) {
    const std::size_t n = made.vertices.size();
    for_each(on, n, put_vertices{made.vertices.data(), world, to.vertices, to.cells, to.sheets});
    for_each(on, n, put_sources{made.sources.size() == 0 ? nullptr : made.sources.data(), to.sources});
    const bool has_quads = made.quads.size() != 0;
    const auto* const corners = has_quads ? reinterpret_cast<const std::uint32_t*>(made.quads.data())
                                          : reinterpret_cast<const std::uint32_t*>(made.triangles.data());
    const std::size_t indices = has_quads ? 4 * made.quads.size() : 3 * made.triangles.size();
    if (to.wide_faces != nullptr)
        for_each(on, indices, put_numbers<std::uint32_t, std::int64_t>{corners, to.wide_faces});
    else
        for_each(on, indices, put_numbers<std::uint32_t, std::uint32_t>{corners, to.faces});
}

// A result that keeps the surface, whose values put_values(surface, arrays) copies.
template <class Surface, class PutValues>
[[nodiscard]] surface_result result_of(const device_stream& on, const std::shared_ptr<kept_surface<Surface>>& kept,
                                       const grid& world, const status& s, const PutValues& put_values) {
    surface_result r;
    r.result = s;
    if (!s.ok()) return r;
    r.num_vertices = kept->made.vertices.size();
    const bool has_quads = kept->made.quads.size() != 0;
    r.num_corners = has_quads ? 4 : 3;
    r.num_faces = has_quads ? kept->made.quads.size() : kept->made.triangles.size();
    r.copy = [kept, on, world, put_values](const surface_arrays& to) {
        const current_device again(on);
        put_surface(on, kept->made, world, to);
        put_values(kept->made, to);
        wait(on);
    };
    return r;
}

// As the CPU's module does: samples lie in bricks, those of a level in a grid.
template <class Draws, class Surface>
[[nodiscard]] status remesh_by_level(cuda_backend& backend, const Draws& draws, const grid& g, Surface& made,
                                     const remesh_options& options) {
    return options.level == 0 ? remesh_sparse(backend, draws, g, made, options)
                              : remesh(backend, draws, g, made, options);
}

} // namespace voxelpipe::python
