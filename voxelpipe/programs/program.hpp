// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Programs between the vertex shader and the rasterizer: tessellation of a mesh's triangles, and geometry programs that
// make triangles of triangles, lines or points. Functors like the shaders: const, trivially copyable, no side effects.
//
//   tessellation program   static constexpr int max_level
//                          int edge_level(const vertex_output<V>& a, const vertex_output<V>& b) const
//                          vertex_output<W> operator()(const patch_point<V>&) const
//   geometry program       triangles<N, W> operator()(const triangle<V>&) const      or line<V>, or point<V>
// V are the varyings of the stage before, W those that the fragment shader takes.
//
//   vp::voxelize(backend, mesh, grid, vs, vp::tessellate{ridges{}}, fs, target)
//   vp::voxelize(backend, curves, grid, vs, vp::geometry{tube{}}, fs, target)
//   vp::voxelize(backend, mesh, grid, vs, vp::tessellate{ridges{}} | vp::geometry{shell{}}, fs, target)
//
// The result is defined exactly (docs/design.md, "Programs"): the same triangles in the same order on every backend, in
// bounded memory. A program's floats follow the rule of the shaders: vp::exact, or no product that feeds a bare + or -.

#include <voxelpipe/core/lattice.hpp>
#include <voxelpipe/shader.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe {

// ---- tessellation ---------------------------------------------------------------------------------------------------

namespace core {

// -0 is +0, so that vertices that are doubled along a seam agree.
[[nodiscard]] VOXELPIPE_HD inline bool same_position(const glm::vec3& p, const glm::vec3& q) {
    return p.x == q.x && p.y == q.y && p.z == q.z;
}
// The canonical order of an edge's ends.
[[nodiscard]] VOXELPIPE_HD inline bool comes_before(const glm::vec3& p, const glm::vec3& q) {
    return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z < q.z;
}

} // namespace core

// A point of a tessellated triangle. Values at a corner are the vertex's own, bit for bit. On an edge they come from
// the edge's two vertices alone, in canonical order (by position), so that two triangles with a common edge get the
// same points; a flat varying is that of the first of them there, and of the triangle's first vertex inside.
template <class Varyings>
class patch_point {
public:
    using vertex_type = vertex_output<Varyings>; // what the vertex shader returns

    // Position of the point, before the program displaces it.
    [[nodiscard]] VOXELPIPE_HD glm::vec3 position() const { return mix_of(a_.position, b_.position, c_.position); }
    // All varyings, interpolated; flat ones from one vertex.
    [[nodiscard]] VOXELPIPE_HD Varyings varyings() const {
        return is_corner_ ? a_.varyings : core::mix(a_.varyings, b_.varyings, c_.varyings, t1_, t2_);
    }
    // One member of the varyings, as in p.mix(&surface::normal).
    template <class T>
    [[nodiscard]] VOXELPIPE_HD T mix(T Varyings::*member) const {
        return mix_of(a_.varyings.*member, b_.varyings.*member, c_.varyings.*member);
    }

    // For the library: a + t1 (b - a) + t2 (c - a), or a itself.
    VOXELPIPE_HD
    patch_point(const vertex_type& a, const vertex_type& b, const vertex_type& c, float t1, float t2, bool is_corner)
        : a_(a), b_(b), c_(c), t1_(t1), t2_(t2), is_corner_(is_corner) {}

private:
    template <class T>
    [[nodiscard]] VOXELPIPE_HD T mix_of(const T& a, const T& b, const T& c) const {
        return is_corner_ ? a : core::member_traits<T>::mix(a, b, c, t1_, t2_);
    }
    const vertex_type &a_, &b_, &c_;
    float t1_, t2_;
    bool is_corner_;
};

// Divides triangles by a tessellation program.
template <class Program>
struct tessellate {
    Program program; // trivially copyable; edge_level(), and a call for each point
};
template <class Program>
tessellate(Program) -> tessellate<Program>;

// The least level whose parts of a straight edge are at most `length` long, from 1 to `most`; 1 for NaN.
[[nodiscard]] VOXELPIPE_HD inline int level_by_length(const glm::vec3& a, const glm::vec3& b, float length,
                                                      int most = core::max_tessellation_level) {
    const double x = exact::to_double(exact::sub(b.x, a.x)), y = exact::to_double(exact::sub(b.y, a.y)),
                 z = exact::to_double(exact::sub(b.z, a.z));
    const double d = exact::sqrt(exact::fma(z, z, exact::fma(y, y, exact::mul(x, x))));
    const double parts = exact::div(d, exact::to_double(length));
    if (!(parts > 1.0)) return 1;
    if (parts >= most) return most;
    const int floor = static_cast<int>(parts);
    return static_cast<double>(floor) < parts ? floor + 1 : floor;
}

namespace exact {

// p + amount * direction, one fused step a component.
[[nodiscard]] VOXELPIPE_HD inline glm::vec3 along(const glm::vec3& p, const glm::vec3& direction, float amount) {
    return {fma(amount, direction.x, p.x), fma(amount, direction.y, p.y), fma(amount, direction.z, p.z)};
}

} // namespace exact

// ---- geometry programs ----------------------------------------------------------------------------------------------

// What a geometry program gets: vertices after the vertex shader, or after the tessellation program.
template <class Varyings = no_varyings>
struct triangle {
    vertex_output<Varyings> vertices[3];  // counter-clockwise from the front
    std::uint32_t number, instance, draw; // number: of the triangle in its mesh; of the patch after a tessellation
};
// What a geometry program gets of a segment of lines_view.
template <class Varyings = no_varyings>
struct line {
    vertex_output<Varyings> vertices[2];  // in the order of the indices
    std::uint32_t number, instance, draw; // number: of the segment in its view
};
// What a geometry program gets of a point of points_view.
template <class Varyings = no_varyings>
struct point {
    vertex_output<Varyings> vertices[1];  // one
    std::uint32_t number, instance, draw; // number: of the point in its view
};

// What it returns: up to N triangles, in order.
template <int N, class Varyings = no_varyings>
struct triangles {
    using vertex_type = vertex_output<Varyings>; // what the vertex shader returns
    static constexpr int capacity = N;           // most triangles of one element

    vertex_type vertices[std::size_t{3} * N]; // three a triangle
    int count = 0;                            // a call fails with bad_count unless this is 0 to N

    // Appends a triangle. Beyond N it only counts, and the call fails.
    VOXELPIPE_HD void add(const vertex_type& a, const vertex_type& b, const vertex_type& c) {
        if (count >= 0 && count < N) {
            vertices[3 * count] = a;
            vertices[3 * count + 1] = b;
            vertices[3 * count + 2] = c;
        }
        ++count;
    }
};

// Replaces triangles, lines or points by what a geometry program returns for each.
template <class Program>
struct geometry {
    Program program; // trivially copyable
};
template <class Program>
geometry(Program) -> geometry<Program>;

// A geometry program for the triangles of a tessellation.
template <class Tessellation, class Geometry>
struct tessellate_then_geometry {
    tessellate<Tessellation> first; // divides triangles
    geometry<Geometry> second;      // gets the parts
};
// Both programs, one after the other, as in vp::tessellate{a} | vp::geometry{b}.
template <class Tessellation, class Geometry>
[[nodiscard]] constexpr tessellate_then_geometry<Tessellation, Geometry> operator|(const tessellate<Tessellation>& t,
                                                                                   const geometry<Geometry>& g) {
    return {t, g};
}

// ---- checks ---------------------------------------------------------------------------------------------------------

namespace core {

// The vertices of a program's inputs, and how many there are.
template <class Input>
struct program_input;
template <class V>
struct program_input<triangle<V>> {
    static constexpr int vertices = 3;
};
template <class V>
struct program_input<line<V>> {
    static constexpr int vertices = 2;
};
template <class V>
struct program_input<point<V>> {
    static constexpr int vertices = 1;
};

template <class T>
inline constexpr bool is_triangles = false;
template <int N, class V>
inline constexpr bool is_triangles<triangles<N, V>> = N >= 1 && N <= 256 && is_varyings<V>();

template <class Program, class V>
concept has_edge_level = requires(const Program& p, const vertex_output<V>& v) {
    { p.edge_level(v, v) } -> std::same_as<int>;
};
template <class Program>
concept has_max_level = requires {
    { Program::max_level } -> std::convertible_to<int>;
};

// What a program makes of varyings V; void unless the check below accepts it. Each check is one readable line, and
// nothing that depends on a failed one is instantiated.
template <class Program, class V>
[[nodiscard]] constexpr bool check_tessellation() {
    constexpr bool copyable = std::is_trivially_copyable_v<Program>;
    static_assert(copyable, "voxelpipe: a tessellation program must be trivially copyable");
    constexpr bool has_levels = has_edge_level<Program, V>;
    static_assert(has_levels,
                  "voxelpipe: a tessellation program must have int edge_level(const vertex&, const vertex&) "
                  "const, with the vertex_output that the vertex shader makes");
    constexpr bool has_max = has_max_level<Program>;
    static_assert(has_max, "voxelpipe: a tessellation program must have static constexpr int max_level");
    if constexpr (has_max) {
        constexpr bool in_range = Program::max_level >= 1 && Program::max_level <= max_tessellation_level;
        static_assert(in_range, "voxelpipe: max_level must be 1 to 1024");
        constexpr bool callable = std::is_invocable_v<const Program&, const patch_point<V>&>;
        static_assert(callable,
                      "voxelpipe: the tessellation program cannot be called with const patch_point<Varyings>& "
                      "(is its operator() const, and does it take the varyings that the vertex shader makes?)");
        if constexpr (copyable && has_levels && in_range && callable) {
            using result = std::remove_cvref_t<std::invoke_result_t<const Program&, const patch_point<V>&>>;
            constexpr bool known = is_vertex_result<result>;
            static_assert(known, "voxelpipe: a tessellation program must return glm::vec3 or vertex_output<Varyings>");
            if constexpr (known) {
                constexpr bool interpolable = is_varyings<typename vertex_result<result>::varyings>();
                static_assert(interpolable, "voxelpipe: varyings must be an aggregate of float, glm::vec2/3/4, "
                                            "std::array<float, N> or flat<T>, at most 12 of them");
                return interpolable;
            }
        }
    }
    return false;
}
template <class Program, class V>
using tessellated =
    typename vertex_result<std::remove_cvref_t<std::invoke_result_t<const Program&, const patch_point<V>&>>>::varyings;

template <class Program, class Input>
[[nodiscard]] constexpr bool check_geometry() {
    constexpr bool copyable = std::is_trivially_copyable_v<Program>;
    static_assert(copyable, "voxelpipe: a geometry program must be trivially copyable");
    constexpr bool callable = std::is_invocable_v<const Program&, const Input&>;
    static_assert(callable, "voxelpipe: the geometry program cannot be called with const triangle<Varyings>&, line or "
                            "point of this mesh (is its operator() const, and does it take these varyings?)");
    if constexpr (copyable && callable) {
        using result = std::remove_cvref_t<std::invoke_result_t<const Program&, const Input&>>;
        static_assert(is_triangles<result>,
                      "voxelpipe: a geometry program must return vp::triangles<N, Varyings>, N at most 256");
        return is_triangles<result>;
    }
    return false;
}
template <class Program, class Input>
using geometry_result = std::remove_cvref_t<std::invoke_result_t<const Program&, const Input&>>;

template <class T>
struct varyings_of_triangles;
template <int N, class V>
struct varyings_of_triangles<triangles<N, V>> {
    using type = V;
};

// The varyings behind an amplification of inputs with varyings V: Input<V> is triangle<V>, line<V> or point<V>.
template <class Amplify, template <class> class Input, class V>
struct amplified {
    static constexpr bool is_known = false;
};
template <class Program, template <class> class Input, class V>
struct amplified<tessellate<Program>, Input, V> {
    static constexpr bool is_known = true;
    [[nodiscard]] static constexpr bool check() {
        constexpr bool of_triangles = program_input<Input<V>>::vertices == 3;
        static_assert(of_triangles, "voxelpipe: only triangles can be tessellated");
        if constexpr (of_triangles) return check_tessellation<Program, V>();
        return false;
    }
    template <int = 0>
    using varyings = tessellated<Program, V>;
};
template <class Program, template <class> class Input, class V>
struct amplified<geometry<Program>, Input, V> {
    static constexpr bool is_known = true;
    [[nodiscard]] static constexpr bool check() { return check_geometry<Program, Input<V>>(); }
    template <int = 0>
    using varyings = typename varyings_of_triangles<geometry_result<Program, Input<V>>>::type;
};
template <class T, class G, template <class> class Input, class V>
struct amplified<tessellate_then_geometry<T, G>, Input, V> {
    static constexpr bool is_known = true;
    using first = amplified<tessellate<T>, Input, V>;
    [[nodiscard]] static constexpr bool check() {
        if constexpr (first::check()) return check_geometry<G, triangle<tessellated<T, V>>>();
        return false;
    }
    template <int = 0>
    using varyings = typename varyings_of_triangles<geometry_result<G, triangle<tessellated<T, V>>>>::type;
};

template <class T>
inline constexpr bool is_amplifier = false;
template <class P>
inline constexpr bool is_amplifier<tessellate<P>> = true;
template <class P>
inline constexpr bool is_amplifier<geometry<P>> = true;
template <class T, class G>
inline constexpr bool is_amplifier<tessellate_then_geometry<T, G>> = true;

} // namespace core
} // namespace voxelpipe
