// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids: voxelize_solid draws the inside of closed meshes into a framebuffer or an A-buffer, on the backend whose tag
// is passed, exactly (docs/design.md, "Solids"). A solid is a coverage like the others: the same draws, vertex shaders,
// targets, blends, layouts, crops and checks of arguments as voxelize; its shader gets a solid_fragment.

#include <voxelpipe/core/seen_triangle.hpp>
#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

namespace voxelpipe {

namespace core {
struct hole_cones;
}

// The unit that is one body, with one winding number: all draws of the call together, which gives one fragment a voxel;
// or each draw by itself, which gives one fragment for each draw that a voxel lies in.
enum class bodies : std::uint8_t { call, draw };

// The voxels that are drawn.
enum class solid_extent : std::uint8_t {
    centre, // those whose centre is inside
    outer,  // these and those whose closed box meets a triangle
    inner,  // those whose centre is inside and whose closed box meets no triangle
};

// Repairs of meshes that are not closed.
enum class repair : std::uint8_t {
    none,        // a hole casts its shadow along +x; solid_counters::open_rows tells
    close_holes, // a cone is put over each hole's boundary, before anything else
    // The next two have an inside of their own, and what a triangle touches belongs to it (solid_options::with_cover):
    // a rule or an extent that is not solid_options' default is refused with status_code::bad_solid_options.
    // diagnose_repair (diagnose_repair.hpp) tells whether a flood took part of the inside.
    exterior, // what a flood from outside the grid does not reach through untouched voxels: fills cavities; no crops
    vote,     // what most of the closed rows along x, y and z call inside by even_odd; a tie is outside
    // Where the generalized winding number is at least 1/2, or with fill_rule::nonzero its magnitude: the solid angles
    // of all triangles over 4 pi, which across a hole falls smoothly. even_odd is refused with bad_solid_options, voxel
    // sizes outside 2^-100 .. 2^100 with bad_voxel_size. Holes and their cones are those of close_holes; they do not
    // belong to the cover. On a GPU a call takes 8 bytes a voxel and body.
    winding,
};

// What repair::exterior and repair::vote take from the rest of the grid where a call draws a slab of it along z. Bits
// of host memory, on a GPU also of its own: 64 voxels along x a word, from the slab's first one on, each row of words
// from a new word on; rows by ascending y, then z. Not owned.
struct solid_slab {
    // exterior: the slab's voxels that are inside, which is all that is drawn (slabs/exterior.hpp). Like
    // solid_options::cones, they need a triangle to be drawn, whichever.
    const std::uint64_t* inside = nullptr;
    // vote, a bit a column along z: the parity below the slab, and whether the column is open (slabs/columns.hpp). The
    // call has all triangles that reach the slab's layers and meet its x or y interval.
    const std::uint64_t *below = nullptr, *open = nullptr;
};

// Written {.rule = fill_rule::even_odd, .extent = solid_extent::outer}.
struct solid_options {
    fill_rule rule = fill_rule::nonzero;                // what a winding number means
    voxelpipe::bodies bodies = voxelpipe::bodies::call; // one body, or one for each draw
    solid_extent extent = solid_extent::centre;         // which voxels belong to the inside
    voxelpipe::repair repair = voxelpipe::repair::none; // of meshes that are not closed
    bool count_voxels = true;                           // fill counters::voxels

    // close_holes, winding: holes with more boundary edges than this stay open.
    std::uint64_t max_hole_edges = std::numeric_limits<std::uint64_t>::max();
    // close_holes or winding of a part of a mesh: the cones of each body of the whole one, in host memory
    // (slabs/holes.hpp), in place of those that this call would find. Null: found by the call. Like that, they need a
    // triangle to be drawn.
    const core::hole_cones* cones = nullptr;
    // exterior: gaps of up to about twice as many voxels are closed, 0 to max_closing.
    int closing = 0;
    static constexpr int max_closing = 64; // the largest `closing`
    // exterior or vote of a slab of a mesh in slabs, with bodies::call (slabs/stream.hpp puts it together). Null: of
    // the grid by itself.
    const solid_slab* slab = nullptr;
    // exterior, vote: voxels that a triangle touches are inside, whatever their centres are. False: a vote decides at
    // each centre; of a flood's cover those voxels are outside whose centre sees the outside: no triangle crosses the
    // segment to the centre of a voxel, one or two away along an axis, that is reached and not touched. The sign of
    // distances and of surfaces has it so (DISTANCE in docs/design.md). False with another repair, or with exterior of
    // a slab, is refused with bad_solid_options.
    bool with_cover = true;
};

// even_odd, each draw by itself: overlapping draws stay solid, cavities within one draw stay empty.
inline constexpr solid_options each_draw{.rule = fill_rule::even_odd, .bodies = bodies::draw};

// One voxel of one body: what a solid's shader gets. The order of fragments in a voxel, and their number in an
// A-buffer, is the draw.
struct solid_fragment {
    glm::ivec3 voxel;   // index in the whole grid
    std::uint32_t draw; // which draw of the call; 0 with bodies::call
    std::int64_t
        winding; // winding number of the voxel's centre; 0 is possible with outer; 0 with exterior, vote, winding
};

namespace core {

template <class SolidShader>
using solid_output = std::remove_cvref_t<std::invoke_result_t<const SolidShader&, const solid_fragment&>>;

// True where both shaders can be used with the mesh; otherwise one readable line says why not. Varyings are computed by
// nobody: a solid has none.
template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] constexpr bool check_solid_shaders() {
    if constexpr (check_vertex_shader<Mesh, VertexShader>()) {
        constexpr bool copyable = std::is_trivially_copyable_v<SolidShader>;
        static_assert(copyable, "voxelpipe: a solid's shader must be trivially copyable");
        constexpr bool callable = std::is_invocable_v<const SolidShader&, const solid_fragment&>;
        static_assert(callable, "voxelpipe: the solid's shader cannot be called with const solid_fragment& (is its "
                                "operator() const? a solid has no barycentrics, normals or varyings)");
        if constexpr (copyable && callable) {
            using result = solid_output<SolidShader>;
            constexpr bool gives_output = is_output<result>;
            static_assert(gives_output,
                          "voxelpipe: a solid's shader must return vp::outputs(...), one value per render target; one "
                          "for the device only spells vp::output<T...> instead of auto");
            return gives_output;
        }
    }
    return false;
}

template <class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] constexpr bool solid_fits_targets() {
    if constexpr (check_solid_shaders<Mesh, VertexShader, SolidShader>())
        return output_check<solid_output<SolidShader>>::template fits_targets<Targets...>();
    return false;
}
template <class Mesh, class VertexShader, class SolidShader, class Payload>
[[nodiscard]] constexpr bool solid_fits_payload() {
    if constexpr (check_solid_shaders<Mesh, VertexShader, SolidShader>())
        return output_check<solid_output<SolidShader>>::template fits_payload<Payload>();
    return false;
}

// True if a repair puts cones over the boundaries of holes.
[[nodiscard]] constexpr bool has_cones(repair kind) { return kind == repair::close_holes || kind == repair::winding; }
// True if a repair has an inside of its own, to which the cover belongs but for solid_options::with_cover.
[[nodiscard]] constexpr bool may_have_cover(repair kind) { return kind == repair::exterior || kind == repair::vote; }

// Names the calls of this module: a backend implements voxelize_solid as run_module(solid_tag, backend, draws, grid,
// framebuffer_view or A-buffer, options, number of triangles), which argument-dependent lookup finds by the tag.
struct solid_tag {};
// The tag of diagnose_repair and remesh, whose arguments are draws, grid, bodies, and optionally the greatest number of
// edges of a hole. Gives the lids on the holes of each body.
struct find_holes_tag {};

// True if a backend's calls take solid_options::slab.
template <class Backend>
inline constexpr bool takes_solid_slabs = requires {
    Backend::takes_solid_slabs;
};

[[nodiscard]] inline status validate(const solid_options& o, const grid& g, bool takes_slabs = false) {
    const bool known = o.rule <= fill_rule::positive && o.bodies <= bodies::draw && o.extent <= solid_extent::inner &&
                       o.repair <= repair::winding;
    if (!known || o.closing < 0 || o.closing > solid_options::max_closing)
        return failure(status_code::bad_solid_options);
    constexpr solid_options plain;
    if (may_have_cover(o.repair) && (o.rule != plain.rule || o.extent != plain.extent))
        return failure(status_code::bad_solid_options);
    if (o.repair == repair::winding) {
        if (o.rule == fill_rule::even_odd) return failure(status_code::bad_solid_options);
        if (!are_measurable(g.voxel_size)) return failure(status_code::bad_voxel_size);
    }
    if (!o.with_cover && (!may_have_cover(o.repair) || (o.repair == repair::exterior && o.slab != nullptr)))
        return failure(status_code::bad_solid_options);
    if (o.slab != nullptr) {
        if (!takes_slabs) return failure(status_code::strategy_unavailable);
        const bool has_bits = o.repair == repair::exterior
                                  ? o.slab->inside != nullptr
                                  : o.repair == repair::vote && o.slab->below != nullptr && o.slab->open != nullptr;
        return has_bits && o.bodies == bodies::call ? status{} : failure(status_code::bad_solid_options);
    }
    if (o.repair == repair::exterior && g.extent != g.whole_extent()) return failure(status_code::crop_without_whole);
    return {};
}

} // namespace core

// Draws the inside of meshes into render targets. The draws share one type of mesh, vertex shader and solid's shader;
// draw::fragment_shader is the solid's shader, called with a solid_fragment: the one of draw 0 with bodies::call, each
// draw's own with bodies::draw. Triangles with no area, and duplicates that cancel, enclose nothing. Fills
// status::solid; triangles count as outside iff they miss the grid's y or z interval. Returns after the work is done.
// Without any triangles it clears, as vp::clear does.
template <class Backend, class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] status voxelize_solid(Backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                    const grid& g, const framebuffer_view<Targets...>& fb,
                                    const solid_options& options = {}) {
    if constexpr (core::solid_fits_targets<Mesh, VertexShader, SolidShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g, core::takes_solid_slabs<Backend>); !s.ok()) return s;
        if (const status s = core::validate_framebuffer(fb, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) return backend.clear(fb);
        return core::name_bad_triangle(
            backend, draws, run_module(core::solid_tag{}, backend, draws, g, fb, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

template <class Backend, class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] status voxelize_solid(Backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                    const grid& g, framebuffer<Backend, Targets...>& fb,
                                    const solid_options& options = {}) {
    return voxelize_solid(backend, draws, g, fb.view(), options);
}

// Draws the inside of meshes into an A-buffer: a voxel's fragments by ascending draw, which is their number
// (host_abuffer::fragment_entry::primitive; primitive_map does not apply). The shader's one output is the payload.
template <class Backend, class Mesh, class VertexShader, class SolidShader, class Payload>
[[nodiscard]] status voxelize_solid(Backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                    const grid& g, abuffer<Backend, Payload>& lists,
                                    const solid_options& options = {}) {
    if constexpr (core::solid_fits_payload<Mesh, VertexShader, SolidShader, Payload>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g, core::takes_solid_slabs<Backend>); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) {
            lists = abuffer<Backend, Payload>(backend);
            lists.extent = g.extent;
            return s;
        }
        return core::name_bad_triangle(
            backend, draws, run_module(core::solid_tag{}, backend, draws, g, lists, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// One mesh, into a framebuffer, a framebuffer_view or an A-buffer.
template <class Backend, class... Attributes, class VertexShader, class SolidShader, class Output>
[[nodiscard]] status voxelize_solid(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                                    const VertexShader& vertex_shader, const SolidShader& solid_shader, Output&& out,
                                    const solid_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, SolidShader>;
    const draw_type d{mesh, vertex_shader, solid_shader};
    return voxelize_solid(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

template <class Backend, class... Attributes, class VertexShader, class SolidShader, class Output>
[[nodiscard]] status voxelize_solid(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                                    const VertexShader& vertex_shader, const SolidShader& solid_shader, Output&& out,
                                    const solid_options& options = {}) {
    return voxelize_solid(backend, m.view(), g, vertex_shader, solid_shader, out, options);
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws, class Output>
[[nodiscard]] status voxelize_solid(Backend& backend, const Draws& draws, const grid& g, Output&& out,
                                    const solid_options& options = {}) {
    return voxelize_solid(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g, out,
                          options);
}

} // namespace voxelpipe
