// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Set up triangles in a warp's shared memory, for masks (sparse/device/mask_pass.cuh): 32 small ones, or one large one,
// which give bricks the same functions (core/mask_triangle.hpp), and the pairs of a triangle and a brick that wait.

#include <voxelpipe/core/mask_triangle.hpp>
#include <voxelpipe/device/raster/split_setup.cuh>

#include <cstdint>

namespace voxelpipe::device {

inline constexpr int log2_mask_brick = 3;
static_assert(1 << log2_mask_brick == core::mask_brick_size);

// Setups of a warp's small triangles, a column of words each: no two lanes' words are in one bank.
struct mask_columns {
    static constexpr int half_planes = 0, normal = 27, below = 33, above = 35, lowest = 37, part = 40, count = 41;
    word words[count][32];
};
// One of them, as mask_triangle. Half-planes within its box and a brick beyond it fit 32 bits.
struct mask_column {
    mask_columns& all;
    unsigned slot;

    // part: of the box within the grid, not empty.
    __device__ VOXELPIPE_INLINE void set(const int32_triangle& r, const core::small_box& part, int fraction) const {
        const core::small_triangle t = r.relative(fraction);
        const int row = core::row_axis(core::small_normal(t));
        core::small_triangle turned;
        for (int v = 0; v < 3; ++v) {
            const core::triple<std::int32_t> p = core::turn_to_row(row, t.p[v][0], t.p[v][1], t.p[v][2]);
            for (int k = 0; k < 3; ++k) turned.p[v][k] = p[k];
        }
        const core::small_conservative s(turned, fraction);
        for (int i = 0; i < 3; ++i) {
            set_half(i, s.xy[i]);
            set_half(3 + i, s.yz[i]);
            set_half(6 + i, s.zx[i]);
            set_long(mask_columns::normal + 2 * i, s.n[i]);
            all.words[mask_columns::lowest + i][slot] = static_cast<word>(r.lo[i]);
        }
        set_long(mask_columns::below, s.below);
        set_long(mask_columns::above, s.above);
        word packed = static_cast<word>(row) << 30; // sides are at most 32
        for (int i = 0; i < 3; ++i)
            packed |= static_cast<word>(part.lo[i]) << (10 * i) | static_cast<word>(part.hi[i]) << (10 * i + 5);
        all.words[mask_columns::part][slot] = packed;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE core::small_half_plane half(int k, int u, int v) const {
        const auto a = static_cast<std::int32_t>(all.words[3 * k][slot]),
                   b = static_cast<std::int32_t>(all.words[3 * k + 1][slot]),
                   c = static_cast<std::int32_t>(all.words[3 * k + 2][slot]);
        return {a, b, a * u + b * v + c};
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::int64_t normal(int i) const {
        return get_long(mask_columns::normal + 2 * i);
    }
    __device__ VOXELPIPE_INLINE void plane(const core::triple<int>& o, std::int64_t& below, std::int64_t& above) const {
        const std::int64_t depth = normal(0) * o[0] + normal(1) * o[1] + normal(2) * o[2];
        below = get_long(mask_columns::below) + depth;
        above = get_long(mask_columns::above) - depth;
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int row() const {
        return static_cast<int>(all.words[mask_columns::part][slot] >> 30);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int lowest(int i) const {
        return static_cast<int>(all.words[mask_columns::lowest + i][slot]);
    }
    // The first and the last voxel of the box within the grid.
    [[nodiscard]] __device__ VOXELPIPE_INLINE int first(int i) const {
        return lowest(i) + static_cast<int>(all.words[mask_columns::part][slot] >> (10 * i) & 31u);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int last(int i) const {
        return lowest(i) + static_cast<int>(all.words[mask_columns::part][slot] >> (10 * i + 5) & 31u);
    }

private:
    __device__ VOXELPIPE_INLINE void set_half(int k, const core::small_half_plane& h) const {
        all.words[3 * k][slot] = static_cast<word>(h.a);
        all.words[3 * k + 1][slot] = static_cast<word>(h.b);
        all.words[3 * k + 2][slot] = static_cast<word>(h.c);
    }
    __device__ VOXELPIPE_INLINE void set_long(int at, std::int64_t value) const {
        all.words[at][slot] = static_cast<word>(value);
        all.words[at + 1][slot] = static_cast<word>(static_cast<std::uint64_t>(value) >> 32);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::int64_t get_long(int at) const {
        return static_cast<std::int64_t>(all.words[at][slot] | std::uint64_t{all.words[at + 1][slot]} << 32);
    }
};

// A large triangle, by which all lanes draw.
struct large_mask_triangle {
    core::mask_triangle t;
    core::triple<int> low, begin, end; // the lowest voxel of its box; first and last of its part within the grid
    unsigned long long first_work_item;
    split_pieces<coverage::conservative> pieces;
    std::uint32_t triangle;
    bool fits; // otherwise t is not set

    template <class Call>
    __device__ VOXELPIPE_INLINE void find(const Call& call, std::uint32_t number) {
        first_work_item = call.lists.first_work_items[number];
        triangle = call.lists.split[number];
        const located_triangle<Call> found(call, triangle);
        pieces = found.pieces(call.in.fraction);
        fits = core::mask_triangle::fits(found.a, found.b, found.c);
        if (!fits) return;
        const core::voxel_box box = core::bounds(found.a, found.b, found.c, call.in.fraction);
        t = core::mask_triangle(found.a, found.b, found.c, box.lo, call.in.fraction);
        for (int k = 0; k < 3; ++k) {
            low[k] = static_cast<int>(box.lo[k]);
            begin[k] = static_cast<int>(found.reach.lo[k]);
            end[k] = static_cast<int>(found.reach.hi[k]);
        }
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE core::small_half_plane half(int k, int u, int v) const {
        return t.half(k, u, v);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::int64_t normal(int i) const { return t.normal(i); }
    __device__ VOXELPIPE_INLINE void plane(const core::triple<int>& o, std::int64_t& below, std::int64_t& above) const {
        t.plane(o, below, above);
    }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int row() const { return t.row; }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int lowest(int i) const { return low[i]; }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int first(int i) const { return begin[i]; }
    [[nodiscard]] __device__ VOXELPIPE_INLINE int last(int i) const { return end[i]; }
};

// A brick of the raster, and the slot of a triangle that meets it.
struct mask_pair {
    std::uint16_t x, y, z, slot;
};

// Shared memory of a warp.
struct mask_memory {
    static constexpr int max_pairs = 64, rows_each = 16, max_large = 12;
    union {
        mask_columns small;
        large_mask_triangle large[max_large];
    };
    mask_pair pairs[max_pairs];
    // Set-ups of the lanes' pairs, while they are drawn: near_plane; mask_rows::by_across, by_deep and met; the axis of
    // the rows; the brick's number.
    float planes[6][32];
    word limits[4][32], met[2][32], axes[32], bricks[32];
    std::uint16_t rows[32 * rows_each]; // that are to be drawn: across + 8 deep, 64 pair
    word bits[32][17];                  // of the pairs' bricks; one more, for other banks
};

} // namespace voxelpipe::device
