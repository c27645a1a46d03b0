// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The nearest triangle of each sample of a brick of 8^3. The triangles near the brick are listed, then those near each
// octant, near each cube of 2^3, and at last near each sample, by bounds that only reject; the formula decides between
// the few that remain. The result is a minimum, so no order shows.

#include <cpu_ref/distance/bounds.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace voxelpipe::cpu {

// What a sample has: the least double square, and the lowest primitive that has it.
struct nearest_triangle {
    double square = std::numeric_limits<double>::infinity();
    std::uint32_t primitive = ~std::uint32_t{0};

    void take(double other, std::uint32_t number) {
        if (other < square || (other == square && number < primitive)) {
            square = other;
            primitive = number;
        }
    }
};

inline constexpr int brick_size = 8;
inline constexpr std::size_t brick_samples = 512;

// What all threads of a call read.
struct distance_scene {
    const geometry* shapes;
    const triangle_tree* tree;
    core::distance_scale scale; // world units
    vector3 voxel;              // a voxel's sides, in units of the largest one
    float band;                 // in world units; infinity: the whole field
    float band_units;           // not less, in units of the largest voxel
};

// Snapped positions of a triangle.
struct snapped_triangle {
    core::snapped_position a, b, c;
};
[[nodiscard]] inline snapped_triangle find_triangle(const geometry& s, std::uint32_t primitive) {
    const auto tri = s.find(primitive);
    const core::snapped_position* const p = s.parts[tri.draw].positions;
    return {p[tri.index.x], p[tri.index.y], p[tri.index.z]};
}
// Snapped position of a sample of the grid's part.
[[nodiscard]] inline core::snapped_position sample_position(const glm::ivec3& sample, int fraction) {
    const auto at = [&](int i) { return (2 * std::int64_t{i} + 1) << (fraction - 1); };
    return {at(sample.x), at(sample.y), at(sample.z)};
}
[[nodiscard]] inline core::seen_triangle see(const snapped_triangle& t, bool narrow, const core::snapped_position& p) {
    if (narrow)
        return core::see(core::make_narrow(t.a, t.b, t.c), static_cast<double>(p.x), static_cast<double>(p.y),
                         static_cast<double>(p.z));
    return core::see_wide(t.a, t.b, t.c, p);
}

// One thread's memory.
class brick_search {
public:
    explicit brick_search(const distance_scene& scene) : scene_(&scene) {}

    // False only if no sample of a run of four bricks lies within the band.
    [[nodiscard]] bool is_near_run(const glm::ivec3& first) {
        const vector3& v = scene_->voxel;
        if (!(scene_->band_units < std::numeric_limits<float>::infinity())) return true;
        const vector3 middle{(first.x + 16) * v.x, (first.y + 4) * v.y, (first.z + 4) * v.z};
        // From the middle to the outermost samples, 15.5 and 3.5 voxels away.
        const auto reach =
            static_cast<float>(std::sqrt(240.25 * v.x * v.x + 12.25 * v.y * v.y + 12.25 * v.z * v.z) * (1.0 + 0x1p-20));
        bool is_near = false;
        scene_->tree->visit(
            middle, [&] { return is_near ? 0.0f : scene_->band_units + reach; },
            [&](std::size_t, std::size_t) { is_near = true; });
        return is_near;
    }

    // Finds what the samples of a brick have; `first` is its lowest one. Returns false if none is within the band.
    [[nodiscard]] bool find(const glm::ivec3& first) {
        const vector3& v = scene_->voxel;
        first_ = first;
        middle_ = {(first.x + 4) * v.x, (first.y + 4) * v.y, (first.z + 4) * v.z};
        half_ = static_cast<float>(0.5 * std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z)) * (1.0f + 0x1p-20f);
        limit_ = scene_->band_units;
        if (!list()) return false;
        for (nearest_triangle& n : found_) n = {};
        refine(all_, {0.0f, 0.0f, 0.0f}, 2, 0);
        return true;
    }
    [[nodiscard]] const nearest_triangle& operator[](std::size_t i) const { return found_[i]; }

private:
    // A triangle near the brick, and its narrow form once it is needed.
    struct entry {
        local_triangle local;
        std::uint32_t primitive;
        bool narrow, ready = false;
    };

    // Lists the triangles that may be nearest to a sample of the brick.
    [[nodiscard]] bool list() {
        entries_.clear();
        all_.clear();
        narrow_.clear();
        const triangle_tree& tree = *scene_->tree;
        const float reach = 7.0f * half_;                       // half the brick's diagonal
        const float size = 4.0f;                                // of coordinates of its samples, relative to the middle
        float nearest = std::numeric_limits<float>::infinity(); // upper bound of the middle's distance
        if (!(limit_ < std::numeric_limits<float>::infinity())) {
            // Whole field: first the middle's own distance, beginning with what the brick before had.
            lane_points at{};
            lane_floats lower{}, upper{};
            const auto try_one = [&](std::size_t i) {
                const local_triangle t = make_local(tree[i], static_cast<std::uint32_t>(i), middle_, size);
                close_bounds(t, at, lower, upper);
                if (upper[0] < nearest) {
                    nearest = upper[0];
                    last_ = i;
                }
            };
            if (last_ < tree.size()) try_one(last_);
            tree.visit(
                middle_, [&] { return nearest; },
                [&](std::size_t begin, std::size_t end) {
                    for (std::size_t i = begin; i < end; ++i) try_one(i);
                });
        }
        const float bound = std::min(nearest + 2.0f * reach, limit_ + reach);
        tree.visit(
            middle_, [&] { return bound; },
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    const placed_triangle& t = tree[i];
                    entry e{make_local(t, static_cast<std::uint32_t>(i), middle_, size), t.primitive, t.narrow};
                    const std::array<float, 3>& m = e.local.middle;
                    if (std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]) - e.local.radius > bound) continue;
                    all_.push_back(static_cast<std::uint32_t>(entries_.size()));
                    entries_.push_back(e);
                }
            });
        narrow_.resize(entries_.size());
        return !entries_.empty();
    }

    // The eight points around a middle, `step` voxels from it along each axis.
    [[nodiscard]] lane_points around(const std::array<float, 3>& middle, float step) const {
        lane_points p{};
        const std::array<float, 3> d{step * static_cast<float>(scene_->voxel.x),
                                     step * static_cast<float>(scene_->voxel.y),
                                     step * static_cast<float>(scene_->voxel.z)};
        for (std::size_t l = 0; l < lanes; ++l) {
            p.x[l] = middle[0] + ((l & 1) != 0 ? d[0] : -d[0]);
            p.y[l] = middle[1] + ((l & 2) != 0 ? d[1] : -d[1]);
            p.z[l] = middle[2] + ((l & 4) != 0 ? d[2] : -d[2]);
        }
        return p;
    }

    // level 2: the octants of the brick; 1: the cubes of an octant; 0: the samples of a cube. `place`: Morton number of
    // the first sample.
    void refine(const std::vector<std::uint32_t>& from, const std::array<float, 3>& middle, int level,
                std::size_t place) {
        const float step = static_cast<float>(1 << level) * 0.5f;
        const lane_points points = around(middle, step);
        const float reach = static_cast<float>((1 << level) - 1) * half_; // from a point to its samples
        std::vector<lane_floats>& lowers = lowers_[static_cast<std::size_t>(level)];
        lowers.resize(from.size());
        lane_floats best{}, upper{};
        best.fill(std::numeric_limits<float>::infinity());
        for (std::size_t i = 0; i < from.size(); ++i) {
            const local_triangle& t = entries_[from[i]].local;
            if (level > 0 && t.radius < 1.0f) {
                ball_bounds(t, points, lowers[i], upper);
            } else {
                close_bounds(t, points, lowers[i], upper);
            }
            for (std::size_t l = 0; l < lanes; ++l) best[l] = std::min(best[l], upper[l]);
        }
        for (std::size_t l = 0; l < lanes; ++l) best[l] = std::min(best[l] + 2.0f * reach, limit_ + reach);
        if (level == 0) {
            decide(from, lowers, best, place);
            return;
        }
        std::vector<std::uint32_t>& kept = kept_[static_cast<std::size_t>(level)];
        for (std::size_t l = 0; l < lanes; ++l) {
            kept.clear();
            for (std::size_t i = 0; i < from.size(); ++i)
                if (lowers[i][l] <= best[l]) kept.push_back(from[i]);
            if (kept.empty()) continue;
            refine(kept, {points.x[l], points.y[l], points.z[l]}, level - 1, place + (l << (3 * level)));
        }
    }

    void decide(const std::vector<std::uint32_t>& from, const std::vector<lane_floats>& lowers, const lane_floats& best,
                std::size_t place) {
        const int fraction = scene_->shapes->snap.fraction;
        for (std::size_t i = 0; i < from.size(); ++i) {
            unsigned near = 0;
            for (std::size_t l = 0; l < lanes; ++l) near |= static_cast<unsigned>(lowers[i][l] <= best[l]) << l;
            if (near == 0) continue;
            entry& e = entries_[from[i]];
            const snapped_triangle t = find_triangle(*scene_->shapes, e.primitive);
            for (std::size_t l = 0; l < lanes; ++l) {
                if ((near >> l & 1u) == 0) continue;
                const core::snapped_position p = sample_position(first_ + offset_of(place + l), fraction);
                const core::seen_triangle seen =
                    e.narrow ? see_narrow(from[i], t, p) : core::see_wide(t.a, t.b, t.c, p);
                found_[place + l].take(core::find_distance(seen, scene_->scale).square, e.primitive);
            }
        }
    }
    [[nodiscard]] core::seen_triangle see_narrow(std::uint32_t i, const snapped_triangle& t,
                                                 const core::snapped_position& p) {
        if (!entries_[i].ready) {
            narrow_[i] = core::make_narrow(t.a, t.b, t.c);
            entries_[i].ready = true;
        }
        return core::see(narrow_[i], static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
    }

public:
    // Position in the brick of the sample with a Morton number.
    [[nodiscard]] static glm::ivec3 offset_of(std::size_t m) {
        const auto bits = [&](std::size_t a) {
            return static_cast<int>((m >> a & 1) | (m >> (a + 2) & 2) | (m >> (a + 4) & 4));
        };
        return {bits(0), bits(1), bits(2)};
    }
    // The Morton number of a sample.
    [[nodiscard]] static std::size_t number_of(int x, int y, int z) {
        const auto spread = [](int a) {
            const auto v = static_cast<std::size_t>(a);
            return (v & 1) | (v & 2) << 2 | (v & 4) << 4;
        };
        return spread(x) | spread(y) << 1 | spread(z) << 2;
    }

private:
    const distance_scene* scene_;
    glm::ivec3 first_{0};
    vector3 middle_{};
    float half_ = 0.0f;  // of a voxel's diagonal
    float limit_ = 0.0f; // the band
    std::size_t last_ = ~std::size_t{0};
    std::vector<entry> entries_;
    std::vector<core::narrow_triangle> narrow_;
    std::vector<std::uint32_t> all_;
    std::array<std::vector<std::uint32_t>, 3> kept_;
    std::array<std::vector<lane_floats>, 3> lowers_;
    std::array<nearest_triangle, brick_samples> found_;
};

} // namespace voxelpipe::cpu
