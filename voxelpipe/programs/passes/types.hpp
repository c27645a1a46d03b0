// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// What calls with programs are made of, known before any of them runs: the types between the stages, the shaders of
// emitted meshes, and the checks of draws and counts.

#include <voxelpipe/programs/passes/passes.hpp>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// The input of a geometry program for elements of a view.
template <int K>
struct input_of_size;
template <>
struct input_of_size<1> {
    template <class V>
    using type = point<V>;
};
template <>
struct input_of_size<2> {
    template <class V>
    using type = line<V>;
};
template <>
struct input_of_size<3> {
    template <class V>
    using type = triangle<V>;
};

template <class Mesh, class VertexShader, class Amplify>
struct program_types {
    static constexpr int size = elements_of<Mesh>::size;
    template <class V>
    using input = typename input_of_size<size>::template type<V>;
    using shaded_varyings = typename shaded<Mesh, VertexShader>::varyings;
    using result = amplified<Amplify, input, shaded_varyings>;
    using varyings = typename result::template varyings<>;
};

// Gives a fragment the numbers of the whole call: a surface's, or a distance's, which has some within the band alone.
// `origins`: input primitive of each triangle of the mesh that is drawn.
template <class FragmentShader>
struct origin_shader {
    FragmentShader shader;
    const std::uint32_t* origins;
    std::uint32_t each; // input primitives of an instance
    std::uint32_t draw, first_primitive;
    const std::uint32_t* moved = nullptr; // added to the primitives, in the backend's memory; null: nothing

    VOXELPIPE_ANY_CALLABLE
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& drawn) const {
        Fragment f = drawn;
        if constexpr (requires { drawn.in_band; })
            if (!drawn.in_band) return shader(f);
        const std::uint32_t origin = origins[drawn.triangle];
        f.triangle = origin % each;
        f.instance = origin / each;
        f.draw = draw;
        f.primitive = drawn.primitive + first_primitive + (moved != nullptr ? *moved : 0);
        return shader(f);
    }
};

// A draw's shader for its emitted meshes. Shaders that give constants, and solids' shaders, need neither varyings nor
// numbers, and are drawn by the code that draws other meshes.
template <class FragmentShader, class V, bool IsPlain>
struct emitted_shader {
    using type = origin_shader<FragmentShader>;
    using stored = V;
};
template <class FragmentShader, class V>
struct emitted_shader<FragmentShader, V, true> {
    using type = FragmentShader;
    using stored = no_varyings;
};

// A position whose voxels lie before the grid on every axis, for triangles that are left out.
[[nodiscard]] inline glm::vec3 position_outside(const grid& g) {
    glm::vec3 p(0.0f);
    for (int a = 0; a < 3; ++a) {
        double distance = 4.0 * g.voxel_size[a];
        do {
            p[a] = static_cast<float>(g.origin[a] - distance);
            distance *= 2.0;
        } while (static_cast<double>(p[a]) > g.origin[a] - 4.0 * g.voxel_size[a] &&
                 distance < std::numeric_limits<double>::max());
    }
    return p;
}

// No position: for triangles that are left out of distances, because one outside the grid would be nearest somewhere.
inline constexpr glm::vec3 position_nowhere(std::numeric_limits<float>::quiet_NaN());

template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
[[nodiscard]] status validate_program_draws(std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws) {
    using elements = elements_of<Mesh>;
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    std::uint64_t inputs = 0;
    for (const auto& d : draws) {
        // Instances that are too many are refused below, as inputs.
        using plain = draw<typename elements::vertices_type, VertexShader, none>;
        const plain vertices{elements::vertices(d.mesh), d.vertex_shader, {}};
        if (const status s = validate_draws(std::span<const plain>(&vertices, 1)); !s.ok()) return s;
        if (!elements::has_memory(d.mesh)) return failure(status_code::null_view);
        if (vertices.mesh.part.whole != 0) return failure(status_code::bad_subset);
        const std::uint64_t each = elements::count(d.mesh);
        if (each > most || (each != 0 && d.mesh.copies.count > (most - inputs) / each)) {
            status s = failure(status_code::too_many_triangles);
            const auto all = static_cast<uint128>(each) * d.mesh.copies.count + inputs;
            s.counts.triangles_in = all > ~std::uint64_t{0} ? ~std::uint64_t{0} : static_cast<std::uint64_t>(all);
            return s;
        }
        inputs += each * d.mesh.copies.count;
    }
    return {};
}

// Names the bad triangle of a mesh; other elements have no name in a status.
template <class Backend, class Mesh, class VertexShader, class FragmentShader, class Amplify>
[[nodiscard]] status
name_bad_input(Backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws, status s) {
    if constexpr (is_mesh_view<Mesh>) {
        std::vector<draw<Mesh, VertexShader, none>> plain;
        for (const auto& d : draws) plain.push_back({d.mesh, d.vertex_shader, {}});
        return name_bad_triangle(backend, std::span<const draw<Mesh, VertexShader, none>>(plain), s);
    } else {
        return s;
    }
}

// What was found wrong while the triangles were counted.
[[nodiscard]] inline status check_counts(const std::vector<std::uint64_t>& counts, std::uint64_t total) {
    const auto has = [&](program_count c) { return counts[index_of(c)] != 0; };
    status s;
    if (has(program_count::bad_index))
        s = failure(status_code::index_out_of_range, stage::vertex_shade);
    else if (has(program_count::bad_level))
        s = failure(status_code::bad_level, stage::vertex_shade);
    else if (has(program_count::bad_count))
        s = failure(status_code::bad_count, stage::vertex_shade);
    else if (total > std::numeric_limits<std::uint32_t>::max())
        s = failure(status_code::too_many_triangles, stage::vertex_shade);
    s.counts.triangles_in = total;
    return s;
}

// True if the emitted triangles hold those that a tessellation leaves out. They are no input of a geometry program.
template <class Amplify>
inline constexpr bool counts_left_out = true;
template <class Tessellation, class Geometry>
inline constexpr bool counts_left_out<tessellate_then_geometry<Tessellation, Geometry>> = false;

// Triangles that are left out lie outside of the grid, and are none of those that are counted there.
[[nodiscard]] inline status without_left_out(status s, std::uint64_t left_out) {
    s.counts.triangles_in -= std::min(s.counts.triangles_in, left_out);
    s.counts.triangles_outside -= std::min(s.counts.triangles_outside, left_out);
    return s;
}
// As without_left_out, for triangles at position_nowhere.
[[nodiscard]] inline status without_left_out_nowhere(status s, std::uint64_t left_out) {
    s.counts.triangles_in -= std::min(s.counts.triangles_in, left_out);
    s.counts.triangles_nonfinite -= std::min(s.counts.triangles_nonfinite, left_out);
    return s;
}

// Checks of a call, as check_shaders: one readable line for the first mistake.
template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
[[nodiscard]] constexpr bool check_program() {
    if constexpr (check_vertex_shader<Mesh, VertexShader>()) {
        using types = program_types<Mesh, VertexShader, Amplify>;
        if constexpr (types::result::check()) {
            using fragment_type = fragment<typename types::varyings>;
            constexpr bool copyable = std::is_trivially_copyable_v<FragmentShader>;
            static_assert(copyable, "voxelpipe: a fragment shader must be trivially copyable");
            constexpr bool callable = std::is_invocable_v<const FragmentShader&, const fragment_type&>;
            static_assert(callable,
                          "voxelpipe: the fragment shader cannot be called with const fragment<Varyings>& (is its "
                          "operator() const, and does it take the varyings that the program makes?)");
            if constexpr (copyable && callable) {
                using result = std::remove_cvref_t<std::invoke_result_t<const FragmentShader&, const fragment_type&>>;
                static_assert(is_output<result>,
                              "voxelpipe: a fragment shader must return vp::outputs(...), one value per render target");
                return is_output<result>;
            }
        }
    }
    return false;
}
template <class Mesh, class VertexShader, class FragmentShader, class Amplify>
using program_output = std::remove_cvref_t<std::invoke_result_t<
    const FragmentShader&, const fragment<typename program_types<Mesh, VertexShader, Amplify>::varyings>&>>;

} // namespace voxelpipe::core
