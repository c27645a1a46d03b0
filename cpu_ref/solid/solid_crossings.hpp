// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The crossings of a solid call, sorted by row, and the numbers that rows have: rows lie in beams of 32 x 32, a row of
// tiles along x each, which are the pieces of work. Nothing here depends on the user's types.

#include <cpu_ref/pipeline.hpp>
#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/solid/core/holes.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/triangle_counts.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

// The triangles of a solid call: those of the draws, and cones that close their holes.
struct solid_geometry : geometry {
    std::vector<std::uint32_t> body; // per part: the draw that it belongs to; 0 where all are one body
    std::vector<bool> is_repair;     // per part: cones, which are not counted
    std::vector<shaded_vertices<no_varyings>> vertices; // owns the positions of the draws
    std::vector<core::hole_cones> cones;                // owns the others
    std::uint64_t triangles_in = 0;
};

// The number of a row: its beam (tiles.y * tile z + tile y), then its place in the beam.
struct row_numbers {
    core::tile_grid tiles;
    glm::ivec3 extent;

    explicit row_numbers(glm::ivec3 grid_extent) : tiles(grid_extent, log2_tile_size), extent(grid_extent) {}
    [[nodiscard]] std::uint64_t num_beams() const {
        return static_cast<std::uint64_t>(tiles.tiles.y) * static_cast<std::uint64_t>(tiles.tiles.z);
    }
    [[nodiscard]] std::uint64_t number(std::int64_t y, std::int64_t z) const {
        const auto beam = (z >> log2_tile_size) * tiles.tiles.y + (y >> log2_tile_size);
        const auto place = (z & (tile_size - 1)) << log2_tile_size | (y & (tile_size - 1));
        return static_cast<std::uint64_t>(beam) * tile_rows + static_cast<std::uint64_t>(place);
    }
    [[nodiscard]] int y(std::uint64_t row) const {
        return static_cast<int>(row / tile_rows % static_cast<std::uint64_t>(tiles.tiles.y)) * tile_size +
               static_cast<int>(row % tile_size);
    }
    [[nodiscard]] int z(std::uint64_t row) const {
        return static_cast<int>(row / tile_rows / static_cast<std::uint64_t>(tiles.tiles.y)) * tile_size +
               static_cast<int>(row / tile_size % tile_size);
    }
    [[nodiscard]] std::size_t words() const { return static_cast<std::size_t>(tiles.tiles.x); }
};

// A crossing of a row and a triangle: the first voxel beyond it, from the lowest that is drawn to the extent, and twice
// that if it enters, one more if it leaves. One body needs no draw; 32 bits number the rows of every grid that a
// framebuffer holds.
struct call_crossing {
    std::uint32_t key; // row number
    std::uint32_t at;
    static constexpr std::uint32_t draw = 0;
    call_crossing() = default;
    call_crossing(std::uint64_t row, std::uint32_t at_, std::uint32_t)
        : key(static_cast<std::uint32_t>(row)), at(at_) {}
};
struct draw_crossing {
    std::uint64_t key;
    std::uint32_t at;
    std::uint32_t draw;
    draw_crossing() = default;
    draw_crossing(std::uint64_t row, std::uint32_t at_, std::uint32_t draw_) : key(row), at(at_), draw(draw_) {}
};
[[nodiscard]] constexpr std::uint32_t crossing_voxel(std::uint32_t at) { return at >> 1; }
[[nodiscard]] constexpr int crossing_winding(std::uint32_t at) { return (at & 1) != 0 ? -1 : 1; }

template <class Crossing>
struct crossing_list {
    status_code code = status_code::ok;
    counters counts{};             // of the draws' triangles
    raw_array<Crossing> crossings; // by row, and in a row by primitive, hence by body
};

// Counts primitives from `begin` to `end`, and appends their crossings.
template <class Crossing>
[[nodiscard]] status_code read_triangles(const solid_geometry& s, const row_numbers& rows, std::size_t begin,
                                         std::size_t end, bool votes, counters& counts, std::vector<Crossing>& found) {
    const core::voxel_box whole = s.whole_box();
    const int fraction = s.snap.fraction;
    for (std::size_t i = begin; i < end;) {
        const std::uint32_t number = s.find(static_cast<std::uint32_t>(i)).draw;
        const geometry::part& part = s.parts[number];
        // Up to the end of an instance.
        const core::instanced_triangles& of_part = part.triangles;
        const auto at = of_part.find(static_cast<std::uint32_t>(i - s.first_primitive[number]));
        const std::size_t last = std::min<std::size_t>(end, i - at.triangle + of_part.each);
        const glm::uvec3* triangle = of_part.triangles + at.triangle;
        const core::snapped_position* const positions =
            part.positions + std::size_t{at.instance} * of_part.vertices_each;
        const std::uint32_t body = s.body[number];
        counters seen{};
        for (; i < last; ++i, ++triangle) {
            const glm::uvec3 t = *triangle;
            if (t.x >= of_part.vertices_each || t.y >= of_part.vertices_each || t.z >= of_part.vertices_each)
                return status_code::index_out_of_range;
            const core::snapped_position &a = positions[t.x], &b = positions[t.y], &c = positions[t.z];
            const core::triangle_class kind = core::classify_for_rows(a, b, c, fraction, whole, votes);
            core::count_class(seen, kind);
            if (kind != core::triangle_class::drawn) continue;
            const core::row_box box = core::rows_within<0>(a, b, c, fraction, whole);
            if (box.empty()) continue;
            core::for_each_crossing<0, core::centre_offset<>>(
                a, b, c, fraction, box, [&](std::int64_t y, std::int64_t z, std::int64_t first, int winding) {
                    const auto x =
                        static_cast<std::uint32_t>(std::clamp<std::int64_t>(first, s.lead.x, s.where.extent.x));
                    found.emplace_back(rows.number(y, z), 2 * x + (winding > 0 ? 0 : 1), body);
                });
        }
        if (!s.is_repair[number]) core::add_triangles(counts, seen);
    }
    return status_code::ok;
}

// Reads every triangle once: counts it, and finds its crossings with the rows of the grid. `votes`: rows along y and z
// will be asked too, so that more triangles take part.
template <class Crossing>
[[nodiscard]] crossing_list<Crossing> find_crossings(const execution& how, const solid_geometry& s, bool votes) {
    how.enter(stage::coarse_raster);
    crossing_list<Crossing> all;
    const row_numbers rows(s.where.extent);
    {
        const stopwatch watch(how.times, &stage_times::coarse_raster);
        constexpr std::size_t block = 8192;
        const std::size_t n = s.first_primitive.back();
        const std::size_t blocks = (n + block - 1) / block;
        struct block_result {
            status_code code = status_code::ok;
            counters counts{};
            std::vector<Crossing> crossings;
        };
        std::vector<block_result> parts(blocks);
        parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
            block_result& part = parts[b];
            std::vector<Crossing> found;
            counters counts{};
            part.code = read_triangles(s, rows, b * block, std::min(n, (b + 1) * block), votes, counts, found);
            part.crossings = std::move(found);
            part.counts = counts;
        });

        std::vector<std::size_t> first(blocks + 1, 0);
        for (std::size_t b = 0; b < blocks; ++b) {
            const block_result& part = parts[b];
            if (part.code != status_code::ok) {
                all.code = part.code;
                return all;
            }
            core::add_triangles(all.counts, part.counts);
            first[b + 1] = first[b] + part.crossings.size();
        }
        all.counts.triangles_in = s.triangles_in;
        all.crossings = raw_array<Crossing>(first[blocks]);
        parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
            std::copy(parts[b].crossings.begin(), parts[b].crossings.end(), all.crossings.begin() + first[b]);
            parts[b].crossings = {};
        });
    }
    how.enter(stage::tile_sort);
    const stopwatch watch(how.times, &stage_times::tile_sort);
    radix_sort(how.threads, all.crossings, static_cast<int>(std::bit_width(rows.num_beams() * tile_rows - 1)));
    return all;
}

} // namespace voxelpipe::cpu
