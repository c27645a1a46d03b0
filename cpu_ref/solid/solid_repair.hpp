// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes with holes: repair::close_holes adds cones to the geometry, repair::exterior decides each body's voxels on a
// dense grid of bits (solid_exterior.hpp), as repair::vote does (solid_vote.hpp). All three give sets that no order of
// work can change.

#include <cpu_ref/solid/solid_cover.hpp>
#include <voxelpipe/solid/core/bit_grid.hpp>
#include <voxelpipe/solid/core/holes.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

using core::bit_grid;

// ---- close_holes ----------------------------------------------------------------------------------------------------

// Puts the cones of each body behind its draws' parts. False if there are then more triangles than can be numbered.
[[nodiscard]] inline bool add_cones(solid_geometry& s, const solid_options& options, solid_counters& counts) {
    std::vector<geometry::part> parts;
    std::vector<std::uint32_t> body;
    std::vector<bool> is_repair;
    s.cones.reserve(s.parts.size()); // stays where the parts point to
    for (std::size_t first = 0; first < s.parts.size();) {
        std::size_t last = first;
        std::vector<core::hole_part> of_body;
        for (; last < s.parts.size() && s.body[last] == s.body[first]; ++last) {
            const geometry::part& p = s.parts[last];
            of_body.push_back({p.positions, p.num_vertices, p.triangles, p.num_triangles});
            parts.push_back(p);
            body.push_back(s.body[last]);
            is_repair.push_back(false);
        }
        const core::hole_cones& cones =
            s.cones.emplace_back(options.cones != nullptr ? core::moved(options.cones[s.body[first]], s.snap.offset)
                                                          : core::close_holes(of_body, options.max_hole_edges));
        counts.hole_edges += cones.edges;
        counts.holes += cones.holes;
        counts.cones += cones.cones;
        if (!cones.triangles.empty()) {
            const auto triangles = static_cast<std::uint32_t>(cones.triangles.size()),
                       vertices = static_cast<std::uint32_t>(cones.positions.size());
            parts.push_back(
                {{cones.triangles.data(), triangles, vertices}, cones.positions.data(), triangles, vertices});
            body.push_back(s.body[first]);
            is_repair.push_back(true);
        }
        first = last;
    }
    s.parts = std::move(parts);
    s.body = std::move(body);
    s.is_repair = std::move(is_repair);
    s.first_primitive.clear();
    std::uint64_t first = 0;
    for (const geometry::part& p : s.parts) {
        s.first_primitive.push_back(static_cast<std::uint32_t>(first));
        first += p.num_triangles;
        if (first > ~std::uint32_t{0}) return false;
    }
    s.first_primitive.push_back(static_cast<std::uint32_t>(first));
    return true;
}

// ---- what exterior and vote have in common --------------------------------------------------------------------------

// Appends the bits of one body within `box` to the beams, of which `beams` has all, in order.
template <class BitsAt>
void add_bits(const execution& how, const row_numbers& rows, const core::voxel_box& box, std::uint32_t draw,
              std::vector<beam_words>& beams, const BitsAt& bits_at) {
    parallel_for(how.threads, beams.size(), [&](unsigned, std::size_t b) {
        for (std::uint32_t place = 0; place < tile_rows; ++place) {
            const std::uint64_t row = b * tile_rows + place;
            const int y = rows.y(row), z = rows.z(row);
            if (y < box.lo[1] || z < box.lo[2] || y > box.hi[1] || z > box.hi[2]) continue;
            for (int x = 0; x <= box.hi[0]; x += 32) {
                std::uint32_t bits = bits_at(x, y, z);
                if (box.hi[0] - x < 31) bits &= (1u << (box.hi[0] - x + 1)) - 1;
                if (box.lo[0] > x) bits &= box.lo[0] - x < 32 ? ~0u << (box.lo[0] - x) : 0u;
                if (bits != 0) beams[b].words.push_back({place, draw, static_cast<std::uint32_t>(x) / 32, bits});
            }
        }
    });
}

// Calls visit(x, y, z, bits) for the words of one body.
template <class Visit>
void for_each_word(const std::vector<beam_words>& cover, const row_numbers& rows, std::uint32_t draw,
                   const Visit& visit) {
    for (const beam_words& beam : cover)
        for (const row_word& w : beam.words)
            if (w.draw == draw) {
                const std::uint64_t row = beam.beam * tile_rows + w.row;
                visit(static_cast<int>(w.word) * 32, rows.y(row), rows.z(row), w.bits);
            }
}

// Calls visit(u, v, first voxel behind) for the crossings of one body's triangles with the moved rows along an axis, of
// triangles that reach layer `lowest` of the axis or above, but for crossings below it.
template <int Axis, class Visit>
void for_each_crossing_of(const solid_geometry& s, std::uint32_t draw, std::int64_t lowest, const Visit& visit) {
    const core::voxel_box whole = s.whole_box();
    for (std::size_t part = 0; part < s.parts.size(); ++part) {
        if (s.body[part] != draw) continue;
        const geometry::part& in = s.parts[part];
        for (std::uint32_t i = 0; i < in.num_triangles; ++i) {
            const glm::uvec3 t = in.triangles[i];
            const core::snapped_position &a = in.positions[t.x], &b = in.positions[t.y], &c = in.positions[t.z];
            if (!core::is_drawable(a) || !core::is_drawable(b) || !core::is_drawable(c)) continue;
            if (core::bounds(a, b, c, s.snap.fraction).hi[Axis] < lowest) continue;
            const core::row_box box = core::rows_within<Axis>(a, b, c, s.snap.fraction, whole);
            core::for_each_crossing<Axis, core::centre_offset<>>(
                a, b, c, s.snap.fraction, box, [&](std::int64_t u, std::int64_t v, std::int64_t first, int) {
                    if (first >= lowest) visit(u, v, first);
                });
        }
    }
}

[[nodiscard]] inline std::vector<beam_words> all_beams(const row_numbers& rows) {
    std::vector<beam_words> beams(rows.num_beams());
    for (std::size_t b = 0; b < beams.size(); ++b) beams[b].beam = b;
    return beams;
}

// Puts the words of several bodies in order, and drops beams without any.
inline void end_beams(const execution& how, std::vector<beam_words>& beams) {
    parallel_for(how.threads, beams.size(), [&](unsigned, std::size_t b) { sort_words(beams[b].words); });
    beams.erase(std::remove_if(beams.begin(), beams.end(), [](const beam_words& b) { return b.words.empty(); }),
                beams.end());
}

// What solid_options::slab gives, in the numbers of the geometry's grid, in which the slab begins at its lead.
class slab_bits {
public:
    slab_bits(const std::uint64_t* bits, const solid_geometry& s)
        : bits_(bits), lead_(s.lead), rows_(s.where.extent.y - s.lead.y),
          words_((static_cast<std::size_t>(s.where.extent.x - s.lead.x) + 63) / 64) {}
    // The 32 bits from x on, a multiple of 32; those before the slab, and behind its row, are 0 and of no meaning.
    [[nodiscard]] std::uint32_t operator()(int x, int y, int z) const {
        const std::uint64_t* const r =
            bits_ + (static_cast<std::size_t>(z - lead_.z) * static_cast<std::size_t>(rows_) +
                     static_cast<std::size_t>(y - lead_.y)) *
                        words_;
        const int first = x - lead_.x; // above -32
        if (first < 0) return static_cast<std::uint32_t>(r[0]) << -first;
        const auto i = static_cast<std::size_t>(first) / 64;
        const int at = first % 64;
        std::uint64_t w = r[i] >> at;
        if (at > 32 && i + 1 < words_) w |= r[i + 1] << (64 - at);
        return static_cast<std::uint32_t>(w);
    }

private:
    const std::uint64_t* bits_;
    glm::ivec3 lead_;
    int rows_;
    std::size_t words_;
};

} // namespace voxelpipe::cpu
