// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bits in bricks of 4 x 4 x 4, one word each, and blocks of 4 x 4 x 4 bricks, for rays: a ray passes an empty brick or
// block in one step and meets the cells that walk_cells leads it to. Made from a target of bits, or from any other
// answer to whether a cell is set.

#include <voxelpipe/levels/cell_walk.hpp>
#include <voxelpipe/levels/dense_bits.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe {

// Refers to the bricks and blocks, x fastest, then y, then z. Cell (x, y, z) of a brick is bit x + 4 y + 16 z, and so
// is a brick of a block, set if any of its cells is.
struct brick_bits_view {
    const std::uint64_t* bricks = nullptr;           // not owned
    const std::uint64_t* blocks_of_bricks = nullptr; // not owned
    glm::ivec3 extent{0};                            // in cells

    // The number of bricks for cells, and of blocks for bricks.
    [[nodiscard]] VOXELPIPE_HD static glm::ivec3 num_bricks(const glm::ivec3& extent) {
        return {(extent.x + 3) >> 2, (extent.y + 3) >> 2, (extent.z + 3) >> 2};
    }
    // The number of a cell's word among those of a grid of `extent` cells.
    [[nodiscard]] VOXELPIPE_HD static std::size_t word_of(const glm::ivec3& v, const glm::ivec3& extent) {
        const glm::ivec3 n = num_bricks(extent);
        const auto wide = [](int i) { return static_cast<std::size_t>(i); };
        return (wide(v.z >> 2) * wide(n.y) + wide(v.y >> 2)) * wide(n.x) + wide(v.x >> 2);
    }
    // The bit of a cell in its brick's word, or of a brick in its block's.
    [[nodiscard]] VOXELPIPE_HD static int bit_of(const glm::ivec3& v) {
        return (v.x & 3) + 4 * (v.y & 3) + 16 * (v.z & 3);
    }
    // Calls visit(walked_cell<float>) for every set cell that the ray meets, as walk_cells would, until one call
    // returns true. Returns true if a call did.
    VOXELPIPE_ANY_CALLABLE
    template <class Visit>
    VOXELPIPE_HD bool walk(const glm::vec3& origin, const glm::vec3& direction, float limit, const Visit& visit) const {
        cell_walk<float> walk(extent, origin, direction, limit);
        if (!walk.good()) return false;
        while (true) {
            const glm::ivec3 v = walk.at.cell, in_bricks(v.x >> 2, v.y >> 2, v.z >> 2);
            const std::uint64_t block = blocks_of_bricks[word_of(in_bricks, num_bricks(extent))];
            if ((block >> bit_of(in_bricks) & 1u) == 0) {
                const int side = block == 0 ? 16 : 4;
                const glm::ivec3 low(v.x & -side, v.y & -side, v.z & -side);
                if (!walk.leave_box(low, low + side)) return false;
                continue;
            }
            if ((bricks[word_of(v, extent)] >> bit_of(v) & 1u) != 0) {
                walk.look();
                if (visit(static_cast<const walked_cell<float>&>(walk.at))) return true;
            }
            if (!walk.step()) return false;
        }
    }
    // True if a set cell lies along the ray.
    [[nodiscard]] VOXELPIPE_HD bool blocks(const glm::vec3& origin, const glm::vec3& direction, float limit) const {
        return walk(origin, direction, limit, any_cell{});
    }

private:
    struct any_cell {
        VOXELPIPE_HD bool operator()(const walked_cell<float>&) const { return true; }
    };
};

namespace core {

// Makes brick i.
template <class Rows>
struct make_brick {
    Rows rows;
    glm::ivec3 extent;
    std::uint64_t* out;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::ivec3 n = brick_bits_view::num_bricks(extent);
        const auto nx = static_cast<std::uint64_t>(n.x), ny = static_cast<std::uint64_t>(n.y);
        const glm::ivec3 low(4 * static_cast<int>(i % nx), 4 * static_cast<int>(i / nx % ny),
                             4 * static_cast<int>(i / (nx * ny)));
        std::uint64_t brick = 0;
        for (int row = 0; row < 16; ++row) {
            const glm::ivec3 v(low.x, low.y + (row & 3), low.z + (row >> 2));
            if (v.y < extent.y && v.z < extent.z) brick |= std::uint64_t{rows(v)} << (4 * row);
        }
        out[i] = brick;
    }
};

} // namespace core

// Four bricks of a block, as rows of cells are of bricks.
namespace core {
struct brick_rows {
    const std::uint64_t* bricks;
    glm::ivec3 extent; // in bricks
    VOXELPIPE_HD std::uint32_t operator()(const glm::ivec3& v) const {
        const auto wide = [](int i) { return static_cast<std::size_t>(i); };
        const std::uint64_t* const row = bricks + (wide(v.z) * wide(extent.y) + wide(v.y)) * wide(extent.x) + wide(v.x);
        std::uint32_t bits = 0;
        for (int k = 0; k < 4 && v.x + k < extent.x; ++k) bits |= (row[k] != 0 ? 1u : 0u) << k;
        return bits;
    }
};
} // namespace core

// Rows of a target of bits, for brick_bits::build.
struct bit_rows {
    dense_bits bits; // the target, on the backend that builds
    // Cells v to v + (3, 0, 0) as bits 0 to 3.
    VOXELPIPE_HD std::uint32_t operator()(const glm::ivec3& v) const { return bits.row_of_four(v); }
};

// Owns bricks on Backend: a bit a cell. The constructor allocates and does not initialise. Throws what Backend::buffer
// throws.
template <class Backend>
class brick_bits {
public:
    // extent: cells, each at least 1.
    brick_bits(Backend& backend, const glm::ivec3& extent)
        : extent_(extent), bricks_(backend, count_of(extent)),
          blocks_(backend, count_of(brick_bits_view::num_bricks(extent))) {}

    // Makes all bricks. rows(v), a functor for the backend, gives the cells v to v + (3, 0, 0) as bits 0 to 3: 0 for
    // those outside; v.x is a multiple of 4. In the order of the backend's stream.
    template <class Rows>
    void build(Backend& backend, const Rows& rows) {
        backend.for_each(bricks_.size(), core::make_brick<Rows>{rows, extent_, bricks_.data()});
        const glm::ivec3 bricks = brick_bits_view::num_bricks(extent_);
        backend.for_each(blocks_.size(),
                         core::make_brick<core::brick_rows>{{bricks_.data(), bricks}, bricks, blocks_.data()});
    }
    // Valid as long as this object.
    [[nodiscard]] brick_bits_view view() const { return {bricks_.data(), blocks_.data(), extent_}; }

private:
    [[nodiscard]] static std::size_t count_of(const glm::ivec3& extent) {
        const glm::ivec3 n = brick_bits_view::num_bricks(extent);
        return static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z);
    }
    glm::ivec3 extent_;
    typename Backend::template buffer<std::uint64_t> bricks_, blocks_;
};

} // namespace voxelpipe
