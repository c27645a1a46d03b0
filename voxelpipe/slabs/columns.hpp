// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::vote for a mesh that is drawn in slabs along z: rows along x and y lie within a slab, those along z do not. A
// slab's call takes the parity of each column below it, and whether the whole column is open (solid_options::slab).
// Plain C++.
//
//   column_parities   slabs that are known before the triangles come, gaps between them allowed: a layer of bits a slab
//   column_sweep      slabs that follow each other, wherever they turn out to begin: three layers of bits

#include <voxelpipe/grid.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/solid/solid.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

namespace detail {

// The columns of a grid along z, and where triangles cross them.
class crossed_columns {
public:
    explicit crossed_columns(const grid& g)
        : extent_(g.extent), fraction_(core::make_snap_transform(g).fraction),
          words_((static_cast<std::size_t>(extent_.x) + 63) / 64) {}

    [[nodiscard]] int layers() const { return extent_.z; }
    // Words of a layer: 64 columns each, in rows along x.
    [[nodiscard]] std::size_t words() const { return words_ * static_cast<std::size_t>(extent_.y); }

    // Calls visit(word, bit, above) for each column that a triangle crosses. A slab that begins at layer `above` or
    // higher has the crossing below it; one that begins lower flips the column itself, if it gets the triangle.
    template <class Visit>
    void for_each(const core::snapped_position& a, const core::snapped_position& b, const core::snapped_position& c,
                  const Visit& visit) const {
        if (!core::is_drawable(a) || !core::is_drawable(b) || !core::is_drawable(c)) return;
        const core::voxel_box whole{{{0, 0, 0}}, {{extent_.x - 1, extent_.y - 1, extent_.z - 1}}};
        const core::row_box columns = core::rows_within<2>(a, b, c, fraction_, whole);
        const std::int64_t top = core::bounds(a, b, c, fraction_).hi[2];
        core::for_each_crossing<2, core::centre_offset<>>(
            a, b, c, fraction_, columns, [&](std::int64_t x, std::int64_t y, std::int64_t first, int) {
                visit(static_cast<std::size_t>(y) * words_ + static_cast<std::size_t>(x) / 64,
                      std::uint64_t{1} << (x % 64), first + (top < first ? 0 : 1));
            });
    }

private:
    glm::ivec3 extent_;
    int fraction_;
    std::size_t words_; // in a row
};

} // namespace detail

// A bit for each column of a grid, and of each slab: a slice of bits a slab.
class column_parities {
public:
    // slabs: layers of the grid's computed part, not empty, ascending, without overlaps; there may be gaps.
    column_parities(const grid& g, std::vector<layer_range> slabs)
        : columns_(g), slabs_(std::move(slabs)), below_(slabs_.size()), open_(columns_.words()) {
        for (std::vector<std::uint64_t>& slice : below_) slice.resize(open_.size());
        first_slab_.assign(static_cast<std::size_t>(columns_.layers()) + 1, slabs_.size());
        for (std::size_t s = slabs_.size(); s-- > 0;)
            std::fill_n(first_slab_.begin(), static_cast<std::size_t>(slabs_[s].begin) + 1, s);
    }
    // Bytes that the bits of a grid take.
    [[nodiscard]] static double bytes(const grid& g, std::size_t num_slabs) {
        const int words = (g.extent.x + 63) / 64;
        return (static_cast<double>(num_slabs) + 1) * 8 * words * g.extent.y;
    }

    // A triangle, snapped in the grid; each of the mesh once, wherever it lies. One that cannot be drawn is left out.
    void add(const core::snapped_position& a, const core::snapped_position& b, const core::snapped_position& c) {
        columns_.for_each(a, b, c, [&](std::size_t word, std::uint64_t bit, std::int64_t above) {
            open_[word] ^= bit;
            const std::size_t s =
                first_slab_[static_cast<std::size_t>(std::clamp<std::int64_t>(above, 0, columns_.layers()))];
            if (s < slabs_.size()) below_[s][word] ^= bit;
        });
    }

    // Adds what another one has found, of the same slabs, before of().
    void join(const column_parities& other) {
        for (std::size_t i = 0; i < open_.size(); ++i) open_[i] ^= other.open_[i];
        for (std::size_t s = 0; s < slabs_.size(); ++s)
            for (std::size_t i = 0; i < open_.size(); ++i) below_[s][i] ^= other.below_[s][i];
    }

    // What a slab's call takes, once all triangles are there. By ascending slabs; memory of those before is freed, and
    // the bits are there until the next one is asked for.
    [[nodiscard]] solid_slab of(std::size_t slab) {
        for (; at_ < slab; ++at_) {
            for (std::size_t i = 0; i < open_.size(); ++i) below_[at_ + 1][i] ^= below_[at_][i];
            below_[at_] = {};
        }
        solid_slab bits;
        bits.below = below_[slab].data();
        bits.open = open_.data();
        return bits;
    }

private:
    detail::crossed_columns columns_;
    std::vector<layer_range> slabs_;
    // Crossings between the beginnings of a slab and of the one before; those of all slabs before, from of() on.
    std::vector<std::vector<std::uint64_t>> below_;
    std::vector<std::uint64_t> open_;
    std::vector<std::size_t> first_slab_; // that begins at a layer or above it
    std::size_t at_ = 0;
};

// The columns of a grid's slabs one after the other, without gaps from the grid's lowest layer on. Each slab's own
// triangles tell what lies below the next one.
class column_sweep {
public:
    // Sweeps a grid, or a crop of one: the columns begin at its lowest layer.
    explicit column_sweep(const grid& g)
        : columns_(g), open_(columns_.words()), below_(columns_.words()), next_(columns_.words()) {}

    // A triangle, snapped in the grid; each of the mesh once, wherever it lies. One that cannot be drawn is left out.
    void add(const core::snapped_position& a, const core::snapped_position& b, const core::snapped_position& c) {
        columns_.for_each(a, b, c, [&](std::size_t word, std::uint64_t bit, std::int64_t above) {
            open_[word] ^= bit;
            if (above <= 0) below_[word] ^= bit;
        });
    }

    // Once all triangles are there: the next slab, whose triangles are to be passed.
    void begin(const layer_range& slab) {
        slab_ = slab;
        next_ = below_;
    }
    // A triangle that reaches the slab's layers; each once.
    void pass(const core::snapped_position& a, const core::snapped_position& b, const core::snapped_position& c) {
        columns_.for_each(a, b, c, [&](std::size_t word, std::uint64_t bit, std::int64_t above) {
            if (above > slab_.begin && above <= slab_.end) next_[word] ^= bit;
        });
    }
    // What the slab's call takes, valid until end().
    [[nodiscard]] solid_slab bits() const {
        solid_slab s;
        s.below = below_.data();
        s.open = open_.data();
        return s;
    }
    // Goes on to the layers behind the slab. Without this, begin() takes another slab with the same first layer.
    void end() { below_.swap(next_); }

    // The columns that are open. An exclusive or joins those of several sweeps that share the triangles.
    [[nodiscard]] std::span<std::uint64_t> open() { return open_; }
    // What lies below the next slab; joined in the same way.
    [[nodiscard]] std::span<std::uint64_t> below() { return below_; }

private:
    detail::crossed_columns columns_;
    std::vector<std::uint64_t> open_, below_, next_; // next_: below the layers behind the slab
    layer_range slab_;
};

} // namespace voxelpipe::slabs
