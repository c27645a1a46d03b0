// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "voxel_shape.hpp"

#include "write/preview.hpp"

#include <algorithm>

namespace voxelize {
namespace {

constexpr std::uint32_t packed(const rgb8& c) {
    return static_cast<std::uint32_t>(c[0]) | static_cast<std::uint32_t>(c[1]) << 8 |
           static_cast<std::uint32_t>(c[2]) << 16;
}

// The numbers of materials, or null.
const channel* materials_of(const channel* found) {
    return found != nullptr && found->type == scalar::i32 && found->components == 1 ? found : nullptr;
}

} // namespace

voxel_shape::voxel_shape(const volume& v, int threads) : voxel_shape(v, v, threads) {}

voxel_shape::voxel_shape(const volume& v, const volume& occupied, int threads)
    : extent(v.extent), origin(v.origin), voxel_size(v.voxel_size), own_(find_bricks(occupied, threads)),
      bricks_(&own_), channels_(v.channels), colors_(find_colors(v)), materials_(materials_of(v.find("material"))),
      by_rank_(false), clay_rgb_(packed(clay)) {}

voxel_shape::voxel_shape(const sparse_volume& v)
    : extent(v.shape.extent), origin(v.shape.origin), voxel_size(v.shape.voxel_size), bricks_(&v),
      channels_(v.channels), colors_(find_colors(v.channels)), materials_(materials_of(v.find("material"))),
      by_rank_(true), clay_rgb_(packed(clay)) {}

brick_order::brick_order(const voxel_shape& shape, int axis, std::size_t first, std::size_t last)
    : shape_(shape), axis_(axis) {
    bricks_.reserve(last - first);
    for (std::size_t b = first; b < last; ++b) {
        const glm::ivec3 at = voxelpipe::core::morton_position(shape.key(b));
        const auto along = [&](int a) { return static_cast<std::uint64_t>(at[a % 3]); };
        bricks_.push_back({along(axis) << 42 | along(axis + 2) << 21 | along(axis + 1), b});
    }
    std::sort(bricks_.begin(), bricks_.end(), [](const placed& a, const placed& b) { return a.place < b.place; });
    for (std::size_t n = 0; n < bricks_.size(); ++n)
        if (n == 0 || bricks_[n].at() != bricks_[n - 1].at()) begin_.push_back(n);
    begin_.push_back(bricks_.size());
}

std::span<const brick_order::placed> brick_order::layer_at(int at) const {
    const auto begin = std::lower_bound(bricks_.begin(), bricks_.end(), at,
                                        [](const placed& p, int wanted) { return p.at() < wanted; });
    const auto end =
        std::upper_bound(begin, bricks_.end(), at, [](int wanted, const placed& p) { return wanted < p.at(); });
    return {begin, end};
}

std::span<const brick_order::placed> brick_order::row_of(std::span<const placed> layer, int row) {
    const auto begin =
        std::lower_bound(layer.begin(), layer.end(), row, [](const placed& p, int wanted) { return p.row() < wanted; });
    const auto end =
        std::upper_bound(begin, layer.end(), row, [](int wanted, const placed& p) { return wanted < p.row(); });
    return {begin, end};
}

} // namespace voxelize
