// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distance fields: voxelize_distance draws the distance from a mesh, and whatever a shader makes of the nearest
// triangle, into a framebuffer, on the backend whose tag is passed (docs/design.md, "Distances"). A sample gets one
// fragment. The same draws, vertex shaders, targets, blends, layouts, crops and checks of arguments as voxelize.

#include <voxelpipe/distance/core/point_triangle.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

namespace voxelpipe {

// How far from the mesh samples hold their distance: a number of the largest voxel size, or band::whole.
struct band {
    double voxels = 3.0;   // above 0, finite
    bool is_whole = false; // every sample holds its distance

    constexpr band() = default;                                           // 3 voxels
    constexpr band(double number_of_voxels) : voxels(number_of_voxels) {} // NOLINT(*-explicit-*): {.band = 5}
    static const band whole;                                              // every sample holds its distance
    friend bool operator==(const band&, const band&) = default;

private:
    constexpr band(double number_of_voxels, bool all) : voxels(number_of_voxels), is_whole(all) {}
};
#if !defined(DOXYGEN) // which takes it for a second member
inline constexpr band band::whole{0.0, true};
#endif

// Where samples lie.
enum class sample : std::uint8_t {
    centre, // at the centres of voxels
    corner, // at the corners of voxels: grid::at_corners(), one more an axis, which is the framebuffer's extent then
};

// What the sign of a distance tells.
enum class distance_sign : std::uint8_t {
    inside, // minus inside, as voxelize_solid with solid_extent::centre and the same rule, bodies and repair has it
    none,   // distances are not negative
};

// Written {.band = 5, .repair = repair::close_holes}.
struct distance_options {
    voxelpipe::band band = {};                            // distances beyond it are not found; default 3
    voxelpipe::sample sample = voxelpipe::sample::centre; // where samples lie
    distance_sign sign = distance_sign::inside;           // with `none` the following keep their defaults
    fill_rule rule = fill_rule::nonzero;                  // as in solid_options, like the rest
    voxelpipe::bodies bodies = voxelpipe::bodies::call;   // draw: inside of any draw
    voxelpipe::repair repair = voxelpipe::repair::none;   // of meshes that are not closed
    int closing = 0;                                      // exterior: gaps that are closed, 0 to max_closing
    std::uint64_t max_hole_edges = std::numeric_limits<std::uint64_t>::max(); // close_holes
    bool count_voxels = true;                                                 // fill counters::voxels
    // close_holes or winding of a part of a mesh: the cones of the whole one, as solid_options::cones. Null: they are
    // found.
    const core::hole_cones* cones = nullptr;
};

// The triangle that is nearest to a sample: of those with the least distance, as a square in double, the first by draw,
// instance and triangle. Beyond the band no triangle is named: in_band is false, `triangle`, `draw` and `instance` are
// 0, `primitive` is none, the distance is plus or minus the band's, and all else is 0.
template <class Varyings = no_varyings>
struct distance_fragment {
    static constexpr std::uint32_t none = ~std::uint32_t{0}; // no primitive

    std::uint32_t triangle;  // in its mesh
    std::uint32_t draw;      // number of the draw in the call
    std::uint32_t instance;  // number of the mesh's copy
    std::uint32_t primitive; // numbered by draw, instance, triangle
    bool in_band;            // the distance is that of the triangle
    bool inside;             // the sample is inside, by options.sign
    int side;              // of the triangle's plane: 1 where the normal points to, -1 behind, 0 in it or without area
    glm::ivec3 voxel;      // index of the sample in the whole grid, or in the whole grid of corners
    float distance;        // world units; negative inside; never -0
    glm::vec3 barycentric; // of the closest point: weights of the triangle's three vertices
    glm::vec3 to_closest;  // from the sample to the closest point, world units
    glm::vec3 normal;      // unit, world space, right-handed winding; 0 if the area is zero
    Varyings varyings;     // interpolated at the closest point

    const Varyings* vertex_varyings[3]; // of the triangle's vertices; null beyond the band
};

// Fragment shader that returns the distance: into one target of float.
struct distance {
    // The fragment's distance, also beyond the band.
    template <class Varyings>
    VOXELPIPE_HD output<float> operator()(const distance_fragment<Varyings>& f) const {
        return outputs(f.distance);
    }
};

// Where distance_at writes, in the backend's memory, one element a point; not owned. Either may be null.
struct distance_arrays {
    float* distances = nullptr;      // NaN for a point that is refused
    std::int64_t* nearest = nullptr; // primitive; -1 for a point that is refused, or without a mesh
};

namespace core {

// Names the calls of this module. A backend implements voxelize_distance as run_module(distance_tag, backend, draws,
// sample grid, framebuffer_view, options, number of triangles, which may be 0), and distance_at as
// run_module(distance_at_tag, backend, draws, grid, points, arrays, options, number of triangles).
struct distance_tag {};
struct distance_at_tag {};

// The grid whose voxels' centres are the samples.
[[nodiscard]] inline grid sample_grid(const grid& g, sample where) {
    return where == sample::corner ? g.at_corners() : g;
}

// The band's distance in world units, which samples beyond it hold; infinity for all samples.
[[nodiscard]] inline float band_distance(const band& b, const grid& g) {
    if (b.is_whole) return std::numeric_limits<float>::infinity();
    return static_cast<float>(b.voxels * std::max({g.voxel_size.x, g.voxel_size.y, g.voxel_size.z}));
}

// Layers of voxels by which a triangle may lie outside of a box of samples whose band it reaches, per axis: no triangle
// further away has a sample within the band. band::whole: more than any grid has.
[[nodiscard]] inline glm::ivec3 band_halo(const band& b, const grid& g) {
    glm::ivec3 halo(0);
    for (int i = 0; i < 3; ++i) {
        const double layers = std::ceil(static_cast<double>(band_distance(b, g)) / g.voxel_size[i]);
        halo[i] = static_cast<int>(std::min(layers, 2.0 * grid::max_extent));
    }
    return halo;
}

// The options of the solid that decides the sign. Repairs of which voxelize_solid knows.
[[nodiscard]] inline solid_options sign_options(const distance_options& o) {
    solid_options s;
    s.rule = o.rule;
    s.bodies = o.bodies;
    s.repair = o.repair;
    s.closing = o.closing;
    s.max_hole_edges = o.max_hole_edges;
    s.cones = o.cones;
    s.with_cover = !may_have_cover(o.repair);
    s.count_voxels = false;
    return s;
}

[[nodiscard]] inline status validate(const distance_options& o, const grid& g) {
    if (!are_measurable(g.voxel_size)) return failure(status_code::bad_voxel_size);
    const float b = band_distance(o.band, g);
    const bool has_band = o.band.is_whole || (std::isfinite(o.band.voxels) && o.band.voxels > 0.0 && b > 0.0f &&
                                              b < std::numeric_limits<float>::infinity());
    if (!has_band || o.sample > sample::corner || o.sign > distance_sign::none)
        return failure(status_code::bad_distance_options);
    if (o.sign == distance_sign::none) {
        constexpr distance_options plain;
        const bool is_plain = o.rule == plain.rule && o.bodies == plain.bodies && o.repair == plain.repair &&
                              o.closing == plain.closing && o.max_hole_edges == plain.max_hole_edges &&
                              o.cones == nullptr;
        return is_plain ? status{} : failure(status_code::bad_distance_options);
    }
    return validate(sign_options(o), sample_grid(g, o.sample));
}

template <class DistanceShader, class Varyings>
using distance_output =
    std::remove_cvref_t<std::invoke_result_t<const DistanceShader&, const distance_fragment<Varyings>&>>;

// True where both shaders can be used with the mesh; otherwise one readable line says why not.
template <class Mesh, class VertexShader, class DistanceShader>
[[nodiscard]] constexpr bool check_distance_shaders() {
    if constexpr (check_vertex_shader<Mesh, VertexShader>()) {
        using varyings = typename shaded<Mesh, VertexShader>::varyings;
        constexpr bool copyable = std::is_trivially_copyable_v<DistanceShader>;
        static_assert(copyable, "voxelpipe: a distance's shader must be trivially copyable");
        constexpr bool callable = std::is_invocable_v<const DistanceShader&, const distance_fragment<varyings>&>;
        static_assert(callable, "voxelpipe: the distance's shader cannot be called with const "
                                "distance_fragment<Varyings>& (is its operator() const, and does it take the varyings "
                                "that the vertex shader makes?)");
        if constexpr (copyable && callable) {
            constexpr bool gives_output = is_output<distance_output<DistanceShader, varyings>>;
            static_assert(gives_output,
                          "voxelpipe: a distance's shader must return vp::outputs(...), one value per render target; "
                          "one for the device only spells vp::output<T...> instead of auto");
            return gives_output;
        }
    }
    return false;
}
template <class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] constexpr bool distance_fits_targets() {
    if constexpr (check_distance_shaders<Mesh, VertexShader, DistanceShader>())
        return output_check<distance_output<DistanceShader, typename shaded<Mesh, VertexShader>::varyings>>::
            template fits_targets<Targets...>();
    return false;
}

} // namespace core

// Draws one fragment a sample into render targets: that of the nearest triangle, or beyond the band one without a
// triangle. The draws share one type of mesh, vertex shader and distance shader; draw::fragment_shader is the
// distance's shader, called with a distance_fragment: that of the nearest triangle's draw, beyond the band that of draw
// 0. The framebuffer has the grid's extent, or with sample::corner one more an axis. Triangles without area have
// distances like the others. Triangles count as outside iff the voxels
// of their bounding box lie further from the samples' than core::band_halo. Without draws it clears; draws without
// triangles give plus the band's distance everywhere, which status::nothing_drawn() tells. Returns after the work is
// done.
template <class Backend, class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] status voxelize_distance(Backend& backend,
                                       std::span<const draw<Mesh, VertexShader, DistanceShader>> draws, const grid& g,
                                       const framebuffer_view<Targets...>& fb, const distance_options& options = {}) {
    if constexpr (core::distance_fits_targets<Mesh, VertexShader, DistanceShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g); !s.ok()) return s;
        const grid samples = core::sample_grid(g, options.sample);
        if (const status s = core::validate_framebuffer(fb, samples); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (draws.empty()) return backend.clear(fb);
        return core::name_bad_triangle(
            backend, draws,
            run_module(core::distance_tag{}, backend, draws, samples, fb, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

template <class Backend, class Mesh, class VertexShader, class DistanceShader, class... Targets>
[[nodiscard]] status voxelize_distance(Backend& backend,
                                       std::span<const draw<Mesh, VertexShader, DistanceShader>> draws, const grid& g,
                                       framebuffer<Backend, Targets...>& fb, const distance_options& options = {}) {
    return voxelize_distance(backend, draws, g, fb.view(), options);
}

// One mesh, into a framebuffer or a framebuffer_view.
template <class Backend, class... Attributes, class VertexShader, class DistanceShader, class Output>
[[nodiscard]] status voxelize_distance(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                                       const VertexShader& vertex_shader, const DistanceShader& distance_shader,
                                       Output&& out, const distance_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, DistanceShader>;
    const draw_type d{mesh, vertex_shader, distance_shader};
    return voxelize_distance(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

template <class Backend, class... Attributes, class VertexShader, class DistanceShader, class Output>
[[nodiscard]] status voxelize_distance(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                                       const VertexShader& vertex_shader, const DistanceShader& distance_shader,
                                       Output&& out, const distance_options& options = {}) {
    return voxelize_distance(backend, m.view(), g, vertex_shader, distance_shader, out, options);
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws, class Output>
[[nodiscard]] status voxelize_distance(Backend& backend, const Draws& draws, const grid& g, Output&& out,
                                       const distance_options& options = {}) {
    return voxelize_distance(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g, out,
                             options);
}

// Distances of any points, in world space and in the backend's memory, from the draws' triangles. Points snap like
// vertices of the grid, wherever they lie, and get the distance of voxelize_distance with band::whole, also by sign:
// rows run along x. options.band and sample are ignored; repair::exterior and repair::vote, which decide voxels, are
// refused with bad_distance_options. A point that is not finite, or beyond 2^40 sub-voxel units, counts in
// status::distance.bad_points. Fragment shaders are ignored. Returns after the work is done.
template <class Backend, class Mesh, class VertexShader, class Shader>
[[nodiscard]] status distance_at(Backend& backend, std::span<const draw<Mesh, VertexShader, Shader>> draws,
                                 const grid& g, backend_view<const glm::vec3> points, const distance_arrays& out,
                                 const distance_options& options = {}) {
    if constexpr (core::check_vertex_shader<Mesh, VertexShader>()) {
        if (const status s = validate(g); !s.ok()) return s;
        distance_options o = options;
        o.band = band::whole;
        o.sample = sample::centre;
        if (const status s = core::validate(o, g.uncropped()); !s.ok()) return s;
        if (o.repair == repair::exterior || o.repair == repair::vote)
            return core::failure(status_code::bad_distance_options);
        if (points.size() != 0 && points.data() == nullptr) return core::failure(status_code::null_view);
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        return core::name_bad_triangle(
            backend, draws,
            run_module(core::distance_at_tag{}, backend, draws, g.uncropped(), points, out, o, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// One mesh as it is.
template <class Backend, class... Attributes>
[[nodiscard]] status distance_at(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                                 backend_view<const glm::vec3> points, const distance_arrays& out,
                                 const distance_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, passthrough, distance>;
    const draw_type d{mesh, passthrough{}, distance{}};
    return distance_at(backend, std::span<const draw_type>(&d, 1), g, points, out, options);
}
template <class Backend, class... Attributes>
[[nodiscard]] status distance_at(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                                 backend_view<const glm::vec3> points, const distance_arrays& out,
                                 const distance_options& options = {}) {
    return distance_at(backend, m.view(), g, points, out, options);
}

} // namespace voxelpipe
