// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Vertex and fragment shaders: plain functors, checked when the pipeline is instantiated (paper section 3).
//
//   vertex shader    vertex_output<Varyings> operator()(const vertex<Attributes...>&) const   (or a bare glm::vec3)
//   fragment shader  output<T...> operator()(const fragment<Varyings>&) const                 one value per render
//   target
// A shader for the device only, __device__ without __host__, as one that reads texture objects, spells its result:
//   __device__ vp::output<glm::vec3, float> operator()(const vp::fragment<Varyings>&) const
// because the host compiler, which has to know the type, does not see the body.
//
// Both are copied to where they run and called from many threads: const, trivially copyable, no side effects.

#include <voxelpipe/core/interpolate.hpp>
#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/mesh.hpp>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

struct no_varyings {}; // of shaders that need none

// ---- vertex shader --------------------------------------------------------------------------------------------------

// What a vertex shader gets.
template <class... Attributes>
struct vertex {
    std::uint32_t index;                  // in its mesh
    std::uint32_t draw;                   // number of the draw in the call
    glm::vec3 position;                   // as in the mesh
    core::pack<Attributes...> attributes; // the mesh's, in order: get<I>(v)
    std::uint32_t instance = 0;           // number of the mesh's copy
};

// Attribute I of the vertex.
template <std::size_t I, class... Attributes>
[[nodiscard]] VOXELPIPE_HD constexpr const auto& get(const vertex<Attributes...>& v) {
    return get<I>(v.attributes);
}

// What a vertex shader returns: a position, and what is interpolated over the triangle.
template <class Varyings = no_varyings>
struct vertex_output {
    glm::vec3 position;  // world space
    Varyings varyings{}; // at most 12 floats, glm::vec2 to vec4, std::array<float, N> or flat<T>
};
template <class Varyings>
vertex_output(glm::vec3, Varyings) -> vertex_output<Varyings>;

// Returns positions unchanged; no varyings.
struct passthrough {
    // The position as it is.
    template <class Vertex>
    VOXELPIPE_HD glm::vec3 operator()(const Vertex& v) const {
        return v.position;
    }
};

// Affine transform of a position, p.x * c0 + p.y * c1 + p.z * c2 + c3, as three fused steps per component.
[[nodiscard]] VOXELPIPE_HD inline glm::vec3 transform_point(const glm::mat4& m, const glm::vec3& p) {
    const auto row = [&](int i) {
        return exact::fma(m[2][i], p.z, exact::fma(m[1][i], p.y, exact::fma(m[0][i], p.x, m[3][i])));
    };
    return {row(0), row(1), row(2)};
}

// Transforms a mesh by an affine matrix (last row 0 0 0 1); no varyings.
struct transform {
    glm::mat4 matrix{1.0f}; // columns as in glm
    // The transformed position.
    template <class Vertex>
    VOXELPIPE_HD glm::vec3 operator()(const Vertex& v) const {
        return transform_point(matrix, v.position);
    }
};

// ---- fragment shader ------------------------------------------------------------------------------------------------

// One triangle in one voxel. Barycentrics and varyings are evaluated at the centre of the voxel's column along the
// triangle's dominant axis, projected onto the triangle's plane. They extrapolate if that centre lies outside the
// triangle; the clamped variants lie on it.
template <class Varyings = no_varyings>
struct fragment {
    std::uint32_t triangle;  // in its mesh
    std::uint32_t draw;      // number of the draw in the call
    std::uint32_t instance;  // number of the mesh's copy
    std::uint32_t primitive; // numbered by draw, instance, triangle: the order of replace and of A-buffers
    int axis;                // dominant axis: 0 x, 1 y, 2 z
    bool front_facing;       // counter-clockwise seen from +infinity on the dominant axis; true if the area is zero
    glm::ivec3 voxel;        // index in the whole grid
    glm::vec3 barycentric;   // weights of the triangle's three vertices; 1/3 each if the area is zero
    glm::vec3 normal;        // unit, world space, right-handed winding; 0 if the area is zero
    Varyings varyings;       // interpolated by `barycentric`

    const Varyings* vertex_varyings[3]; // of the triangle's vertices

    // The weights of the nearest point of the triangle.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 clamped_barycentric() const { return core::clamp_barycentric(barycentric); }
    // Varyings at the nearest point of the triangle.
    [[nodiscard]] VOXELPIPE_HD Varyings clamped_varyings() const {
        const glm::vec3 b = clamped_barycentric();
        return core::mix(*vertex_varyings[0], *vertex_varyings[1], *vertex_varyings[2], b.y, b.z);
    }
};

// The result of a fragment shader: one value per render target, in order. The fragment is discarded unless `keep`.
template <class... Ts>
struct output {
    core::pack<Ts...> values; // one per render target
    bool keep = true;         // false discards the fragment in all targets

    // The same values, discarded if `condition` holds.
    [[nodiscard]] VOXELPIPE_HD constexpr output discard_if(bool condition) const {
        return {values, keep && !condition};
    }
};

// Makes the result of a fragment shader, one value per render target. Types are the targets', without a conversion.
template <class... Ts>
[[nodiscard]] VOXELPIPE_HD constexpr output<Ts...> outputs(Ts... values) {
    return {core::make_pack(values...)};
}

// Fragment shader that returns the same values for every fragment: constant_output<bool>{true}, or constant(1.0f, 1u).
template <class... Ts>
struct constant_output {
    core::pack<Ts...> values; // one per render target
    // The same values, whatever the fragment.
    template <class Fragment>
    VOXELPIPE_HD output<Ts...> operator()(const Fragment&) const {
        return {values};
    }
};
// Makes a constant_output. A shader that is known to be constant is drawn by faster strategies.
template <class... Ts>
[[nodiscard]] constexpr constant_output<Ts...> constant(Ts... values) {
    return {core::make_pack(values...)};
}

namespace core {

template <class T>
struct vertex_result;
template <>
struct vertex_result<glm::vec3> {
    using varyings = no_varyings;
    VOXELPIPE_HD
    static vertex_output<no_varyings> widen(const glm::vec3& p) { return {p, {}}; }
};
template <class Varyings>
struct vertex_result<vertex_output<Varyings>> {
    using varyings = Varyings;
    VOXELPIPE_HD
    static const vertex_output<Varyings>& widen(const vertex_output<Varyings>& v) { return v; }
};

template <class T>
inline constexpr bool is_vertex_result = false;
template <>
inline constexpr bool is_vertex_result<glm::vec3> = true;
template <class Varyings>
inline constexpr bool is_vertex_result<vertex_output<Varyings>> = true;

template <class T>
inline constexpr bool is_output = false;
template <class... Ts>
inline constexpr bool is_output<output<Ts...>> = true;

// Output type of a fragment shader; output<> if it returns void, so that only the check of shaders reports an error.
template <class T>
using output_or_none = std::conditional_t<std::is_void_v<T>, output<>, T>;

template <class T>
inline constexpr bool is_constant = false;
template <class... Ts>
inline constexpr bool is_constant<constant_output<Ts...>> = true;

template <class Mesh>
struct mesh_vertex;
template <class... Attributes>
struct mesh_vertex<mesh_view<Attributes...>> {
    using type = vertex<Attributes...>;
};

// Output of a vertex shader for a mesh's vertices, and of a fragment shader for these; only for shaders that
// check_shaders accepts.
template <class Mesh, class VertexShader>
using shaded_vertex =
    std::remove_cvref_t<std::invoke_result_t<const VertexShader&, const typename mesh_vertex<Mesh>::type&>>;
template <class Mesh, class VertexShader>
struct shaded {
    using varyings = typename vertex_result<shaded_vertex<Mesh, VertexShader>>::varyings;
};
template <class Mesh, class VertexShader, class FragmentShader>
using shader_output = std::remove_cvref_t<
    std::invoke_result_t<const FragmentShader&, const fragment<typename shaded<Mesh, VertexShader>::varyings>&>>;

// Returns true if both shaders can be used with the mesh. Otherwise one readable line says why not: nothing that
// depends on a failed check is instantiated.
template <class Mesh, class VertexShader>
[[nodiscard]] constexpr bool check_vertex_shader() {
    using vertex_type = typename mesh_vertex<Mesh>::type;
    constexpr bool copyable = std::is_trivially_copyable_v<VertexShader>;
    static_assert(copyable, "voxelpipe: a vertex shader must be trivially copyable");
    constexpr bool callable = std::is_invocable_v<const VertexShader&, const vertex_type&>;
    static_assert(callable,
                  "voxelpipe: the vertex shader cannot be called with const vertex<Attributes...>& of this mesh "
                  "(is its operator() const, and are the mesh's attributes the ones it reads?)");
    if constexpr (copyable && callable) {
        constexpr bool known = is_vertex_result<shaded_vertex<Mesh, VertexShader>>;
        static_assert(known, "voxelpipe: a vertex shader must return glm::vec3 or vertex_output<Varyings>");
        if constexpr (known) {
            constexpr bool interpolable = is_varyings<typename shaded<Mesh, VertexShader>::varyings>();
            constexpr bool few = has_few_members<typename shaded<Mesh, VertexShader>::varyings>();
            static_assert(few, "voxelpipe: varyings may have at most 12 members (put floats together in glm::vec4 or "
                               "std::array<float, N>)");
            static_assert(interpolable || !few, "voxelpipe: varyings must be an aggregate of float, glm::vec2/3/4, "
                                                "std::array<float, N> or flat<T>, at most 12 of them");
            return interpolable;
        }
    }
    return false;
}

template <class Mesh, class VertexShader, class FragmentShader>
[[nodiscard]] constexpr bool check_shaders() {
    if constexpr (check_vertex_shader<Mesh, VertexShader>()) {
        using varyings = typename shaded<Mesh, VertexShader>::varyings;
        constexpr bool copyable = std::is_trivially_copyable_v<FragmentShader>;
        static_assert(copyable, "voxelpipe: a fragment shader must be trivially copyable");
        constexpr bool callable = std::is_invocable_v<const FragmentShader&, const fragment<varyings>&>;
        static_assert(callable,
                      "voxelpipe: the fragment shader cannot be called with const fragment<Varyings>& "
                      "(is its operator() const, and does it take the varyings that the vertex shader makes?)");
        if constexpr (copyable && callable) {
            using result = shader_output<Mesh, VertexShader, FragmentShader>;
            constexpr bool gives_output = is_output<result>, gives_nothing = std::is_void_v<result>;
            static_assert(
                !gives_nothing,
                "voxelpipe: the fragment shader returns void. If it is for the device only (__device__ without "
                "__host__), write vp::output<T...> instead of auto: the host compiler does not see its body");
            static_assert(gives_output || gives_nothing,
                          "voxelpipe: a fragment shader must return vp::outputs(...), one value per render target");
            return gives_output;
        }
    }
    return false;
}

template <class... Attributes>
[[nodiscard]] VOXELPIPE_HD vertex<Attributes...> fetch_vertex(const mesh_view<Attributes...>& m, std::uint32_t index,
                                                              std::uint32_t draw, std::uint32_t instance = 0) {
    return [&]<std::size_t... I>(std::index_sequence<I...>) {
        return vertex<Attributes...>{index, draw, m.positions[index],
                                     make_pack(Attributes(voxelpipe::get<I>(m.attributes)[index])...), instance};
    }
    (std::index_sequence_for<Attributes...>{});
}

} // namespace core

// ---- draws ----------------------------------------------------------------------------------------------------------

// No program between the vertex shader and the rasterizer (program.hpp).
struct none {};

// A mesh with its shaders; the functors carry the transform and the shader data. Does not own the mesh.
template <class Mesh, class VertexShader, class FragmentShader, class Amplify = none>
struct draw {
    Mesh mesh;                      // a mesh_view, points_view or lines_view
    VertexShader vertex_shader;     // trivially copyable
    Amplify amplify;                // vp::tessellate, vp::geometry, or one after the other
    FragmentShader fragment_shader; // trivially copyable
};
template <class Mesh, class VertexShader, class FragmentShader>
struct draw<Mesh, VertexShader, FragmentShader, none> {
    Mesh mesh;
    VertexShader vertex_shader;
    FragmentShader fragment_shader;
};

// The draw of a call and the triangle of its mesh.
struct draw_triangle {
    std::uint32_t draw = 0, triangle = 0; // numbers in the call and in the draw's mesh
    friend bool operator==(const draw_triangle&, const draw_triangle&) = default;
};

// Maps fragment::primitive, which A-buffers store, back to draw, instance and triangle. On the host. Holds the draws'
// sizes at its construction, and refers to nothing.
class primitive_map {
public:
    // Makes the map of the draws of a call.
    template <class Mesh, class VertexShader, class FragmentShader>
    explicit primitive_map(std::span<const draw<Mesh, VertexShader, FragmentShader>> draws) {
        std::uint64_t end = 0;
        for (const auto& d : draws) {
            ends_.push_back(end += d.mesh.num_triangles());
            each_.push_back(d.mesh.triangles.size());
        }
    }
    template <class Mesh, class VertexShader, class FragmentShader>
    explicit primitive_map(const std::vector<draw<Mesh, VertexShader, FragmentShader>>& draws)
        : primitive_map(std::span<const draw<Mesh, VertexShader, FragmentShader>>(draws)) {}

    // Number of primitives.
    [[nodiscard]] std::uint64_t size() const { return ends_.empty() ? 0 : ends_.back(); }
    // `primitive` must be below size().
    [[nodiscard]] draw_triangle operator()(std::uint32_t primitive) const {
        const auto [draw, i] = find(primitive);
        return {draw, static_cast<std::uint32_t>(i % each_[draw])};
    }
    // The copy of the mesh, fragment::instance.
    [[nodiscard]] std::uint32_t instance(std::uint32_t primitive) const {
        const auto [draw, i] = find(primitive);
        return static_cast<std::uint32_t>(i / each_[draw]);
    }

private:
    struct place {
        std::uint32_t draw;
        std::uint64_t triangle; // through all instances
    };
    [[nodiscard]] place find(std::uint32_t primitive) const {
        VOXELPIPE_EXPECTS(primitive < size());
        const auto at = std::upper_bound(ends_.begin(), ends_.end(), std::uint64_t{primitive});
        const std::uint64_t first = at == ends_.begin() ? 0 : *(at - 1);
        return {static_cast<std::uint32_t>(at - ends_.begin()), primitive - first};
    }
    std::vector<std::uint64_t> ends_; // number of primitives up to each draw's end
    std::vector<std::uint64_t> each_; // triangles of each draw's mesh
};

} // namespace voxelpipe
