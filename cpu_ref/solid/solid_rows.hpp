// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sweep: each row's crossings, in order, become winding numbers, and these and the cover become the row's voxels.
// Beam by beam; rows of a beam and bodies of a row in ascending order, so that whatever receives them may blend at
// once. Compiled once for all shaders and targets, which stand behind row_sink.

#include <cpu_ref/solid/solid_cover.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <vector>

namespace voxelpipe::cpu {

// Voxels of a row up to `end`, from the end of the span before.
struct winding_span {
    int end;
    std::int64_t winding;
};

// One body in one row, or in the 32 voxels of it that lie in a tile: the voxels of `mask`, whose words from first_word
// to last_word alone may be other than 0, and the winding numbers of all voxels, if the sink asked for them. Voxels
// count from the first one that `mask` has a bit for.
struct row_of_body {
    int y, z;
    std::uint32_t draw;
    const std::uint32_t* mask;
    std::size_t first_word, last_word;
    const winding_span* spans;
};

// Receives the rows of one thread: the bodies of a row by ascending draw, then its end.
class row_sink {
public:
    row_sink() = default;
    row_sink(const row_sink&) = delete; // stays where the threads know it
    row_sink& operator=(const row_sink&) = delete;
    virtual ~row_sink() = default;
    virtual void add(const row_of_body& body) = 0;
    virtual void end_row(int y, int z) = 0;
};

// A thread's memory for a row, as large as the largest row needs it, so that the sweep allocates nothing.
struct row_scratch {
    std::vector<std::uint32_t> mask;
    std::vector<std::uint32_t> order;
    std::vector<winding_span> spans;
    solid_counters counts{};
};

// Bits [first, last) of a row of words.
inline void fill_bits(std::uint32_t* words, std::size_t first, std::size_t last) {
    const std::size_t a = first / 32, b = last / 32;
    const std::uint32_t from = ~0u << first % 32, to = (1u << last % 32) - 1;
    if (a == b) {
        words[a] |= from & to;
        return;
    }
    words[a] |= from;
    for (std::size_t i = a + 1; i < b; ++i) words[i] = ~0u;
    if (to != 0) words[b] |= to;
}

template <class Crossing>
class solid_sweep {
public:
    // `cover`: what `extent` speaks of; it is empty for solid_extent::centre.
    solid_sweep(glm::ivec3 extent, const solid_options& options, bool needs_winding, raw_array<Crossing>&& crossings,
                std::vector<beam_words>&& cover)
        : rows_(extent), options_(options), needs_winding_(needs_winding), crossings_(std::move(crossings)),
          cover_(std::move(cover)) {
        std::size_t most = 0;
        std::size_t c = 0, k = 0;
        while (c < crossings_.size() || k < cover_.size()) {
            const std::uint64_t by_crossing = c < crossings_.size() ? crossings_[c].key / tile_rows : none;
            const std::uint64_t by_cover = k < cover_.size() ? cover_[k].beam : none;
            beam b{std::min(by_crossing, by_cover), c, c, nullptr};
            const std::uint64_t end = (b.number + 1) * tile_rows;
            while (c < crossings_.size() && crossings_[c].key < end) {
                std::size_t row_end = c + 1;
                while (row_end < crossings_.size() && crossings_[row_end].key == crossings_[c].key) ++row_end;
                most = std::max(most, row_end - c);
                c = row_end;
            }
            b.last = c;
            if (by_cover == b.number) b.cover = &cover_[k++];
            beams_.push_back(b);
        }
        most_in_row_ = most;
    }

    [[nodiscard]] std::size_t num_beams() const { return beams_.size(); }
    // The first tile of a beam, in tiles; x is 0.
    [[nodiscard]] glm::ivec3 first_tile(std::size_t item) const {
        const std::uint64_t row = beams_[item].number * tile_rows;
        return {0, rows_.y(row) / tile_size, rows_.z(row) / tile_size};
    }
    // Puts the crossings of each body in a row in order, for sweeps that are made more than once.
    void sort_rows(const execution& how) {
        parallel_for(how.threads, beams_.size(), [&](unsigned, std::size_t item) {
            for (std::size_t c = beams_[item].first; c < beams_[item].last;) {
                std::size_t end = c + 1;
                while (end < beams_[item].last && crossings_[end].key == crossings_[c].key &&
                       crossings_[end].draw == crossings_[c].draw)
                    ++end;
                std::sort(crossings_.begin() + c, crossings_.begin() + end,
                          [](const Crossing& a, const Crossing& b) { return a.at < b.at; });
                c = end;
            }
        });
    }
    [[nodiscard]] std::uint64_t num_crossings() const { return crossings_.size(); }

    [[nodiscard]] std::unique_ptr<row_scratch> make_scratch() const {
        auto s = std::make_unique<row_scratch>();
        s->mask.resize(rows_.words() + 1); // fill_bits may look at the word behind the row
        s->order.resize(most_in_row_);
        s->spans.resize(most_in_row_ + 2);
        return s;
    }

    void sweep(std::size_t item, row_scratch& scratch, row_sink& sink) const {
        sweep(item, {0, rows_.words()}, scratch, sink);
    }
    // The part in one tile of the beam. Counts mean nothing then.
    void sweep_tile(std::size_t item, std::size_t tile, row_scratch& scratch, row_sink& sink) const {
        sweep(item, {tile, tile + 1}, scratch, sink);
    }

private:
    static constexpr std::uint64_t none = std::numeric_limits<std::uint64_t>::max();
    // Words of a row, the last one not included.
    struct window {
        std::size_t begin, end;
        [[nodiscard]] std::size_t size() const { return end - begin; }
    };

    void sweep(std::size_t item, const window& in, row_scratch& scratch, row_sink& sink) const {
        const beam& b = beams_[item];
        std::size_t c = b.first, k = 0;
        const std::size_t num_words = b.cover == nullptr ? 0 : b.cover->words.size();
        const row_word* const words = num_words == 0 ? nullptr : b.cover->words.data();
        while (c < b.last || k < num_words) {
            const std::uint64_t row = std::min<std::uint64_t>(
                c < b.last ? crossings_[c].key : none, k < num_words ? b.number * tile_rows + words[k].row : none);
            const auto place = static_cast<std::uint32_t>(row % tile_rows);
            const int y = rows_.y(row), z = rows_.z(row);
            const auto crosses = [&] { return c < b.last && crossings_[c].key == row; };
            const auto covers = [&] { return k < num_words && words[k].row == place; };
            while (crosses() || covers()) {
                constexpr std::uint64_t no_draw = none;
                const auto draw = static_cast<std::uint32_t>(std::min<std::uint64_t>(
                    crosses() ? crossings_[c].draw : no_draw, covers() ? words[k].draw : no_draw));
                const std::size_t c0 = c, k0 = k;
                while (crosses() && crossings_[c].draw == draw) ++c;
                while (covers() && words[k].draw == draw) ++k;
                body(y, z, draw, in, c0, c, words + k0, words + k, scratch, sink);
            }
            sink.end_row(y, z);
        }
    }

    struct beam {
        std::uint64_t number;
        std::size_t first, last; // crossings
        const beam_words* cover;
    };
    struct word_range {
        std::size_t first, last;
        void include(std::size_t a, std::size_t b) {
            first = std::min(first, a);
            last = std::max(last, b);
        }
    };

    void body(int y, int z, std::uint32_t draw, const window& in, std::size_t c0, std::size_t c1, const row_word* k0,
              const row_word* k1, row_scratch& scratch, row_sink& sink) const {
        word_range range{in.size(), 0}; // first > last: no voxels yet
        if (options_.rule == fill_rule::even_odd && !needs_winding_)
            fill_parity(in, c0, c1, scratch, range);
        else
            fill_windings(in, c0, c1, scratch, range);
        std::uint32_t* const mask = scratch.mask.data();
        for (const row_word* w = k0; w != k1; ++w) {
            if (w->word < in.begin || w->word >= in.end) continue;
            const std::size_t i = w->word - in.begin;
            if (options_.extent == solid_extent::inner) {
                mask[i] &= ~w->bits;
            } else {
                mask[i] |= w->bits;
                range.include(i, i);
            }
        }
        if (range.first > range.last) return;
        const row_of_body row{y, z, draw, mask, range.first, range.last, scratch.spans.data()}; // named for nvcc
        sink.add(row);
        std::fill(mask + range.first, mask + range.last + 1, 0u);
    }

    // Even-odd without windings needs no order: a bit where each crossing is, then the parity of those up to each bit.
    void fill_parity(const window& in, std::size_t c0, std::size_t c1, row_scratch& scratch, word_range& range) const {
        if ((c1 - c0) % 2 != 0) ++scratch.counts.open_rows;
        std::uint32_t* const mask = scratch.mask.data();
        const auto nx = static_cast<std::uint32_t>(rows_.extent.x);
        bool odd = false, odd_before = false; // up to the end of the window, and before it
        for (std::size_t c = c0; c < c1; ++c) {
            const std::uint32_t x = crossing_voxel(crossings_[c].at);
            if (x == nx || x / 32 >= in.end) continue;
            odd = !odd;
            if (x / 32 < in.begin) {
                odd_before = !odd_before;
                continue;
            }
            mask[x / 32 - in.begin] ^= 1u << x % 32;
            range.include(x / 32 - in.begin, x / 32 - in.begin);
        }
        if (odd) range.last = in.size() - 1;
        if (odd_before) range.include(0, 0);
        std::uint32_t carry = odd_before ? ~0u : 0u;
        for (std::size_t i = range.first; i <= range.last && i < in.size(); ++i) {
            std::uint32_t w = mask[i];
            w ^= w << 1;
            w ^= w << 2;
            w ^= w << 4;
            w ^= w << 8;
            w ^= w << 16;
            w ^= carry;
            mask[i] = w;
            carry = (w >> 31) != 0 ? ~0u : 0u;
        }
        if (odd && nx % 32 != 0 && in.end == rows_.words()) mask[in.size() - 1] &= (1u << nx % 32) - 1;
    }

    void fill_windings(const window& in, std::size_t c0, std::size_t c1, row_scratch& scratch,
                       word_range& range) const {
        std::uint32_t* const order = scratch.order.data();
        const std::size_t n = c1 - c0;
        for (std::size_t i = 0; i < n; ++i) order[i] = crossings_[c0 + i].at;
        if (!std::is_sorted(order, order + n)) std::sort(order, order + n);
        const auto nx = static_cast<std::uint32_t>(rows_.extent.x);
        const auto low = static_cast<std::uint32_t>(in.begin) * 32;
        const std::uint32_t high = std::min(nx, static_cast<std::uint32_t>(in.end) * 32);
        std::uint32_t* const mask = scratch.mask.data();
        winding_span* span = scratch.spans.data();
        std::int64_t winding = 0;
        std::uint64_t greatest = scratch.counts.max_winding;
        const auto end_span = [&](std::uint32_t begin, std::uint32_t end) {
            begin = std::max(begin, low);
            end = std::min(end, high);
            if (begin >= end) return;
            begin -= low;
            end -= low;
            *span++ = {static_cast<int>(end), winding};
            if (winding == 0) return;
            greatest = std::max(greatest, static_cast<std::uint64_t>(std::abs(winding)));
            if (!core::is_inside(options_.rule, winding)) return;
            fill_bits(mask, begin, end);
            range.include(begin / 32, (end - 1) / 32);
        };
        std::uint32_t begin = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t x = crossing_voxel(order[i]);
            end_span(begin, x);
            begin = x;
            winding += crossing_winding(order[i]);
        }
        end_span(begin, nx);
        if (options_.rule == fill_rule::even_odd) {
            if (n % 2 != 0) ++scratch.counts.open_rows;
        } else {
            if (winding != 0) ++scratch.counts.open_rows;
            scratch.counts.max_winding = greatest;
        }
    }

    row_numbers rows_;
    solid_options options_;
    bool needs_winding_;
    raw_array<Crossing> crossings_;
    std::vector<beam_words> cover_;
    std::vector<beam> beams_;
    std::size_t most_in_row_ = 0;
};

} // namespace voxelpipe::cpu
