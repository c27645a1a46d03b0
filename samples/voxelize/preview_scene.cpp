// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "preview_scene.hpp"

#include "parallel.hpp"

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
    constexpr std::int64_t most = std::int64_t{1} << 30; // indices and their multiples of 64 stay in 32 bits
    std::size_t num_fine = 1, num_coarse = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        if (v.extent[a] > most) throw std::invalid_argument("the preview draws at most 2^30 voxels along an axis");
        extent_[a] = static_cast<std::int32_t>(v.extent[a]);
        fine_size_[a] = (extent_[a] + 7) / 8;
        coarse_size_[a] = (extent_[a] + 63) / 64;
        num_fine *= static_cast<std::size_t>(fine_size_[a]);
        num_coarse *= static_cast<std::size_t>(coarse_size_[a]);
    }
    fine_.resize(num_fine);
    coarse_.resize(num_coarse);

    low_ = extent_;
    std::mutex merging;
    parallel_for(static_cast<std::size_t>(fine_size_[2]), threads, [&](std::size_t layer) {
        int3 low = extent_, high{};
        fill_layer(v, bits, static_cast<std::int32_t>(layer), low, high);
        const std::lock_guard lock(merging);
        for (std::size_t a = 0; a < 3; ++a) {
            low_[a] = std::min(low_[a], low[a]);
            high_[a] = std::max(high_[a], high[a]);
        }
    });
    for (std::int32_t k = 0; k < fine_size_[2]; ++k)
        for (std::int32_t j = 0; j < fine_size_[1]; ++j)
            for (std::int32_t i = 0; i < fine_size_[0]; ++i)
                if (fine_[flag_index(fine_size_, i, j, k)] != 0)
                    coarse_[flag_index(coarse_size_, i / 8, j / 8, k / 8)] = 1;
}

// Flags of one layer of bricks, and the bounds of its voxels.
void preview_scene::fill_layer(const volume& v, const channel& bits, std::int32_t layer, int3& low, int3& high) {
    const std::int32_t k_end = std::min(layer * 8 + 8, extent_[2]);
    for (std::int32_t k = layer * 8; k < k_end; ++k)
        for (std::int32_t j = 0; j < extent_[1]; ++j)
            for (std::int32_t w = 0; 32 * w < extent_[0]; ++w) {
                const std::uint32_t word = v.word(bits, w, j, k);
                if (word == 0) continue;
                for (std::int32_t b = 0; b < 4; ++b)
                    if ((word >> (8 * b) & 0xffu) != 0) fine_[flag_index(fine_size_, 4 * w + b, j / 8, layer)] = 1;
                const int3 first{32 * w + std::countr_zero(word), j, k};
                const int3 last{32 * w + 31 - std::countl_zero(word), j, k};
                for (std::size_t a = 0; a < 3; ++a) {
                    low[a] = std::min(low[a], first[a]);
                    high[a] = std::max(high[a], last[a] + 1);
                }
            }
}

ray_hit preview_scene::first_hit(const vec3& origin, const vec3& direction, double limit) const {
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

    // Leaves the cube of side 2^level around the cell through the side that comes first. Each t is computed from the
    // side itself, so no error adds up, and the cell always advances along one axis, so the walk ends.
    int3 side{};
    vec3 next{};
    const auto aim = [&](std::size_t a, int level) {
        side[a] = ((cell[a] >> level) + ahead[a]) << level;
        next[a] = (side[a] - origin[a]) * inverse[a];
    };
    const auto advance = [&] {
        axis = next[1] < next[0] ? 1 : 0;
        axis = next[2] < next[axis] ? 2 : axis;
        t = std::max(t, next[axis]);
        return next[axis] < t_end; // equal: the side is one of the bounds
    };
    while (true) {
        const bool far_off = coarse_[flag_index(coarse_size_, cell[0] >> 6, cell[1] >> 6, cell[2] >> 6)] == 0;
        if (far_off || fine_[flag_index(fine_size_, cell[0] >> 3, cell[1] >> 3, cell[2] >> 3)] == 0) {
            const int level = far_off ? 6 : 3;
            for (std::size_t a = 0; a < 3; ++a) aim(a, level);
            if (!advance()) return {};
            for (std::size_t a = 0; a < 3; ++a) {
                const std::int32_t from = cell[a] >> level << level;
                cell[a] = cell_at(a, from, std::min(from + (1 << level), extent_[a]) - 1);
            }
            cell[axis] = side[axis] + ahead[axis] - 1;
        } else { // voxel by voxel to the end of the brick; only the axis that was crossed changes
            for (std::size_t a = 0; a < 3; ++a) aim(a, 0);
            std::int32_t crossed;
            do {
                const std::byte* row = bits_ + cell[2] * slice_bytes_ + cell[1] * row_bytes_;
                if ((std::to_integer<unsigned>(row[cell[0] >> 3]) >> (cell[0] & 7) & 1u) != 0)
                    return {t, cell, static_cast<int>(axis), direction[axis] < 0};
                if (!advance()) return {};
                crossed = cell[axis];
                cell[axis] = side[axis] + ahead[axis] - 1;
                aim(axis, 0);
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
            faces[0] += std::popcount(here & ~beside);
            faces[1] += std::popcount(here & ~row(step_y, 0));
            faces[2] += std::popcount(here & ~row(0, step_z));
        }
    vec3 normal{};
    for (std::size_t a = 0; a < 3; ++a) {
        const double area = voxel_size[(a + 1) % 3] * voxel_size[(a + 2) % 3];
        normal[a] = (viewer[a] > 0 ? 1 : -1) * faces[a] * area;
    }
    return normal;
}

} // namespace voxelize
