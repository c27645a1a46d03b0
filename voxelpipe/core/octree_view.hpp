// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree over the voxels of a sparse grid, as host and device read it: level l has nodes of 2^l voxels a side in the
// Morton order of their positions, each with a mask of its children and the number of the first of them in the level
// below; level 0 are the voxels themselves, numbered by rank. A node without children is a tile: all its voxels exist
// and have its rank, which stands in place of the first child. And the first voxel that a ray meets.

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

// Reads an octree in host or device memory; does not own it.
struct octree_view {
    static constexpr int max_levels = 21; // enough for 2^20 voxels an axis

    int num_levels = 0;                       // the root is level num_levels; there is none where no voxel exists
    const std::uint8_t* masks[max_levels]{};  // of level l at [l - 1]; bit c: the child with Morton number c exists
    const std::uint64_t* first[max_levels]{}; // number of the first child that exists; of a tile, its rank

    // The number of child c, 0 to 7, of node n of a level; the child exists.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t child(int level, std::uint64_t n, unsigned c) const {
        return first[level - 1][n] + core::count_ones(masks[level - 1][n] & ((1u << c) - 1));
    }

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
                const unsigned c = child_of(cell, level), mask = masks[level - 1][path[level]];
                if (mask == 0) {
                    is_full = true;
                    rank = first[level - 1][path[level]];
                    break;
                }
                if ((mask >> c & 1u) == 0) break;
                path[level - 1] = child(level, path[level], c);
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
