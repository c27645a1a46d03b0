// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A target of bits as host and device read it beside the pipeline: a voxel, the eight bits of a voxel that is twice as
// large, and the first voxel that a ray meets.
//
// Fractional opacity: draw bits at twice the resolution; a voxel's opacity is count_ones(children(voxel)) / 8. A
// surface that moves then changes a voxel in steps of an eighth, not at once. Fill closed meshes (voxelize_solid): a
// surface alone covers half of its voxels, and light leaks through.

#include <voxelpipe/core/octree_view.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/levels/cell_walk.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe {

// Refers to bits in linear layout: 32 along x to a word, rows padded to words.
struct dense_bits {
    const std::uint32_t* words = nullptr; // the bits, not owned
    glm::ivec3 extent{0};                 // in voxels

    // No bits.
    dense_bits() = default;
    // The bits of a target's elements.
    VOXELPIPE_HD dense_bits(const std::uint32_t* bits, const glm::ivec3& size) : words(bits), extent(size) {}
    // The bits of a target.
    template <class Blend>
    explicit dense_bits(const target_view<target<bit, Blend>>& t) : words(t.elements), extent(t.extent) {}

    // False outside the extent.
    [[nodiscard]] VOXELPIPE_HD bool operator()(const glm::ivec3& v) const {
        if (v.x < 0 || v.y < 0 || v.z < 0 || v.x >= extent.x || v.y >= extent.y || v.z >= extent.z) return false;
        return (word(v.x, v.y, v.z) >> (v.x & 31) & 1u) != 0;
    }
    // The bits of voxel v of a grid of half the resolution, in Morton order: bit 0 is 2 v, bit 1 its neighbour along x,
    // bit 2 along y, bit 4 along z. v is not negative; bits outside the extent are 0.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t children(const glm::ivec3& v) const {
        const int x = 2 * v.x; // both bits of a row lie in one word
        const std::uint32_t row = x + 1 < extent.x ? 3u : 1u;
        std::uint32_t mask = 0;
        if (x >= extent.x) return mask;
        for (int k = 0; k < 4; ++k) {
            const int y = 2 * v.y + (k & 1), z = 2 * v.z + (k >> 1);
            if (y < extent.y && z < extent.z) mask |= (word(x, y, z) >> (x & 31) & row) << (2 * k);
        }
        return mask;
    }
    // Voxels v to v + (3, 0, 0) as bits 0 to 3; those outside are 0. v is within the extent, v.x a multiple of 4.
    [[nodiscard]] VOXELPIPE_HD std::uint32_t row_of_four(const glm::ivec3& v) const {
        const int left = extent.x - v.x;
        const std::uint32_t row = left < 4 ? (1u << left) - 1u : 15u;
        return word(v.x, v.y, v.z) >> (v.x & 31) & row;
    }
    // The first voxel along origin + t * direction, 0 <= t <= limit, as octree_view::first_hit, in the numbers of the
    // bits; rank is the linear id, (z * ny + y) * nx + x.
    [[nodiscard]] VOXELPIPE_HD voxel_hit first_hit(const glm::dvec3& origin, const glm::dvec3& direction,
                                                   double limit = 1e300) const {
        voxel_hit hit;
        const auto stop = [&](const walked_cell<double>& at) {
            if ((word(at.cell.x, at.cell.y, at.cell.z) >> (at.cell.x & 31) & 1u) == 0) return false;
            hit.found = true;
            hit.distance = at.enter;
            hit.voxel = at.cell;
            hit.axis = at.axis;
            hit.from_above = at.from_above;
            return true;
        };
        if (!walk_cells(extent, origin, direction, limit, stop)) return hit;
        const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
        hit.rank = (wide(hit.voxel.z) * wide(extent.y) + wide(hit.voxel.y)) * wide(extent.x) + wide(hit.voxel.x);
        return hit;
    }
    // True if a voxel lies along the ray, in float: for shadows.
    [[nodiscard]] VOXELPIPE_HD bool blocks(const glm::vec3& origin, const glm::vec3& direction, float limit) const {
        const dense_bits& bits = *this;
        return walk_cells(extent, origin, direction, limit, [&](const walked_cell<float>& at) {
            return (bits.word(at.cell.x, at.cell.y, at.cell.z) >> (at.cell.x & 31) & 1u) != 0;
        });
    }

private:
    [[nodiscard]] VOXELPIPE_HD std::uint32_t word(int x, int y, int z) const {
        return words[core::storage_map<bit, layout::linear>::cell(extent, x, y, z)];
    }
};

} // namespace voxelpipe
