// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes with holes: repair::close_holes adds cones to the geometry, repair::exterior and repair::vote decide each
// body's voxels on dense grids of bits. All three give sets that no order of work can change.

#include <cpu_ref/bit_grid.hpp>
#include <cpu_ref/solid_cover.hpp>
#include <voxelpipe/core/holes.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

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

// ---- exterior -------------------------------------------------------------------------------------------------------

// The bits of `open` that rows of `from` reach along x: `from` is a part of `open`.
inline void spread_in_row(std::uint64_t* from, const std::uint64_t* open, std::size_t n) {
    // Upwards: adding the seeds to the open bits carries through each run from its lowest seed; what changes is
    // covered.
    unsigned carry = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint64_t seeds = from[i] | (carry & open[i]);
        const std::uint64_t sum = open[i] + seeds;
        from[i] = seeds | (open[i] & ~sum);
        carry = sum < open[i] ? 1u : 0u;
    }
    // Downwards: bits below a seed within its run.
    std::uint64_t above = 0;
    for (std::size_t i = n; i-- > 0;) {
        std::uint64_t f = from[i] | ((above << 63) & open[i]), run = open[i];
        for (int k = 1; k < 64; k *= 2) {
            f |= (f >> k) & run;
            run &= run >> k;
        }
        from[i] = f;
        above = f & 1;
    }
}

// The bits of ~walls that a 6-connected walk through them reaches from the faces of the grid, which hold no walls.
[[nodiscard]] inline bit_grid flood(const bit_grid& walls) {
    const glm::ivec3 e = walls.extent();
    const std::size_t n = walls.words();
    bit_grid reached(e);
    struct place {
        int y, z;
    };
    std::vector<place> queue;
    std::vector<bool> queued(static_cast<std::size_t>(e.y) * static_cast<std::size_t>(e.z), true);
    const auto index = [&](int y, int z) {
        return static_cast<std::size_t>(z) * static_cast<std::size_t>(e.y) + static_cast<std::size_t>(y);
    };
    std::vector<std::uint64_t> open(n);
    for (int z = 0; z < e.z; ++z)
        for (int y = 0; y < e.y; ++y) {
            std::uint64_t* const r = reached.row(y, z);
            if (y == 0 || z == 0 || y == e.y - 1 || z == e.z - 1) {
                std::fill(r, r + n, ~std::uint64_t{0});
                r[n - 1] &= walls.last_word();
            } else {
                reached.set(0, y, z);
                reached.set(e.x - 1, y, z);
            }
            queue.push_back({y, z});
        }
    while (!queue.empty()) {
        const auto [y, z] = queue.back();
        queue.pop_back();
        queued[index(y, z)] = false;
        std::uint64_t* const r = reached.row(y, z);
        const std::uint64_t* const w = walls.row(y, z);
        for (std::size_t i = 0; i < n; ++i) open[i] = ~w[i];
        open[n - 1] &= walls.last_word();
        spread_in_row(r, open.data(), n);
        const auto pass_on = [&](int to_y, int to_z) {
            if (to_y < 0 || to_z < 0 || to_y >= e.y || to_z >= e.z) return;
            std::uint64_t* const to = reached.row(to_y, to_z);
            const std::uint64_t* const wall = walls.row(to_y, to_z);
            std::uint64_t changed = 0;
            for (std::size_t i = 0; i < n; ++i) {
                const std::uint64_t fresh = r[i] & ~wall[i] & ~to[i];
                to[i] |= fresh;
                changed |= fresh;
            }
            if (changed == 0 || queued[index(to_y, to_z)]) return;
            queued[index(to_y, to_z)] = true;
            queue.push_back({to_y, to_z});
        };
        pass_on(y - 1, z);
        pass_on(y + 1, z);
        pass_on(y, z - 1);
        pass_on(y, z + 1);
    }
    return reached;
}

// Each body's complement of what a flood from outside the grid reaches, through voxels further than `closing` from its
// cover in the max norm; grown back by as much.
[[nodiscard]] inline std::vector<beam_words> find_interior(const execution& how, const solid_geometry& s, int closing,
                                                           std::vector<beam_words>&& cover) {
    const stopwatch watch(how.times, &stage_times::fine_raster);
    const row_numbers rows(s.where.extent);
    std::vector<beam_words> beams;
    const int ring = closing + 1;
    for (std::uint32_t draw = 0; draw <= s.body.back(); ++draw) {
        bit_grid grid(s.where.extent + 2 * ring);
        for_each_word(cover, rows, draw, [&](int x, int y, int z, std::uint32_t bits) {
            grid.set_bits(x + ring, y + ring, z + ring, bits);
        });
        dilate(grid, closing, how.threads);
        grid = flood(grid);
        dilate(grid, closing, how.threads);
        if (draw == 0) beams = all_beams(rows); // behind the grid, which is what there may be no memory for
        add_bits(how, rows, s.whole_box(), draw, beams,
                 [&](int x, int y, int z) { return ~grid.get_bits(x + ring, y + ring, z + ring); });
    }
    end_beams(how, beams);
    return beams;
}

// ---- vote -----------------------------------------------------------------------------------------------------------

// Parities of one body along one axis, and the rows of that axis that are open: their number of crossings is odd.
template <int Axis>
class parity_grid {
public:
    parity_grid(const solid_geometry& s, std::uint32_t draw) : inside_(s.where.extent), open_(face(s.where.extent)) {
        const core::voxel_box whole = s.whole_box();
        const glm::ivec3 e = s.where.extent;
        for (std::size_t part = 0; part < s.parts.size(); ++part) {
            if (s.body[part] != draw) continue;
            const geometry::part& in = s.parts[part];
            for (std::uint32_t i = 0; i < in.num_triangles; ++i) {
                const glm::uvec3 t = in.triangles[i];
                const core::snapped_position &a = in.positions[t.x], &b = in.positions[t.y], &c = in.positions[t.z];
                if (!core::is_drawable(a) || !core::is_drawable(b) || !core::is_drawable(c)) continue;
                const core::row_box box = core::rows_within<Axis>(a, b, c, s.snap.fraction, whole);
                core::for_each_crossing<Axis, core::centre_offset<>>(
                    a, b, c, s.snap.fraction, box, [&](std::int64_t u, std::int64_t v, std::int64_t first, int) {
                        const auto w = static_cast<int>(std::clamp<std::int64_t>(first, 0, e[Axis]));
                        const auto p = core::to_xyz(Axis, static_cast<int>(u), static_cast<int>(v), w);
                        if (w < e[Axis]) inside_.flip(p[0], p[1], p[2]);
                        // The row as a point of a face: along x its y and z, else its x and the other.
                        if constexpr (Axis == 0)
                            open_.flip(p[1], p[2], 0);
                        else
                            open_.flip(p[0], Axis == 1 ? p[2] : p[1], 0);
                    });
            }
        }
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

// Each body's voxels that more of the closed rows along x, y and z call inside than outside, and its cover.
[[nodiscard]] inline std::vector<beam_words> find_majority(const execution& how, const solid_geometry& s,
                                                           std::vector<beam_words>&& cover) {
    const stopwatch watch(how.times, &stage_times::fine_raster);
    const row_numbers rows(s.where.extent);
    std::vector<beam_words> beams;
    for (std::uint32_t draw = 0; draw <= s.body.back(); ++draw) {
        std::unique_ptr<parity_grid<0>> x_rows;
        std::unique_ptr<parity_grid<1>> y_rows;
        std::unique_ptr<parity_grid<2>> z_rows;
        parallel_for(how.threads, 3, [&](unsigned, std::size_t axis) {
            if (axis == 0) x_rows = std::make_unique<parity_grid<0>>(s, draw);
            if (axis == 1) y_rows = std::make_unique<parity_grid<1>>(s, draw);
            if (axis == 2) z_rows = std::make_unique<parity_grid<2>>(s, draw);
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
