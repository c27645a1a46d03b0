// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Voxels of a solid call as words of 32 bits along x, beam by beam: the conservative cover of each body, for
// solid_extent::outer and inner. Memory is in proportion to the surface.

#include <cpu_ref/constant_tile.hpp>
#include <cpu_ref/solid/solid_crossings.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace voxelpipe::cpu {

// Bits of one body in one row of a beam.
struct row_word {
    std::uint32_t row; // place in the beam
    std::uint32_t draw;
    std::uint32_t word; // x / 32
    std::uint32_t bits;
};

// The words of one beam by row, draw and word.
struct beam_words {
    std::uint64_t beam;
    std::vector<row_word> words;
};

inline void sort_words(std::vector<row_word>& words) {
    std::sort(words.begin(), words.end(), [](const row_word& a, const row_word& b) {
        return a.row != b.row ? a.row < b.row : a.draw != b.draw ? a.draw < b.draw : a.word < b.word;
    });
}

// Appends the words of one tile, whose touched voxels become untouched. `lead`: where they begin in the tile.
inline void take_words(constant_scratch& scratch, const glm::ivec3& lead, std::uint32_t draw, std::uint32_t word,
                       std::vector<row_word>& to) {
    const auto first = static_cast<std::uint32_t>(lead.z * tile_size + lead.y);
    for (std::size_t row = 0; row < tile_rows; ++row) {
        const std::uint32_t bits = scratch.touched[row];
        if (bits == 0) continue;
        to.push_back({first + static_cast<std::uint32_t>(row), draw, word, bits << lead.x});
        scratch.touched[row] = 0;
    }
}

// The cover of every body.
struct cover_list {
    status_code code = status_code::ok;
    counters counts{};             // as conservative coverage has them
    std::vector<beam_words> beams; // each that has any, ascending
};

template <class Key>
[[nodiscard]] cover_list find_cover(const execution& how, const solid_geometry& s) {
    const core::tile_grid tiles(s.where.extent, log2_tile_size);
    auto coarse = coarse_raster<coverage::conservative, Key>(how, s, tiles);
    cover_list cover{coarse.code, coarse.counts, {}};
    if (coarse.code != status_code::ok) return cover;
    const std::vector<tile_range> ranges = tile_sort(how, coarse.pairs, tiles.count());
    const auto beam_of = [&](const tile_range& r) { return r.tile / static_cast<std::uint64_t>(tiles.tiles.x); };

    how.enter(stage::fine_raster);
    const stopwatch watch(how.times, &stage_times::fine_raster);
    std::vector<std::size_t> first; // of each beam's ranges
    for (std::size_t i = 0; i < ranges.size(); ++i)
        if (i == 0 || beam_of(ranges[i]) != beam_of(ranges[i - 1])) first.push_back(i);
    first.push_back(ranges.size());
    const std::size_t num_beams = first.size() - 1;
    cover.beams.resize(num_beams);
    std::vector<std::unique_ptr<constant_scratch>> scratch;
    for (unsigned w = 0; w < std::max(1u, how.threads); ++w) scratch.push_back(std::make_unique<constant_scratch>());
    parallel_for(how.threads, num_beams, [&](unsigned worker, std::size_t b) {
        beam_words& out = cover.beams[b];
        out.beam = beam_of(ranges[first[b]]);
        for (std::size_t r = first[b]; r < first[b + 1]; ++r) {
            const tile_range& range = ranges[r];
            const core::voxel_box tile = core::tile_box(tiles, range.tile, s.where.extent);
            const core::voxel_box box = core::intersect(tile, s.whole_box());
            const auto word = static_cast<std::uint32_t>(tiles.position(range.tile).x);
            for (std::size_t i = range.first; i < range.last;) {
                // Primitives ascend, and so do their bodies.
                std::size_t j = range.last;
                const auto part = s.find(coarse.pairs[i].primitive).draw;
                const std::uint32_t body = s.body[part];
                if (s.body.back() != body) {
                    std::size_t end = part;
                    while (end < s.body.size() && s.body[end] == body) ++end;
                    for (j = i + 1; j < range.last && coarse.pairs[j].primitive < s.first_primitive[end];) ++j;
                }
                cover_tile<coverage::conservative, false>(s, box, &coarse.pairs[i].primitive, sizeof(tile_pair<Key>),
                                                          j - i, *scratch[worker]);
                take_words(*scratch[worker], lowest(box) - lowest(tile), body, word, out.words);
                i = j;
            }
        }
        sort_words(out.words);
    });
    return cover;
}

} // namespace voxelpipe::cpu
