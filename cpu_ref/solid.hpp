// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A solid call on the CPU: vertex shade -> crossings of all triangles with the rows along x -> sort by row -> sweep,
// beam by beam, into targets or lists. The multiset of crossings fixes the result, so it is the same for any number of
// threads and any order of the triangles.

#include <cpu_ref/solid_lists.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace voxelpipe::cpu {

template <class Mesh, class VertexShader, class SolidShader>
[[nodiscard]] solid_geometry make_solid_geometry(const execution& how,
                                                 std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                                 const grid& g, const solid_options& options) {
    solid_geometry s;
    s.where = g;
    s.snap = core::make_snap_transform(g);
    s.vertices = shade_vertices<no_varyings>(how, draws, s.snap);
    std::uint32_t first = 0;
    for (std::size_t d = 0; d < draws.size(); ++d) {
        const auto& mesh = draws[d].mesh;
        s.parts.push_back({mesh.triangles, s.vertices[d].positions.get(), mesh.positions.size()});
        s.body.push_back(options.bodies == bodies::draw ? static_cast<std::uint32_t>(d) : 0);
        s.is_repair.push_back(false);
        s.first_primitive.push_back(first);
        first += static_cast<std::uint32_t>(mesh.triangles.size());
    }
    s.first_primitive.push_back(first);
    s.triangles_in = first;
    return s;
}

// The crossings and the cover of the geometry, then `finish(sweep, status so far)`.
template <class Crossing, class Finish>
[[nodiscard]] status run_sweep(const execution& how, const solid_geometry& s, const solid_options& options,
                               bool needs_winding, status result, const Finish& finish) {
    auto found = find_crossings<Crossing>(how, s);
    if (found.code != status_code::ok) {
        status failed = core::failure(found.code, stage::coarse_raster);
        failed.counts.triangles_in = s.triangles_in;
        return failed;
    }
    result.counts = found.counts;
    std::vector<beam_words> cover;
    if (options.extent != solid_extent::centre) {
        const bool small_keys = core::tile_grid(s.where.extent, log2_tile_size).count() <= std::uint64_t{1} << 32;
        cover = small_keys ? find_cover<std::uint32_t>(how, s) : find_cover<std::uint64_t>(how, s);
    }
    const solid_sweep<Crossing> sweep(s.where.extent, options, needs_winding, std::move(found.crossings),
                                      std::move(cover));
    return finish(sweep, result);
}

// finish is called with a sweep of either kind of crossings.
template <class Mesh, class VertexShader, class SolidShader, class Finish>
[[nodiscard]] status run_solid(const execution& how, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                               const grid& g, const solid_options& options, const Finish& finish) {
    const solid_geometry s = make_solid_geometry(how, draws, g, options);
    constexpr bool needs_winding = shader_reads_winding<draw<Mesh, VertexShader, SolidShader>>;
    const bool small_keys = row_numbers(g.extent).num_beams() * tile_rows <= std::uint64_t{1} << 32;
    if (options.bodies == bodies::call && small_keys)
        return run_sweep<call_crossing>(how, s, options, needs_winding, status{}, finish);
    return run_sweep<draw_crossing>(how, s, options, needs_winding, status{}, finish);
}

} // namespace voxelpipe::cpu
