// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A solid call on the CPU: vertex shade -> crossings of all triangles with the rows along x -> sort by row -> sweep,
// beam by beam, into targets or lists. The multiset of crossings fixes the result, so it is the same for any number of
// threads and any order of the triangles.

#include <cpu_ref/solid/solid_exterior.hpp>
#include <cpu_ref/solid/solid_lists.hpp>
#include <cpu_ref/solid/solid_repair.hpp>
#include <cpu_ref/solid/solid_vote.hpp>
#include <cpu_ref/solid/solid_winding.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace voxelpipe::cpu {

template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] solid_geometry make_solid_geometry(const execution& how,
                                                 std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                 const grid& g, const glm::ivec3& lead, const solid_options& options) {
    solid_geometry s;
    s.where = g;
    s.lead = lead;
    s.snap = core::make_snap_transform(g);
    s.vertices = shade_vertices<no_varyings>(how, draws, s.snap);
    std::uint32_t first = 0;
    for (std::size_t d = 0; d < draws.size(); ++d) {
        const auto& mesh = draws[d].mesh;
        s.parts.push_back(make_part(mesh, s.vertices[d].positions.get()));
        s.body.push_back(options.bodies == bodies::draw ? static_cast<std::uint32_t>(d) : 0);
        s.is_repair.push_back(false);
        s.first_primitive.push_back(first);
        first += s.parts.back().num_triangles;
    }
    s.first_primitive.push_back(first);
    s.triangles_in = first;
    return s;
}

[[nodiscard]] inline status solid_failure(status_code code, const solid_geometry& s) {
    status failed = core::failure(code, stage::coarse_raster);
    failed.counts.triangles_in = s.triangles_in;
    return failed;
}

[[nodiscard]] inline cover_list find_cover(const execution& how, const solid_geometry& s) {
    const bool small_keys = core::tile_grid(s.where.extent, log2_tile_size).count() <= std::uint64_t{1} << 32;
    return small_keys ? find_cover<std::uint32_t>(how, s) : find_cover<std::uint64_t>(how, s);
}

// The crossings along x, and how many rows they leave open, for calls that need no more of them.
template <class Crossing>
void count_crossings(const raw_array<Crossing>& sorted, solid_counters& counts) {
    counts.crossings = sorted.size();
    for (std::size_t i = 0; i < sorted.size();) {
        const std::size_t first = i;
        while (i < sorted.size() && sorted[i].key == sorted[first].key && sorted[i].draw == sorted[first].draw) ++i;
        counts.open_rows += (i - first) % 2;
    }
}

// The crossings and the cover of the geometry, or what a repair makes of them, then finish(sweep, status so far).
template <class Crossing, class Finish>
[[nodiscard]] status run_sweep(const execution& how, const solid_geometry& s, solid_options options, bool needs_winding,
                               status result, const Finish& finish) {
    raw_array<Crossing> crossings;
    std::vector<beam_words> words;
    if (options.repair != repair::exterior) {
        auto found = find_crossings<Crossing>(how, s, options.repair == repair::vote);
        if (found.code != status_code::ok) return solid_failure(found.code, s);
        result.counts = found.counts;
        crossings = std::move(found.crossings);
    }
    const bool is_set =
        options.repair == repair::exterior || options.repair == repair::vote || options.repair == repair::winding;
    const bool is_decided = options.repair == repair::exterior && options.slab != nullptr;
    const bool is_winding = options.repair == repair::winding;
    const bool votes_alone = options.repair == repair::vote && !options.with_cover;
    if ((is_set && !is_winding && !votes_alone) || options.extent != solid_extent::centre) {
        cover_list cover = is_decided   ? count_triangles(s)
                           : is_winding ? find_cover(how, keep_parts(s, false))
                                        : find_cover(how, s);
        if (cover.code != status_code::ok) return solid_failure(cover.code, s);
        if (options.repair == repair::exterior) result.counts = cover.counts;
        words = std::move(cover.beams);
    }
    if (is_set) { // the sweep has nothing to do but hand the words on
        const solid_extent extent = options.extent;
        options.extent = solid_extent::outer;
        if (is_winding) {
            words =
                join_cover(how, find_windings(how, s, options.rule, crossings, result.solid), std::move(words), extent);
            crossings = {};
        } else if (options.repair == repair::vote) {
            count_crossings(crossings, result.solid);
            crossings = {};
            words = find_majority(how, s, options.slab, std::move(words));
        } else if (is_decided) {
            words = take_interior(how, s, *options.slab);
        } else {
            words = find_interior(how, s, options, std::move(words));
        }
    }
    solid_sweep<Crossing> sweep(s.where.extent, options, needs_winding, std::move(crossings), std::move(words));
    return finish(sweep, result);
}

// Draws the voxels of `g` from `lead` on. finish is called with a sweep of either kind of crossings.
template <class Mesh, class VertexShader, class SolidShader, class Finish>
[[nodiscard]] status run_solid(const execution& how, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                               const grid& g, const glm::ivec3& lead, const solid_options& options,
                               const Finish& finish) {
    solid_geometry s = make_solid_geometry(how, draws, g, lead, options);
    status result;
    if (core::has_cones(options.repair) && !add_cones(s, options, result.solid))
        return solid_failure(status_code::too_many_triangles, s);
    constexpr bool needs_winding = shader_reads_winding<draw<Mesh, VertexShader, SolidShader>>;
    const bool small_keys = row_numbers(g.extent).num_beams() * tile_rows <= std::uint64_t{1} << 32;
    if (options.bodies == bodies::call && small_keys)
        return run_sweep<call_crossing>(how, s, options, needs_winding, result, finish);
    return run_sweep<draw_crossing>(how, s, options, needs_winding, result, finish);
}

} // namespace voxelpipe::cpu
