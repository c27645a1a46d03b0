// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The graph of an octree's different subtrees (octree_dag.hpp) in the memory of a backend, built there by sorts, with
// the same nodes in the same order. A level's nodes are numbered in the order of their masks, then of their children.

#include <voxelpipe/sparse/backend_octree.hpp>
#include <voxelpipe/sparse/octree_dag.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace core {

// The nodes of a level of an octree, each with what its children have become. As one number, the mask is on top and the
// children follow, the first one first, `width` bits each and 0 for a missing child.
struct dag_level {
    octree_level_view nodes;
    const std::uint32_t* below; // null on level 1
    int width;                  // 0 on level 1

    // Word w of the number of node n, the lowest one first.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t word(std::uint64_t n, int w) const {
        std::uint64_t bits = 0;
        const auto add = [&](std::uint64_t value, int at) {
            at -= 64 * w;
            if (at >= 0 && at < 64)
                bits |= value << at;
            else if (at < 0 && at > -64)
                bits |= value >> -at;
        };
        const unsigned mask = nodes.mask(n), children = width == 0 ? 0 : count_ones(mask);
        const std::uint64_t first = nodes.first_child(n);
        for (unsigned c = 0; c < children; ++c) add(below[first + c], (7 - static_cast<int>(c)) * width);
        add(mask, 8 * width);
        return bits;
    }
    [[nodiscard]] VOXELPIPE_HD bool are_equal(std::uint64_t a, std::uint64_t b) const {
        if (nodes.mask(a) != nodes.mask(b)) return false;
        const unsigned children = width == 0 ? 0 : count_ones(nodes.mask(a));
        const std::uint64_t first_a = nodes.first_child(a), first_b = nodes.first_child(b);
        for (unsigned c = 0; c < children; ++c)
            if (below[first_a + c] != below[first_b + c]) return false;
        return true;
    }
};

// The keys by which one sort of a level's nodes goes; the first one numbers the nodes too.
struct make_dag_keys {
    dag_level level;
    int word;
    std::uint64_t* keys;
    std::uint32_t* nodes;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (word == 0) nodes[i] = static_cast<std::uint32_t>(i);
        keys[i] = level.word(nodes[i], word);
    }
};
// 1 for the first of equal nodes; the last count is 0.
struct count_dag_nodes {
    dag_level level;
    std::uint64_t count;
    const std::uint32_t* nodes; // sorted
    std::uint32_t* is_first;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        is_first[i] = i < count && (i == 0 || !level.are_equal(nodes[i], nodes[i - 1])) ? 1 : 0;
    }
};
// What each node becomes; the masks, and the children's number, of those that stay.
struct number_dag_nodes {
    dag_level level;
    const std::uint32_t* nodes;
    const std::uint32_t* is_first;
    const std::uint64_t* before; // of them
    std::uint32_t* becomes;
    std::uint8_t* masks;
    std::uint32_t* children; // null on level 1
    std::uint32_t* source;   // null on level 1; a node of the octree that is like it

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const auto number = static_cast<std::uint32_t>(before[i] + is_first[i] - 1);
        becomes[nodes[i]] = number;
        if (is_first[i] == 0) return;
        masks[number] = static_cast<std::uint8_t>(level.nodes.mask(nodes[i]));
        if (children == nullptr) return;
        children[number] = count_ones(masks[number]);
        source[number] = nodes[i];
    }
};
struct list_dag_children {
    dag_level level;
    const std::uint32_t* source;
    const std::uint64_t* offsets;
    std::uint32_t *first, *children;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t at = offsets[i];
        first[i] = static_cast<std::uint32_t>(at);
        const std::uint64_t from = level.nodes.first_child(source[i]);
        const unsigned count = count_ones(level.nodes.mask(source[i]));
        for (unsigned c = 0; c < count; ++c) children[at + c] = level.below[from + c];
    }
};
struct set_count {
    std::uint32_t* count;
    VOXELPIPE_HD void operator()(std::uint64_t) const { *count = 0; }
};

// As dag_nodes, in memory of Backend.
template <class Backend>
struct backend_dag_nodes {
    typename Backend::template buffer<std::uint8_t> masks;
    typename Backend::template buffer<std::uint32_t> first, children;
};

} // namespace core

// Owns its nodes, in memory of Backend. Levels as octree_dag's.
template <class Backend>
class backend_octree_dag : public core::dag_levels<core::backend_dag_nodes<Backend>> {
public:
    // Memory of the backend.
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    // Makes the graph of an octree of fewer than 2^32 - 1 nodes a level; throws std::length_error otherwise, and what a
    // buffer throws. Beside the result it takes about 40 bytes for each node of the octree's largest level. Waits twice
    // a level.
    backend_octree_dag(Backend& backend, const backend_octree<Backend>& tree) {
        buffer<std::uint32_t> below(backend, std::size_t{0});
        for (int l = 1; l <= tree.num_levels(); ++l) below = add_level(backend, tree, l, below);
    }

    // Copies everything, then waits.
    [[nodiscard]] octree_dag to_host(Backend& backend) const {
        octree_dag dag;
        for (const level_type& l : levels_)
            dag.levels_.push_back({l.masks.to_host(backend), l.first.to_host(backend), l.children.to_host(backend)});
        return dag;
    }

private:
    using level_type = core::backend_dag_nodes<Backend>;
    using levels = core::dag_levels<level_type>;
    using levels::levels_;

    // Returns what each node of the octree's level has become.
    buffer<std::uint32_t> add_level(Backend& backend, const backend_octree<Backend>& tree, int l,
                                    const buffer<std::uint32_t>& below) {
        const auto n = static_cast<std::size_t>(tree.num_nodes(l));
        if (n >= 0xffffffffu) throw std::length_error("voxelpipe: a graph takes levels of fewer than 2^32 - 1 nodes");
        const int width = l == 1 ? 0 : static_cast<int>(std::bit_width(this->num_nodes(l - 1)));
        const core::dag_level nodes{tree.level(l), below.data(), width};
        buffer<std::uint32_t> sorted(backend, n);
        {
            buffer<std::uint64_t> keys(backend, n);
            const int bits = 8 + 8 * width;
            for (int w = 0; 64 * w < bits; ++w) {
                backend.for_each(n, core::make_dag_keys{nodes, w, keys.data(), sorted.data()});
                backend.sort_by_key(keys, sorted, std::min(64, bits - 64 * w));
            }
        }
        buffer<std::uint32_t> is_first(backend, n + 1), becomes(backend, n);
        buffer<std::uint64_t> before(backend, n + 1);
        backend.for_each(n + 1, core::count_dag_nodes{nodes, n, sorted.data(), is_first.data()});
        const auto made = static_cast<std::size_t>(backend.sum(is_first, before));
        const std::size_t inner = l == 1 ? 0 : made;
        level_type out{{backend, made}, {backend, inner}, {backend, std::size_t{0}}};
        buffer<std::uint32_t> children(backend, l == 1 ? 0 : made + 1), source(backend, inner);
        backend.for_each(n, core::number_dag_nodes{nodes, sorted.data(), is_first.data(), before.data(), becomes.data(),
                                                   out.masks.data(), l == 1 ? nullptr : children.data(),
                                                   l == 1 ? nullptr : source.data()});
        if (l != 1) {
            buffer<std::uint64_t> offsets(backend, made + 1);
            backend.for_each(1, core::set_count{children.data() + made});
            out.children = buffer<std::uint32_t>(backend, static_cast<std::size_t>(backend.sum(children, offsets)));
            backend.for_each(made, core::list_dag_children{nodes, source.data(), offsets.data(), out.first.data(),
                                                           out.children.data()});
        }
        levels_.push_back(std::move(out));
        return becomes;
    }
};

} // namespace voxelpipe
