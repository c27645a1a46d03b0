// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cut cells: voxelize_cells draws how much of each voxel is inside, as multiples of 2^-44, into a framebuffer or an
// A-buffer, on the backend whose tag is passed (docs/design.md, "Cut cells"). A voxel that a triangle cuts, or that is
// inside, gets one fragment. The same draws, vertex shaders, targets, blends, layouts, crops and checks of arguments as
// voxelize.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/cells/core/cell_terms.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelize.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

namespace voxelpipe {

// Written {.bodies = bodies::draw}.
struct cell_options {
    voxelpipe::bodies bodies = voxelpipe::bodies::call; // one body, or one for each draw
    // The axis that rows run along, 0 to 2: that of cell_fragment::aperture and of open_rows. On closed meshes the
    // fraction is the same by all axes within the bound of errors, and to the last bit where no triangle is.
    int axis = 0;
    bool count_voxels = true;     // fill counters::voxels
    bool count_open_edges = true; // fill cell_counters::open_edges, which sorts all edges
    // repair::none, or repair::close_holes, which first puts a cone over each hole of each body, as for solids. Cones
    // are triangles of the mesh then: they cut voxels and have areas. Takes host memory for all triangles and vertices.
    voxelpipe::repair repair = voxelpipe::repair::none;
    std::uint64_t max_hole_edges = std::numeric_limits<std::uint64_t>::max(); // holes with more edges stay open
    // close_holes of a part of a mesh: the cones of each body of the whole one, in host memory, in units of the whole
    // grid, as solid_options::cones. Null: they are found.
    const core::hole_cones* cones = nullptr;
};

// One voxel of one body: what a cell's shader gets. Units are u = 2^-44 of the voxel, or of its face.
struct cell_fragment {
    glm::ivec3 voxel;           // index in the whole grid
    std::uint32_t draw;         // which draw of the call; 0 with bodies::call
    bool is_cut;                // the inside of the voxel, or its upper face along the axis, meets a triangle
    float fraction;             // the units' nearest float: 1 inside, 0 outside; neither clamped nor snapped
    std::int64_t units;         // the integral of the winding number over the voxel
    std::int64_t aperture;      // the same over its lower face along the axis
    std::int64_t next_aperture; // over its upper face; aperture - next_aperture is the axis' component of the mesh's
                                // area within the voxel, to the last bit
};

// What a voxel can have beside a cell_fragment's members. Each is computed only if a shader asks for it.
enum class cell_value : std::uint8_t {
    centroid, // of the part inside
    area,     // of the mesh within the voxel, and that area's centroid
    sheets,   // whether more than one sheet of the surface cuts the voxel
    faces     // the centroids of the two apertures
};

namespace core {

template <cell_value>
struct value_of_cell;
template <>
struct value_of_cell<cell_value::centroid> {
    // The middle of the part inside: from the voxel's centre, in voxels, -0.5 to 0.5. 0 where the fraction is less than
    // 2^-20 or the quotient lies more than 2^-10 beyond the voxel, as overlapping and inverted parts can have it.
    glm::vec3 centroid;
};
template <>
struct value_of_cell<cell_value::area> {
    double area;             // of all triangles' parts within the voxel, in squared units of the world
    glm::vec3 area_centroid; // from the voxel's centre, in voxels, -0.5 to 0.5; 0 without area
};
template <>
struct value_of_cell<cell_value::sheets> {
    // The triangles that cut the voxel (is_cut) are no single sheet. Two of them are of one sheet if they share an
    // edge, by its snapped ends, that meets the closed voxel, or if such neighbours link them.
    bool is_multi_cut;
};
template <>
struct value_of_cell<cell_value::faces> {
    // The middles of the inside parts of the voxel's lower and upper face along the axis: from the face's centre, in
    // voxels, -0.5 to 0.5, and 0 along the axis. 0 where the aperture is less than 2^-20 or the quotient lies more than
    // 2^-10 beyond the face, as overlapping and inverted parts can have it.
    glm::vec3 aperture_centroid, next_aperture_centroid;
};

} // namespace core

// What a shader gets that asks for more: it names this type as `fragment`, with what it needs, each once, such as
//   struct middle { using fragment = vp::measured_cell<vp::cell_value::centroid>;
//                   VOXELPIPE_HD auto operator()(const fragment& f) const { return vp::outputs(f.centroid.x); } };
// With cell_value::area the upper faces along all axes belong to the voxel, for is_cut too: triangles in them are
// drawn.
template <cell_value... Values>
struct measured_cell : cell_fragment, core::value_of_cell<Values>... {};

// Cell shader that returns the fraction: into one target of float.
struct fraction {
    static constexpr bool ignores_voxel = true; // called once for voxels of a row between two that are cut
    // The fragment's fraction.
    VOXELPIPE_HD output<float> operator()(const cell_fragment& f) const { return outputs(f.fraction); }
};

namespace core {

// Names the call of this module. A backend implements voxelize_cells as run_module(cells_tag, backend, draws, grid,
// framebuffer_view or A-buffer, options, number of triangles).
struct cells_tag {};

// The type that a shader names as `fragment`, and the bits of what it needs.
template <class CellShader>
struct fragment_of_cells {
    using type = cell_fragment;
};
template <class CellShader>
requires requires { typename CellShader::fragment; }
struct fragment_of_cells<CellShader> {
    using type = typename CellShader::fragment;
};
template <class CellShader>
using cell_fragment_of = typename fragment_of_cells<CellShader>::type;
template <class Fragment>
inline constexpr unsigned
    needs_of_cells = (std::is_base_of_v<value_of_cell<cell_value::centroid>, Fragment> ? needs_centroid : 0) |
                     (std::is_base_of_v<value_of_cell<cell_value::area>, Fragment> ? needs_area : 0) |
                     (std::is_base_of_v<value_of_cell<cell_value::sheets>, Fragment> ? needs_sheets : 0) |
                     (std::is_base_of_v<value_of_cell<cell_value::faces>, Fragment> ? needs_faces : 0);

// True of a cell's shader that says so by a member `static constexpr bool ignores_voxel = true`, and of a constant:
// what it returns does not depend on cell_fragment::voxel.
template <class CellShader>
inline constexpr bool ignores_voxel = is_constant<CellShader> || requires {
    requires CellShader::ignores_voxel;
};

template <class CellShader>
using cell_output = std::remove_cvref_t<std::invoke_result_t<const CellShader&, const cell_fragment_of<CellShader>&>>;

// True where both shaders can be used with the mesh; otherwise one readable line says why not.
template <class Mesh, class VertexShader, class CellShader>
[[nodiscard]] constexpr bool check_cell_shaders() {
    if constexpr (check_vertex_shader<Mesh, VertexShader>()) {
        constexpr bool copyable = std::is_trivially_copyable_v<CellShader>;
        static_assert(copyable, "voxelpipe: a cell's shader must be trivially copyable");
        constexpr bool known = std::is_base_of_v<cell_fragment, cell_fragment_of<CellShader>>;
        static_assert(known, "voxelpipe: a cell's shader names as `fragment` a vp::measured_cell of what it needs");
        constexpr bool callable = std::is_invocable_v<const CellShader&, const cell_fragment_of<CellShader>&>;
        static_assert(callable,
                      "voxelpipe: the cell's shader cannot be called with const cell_fragment&, or with what it "
                      "names as `fragment` (is its operator() const? a cell has no barycentrics, normals or "
                      "varyings)");
        if constexpr (copyable && known && callable) {
            constexpr bool gives_output = is_output<cell_output<CellShader>>;
            static_assert(gives_output,
                          "voxelpipe: a cell's shader must return vp::outputs(...), one value per render target; one "
                          "for the device only spells vp::output<T...> instead of auto");
            return gives_output;
        }
    }
    return false;
}
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] constexpr bool cell_fits_targets() {
    if constexpr (check_cell_shaders<Mesh, VertexShader, CellShader>())
        return output_check<cell_output<CellShader>>::template fits_targets<Targets...>();
    return false;
}

template <class Mesh, class VertexShader, class CellShader, class Payload>
[[nodiscard]] constexpr bool cell_fits_payload() {
    if constexpr (check_cell_shaders<Mesh, VertexShader, CellShader>())
        return output_check<cell_output<CellShader>>::template fits_payload<Payload>();
    return false;
}

[[nodiscard]] inline status validate(const cell_options& o) {
    const bool repairs = o.repair == repair::none || o.repair == repair::close_holes;
    const bool known = o.bodies <= bodies::draw && o.axis >= 0 && o.axis <= 2 && repairs;
    return known ? status{} : failure(status_code::bad_cell_options);
}

} // namespace core

// Draws the fractions of voxels that are inside into render targets: the integral of the winding number over the voxel,
// which for outward bodies that do not overlap is the volume inside, 0 to 1. Overlapping parts add up, inverted ones
// count negative; status::cells tells how many fractions are no 0 to 1. The draws share one type of mesh, vertex shader
// and cell shader; draw::fragment_shader is the cell's shader, called with a cell_fragment: that of draw 0 with
// bodies::call, each draw's own with bodies::draw. On a closed mesh a voxel that no triangle touches has its integer
// exactly, and the sum of all is the mesh's volume up to roundings of 2^-44. An open mesh is defined by rows along the
// axis, from the low end. Triangles count as outside iff they miss the grid's intervals along the two other axes.
// repair::close_holes closes the mesh first, by all its triangles, so that a crop is the crop of the whole then too.
// Without any triangles it clears, as vp::clear does. Returns after the work is done. Fails with winding_too_large, and
// writes nothing, where 2^19 triangles or more could wrap the sums of a row. A cell's shader that needs centroids or
// areas names them (measured_cell).
template <class Backend, class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status voxelize_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                                    const grid& g, const framebuffer_view<Targets...>& fb,
                                    const cell_options& options = {}) {
    if constexpr (core::cell_fits_targets<Mesh, VertexShader, CellShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options); !s.ok()) return s;
        if (const status s = core::validate_framebuffer(fb, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) return backend.clear(fb);
        return core::name_bad_triangle(
            backend, draws, run_module(core::cells_tag{}, backend, draws, g, fb, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

template <class Backend, class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status voxelize_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                                    const grid& g, framebuffer<Backend, Targets...>& fb,
                                    const cell_options& options = {}) {
    return voxelize_cells(backend, draws, g, fb.view(), options);
}

// Draws them into an A-buffer, as materials that share a voxel want it with bodies::draw: a voxel's fragments by
// ascending draw, which is their number (host_abuffer::fragment_entry::primitive, 0 with bodies::call; primitive_map
// does not apply). The shader's one output is the payload; it is called twice for each fragment. Every voxel inside is
// listed, so memory follows the volume. size_overflow for 2^32 voxels or more in the lists of rows along axis 1 or 2.
template <class Backend, class Mesh, class VertexShader, class CellShader, class Payload>
[[nodiscard]] status voxelize_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                                    const grid& g, abuffer<Backend, Payload>& lists, const cell_options& options = {}) {
    if constexpr (core::cell_fits_payload<Mesh, VertexShader, CellShader, Payload>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) {
            lists = abuffer<Backend, Payload>(backend);
            lists.extent = g.extent;
            return s;
        }
        return core::name_bad_triangle(
            backend, draws, run_module(core::cells_tag{}, backend, draws, g, lists, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// One mesh, into a framebuffer, a framebuffer_view or an A-buffer.
template <class Backend, class... Attributes, class VertexShader, class CellShader, class Output>
[[nodiscard]] status voxelize_cells(Backend& backend, const mesh_view<Attributes...>& mesh, const grid& g,
                                    const VertexShader& vertex_shader, const CellShader& cell_shader, Output&& out,
                                    const cell_options& options = {}) {
    using draw_type = draw<mesh_view<Attributes...>, VertexShader, CellShader>;
    const draw_type d{mesh, vertex_shader, cell_shader};
    return voxelize_cells(backend, std::span<const draw_type>(&d, 1), g, out, options);
}

template <class Backend, class... Attributes, class VertexShader, class CellShader, class Output>
[[nodiscard]] status voxelize_cells(Backend& backend, const mesh<Backend, Attributes...>& m, const grid& g,
                                    const VertexShader& vertex_shader, const CellShader& cell_shader, Output&& out,
                                    const cell_options& options = {}) {
    return voxelize_cells(backend, m.view(), g, vertex_shader, cell_shader, out, options);
}

// Draws in any contiguous range, such as a std::vector.
template <class Backend, core::draw_range Draws, class Output>
[[nodiscard]] status voxelize_cells(Backend& backend, const Draws& draws, const grid& g, Output&& out,
                                    const cell_options& options = {}) {
    return voxelize_cells(backend, std::span<const core::draw_of<Draws>>(std::data(draws), std::size(draws)), g, out,
                          options);
}

} // namespace voxelpipe
