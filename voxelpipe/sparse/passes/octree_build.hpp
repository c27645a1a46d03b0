// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The passes that build an octree in the memory of a backend, as functors for Backend::for_each.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/octree_view.hpp>

#include <bit>
#include <cstdint>

namespace voxelpipe::core {

// Bit i: byte i of a word is not 0.
[[nodiscard]] VOXELPIPE_HD inline unsigned bytes_in_use(std::uint64_t word) {
    word |= word >> 4;
    word |= word >> 2;
    word |= word >> 1;
    return static_cast<unsigned>((word & 0x0101010101010101u) * 0x0102040810204080u >> 56);
}

// Nodes of levels 2 and 1 in each brick; the last count is 0, for the sums.
struct count_brick_nodes {
    brick_table table;
    std::uint32_t *words, *bytes;

    VOXELPIPE_HD void operator()(std::uint64_t b) const {
        unsigned w = 0, n = 0;
        if (b < table.count)
            for (const std::uint64_t word : table.masks[b].words) {
                w += word != 0 ? 1 : 0;
                n += count_ones(bytes_in_use(word));
            }
        words[b] = w;
        bytes[b] = n;
    }
};

// Masks of a level's nodes as they are made, a byte each, the first of a word lowest.
struct mask_bytes {
    std::uint64_t* words;
    std::uint64_t count; // nodes

    // Stores the mask of node n. The last node also sets the rest of its word to 0.
    VOXELPIPE_HD void store(std::uint64_t n, unsigned mask) const {
        auto* const bytes = reinterpret_cast<std::uint8_t*>(words);
        bytes[n] = static_cast<std::uint8_t>(mask);
        if (n + 1 == count)
            while (++n % 8 != 0) bytes[n] = 0;
    }
};
static_assert(std::endian::native == std::endian::little, "voxelpipe: bytes of words are written as little-endian");

// Levels 1 to 3, a call for each word of the bricks' masks: a node of level 2.
struct make_brick_nodes {
    brick_table table;
    const std::uint64_t *first_word, *first_byte; // of each brick
    mask_bytes masks[3];

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t b = i >> 3;
        const auto w = static_cast<unsigned>(i & 7u);
        const brick_mask& mask = table.masks[b];
        std::uint64_t node = first_word[b], leaf = first_byte[b];
        unsigned words = 0;
        for (unsigned k = 0; k < 8; ++k) {
            const std::uint64_t word = mask.words[k];
            words |= (word != 0 ? 1u : 0u) << k;
            if (k >= w) continue;
            node += word != 0 ? 1 : 0;
            leaf += count_ones(bytes_in_use(word));
        }
        if (w == 0) masks[2].store(b, words);
        const std::uint64_t word = mask.words[w];
        if (word == 0) return;
        masks[1].store(node, bytes_in_use(word));
        for (unsigned k = 0; k < 8; ++k) {
            const unsigned byte = static_cast<unsigned>(word >> (8 * k)) & 255u;
            if (byte != 0) masks[0].store(leaf++, byte);
        }
    }
};

// 1 for tiles of a level; the last count is 0.
struct count_tiles {
    brick_table table;
    int level;
    std::uint32_t* is_of_level;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        is_of_level[i] = i < table.num_tiles && table.tiles[i].level() == level ? 1 : 0;
    }
};
// The tiles of a level: keys of its nodes, and ranks.
struct list_tiles {
    brick_table table;
    int level;
    std::uint64_t first_rank;   // of tiles
    const std::uint64_t* place; // of each tile among those of the level
    std::uint64_t* keys;
    octree_tile* tiles;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (table.tiles[i].level() != level) return;
        keys[place[i]] = table.tiles[i].first() >> (3 * level);
        tiles[place[i]].rank = first_rank + i;
    }
};
// A level's nodes that have children and its tiles, each by their keys, in one list. A call for each of both.
struct merge_nodes {
    const std::uint64_t* node_keys;
    const std::uint8_t* node_masks;
    std::uint64_t num_nodes;
    const std::uint64_t* tile_keys;
    std::uint64_t num_tiles;
    std::uint64_t* keys;
    mask_bytes masks;
    octree_tile* tiles;

    VOXELPIPE_HD void operator()(std::uint64_t i) const { // no key is in both
        if (i < num_nodes) {
            const std::uint64_t key = node_keys[i], at = i + count_below(tile_keys, num_tiles, key);
            keys[at] = key;
            masks.store(at, node_masks[i]);
        } else {
            const std::uint64_t t = i - num_nodes, key = tile_keys[t], at = t + count_below(node_keys, num_nodes, key);
            keys[at] = key;
            masks.store(at, 0);
            tiles[t].node = at;
        }
    }
};
// The parents, each by its first child.
struct make_parents {
    const std::uint64_t* keys;
    std::uint64_t count;
    const std::uint32_t* is_first;
    const std::uint64_t* parent;
    std::uint64_t* parent_keys;
    mask_bytes masks;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (is_first[i] == 0) return;
        unsigned mask = 0;
        for (std::uint64_t c = i; c < count && keys[c] >> 3 == keys[i] >> 3; ++c) mask |= 1u << (keys[c] & 7u);
        parent_keys[parent[i]] = keys[i] >> 3;
        masks.store(parent[i], mask);
    }
};

// The blocks of all levels, one level after the other.
struct octree_blocks {
    int num_levels = 0;
    std::uint64_t begin[octree_view::max_levels + 1]{};    // the first block of a level, and of all the number
    const std::uint64_t* masks[octree_view::max_levels]{}; // of a level, as octree_level_view's
    std::uint64_t num_words[octree_view::max_levels]{};    // of masks

    [[nodiscard]] VOXELPIPE_HD int level_of(std::uint64_t block) const {
        int l = 0;
        while (block >= begin[l + 1]) ++l;
        return l;
    }
    // Calls f(w, children before word w of the block) for the words that a level has; returns the block's children.
    template <class F>
    VOXELPIPE_HD unsigned for_each_word(int l, std::uint64_t block, const F& f) const {
        const std::uint64_t first = (block - begin[l]) * 8;
        unsigned children = 0;
        for (unsigned w = 0; w < 8 && first + w < num_words[l]; ++w) {
            f(w, children);
            children += count_ones(masks[l][first + w]);
        }
        return children;
    }
};
// Children of the nodes of each block; the last count is 0.
struct count_children {
    octree_blocks blocks;
    std::uint32_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        counts[i] = i == blocks.begin[blocks.num_levels]
                        ? 0
                        : blocks.for_each_word(blocks.level_of(i), i, [](unsigned, unsigned) {});
    }
};
// The blocks, from sums over those of all levels.
struct make_blocks {
    octree_blocks blocks;
    const std::uint64_t* sums;
    std::uint64_t below[octree_view::max_levels]; // children of all lower levels
    octree_block* to;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const int l = blocks.level_of(i);
        octree_block block;
        block.before = sums[i] - below[l];
        blocks.for_each_word(l, i, [&block](unsigned w, unsigned children) {
            if (w != 0) block.set_part(w, children);
        });
        to[i] = block;
    }
};

} // namespace voxelpipe::core
