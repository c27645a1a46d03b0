// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bricks of 8^3 voxels, sorted by Morton key, each with a bit for every voxel that exists. A voxel's rank is its number
// among them, in the Morton order of voxels: the place of its values. Cubes of bricks whose voxels all exist and have
// one value may be tiles instead; tile t has the t-th rank behind those of the voxels. The table names memory that
// someone else owns; host and device read it alike.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/bits.hpp>
#include <voxelpipe/core/brick_tile.hpp>
#include <voxelpipe/core/morton.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace voxelpipe {

namespace core {

inline constexpr int log2_sparse_brick = 3;
inline constexpr int sparse_brick_size = 1 << log2_sparse_brick;
inline constexpr int sparse_brick_voxels = sparse_brick_size * sparse_brick_size * sparse_brick_size;

[[nodiscard]] VOXELPIPE_HD inline unsigned count_ones(std::uint64_t word) {
#if defined(__CUDA_ARCH__)
    return static_cast<unsigned>(__popcll(word));
#else
    return static_cast<unsigned>(std::popcount(word));
#endif
}

} // namespace core

// A bit for each voxel of a brick, in Morton order: voxel (x, y, z) of the brick is bit morton_key(x, y, z), and eight
// voxels that share a parent are a byte.
struct brick_mask {
    std::uint64_t words[8]{}; // bit b is bit b % 64 of word b / 64

    // True if the voxel of this bit exists, 0 <= bit < 512.
    [[nodiscard]] VOXELPIPE_HD bool has(unsigned bit) const { return (words[bit >> 6] >> (bit & 63u) & 1u) != 0; }
    // The number of voxels that exist below a bit.
    [[nodiscard]] VOXELPIPE_HD unsigned before(unsigned bit) const {
        unsigned n = core::count_ones(words[bit >> 6] & ((std::uint64_t{1} << (bit & 63u)) - 1));
        for (unsigned w = 0; w < bit >> 6; ++w) n += core::count_ones(words[w]);
        return n;
    }
    // Voxels that exist.
    [[nodiscard]] VOXELPIPE_HD unsigned count() const {
        unsigned n = 0;
        for (const std::uint64_t word : words) n += core::count_ones(word);
        return n;
    }
    friend bool operator==(const brick_mask&, const brick_mask&) = default;
};

// Bricks are numbered in the whole grid, so that crops of it agree; voxels as framebuffers number them, from the corner
// of the computed part.
struct brick_table {
    static constexpr std::uint64_t none = ~std::uint64_t{0}; // no brick, or no voxel

    const std::uint64_t* keys = nullptr;    // core::morton_key of the brick's place, ascending
    const brick_mask* masks = nullptr;      // none is empty
    const std::uint64_t* offsets = nullptr; // rank of each brick's first voxel, and one more: the number of voxels
    std::uint64_t count = 0;                // bricks
    glm::ivec3 extent{0};                   // voxels of the part
    glm::ivec3 offset{0};                   // of the part in the whole grid
    const brick_tile* tiles = nullptr;      // ascending; none has a brick of `keys`, or reaches out of the part
    std::uint64_t num_tiles = 0;            // length of `tiles`

    // Voxels that exist in bricks: the ranks below those of the tiles.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_in_bricks() const { return count == 0 ? 0 : offsets[count]; }
    // Voxels that exist, those of tiles among them, which are added up.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_voxels() const {
        std::uint64_t n = num_in_bricks();
        for (std::uint64_t t = 0; t < num_tiles && tiles[t].bits != brick_tile::none().bits; ++t)
            n += tiles[t].num_voxels();
        return n;
    }
    // Ranks: values of a target.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_values() const { return num_in_bricks() + num_tiles; }

    // The number of the brick with this key, by bisection; `none` where it does not exist.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find_brick(std::uint64_t key) const {
        const std::uint64_t brick = core::count_below(keys, count, key);
        return brick < count && keys[brick] == key ? brick : none;
    }

    // The rank of the tile that has the brick with this key; `none` where none has it.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t rank_of_tile(std::uint64_t key) const {
        const std::uint64_t t = num_tiles == 0 ? 0 : core::find_tile(tiles, num_tiles, key);
        return t == num_tiles ? none : num_in_bricks() + t;
    }
    // The rank of a voxel of the part, or of its tile; `none` where it does not exist or lies outside.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find(const glm::ivec3& voxel) const {
        if (!is_in_part(voxel)) return none;
        const std::uint64_t key = core::morton_key(voxel + offset), of_brick = key / core::sparse_brick_voxels;
        const std::uint64_t brick = find_brick(of_brick);
        return brick == none ? rank_of_tile(of_brick) : rank_of(brick, key);
    }
    // True if (x, y, z) is a voxel of the part, whether it exists or not.
    [[nodiscard]] VOXELPIPE_HD bool is_in_part(const glm::ivec3& voxel) const {
        bool is_in = true;
        for (int a = 0; a < 3; ++a) is_in = is_in && voxel[a] >= 0 && voxel[a] < extent[a];
        return is_in;
    }
    // The rank of the voxel with this Morton key in a brick, or in `none`.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t rank_of(std::uint64_t brick, std::uint64_t voxel_key) const {
        const auto bit = static_cast<unsigned>(voxel_key % core::sparse_brick_voxels);
        if (brick == none || !masks[brick].has(bit)) return none;
        return offsets[brick] + masks[brick].before(bit);
    }

    // The first voxel of a brick, in the part's numbers: negative where a crop begins within the brick.
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 brick_origin(std::uint64_t brick) const {
        return core::morton_position(keys[brick]) * core::sparse_brick_size - offset;
    }
};

namespace core {

// The values of a target by rank, vectors interleaved whatever the target's layout, bits 32 to a word.
template <class Target>
struct rank_map {
    using value = typename Target::value_type;
    static constexpr bool is_bit = Target::map::is_bit;
    using element = std::conditional_t<is_bit, std::uint32_t, value>;

    [[nodiscard]] VOXELPIPE_HD static constexpr std::size_t elements(std::uint64_t voxels) {
        return static_cast<std::size_t>(is_bit ? (voxels + 31) / 32 : voxels);
    }
    [[nodiscard]] VOXELPIPE_HD static value load(const element* values, std::uint64_t rank) {
        if constexpr (is_bit)
            return (values[rank >> 5] >> (rank & 31u) & 1u) != 0;
        else
            return values[rank];
    }
    // Bits share words: one thread a word.
    VOXELPIPE_HD static void store(element* values, std::uint64_t rank, const value& v) {
        if constexpr (is_bit) {
            const std::uint32_t bit = 1u << (rank & 31u);
            values[rank >> 5] = v ? values[rank >> 5] | bit : values[rank >> 5] & ~bit;
        } else {
            values[rank] = v;
        }
    }
};

} // namespace core
} // namespace voxelpipe
