// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cut cells of what programs make of meshes, lines or points (voxelpipe/programs).

#include <voxelpipe/cells/cells.hpp>
#include <voxelpipe/programs/program_call.hpp>

#include <span>

namespace voxelpipe {

// As voxelize_cells of a mesh (cells.hpp, sparse_cells.hpp), of what programs make. Triangles that a tessellation
// leaves out are not counted. All triangles are in memory at once: out_of_memory for more than 2^30. Beside the errors
// of voxelize_cells: bad_level, bad_count, too_many_triangles. Waits.
template <class Backend, class Mesh, class VertexShader, class CellShader, class Amplify, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_cells(Backend& backend,
                                    std::span<const draw<Mesh, VertexShader, CellShader, Amplify>> draws, const grid& g,
                                    Output&& out, const cell_options& options = {}) {
    using types = core::program_types<Mesh, VertexShader, Amplify>;
    if constexpr (core::check_vertex_shader<Mesh, VertexShader>()) {
        if constexpr (types::result::check()) {
            if (const status s = validate(g); !s.ok()) return s;
            if (const status s = core::validate(options); !s.ok()) return s;
            if (const status s = core::validate_program_draws(draws); !s.ok()) return s;
            return core::run_at_once<true>(backend, draws, core::position_outside(g), [&](const auto& emitted) {
                return voxelize_cells(backend, emitted, g, out, options);
            });
        }
    }
    return {}; // does not compile: a static_assert has said why
}

// One mesh, or view of a mesh, points or lines.
template <class Backend, class View, class VertexShader, class Amplify, class CellShader, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_cells(Backend& backend, const View& view, const grid& g,
                                    const VertexShader& vertex_shader, const Amplify& amplify,
                                    const CellShader& cell_shader, Output&& out, const cell_options& options = {}) {
    using draw_type = draw<core::view_type_of<View>, VertexShader, CellShader, Amplify>;
    const draw_type d{core::view_of(view), vertex_shader, amplify, cell_shader};
    return voxelize_cells(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

} // namespace voxelpipe
