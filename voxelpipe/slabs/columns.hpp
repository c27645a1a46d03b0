// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::vote for a mesh that is drawn in slabs along z: rows along x and y lie within a slab, those along z do not.
// One pass over all triangles finds for every slab the parity of each column below it, and whether the whole column is
// open; solid_options::slab brings both to the slab's call. Plain C++.

#include <voxelpipe/core/crossing.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/solid.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// A bit for each column of a grid, and of each slab: a slice of bits a slab.
class column_parities {
public:
    // slabs: layers of the grid's computed part, not empty, ascending, without overlaps; there may be gaps.
    column_parities(const grid& g, std::vector<layer_range> slabs)
        : extent_(g.extent), fraction_(core::make_snap_transform(g).fraction), slabs_(std::move(slabs)),
          words_((static_cast<std::size_t>(extent_.x) + 63) / 64), below_(slabs_.size()),
          open_(words_ * static_cast<std::size_t>(extent_.y)) {
        for (std::vector<std::uint64_t>& slice : below_) slice.resize(open_.size());
        first_slab_.assign(static_cast<std::size_t>(extent_.z) + 1, slabs_.size());
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
        if (!core::is_drawable(a) || !core::is_drawable(b) || !core::is_drawable(c)) return;
        const core::voxel_box whole{{{0, 0, 0}}, {{extent_.x - 1, extent_.y - 1, extent_.z - 1}}};
        const core::row_box columns = core::rows_within<2>(a, b, c, fraction_, whole);
        const std::int64_t top = core::bounds(a, b, c, fraction_).hi[2];
        core::for_each_crossing<2, core::centre_offset<>>(
            a, b, c, fraction_, columns, [&](std::int64_t x, std::int64_t y, std::int64_t first, int) {
                const std::size_t word = static_cast<std::size_t>(y) * words_ + static_cast<std::size_t>(x) / 64;
                const std::uint64_t bit = std::uint64_t{1} << (x % 64);
                open_[word] ^= bit;
                // A slab that begins at `first` flips it itself if it gets the triangle.
                const std::int64_t above = first + (top < first ? 0 : 1);
                const std::size_t s =
                    first_slab_[static_cast<std::size_t>(std::clamp<std::int64_t>(above, 0, extent_.z))];
                if (s < slabs_.size()) below_[s][word] ^= bit;
            });
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
    glm::ivec3 extent_;
    int fraction_;
    std::vector<layer_range> slabs_;
    std::size_t words_; // of 64 columns, in a row
    // Crossings between the beginnings of a slab and of the one before; those of all slabs before, from of() on.
    std::vector<std::vector<std::uint64_t>> below_;
    std::vector<std::uint64_t> open_;
    std::vector<std::size_t> first_slab_; // that begins at a layer or above it
    std::size_t at_ = 0;
};

} // namespace voxelpipe::slabs
