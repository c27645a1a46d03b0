// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Host side of a solid's call up to its entries for any output: what memory they take, and their launches.

#include <voxelpipe/device/base/stage_clock.cuh>
#include <voxelpipe/device/scene/scene_memory.cuh>
#include <voxelpipe/solid/device/emit_crossings.cuh>
#include <voxelpipe/solid/device/exterior.cuh>
#include <voxelpipe/solid/device/exterior_sides.cuh>
#include <voxelpipe/solid/device/fill_rows.cuh>
#include <voxelpipe/solid/device/solid_cones.cuh>
#include <voxelpipe/solid/device/solid_cover.cuh>
#include <voxelpipe/solid/device/winding.cuh>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace voxelpipe::device {

// All but the draws and the output that the launches of a call depend on.
struct solid_plan {
    grid g;
    solid_options options;
    std::uint32_t num_primitives;
    capacities limits;
};

// The draws of a call, and their entries.
template <class Draw>
struct solid_entries;
template <class Mesh, class VertexShader, class SolidShader>
struct solid_entries<draw<Mesh, VertexShader, SolidShader>> {
    using draw_type = draw<Mesh, VertexShader, SolidShader>;
    using solid_shader = SolidShader;

    std::span<const draw_type> draws;
    std::span<const cone_part> cones; // of each body, or none
    solid_plan plan;
    stage_clock* clock = nullptr;

    // num_primitives: with the triangles of the cones.
    solid_entries(std::span<const draw_type> draws_, const grid& g, const solid_options& options,
                  std::uint32_t num_primitives, const capacities& limits, std::span<const cone_part> cones_ = {})
        : draws(draws_), cones(cones_) {
        std::memset(static_cast<void*>(&plan), 0, sizeof(plan)); // padding is part of a graph's key
        plan.g = g;
        plan.options = options;
        plan.num_primitives = num_primitives;
        plan.limits = limits;
    }

    // True if entries, keys and work items of the call can be numbered.
    [[nodiscard]] bool fits() const {
        return plan.limits.fragments <= max_listed_entries && num_keys() <= (uint128{1} << 64) &&
               row_triangles::holds(plan.num_primitives, plan.g.extent);
    }
    [[nodiscard]] bool has_cover() const { return makes_sets() || plan.options.extent != solid_extent::centre; }
    // Bodies are sets of voxels that no crossings are swept for.
    [[nodiscard]] bool makes_sets() const {
        return plan.options.repair == repair::exterior || plan.options.repair == repair::vote ||
               plan.options.repair == repair::winding;
    }
    // A body a draw, of several.
    [[nodiscard]] bool is_split() const { return plan.options.bodies == bodies::draw && draws.size() > 1; }
    [[nodiscard]] row_grid rows() const { return {plan.g.extent, core::make_snap_transform(plan.g).fraction}; }
    [[nodiscard]] sweep_rules rules() const {
        const solid_extent extent = makes_sets() ? solid_extent::outer : plan.options.extent;
        return {rows(), plan.g.offset, plan.options.rule, extent, plan.options.count_voxels, !makes_sets()};
    }
    // The mesh is read, shaded and snapped by the kernel that makes the crossings: once a corner, not once a vertex.
    [[nodiscard]] bool shades_on_the_spot() const {
        return is_cheap<VertexShader> && draws.size() == 1 && cones.empty() && !has_cover();
    }

    struct memory {
        vertex_positions positions{};
        std::uint32_t* codes = nullptr; // of vertices, where they are shaded on the spot
        draw_geometry* geometries = nullptr;
        SolidShader* shaders = nullptr; // by draw, where they differ
        row_triangles kept{};
        crossing_memory list;
        row_groups by_row;
        cover_memory cover;
        exterior_memory exterior;
        vote_memory vote;
        side_memory sides;
        winding_memory winding;
    };
    // Crossings toggle bits, are grouped by row, or go into one list that is sorted, and the cover with them.
    enum class crossing_use { toggles, groups, sorts };
    // counts: of the rows, for crossing_use::groups.
    [[nodiscard]] memory take(arena& a, crossing_use use = crossing_use::sorts, std::uint32_t* counts = nullptr) const {
        memory m;
        std::size_t vertices = 0, most = 0;
        for (const draw_type& d : draws) {
            vertices += d.mesh.num_vertices();
            most = std::max<std::size_t>(most, d.mesh.num_triangles());
        }
        for (const cone_part& c : cones) most = std::max(most, std::size_t{c.num_triangles});
        if (shades_on_the_spot())
            m.codes = a.take<std::uint32_t>(vertices);
        else
            m.positions = vertex_positions::take(a, vertices);
        m.geometries = a.take<draw_geometry>(num_parts() > 1 ? num_parts() : 0);
        if (is_split()) m.shaders = a.take<SolidShader>(draws.size());
        m.kept = row_triangles::take(a, plan.num_primitives);
        if (use == crossing_use::sorts)
            m.list = crossing_memory::take(a, plan.limits.fragments, num_keys(), num_bodies());
        if (use == crossing_use::groups)
            m.by_row = row_groups::take(a, plan.limits.fragments, rows().num_rows(), counts);
        if (has_cover()) m.cover = cover_memory::take(a, most, plan.g, plan.limits);
        if (plan.options.repair == repair::exterior && plan.options.slab == nullptr)
            m.exterior = exterior_memory::take(a, plan.g.extent, plan.options.closing);
        if (plan.options.repair == repair::exterior && !plan.options.with_cover)
            m.sides = side_memory::take(a, plan.g.extent);
        if (plan.options.repair == repair::vote) m.vote = vote_memory::take(a, plan.g.extent);
        if (plan.options.repair == repair::winding) m.winding = winding_memory::take(a, rows(), num_bodies(), cones);
        return m;
    }
    [[nodiscard]] body_shaders<SolidShader> shaders(const memory& m, cudaStream_t stream) const {
        if (!is_split()) return {draws[0].fragment_shader, nullptr};
        upload(
            m.shaders, draws.size(), [&](std::size_t d) { return draws[d].fragment_shader; }, stream);
        return {draws[0].fragment_shader, m.shaders};
    }

    // Lists all entries and sorts them; state->list_fragments says how many there are.
    [[nodiscard]] crossing_list launch(const memory& m, pipeline_state* state, cudaStream_t stream) const {
        const crossing_appender sink{m.list.list(), is_split(), static_cast<std::uint32_t>(draws.size())};
        if (makes_sets())
            emit_sets(m, sink.list, state, stream);
        else
            emit(m, sink, {}, state, stream);
        const crossing_list sorted = sort_crossings(m.list, state, plan.limits, stream);
        end_stage(clock, &stage_times::tile_sort);
        return sorted;
    }
    // Groups the crossings by row, in memory that is taken for crossing_use::groups. The cover stays in its mask.
    void launch_groups(const memory& m, pipeline_state* state, cudaStream_t stream) const {
        if (makes_sets())
            emit_sets(m, {}, state, stream);
        else
            emit(m, crossing_appender{m.by_row.list, false, static_cast<std::uint32_t>(draws.size()), m.by_row.counts},
                 {}, state, stream);
        group_by_row(m.by_row, rows().num_rows(), state, plan.limits, stream);
        end_stage(clock, &stage_times::tile_sort);
    }
    // Gives all crossings to a sink, and the list the cover where that is wanted. zeros: memory that is to be zero
    // before; none unless shades_on_the_spot.
    template <class Sink>
    void emit(const memory& m, const Sink& sink, const zeroed_memory& zeros, pipeline_state* state,
              cudaStream_t stream) const {
        const row_triangles kept = m.kept.with(state);
        if constexpr (is_cheap<VertexShader>) {
            if (shades_on_the_spot()) {
                const draw_type& d = draws[0];
                const shaded_triangles<Mesh, VertexShader> triangles{
                    {d.mesh, d.vertex_shader, core::make_snap_transform(plan.g), 0},
                    m.codes,
                    plan.num_primitives,
                    static_cast<std::uint32_t>(d.mesh.positions.size())};
                find_row_codes(triangles, rows(), zeros, state, stream);
                end_stage(clock, &stage_times::vertex_shade);
                emit_crossings(triangles, rows(), sink, kept, state, stream);
                end_stage(clock, &stage_times::coarse_raster);
                return;
            }
        }
        std::vector<draw_geometry> geometry_of;
        const geometry geo = shade(m, geometry_of, stream);
        emit_crossings(stored_triangles{geo, rows(), plan.num_primitives, num_drawn(geometry_of)}, rows(), sink, kept,
                       state, stream);
        end_stage(clock, &stage_times::coarse_raster);
        if constexpr (Sink::is_listing)
            if (has_cover()) emit_cover(m, geo, geometry_of, sink.list, state, stream);
    }

private:
    [[nodiscard]] std::size_t num_parts() const { return draws.size() + cones.size(); }
    // Triangles of the draws, which are counted.
    [[nodiscard]] std::uint32_t num_drawn(const std::vector<draw_geometry>& geometry_of) const {
        return cones.empty() ? plan.num_primitives : geometry_of[draws.size()].first_primitive;
    }
    [[nodiscard]] std::uint32_t num_bodies() const { return is_split() ? static_cast<std::uint32_t>(draws.size()) : 1; }
    [[nodiscard]] uint128 num_keys() const { return static_cast<uint128>(rows().num_rows()) * num_bodies(); }

    [[nodiscard]] geometry shade(const memory& m, std::vector<draw_geometry>& geometry_of, cudaStream_t stream) const {
        geometry geo{};
        geo.num_draws = static_cast<std::uint32_t>(num_parts());
        geo.num_primitives = plan.num_primitives;
        geo.snap = core::make_snap_transform(plan.g);
        geo.extent = plan.g.extent;
        std::size_t vertex = 0;
        std::uint32_t primitive = 0;
        for (std::size_t d = 0; d < draws.size(); ++d) {
            const Mesh& mesh = draws[d].mesh;
            const vertex_positions positions = m.positions.from(vertex);
            geometry_of.push_back(geometry_from(mesh, positions, primitive));
            vertex_shade(mesh, draws[d].vertex_shader, geo.snap, static_cast<std::uint32_t>(d), positions,
                         static_cast<no_varyings*>(nullptr), stream); // a solid has none
            vertex += mesh.num_vertices();
            primitive += static_cast<std::uint32_t>(mesh.num_triangles());
        }
        for (const cone_part& c : cones) {
            geometry_of.push_back(c.geometry);
            geometry_of.back().first_primitive = primitive;
            primitive += c.num_triangles;
        }
        geo.one = geometry_of[0];
        if (num_parts() > 1) {
            upload(
                m.geometries, num_parts(), [&](std::size_t d) { return geometry_of[d]; }, stream);
            geo.many = m.geometries;
        }
        end_stage(clock, &stage_times::vertex_shade);
        return geo;
    }
    // Calls f(body, first draw, behind its last draw).
    template <class F>
    void for_each_body(F&& f) const {
        for (std::size_t d = 0; d < draws.size(); d = is_split() ? d + 1 : draws.size())
            f(is_split() ? static_cast<std::uint32_t>(d) : 0u, d, is_split() ? d + 1 : draws.size());
    }
    // The mask of a body's cover, with the cones of repair::close_holes.
    void cover_body(const memory& m, const geometry& geo, const std::vector<draw_geometry>& geometry_of,
                    std::uint32_t body, std::size_t first, std::size_t last, pipeline_state* state,
                    cudaStream_t stream) const {
        m.cover.clear(plan.g, stream);
        for (std::size_t d = first; d < last; ++d)
            raster_cover(m.cover, geometry_of[d], static_cast<std::uint32_t>(draws[d].mesh.num_triangles()), geo,
                         plan.g, state, stream);
        if (plan.options.repair == repair::close_holes)
            raster_cover(m.cover, geometry_of[draws.size() + body], cones[body].num_triangles, geo, plan.g, state,
                         stream);
    }
    // Bodies that repair::exterior, vote or winding decides, as runs of cover, or of one body as the mask. Waits.
    void emit_sets(const memory& m, const crossing_list& list, pipeline_state* state, cudaStream_t stream) const {
        std::vector<draw_geometry> geometry_of;
        const geometry geo = shade(m, geometry_of, stream);
        m.cover.start(stream);
        const bool is_winding = plan.options.repair == repair::winding;
        if (is_winding) {
            m.winding.clear(rows(), num_bodies(), stream);
            const winding_adder sink = m.winding.adder(rows(), is_split(), static_cast<std::uint32_t>(draws.size()));
            emit_crossings(stored_triangles{geo, rows(), plan.num_primitives, num_drawn(geometry_of)}, rows(), sink,
                           m.kept.with(state), state, stream);
        }
        const bool votes_alone = plan.options.repair == repair::vote && !plan.options.with_cover;
        for_each_body([&](std::uint32_t body, std::size_t first, std::size_t last) {
            const std::uint32_t begin = geometry_of[first].first_primitive,
                                end =
                                    last < geometry_of.size() ? geometry_of[last].first_primitive : plan.num_primitives;
            const stored_triangles all{geo, rows(), plan.num_primitives, plan.num_primitives};
            if (votes_alone)
                m.cover.clear(plan.g, stream);
            else if (!is_winding || plan.options.extent != solid_extent::centre)
                cover_body(m, geo, geometry_of, body, first, last, state, stream);
            if (is_winding) {
                // Behind the draws are the cones, body by body.
                const std::uint32_t first_cone = geometry_of[draws.size() + body].first_primitive;
                const winding_triangles of_body{begin, end, first_cone, first_cone + cones[body].num_triangles};
                add_windings(m.winding, cones[body].tree, geo, of_body, rows(), plan.options.rule, plan.options.extent,
                             body, m.cover.mask, state, stream);
            } else if (plan.options.repair == repair::exterior && plan.options.slab != nullptr) {
                // The cover has counted the triangles; the inside is known.
                copy_from_slab(m.cover.mask, plan.options.slab->inside, {plan.g.extent}, plan.g.extent.z, stream);
            } else if (plan.options.repair == repair::exterior) {
                if (!plan.options.with_cover) m.sides.keep_cover(m.cover.mask, stream);
                fill_to_exterior(m.exterior, m.cover.mask, stream);
                if (!plan.options.with_cover)
                    drop_seen(m.sides, all, begin, end - begin, rows(), m.cover.mask, state, stream);
            } else {
                add_votes(m.vote, all, begin, end - begin, rows(), plan.options.slab, m.cover.mask, state, stream);
            }
            if (m.by_row.counts == nullptr) list_cover(m.cover, rows(), list, body, state, stream);
        });
        if (plan.options.repair == repair::exterior) {
            take_counts(m.cover, state, stream);
        }
        end_stage(clock, &stage_times::fine_raster);
    }
    void emit_cover(const memory& m, const geometry& geo, const std::vector<draw_geometry>& geometry_of,
                    const crossing_list& list, pipeline_state* state, cudaStream_t stream) const {
        m.cover.start(stream);
        for_each_body([&](std::uint32_t body, std::size_t first, std::size_t last) {
            cover_body(m, geo, geometry_of, body, first, last, state, stream);
            if (m.by_row.counts == nullptr) list_cover(m.cover, rows(), list, body, state, stream);
        });
        end_stage(clock, &stage_times::fine_raster);
    }
};

} // namespace voxelpipe::device
