// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::vote: the parities of crossings along x, y and z on dense grids of bits, and what most of the closed rows
// say.

#include <cpu_ref/solid/solid_repair.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

namespace voxelpipe::cpu {

// Parities of one body along one axis, and the rows of that axis that are open: their number of crossings is odd. Of a
// slab along z, columns begin with the parity below it, and are open where the whole one is.
template <int Axis>
class parity_grid {
public:
    parity_grid(const solid_geometry& s, std::uint32_t draw, const solid_slab* slab)
        : inside_(s.where.extent), open_(face(s.where.extent)) {
        const glm::ivec3 e = s.where.extent;
        const bool is_slab = Axis == 2 && slab != nullptr;
        // Crossings below the slab are in its parities.
        const std::int64_t lowest = is_slab ? s.lead.z : std::numeric_limits<std::int64_t>::min();
        for_each_crossing_of<Axis>(s, draw, lowest, [&](std::int64_t u, std::int64_t v, std::int64_t first) {
            const auto w = static_cast<int>(std::clamp<std::int64_t>(first, 0, e[Axis]));
            const auto p = core::to_xyz(Axis, static_cast<int>(u), static_cast<int>(v), w);
            if (w < e[Axis]) inside_.flip(p[0], p[1], p[2]);
            if (is_slab) return;
            // The row as a point of a face: along x its y and z, else its x and the other.
            if constexpr (Axis == 0)
                open_.flip(p[1], p[2], 0);
            else
                open_.flip(p[0], Axis == 1 ? p[2] : p[1], 0);
        });
        if (is_slab) begin_with(s, *slab);
        accumulate();
    }

    // Bits of 32 voxels along x: inside, and outside; neither if their row is open.
    void vote(int x, int y, int z, std::uint32_t& for_it, std::uint32_t& against) const {
        const std::uint32_t in = inside_.get_bits(x, y, z);
        std::uint32_t open = 0;
        if constexpr (Axis == 0)
            open = (open_.get_bits(y & ~31, z, 0) >> (y & 31) & 1u) != 0 ? ~0u : 0u;
        else
            open = open_.get_bits(x, Axis == 1 ? z : y, 0);
        for_it = in & ~open;
        against = ~in & ~open;
    }

private:
    static glm::ivec3 face(glm::ivec3 e) {
        return Axis == 0 ? glm::ivec3(e.y, e.z, 1) : glm::ivec3(e.x, Axis == 1 ? e.z : e.y, 1);
    }
    void begin_with(const solid_geometry& s, const solid_slab& slab) {
        const core::voxel_box whole = s.whole_box();
        const slab_bits below(slab.below, s), open(slab.open, s);
        for (auto y = static_cast<int>(whole.lo[1]); y <= whole.hi[1]; ++y)
            for (int x = 0; x <= whole.hi[0]; x += 32) {
                inside_.flip_bits(x, y, s.lead.z, below(x, y, s.lead.z));
                open_.flip_bits(x, y, 0, open(x, y, s.lead.z));
            }
    }
    // Each bit becomes the parity of those up to it along the axis.
    void accumulate() {
        const glm::ivec3 e = inside_.extent();
        const std::size_t n = inside_.words();
        for (int z = 0; z < e.z; ++z)
            for (int y = 0; y < e.y; ++y) {
                std::uint64_t* const r = inside_.row(y, z);
                if constexpr (Axis == 0) {
                    std::uint64_t carry = 0;
                    for (std::size_t i = 0; i < n; ++i) {
                        std::uint64_t w = r[i];
                        for (int k = 1; k < 64; k *= 2) w ^= w << k;
                        r[i] = w ^= carry;
                        carry = w >> 63 != 0 ? ~std::uint64_t{0} : 0;
                    }
                } else if (Axis == 1 ? y > 0 : z > 0) {
                    const std::uint64_t* const before = Axis == 1 ? inside_.row(y - 1, z) : inside_.row(y, z - 1);
                    for (std::size_t i = 0; i < n; ++i) r[i] ^= before[i];
                }
            }
    }

    bit_grid inside_;
    bit_grid open_; // a bit a row, in one slice
};

// Each body's voxels that more of the closed rows along x, y and z call inside than outside, and its cover, if any.
[[nodiscard]] inline std::vector<beam_words> find_majority(const execution& how, const solid_geometry& s,
                                                           const solid_slab* slab, std::vector<beam_words>&& cover) {
    const stopwatch watch(how.times, &stage_times::fine_raster);
    const row_numbers rows(s.where.extent);
    std::vector<beam_words> beams;
    for (std::uint32_t draw = 0; draw <= s.body.back(); ++draw) {
        std::unique_ptr<parity_grid<0>> x_rows;
        std::unique_ptr<parity_grid<1>> y_rows;
        std::unique_ptr<parity_grid<2>> z_rows;
        parallel_for(how.threads, 3, [&](unsigned, std::size_t axis) {
            if (axis == 0) x_rows = std::make_unique<parity_grid<0>>(s, draw, slab);
            if (axis == 1) y_rows = std::make_unique<parity_grid<1>>(s, draw, slab);
            if (axis == 2) z_rows = std::make_unique<parity_grid<2>>(s, draw, slab);
        });
        if (draw == 0) beams = all_beams(rows);
        bit_grid touched(s.where.extent);
        for_each_word(cover, rows, draw,
                      [&](int x, int y, int z, std::uint32_t bits) { touched.set_bits(x, y, z, bits); });
        add_bits(how, rows, s.whole_box(), draw, beams, [&](int x, int y, int z) {
            std::uint32_t a = 0, b = 0, c = 0, not_a = 0, not_b = 0, not_c = 0;
            x_rows->vote(x, y, z, a, not_a);
            y_rows->vote(x, y, z, b, not_b);
            z_rows->vote(x, y, z, c, not_c);
            const std::uint32_t two = (a & b) | (b & c) | (c & a);
            const std::uint32_t alone = (a | b | c) & ~(not_a | not_b | not_c);
            return two | alone | touched.get_bits(x, y, z);
        });
    }
    end_beams(how, beams);
    return beams;
}

} // namespace voxelpipe::cpu
