// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding: the winding numbers of the mesh with its cones, of 8 x 8 rows at a time, and bricks of 8^3 voxels
// where the cones' solid angles may change the verdict.

#include <cpu_ref/solid/solid_repair.hpp>
#include <voxelpipe/solid/core/winding_tree.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

// The geometry of the draws alone. Refers to `s`.
[[nodiscard]] inline solid_geometry without_cones(const solid_geometry& s) {
    solid_geometry r;
    r.where = s.where;
    r.lead = s.lead;
    r.snap = s.snap;
    r.triangles_in = s.triangles_in;
    std::uint32_t first = 0;
    for (std::size_t p = 0; p < s.parts.size(); ++p) {
        if (s.is_repair[p]) continue;
        r.parts.push_back(s.parts[p]);
        r.body.push_back(s.body[p]);
        r.is_repair.push_back(false);
        r.first_primitive.push_back(first);
        first += s.parts[p].num_triangles;
    }
    r.first_primitive.push_back(first);
    return r;
}

// The trees of each body's cones.
[[nodiscard]] inline std::vector<core::winding_tree> make_winding_trees(const solid_geometry& s) {
    const core::distance_scale scale = core::make_distance_scale(s.where.voxel_size, s.snap.fraction);
    std::vector<core::winding_tree> trees;
    trees.reserve(s.cones.size());
    for (const core::hole_cones& cones : s.cones)
        trees.emplace_back(cones, scale, core::largest_side(s.where.voxel_size));
    return trees;
}

// The rows of 8 x 8 voxels of one body: winding numbers, then verdicts.
class winding_rows {
public:
    static constexpr int side = 8;

    winding_rows(const solid_geometry& s, fill_rule rule)
        : s_(s), rule_(rule), stride_(static_cast<std::size_t>(s.where.extent.x) + 1), windings_(stride_ * side * side),
          words_((stride_ + 31) / 32), bits_(words_ * side * side) {}

    // Finds the bits of the rows from (y0, z0) on. [first, last): the crossings of their beam.
    template <class Crossing>
    void find(const row_numbers& rows, int y0, int z0, std::uint32_t body, const core::winding_tree& cones,
              const Crossing* first, const Crossing* last, solid_counters& counts) {
        std::fill(windings_.begin(), windings_.end(), 0);
        std::fill(bits_.begin(), bits_.end(), 0u);
        for (int r = 0; r < side * side; ++r) {
            const int y = y0 + r % side, z = z0 + r / side;
            if (y < s_.lead.y || z < s_.lead.z || y >= s_.where.extent.y || z >= s_.where.extent.z) continue;
            const std::uint64_t key = rows.number(y, z);
            const Crossing* at =
                std::lower_bound(first, last, key, [](const Crossing& c, std::uint64_t k) { return c.key < k; });
            std::int32_t* const w = windings_.data() + static_cast<std::size_t>(r) * stride_;
            for (; at != last && at->key == key; ++at)
                if (at->draw == body) w[crossing_voxel(at->at)] += crossing_winding(at->at);
            for (std::size_t x = 1; x < stride_; ++x) w[x] += w[x - 1];
            counts.open_rows += w[stride_ - 1] != 0 ? 1 : 0;
            std::uint32_t* const bits = bits_.data() + static_cast<std::size_t>(r) * words_;
            for (auto x = static_cast<std::size_t>(s_.lead.x); x + 1 < stride_; ++x) {
                if (w[x] == 0) continue;
                counts.max_winding = std::max(counts.max_winding, static_cast<std::uint64_t>(std::abs(w[x])));
                if (core::is_inside(rule_, w[x])) bits[x / 32] |= 1u << x % 32;
            }
        }
        const core::winding_view tree = cones.view();
        if (tree.num_triangles == 0) return;
        for (int x = s_.lead.x / 32 * 32; x < s_.where.extent.x; x += 32) {
            std::int64_t whole = 0;
            const bool is_decided = find_whole(tree, {x, y0, z0}, 32, whole);
            if (is_decided && whole == 0) continue; // the bits are those of the winding numbers
            for (int brick = x; brick < std::min(x + 32, s_.where.extent.x); brick += side) {
                const glm::ivec3 at(brick, y0, z0);
                if (is_decided || find_whole(tree, at, side, whole)) {
                    if (whole != 0)
                        decide(at, [&](const glm::ivec3&, std::int32_t k) {
                            return core::is_inside_beyond(rule_, k, whole);
                        });
                } else {
                    decide_by_sums(cones, at);
                }
            }
        }
    }
    [[nodiscard]] std::uint32_t word(int r, std::size_t i) const {
        return bits_[static_cast<std::size_t>(r) * words_ + i];
    }

private:
    [[nodiscard]] core::snapped_position sample(int x, int y, int z) const {
        const auto at = [&](int i) { return (2 * std::int64_t{i} + 1) << (s_.snap.fraction - 1); };
        return {at(x), at(y), at(z)};
    }
    [[nodiscard]] bool find_whole(const core::winding_view& tree, const glm::ivec3& first, int length,
                                  std::int64_t& whole) const {
        const glm::dvec3 size = s_.where.voxel_size;
        const double x = 0.5 * (length - 1), yz = 0.5 * (side - 1);
        const double reach = std::hypot(x * size.x, yz * size.y, yz * size.z);
        core::world_point centre = core::to_world(tree, sample(first.x, first.y, first.z));
        centre.x[0] += x * size.x;
        centre.x[1] += yz * size.y;
        centre.x[2] += yz * size.z;
        return core::find_whole(tree, centre, reach * (1.0 + 0x1p-20), core::coarse_bound, whole);
    }
    // Once samples of a brick have taken as much work as some whole sums, these are a linear function for the others.
    void decide_by_sums(const core::winding_tree& cones, const glm::ivec3& first) {
        const core::winding_view tree = cones.view();
        core::winding_tree::linear near;
        const std::uint64_t most_work = std::uint64_t{4} * tree.num_triangles;
        std::uint64_t work = 0;
        bool is_linear = false;
        decide(first, [&](const glm::ivec3& at, std::int32_t k) {
            const glm::ivec3 p = at - first;
            const bool is_in =
                core::is_inside_by_winding(tree, sample(at.x, at.y, at.z), k, rule_, near.at(p.x, p.y, p.z), work);
            if (!is_linear && work > most_work) {
                is_linear = true;
                near = cones.find_linear(sample(first.x, first.y, first.z), std::int64_t{1} << s_.snap.fraction);
            }
            return is_in;
        });
    }
    // verdict(voxel, winding number): of the voxels of a brick.
    template <class Verdict>
    void decide(const glm::ivec3& first, const Verdict& verdict) {
        const glm::ivec3 end = glm::min(first + side, s_.where.extent);
        for (int z = std::max(first.z, s_.lead.z); z < end.z; ++z)
            for (int y = std::max(first.y, s_.lead.y); y < end.y; ++y)
                for (int x = std::max(first.x, s_.lead.x); x < end.x; ++x) {
                    const auto r = static_cast<std::size_t>((z - first.z) * side + y - first.y);
                    const auto i = static_cast<std::size_t>(x);
                    std::uint32_t& word = bits_[r * words_ + i / 32];
                    const std::uint32_t bit = 1u << i % 32;
                    word = verdict(glm::ivec3(x, y, z), windings_[r * stride_ + i]) ? word | bit : word & ~bit;
                }
    }

    const solid_geometry& s_;
    fill_rule rule_;
    std::size_t stride_; // a place a voxel, and one behind the row
    std::vector<std::int32_t> windings_;
    std::size_t words_;
    std::vector<std::uint32_t> bits_;
};

// The voxels of each body whose generalized winding number is inside. sorted: the crossings of draws and cones.
template <class Crossing>
[[nodiscard]] std::vector<beam_words> find_windings(const execution& how, const solid_geometry& s, fill_rule rule,
                                                    const raw_array<Crossing>& sorted, solid_counters& counts) {
    const stopwatch watch(how.times, &stage_times::fine_raster);
    const std::vector<core::winding_tree> trees = make_winding_trees(s);
    const row_numbers rows(s.where.extent);
    std::vector<beam_words> beams = all_beams(rows);
    std::vector<solid_counters> of_beam(beams.size());
    parallel_for(how.threads, beams.size(), [&](unsigned, std::size_t b) {
        const Crossing* const all = sorted.begin();
        const auto from = [&](std::uint64_t key) {
            return std::lower_bound(all, all + sorted.size(), key,
                                    [](const Crossing& c, std::uint64_t k) { return c.key < k; });
        };
        const std::uint64_t key = b * tile_rows;
        const Crossing *const first = from(key), *const last = from(key + tile_rows);
        winding_rows found(s, rule);
        constexpr int side = winding_rows::side;
        const int y0 = rows.y(key), z0 = rows.z(key);
        for (int z = z0; z < std::min(z0 + tile_size, s.where.extent.z); z += side)
            for (int y = y0; y < std::min(y0 + tile_size, s.where.extent.y); y += side)
                for (std::uint32_t body = 0; body < trees.size(); ++body) {
                    found.find(rows, y, z, body, trees[body], first, last, of_beam[b]);
                    for (int r = 0; r < side * side; ++r)
                        for (std::size_t i = 0; i < rows.words(); ++i) {
                            const std::uint32_t bits = found.word(r, i);
                            if (bits == 0) continue;
                            const std::uint64_t place = rows.number(y + r % side, z + r / side) - key;
                            beams[b].words.push_back(
                                {static_cast<std::uint32_t>(place), body, static_cast<std::uint32_t>(i), bits});
                        }
                }
    });
    end_beams(how, beams);
    counts.crossings = sorted.size();
    for (const solid_counters& c : of_beam) {
        counts.open_rows += c.open_rows;
        counts.max_winding = std::max(counts.max_winding, c.max_winding);
    }
    return beams;
}

// What an extent makes of the inside and the cover, both in order.
[[nodiscard]] inline std::vector<beam_words> join_cover(const execution& how, std::vector<beam_words>&& inside,
                                                        std::vector<beam_words>&& cover, solid_extent extent) {
    if (extent == solid_extent::centre) return std::move(inside);
    const auto is_before = [](const row_word& a, const row_word& b) {
        return a.row != b.row ? a.row < b.row : a.draw != b.draw ? a.draw < b.draw : a.word < b.word;
    };
    std::vector<beam_words> joined;
    std::size_t c = 0;
    for (beam_words& b : inside) {
        while (c < cover.size() && cover[c].beam < b.beam) {
            if (extent == solid_extent::outer) joined.push_back(std::move(cover[c]));
            ++c;
        }
        if (c < cover.size() && cover[c].beam == b.beam) {
            const std::vector<row_word>& covered = cover[c++].words;
            if (extent == solid_extent::outer) {
                b.words.insert(b.words.end(), covered.begin(), covered.end());
            } else {
                auto k = covered.begin();
                for (row_word& w : b.words) {
                    while (k != covered.end() && is_before(*k, w)) ++k;
                    for (auto same = k; same != covered.end() && !is_before(w, *same); ++same) w.bits &= ~same->bits;
                }
                b.words.erase(
                    std::remove_if(b.words.begin(), b.words.end(), [](const row_word& w) { return w.bits == 0; }),
                    b.words.end());
            }
        }
        joined.push_back(std::move(b));
    }
    for (; c < cover.size() && extent == solid_extent::outer; ++c) joined.push_back(std::move(cover[c]));
    end_beams(how, joined);
    return joined;
}

} // namespace voxelpipe::cpu
