// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree over a sparse framebuffer, on the host (backend_octree.hpp: on a GPU): nodes of 2, 4, 8 ... voxels a side,
// in the Morton order of their places, so that the nodes below a node are a stretch of each level; values for every
// level by a reducer (reducers.hpp); and a ray through it. A node exists if a voxel below it does: the levels are the
// OR of the finest, not what a voxelization at half the resolution gives, which snaps otherwise.

#include <voxelpipe/core/octree_view.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>
#include <voxelpipe/sparse/passes/octree_nodes.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

template <class Backend>
class backend_octree;

namespace core {

// Levels of an octree whose root holds a grid.
[[nodiscard]] inline int octree_depth(const glm::ivec3& whole_extent) {
    const int side = std::max({whole_extent.x, whole_extent.y, whole_extent.z});
    return std::max(log2_sparse_brick,
                    side <= 1 ? 0 : static_cast<int>(std::bit_width(static_cast<unsigned>(side - 1))));
}

} // namespace core

// Owns its nodes: a byte each, 16 more for 64 nodes, and 16 for a tile. Level l of 1 .. num_levels() has nodes of 2^l
// voxels a side, the last one the root alone; level 0 are the voxels. Places count in the whole grid. A tile is one
// node without children, and nothing below it is there.
class octree {
public:
    octree() = default;
    // Up to the least root that holds the whole grid; no level where no voxel exists.
    explicit octree(const brick_table& table, const glm::ivec3& whole_extent) { build(table, whole_extent); }
    template <class... Targets>
    explicit octree(const host_sparse<Targets...>& h) : octree(h.table(), h.where.whole_extent()) {}

    // Levels above the voxels; 0 if there are none.
    [[nodiscard]] int num_levels() const { return static_cast<int>(levels_.size()); }
    // A level, from 0 on. Level 0 counts values: the voxels in bricks, and the tiles, whose ranks follow.
    [[nodiscard]] std::uint64_t num_nodes(int level) const {
        return level == 0 ? num_values_ : levels_[static_cast<std::size_t>(level) - 1].count;
    }
    // Bytes that the nodes take.
    [[nodiscard]] std::uint64_t num_bytes() const {
        std::uint64_t bytes = 0;
        for (const nodes& l : levels_)
            bytes += l.masks.size() * sizeof(std::uint64_t) + l.blocks.size() * sizeof(octree_block) +
                     l.tiles.size() * sizeof(octree_tile);
        return bytes;
    }
    // The nodes of a level, 1 to num_levels(). Refers to the octree.
    [[nodiscard]] octree_level_view level(int level) const {
        const nodes& l = levels_[static_cast<std::size_t>(level) - 1];
        return {l.masks.data(), l.blocks.data(), l.tiles.data(), l.tiles.size()};
    }
    // Refers to the octree.
    [[nodiscard]] octree_view view() const {
        octree_view v;
        v.num_levels = num_levels();
        for (int l = 1; l <= v.num_levels; ++l) v.levels[l - 1] = level(l);
        return v;
    }
    // See octree_view.
    [[nodiscard]] voxel_hit first_hit(const glm::dvec3& origin, const glm::dvec3& direction,
                                      double limit = 1e300) const {
        return view().first_hit(origin, direction, limit);
    }

    // Calls f(glm::ivec3 place, n) for every node of a level, in order; the node's first voxel is place << level. Not
    // for what lies in tiles above that level.
    template <class F>
    void for_each_node(int level, F&& f) const {
        if (num_levels() != 0) visit(num_levels(), 0, 0, level, f);
    }

    // True if two have the same nodes.
    friend bool operator==(const octree&, const octree&) = default;

private:
    template <class Backend>
    friend class backend_octree;

    struct nodes { // as octree_level_view
        std::vector<std::uint64_t> masks;
        std::vector<octree_block> blocks;
        std::vector<octree_tile> tiles;
        std::uint64_t count = 0, num_children = 0; // of nodes, and of their children

        void add(unsigned mask) {
            if (count % 64 == 0)
                blocks.push_back({num_children, 0});
            else if (count % 8 == 0)
                blocks.back().set_part(static_cast<unsigned>(count / 8 % 8), num_children - blocks.back().before);
            if (count % 8 == 0) masks.push_back(0);
            masks.back() |= std::uint64_t{mask} << (count++ % 8 * 8);
            num_children += static_cast<unsigned>(std::popcount(mask));
        }
        void add_tile(std::uint64_t rank) {
            tiles.push_back({count, rank});
            add(0);
        }
        friend bool operator==(const nodes&, const nodes&) = default;
    };

    template <class F>
    void visit(int at, std::uint64_t n, std::uint64_t key, int level, F& f) const {
        if (at == level) {
            f(core::morton_position(key), n);
            return;
        }
        const octree_level_view nodes_of = this->level(at);
        std::uint64_t child = nodes_of.first_child(n);
        for (unsigned mask = nodes_of.mask(n); mask != 0; mask &= mask - 1)
            visit(at - 1, child++, key << 3 | static_cast<unsigned>(std::countr_zero(mask)), level, f);
    }

    void build(const brick_table& table, const glm::ivec3& whole_extent) {
        num_values_ = table.num_values();
        if (num_values_ == 0) return;
        levels_.resize(static_cast<std::size_t>(core::octree_depth(whole_extent)));
        std::vector<std::uint64_t> keys, above; // of the nodes of a level
        // A brick is a node of level 3. Its mask has a word for each child and a byte for each grandchild.
        const auto add_brick = [&](std::uint64_t b) {
            unsigned words = 0;
            for (unsigned w = 0; w < 8; ++w) {
                const std::uint64_t word = table.masks[b].words[w];
                if (word == 0) continue;
                words |= 1u << w;
                unsigned bytes = 0;
                for (unsigned i = 0; i < 8; ++i) {
                    const unsigned byte = static_cast<unsigned>(word >> (8 * i)) & 255u;
                    if (byte == 0) continue;
                    bytes |= 1u << i;
                    levels_[0].add(byte);
                }
                levels_[1].add(bytes);
            }
            levels_[2].add(words);
            keys.push_back(table.keys[b]);
        };
        for_each_brick_and_tile(table, add_brick, [&](std::uint64_t t) {
            if (table.tiles[t].level() != 0) return;
            levels_[2].add_tile(table.num_in_bricks() + t);
            keys.push_back(table.tiles[t].first());
        });
        for (int l = 3; l < num_levels(); ++l) {
            nodes& level = levels_[static_cast<std::size_t>(l)];
            above.clear();
            std::uint64_t t = 0;
            // The level's tiles before a key.
            const auto add_tiles = [&](std::uint64_t key) {
                for (; t < table.num_tiles && table.tiles[t].first() >> (3 * (l - 2)) < key; ++t) {
                    if (table.tiles[t].level() != l - 2) continue;
                    above.push_back(table.tiles[t].first() >> (3 * (l - 2)));
                    level.add_tile(table.num_in_bricks() + t);
                }
            };
            for (std::uint64_t i = 0; i < keys.size();) {
                const std::uint64_t parent = keys[i] >> 3;
                unsigned mask = 0;
                for (; i < keys.size() && keys[i] >> 3 == parent; ++i) mask |= 1u << (keys[i] & 7u);
                add_tiles(parent);
                above.push_back(parent);
                level.add(mask);
            }
            add_tiles(~std::uint64_t{0});
            keys.swap(above);
        }
    }

    std::vector<nodes> levels_;
    std::uint64_t num_values_ = 0;
};

// The values of a target on every level of an octree: at(level)[node], levels from 1 on.
template <class T>
class octree_levels {
public:
    // Values of a level's nodes, 1 to num_levels().
    [[nodiscard]] std::span<const T> at(int level) const { return levels_[static_cast<std::size_t>(level) - 1]; }
    [[nodiscard]] int num_levels() const { return static_cast<int>(levels_.size()); } // As the octree's.
    std::vector<T>& add() { return levels_.emplace_back(); } // A level more, empty, to be filled.

private:
    std::vector<std::vector<T>> levels_;
};

// The values of target I on every level. `tree` is of `host`. Sums and means are exact and rounded once a node; the
// others fold the up to 8 children of each node, in Morton order, level by level. Values that do not exist do not
// count. The results have the target's type, bits as 0 and 1 in bytes; sums of integers are 64-bit, means of integers
// doubles.
template <std::size_t I, class Reducer, class... Targets>
[[nodiscard]] auto reduce_levels(const octree& tree, const host_sparse<Targets...>& host, const Reducer& reducer) {
    if (host.num_values() != tree.num_nodes(0) || !get<I>(host).enabled())
        throw std::invalid_argument(
            "voxelpipe::reduce_levels: the octree is of other voxels, or the target is disabled");
    if constexpr (core::sums_terms<Reducer>) {
        static_cast<void>(reducer);
        using sum_nodes = core::sum_octree_nodes<I, Reducer, Targets...>;
        const auto voxels = sum_nodes::terms::of(host);
        octree_levels<typename sum_nodes::terms::result> levels;
        std::vector<typename sum_nodes::node> below, here;
        for (int l = 1; l <= tree.num_levels(); ++l) {
            auto& values = levels.add();
            values.resize(tree.num_nodes(l));
            here.resize(values.size());
            const sum_nodes sum{voxels, l, tree.level(l), below.data(), here.data(), values.data()};
            for (std::uint64_t i = 0; i < values.size(); ++i) sum(i);
            below.swap(here);
        }
        return levels;
    } else {
        using fold_nodes = core::fold_octree_nodes<Reducer, typename core::pack_element<I, Targets...>::type>;
        octree_levels<typename fold_nodes::value> levels;
        for (int l = 1; l <= tree.num_levels(); ++l) {
            auto& values = levels.add();
            values.resize(tree.num_nodes(l));
            const fold_nodes fold{
                reducer,      get<I>(host.values).data(), l, tree.level(l), l == 1 ? nullptr : levels.at(l - 1).data(),
                values.data()};
            for (std::uint64_t i = 0; i < values.size(); ++i) fold(i);
        }
        return levels;
    }
}

} // namespace voxelpipe
