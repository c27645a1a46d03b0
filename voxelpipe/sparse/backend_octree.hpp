// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree over a sparse framebuffer in the memory of a backend, built there: the nodes, values and rays of
// octree.hpp, bit for bit. Its passes (sparse/passes/octree_build.hpp) are functors for Backend::for_each, so that a
// program that does not use it compiles none.

#include <voxelpipe/core/morton_parents.hpp>
#include <voxelpipe/sparse/octree.hpp>
#include <voxelpipe/sparse/passes/octree_build.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe {

// Owns its nodes in memory of Backend, in as many bytes as octree's. Levels as octree's.
template <class Backend>
class backend_octree {
public:
    // Memory of the backend.
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    // Makes the octree of bricks and tiles in memory of the backend, up to the least root that holds the whole grid; no
    // level where no voxel exists. Fewer than 2^32 - 1 bricks; throws std::length_error otherwise, and what a buffer
    // throws. Waits once a level, and once.
    backend_octree(Backend& backend, const brick_table& table, const glm::ivec3& whole_extent)
        : blocks_(backend, std::size_t{0}) {
        if (table.count >= max_bricks) throw std::length_error("voxelpipe: an octree takes fewer than 2^32 - 1 bricks");
        if (table.count != 0 || table.num_tiles != 0) build(backend, table, whole_extent);
    }
    // Makes the octree of what the framebuffer holds now.
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

    // Number of children of all nodes of levels_[l].
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
