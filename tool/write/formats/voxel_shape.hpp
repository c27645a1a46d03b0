// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The occupied voxels of a volume and their colours, as the writers of shapes read them (.vox, .schem, .binvox, meshes
// and points): bricks of 8^3 voxels, whether the volume is dense or sparse, so that both give the same files, in time
// and memory in proportion to the occupied bricks.

#include "model/sparse_volume.hpp"

#include <voxelpipe/sparse/host_sparse.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace voxelize {

// Refers to the volume that it was made of.
class voxel_shape {
public:
    // The volume has the occupancy, whose bricks are found first.
    voxel_shape(const volume& v, int threads);
    explicit voxel_shape(const sparse_volume& v);
    // The occupied voxels of a volume of the same grid, with the values of V.
    voxel_shape(const volume& v, const volume& occupied, int threads);
    voxel_shape(const voxel_shape&) = delete;
    voxel_shape& operator=(const voxel_shape&) = delete;
    ~voxel_shape() = default;

    std::array<std::int64_t, 3> extent;
    std::array<double, 3> origin;
    std::array<double, 3> voxel_size;

    [[nodiscard]] std::size_t num_bricks() const { return bricks_->keys.size(); }
    [[nodiscard]] std::uint64_t num_voxels() const { return bricks_->num_voxels(); }
    // Bricks in the Morton order of their places.
    [[nodiscard]] std::uint64_t key(std::size_t brick) const { return bricks_->keys[brick]; }
    [[nodiscard]] const voxelpipe::brick_mask& mask(std::size_t brick) const { return bricks_->masks[brick]; }
    // Voxels of the bricks before this one; it may be the end.
    [[nodiscard]] std::uint64_t first_rank(std::size_t brick) const {
        return num_bricks() == 0 ? 0 : bricks_->offsets[brick];
    }

    // True if there are colours; if not, voxels are clay.
    [[nodiscard]] bool colored() const { return colors_ != nullptr; }
    // sRGB, red in the low byte; of an occupied voxel of a brick.
    [[nodiscard]] std::uint32_t rgb(std::size_t brick, const glm::ivec3& voxel) const {
        return colors_ == nullptr ? clay_rgb_ : rgb_at(value_of(brick, voxel));
    }
    // True if there are numbers of materials.
    [[nodiscard]] bool has_materials() const { return materials_ != nullptr; }
    // Number of the material of an occupied voxel of a brick; -1: no material.
    [[nodiscard]] std::int32_t material(std::size_t brick, const glm::ivec3& voxel) const {
        std::int32_t number;
        std::memcpy(&number, materials_->data.data() + value_of(brick, voxel) * sizeof(number), sizeof(number));
        return number;
    }
    // All channels; those without data are bits that every voxel has.
    [[nodiscard]] std::span<const channel> channels() const { return channels_; }
    // Number of the value of an occupied voxel of a brick in a channel that is not of bits.
    [[nodiscard]] std::uint64_t value_of(std::size_t brick, const glm::ivec3& voxel) const {
        if (!by_rank_) return static_cast<std::uint64_t>((voxel.z * extent[1] + voxel.y) * extent[0] + voxel.x);
        const auto bit =
            static_cast<unsigned>(voxelpipe::core::morton_key(voxel) % voxelpipe::core::sparse_brick_voxels);
        return bricks_->offsets[brick] + bricks_->masks[brick].before(bit);
    }
    // The bit of an occupied voxel in a channel of bits.
    [[nodiscard]] bool bit_of(const channel& bits, const glm::ivec3& voxel) const {
        if (by_rank_) return true;
        const std::int64_t row = (voxel.z * extent[1] + voxel.y) * ((extent[0] + 31) / 32);
        const auto byte = static_cast<std::size_t>(4 * row + voxel.x / 8);
        return (std::to_integer<unsigned>(bits.data[byte]) >> (voxel.x % 8) & 1U) != 0;
    }
    // Calls visit(rgb) for the voxels of a brick.
    template <class Visit>
    void for_each_color(std::size_t brick, const Visit& visit) const {
        voxelpipe::for_each_voxel_in(bricks_->table(), brick, [&](const glm::ivec3& voxel, std::uint64_t rank) {
            visit(by_rank_ && colored() ? rgb_at(rank) : rgb(brick, voxel));
        });
    }

private:
    [[nodiscard]] std::uint32_t rgb_at(std::uint64_t value) const {
        const std::byte* at = colors_->data.data() + value * static_cast<std::uint64_t>(colors_->components);
        return std::to_integer<std::uint32_t>(at[0]) | std::to_integer<std::uint32_t>(at[1]) << 8 |
               std::to_integer<std::uint32_t>(at[2]) << 16;
    }

    sparse_volume own_; // of a dense volume
    const sparse_volume* bricks_;
    std::span<const channel> channels_;
    const channel *colors_, *materials_;
    bool by_rank_; // values lie in the order of the bricks, not of the grid
    std::uint32_t clay_rgb_;
};

// Eight voxels of a brick in a row: those at n along `axis` and at b along axis + 2; bit a is the voxel at a along
// axis + 1.
[[nodiscard]] inline unsigned brick_row(const voxelpipe::brick_mask& mask, int axis, unsigned n, unsigned b) {
    constexpr std::array<unsigned, 8> spread{0, 1, 8, 9, 64, 65, 72, 73}; // Morton numbers along x
    const int along = (axis + 1) % 3;
    const unsigned bit = spread[n] << axis | spread[b] << (axis + 2) % 3;
    const auto four = [&](std::uint64_t word) {
        word >>= bit % 64;
        return static_cast<unsigned>((word & 1) | (word >> (1 << along) & 1) << 1 | (word >> (8 << along) & 1) << 2 |
                                     (word >> (9 << along) & 1) << 3);
    };
    const unsigned low = bit / 64;
    return four(mask.words[low]) | four(mask.words[low + (1U << along)]) << 4;
}

// The bricks [first, last) of a shape by their place along an axis, then along axis + 2, then along axis + 1: the order
// in which voxels of planes come row by row.
class brick_order {
public:
    struct placed {
        std::uint64_t place; // three coordinates of 21 bits, the slowest one on top
        std::size_t brick;

        [[nodiscard]] int at() const { return static_cast<int>(place >> 42); }              // along axis
        [[nodiscard]] int row() const { return static_cast<int>(place >> 21 & 0x1fffff); }  // along axis + 2
        [[nodiscard]] int column() const { return static_cast<int>(place & 0x1fffff); }     // along axis + 1
        [[nodiscard]] std::uint64_t in_layer() const { return place & ((1ULL << 42) - 1); } // row and column
    };

    brick_order(const voxel_shape& shape, int axis, std::size_t first, std::size_t last);
    brick_order(const voxel_shape& shape, int axis) : brick_order(shape, axis, 0, shape.num_bricks()) {}

    // Layers of bricks across the axis that have any, in order.
    [[nodiscard]] std::size_t num_layers() const { return begin_.size() - 1; }
    [[nodiscard]] std::span<const placed> layer(std::size_t n) const {
        return std::span{bricks_}.subspan(begin_[n], begin_[n + 1] - begin_[n]);
    }
    // The bricks of the layer that lies at `at` along the axis; an empty span for an empty layer.
    [[nodiscard]] std::span<const placed> layer_at(int at) const;
    // Those of them that lie at `row`.
    [[nodiscard]] static std::span<const placed> row_of(std::span<const placed> layer, int row);

    // Calls visit(rows of equal place along axis + 2) for a layer.
    template <class Visit>
    static void for_each_row(std::span<const placed> layer, const Visit& visit) {
        for (std::size_t begin = 0, end = 0; begin < layer.size(); begin = end) {
            while (end < layer.size() && layer[end].row() == layer[begin].row()) ++end;
            visit(layer.subspan(begin, end - begin));
        }
    }
    // Calls visit(brick, glm::ivec3 voxel) for the voxels of plane n, 0 to 7, of a layer: by axis + 2, then axis + 1.
    template <class Visit>
    void for_each_voxel(std::span<const placed> layer, unsigned n, const Visit& visit) const {
        for_each_row(layer, [&](std::span<const placed> row) {
            for (unsigned b = 0; b < 8; ++b)
                for (const placed& p : row) {
                    unsigned bits = brick_row(shape_.mask(p.brick), axis_, n, b);
                    for (; bits != 0; bits &= bits - 1)
                        visit(p.brick, voxel_at(p, n, static_cast<unsigned>(std::countr_zero(bits)), b));
                }
        });
    }
    // The voxel of a brick at n along axis, a along axis + 1 and b along axis + 2.
    [[nodiscard]] glm::ivec3 voxel_at(const placed& p, unsigned n, unsigned a, unsigned b) const {
        glm::ivec3 voxel;
        voxel[axis_] = 8 * p.at() + static_cast<int>(n);
        voxel[(axis_ + 1) % 3] = 8 * p.column() + static_cast<int>(a);
        voxel[(axis_ + 2) % 3] = 8 * p.row() + static_cast<int>(b);
        return voxel;
    }

private:
    const voxel_shape& shape_;
    int axis_;
    std::vector<placed> bricks_;
    std::vector<std::size_t> begin_; // of the layers, and the end
};

} // namespace voxelize
