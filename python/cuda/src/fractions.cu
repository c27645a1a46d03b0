// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "on_device.cuh"

#include <bindings/parts.hpp>
#include <voxelpipe/cells/device/cells.cuh>

namespace voxelpipe::python {
namespace {

template <class Shader>
status draw_cells(const device_stream& on, const mesh_view<>& mesh, const grid& g, const cell_options& options,
                  float* out, const Shader& shader) {
    using cell_draw = draw<mesh_view<>, passthrough, Shader>;
    const current_device current(on);
    call_backend own(on);
    const auto draws = draws_of_parts<cell_draw>(mesh, std::vector<std::uint64_t>{0}, shader);
    return voxelize_cells(own.backend, draws, g, framebuffer_view<target<float, blend::replace>>::on(g.extent, out),
                          options);
}

} // namespace

status draw_fractions(const device_stream& on, const mesh_view<>& mesh, const grid& g, const cell_options& options,
                      float* out, const face_arrays& faces, const inner_arrays& inner) {
    const fraction_and_faces shader{faces.of(g, options.axis)};
    if (inner.any()) return draw_cells(on, mesh, g, options, out, fraction_and_measures{shader, inner});
    if (faces.centroids != nullptr) return draw_cells(on, mesh, g, options, out, fraction_and_face_centroids{shader});
    return draw_cells(on, mesh, g, options, out, shader);
}

} // namespace voxelpipe::python
