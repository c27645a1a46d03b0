// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::winding: the winding numbers of the mesh with its cones, of 8 x 8 rows at a time, and what the cones' solid
// angles make of them, brick by brick.

#include <cpu_ref/solid/solid_repair.hpp>
#include <voxelpipe/solid/core/winding_bricks.hpp>
#include <voxelpipe/solid/core/winding_lids.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

// The geometry of the draws alone, or of the cones alone. Refers to `s`.
[[nodiscard]] inline solid_geometry keep_parts(const solid_geometry& s, bool cones) {
    solid_geometry r;
    r.where = s.where;
    r.lead = s.lead;
    r.snap = s.snap;
    r.triangles_in = s.triangles_in;
    std::uint32_t first = 0;
    for (std::size_t p = 0; p < s.parts.size(); ++p) {
        if (s.is_repair[p] != cones) continue;
        r.parts.push_back(s.parts[p]);
        r.body.push_back(s.body[p]);
        r.is_repair.push_back(cones);
        r.first_primitive.push_back(first);
        first += s.parts[p].num_triangles;
    }
    r.first_primitive.push_back(first);
    return r;
}

// The trees of each body's holes.
[[nodiscard]] inline std::vector<core::winding_tree> make_winding_trees(const execution& how, const solid_geometry& s) {
    const core::distance_scale scale = core::make_distance_scale(s.where.voxel_size, s.snap.fraction);
    std::vector<core::winding_tree> trees;
    trees.reserve(s.cones.size());
    for (const core::hole_cones& cones : s.cones) trees.emplace_back(cones, scale, how.threads);
    return trees;
}

// What meets the bricks of a body that has holes, which samples lie on its cones, and where rows decide.
class winding_bricks {
public:
    winding_bricks() = default;
    winding_bricks(const execution& how, const solid_geometry& s, std::uint32_t body, const core::winding_view& tree)
        : extent_{{s.where.extent.x, s.where.extent.y, s.where.extent.z}}, count_(core::bricks_of(extent_)),
          marks_(static_cast<std::size_t>(count_[0] * count_[1] * count_[2])) {
        for (std::size_t p = 0; p < s.parts.size(); ++p)
            if (s.body[p] == body) mark(how, s.parts[p], s.snap.fraction, s.is_repair[p]);
        std::sort(on_cones_.begin(), on_cones_.end());
        for (const std::uint64_t i : on_cones_) {
            const auto x = static_cast<std::uint64_t>(extent_[0]), y = static_cast<std::uint64_t>(extent_[1]);
            marks_[brick(static_cast<std::int64_t>(i % x) / side, static_cast<std::int64_t>(i / x % y) / side,
                         static_cast<std::int64_t>(i / x / y) / side)] |= core::has_samples_on_cones;
        }
        find_boxes_of_rows(how, tree, s.snap.fraction);
    }
    // True if the cones cover less than half from the voxel's box: rows decide.
    [[nodiscard]] bool is_of_rows(const glm::ivec3& voxel) const { return is_of_rows_[box(voxel)] != 0; }
    // The marks of the brick with this voxel.
    [[nodiscard]] unsigned marks(const glm::ivec3& voxel) const {
        return marks_[brick(voxel.x / side, voxel.y / side, voxel.z / side)];
    }
    [[nodiscard]] bool is_on_cone(const glm::ivec3& voxel) const {
        return std::binary_search(on_cones_.begin(), on_cones_.end(), sample(voxel.x, voxel.y, voxel.z));
    }

private:
    static constexpr int side = core::winding_brick;

    [[nodiscard]] std::size_t brick(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>((z * count_[1] + y) * count_[0] + x);
    }
    static constexpr int box_side = core::small_winding_box;
    [[nodiscard]] int boxes(int axis) const { return static_cast<int>((extent_[axis] + box_side - 1) / box_side); }
    [[nodiscard]] std::size_t box(const glm::ivec3& voxel) const {
        const glm::ivec3 b = voxel / box_side;
        return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(boxes(1)) + static_cast<std::size_t>(b.y)) *
                   static_cast<std::size_t>(boxes(0)) +
               static_cast<std::size_t>(b.x);
    }
    // Large boxes, and the small ones of those that are not decided.
    void find_boxes_of_rows(const execution& how, const core::winding_view& tree, int fraction) {
        const int extent[3] = {static_cast<int>(extent_[0]), static_cast<int>(extent_[1]),
                               static_cast<int>(extent_[2])};
        is_of_rows_.resize(static_cast<std::size_t>(boxes(0)) * static_cast<std::size_t>(boxes(1)) *
                           static_cast<std::size_t>(boxes(2)));
        constexpr int large = core::large_winding_box;
        const auto is_decided = [&](const glm::ivec3& v, int box) {
            return core::is_below_half(tree, core::winding_samples::of_box({v.x, v.y, v.z}, box, extent, fraction));
        };
        const auto rows = [&](int axis) { return static_cast<std::size_t>((extent[axis] + large - 1) / large); };
        parallel_for(how.threads, rows(1) * rows(2), [&](unsigned, std::size_t row) {
            const int y0 = static_cast<int>(row % rows(1)) * large, z0 = static_cast<int>(row / rows(1)) * large;
            for (int x0 = 0; x0 < extent[0]; x0 += large) {
                const bool whole = is_decided({x0, y0, z0}, large);
                for (int z = z0; z < std::min(z0 + large, extent[2]); z += box_side)
                    for (int y = y0; y < std::min(y0 + large, extent[1]); y += box_side)
                        for (int x = x0; x < std::min(x0 + large, extent[0]); x += box_side)
                            is_of_rows_[box({x, y, z})] = whole || is_decided({x, y, z}, box_side) ? 1 : 0;
            }
        });
    }
    [[nodiscard]] std::uint64_t sample(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return static_cast<std::uint64_t>((z * extent_[1] + y) * extent_[0] + x);
    }
    void mark(const execution& how, const geometry::part& part, int fraction, bool is_cone) {
        constexpr std::uint32_t block = 4096;
        const std::uint32_t blocks = (part.num_triangles + block - 1) / block;
        std::vector<std::vector<std::uint64_t>> found(blocks);
        const std::uint8_t bit = is_cone ? core::meets_cones : core::meets_mesh;
        parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
            const auto first = static_cast<std::uint32_t>(b) * block;
            for (std::uint32_t i = first; i < std::min(part.num_triangles, first + block); ++i) {
                const glm::uvec3 t = part.triangles[i];
                const core::snapped_position &p = part.positions[t.x], &q = part.positions[t.y],
                                             &r = part.positions[t.z];
                if (core::classify_positions(p, q, r) != core::triangle_class::drawn) continue;
                core::visit_bricks(p, q, r, extent_, fraction, 0, 1,
                                   [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                                       const std::atomic_ref<std::uint8_t> m(marks_[brick(x, y, z)]);
                                       if ((m.load(std::memory_order_relaxed) & bit) == 0)
                                           m.fetch_or(bit, std::memory_order_relaxed);
                                   });
                if (is_cone)
                    core::visit_samples_on(
                        p, q, r, extent_, fraction, 0, 1,
                        [&](std::int64_t x, std::int64_t y, std::int64_t z) { found[b].push_back(sample(x, y, z)); });
            }
        });
        for (const auto& f : found) on_cones_.insert(on_cones_.end(), f.begin(), f.end());
    }

    core::triple<std::int64_t> extent_{}, count_{};
    std::vector<std::uint8_t> marks_, is_of_rows_;
    std::vector<std::uint64_t> on_cones_; // ascending
};

// The rows of 8 x 8 voxels of one body: winding numbers, then verdicts.
class winding_rows {
public:
    static constexpr int side = core::winding_brick;

    winding_rows(const solid_geometry& s, fill_rule rule)
        : s_(s), rule_(rule), stride_(static_cast<std::size_t>(s.where.extent.x) + 1), windings_(stride_ * side * side),
          of_cones_(stride_ * side * side), words_((stride_ + 31) / 32), bits_(words_ * side * side) {}

    // Finds the bits of the rows from (y0, z0) on. [first, last): the crossings of their beam; and those of cones
    // alone.
    template <class Crossing>
    void find(const row_numbers& rows, int y0, int z0, std::uint32_t body, const core::winding_view& tree,
              const winding_bricks& bricks, const Crossing* first, const Crossing* last, const Crossing* first_cone,
              const Crossing* last_cone, solid_counters& counts) {
        std::fill(bits_.begin(), bits_.end(), 0u);
        count_up(rows, y0, z0, body, first, last, windings_);
        for (int r = 0; r < side * side; ++r) {
            const std::int32_t* const w = windings_.data() + static_cast<std::size_t>(r) * stride_;
            counts.open_rows += w[stride_ - 1] != 0 ? 1 : 0;
            std::uint32_t* const bits = bits_.data() + static_cast<std::size_t>(r) * words_;
            for (auto x = static_cast<std::size_t>(s_.lead.x); x + 1 < stride_; ++x) {
                if (w[x] == 0) continue;
                counts.max_winding = std::max(counts.max_winding, static_cast<std::uint64_t>(std::abs(w[x])));
                if (core::is_inside(rule_, w[x])) bits[x / 32] |= 1u << x % 32;
            }
        }
        if (tree.num_triangles == 0) return;
        count_up(rows, y0, z0, body, first_cone, last_cone, of_cones_);
        for (int x = s_.lead.x / side * side; x < s_.where.extent.x; x += side) judge(tree, bricks, {x, y0, z0});
    }
    [[nodiscard]] std::uint32_t word(int r, std::size_t i) const {
        return bits_[static_cast<std::size_t>(r) * words_ + i];
    }

private:
    // Winding numbers along the rows; 0 in those that are not drawn.
    template <class Crossing>
    void count_up(const row_numbers& rows, int y0, int z0, std::uint32_t body, const Crossing* first,
                  const Crossing* last, std::vector<std::int32_t>& windings) const {
        std::fill(windings.begin(), windings.end(), 0);
        for (int r = 0; r < side * side; ++r) {
            const int y = y0 + r % side, z = z0 + r / side;
            if (y < s_.lead.y || z < s_.lead.z || y >= s_.where.extent.y || z >= s_.where.extent.z) continue;
            const std::uint64_t key = rows.number(y, z);
            const Crossing* at =
                std::lower_bound(first, last, key, [](const Crossing& c, std::uint64_t k) { return c.key < k; });
            std::int32_t* const w = windings.data() + static_cast<std::size_t>(r) * stride_;
            for (; at != last && at->key == key; ++at)
                if (at->draw == body) w[crossing_voxel(at->at)] += crossing_winding(at->at);
            for (std::size_t x = 1; x < stride_; ++x) w[x] += w[x - 1];
        }
    }
    [[nodiscard]] std::size_t row(const glm::ivec3& voxel) const {
        return static_cast<std::size_t>(voxel.z % side) * std::size_t{side} + static_cast<std::size_t>(voxel.y % side);
    }
    // Decides the voxels of the brick that begins there.
    void judge(const core::winding_view& tree, const winding_bricks& bricks, const glm::ivec3& brick) {
        const glm::ivec3 begin = glm::max(brick, s_.lead), end = glm::min(brick + side, s_.where.extent);
        if (begin.y >= end.y || begin.z >= end.z || bricks.is_of_rows(brick)) return;
        const unsigned marks = bricks.marks(brick);
        const core::winding_samples samples =
            core::winding_samples::of_box({begin.x, begin.y, begin.z}, side, {end.x, end.y, end.z}, s_.snap.fraction);
        const glm::ivec3 middle = begin + glm::ivec3(samples.middle(0), samples.middle(1), samples.middle(2));
        const std::size_t m = row(middle) * stride_ + static_cast<std::size_t>(middle.x);
        const core::winding_verdict known =
            core::judge_brick(tree, samples, windings_[m], of_cones_[m], marks, rule_, near_holes_.data());
        if (known.kind == core::winding_verdict::beyond && known.whole == 0) return; // as the bits are
        for (int z = begin.z; z < end.z; ++z)
            for (int y = begin.y; y < end.y; ++y)
                for (int x = begin.x; x < end.x; ++x) {
                    const glm::ivec3 voxel(x, y, z);
                    const std::size_t r = row(voxel), i = static_cast<std::size_t>(x);
                    const core::winding_sample of{windings_[r * stride_ + i], of_cones_[r * stride_ + i],
                                                  (marks & core::has_samples_on_cones) != 0 &&
                                                      bricks.is_on_cone(voxel)};
                    std::uint32_t& word = bits_[r * words_ + i / 32];
                    const std::uint32_t bit = 1u << i % 32;
                    word = core::judge_sample(tree, samples, known, near_holes_.data(), x - begin.x, y - begin.y,
                                              z - begin.z, of, rule_)
                               ? word | bit
                               : word & ~bit;
                }
    }

    const solid_geometry& s_;
    fill_rule rule_;
    std::size_t stride_;                            // a place a voxel, and one behind the row
    std::vector<std::int32_t> windings_, of_cones_; // of draws and cones, and of cones alone
    std::size_t words_;
    std::vector<std::uint32_t> bits_;
    std::array<std::uint32_t, core::near_holes::most> near_holes_{}; // of the brick that is judged
};

// The voxels of each body whose generalized winding number is inside. sorted: the crossings of draws and cones.
template <class Crossing>
[[nodiscard]] std::vector<beam_words> find_windings(const execution& how, const solid_geometry& s, fill_rule rule,
                                                    const raw_array<Crossing>& sorted, solid_counters& counts) {
    const raw_array<Crossing> of_cones = find_crossings<Crossing>(how, keep_parts(s, true), false).crossings;
    how.enter(stage::fine_raster);
    const stopwatch watch(how.times, &stage_times::fine_raster);
    const std::vector<core::winding_tree> trees = make_winding_trees(how, s);
    std::vector<winding_bricks> bricks(trees.size());
    for (std::uint32_t body = 0; body < trees.size(); ++body)
        if (trees[body].view().num_triangles != 0) bricks[body] = winding_bricks(how, s, body, trees[body].view());
    const row_numbers rows(s.where.extent);
    std::vector<beam_words> beams = all_beams(rows);
    std::vector<solid_counters> of_beam(beams.size());
    parallel_for(how.threads, beams.size(), [&](unsigned, std::size_t b) {
        const auto from = [&](const raw_array<Crossing>& all, std::uint64_t key) {
            return std::lower_bound(all.begin(), all.begin() + all.size(), key,
                                    [](const Crossing& c, std::uint64_t k) { return c.key < k; });
        };
        const std::uint64_t key = b * tile_rows;
        const Crossing *const first = from(sorted, key), *const last = from(sorted, key + tile_rows),
                              *const first_cone = from(of_cones, key),
                              *const last_cone = from(of_cones, key + tile_rows);
        winding_rows found(s, rule);
        constexpr int side = winding_rows::side;
        const int y0 = rows.y(key), z0 = rows.z(key);
        for (int z = z0; z < std::min(z0 + tile_size, s.where.extent.z); z += side)
            for (int y = y0; y < std::min(y0 + tile_size, s.where.extent.y); y += side)
                for (std::uint32_t body = 0; body < trees.size(); ++body) {
                    found.find(rows, y, z, body, trees[body].view(), bricks[body], first, last, first_cone, last_cone,
                               of_beam[b]);
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
