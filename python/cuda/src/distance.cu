// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "on_device.cuh"

#include <bindings/nearest.hpp>
#include <bindings/parts.hpp>
#include <voxelpipe/distance/device/distance.cuh>
#include <voxelpipe/distance/device/distance_at.cuh>

#include <span>

namespace voxelpipe::python {
namespace {

using distance_draw = draw<mesh_view<>, passthrough, distance>;
using nearest_draw = draw<mesh_view<>, passthrough, distance_and_nearest>;

} // namespace

status draw_distance(const device_stream& on, const mesh_view<>& mesh,
                     const std::vector<std::uint64_t>& first_triangles, const grid& g, const distance_options& options,
                     float* out, std::int64_t* nearest) {
    const current_device current(on);
    call_backend own(on);
    cuda_backend& backend = own.backend;
    const glm::ivec3 extent = (options.sample == sample::corner ? g.at_corners() : g).extent;
    if (nearest != nullptr) {
        const auto draws = draws_of_parts<nearest_draw>(mesh, first_triangles, distance_and_nearest{});
        return voxelize_distance(backend, draws, g, framebuffer_view<distances, numbers>::on(extent, out, nearest),
                                 options);
    }
    const auto draws = draws_of_parts<distance_draw>(mesh, first_triangles, distance{});
    return voxelize_distance(backend, draws, g, framebuffer_view<distances>::on(extent, out), options);
}

status measure_points(const device_stream& on, const mesh_view<>& mesh,
                      const std::vector<std::uint64_t>& first_triangles, const grid& g,
                      array_view<const glm::vec3> points, const distance_options& options, const distance_arrays& out) {
    const current_device current(on);
    call_backend own(on);
    const auto draws = draws_of_parts<distance_draw>(mesh, first_triangles, distance{});
    return distance_at(own.backend, std::span<const distance_draw>(draws), g, points, out, options);
}

} // namespace voxelpipe::python
