// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The part of preview_scene that reads the bricks of a sparse grid.

#include "preview_scene.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <stdexcept>

namespace voxelize {

namespace {

// Every third bit of a Morton key, from bit `axis` on.
std::int32_t coordinate_of(std::uint64_t key, int axis) {
    std::uint32_t n = 0;
    key >>= axis;
    for (unsigned bit = 0; key != 0; ++bit, key >>= 3) n |= static_cast<std::uint32_t>(key & 1u) << bit;
    return static_cast<std::int32_t>(n);
}

// The Morton number of a voxel within its brick.
unsigned bit_of(std::int32_t x, std::int32_t y, std::int32_t z) {
    constexpr std::array<unsigned, 8> spread{0, 1, 8, 9, 64, 65, 72, 73};
    return spread[static_cast<std::size_t>(x & 7)] | spread[static_cast<std::size_t>(y & 7)] << 1 |
           spread[static_cast<std::size_t>(z & 7)] << 2;
}

} // namespace

preview_scene::preview_scene(const volume& v, const preview_bricks& bricks) : is_sparse_(true), sparse_(bricks) {
    std::size_t num_nodes = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        if (v.extent[a] > max_extent)
            throw std::invalid_argument("the preview draws at most 2^30 voxels along an axis");
        extent_[a] = static_cast<std::int32_t>(v.extent[a]);
        coarse_size_[a] = (extent_[a] + 63) / 64;
        num_nodes *= static_cast<std::size_t>(coarse_size_[a]);
    }
    if (bricks.count >= UINT32_MAX - first_brick)
        throw std::invalid_argument("the preview draws fewer than 2^32 - 3 bricks");
    nodes_.resize(num_nodes);
    bricks_.resize(bricks.count + first_brick);
    low_ = extent_;
    std::vector<std::size_t> layers(static_cast<std::size_t>((extent_[2] + 7) / 8) + 1);
    for (std::uint32_t b = 0; b < bricks.count; ++b) {
        const int3 at = brick_position(b);
        std::uint32_t& node = nodes_[flag_index(coarse_size_, at[0] / 8, at[1] / 8, at[2] / 8)];
        if (node == 0) {
            tables_.resize(tables_.size() + 512, empty_brick);
            node = static_cast<std::uint32_t>(tables_.size() / 512);
        }
        tables_[std::size_t{node - 1} * 512 + static_cast<std::size_t>((at[2] % 8 * 8 + at[1] % 8) * 8 + at[0] % 8)] =
            b + first_brick;
        ++layers[static_cast<std::size_t>(at[2]) + 1];
        const std::uint64_t* const words = bricks.masks + std::size_t{b} * 8;
        brick& rows = bricks_[b + first_brick];
        for (std::int32_t z = 0; z < 8; ++z)
            for (std::int32_t y = 0; y < 8; ++y)
                for (std::int32_t x = 0; x < 8; ++x) {
                    const unsigned bit = bit_of(x, y, z);
                    if ((words[bit / 64] >> bit % 64 & 1u) == 0) continue;
                    rows[static_cast<std::size_t>(z)] |= std::uint64_t{1} << (8 * y + x);
                    const int3 voxel{8 * at[0] + x, 8 * at[1] + y, 8 * at[2] + z};
                    for (std::size_t a = 0; a < 3; ++a) {
                        low_[a] = std::min(low_[a], voxel[a]);
                        high_[a] = std::max(high_[a], voxel[a] + 1);
                    }
                }
    }
    for (std::size_t z = 1; z < layers.size(); ++z) layers[z] += layers[z - 1];
    by_layer_.resize(bricks.count);
    for (std::uint32_t b = 0; b < bricks.count; ++b)
        by_layer_[layers[static_cast<std::size_t>(brick_position(b)[2])]++] = b;
}

preview_scene::int3 preview_scene::brick_position(std::uint32_t brick) const {
    const std::uint64_t key = sparse_.keys[brick];
    return {coordinate_of(key, 0), coordinate_of(key, 1), coordinate_of(key, 2)};
}

void preview_scene::add_row_ends(std::uint32_t brick, std::vector<std::int32_t>& first,
                                 std::vector<std::int32_t>& last) const {
    const int3 at = brick_position(brick);
    for (std::int32_t z = 0; z < 8; ++z)
        for (std::int32_t y = 0; y < 8; ++y) {
            const auto row = static_cast<std::uint32_t>(
                bricks_[brick + first_brick][static_cast<std::size_t>(z)] >> (8 * y) & 0xffu);
            if (row == 0) continue;
            const std::size_t n = static_cast<std::size_t>(8 * at[1] + y) * 8 + static_cast<std::size_t>(z);
            first[n] = std::min(first[n], 8 * at[0] + std::countr_zero(row));
            last[n] = std::max(last[n], 8 * at[0] + 31 - std::countl_zero(row));
        }
}

std::uint64_t preview_scene::rank_of(const int3& voxel) const {
    bool far_off;
    const std::uint32_t brick = number_of(voxel, far_off) - first_brick;
    const unsigned bit = bit_of(voxel[0], voxel[1], voxel[2]);
    const std::uint64_t* const words = sparse_.masks + std::size_t{brick} * 8;
    std::uint64_t rank = sparse_.offsets[brick];
    for (unsigned w = 0; w < bit / 64; ++w) rank += static_cast<std::uint64_t>(std::popcount(words[w]));
    return rank + static_cast<std::uint64_t>(std::popcount(words[bit / 64] & ((std::uint64_t{1} << bit % 64) - 1)));
}

} // namespace voxelize
