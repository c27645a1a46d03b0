// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Solids into sparse framebuffers: the rows of a solid, tile by tile, as a source of fragments for sparse_pass.hpp. One
// sweep over all rows finds the tiles that have voxels and counts; a tile is then drawn from the crossings of its beam,
// those before it included. Beside the result, memory is in proportion to the crossings and the tiles. Calls that make
// tiles (sparse/passes/solid_bricks.hpp) need the rows alone, as runs.

#include <cpu_ref/solid/solid.hpp>
#include <cpu_ref/sparse/sparse_pass.hpp>
#include <voxelpipe/sparse/passes/solid_bricks.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace voxelpipe::cpu {

// A tile of a beam that has voxels of the solid.
struct solid_tile {
    std::uint64_t key; // Morton, in the whole grid
    std::size_t beam;
    std::size_t tile; // in the beam
};

// Marks the tiles of a beam that have voxels.
class tile_finder final : public row_sink {
public:
    explicit tile_finder(std::size_t tiles) : has_voxels_(tiles) {}
    void add(const row_of_body& r) override {
        for (std::size_t i = r.first_word; i <= r.last_word; ++i)
            if (r.mask[i] != 0) has_voxels_[i] = 1;
    }
    void end_row(int, int) override {}
    // `first`: of the beam, in the whole grid.
    void end_beam(std::size_t beam, const glm::ivec3& first) {
        for (std::size_t i = 0; i < has_voxels_.size(); ++i) {
            if (has_voxels_[i] == 0) continue;
            has_voxels_[i] = 0;
            found.push_back({core::morton_key(first + glm::ivec3(static_cast<int>(i), 0, 0)), beam, i});
        }
    }
    std::vector<solid_tile> found;

private:
    std::vector<std::uint8_t> has_voxels_;
};

// All tiles that have voxels of the solid, by key. `corner`: the first tile of the grid that is swept. Adds what the
// sweep counts.
template <class Crossing>
[[nodiscard]] std::vector<solid_tile> find_tiles(const execution& how, const solid_sweep<Crossing>& sweep,
                                                 std::size_t tiles_x, const glm::ivec3& corner,
                                                 solid_counters& counts) {
    const stopwatch watch(how.times, &stage_times::fine_raster);
    std::vector<std::unique_ptr<row_scratch>> scratch;
    std::vector<std::unique_ptr<tile_finder>> finders;
    for (std::size_t w = 0; w < std::min<std::size_t>(how.threads, std::max<std::size_t>(sweep.num_beams(), 1)); ++w) {
        scratch.push_back(sweep.make_scratch());
        finders.push_back(std::make_unique<tile_finder>(tiles_x));
    }
    parallel_for(how.threads, sweep.num_beams(), [&](unsigned worker, std::size_t beam) {
        sweep.sweep(beam, *scratch[worker], *finders[worker]);
        finders[worker]->end_beam(beam, corner + sweep.first_tile(beam));
    });
    add_counts(sweep, scratch, counts);
    std::vector<solid_tile> tiles;
    for (auto& f : finders) {
        tiles.insert(tiles.end(), f->found.begin(), f->found.end());
        f.reset();
    }
    std::sort(tiles.begin(), tiles.end(), [](const solid_tile& a, const solid_tile& b) { return a.key < b.key; });
    return tiles;
}

// Rows of one tile, whose voxels from `box` on are drawn: bodies of a row by ascending draw, as for dense targets.
template <class Draw, class... Targets>
class tile_shading_sink final : public row_sink {
public:
    tile_shading_sink(std::span<const Draw> draws, const glm::ivec3& offset, const core::voxel_box& box,
                      sparse_scratch<Targets...>& scratch)
        : draws_(draws), offset_(offset), low_(lowest(box)), scratch_(scratch) {}
    void add(const row_of_body& r) override {
        const auto& shader = draws_[r.draw].fragment_shader;
        const int lead = low_.x % tile_size, y = r.y - low_.y, z = r.z - low_.z;
        auto& shaded = scratch_.shaded;
        solid_fragment f{};
        f.voxel = offset_ + glm::ivec3(0, r.y, r.z);
        f.draw = r.draw;
        for_each_voxel(r, [&](int column, std::int64_t winding) {
            const int x = column - lead;
            f.voxel.x = offset_.x + low_.x + x;
            f.winding = winding;
            const auto out = shader(f);
            if (!out.keep) {
                ++shaded.counts.fragments_discarded;
                return;
            }
            ++shaded.counts.fragments;
            blend_in_tile<true>(scratch_.view, shaded, z * tile_size + y, x, x, y, z, out.values);
        });
    }
    void end_row(int, int) override {}

private:
    std::span<const Draw> draws_;
    glm::ivec3 offset_; // of the grid that is swept, in the whole one
    glm::ivec3 low_;
    sparse_scratch<Targets...>& scratch_;
};

// The same where all bodies give the same values: voxels are marked, and counted where that matters.
class tile_constant_sink final : public row_sink {
public:
    tile_constant_sink(const core::voxel_box& box, constant_scratch& scratch) : low_(lowest(box)), scratch_(scratch) {}
    void add(const row_of_body& r) override {
        std::uint32_t word = r.mask[0] >> (low_.x % tile_size);
        const int row = (r.z - low_.z) * tile_size + r.y - low_.y;
        scratch_.touched[static_cast<std::size_t>(row)] |= word;
        scratch_.counts.fragments += static_cast<unsigned>(std::popcount(word));
        if (scratch_.repeats == nullptr) return;
        for (; word != 0; word &= word - 1) ++scratch_.repeats[tile_voxel(row, std::countr_zero(word))];
    }
    void end_row(int, int) override {}

private:
    glm::ivec3 low_;
    constant_scratch& scratch_;
};

template <class Crossing, class Draw>
class solid_source {
public:
    // `g`: the grid that is swept. Adds what the sweep counts.
    solid_source(const execution& how, solid_sweep<Crossing>& sweep, std::span<const Draw> draws, const grid& g,
                 const solid_options& options, solid_counters& counts)
        : sweep_(sweep), draws_(draws), offset_(g.offset) {
        if constexpr (core::is_constant<solid_shader_of<Draw>>) all_same_ = has_same_values(draws, options.bodies);
        sweep.sort_rows(how);
        const core::tile_grid tiles(g.extent, log2_tile_size);
        tiles_ = find_tiles(how, sweep, static_cast<std::size_t>(tiles.tiles.x), offset_ / tile_size, counts);
    }

    [[nodiscard]] std::size_t num_tiles() const { return tiles_.size(); }
    [[nodiscard]] std::uint64_t key(std::size_t i) const { return tiles_[i].key; }
    [[nodiscard]] std::unique_ptr<row_scratch> make_scratch() const { return sweep_.make_scratch(); }

    template <class... Targets>
    void draw(std::size_t i, const core::voxel_box& box, bool keeps_sums, row_scratch* rows,
              sparse_scratch<Targets...>& scratch) const {
        const solid_tile& tile = tiles_[i];
        if constexpr (core::is_constant<solid_shader_of<Draw>>) {
            if (all_same_ && !keeps_sums) {
                if (needs_repeats(scratch.view)) scratch.count_repeats();
                tile_constant_sink sink(box, scratch.constant);
                sweep_.sweep_tile(tile.beam, tile.tile, *rows, sink);
                scratch.end_constant(draws_[0].fragment_shader.values);
                return;
            }
        }
        tile_shading_sink<Draw, Targets...> sink(draws_, offset_, box, scratch);
        sweep_.sweep_tile(tile.beam, tile.tile, *rows, sink);
        scratch.end_shaded();
    }

private:
    const solid_sweep<Crossing>& sweep_;
    std::span<const Draw> draws_;
    glm::ivec3 offset_;
    std::vector<solid_tile> tiles_;
    bool all_same_ = false;
};

// The rows of one thread as runs of voxels that lie in any body.
class run_sink final : public row_sink {
public:
    // `g`: the grid that is swept.
    explicit run_sink(const grid& g) : offset_(g.offset), touched_((static_cast<std::size_t>(g.extent.x) + 31) / 32) {}
    void add(const row_of_body& r) override {
        for (std::size_t i = r.first_word; i <= r.last_word; ++i) {
            touched_[i] |= r.mask[i];
            counts.fragments += static_cast<unsigned>(std::popcount(r.mask[i]));
        }
        first_ = std::min(first_, r.first_word);
        last_ = std::max(last_, r.last_word);
    }
    void end_row(int y, int z) override {
        const std::size_t before = bounds.size();
        bool is_in = false;
        const auto begin = static_cast<std::uint32_t>(offset_.x);
        for (std::size_t i = first_; i <= last_ && i < touched_.size(); ++i) {
            const std::uint32_t word = touched_[i];
            touched_[i] = 0;
            counts.voxels += static_cast<unsigned>(std::popcount(word));
            // A bit where a run begins or ends.
            for (std::uint32_t changes = word ^ (word << 1 | (is_in ? 1u : 0u)); changes != 0; changes &= changes - 1)
                bounds.push_back(begin + static_cast<std::uint32_t>(i) * 32 +
                                 static_cast<std::uint32_t>(std::countr_zero(changes)));
            is_in = (word >> 31) != 0;
        }
        if (is_in) bounds.push_back(begin + static_cast<std::uint32_t>(last_ + 1) * 32);
        first_ = touched_.size();
        last_ = 0;
        if (bounds.size() == before) return;
        places.push_back(core::morton_key(0, y + offset_.y, z + offset_.z));
        ends.push_back(bounds.size());
    }

    std::vector<std::uint64_t> places, ends; // of rows; where their bounds end
    std::vector<std::uint32_t> bounds;
    counters counts{};

private:
    glm::ivec3 offset_;
    std::vector<std::uint32_t> touched_;
    std::size_t first_ = touched_.size(), last_ = 0; // words that may be touched
};

// A call that makes_tiles. `sweep` is over g.
template <class Backend, class Crossing, class Draw, class... Targets>
[[nodiscard]] status draw_solid_tiles(const execution& how, Backend& backend, const solid_sweep<Crossing>& sweep,
                                      std::span<const Draw> draws, const grid& g, const solid_options& options,
                                      sparse_framebuffer<Backend, Targets...>& fb, status result) {
    how.enter(stage::fine_raster);
    const auto workers = std::max<std::size_t>(1, std::min<std::size_t>(how.threads, sweep.num_beams()));
    std::vector<std::unique_ptr<row_scratch>> scratch;
    std::vector<std::unique_ptr<run_sink>> sinks;
    for (std::size_t w = 0; w < workers; ++w) {
        scratch.push_back(sweep.make_scratch());
        sinks.push_back(std::make_unique<run_sink>(g));
    }
    sweep_all(how, sweep, sinks, scratch, result);
    std::size_t rows = 0, bounds = 0;
    for (const auto& s : sinks) {
        rows += s->places.size();
        bounds += s->bounds.size();
        result.counts.fragments += s->counts.fragments;
        result.counts.voxels += s->counts.voxels;
    }
    if (!options.count_voxels) result.counts.voxels = 0;
    const stopwatch watch(how.times, &stage_times::tile_resolve);
    how.enter(stage::tile_resolve);
    core::found_rows<Backend> found(backend);
    found.places = typename Backend::template buffer<std::uint64_t>(backend, rows);
    found.runs.first = typename Backend::template buffer<std::uint64_t>(backend, rows + 1);
    found.runs.bounds = typename Backend::template buffer<std::uint32_t>(backend, bounds);
    std::size_t row = 0, bound = 0;
    for (auto& s : sinks) {
        std::copy(s->places.begin(), s->places.end(), found.places.data() + row);
        std::copy(s->bounds.begin(), s->bounds.end(), found.runs.bounds.data() + bound);
        std::uint64_t begin = 0;
        for (const std::uint64_t end : s->ends) {
            found.runs.first.data()[row++] = bound + begin;
            begin = end;
        }
        bound += s->bounds.size();
        s.reset();
    }
    found.runs.first.data()[row] = bound;
    return core::store_solid_rows(backend, draws, g, std::move(found), result, fb);
}

// `sweep` is over tile_aligned(g).
template <class Backend, class Crossing, class Draw, class... Targets>
[[nodiscard]] status draw_sparse_solid(const execution& how, Backend& backend, solid_sweep<Crossing>& sweep,
                                       std::span<const Draw> draws, const grid& g, const solid_options& options,
                                       sparse_framebuffer<Backend, Targets...>& fb, status result) {
    how.enter(stage::fine_raster);
    const solid_source<Crossing, Draw> source(how, sweep, draws, tile_aligned(g), options, result.solid);
    return draw_sparse(how, backend, g, source, options.count_voxels, result, fb);
}

} // namespace voxelpipe::cpu
