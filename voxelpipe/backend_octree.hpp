// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree over a sparse framebuffer in the memory of a backend, built there: the nodes, values and rays of
// octree.hpp, bit for bit. Its passes are functors for Backend::for_each, so that a program that does not use it
// compiles none.

#include <voxelpipe/core/morton_parents.hpp>
#include <voxelpipe/octree.hpp>
#include <voxelpipe/sparse.hpp>

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

// Levels 1 to 3, a call for each word of the bricks' masks: a node of level 2.
struct make_brick_nodes {
    brick_table table;
    const std::uint64_t *first_word, *first_byte; // of each brick
    std::uint8_t* masks[3];
    std::uint64_t* first[3];

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t b = i >> 3;
        const auto w = static_cast<unsigned>(i & 7u);
        const brick_mask& mask = table.masks[b];
        std::uint64_t node = first_word[b], leaf = first_byte[b], rank = table.offsets[b];
        unsigned words = 0;
        for (unsigned k = 0; k < 8; ++k) {
            const std::uint64_t word = mask.words[k];
            words |= (word != 0 ? 1u : 0u) << k;
            if (k >= w) continue;
            node += word != 0 ? 1 : 0;
            leaf += count_ones(bytes_in_use(word));
            rank += count_ones(word);
        }
        if (w == 0) {
            masks[2][b] = static_cast<std::uint8_t>(words);
            first[2][b] = first_word[b];
        }
        const std::uint64_t word = mask.words[w];
        if (word == 0) return;
        masks[1][node] = static_cast<std::uint8_t>(bytes_in_use(word));
        first[1][node] = leaf;
        for (unsigned k = 0; k < 8; ++k) {
            const auto byte = static_cast<std::uint8_t>(word >> (8 * k));
            if (byte == 0) continue;
            masks[0][leaf] = byte;
            first[0][leaf++] = rank;
            rank += count_ones(byte);
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
// A level's nodes, as arrays that someone owns.
struct octree_level {
    std::uint64_t* keys;
    std::uint8_t* masks;
    std::uint64_t* first;
};
struct const_octree_level {
    const std::uint64_t* keys;
    const std::uint8_t* masks;
    const std::uint64_t* first;
};
// The tiles of a level as nodes.
struct list_tiles {
    brick_table table;
    int level;
    std::uint64_t first_rank;   // of tiles
    const std::uint64_t* place; // of each tile among those of the level
    octree_level to;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (table.tiles[i].level() != level) return;
        to.keys[place[i]] = table.tiles[i].first() >> (3 * level);
        to.masks[place[i]] = 0;
        to.first[place[i]] = first_rank + i;
    }
};
// Two lists of a level's nodes, each by its keys, into one.
struct merge_nodes {
    const_octree_level one, other;
    std::uint64_t num_one, num_other;
    octree_level to;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const bool is_one = i < num_one;
        const const_octree_level& from = is_one ? one : other;
        const std::uint64_t n = is_one ? i : i - num_one, key = from.keys[n];
        const std::uint64_t* const keys = is_one ? other.keys : one.keys;
        std::uint64_t first = 0, last = is_one ? num_other : num_one; // no key is in both
        while (first < last) {
            const std::uint64_t middle = first + (last - first) / 2;
            if (keys[middle] < key)
                first = middle + 1;
            else
                last = middle;
        }
        to.keys[n + first] = key;
        to.masks[n + first] = from.masks[n];
        to.first[n + first] = from.first[n];
    }
};
// The parents, each by its first child.
struct make_parents {
    const std::uint64_t* keys;
    std::uint64_t count;
    const std::uint32_t* is_first;
    const std::uint64_t* parent;
    std::uint64_t* parent_keys;
    std::uint8_t* masks;
    std::uint64_t* first;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (is_first[i] == 0) return;
        unsigned mask = 0;
        for (std::uint64_t c = i; c < count && keys[c] >> 3 == keys[i] >> 3; ++c) mask |= 1u << (keys[c] & 7u);
        parent_keys[parent[i]] = keys[i] >> 3;
        masks[parent[i]] = static_cast<std::uint8_t>(mask);
        first[parent[i]] = i;
    }
};

} // namespace core

// Owns its nodes, 9 bytes each, in memory of Backend. Levels as octree's.
template <class Backend>
class backend_octree {
public:
    // Memory of the backend.
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    // Of bricks and tiles in memory of the backend, up to the least root that holds the whole grid; no level where no
    // voxel exists. Fewer than 2^32 - 1 bricks; throws std::length_error otherwise, and what a buffer throws. Waits
    // once a level.
    backend_octree(Backend& backend, const brick_table& table, const glm::ivec3& whole_extent) {
        if (table.count >= max_bricks) throw std::length_error("voxelpipe: an octree takes fewer than 2^32 - 1 bricks");
        if (table.count != 0 || table.num_tiles != 0) build(backend, table, whole_extent);
    }
    // Of what the framebuffer holds now.
    template <class... Targets>
    backend_octree(Backend& backend, const sparse_framebuffer<Backend, Targets...>& fb)
        : backend_octree(backend, fb.view().table, fb.where().whole_extent()) {}

    // Levels above the voxels; 0 if there are none.
    [[nodiscard]] int num_levels() const { return static_cast<int>(masks_.size()); }
    // A level, from 0 on; level 0 as octree's.
    [[nodiscard]] std::uint64_t num_nodes(int level) const {
        return level == 0 ? num_values_ : masks_[static_cast<std::size_t>(level) - 1].size();
    }
    // Bytes that the nodes take.
    [[nodiscard]] std::uint64_t num_bytes() const {
        std::uint64_t count = 0;
        for (const auto& m : masks_) count += m.size();
        return count * (sizeof(std::uint8_t) + sizeof(std::uint64_t));
    }
    // As octree's, in memory of the backend.
    [[nodiscard]] const buffer<std::uint8_t>& masks(int level) const {
        return masks_[static_cast<std::size_t>(level) - 1];
    }
    // As octree's, in memory of the backend.
    [[nodiscard]] const buffer<std::uint64_t>& first(int level) const {
        return first_[static_cast<std::size_t>(level) - 1];
    }
    // Refers to the octree; for code that runs on the backend, rays among it.
    [[nodiscard]] octree_view view() const {
        octree_view v;
        v.num_levels = num_levels();
        for (std::size_t l = 0; l < masks_.size(); ++l) {
            v.masks[l] = masks_[l].data();
            v.first[l] = first_[l].data();
        }
        return v;
    }
    // Copies everything, then waits.
    [[nodiscard]] octree to_host(Backend& backend) const {
        octree tree;
        tree.num_values_ = num_values_;
        for (std::size_t l = 0; l < masks_.size(); ++l)
            tree.levels_.push_back({masks_[l].to_host(backend), first_[l].to_host(backend)});
        return tree;
    }

private:
    static constexpr std::uint64_t max_bricks = 0xffffffffu;

    void add_level(Backend& backend, std::uint64_t nodes) {
        masks_.emplace_back(backend, static_cast<std::size_t>(nodes));
        first_.emplace_back(backend, static_cast<std::size_t>(nodes));
    }
    // Nodes of a level with their keys.
    struct keyed_nodes {
        buffer<std::uint64_t> keys;
        buffer<std::uint8_t> masks;
        buffer<std::uint64_t> first;

        keyed_nodes(Backend& backend, std::uint64_t n)
            : keys(backend, static_cast<std::size_t>(n)), masks(backend, static_cast<std::size_t>(n)),
              first(backend, static_cast<std::size_t>(n)) {}
        [[nodiscard]] core::octree_level arrays() { return {keys.data(), masks.data(), first.data()}; }
    };
    // Makes the last level that level's nodes and the tiles of as many bricks a side; `keys` are those of the level.
    void merge_tiles(Backend& backend, const brick_table& table, int log2_bricks, const std::uint64_t*& keys,
                     buffer<std::uint64_t>& kept_keys, std::uint64_t& count) {
        if (table.num_tiles == 0) return;
        const auto all = static_cast<std::size_t>(table.num_tiles);
        buffer<std::uint32_t> is_of_level(backend, all + 1);
        buffer<std::uint64_t> place(backend, all + 1);
        backend.for_each(all + 1, core::count_tiles{table, log2_bricks, is_of_level.data()});
        const std::uint64_t tiles = backend.sum(is_of_level, place);
        if (tiles == 0) return;
        keyed_nodes of_tiles(backend, tiles), merged(backend, count + tiles);
        backend.for_each(
            all, core::list_tiles{table, log2_bricks, num_values_ - table.num_tiles, place.data(), of_tiles.arrays()});
        backend.for_each(count + tiles,
                         core::merge_nodes{{keys, masks_.back().data(), first_.back().data()},
                                           {of_tiles.keys.data(), of_tiles.masks.data(), of_tiles.first.data()},
                                           count,
                                           tiles,
                                           merged.arrays()});
        masks_.back() = std::move(merged.masks);
        first_.back() = std::move(merged.first);
        kept_keys = std::move(merged.keys);
        keys = kept_keys.data();
        count += tiles;
    }
    void build(Backend& backend, const brick_table& table, const glm::ivec3& whole_extent) {
        const auto bricks = static_cast<std::size_t>(table.count);
        num_values_ = table.num_tiles;
        if (bricks != 0) num_values_ += backend.read(backend_view<const std::uint64_t>{table.offsets + bricks, 1})[0];
        buffer<std::uint32_t> counts(backend, bricks + 1);
        {
            buffer<std::uint32_t> words(backend, bricks + 1);
            buffer<std::uint64_t> first_word(backend, bricks + 1), first_byte(backend, bricks + 1);
            backend.for_each(bricks + 1, core::count_brick_nodes{table, words.data(), counts.data()});
            add_level(backend, backend.sum(counts, first_byte));
            add_level(backend, backend.sum(words, first_word));
            add_level(backend, bricks);
            backend.for_each(table.count * 8,
                             core::make_brick_nodes{table,
                                                    first_word.data(),
                                                    first_byte.data(),
                                                    {masks_[0].data(), masks_[1].data(), masks_[2].data()},
                                                    {first_[0].data(), first_[1].data(), first_[2].data()}});
        }
        buffer<std::uint64_t> below(backend, std::size_t{0});
        const std::uint64_t* keys = table.keys;
        std::uint64_t count = bricks;
        merge_tiles(backend, table, 0, keys, below, count);
        for (int l = 4; l <= core::octree_depth(whole_extent); ++l) {
            const auto n = static_cast<std::size_t>(count);
            if (counts.size() != n + 1) counts = buffer<std::uint32_t>(backend, n + 1);
            buffer<std::uint64_t> parent(backend, n + 1);
            backend.for_each(n + 1, core::count_parents{keys, count, counts.data()});
            const std::uint64_t parents = backend.sum(counts, parent);
            buffer<std::uint64_t> above(backend, static_cast<std::size_t>(parents));
            add_level(backend, parents);
            backend.for_each(count, core::make_parents{keys, count, counts.data(), parent.data(), above.data(),
                                                       masks_.back().data(), first_.back().data()});
            below = std::move(above);
            keys = below.data();
            count = parents;
            merge_tiles(backend, table, l - 3, keys, below, count);
        }
    }

    std::vector<buffer<std::uint8_t>> masks_;
    std::vector<buffer<std::uint64_t>> first_;
    std::uint64_t num_values_ = 0;
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
            backend.for_each(values.size(), sum_nodes{voxels, l, tree.masks(l).data(), tree.first(l).data(),
                                                      below.data(), here.data(), values.data()});
            below = std::move(here);
        }
        return levels;
    } else {
        using fold_nodes = core::fold_octree_nodes<Reducer, typename core::pack_element<I, Targets...>::type>;
        backend_octree_levels<Backend, typename fold_nodes::value> levels;
        for (int l = 1; l <= tree.num_levels(); ++l) {
            auto& values = levels.add(backend, tree.num_nodes(l));
            backend.for_each(values.size(), fold_nodes{reducer, get<I>(arrays.values).data(), l, tree.masks(l).data(),
                                                       tree.first(l).data(), l == 1 ? nullptr : levels.at(l - 1).data(),
                                                       values.data()});
        }
        return levels;
    }
}

} // namespace voxelpipe
