// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Addresses: voxel -> storage element for each layout of a render target.
//
//   linear   x fastest, then y, then z; vectors interleaved (RGBRGB). Bits: 32 along x to a word, rows padded to words.
//   planar   as linear, one plane a component (RRGGBB).
//   tiled    bricks of 8 x 8 x 8 voxels (bits: 32 x 8 x 8), x fastest in a brick and among bricks; edges padded.

#include <voxelpipe/core/value_traits.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe {

namespace layout {
struct linear {}; // voxels in the order x, y, z; the components of a vector side by side
struct planar {}; // the same order, each component of a vector in an array of its own
struct tiled {};  // bricks of 8 x 8 x 8 voxels (bits: 32 x 8 x 8)
} // namespace layout

namespace core {

// The storage of a target of T (`bit` for bits): number and type of its elements, and access to a voxel. Sizes are
// 64-bit: nx * ny * nz may exceed 2^32.
template <class T, class Layout>
struct storage_map {
    static constexpr bool is_bit = std::is_same_v<T, bit>;
    static constexpr int components = vector_traits<T>::components;
    static constexpr bool planes = std::is_same_v<Layout, layout::planar> && components > 1;
    static constexpr bool bricks = std::is_same_v<Layout, layout::tiled>;

    using value = std::conditional_t<is_bit, bool, T>;
    using element =
        std::conditional_t<is_bit, std::uint32_t, std::conditional_t<planes, typename vector_traits<T>::element, T>>;

    static constexpr int brick_x = is_bit ? 32 : 8;

    // Number of voxels, or of words of 32 voxels for bits, padding included.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::size_t cells(glm::ivec3 extent) {
        const auto x = static_cast<std::size_t>(extent.x), y = static_cast<std::size_t>(extent.y),
                   z = static_cast<std::size_t>(extent.z);
        if constexpr (bricks)
            return ((x + brick_x - 1) / brick_x) * ((y + 7) / 8) * ((z + 7) / 8) * (is_bit ? 64 : 512);
        else
            return (is_bit ? (x + 31) / 32 : x) * y * z;
    }
    [[nodiscard]] VOXELPIPE_HD static constexpr std::size_t elements(glm::ivec3 extent) {
        return cells(extent) * (planes ? components : 1);
    }

    // Index of a voxel's cell.
    [[nodiscard]] VOXELPIPE_HD static constexpr std::size_t cell(glm::ivec3 extent, int x, int y, int z) {
        const int column = is_bit ? x >> 5 : x;
        if constexpr (bricks) {
            const auto bricks_x = static_cast<std::size_t>((extent.x + brick_x - 1) / brick_x);
            const auto bricks_y = static_cast<std::size_t>((extent.y + 7) / 8);
            const std::size_t brick =
                (static_cast<std::size_t>(z >> 3) * bricks_y + static_cast<std::size_t>(y >> 3)) * bricks_x +
                static_cast<std::size_t>(x / brick_x);
            const int inside = is_bit ? (z & 7) * 8 + (y & 7) : ((z & 7) * 8 + (y & 7)) * 8 + (x & 7);
            return brick * (is_bit ? 64 : 512) + static_cast<std::size_t>(inside);
        } else {
            const auto wide = [](int a) { return std::size_t{static_cast<std::uint32_t>(a)}; }; // no sign extension
            const std::size_t row = wide(is_bit ? (extent.x + 31) / 32 : extent.x);
            return (wide(z) * wide(extent.y) + wide(y)) * row + wide(column);
        }
    }

    [[nodiscard]] VOXELPIPE_HD static value load(const element* data, glm::ivec3 extent, int x, int y, int z) {
        const std::size_t i = cell(extent, x, y, z);
        if constexpr (is_bit) {
            return ((data[i] >> (x & 31)) & 1u) != 0;
        } else if constexpr (planes) {
            value r;
            const std::size_t plane = cells(extent);
            for (int c = 0; c < components; ++c) r[c] = data[i + static_cast<std::size_t>(c) * plane];
            return r;
        } else {
            return data[i];
        }
    }

    VOXELPIPE_HD
    static void store(element* data, glm::ivec3 extent, int x, int y, int z, const value& v) {
        const std::size_t i = cell(extent, x, y, z);
        if constexpr (is_bit) {
            const std::uint32_t mask = 1u << (x & 31);
            data[i] = v ? data[i] | mask : data[i] & ~mask;
        } else if constexpr (planes) {
            const std::size_t plane = cells(extent);
            for (int c = 0; c < components; ++c) data[i + static_cast<std::size_t>(c) * plane] = v[c];
        } else {
            data[i] = v;
        }
    }
};

} // namespace core
} // namespace voxelpipe
