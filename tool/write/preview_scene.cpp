// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "preview_scene.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <mutex>

namespace voxelize {

preview_scene::preview_scene(const volume& v, int threads) {
    const channel& bits = *v.occupancy();
    bits_ = bits.data.data();
    row_bytes_ = v.words_per_row() * 4;
    slice_bytes_ = row_bytes_ * v.extent[1];
    std::size_t num_fine = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        if (v.extent[a] > max_extent)
            throw std::invalid_argument("the preview draws at most 2^30 voxels along an axis");
        extent_[a] = static_cast<std::int32_t>(v.extent[a]);
        fine_size_[a] = (extent_[a] + 7) / 8;
        num_fine *= static_cast<std::size_t>(fine_size_[a]);
    }
    fine_.resize(num_fine);

    low_ = extent_;
    std::mutex merging;
    parallel_for(static_cast<std::size_t>(fine_size_[2]), threads, [&](std::size_t layer) {
        int3 low = extent_, high{};
        look_at_layer(v, bits, static_cast<std::int32_t>(layer), low, high);
        const std::lock_guard lock(merging);
        for (std::size_t a = 0; a < 3; ++a) {
            low_[a] = std::min(low_[a], low[a]);
            high_[a] = std::max(high_[a], high[a]);
        }
    });
    std::uint32_t num_bricks = full_brick + 1;
    for (std::int32_t k = 0; k < fine_size_[2]; ++k)
        for (std::int32_t j = 0; j < fine_size_[1]; ++j)
            for (std::int32_t i = 0; i < fine_size_[0]; ++i) {
                std::uint32_t& number = fine_[flag_index(fine_size_, i, j, k)];
                if (number == empty_brick) continue;
                if (number != full_brick) number = num_bricks++;
            }
    bricks_.resize(num_bricks);
    bricks_[full_brick].fill(~std::uint64_t{0});
    parallel_for(static_cast<std::size_t>(fine_size_[2]), threads,
                 [&](std::size_t layer) { fill_layer(static_cast<std::int32_t>(layer)); });
    measure_distances(threads);
}

// Along one axis after the other: the distance in a plane is the least, over the cells of a line, of the greater of the
// step along the line and the distance found so far.
void preview_scene::measure_distances(int threads) {
    constexpr auto most = static_cast<std::uint8_t>(max_distance);
    std::vector<std::uint8_t> before(fine_.size()), after(fine_.size());
    for (std::size_t i = 0; i < fine_.size(); ++i) before[i] = fine_[i] == empty_brick ? most : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::ptrdiff_t stride = axis == 0   ? 1
                                      : axis == 1 ? fine_size_[0]
                                                  : std::ptrdiff_t{fine_size_[0]} * fine_size_[1];
        const std::int32_t length = fine_size_[axis];
        parallel_for(static_cast<std::size_t>(fine_size_[2]), threads, [&](std::size_t layer) {
            int3 at{0, 0, static_cast<std::int32_t>(layer)};
            std::size_t i = flag_index(fine_size_, 0, 0, at[2]);
            for (at[1] = 0; at[1] < fine_size_[1]; ++at[1])
                for (at[0] = 0; at[0] < fine_size_[0]; ++at[0], ++i) {
                    const std::uint8_t* const here = before.data() + i;
                    std::uint8_t least = *here;
                    for (std::uint8_t step = 1; step < least; ++step) {
                        if (at[axis] >= step) least = std::min(least, std::max(step, here[-step * stride]));
                        if (at[axis] + step < length) least = std::min(least, std::max(step, here[step * stride]));
                    }
                    after[i] = least;
                }
        });
        before.swap(after);
    }
    for (std::size_t i = 0; i < fine_.size(); ++i)
        if (before[i] != 0) fine_[i] = no_brick + before[i];
}

// Marks the bricks of a layer as empty, full or neither (any other number), and finds the bounds of its voxels.
void preview_scene::look_at_layer(const volume& v, const channel& bits, std::int32_t layer, int3& low, int3& high) {
    const auto words = static_cast<std::size_t>(v.words_per_row());
    const std::int32_t k_end = std::min(layer * 8 + 8, extent_[2]);
    std::vector<std::uint32_t> any(words), all(words); // of the rows that go through the same bricks
    for (std::int32_t j0 = 0; j0 < extent_[1]; j0 += 8) {
        const std::int32_t j_end = std::min(j0 + 8, extent_[1]);
        const bool whole = k_end - layer * 8 == 8 && j_end - j0 == 8;
        std::fill(any.begin(), any.end(), 0u);
        std::fill(all.begin(), all.end(), whole ? ~0u : 0u);
        for (std::int32_t k = layer * 8; k < k_end; ++k)
            for (std::int32_t j = j0; j < j_end; ++j) {
                std::uint32_t row = 0;
                for (std::size_t w = 0; w < words; ++w) {
                    const std::uint32_t word = v.word(bits, static_cast<std::int64_t>(w), j, k);
                    row |= word;
                    any[w] |= word;
                    all[w] &= word;
                }
                if (row == 0) continue;
                low[1] = std::min(low[1], j);
                low[2] = std::min(low[2], k);
                high[1] = std::max(high[1], j + 1);
                high[2] = std::max(high[2], k + 1);
            }
        for (std::int32_t i = 0; i < fine_size_[0]; ++i) {
            const auto w = static_cast<std::size_t>(i / 4);
            const unsigned some = any[w] >> (8 * (i % 4)) & 0xffu, each = all[w] >> (8 * (i % 4)) & 0xffu;
            if (some == 0) continue;
            fine_[flag_index(fine_size_, i, j0 / 8, layer)] = each == 0xffu ? full_brick : full_brick + 1;
            low[0] = std::min(low[0], 8 * i + std::countr_zero(some));
            high[0] = std::max(high[0], 8 * i + static_cast<std::int32_t>(std::bit_width(some)));
        }
    }
}

// The bricks of a layer that have a number of their own.
void preview_scene::fill_layer(std::int32_t layer) {
    const std::int32_t k_end = std::min(layer * 8 + 8, extent_[2]);
    for (std::int32_t j0 = 0; j0 < extent_[1]; j0 += 8)
        for (std::int32_t i = 0; i < fine_size_[0]; ++i) {
            const std::uint32_t number = fine_[flag_index(fine_size_, i, j0 / 8, layer)];
            if (number <= full_brick) continue;
            for (std::int32_t k = layer * 8; k < k_end; ++k) {
                std::uint64_t word = 0;
                for (std::int32_t j = j0; j < std::min(j0 + 8, extent_[1]); ++j)
                    word |= std::to_integer<std::uint64_t>(bits_[k * slice_bytes_ + j * row_bytes_ + i])
                            << (8 * (j - j0));
                bricks_[number][static_cast<std::size_t>(k - layer * 8)] = word;
            }
        }
}

template <bool Sparse>
const std::array<std::uint64_t, 8>* preview_scene::brick_at(const int3& cell, int3& from, int3& end) const {
    if constexpr (Sparse) {
        bool far_off;
        const std::uint32_t number = number_of(cell, far_off);
        if (number != empty_brick) return &bricks_[number];
        const int level = far_off ? 6 : 3;
        for (std::size_t a = 0; a < 3; ++a) {
            from[a] = cell[a] >> level << level;
            end[a] = from[a] + (1 << level);
        }
    } else {
        const std::uint32_t number = fine_[flag_index(fine_size_, cell[0] >> 3, cell[1] >> 3, cell[2] >> 3)];
        if (number < no_brick) return &bricks_[number];
        const auto distance = static_cast<std::int32_t>(number - no_brick);
        for (std::size_t a = 0; a < 3; ++a) {
            from[a] = std::max(((cell[a] >> 3) + 1 - distance) << 3, 0);
            end[a] = ((cell[a] >> 3) + distance) << 3;
        }
    }
    return nullptr;
}

ray_hit preview_scene::first_hit(const vec3& origin, const vec3& direction, double limit) const {
    return is_sparse_ ? walk<true>(origin, direction, limit) : walk<false>(origin, direction, limit);
}

template <bool Sparse>
ray_hit preview_scene::walk(const vec3& origin, const vec3& direction, double limit) const {
    // Enter the bounds: the cell on the way in lies behind the side that is met last. An axis along which the ray does
    // not move gets an inverse so large that its sides never come next.
    double t = 0;
    double t_end = limit;
    std::size_t axis = 0;
    vec3 inverse{};
    int3 ahead{}; // 1 where the next side is the high one
    for (std::size_t a = 0; a < 3; ++a) {
        if (direction[a] == 0) {
            if (origin[a] < low_[a] || origin[a] >= high_[a]) return {};
            inverse[a] = 1e300;
            ahead[a] = 1;
            continue;
        }
        inverse[a] = 1 / direction[a];
        ahead[a] = direction[a] > 0 ? 1 : 0;
        const double near = ((ahead[a] != 0 ? low_[a] : high_[a]) - origin[a]) * inverse[a];
        const double far = ((ahead[a] != 0 ? high_[a] : low_[a]) - origin[a]) * inverse[a];
        if (near > t) {
            t = near;
            axis = a;
        }
        t_end = std::min(t_end, far);
    }
    if (!(t <= t_end)) return {};
    if (t == 0)
        for (std::size_t a = 1; a < 3; ++a)
            if (std::abs(direction[a]) > std::abs(direction[axis])) axis = a;
    // Inside the bounds no coordinate is below zero, so the conversion to an integer is the floor.
    const auto cell_at = [&](std::size_t a, std::int32_t from, std::int32_t last) {
        return std::clamp(static_cast<std::int32_t>(origin[a] + t * direction[a]), from, last);
    };
    int3 cell{};
    for (std::size_t a = 0; a < 3; ++a) cell[a] = cell_at(a, low_[a], high_[a] - 1);

    // Leaves a box around the cell through the side that comes first. Each t is computed from the side itself, so no
    // error adds up, and the cell always advances along one axis, so the walk ends.
    int3 side{};
    vec3 next{};
    const auto aim = [&](std::size_t a, std::int32_t at) {
        side[a] = at;
        next[a] = (at - origin[a]) * inverse[a];
    };
    const auto advance = [&] {
        axis = next[1] < next[0] ? 1 : 0;
        axis = next[2] < next[axis] ? 2 : axis;
        t = std::max(t, next[axis]);
        return next[axis] < t_end; // equal: the side is one of the bounds
    };
    while (true) {
        int3 from{}, end{};
        const brick* const voxels = brick_at<Sparse>(cell, from, end);
        if (voxels == nullptr) {
            for (std::size_t a = 0; a < 3; ++a) aim(a, ahead[a] != 0 ? end[a] : from[a]);
            if (!advance()) return {};
            for (std::size_t a = 0; a < 3; ++a) cell[a] = cell_at(a, from[a], std::min(end[a], extent_[a]) - 1);
            cell[axis] = side[axis] + ahead[axis] - 1;
        } else { // voxel by voxel to the end of the brick; only the axis that was crossed changes
            for (std::size_t a = 0; a < 3; ++a) aim(a, cell[a] + ahead[a]);
            std::int32_t crossed;
            do {
                const std::uint64_t layer = (*voxels)[static_cast<std::size_t>(cell[2] & 7)];
                if ((layer >> (8 * (cell[1] & 7) + (cell[0] & 7)) & 1u) != 0)
                    return {t, cell, static_cast<int>(axis), direction[axis] < 0};
                if (!advance()) return {};
                crossed = cell[axis];
                cell[axis] = side[axis] + ahead[axis] - 1;
                aim(axis, cell[axis] + ahead[axis]);
            } while (crossed >> 3 == cell[axis] >> 3);
        }
    }
}

std::array<std::int32_t, 2> preview_scene::row_ends(std::int32_t j, std::int32_t k) const {
    const std::byte* row = bits_ + k * slice_bytes_ + j * row_bytes_;
    const auto word = [&](std::int32_t w) {
        std::uint32_t value;
        std::memcpy(&value, row + std::ptrdiff_t{4} * w, 4);
        return value;
    };
    const auto words = static_cast<std::int32_t>(row_bytes_ / 4);
    std::int32_t first = 0, last = words - 1;
    while (first < words && word(first) == 0) ++first;
    if (first == words) return {1, 0};
    while (word(last) == 0) --last;
    return {32 * first + std::countr_zero(word(first)), 32 * last + 31 - std::countl_zero(word(last))};
}

// Voxels (i, j, k) .. (i + 31, j, k) as bits; whatever lies outside the grid is empty.
std::uint32_t preview_scene::window(std::int32_t i, std::int32_t j, std::int32_t k) const {
    if (j < 0 || j >= extent_[1] || k < 0 || k >= extent_[2]) return 0;
    if (is_sparse_) {
        std::uint64_t bits = 0; // from the brick that i lies in
        for (std::int32_t b = 0; b < 5; ++b) {
            const std::int32_t x = ((i >> 3) + b) * 8;
            if (x < 0 || x >= extent_[0]) continue;
            bool far_off;
            const std::uint64_t layer = bricks_[number_of({x, j, k}, far_off)][static_cast<std::size_t>(k & 7)];
            bits |= (layer >> (8 * (j & 7)) & 0xffu) << (8 * b);
        }
        return static_cast<std::uint32_t>(bits >> (i & 7));
    }
    const std::byte* row = bits_ + k * slice_bytes_ + j * row_bytes_;
    const std::int64_t at = i >> 5; // floor, also for negative i
    std::array<std::uint32_t, 2> words{};
    for (std::int64_t w = 0; w < 2; ++w)
        if (at + w >= 0 && 4 * (at + w) < row_bytes_)
            std::memcpy(&words[static_cast<std::size_t>(w)], row + 4 * (at + w), 4);
    const std::uint64_t both = std::uint64_t{words[1]} << 32 | words[0];
    return static_cast<std::uint32_t>(both >> (i & 31));
}

vec3 preview_scene::surface_normal(const int3& voxel, const vec3& viewer, const vec3& voxel_size) const {
    constexpr int reach = 3, side = 2 * reach + 1, padded = side + 2;
    // Processors without an instruction for it count bits by a call.
    static constexpr auto ones = [] {
        std::array<std::uint8_t, std::size_t{1} << side> table{};
        for (std::size_t i = 1; i < table.size(); ++i) table[i] = static_cast<std::uint8_t>(table[i / 2] + i % 2);
        return table;
    }();
    constexpr std::uint32_t inner = ((1u << side) - 1) << 1; // without the one voxel of padding at either end
    std::array<std::array<std::uint32_t, padded>, padded> rows{};
    for (int z = 0; z < padded; ++z)
        for (int y = 0; y < padded; ++y)
            rows[static_cast<std::size_t>(z)][static_cast<std::size_t>(y)] =
                window(voxel[0] - reach - 1, voxel[1] - reach - 1 + y, voxel[2] - reach - 1 + z);
    const int step_y = viewer[1] > 0 ? 1 : -1, step_z = viewer[2] > 0 ? 1 : -1;
    std::array<int, 3> faces{};
    for (int z = 1; z <= side; ++z)
        for (int y = 1; y <= side; ++y) {
            const auto row = [&](int dy, int dz) {
                const auto at_y = static_cast<unsigned>(y + dy), at_z = static_cast<unsigned>(z + dz);
                return rows[at_z][at_y];
            };
            const std::uint32_t here = row(0, 0) & inner;
            if (here == 0) continue;
            const std::uint32_t beside = viewer[0] > 0 ? row(0, 0) >> 1 : row(0, 0) << 1;
            faces[0] += ones[(here & ~beside) >> 1];
            faces[1] += ones[(here & ~row(step_y, 0)) >> 1];
            faces[2] += ones[(here & ~row(0, step_z)) >> 1];
        }
    vec3 normal{};
    for (std::size_t a = 0; a < 3; ++a) {
        const double area = voxel_size[(a + 1) % 3] * voxel_size[(a + 2) % 3];
        normal[a] = (viewer[a] > 0 ? 1 : -1) * faces[a] * area;
    }
    return normal;
}

} // namespace voxelize
