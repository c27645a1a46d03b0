// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "kept_surface.cuh"

namespace voxelpipe::python {

surface_result make_surface(const device_stream& on, const mesh_view<>& mesh,
                            const std::vector<std::uint64_t>& first_triangles, const grid& g,
                            const remesh_options& options, const grid& world) {
    const current_device current(on);
    const auto kept = std::make_shared<kept_surface<surface<cuda_backend>>>(on);
    const auto draws = draws_of_parts<draw<mesh_view<>, passthrough, none>>(mesh, first_triangles, none{});
    const status s = remesh_by_level(kept->own.backend, draws, g, kept->made, options);
    return result_of(on, kept, world, s, [](const surface<cuda_backend>&, const surface_arrays&) {});
}

} // namespace voxelpipe::python
