// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distances from what programs make of meshes, lines or points (voxelpipe/programs).

#include <voxelpipe/distance/distance.hpp>
#include <voxelpipe/programs/program_call.hpp>

#include <span>
#include <type_traits>

namespace voxelpipe {
namespace core {

// True where program and shaders fit; otherwise one readable line says why not.
template <class Mesh, class VertexShader, class DistanceShader, class Amplify>
[[nodiscard]] constexpr bool check_distance_program() {
    if constexpr (check_vertex_shader<Mesh, VertexShader>()) {
        using types = program_types<Mesh, VertexShader, Amplify>;
        if constexpr (types::result::check()) {
            using fragment_type = distance_fragment<typename types::varyings>;
            constexpr bool callable = std::is_invocable_v<const DistanceShader&, const fragment_type&>;
            static_assert(callable, "voxelpipe: the distance's shader cannot be called with const "
                                    "distance_fragment<Varyings>& (is its operator() const, and does it take the "
                                    "varyings that the program makes?)");
            return callable;
        }
    }
    return false;
}

} // namespace core

// As voxelize_distance of a mesh (distance.hpp, sparse_distance.hpp), of what programs make. Fragments within the band
// have the number of the input primitive (triangle), its instance and draw; `primitive` numbers the triangles that the
// programs make. Triangles that a tessellation leaves out have no distance and are not counted. All triangles are in
// memory at once: out_of_memory for more than 2^30. Beside the errors of voxelize_distance: bad_level, bad_count,
// too_many_triangles. Waits.
template <class Backend, class Mesh, class VertexShader, class DistanceShader, class Amplify, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_distance(Backend& backend,
                                       std::span<const draw<Mesh, VertexShader, DistanceShader, Amplify>> draws,
                                       const grid& g, Output&& out, const distance_options& options = {}) {
    if constexpr (core::check_distance_program<Mesh, VertexShader, DistanceShader, Amplify>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g); !s.ok()) return s;
        if (const status s = core::validate_program_draws(draws); !s.ok()) return s;
        return core::run_at_once<false>(backend, draws, core::position_nowhere, [&](const auto& emitted) {
            return voxelize_distance(backend, emitted, g, out, options);
        });
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// One mesh, or view of a mesh, points or lines.
template <class Backend, class View, class VertexShader, class Amplify, class DistanceShader, class Output>
requires core::is_amplifier<Amplify>
[[nodiscard]] status voxelize_distance(Backend& backend, const View& view, const grid& g,
                                       const VertexShader& vertex_shader, const Amplify& amplify,
                                       const DistanceShader& distance_shader, Output&& out,
                                       const distance_options& options = {}) {
    using draw_type = draw<core::view_type_of<View>, VertexShader, DistanceShader, Amplify>;
    const draw_type d{core::view_of(view), vertex_shader, amplify, distance_shader};
    return voxelize_distance(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

} // namespace voxelpipe
