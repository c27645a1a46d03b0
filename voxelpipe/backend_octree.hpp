// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree over a sparse framebuffer in the memory of a backend, built there: the nodes, values and rays of
// octree.hpp, bit for bit. Its passes are functors for Backend::for_each, so that a program that does not use it
// compiles none.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/morton_parents.hpp>
#include <voxelpipe/octree.hpp>
#include <voxelpipe/sparse.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace core {

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

    // Of node n. With that of the last node, the rest of its word becomes 0.
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

} // namespace core

// Owns its nodes in memory of Backend, in as many bytes as octree's. Levels as octree's.
template <class Backend>
class backend_octree {
public:
    // Memory of the backend.
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    // Of bricks and tiles in memory of the backend, up to the least root that holds the whole grid; no level where no
    // voxel exists. Fewer than 2^32 - 1 bricks; throws std::length_error otherwise, and what a buffer throws. Waits
    // once a level, and once.
    backend_octree(Backend& backend, const brick_table& table, const glm::ivec3& whole_extent)
        : blocks_(backend, std::size_t{0}) {
        if (table.count >= max_bricks) throw std::length_error("voxelpipe: an octree takes fewer than 2^32 - 1 bricks");
        if (table.count != 0 || table.num_tiles != 0) build(backend, table, whole_extent);
    }
    // Of what the framebuffer holds now.
    template <class... Targets>
    backend_octree(Backend& backend, const sparse_framebuffer<Backend, Targets...>& fb)
        : backend_octree(backend, fb.view().table, fb.where().whole_extent()) {}

    // Levels above the voxels; 0 if there are none.
    [[nodiscard]] int num_levels() const { return static_cast<int>(levels_.size()); }
    // A level, from 0 on; level 0 as octree's.
    [[nodiscard]] std::uint64_t num_nodes(int level) const {
        return level == 0 ? num_values_ : levels_[static_cast<std::size_t>(level) - 1].count;
    }
    // Bytes that the nodes take.
    [[nodiscard]] std::uint64_t num_bytes() const {
        std::uint64_t bytes = 0;
        for (const nodes& l : levels_)
            bytes += l.masks.size() * sizeof(std::uint64_t) + l.tiles.size() * sizeof(octree_tile);
        return bytes + blocks_.size() * sizeof(octree_block);
    }
    // The nodes of a level, 1 to num_levels(). Refers to the octree; for code that runs on the backend.
    [[nodiscard]] octree_level_view level(int level) const {
        const nodes& l = levels_[static_cast<std::size_t>(level) - 1];
        return {l.masks.data(), blocks_.data() + l.first_block, l.tiles.data(), l.tiles.size()};
    }
    // Refers to the octree; for code that runs on the backend, rays among it.
    [[nodiscard]] octree_view view() const {
        octree_view v;
        v.num_levels = num_levels();
        for (int l = 1; l <= v.num_levels; ++l) v.levels[l - 1] = level(l);
        return v;
    }
    // Copies everything, then waits.
    [[nodiscard]] octree to_host(Backend& backend) const {
        octree tree;
        tree.num_values_ = num_values_;
        const std::vector<octree_block> blocks = blocks_.to_host(backend);
        for (std::size_t l = 0; l < levels_.size(); ++l) {
            const nodes& from = levels_[l];
            const auto first = blocks.begin() + static_cast<std::ptrdiff_t>(from.first_block);
            const auto count = static_cast<std::ptrdiff_t>(octree_level_view::num_blocks(from.count));
            tree.levels_.push_back({from.masks.to_host(backend),
                                    {first, first + count},
                                    from.tiles.to_host(backend),
                                    from.count,
                                    num_children(l)});
        }
        return tree;
    }

private:
    static constexpr std::uint64_t max_bricks = 0xffffffffu;

    struct nodes { // as octree_level_view
        buffer<std::uint64_t> masks;
        buffer<octree_tile> tiles;
        std::uint64_t count = 0;
        std::uint64_t first_block = 0; // in blocks_

        nodes(Backend& backend, std::uint64_t n)
            : masks(backend, static_cast<std::size_t>(octree_level_view::num_words(n))), tiles(backend, std::size_t{0}),
              count(n) {}
        [[nodiscard]] core::mask_bytes bytes() { return {masks.data(), count}; }
    };

    // Of all nodes of levels_[l].
    [[nodiscard]] std::uint64_t num_children(std::size_t l) const {
        return l == 0 ? num_in_bricks_ : levels_[l - 1].count;
    }
    // Adds to the last level the tiles of as many bricks a side; `keys` are those of the level.
    void merge_tiles(Backend& backend, const brick_table& table, int log2_bricks, const std::uint64_t*& keys,
                     buffer<std::uint64_t>& kept_keys) {
        if (table.num_tiles == 0) return;
        const auto all = static_cast<std::size_t>(table.num_tiles);
        buffer<std::uint32_t> is_of_level(backend, all + 1);
        buffer<std::uint64_t> place(backend, all + 1);
        backend.for_each(all + 1, core::count_tiles{table, log2_bricks, is_of_level.data()});
        const auto tiles = static_cast<std::size_t>(backend.sum(is_of_level, place));
        if (tiles == 0) return;
        nodes& level = levels_.back();
        nodes merged(backend, level.count + tiles);
        merged.tiles = buffer<octree_tile>(backend, tiles);
        buffer<std::uint64_t> tile_keys(backend, tiles), all_keys(backend, static_cast<std::size_t>(merged.count));
        backend.for_each(all, core::list_tiles{table, log2_bricks, num_in_bricks_, place.data(), tile_keys.data(),
                                               merged.tiles.data()});
        backend.for_each(merged.count,
                         core::merge_nodes{keys, reinterpret_cast<const std::uint8_t*>(level.masks.data()), level.count,
                                           tile_keys.data(), tiles, all_keys.data(), merged.bytes(),
                                           merged.tiles.data()});
        level = std::move(merged);
        kept_keys = std::move(all_keys);
        keys = kept_keys.data();
    }
    void build(Backend& backend, const brick_table& table, const glm::ivec3& whole_extent) {
        const auto bricks = static_cast<std::size_t>(table.count);
        if (bricks != 0) num_in_bricks_ = backend.read(backend_view<const std::uint64_t>{table.offsets + bricks, 1})[0];
        num_values_ = num_in_bricks_ + table.num_tiles;
        buffer<std::uint32_t> counts(backend, bricks + 1);
        {
            buffer<std::uint32_t> words(backend, bricks + 1);
            buffer<std::uint64_t> first_word(backend, bricks + 1), first_byte(backend, bricks + 1);
            backend.for_each(bricks + 1, core::count_brick_nodes{table, words.data(), counts.data()});
            levels_.emplace_back(backend, backend.sum(counts, first_byte));
            levels_.emplace_back(backend, backend.sum(words, first_word));
            levels_.emplace_back(backend, table.count);
            backend.for_each(table.count * 8,
                             core::make_brick_nodes{table,
                                                    first_word.data(),
                                                    first_byte.data(),
                                                    {levels_[0].bytes(), levels_[1].bytes(), levels_[2].bytes()}});
        }
        buffer<std::uint64_t> below(backend, std::size_t{0});
        const std::uint64_t* keys = table.keys;
        merge_tiles(backend, table, 0, keys, below);
        for (int l = 4; l <= core::octree_depth(whole_extent); ++l) {
            const std::uint64_t count = levels_.back().count;
            const auto n = static_cast<std::size_t>(count);
            if (counts.size() != n + 1) counts = buffer<std::uint32_t>(backend, n + 1);
            buffer<std::uint64_t> parent(backend, n + 1);
            backend.for_each(n + 1, core::count_parents{keys, count, counts.data()});
            const std::uint64_t parents = backend.sum(counts, parent);
            buffer<std::uint64_t> above(backend, static_cast<std::size_t>(parents));
            nodes& level = levels_.emplace_back(backend, parents);
            backend.for_each(
                count, core::make_parents{keys, count, counts.data(), parent.data(), above.data(), level.bytes()});
            below = std::move(above);
            keys = below.data();
            merge_tiles(backend, table, l - 3, keys, below);
        }
        make_blocks(backend);
    }
    void make_blocks(Backend& backend) {
        core::octree_blocks of;
        core::make_blocks make{};
        for (std::size_t l = 0; l < levels_.size(); ++l) {
            levels_[l].first_block = of.begin[l];
            of.begin[l + 1] = of.begin[l] + octree_level_view::num_blocks(levels_[l].count);
            of.masks[l] = levels_[l].masks.data();
            of.num_words[l] = levels_[l].masks.size();
            make.below[l] = l == 0 ? 0 : make.below[l - 1] + num_children(l - 1);
        }
        of.num_levels = num_levels();
        const auto all = static_cast<std::size_t>(of.begin[levels_.size()]);
        buffer<std::uint32_t> counts(backend, all + 1);
        buffer<std::uint64_t> sums(backend, all + 1);
        backend.for_each(all + 1, core::count_children{of, counts.data()});
        backend.sum(counts, sums);
        blocks_ = buffer<octree_block>(backend, all);
        make.blocks = of;
        make.sums = sums.data();
        make.to = blocks_.data();
        backend.for_each(all, make);
    }

    std::vector<nodes> levels_;
    buffer<octree_block> blocks_; // of all levels, one after the other
    std::uint64_t num_values_ = 0, num_in_bricks_ = 0;
};
template <class Backend, class... Targets>
backend_octree(Backend&, const sparse_framebuffer<Backend, Targets...>&) -> backend_octree<Backend>;

// The values of a target on every level, in memory of Backend: at(level), levels from 1 on.
template <class Backend, class T>
class backend_octree_levels {
public:
    using values_type = typename Backend::template buffer<T>; // of a level

    // Values of a level's nodes, 1 to num_levels().
    [[nodiscard]] const values_type& at(int level) const { return levels_[static_cast<std::size_t>(level) - 1]; }
    [[nodiscard]] int num_levels() const { return static_cast<int>(levels_.size()); } // As the octree's.
    // A level more, its values unset.
    values_type& add(Backend& backend, std::uint64_t nodes) {
        return levels_.emplace_back(backend, static_cast<std::size_t>(nodes));
    }

private:
    std::vector<values_type> levels_;
};

// As reduce_levels of the host, on the backend, of the voxels that `fb` holds; `tree` is of `fb`. A functor of the
// caller runs there. Throws what a buffer throws.
template <std::size_t I, class Reducer, class Backend, class... Targets>
[[nodiscard]] auto reduce_levels(Backend& backend, const backend_octree<Backend>& tree,
                                 const sparse_framebuffer<Backend, Targets...>& fb, const Reducer& reducer) {
    const auto& arrays = fb.contents();
    if (fb.num_values() != tree.num_nodes(0) || (fb.num_values() != 0 && get<I>(arrays.values).size() == 0))
        throw std::invalid_argument(
            "voxelpipe::reduce_levels: the octree is of other voxels, or the target is disabled");
    if constexpr (core::sums_terms<Reducer>) {
        static_cast<void>(reducer);
        using sum_nodes = core::sum_octree_nodes<I, Reducer, Targets...>;
        using node = typename sum_nodes::node;
        const auto voxels = sum_nodes::terms::of(arrays);
        backend_octree_levels<Backend, typename sum_nodes::terms::result> levels;
        typename Backend::template buffer<node> below(backend, std::size_t{0});
        for (int l = 1; l <= tree.num_levels(); ++l) {
            auto& values = levels.add(backend, tree.num_nodes(l));
            typename Backend::template buffer<node> here(backend, values.size());
            backend.for_each(values.size(),
                             sum_nodes{voxels, l, tree.level(l), below.data(), here.data(), values.data()});
            below = std::move(here);
        }
        return levels;
    } else {
        using fold_nodes = core::fold_octree_nodes<Reducer, typename core::pack_element<I, Targets...>::type>;
        backend_octree_levels<Backend, typename fold_nodes::value> levels;
        for (int l = 1; l <= tree.num_levels(); ++l) {
            auto& values = levels.add(backend, tree.num_nodes(l));
            backend.for_each(values.size(), fold_nodes{reducer, get<I>(arrays.values).data(), l, tree.level(l),
                                                       l == 1 ? nullptr : levels.at(l - 1).data(), values.data()});
        }
        return levels;
    }
}

} // namespace voxelpipe
