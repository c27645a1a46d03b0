// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Samples of sparse framebuffers, in bricks of 8^3: which are inside. Functors for a backend's for_each.

#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <glm/vec3.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// A bit for each sample, or cell, of a brick: x + 8 y of layer z.
struct brick_layers {
    std::uint64_t layers[8];
};

// Bricks of one sparse framebuffer, with the samples that are inside.
struct brick_source {
    brick_table table;
    brick_lookup lookup;
    const brick_layers* inside = nullptr;

    // The brick at this place of the whole grid, which is not negative; brick_table::none if it does not exist.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find(std::uint64_t key) const {
        return table.count == 0 ? brick_table::none : lookup.find_brick(table, key);
    }
};

// The samples of a field and, where it has no brick, those of bits, whose cubes of full bricks may be tiles. What
// neither has is outside. Bricks are numbered through: of the field, of the bits, tiles.
struct sample_bricks {
    static constexpr std::uint64_t none = brick_table::none;
    brick_source field, bits;
    const std::uint32_t* values = nullptr; // by rank, of the bits

    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_bricks() const { return field.table.count + bits.table.count; }
    // The brick or the tile at a place in the whole grid, counted in bricks, or `none`.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find(int x, int y, int z) const {
        if (x < 0 || y < 0 || z < 0) return none;
        const std::uint64_t key = morton_key(x, y, z);
        const std::uint64_t of_field = field.find(key);
        if (of_field != none) return of_field;
        const std::uint64_t of_bits = bits.find(key);
        if (of_bits != none) return field.table.count + of_bits;
        const std::uint64_t rank = bits.table.rank_of_tile(key);
        return rank == none ? none : num_bricks() + rank - bits.table.num_in_bricks();
    }
    // The samples of a layer that are inside.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t layer(std::uint64_t brick, int z) const {
        if (brick == none) return 0;
        if (brick < field.table.count) return field.inside[brick].layers[z];
        if (brick < num_bricks()) return bits.inside[brick - field.table.count].layers[z];
        const std::uint64_t rank = bits.table.num_in_bricks() + brick - num_bricks();
        return (values[rank >> 5] >> (rank & 31u) & 1u) != 0 ? ~std::uint64_t{0} : 0;
    }
    // The first sample of the part in the whole grid.
    [[nodiscard]] VOXELPIPE_HD glm::ivec3 offset() const { return bits.table.offset; }
    // Sample of the part.
    [[nodiscard]] VOXELPIPE_HD bool inside(int x, int y, int z) const {
        const int wx = x + offset().x, wy = y + offset().y, wz = z + offset().z;
        const std::uint64_t brick = find(wx >> 3, wy >> 3, wz >> 3);
        return brick != none && (layer(brick, wz & 7) >> ((wx & 7) + 8 * (wy & 7)) & 1u) != 0;
    }
    // The corners of a cell of the part as bits.
    [[nodiscard]] VOXELPIPE_HD int corners(int x, int y, int z) const {
        int c = 0;
        for (int i = 0; i < 8; ++i)
            if (inside(x - 1 + (i & 1), y - 1 + (i >> 1 & 1), z - 1 + (i >> 2))) c |= 1 << i;
        return c;
    }
};

// The place of a bit of a brick_mask.
[[nodiscard]] VOXELPIPE_HD inline int place_in_layer(unsigned bit) {
    return static_cast<int>(gather_bits(bit) + 8 * gather_bits(bit >> 1));
}
[[nodiscard]] VOXELPIPE_HD inline int layer_of_bit(unsigned bit) { return static_cast<int>(gather_bits(bit >> 2)); }

// Calls visit(bit of the mask, rank) for the voxels of brick i that exist.
VOXELPIPE_ANY_CALLABLE
template <class Visit>
VOXELPIPE_HD void for_each_in_brick(const brick_table& table, std::uint64_t i, const Visit& visit) {
    std::uint64_t rank = table.offsets[i];
    for (unsigned w = 0; w < 8; ++w)
        for (std::uint64_t left = table.masks[i].words[w]; left != 0; left &= left - 1)
            visit(64 * w + static_cast<unsigned>(exact::lowest_one(left)), rank++);
}

// The samples of brick i whose bit is set.
struct read_bit_bricks {
    brick_table table;
    const std::uint32_t* values; // by rank
    brick_layers* inside;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        brick_layers b{};
        for_each_in_brick(table, i, [&](unsigned bit, std::uint64_t rank) {
            if ((values[rank >> 5] >> (rank & 31u) & 1u) != 0)
                b.layers[layer_of_bit(bit)] |= std::uint64_t{1} << place_in_layer(bit);
        });
        inside[i] = b;
    }
};

// The samples of brick i of a field that are below the level; those without a value are inside where their bit is set.
struct read_field_bricks {
    brick_table table;
    const float* values; // by rank
    double level;
    sample_bricks others; // of the bits alone
    brick_layers* inside;
    std::uint64_t* nan_samples; // a count

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::ivec3 at = morton_position(table.keys[i]);
        const std::uint64_t other = others.find(at.x, at.y, at.z);
        brick_layers b{};
        for (int z = 0; z < 8; ++z) b.layers[z] = others.layer(other, z);
        std::uint32_t nans = 0;
        for_each_in_brick(table, i, [&](unsigned bit, std::uint64_t rank) {
            const double number = exact::to_double(values[rank]);
            const std::uint64_t sample = std::uint64_t{1} << place_in_layer(bit);
            std::uint64_t& layer = b.layers[layer_of_bit(bit)];
            layer = number < level ? layer | sample : layer & ~sample;
            nans += number >= 0 || number < 0 ? 0 : 1; // not a number
        });
        inside[i] = b;
        if (nans != 0) add_shared(*nan_samples, nans);
    }
};

// A sparse field as cross_field reads it: where it has no value, plus or minus the distance of its band.
struct sparse_field_view {
    sample_bricks samples;
    const float* values; // by rank
    float band;

    [[nodiscard]] VOXELPIPE_HD bool has(int x, int y, int z) const {
        return samples.field.table.is_in_part(glm::ivec3(x, y, z));
    }
    [[nodiscard]] VOXELPIPE_HD float operator()(int x, int y, int z) const {
        const std::uint64_t rank = samples.field.lookup.find(samples.field.table, glm::ivec3(x, y, z));
        if (rank != brick_table::none) return values[rank];
        return samples.inside(x, y, z) ? -band : band;
    }
};

} // namespace voxelpipe::core::passes
