// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior: the complement of what a flood from outside the grid reaches, and with solid_options::with_cover
// off the side on which each touched voxel's centre lies.

#include <cpu_ref/solid/solid_repair.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

// The segments between the moved centres of neighbours along an axis that one body's triangles cross: bit w for the
// segment from voxel w - 1 to w, from that into the grid to that out of it.
template <int Axis>
[[nodiscard]] bit_grid crossed_segments(const solid_geometry& s, std::uint32_t draw) {
    glm::ivec3 e = s.where.extent;
    ++e[Axis];
    bit_grid crossed(e);
    for_each_crossing_of<Axis>(
        s, draw, std::numeric_limits<std::int64_t>::min(), [&](std::int64_t u, std::int64_t v, std::int64_t first) {
            if (first < 0 || first >= e[Axis]) return;
            const auto p = core::to_xyz(Axis, static_cast<int>(u), static_cast<int>(v), static_cast<int>(first));
            crossed.set(p[0], p[1], p[2]);
        });
    return crossed;
}

// Which touched voxels of one body are outside although the flood does not reach them: their centre sees that of a
// voxel, one or two away along an axis, that it reaches and no triangle touches.
class seen_from_outside {
public:
    // touched, outside: with a ring of `ring` voxels around the grid, all of which is outside; kept, not owned.
    seen_from_outside(const execution& how, const solid_geometry& s, std::uint32_t draw, const bit_grid& touched,
                      const bit_grid& outside, int ring)
        : touched_(touched), outside_(outside), ring_(ring) {
        parallel_for(how.threads, 3, [&](unsigned, std::size_t axis) {
            if (axis == 0) crossed_[0].emplace(crossed_segments<0>(s, draw));
            if (axis == 1) crossed_[1].emplace(crossed_segments<1>(s, draw));
            if (axis == 2) crossed_[2].emplace(crossed_segments<2>(s, draw));
        });
    }
    // Bits of the 32 voxels from x on, a multiple of 32. Those beyond the grid have no meaning.
    [[nodiscard]] std::uint32_t operator()(int x, int y, int z) const {
        const std::uint32_t touched = touched_.get_bits(x + ring_, y + ring_, z + ring_);
        if (touched == 0) return 0;
        std::uint32_t seen = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const glm::ivec3 step(axis == 0 ? 1 : 0, axis == 1 ? 1 : 0, axis == 2 ? 1 : 0);
            const glm::ivec3 here(x, y, z);
            // One voxel down, then two; and up.
            std::uint32_t clear = ~crossed(axis, here);
            seen |= open(here - step) & clear;
            clear &= ~crossed(axis, here - step);
            seen |= open(here - 2 * step) & clear;
            clear = ~crossed(axis, here + step);
            seen |= open(here + step) & clear;
            clear &= ~crossed(axis, here + 2 * step);
            seen |= open(here + 2 * step) & clear;
        }
        return touched & seen;
    }

private:
    [[nodiscard]] std::uint32_t open(const glm::ivec3& at) const {
        const glm::ivec3 p = at + ring_;
        return outside_.get_bits(p.x, p.y, p.z) & ~touched_.get_bits(p.x, p.y, p.z);
    }
    // Segments beyond the first and the last of a row are not crossed: what lies there is outside.
    [[nodiscard]] std::uint32_t crossed(int axis, const glm::ivec3& at) const {
        const bit_grid& c = *crossed_[axis];
        const glm::ivec3 e = c.extent();
        if (at.y < 0 || at.z < 0 || at.y >= e.y || at.z >= e.z) return 0;
        return at.x < 0 ? c.get_bits(0, at.y, at.z) << -at.x : c.get_bits(at.x, at.y, at.z);
    }

    const bit_grid &touched_, &outside_;
    int ring_;
    std::optional<bit_grid> crossed_[3];
};

// Each body's complement of what a flood from outside the grid reaches, through voxels further than `closing` from its
// cover in the max norm; grown back by as much.
[[nodiscard]] inline std::vector<beam_words> find_interior(const execution& how, const solid_geometry& s,
                                                           const solid_options& options,
                                                           std::vector<beam_words>&& cover) {
    const stopwatch watch(how.times, &stage_times::fine_raster);
    const row_numbers rows(s.where.extent);
    std::vector<beam_words> beams;
    const int ring = options.closing + (options.with_cover ? 1 : 2); // with what touched voxels look at
    for (std::uint32_t draw = 0; draw <= s.body.back(); ++draw) {
        bit_grid grid(s.where.extent + 2 * ring);
        for_each_word(cover, rows, draw, [&](int x, int y, int z, std::uint32_t bits) {
            grid.set_bits(x + ring, y + ring, z + ring, bits);
        });
        std::optional<bit_grid> touched;
        if (!options.with_cover) touched = grid;
        core::dilate(grid, options.closing, how.threads);
        grid = core::flood(grid);
        core::dilate(grid, options.closing, how.threads);
        std::optional<seen_from_outside> seen;
        if (touched) seen.emplace(how, s, draw, *touched, grid, ring);
        if (draw == 0) beams = all_beams(rows); // behind the grid, which is what there may be no memory for
        add_bits(how, rows, s.whole_box(), draw, beams, [&](int x, int y, int z) {
            const std::uint32_t inside = ~grid.get_bits(x + ring, y + ring, z + ring);
            return seen ? inside & ~(*seen)(x, y, z) : inside;
        });
    }
    end_beams(how, beams);
    return beams;
}

// The interior of a slab, all of whose voxels a flood of the whole grid has decided.
[[nodiscard]] inline std::vector<beam_words> take_interior(const execution& how, const solid_geometry& s,
                                                           const solid_slab& slab) {
    const stopwatch watch(how.times, &stage_times::fine_raster);
    const row_numbers rows(s.where.extent);
    std::vector<beam_words> beams = all_beams(rows);
    add_bits(how, rows, s.whole_box(), 0, beams, slab_bits(slab.inside, s));
    end_beams(how, beams);
    return beams;
}

// The code and the counts that a cover has, of its triangles.
[[nodiscard]] inline cover_list count_triangles(const solid_geometry& s) {
    cover_list none;
    const core::voxel_box whole = s.whole_box();
    for (const geometry::part& p : s.parts)
        for (std::uint32_t i = 0; i < p.num_triangles; ++i) {
            const glm::uvec3 t = p.triangles[i];
            if (t.x >= p.num_vertices || t.y >= p.num_vertices || t.z >= p.num_vertices) {
                none.code = status_code::index_out_of_range;
                return none;
            }
            core::voxel_box reach{};
            core::count_class(none.counts,
                              core::classify<coverage::conservative>(p.positions[t.x], p.positions[t.y],
                                                                     p.positions[t.z], s.snap.fraction, whole, reach));
        }
    none.counts.triangles_in = s.triangles_in;
    return none;
}

} // namespace voxelpipe::cpu
