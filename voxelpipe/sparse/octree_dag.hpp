// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// An octree of which equal subtrees are stored once: a directed acyclic graph, geometry only. Built from the leaves up:
// nodes of a level with the same mask and the same children become one.

#include <voxelpipe/core/octree_dag_view.hpp>
#include <voxelpipe/sparse/octree.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace voxelpipe {

template <class Backend>
class backend_octree_dag;

namespace core {

// The nodes of a level of a graph on the host, as octree_dag_view has them.
struct dag_nodes {
    std::vector<std::uint8_t> masks;
    std::vector<std::uint32_t> first, children;
    friend bool operator==(const dag_nodes&, const dag_nodes&) = default;
};

// The levels of a graph, wherever they are. Nodes has arrays as dag_nodes.
template <class Nodes>
class dag_levels {
public:
    [[nodiscard]] int num_levels() const { return static_cast<int>(levels_.size()); } // As the octree's.
    // A level, from 1 on; the last one has the root.
    [[nodiscard]] std::uint64_t num_nodes(int level) const {
        return levels_[static_cast<std::size_t>(level) - 1].masks.size();
    }
    // A byte a node, and four for each child and for the place of a node's children; level 1 has neither.
    [[nodiscard]] std::uint64_t num_bytes() const {
        std::uint64_t bytes = 0;
        for (const Nodes& l : levels_)
            bytes += l.masks.size() + (l.first.size() + l.children.size()) * sizeof(std::uint32_t);
        return bytes;
    }
    // Refers to the graph; for code that runs where it lies.
    [[nodiscard]] octree_dag_view view() const {
        octree_dag_view v;
        v.num_levels = num_levels();
        for (std::size_t l = 0; l < levels_.size(); ++l) {
            v.masks[l] = levels_[l].masks.data();
            v.first[l] = levels_[l].first.data();
            v.children[l] = levels_[l].children.data();
        }
        return v;
    }
    friend bool operator==(const dag_levels&, const dag_levels&) = default;

protected:
    std::vector<Nodes> levels_;
};

} // namespace core

// An octree whose equal parts are there once: a directed acyclic graph. On the host; owns its nodes.
class octree_dag : public core::dag_levels<core::dag_nodes> {
public:
    octree_dag() = default;
    // Merges equal nodes, from the voxels up.
    explicit octree_dag(const octree& tree) {
        std::vector<std::uint32_t> below; // what each node of the level below has become
        for (int l = 1; l <= tree.num_levels(); ++l) below = add_level(tree, l, below);
    }

    // True if a voxel exists, in the numbers of the whole grid; false outside.
    [[nodiscard]] bool contains(const glm::ivec3& voxel) const { return view().contains(voxel); }
    // True if two have the same nodes in the same order.
    friend bool operator==(const octree_dag&, const octree_dag&) = default;

private:
    template <class Backend>
    friend class backend_octree_dag;

    using node = std::array<std::uint32_t, 9>; // the mask, and the children from the first on

    std::vector<std::uint32_t> add_level(const octree& tree, int l, const std::vector<std::uint32_t>& below) {
        const octree_level_view of_tree = tree.level(l);
        std::vector<node> nodes(static_cast<std::size_t>(tree.num_nodes(l)), node{});
        std::size_t child = 0;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            nodes[i][0] = of_tree.mask(i);
            if (l == 1) continue;
            const auto children = static_cast<unsigned>(std::popcount(nodes[i][0]));
            for (unsigned c = 1; c <= children; ++c) nodes[i][c] = below[child++];
        }
        std::vector<std::uint32_t> order(nodes.size()), number(nodes.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return nodes[a] < nodes[b]; });
        core::dag_nodes& out = levels_.emplace_back();
        for (std::size_t i = 0; i < order.size(); ++i) {
            const node& here = nodes[order[i]];
            if (i == 0 || here != nodes[order[i - 1]]) {
                out.masks.push_back(static_cast<std::uint8_t>(here[0]));
                if (l != 1) {
                    out.first.push_back(static_cast<std::uint32_t>(out.children.size()));
                    const auto children = static_cast<std::ptrdiff_t>(std::popcount(here[0]));
                    out.children.insert(out.children.end(), here.begin() + 1, here.begin() + 1 + children);
                }
            }
            number[order[i]] = static_cast<std::uint32_t>(out.masks.size() - 1);
        }
        return number;
    }
};

} // namespace voxelpipe
