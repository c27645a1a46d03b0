// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The occupied voxels as something that rays can hit: bricks of 8^3 voxels, 64 bytes each and only where there are any,
// found through a table. An entry without a brick says how far the next brick is, so that empty space is crossed in
// large steps and a ray reads little memory. They come from packed bits, or from bricks of a sparse grid, whose table
// has a part for each 64^3 voxels that has any, and no distances. Internal to the preview.

#include "model/volume.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelize {

using vec3 = std::array<double, 3>;

[[nodiscard]] constexpr vec3 operator+(const vec3& a, const vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
[[nodiscard]] constexpr vec3 operator-(const vec3& a, const vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
[[nodiscard]] constexpr vec3 operator*(const vec3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
[[nodiscard]] constexpr double dot(const vec3& a, const vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Bricks of 8^3 voxels, none empty, by ascending Morton key of their position (bits of x, y and z in turn, x lowest).
// Eight words of bits each, in Morton order too. offsets[i] is the number of occupied voxels in the bricks before.
struct preview_bricks {
    const std::uint64_t* keys = nullptr;
    const std::uint64_t* masks = nullptr;
    const std::uint64_t* offsets = nullptr;
    std::size_t count = 0;
};

// The first occupied voxel that a ray meets, on the side of `axis`, low or high.
struct ray_hit {
    double distance = 0; // along the ray, in lengths of its direction
    std::array<std::int32_t, 3> voxel{};
    int axis = -1; // -1: nothing hit
    bool high = false;
};

class preview_scene {
public:
    // `v` must outlive the scene and have an occupancy channel. Reads the bits once, on `threads` threads (>= 1).
    preview_scene(const volume& v, int threads);
    // The same voxels as bricks, which must outlive the scene too; of `v` the extent counts alone.
    preview_scene(const volume& v, const preview_bricks& bricks);

    [[nodiscard]] bool is_sparse() const { return is_sparse_; }
    // The number of an occupied voxel among those of the bricks.
    [[nodiscard]] std::uint64_t rank_of(const std::array<std::int32_t, 3>& voxel) const;

    [[nodiscard]] bool empty() const { return high_[0] <= low_[0]; }
    // Bounds of the occupied voxels, in voxels: [low, high).
    [[nodiscard]] const std::array<std::int32_t, 3>& low() const { return low_; }
    [[nodiscard]] const std::array<std::int32_t, 3>& high() const { return high_; }

    // First occupied voxel along origin + t * direction for 0 <= t <= limit. Origin and direction in voxel units of the
    // grid. A ray that starts inside an occupied voxel reports it at t = 0 on the axis of its largest component.
    [[nodiscard]] ray_hit first_hit(const vec3& origin, const vec3& direction, double limit) const;

    // Outward normal of the surface around an occupied voxel, not normalised and never zero for a voxel that is seen
    // from `viewer` (a direction, any length): the sum of the exposed faces that look towards the viewer, over the
    // voxels at most three steps away. This is the area vector of that piece of surface, so it is right for thin shells
    // and solids alike.
    [[nodiscard]] vec3 surface_normal(const std::array<std::int32_t, 3>& voxel, const vec3& viewer,
                                      const vec3& voxel_size) const;

    // Calls visit(low corner, high corner) in voxels for the stretch of each row along x that its first and last
    // occupied voxel bound; together these boxes have the convex hull of all occupied voxels.
    template <class Visit>
    void for_each_row(Visit visit) const {
        if (is_sparse_) {
            for_each_row_of_bricks(visit);
            return;
        }
        for (std::int32_t k = low_[2]; k < high_[2]; ++k)
            for (std::int32_t j = low_[1]; j < high_[1]; ++j) {
                const auto [first, last] = row_ends(j, k);
                if (first > last) continue;
                visit(vec3{static_cast<double>(first), static_cast<double>(j), static_cast<double>(k)},
                      vec3{last + 1.0, j + 1.0, k + 1.0});
            }
    }

private:
    // Voxels along an axis: indices and their multiples of 64 stay in 32 bits.
    static constexpr std::int64_t max_extent = std::int64_t{1} << 30;

    using int3 = std::array<std::int32_t, 3>;

    static std::size_t flag_index(const int3& size, std::int32_t i, std::int32_t j, std::int32_t k) {
        return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
                   static_cast<std::size_t>(size[0]) +
               static_cast<std::size_t>(i);
    }
    // Layer by layer of bricks: the ends of the layer's rows are known once its bricks are through.
    template <class Visit>
    void for_each_row_of_bricks(const Visit& visit) const {
        const auto rows = std::size_t{8} * 8 * static_cast<std::size_t>((extent_[1] + 7) / 8); // y * 8 + z % 8
        std::vector<std::int32_t> first(rows), last(rows);
        for (std::size_t i = 0; i < by_layer_.size();) {
            const std::int32_t layer = brick_position(by_layer_[i])[2];
            std::fill(first.begin(), first.end(), extent_[0]);
            std::fill(last.begin(), last.end(), -1);
            for (; i < by_layer_.size() && brick_position(by_layer_[i])[2] == layer; ++i)
                add_row_ends(by_layer_[i], first, last);
            for (std::size_t row = 0; row < rows; ++row) {
                if (last[row] < 0) continue;
                const std::size_t y = row / 8, z = row % 8;
                const auto j = static_cast<double>(y), k = 8.0 * layer + static_cast<double>(z);
                visit(vec3{static_cast<double>(first[row]), j, k}, vec3{last[row] + 1.0, j + 1.0, k + 1.0});
            }
        }
    }
    void add_row_ends(std::uint32_t brick, std::vector<std::int32_t>& first, std::vector<std::int32_t>& last) const;
    [[nodiscard]] int3 brick_position(std::uint32_t brick) const;
    // The number in bricks_ of a voxel's brick, of a sparse grid; far_off: no brick lies within 64^3 voxels.
    [[nodiscard]] std::uint32_t number_of(const int3& cell, bool& far_off) const {
        const std::uint32_t node = nodes_[flag_index(coarse_size_, cell[0] >> 6, cell[1] >> 6, cell[2] >> 6)];
        far_off = node == 0;
        if (far_off) return empty_brick;
        const std::int32_t at = ((cell[2] >> 3 & 7) * 8 + (cell[1] >> 3 & 7)) * 8 + (cell[0] >> 3 & 7);
        return tables_[std::size_t{node - 1} * 512 + static_cast<std::size_t>(at)];
    }
    // The brick of a voxel, or null and the voxels [from, end) around it that are empty too.
    template <bool Sparse>
    [[nodiscard]] const std::array<std::uint64_t, 8>* brick_at(const int3& cell, int3& from, int3& end) const;
    template <bool Sparse>
    [[nodiscard]] ray_hit walk(const vec3& origin, const vec3& direction, double limit) const;
    void measure_distances(int threads);

    // First and last occupied voxel of a row; first > last for an empty row.
    [[nodiscard]] std::array<std::int32_t, 2> row_ends(std::int32_t j, std::int32_t k) const;
    [[nodiscard]] std::uint32_t window(std::int32_t i, std::int32_t j, std::int32_t k) const;
    void look_at_layer(const volume& v, const channel& bits, std::int32_t layer, int3& low, int3& high);
    void fill_layer(std::int32_t layer);

    const std::byte* bits_ = nullptr;
    std::int64_t row_bytes_ = 0;
    std::int64_t slice_bytes_ = 0;
    int3 extent_{};
    int3 fine_size_{};
    int3 coarse_size_{};
    // Bit i of byte j of word k is voxel (i, j, k) of the brick.
    using brick = std::array<std::uint64_t, 8>;
    static constexpr std::uint32_t empty_brick = 0, full_brick = 1;
    // For each 8^3 voxels the number of its brick, or no_brick plus the distance to the next brick: the greatest of the
    // differences along the axes, in bricks, at most max_distance.
    std::vector<std::uint32_t> fine_;
    static constexpr std::uint32_t no_brick = std::uint32_t{1} << 31;
    static constexpr std::uint32_t max_distance = 15;
    std::vector<brick> bricks_; // all empty ones are one, all full ones too
    // A sparse grid has these in place of that table; brick i of the grid is bricks_[i + first_brick].
    static constexpr std::uint32_t first_brick = full_brick + 1;
    bool is_sparse_ = false;
    preview_bricks sparse_;
    std::vector<std::uint32_t> nodes_;    // for each 64^3 voxels the number of its table plus one, or 0
    std::vector<std::uint32_t> tables_;   // 512 each, x fastest: numbers of bricks
    std::vector<std::uint32_t> by_layer_; // the grid's bricks, by their z
    int3 low_{};
    int3 high_{};
};

} // namespace voxelize
