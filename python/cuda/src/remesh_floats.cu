// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "remesh_columns.cuh"

namespace voxelpipe::python {

surface_result make_surface_of_floats(const device_stream& on, const mesh_view<>& mesh,
                                      const std::vector<std::uint64_t>& first_triangles, const grid& g,
                                      const remesh_options& options, const grid& world, const surface_columns& values) {
    return remesh_columns<1, 0>(on, mesh, first_triangles, g, options, world, values);
}

} // namespace voxelpipe::python
