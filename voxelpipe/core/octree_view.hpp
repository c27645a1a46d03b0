// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree over the voxels of a sparse grid, as host and device read it: level l has nodes of 2^l voxels a side in the
// Morton order of their positions, each with a mask of its children; level 0 are the voxels themselves, numbered by
// rank. The children of a level follow each other in its order, so the number of a node's first child is the number of
// bits in all masks before. A directory of 16 bytes for 64 nodes makes that one count of a word (Vigna 2008, rank9). A
// node without children is a tile: all its voxels exist and have one rank, which is listed. And the first voxel that a
// ray meets.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/exact.hpp>

#include <cstdint>

namespace voxelpipe {

// The first voxel that a ray meets.
struct voxel_hit {
    bool found = false;      // false: none within the limit
    double distance = 0;     // along the ray, in lengths of its direction
    glm::ivec3 voxel{0};     // in the numbers of the whole grid
    std::uint64_t rank = 0;  // of the voxel, or of its tile
    int axis = 0;            // of the side through which the ray enters the voxel
    bool from_above = false; // through the upper side
};

// A tile among the nodes of a level.
struct octree_tile {
    std::uint64_t node = 0; // its number
    std::uint64_t rank = 0; // of its value
    friend bool operator==(const octree_tile&, const octree_tile&) = default;
};

// The children of the nodes before a block of 64, and before each of its words of eight masks.
struct alignas(16) octree_block {
    static constexpr int log2_nodes = 6; // of a block
    static constexpr int part_bits = 9;  // a block has up to 512 children

    std::uint64_t before = 0; // children before the block
    std::uint64_t parts = 0;  // 9 bits each: children in the block before words 1 to 7, that of word 1 lowest

    // The children before word w of the block, 0 to 7.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t before_word(unsigned w) const {
        return before + (parts >> (part_bits * ((w - 1) & 7u)) & 511u); // of word 0: the highest bit, which is 0
    }
    // Sets the number of children of the block before word w, 1 to 7. Called once for each word.
    VOXELPIPE_HD void set_part(unsigned w, std::uint64_t children) { parts |= children << (part_bits * (w - 1)); }
    friend bool operator==(const octree_block&, const octree_block&) = default;
};

// Reads a level of an octree in host or device memory; does not own it.
struct octree_level_view {
    const std::uint64_t* masks = nullptr; // a byte a node, the first of eight lowest; bytes without a node are 0
    const octree_block* blocks = nullptr; // one for 64 nodes
    const octree_tile* tiles = nullptr;   // by node
    std::uint64_t num_tiles = 0;          // length of `tiles`

    // Bit c: the child of node n with Morton number c exists. 0: the node is a tile.
    [[nodiscard]] VOXELPIPE_HD unsigned mask(std::uint64_t n) const {
        return static_cast<unsigned>(masks[n >> 3] >> low_bit(n)) & 255u;
    }
    // The number of child c, 0 to 7, of node n, on the level below; the child exists.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t child(std::uint64_t n, unsigned c) const {
        const octree_block block = blocks[n >> octree_block::log2_nodes];
        const std::uint64_t word = n >> 3, below = (std::uint64_t{1} << (low_bit(n) + c)) - 1;
        return block.before_word(static_cast<unsigned>(word & 7u)) + core::count_ones(masks[word] & below);
    }
    // The number of the first child of node n that exists; the others follow.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t first_child(std::uint64_t n) const { return child(n, 0); }
    // The rank of the value of node n, which is a tile.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t rank_of_tile(std::uint64_t n) const {
        return tiles[core::bisect(num_tiles, [this, n](std::uint64_t i) { return tiles[i].node < n; })].rank;
    }

    // Number of words of the masks of `nodes` nodes.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint64_t num_words(std::uint64_t nodes) { return (nodes + 7) / 8; }
    // Number of blocks of `nodes` nodes.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::uint64_t num_blocks(std::uint64_t nodes) {
        return (nodes + 63) / 64;
    }

private:
    [[nodiscard]] VOXELPIPE_HD static unsigned low_bit(std::uint64_t n) { return static_cast<unsigned>(n & 7u) * 8; }
};

// Reads an octree in host or device memory; does not own it.
struct octree_view {
    static constexpr int max_levels = 21; // enough for 2^20 voxels an axis

    int num_levels = 0;                     // the root is level num_levels; 0 if no voxel exists
    octree_level_view levels[max_levels]{}; // level l at [l - 1]

    // The first voxel along origin + t * direction, 0 <= t <= limit, in continuous voxel coordinates of the whole grid,
    // in which voxel (i, j, k) is the box from (i, j, k) to (i + 1, j + 1, k + 1). A ray that starts within a voxel
    // meets it at t = 0. The direction is not zero; numbers are finite.
    [[nodiscard]] VOXELPIPE_HD voxel_hit first_hit(const glm::dvec3& origin, const glm::dvec3& direction,
                                                   double limit = 1e300) const {
        voxel_hit hit;
        if (num_levels == 0) return hit;
        const int side = 1 << num_levels;
        // Enter the root's box: through the side that is met last.
        double t = 0, t_end = limit;
        int axis = 0;
        double inverse[3];
        for (int a = 0; a < 3; ++a) {
            if (direction[a] == 0) {
                if (origin[a] < 0 || origin[a] >= side) return hit;
                inverse[a] = 1e300; // its sides never come next
                continue;
            }
            inverse[a] = 1 / direction[a];
            const double near = ((direction[a] > 0 ? 0 : side) - origin[a]) * inverse[a];
            const double far = ((direction[a] > 0 ? side : 0) - origin[a]) * inverse[a];
            if (near > t) {
                t = near;
                axis = a;
            }
            if (far < t_end) t_end = far;
        }
        if (!(t <= t_end)) return hit;
        if (t == 0)
            for (int a = 1; a < 3; ++a)
                if (magnitude_of(direction[a]) > magnitude_of(direction[axis])) axis = a;
        int cell[3];
        for (int a = 0; a < 3; ++a) cell[a] = clamped(exact::fma(t, direction[a], origin[a]), 0, side - 1);

        // The way from the root to the cell; after a step only what lies below the common part is walked again.
        std::uint64_t path[max_levels + 1];
        int level = num_levels;
        path[level] = 0;
        while (true) {
            bool is_full = level == 0;
            std::uint64_t rank = path[0];
            while (level > 0) {
                const octree_level_view& nodes = levels[level - 1];
                const unsigned c = child_of(cell, level), mask = nodes.mask(path[level]);
                if (mask == 0) {
                    is_full = true;
                    rank = nodes.rank_of_tile(path[level]);
                    break;
                }
                if ((mask >> c & 1u) == 0) break;
                path[level - 1] = nodes.child(path[level], c);
                --level;
                is_full = level == 0;
                rank = path[level];
            }
            if (is_full) {
                hit.found = true;
                hit.distance = t;
                hit.voxel = {cell[0], cell[1], cell[2]};
                hit.rank = rank;
                hit.axis = axis;
                hit.from_above = direction[axis] < 0;
                return hit;
            }
            // Leaves the empty child, 2^(level - 1) voxels a side. Each t comes from the side itself, so no error adds
            // up, and the cell advances along an axis with every step.
            const int empty = level - 1;
            double next = 1e308;
            int end = 0;
            for (int a = 0; a < 3; ++a) {
                if (direction[a] == 0) continue;
                const int at = ((cell[a] >> empty) + (direction[a] > 0 ? 1 : 0)) << empty;
                const double to = (at - origin[a]) * inverse[a];
                if (to < next) {
                    next = to;
                    axis = a;
                    end = at;
                }
            }
            if (!(next < t_end)) return hit;
            if (next > t) t = next;
            const int before[3] = {cell[0], cell[1], cell[2]};
            for (int a = 0; a < 3; ++a) {
                const int from = cell[a] >> empty << empty;
                cell[a] = clamped(exact::fma(t, direction[a], origin[a]), from, from + (1 << empty) - 1);
            }
            cell[axis] = direction[axis] > 0 ? end : end - 1;
            if (cell[axis] < 0 || cell[axis] >= side) return hit;
            const unsigned changed =
                static_cast<unsigned>((before[0] ^ cell[0]) | (before[1] ^ cell[1]) | (before[2] ^ cell[2]));
            while (level < num_levels && (changed >> level) != 0) ++level;
        }
    }

private:
    [[nodiscard]] VOXELPIPE_HD static double magnitude_of(double a) { return a < 0 ? -a : a; }
    // The floor of what is not far below zero, brought into [from, to].
    [[nodiscard]] VOXELPIPE_HD static int clamped(double a, int from, int to) {
        return a <= from ? from : a >= to ? to : static_cast<int>(a);
    }
    // Number of the child of its node of this level that a cell lies in.
    [[nodiscard]] VOXELPIPE_HD static unsigned child_of(const int (&cell)[3], int level) {
        return static_cast<unsigned>((cell[0] >> (level - 1) & 1) | (cell[1] >> (level - 1) & 1) << 1 |
                                     (cell[2] >> (level - 1) & 1) << 2);
    }
};

} // namespace voxelpipe
