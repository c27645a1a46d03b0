// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "on_device.cuh"

#include <bindings/parts.hpp>
#include <voxelpipe/solid/diagnose_repair.hpp>

namespace voxelpipe::python {

status draw_solid(const device_stream& on, const mesh_view<>& mesh, const std::vector<std::uint64_t>& first_triangles,
                  const grid& g, const solid_options& options, std::uint8_t* out) {
    using mask = target<std::uint8_t, blend::replace>;
    using shader = decltype(constant(std::uint8_t{1}));
    const current_device current(on);
    call_backend own(on);
    cuda_backend& backend = own.backend;
    const auto draws =
        draws_of_parts<draw<mesh_view<>, passthrough, shader>>(mesh, first_triangles, constant(std::uint8_t{1}));
    return voxelize_solid(backend, draws, g, framebuffer_view<mask>::on(g.extent, out), options);
}

status examine_solid(const device_stream& on, const mesh_view<>& mesh,
                     const std::vector<std::uint64_t>& first_triangles, const grid& g, const solid_options& options) {
    using shader = decltype(constant(true));
    const current_device current(on);
    call_backend own(on);
    const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, shader>>(mesh, first_triangles, constant(true));
    return diagnose_repair(own.backend, draws, g, options);
}

} // namespace voxelpipe::python
