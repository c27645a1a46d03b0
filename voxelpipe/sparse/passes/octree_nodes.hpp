// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The values of an octree's nodes on one level, from those of the level below or from the voxels; one functor call a
// node, on any backend.

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/core/octree_view.hpp>
#include <voxelpipe/core/pack.hpp>
#include <voxelpipe/levels/reducers.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace voxelpipe::core {

// The number of fragments of each voxel, where a reducer asks for them; voxels otherwise.
template <class Reducer, class... Targets>
struct counted_voxels {
    template <class Values>
    [[nodiscard]] static counted_voxels of(const Values&) {
        return {};
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t count(std::uint64_t) const { return 1; }
};
template <std::size_t C, class... Targets>
struct counted_voxels<reduce::mean<C>, Targets...> {
    using map = rank_map<typename pack_element<C, Targets...>::type>;
    const typename map::element* counts;

    template <class Values>
    [[nodiscard]] static counted_voxels of(const Values& values) {
        return {voxelpipe::get<C>(values).data()};
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t count(std::uint64_t rank) const {
        return static_cast<std::uint64_t>(map::load(counts, rank));
    }
};

// The terms of target I below each voxel, read where they lie.
template <std::size_t I, class Reducer, class... Targets>
struct octree_terms {
    using target = typename pack_element<I, Targets...>::type;
    using value = typename target::value_type;
    using parts = components_of<value>;
    using format = blend_tree_sum<typename target::blend_type, typename parts::scalar>;
    static constexpr bool divides = !std::is_same_v<Reducer, reduce::sum>;
    using scalar = std::conditional_t<divides, typename format::quotient, typename format::total>;
    using result = typename parts::template with<scalar>;
    struct node {
        typename format::sum sums[parts::count]{};
        std::uint64_t count = 0;
    };

    const typename rank_map<target>::element* values;
    const kept_sum<target>* sums; // null where they were not kept
    counted_voxels<Reducer, Targets...> counted;

    // Arrays: the values and sums of a host_sparse, or of sparse_contents.
    template <class Arrays>
    [[nodiscard]] static octree_terms of(const Arrays& a) {
        const auto& kept = voxelpipe::get<I>(a.sums);
        return {voxelpipe::get<I>(a.values).data(), kept.size() == 0 ? nullptr : kept.data(),
                counted_voxels<Reducer, Targets...>::of(a.values)};
    }
    [[nodiscard]] VOXELPIPE_HD node of_voxel(std::uint64_t rank) const {
        node n;
        n.count = counted.count(rank);
        // A mean has no sum of its own: it does not tell how many terms it had.
        if constexpr (has_wide_sums<target> && is_floating<typename parts::scalar> &&
                      !std::is_same_v<typename target::blend_type, blend::mean>) {
            if (sums != nullptr) {
                for (int c = 0; c < parts::count; ++c) {
                    if constexpr (parts::count > 1)
                        n.sums[c] = widen(sums[rank].c[c]);
                    else
                        n.sums[c] = widen(sums[rank]);
                }
                return n;
            }
        }
        const value v = rank_map<target>::load(values, rank);
        for (int c = 0; c < parts::count; ++c) n.sums[c] = format::begin(parts::at(v, c));
        return n;
    }
};

// Node i of a level: the sum of all terms below it, and the value that follows.
template <std::size_t I, class Reducer, class... Targets>
struct sum_octree_nodes {
    using terms = octree_terms<I, Reducer, Targets...>;
    using node = typename terms::node;
    using parts = typename terms::parts;
    using format = typename terms::format;

    terms voxels;
    int level;
    octree_level_view level_nodes;
    const node* below; // not read on level 1
    node* nodes;
    typename terms::result* values;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        node sum;
        const unsigned mask = level_nodes.mask(i);
        const std::uint64_t begin = level_nodes.first_child(i), end = begin + count_ones(mask);
        if (mask == 0) sum = of_tile(level_nodes.rank_of_tile(i));
        for (std::uint64_t c = begin; c < end; ++c) {
            const node child = level == 1 ? voxels.of_voxel(c) : below[c];
            for (int k = 0; k < parts::count; ++k) sum.sums[k].add(child.sums[k]);
            sum.count += child.count;
        }
        nodes[i] = sum;
        constexpr bool of_volume = std::is_same_v<Reducer, reduce::mean_of_volume>;
        const std::uint64_t divisor = of_volume ? std::uint64_t{1} << (3 * level) : sum.count;
        typename terms::result value{};
        for (int k = 0; k < parts::count; ++k) {
            auto& component = components_of<typename terms::result>::at(value, k);
            if constexpr (terms::divides)
                component = divisor == 0 ? typename terms::scalar{} : format::divide(sum.sums[k], divisor);
            else
                component = format::end(sum.sums[k]);
        }
        values[i] = value;
    }

private:
    // The sum of 8^level times the value with this rank.
    [[nodiscard]] VOXELPIPE_HD node of_tile(std::uint64_t rank) const {
        node sum = voxels.of_voxel(rank);
        for (int twice = 0; twice < 3 * level; ++twice) {
            const node half = sum;
            for (int k = 0; k < parts::count; ++k) sum.sums[k].add(half.sums[k]);
            sum.count += half.count;
        }
        return sum;
    }
};

// Node i of a level: the fold of its children, in Morton order.
template <class Reducer, class Target>
struct fold_octree_nodes {
    using value = std::conditional_t<std::is_same_v<typename Target::value_type, bool>, std::uint8_t,
                                     typename Target::value_type>;

    Reducer reducer;
    const typename rank_map<Target>::element* voxels;
    int level;
    octree_level_view level_nodes;
    const value* below; // not read on level 1
    value* values;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        value children[8];
        const auto n = static_cast<std::size_t>(count_ones(level_nodes.mask(i)));
        if (n == 0) { // a tile: eight equal children, level by level
            value v = value(rank_map<Target>::load(voxels, level_nodes.rank_of_tile(i)));
            for (int l = 0; l < level; ++l) {
                for (value& child : children) child = v;
                v = fold_of<Reducer, value>::fold(reducer, std::span<const value>(children, 8));
            }
            values[i] = v;
            return;
        }
        const std::uint64_t first = level_nodes.first_child(i);
        children[0] = child(first); // outside the loop, for g++ -O2 warns of a loop that may not run
        for (std::size_t c = 1; c < n; ++c) children[c] = child(first + c);
        values[i] = fold_of<Reducer, value>::fold(reducer, std::span<const value>(children, n));
    }

    [[nodiscard]] VOXELPIPE_HD value child(std::uint64_t k) const {
        return level == 1 ? value(rank_map<Target>::load(voxels, k)) : below[k];
    }
};

} // namespace voxelpipe::core
