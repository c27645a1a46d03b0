// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Cuts a grid into slabs of about equal work: the layers of one axis, in contiguous ranges. A slab is a crop of the
// grid, so that the results of all slabs together are that of the whole, bit for bit. Plain C++; nothing is drawn here.
//
//   histogram   triangles that begin and end in each layer, along the three axes: one pass over the triangles. Those of
//               several machines are added up.
//   split       a number of slabs, so that the most expensive one is as cheap as cuts between layers allow
//   cover       as few slabs as keep each one below a limit

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/primitive.hpp>
#include <voxelpipe/grid.hpp>
#include <voxelpipe/solid/core/crossing.hpp>
#include <voxelpipe/status.hpp>
#include <voxelpipe/triangle_counts.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// The layers [begin, end) of an axis.
struct layer_range {
    int begin = 0, end = 0;

    [[nodiscard]] int size() const { return end - begin; }
    friend bool operator==(const layer_range&, const layer_range&) = default;
};

// Counts triangles by the layers that they reach. 16 bytes a layer and axis.
class histogram {
public:
    histogram() = default;
    // extent: voxels of the grid's computed part.
    explicit histogram(glm::ivec3 extent) : extent_(extent) {
        std::size_t words = 0;
        for (int a = 0; a < 3; ++a) words += 2 * static_cast<std::size_t>(extent[a]);
        words_.resize(words);
    }

    // As given.
    [[nodiscard]] glm::ivec3 extent() const { return extent_; }

    // reach: the voxels that a triangle may touch, not empty and within the extent.
    void add(const core::voxel_box& reach) {
        for (int a = 0; a < 3; ++a) {
            ++begins(a)[static_cast<std::size_t>(reach.lo[a])];
            ++ends(a)[static_cast<std::size_t>(reach.hi[a])];
        }
    }
    // All numbers, for a sum over several histograms of one extent, as in an all-reduce.
    [[nodiscard]] std::span<std::uint64_t> words() { return words_; }
    [[nodiscard]] std::span<const std::uint64_t> words() const { return words_; }

    // Triangles by their first layer along an axis.
    [[nodiscard]] std::span<std::uint64_t> begins(int axis) { return words(axis).first(layers(axis)); }
    // Triangles by their last layer.
    [[nodiscard]] std::span<std::uint64_t> ends(int axis) { return words(axis).last(layers(axis)); }
    [[nodiscard]] std::span<const std::uint64_t> begins(int axis) const { return words(axis).first(layers(axis)); }
    [[nodiscard]] std::span<const std::uint64_t> ends(int axis) const { return words(axis).last(layers(axis)); }

private:
    [[nodiscard]] std::size_t layers(int axis) const { return static_cast<std::size_t>(extent_[axis]); }
    [[nodiscard]] std::size_t first_word(int axis) const {
        std::size_t first = 0;
        for (int a = 0; a < axis; ++a) first += 2 * layers(a);
        return first;
    }
    [[nodiscard]] std::span<std::uint64_t> words(int axis) {
        return std::span(words_).subspan(first_word(axis), 2 * layers(axis));
    }
    [[nodiscard]] std::span<const std::uint64_t> words(int axis) const {
        return std::span(words_).subspan(first_word(axis), 2 * layers(axis));
    }

    glm::ivec3 extent_{0};
    std::vector<std::uint64_t> words_;
};

// What a slab costs, in any unit, and where it may be cut.
struct plan_options {
    std::uint64_t triangle_cost = 1; // of each triangle that reaches the slab
    std::uint64_t layer_cost = 0;    // of each of its layers, such as their clear and their output
    std::uint64_t voxel_cost = 0;    // of each of its voxels, whose number in a layer depends on the axis
    int align = 1;                   // slabs begin at multiples of this, from the computed part's first layer
    bool may_turn = true;            // x or y may be chosen; A-buffers and files that are written in order need z
    bool may_be_along_x = true;      // not for solids: a row along x crosses slabs beside the triangles that it needs
    double turn_gain = 1.05;         // another axis than z must be better by more than this factor
};

// Slabs of a grid's computed part, and what they cost.
struct plan {
    int axis = 2;                    // that the slabs follow each other along: 0 x, 1 y, 2 z
    std::vector<layer_range> slabs;  // in order, without gaps; the last ones may be empty
    std::uint64_t bottleneck = 0;    // cost of the most expensive slab
    std::uint64_t triangles = 0;     // that reach the grid
    std::uint64_t triangles_cut = 0; // sum over all slabs, less `triangles`: what is sent or drawn more than once

    // Slab i as a crop of the grid that was planned for.
    [[nodiscard]] grid crop(const grid& whole, std::size_t i) const {
        glm::ivec3 begin(0), size = whole.extent;
        begin[axis] = slabs[i].begin;
        size[axis] = slabs[i].size();
        return whole.crop(begin, size);
    }
};

namespace detail {

// Costs of ranges of layers along one axis.
class layer_costs {
public:
    layer_costs(const histogram& counts, int axis, const plan_options& options)
        : options_(options), layers_(counts.extent()[axis]), step_(std::max(1, options.align)) {
        const glm::ivec3 e = counts.extent();
        const std::int64_t area = std::int64_t{e[(axis + 1) % 3]} * e[(axis + 2) % 3];
        options_.layer_cost += options_.voxel_cost * static_cast<std::uint64_t>(area);
        const auto begins = counts.begins(axis), ends = counts.ends(axis);
        begun_.resize(begins.size() + 1);
        ended_.resize(ends.size() + 1);
        for (std::size_t i = 0; i < begins.size(); ++i) {
            begun_[i + 1] = begun_[i] + begins[i];
            ended_[i + 1] = ended_[i] + ends[i];
        }
    }
    [[nodiscard]] std::uint64_t triangles(const layer_range& r) const {
        return r.size() == 0 ? 0 : begun_[static_cast<std::size_t>(r.end)] - ended_[static_cast<std::size_t>(r.begin)];
    }
    [[nodiscard]] std::uint64_t cost(const layer_range& r) const {
        return triangles(r) * options_.triangle_cost + static_cast<std::uint64_t>(r.size()) * options_.layer_cost;
    }
    [[nodiscard]] std::uint64_t all_triangles() const { return begun_.back(); }
    [[nodiscard]] int layers() const { return layers_; }

    // The longest range from `begin` on whose cost is at most `limit`: one step of alignment at least.
    [[nodiscard]] layer_range longest(int begin, std::uint64_t limit) const {
        const int all = (layers_ - begin + step_ - 1) / step_;
        const int steps = core::bisect_last(1, all + 1, [&](int n) {
            return cost({begin, end_of(begin, n)}) <= limit;
        });
        return {begin, end_of(begin, steps)};
    }
    // The fewest ranges whose costs are at most `limit`, but for single steps that cost more.
    [[nodiscard]] std::vector<layer_range> ranges_below(std::uint64_t limit) const {
        std::vector<layer_range> ranges;
        for (int at = 0; at < layers_; at = ranges.back().end) ranges.push_back(longest(at, limit));
        return ranges;
    }
    [[nodiscard]] std::uint64_t dearest(const std::vector<layer_range>& ranges) const {
        std::uint64_t most = 0;
        for (const layer_range& r : ranges) most = std::max(most, cost(r));
        return most;
    }

private:
    [[nodiscard]] int end_of(int begin, int steps) const {
        return static_cast<int>(std::min<std::int64_t>(layers_, begin + static_cast<std::int64_t>(steps) * step_));
    }
    plan_options options_;
    int layers_, step_;
    std::vector<std::uint64_t> begun_, ended_; // triangles that begin, or end, before a layer
};

[[nodiscard]] inline plan make_plan(const layer_costs& costs, int axis, std::vector<layer_range> ranges) {
    plan p{axis, std::move(ranges), 0, costs.all_triangles(), 0};
    p.bottleneck = costs.dearest(p.slabs);
    std::uint64_t sum = 0;
    for (const layer_range& r : p.slabs) sum += costs.triangles(r);
    p.triangles_cut = sum - p.triangles;
    return p;
}

[[nodiscard]] inline plan split_along(const histogram& counts, int axis, int num_slabs, const plan_options& options) {
    const layer_costs costs(counts, axis, options);
    // The least limit that `num_slabs` ranges meet: costs grow with their ranges, so longest ranges need the fewest.
    const auto meets = [&](std::uint64_t limit) {
        const auto ranges = costs.ranges_below(limit);
        return ranges.size() <= static_cast<std::size_t>(num_slabs) && costs.dearest(ranges) <= limit;
    };
    const std::uint64_t least =
        core::bisect(costs.cost({0, costs.layers()}), [&](std::uint64_t limit) { return !meets(limit); });
    std::vector<layer_range> ranges = costs.ranges_below(least);
    ranges.resize(static_cast<std::size_t>(num_slabs), {costs.layers(), costs.layers()});
    return make_plan(costs, axis, std::move(ranges));
}

} // namespace detail

// `num_slabs` slabs, at least 1, of least bottleneck. Along z, or along another axis that is better by turn_gain.
[[nodiscard]] inline plan split(const histogram& counts, int num_slabs, const plan_options& options = {}) {
    plan best = detail::split_along(counts, 2, std::max(1, num_slabs), options);
    if (!options.may_turn) return best;
    auto to_beat = static_cast<double>(best.bottleneck) / options.turn_gain;
    for (const int axis : {1, 0}) {
        if (axis == 0 && !options.may_be_along_x) continue;
        plan other = detail::split_along(counts, axis, std::max(1, num_slabs), options);
        if (static_cast<double>(other.bottleneck) >= to_beat) continue;
        to_beat = static_cast<double>(other.bottleneck);
        best = std::move(other);
    }
    return best;
}

// As few slabs along an axis as keep each one's cost at `limit` or below. One layer (`align` of them) that costs more
// is a slab by itself.
[[nodiscard]] inline plan cover(const histogram& counts, int axis, std::uint64_t limit,
                                const plan_options& options = {}) {
    const detail::layer_costs costs(counts, axis, options);
    return detail::make_plan(costs, axis, costs.ranges_below(limit));
}

// Slabs of about equal thickness along an axis, for a grid whose triangles are not known yet.
[[nodiscard]] inline plan equal_layers(const grid& g, int axis, int num_slabs, int align = 1) {
    plan p;
    p.axis = axis;
    const std::int64_t layers = g.extent[axis], step = std::max(1, align), steps = (layers + step - 1) / step;
    const std::int64_t n = std::clamp<std::int64_t>(num_slabs, 1, std::max<std::int64_t>(1, steps));
    for (std::int64_t i = 0; i < n; ++i)
        p.slabs.push_back({static_cast<int>(std::min(layers, steps * i / n * step)),
                           static_cast<int>(std::min(layers, steps * (i + 1) / n * step))});
    return p;
}

// Why a triangle is not drawn, or which voxels of the computed part it may touch. Positions are those that the vertex
// shader gives.
struct classified {
    core::triangle_class kind = core::triangle_class::outside; // drawn, or why not
    core::voxel_box reach{};                                   // within the extent, of a triangle that is drawn
};
// is_solid: as voxelize_solid needs them. Triangles beside the grid along x cross its rows too, and their reach is the
// nearest layer; those of no area are kept.
[[nodiscard]] VOXELPIPE_HD inline classified classify(const core::snap_transform& snap, const glm::ivec3& extent,
                                                      coverage rule, const glm::vec3& a, const glm::vec3& b,
                                                      const glm::vec3& c, bool is_solid = false) {
    const auto snapped = [&](const glm::vec3& p) { return core::snap(snap, p.x, p.y, p.z); };
    const core::snapped_position p = snapped(a), q = snapped(b), r = snapped(c);
    core::voxel_box whole{{{0, 0, 0}}, {{extent.x - 1, extent.y - 1, extent.z - 1}}};
    constexpr std::int64_t far = std::int64_t{1} << core::coordinate_bits;
    if (is_solid) whole.lo[0] = -far, whole.hi[0] = far;
    classified t;
    t.kind = rule == coverage::thin && !is_solid
                 ? core::classify<coverage::thin>(p, q, r, snap.fraction, whole, t.reach)
                 : core::classify<coverage::conservative>(p, q, r, snap.fraction, whole, t.reach);
    if (is_solid) {
        const auto nearest = [&](std::int64_t x) { return x < 0 ? 0 : x < extent.x ? x : extent.x - 1; };
        t.reach.lo[0] = nearest(t.reach.lo[0]);
        t.reach.hi[0] = nearest(t.reach.hi[0]);
    } else if (t.kind == core::triangle_class::drawn && rule != coverage::conservative &&
               core::has_zero_area(p, q, r)) {
        t.kind = core::triangle_class::zero_area;
    }
    return t;
}

// Classifies a triangle as voxelize_solid with repair::vote needs it, in slabs along z: rows along all axes count, so
// that a triangle beside the grid does that meets two of its intervals. Where it misses that of z, it is drawn, and its
// reach is empty: no slab needs it.
[[nodiscard]] VOXELPIPE_HD inline classified classify_for_vote(const core::snap_transform& snap,
                                                               const glm::ivec3& extent, const glm::vec3& a,
                                                               const glm::vec3& b, const glm::vec3& c) {
    const auto snapped = [&](const glm::vec3& p) { return core::snap(snap, p.x, p.y, p.z); };
    const core::snapped_position p = snapped(a), q = snapped(b), r = snapped(c);
    const core::voxel_box whole{{{0, 0, 0}}, {{extent.x - 1, extent.y - 1, extent.z - 1}}};
    classified t;
    t.kind = core::classify_for_rows(p, q, r, snap.fraction, whole, true);
    t.reach = {{{0, 0, 0}}, {{-1, -1, -1}}};
    if (t.kind != core::triangle_class::drawn) return t;
    t.reach = core::bounds(p, q, r, snap.fraction);
    for (int axis = 0; axis < 2; ++axis) {
        const auto nearest = [&](std::int64_t i) { return i < 0 ? 0 : i > whole.hi[axis] ? whole.hi[axis] : i; };
        t.reach.lo[axis] = nearest(t.reach.lo[axis]);
        t.reach.hi[axis] = nearest(t.reach.hi[axis]);
    }
    t.reach = core::intersect(t.reach, whole);
    return t;
}

// Classifies a triangle as voxelize_distance does, whose band reaches `halo` layers beyond the grid (core::band_halo).
// Its reach are the samples that it may be near, but along x all, because its crossings count for the sign, whether it
// is drawn or outside.
[[nodiscard]] VOXELPIPE_HD inline classified classify_for_distance(const core::snap_transform& snap,
                                                                   const glm::ivec3& extent, const glm::ivec3& halo,
                                                                   const glm::vec3& a, const glm::vec3& b,
                                                                   const glm::vec3& c) {
    const auto snapped = [&](const glm::vec3& p) { return core::snap(snap, p.x, p.y, p.z); };
    const core::snapped_position p = snapped(a), q = snapped(b), r = snapped(c);
    classified t;
    t.kind = core::classify_positions(p, q, r);
    t.reach = {{{0, 0, 0}}, {{-1, -1, -1}}};
    if (t.kind != core::triangle_class::drawn) return t;
    const core::voxel_box box = core::bounds(p, q, r, snap.fraction);
    core::voxel_box whole{}, near{}, reach{};
    for (int k = 0; k < 3; ++k) {
        // A whole field has no outside.
        const std::int64_t layers = halo[k] < 2 * grid::max_extent ? halo[k] : std::int64_t{1} << 42;
        near.lo[k] = -layers;
        near.hi[k] = extent[k] - 1 + layers;
        whole.lo[k] = 0;
        whole.hi[k] = extent[k] - 1;
        reach.lo[k] = k == 0 ? 0 : box.lo[k] - layers;
        reach.hi[k] = k == 0 ? whole.hi[k] : box.hi[k] + layers;
    }
    if (core::intersect(box, near).empty()) t.kind = core::triangle_class::outside;
    t.reach = core::intersect(reach, whole);
    return t;
}

// Classifies a triangle as voxelize_links does. Its reach are the voxels whose links may meet its box: they end half a
// voxel beyond them.
[[nodiscard]] VOXELPIPE_HD inline classified classify_for_links(const core::snap_transform& snap,
                                                                const glm::ivec3& extent, const glm::vec3& a,
                                                                const glm::vec3& b, const glm::vec3& c) {
    const auto snapped = [&](const glm::vec3& p) { return core::snap(snap, p.x, p.y, p.z); };
    const core::snapped_position p = snapped(a), q = snapped(b), r = snapped(c);
    classified t;
    t.kind = core::classify_positions(p, q, r);
    t.reach = {{{0, 0, 0}}, {{-1, -1, -1}}};
    if (t.kind != core::triangle_class::drawn) return t;
    const std::int64_t half = std::int64_t{1} << (snap.fraction - 1);
    const std::int64_t at[3][3] = {{p.x, q.x, r.x}, {p.y, q.y, r.y}, {p.z, q.z, r.z}};
    core::voxel_box whole{}, reach{};
    for (int k = 0; k < 3; ++k) {
        const std::int64_t low = core::min3(at[k][0], at[k][1], at[k][2]),
                           high = core::max3(at[k][0], at[k][1], at[k][2]);
        whole.lo[k] = 0;
        whole.hi[k] = extent[k] - 1;
        reach.lo[k] = -((3 * half - low) >> snap.fraction); // the least voxel whose links end at or beyond `low`
        reach.hi[k] = (high + half) >> snap.fraction;
    }
    t.reach = core::intersect(reach, whole);
    if (t.reach.empty()) t.kind = core::triangle_class::outside;
    return t;
}

// The status of the whole: what was drawn in all slabs, added up, and the counts of the triangles of the whole.
[[nodiscard]] inline status with_triangles(status all, const counters& triangles) {
    const counters drawn = all.counts;
    all.counts = triangles;
    all.counts.fragments = drawn.fragments;
    all.counts.fragments_discarded = drawn.fragments_discarded;
    all.counts.voxels = drawn.voxels;
    return all;
}

// Adds what different slabs have drawn: fragments, voxels and rows. Their triangles are not added up.
inline void add_drawn(status& all, const status& one) {
    all.counts.fragments += one.counts.fragments;
    all.counts.fragments_discarded += one.counts.fragments_discarded;
    all.counts.voxels += one.counts.voxels;
    all.solid.open_rows += one.solid.open_rows;
    all.solid.crossings += one.solid.crossings;
    all.solid.max_winding = std::max(all.solid.max_winding, one.solid.max_winding);
    all.distance.band_samples += one.distance.band_samples;
    cell_counters& c = all.cells;
    const std::uint64_t low = c.volume_low + one.cells.volume_low;
    c.volume_high += one.cells.volume_high + (low < c.volume_low ? 1 : 0);
    c.volume_low = low;
    c.cut_voxels += one.cells.cut_voxels;
    c.below_zero += one.cells.below_zero;
    c.above_one += one.cells.above_one;
    c.open_rows += one.cells.open_rows;
    c.cell_records += one.cells.cell_records;
    c.lost_centroids += one.cells.lost_centroids;
}
// The holes that a repair has counted are those of cut cells.
inline void move_holes_to_cells(status& s) {
    s.cells.hole_edges = std::exchange(s.solid.hole_edges, 0);
    s.cells.holes = std::exchange(s.solid.holes, 0);
    s.cells.cones = std::exchange(s.solid.cones, 0);
}

// The items [first, second) of `count` that one of several ranks or devices reads: contiguous, ascending with the rank,
// of about equal number.
[[nodiscard]] inline std::pair<std::uint64_t, std::uint64_t> share_of(std::uint64_t count, int rank, int num_ranks) {
    const auto at = [&](int r) {
        const auto n = static_cast<std::uint64_t>(num_ranks), i = static_cast<std::uint64_t>(r);
        return count / n * i + std::min(i, count % n);
    };
    return {at(rank), at(rank + 1)};
}

} // namespace voxelpipe::slabs
