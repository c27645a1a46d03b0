// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Levels of a dense grid: values of voxels that are 2, 4, 8 ... times as large, by the reducers of octree levels
// (reducers.hpp) and equal to these, bit for bit, on either backend. A voxel of a level exists if one below it does.

#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/levels/direction_mips.hpp>
#include <voxelpipe/levels/reducers.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

// A voxel as the reducers take it.
template <class T>
struct level_voxel {
    bool exists;         // false: value and count are not read
    T value;             // of the voxel
    std::uint64_t count; // of its fragments, for reduce::mean
};

// Reads the voxels of targets in memory of the backend. A voxel exists where its bit is set; a null `counts` counts
// one fragment each.
template <class Value, class Occupied, class Count = target<std::uint32_t, blend::count>>
struct target_voxels {
    target_view<Value> values;      // what is reduced
    target_view<Occupied> occupied; // which voxels exist
    target_view<Count> counts{};    // of fragments, or null

    // Voxel v, bits as 0 and 1 in bytes.
    [[nodiscard]] VOXELPIPE_HD auto operator()(const glm::ivec3& v) const {
        using value = std::conditional_t<std::is_same_v<typename Value::value_type, bool>, std::uint8_t,
                                         typename Value::value_type>;
        const bool exists = occupied(v.x, v.y, v.z);
        return level_voxel<value>{
            exists, exists ? value(values(v.x, v.y, v.z)) : value{},
            exists && counts.elements != nullptr ? static_cast<std::uint64_t>(counts(v.x, v.y, v.z)) : 1};
    }
};
template <class Value, class Occupied>
target_voxels(target_view<Value>, target_view<Occupied>) -> target_voxels<Value, Occupied>;
template <class Value, class Occupied, class Count>
target_voxels(target_view<Value>, target_view<Occupied>, target_view<Count>) -> target_voxels<Value, Occupied, Count>;

// The levels from 1 on, on Backend: extents of mip_extent, x fastest, then y, then z.
template <class Backend, class T>
struct dense_levels {
    // Memory of the backend.
    template <class U>
    using buffer = typename Backend::template buffer<U>;

    glm::ivec3 extent{0};                     // of level 0
    std::vector<buffer<T>> values;            // of level l at [l - 1]; T{} where the voxel does not exist
    std::vector<buffer<std::uint8_t>> exists; // 0 or 1
    // Without level 0.
    [[nodiscard]] int num_levels() const { return static_cast<int>(values.size()); }
};

namespace core {

// Calls f(child, slot) for the voxels of the level below that voxel i covers, in Morton order.
VOXELPIPE_ANY_CALLABLE
template <class F>
VOXELPIPE_HD void for_each_child(const glm::ivec3& extent, int level, std::uint64_t i, const F& f) {
    const glm::ivec3 e = mip_extent(extent, level), below = mip_extent(extent, level - 1);
    const auto nx = static_cast<std::uint64_t>(e.x), ny = static_cast<std::uint64_t>(e.y);
    const int x = static_cast<int>(i % nx), y = static_cast<int>(i / nx % ny), z = static_cast<int>(i / (nx * ny));
    for (int c = 0; c < 8; ++c) {
        const glm::ivec3 v(2 * x + (c & 1), 2 * y + (c >> 1 & 1), 2 * z + (c >> 2));
        if (v.x < below.x && v.y < below.y && v.z < below.z) f(v, direction_mips_view::index(below, v));
    }
}

template <class Reducer, class Voxels, class T>
struct fold_level {
    Reducer reducer;
    Voxels voxels;
    glm::ivec3 extent;
    int level;
    const T* below;
    const std::uint8_t* below_exists;
    T* values;
    std::uint8_t* exists;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        T children[8];
        std::size_t n = 0;
        for_each_child(extent, level, i, [&](const glm::ivec3& v, std::size_t slot) {
            if (level == 1) {
                const auto voxel = voxels(v);
                if (voxel.exists) children[n++] = voxel.value;
            } else if (below_exists[slot] != 0) {
                children[n++] = below[slot];
            }
        });
        exists[i] = n != 0 ? 1 : 0;
        values[i] = n == 0 ? T{} : fold_of<Reducer, T>::fold(reducer, std::span<const T>(children, n));
    }
};

// Sums of all terms below a voxel, and what divides them.
template <class Sum, int Components>
struct level_sums {
    Sum sums[std::size_t{Components}]{};
    std::uint64_t count = 0;
    bool exists = false;
};

template <class Reducer, class Voxels, class T>
struct sum_level {
    using parts = components_of<T>;
    using format = tree_sum_of<typename parts::scalar>;
    static constexpr bool divides = !std::is_same_v<Reducer, reduce::sum>;
    using scalar = std::conditional_t<divides, typename format::quotient, typename format::total>;
    using result = typename parts::template with<scalar>;
    using node = level_sums<typename format::sum, parts::count>;

    Voxels voxels;
    glm::ivec3 extent;
    int level;
    const node* below;
    node* nodes;
    result* values;
    std::uint8_t* exists;

    [[nodiscard]] VOXELPIPE_HD node of_voxel(const glm::ivec3& v) const {
        const auto voxel = voxels(v);
        node n;
        if (!voxel.exists) return n;
        n.exists = true;
        n.count = counts_voxels ? 1 : voxel.count;
        for (int c = 0; c < parts::count; ++c) n.sums[c] = format::begin(parts::at(voxel.value, c));
        return n;
    }
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        node sum;
        for_each_child(extent, level, i, [&](const glm::ivec3& v, std::size_t slot) {
            const node n = level == 1 ? of_voxel(v) : below[slot];
            if (!n.exists) return;
            sum.exists = true;
            sum.count += n.count;
            for (int c = 0; c < parts::count; ++c) sum.sums[c].add(n.sums[c]);
        });
        nodes[i] = sum;
        exists[i] = sum.exists ? 1 : 0;
        const std::uint64_t divisor = of_volume ? std::uint64_t{1} << (3 * level) : sum.count;
        result value{};
        for (int c = 0; c < parts::count; ++c) {
            if constexpr (divides)
                components_of<result>::at(value, c) =
                    divisor == 0 || !sum.exists ? scalar{} : format::divide(sum.sums[c], divisor);
            else
                components_of<result>::at(value, c) = format::end(sum.sums[c]);
        }
        values[i] = value;
    }

private:
    static constexpr bool of_volume = std::is_same_v<Reducer, reduce::mean_of_volume>;
    static constexpr bool counts_voxels =
        of_volume || std::is_same_v<Reducer, reduce::mean_of_voxels> || std::is_same_v<Reducer, reduce::sum>;
};

} // namespace core

// The values of all levels of a grid of `extent`. `voxels` is called as level_voxel<T> operator()(ivec3) const on the
// backend, from many threads: target_voxels, or a functor of the caller. The results have the types of reduce_levels of
// an octree; sums are those of the voxels' values. The steps run in the order of the backend's stream. Throws what
// Backend::buffer throws.
template <class Backend, class Voxels, class Reducer>
[[nodiscard]] auto reduce_levels(Backend& backend, const glm::ivec3& extent, const Voxels& voxels,
                                 const Reducer& reducer) {
    using value = decltype(voxels(glm::ivec3(0)).value);
    constexpr bool sums = core::sums_terms<Reducer>;
    using summing = core::sum_level<Reducer, Voxels, std::conditional_t<sums, value, int>>;
    using result = typename std::conditional_t<sums, summing, std::type_identity<value>>;
    const auto count_of = [&](int level) {
        const glm::ivec3 e = mip_extent(extent, level);
        return static_cast<std::size_t>(e.x) * static_cast<std::size_t>(e.y) * static_cast<std::size_t>(e.z);
    };
    const int last = last_mip_level(extent);
    if constexpr (sums) {
        static_cast<void>(reducer);
        using node = typename result::node;
        dense_levels<Backend, typename result::result> levels{extent, {}, {}};
        typename Backend::template buffer<node> below(backend, std::size_t{0});
        for (int l = 1; l <= last; ++l) {
            typename Backend::template buffer<node> nodes(backend, count_of(l));
            levels.values.emplace_back(backend, count_of(l));
            levels.exists.emplace_back(backend, count_of(l));
            backend.for_each(count_of(l), summing{voxels, extent, l, below.data(), nodes.data(),
                                                  levels.values.back().data(), levels.exists.back().data()});
            below = std::move(nodes);
        }
        return levels;
    } else {
        dense_levels<Backend, value> levels{extent, {}, {}};
        for (int l = 1; l <= last; ++l) {
            levels.values.emplace_back(backend, count_of(l));
            levels.exists.emplace_back(backend, count_of(l));
            const std::size_t at = levels.values.size() - 1;
            backend.for_each(count_of(l),
                             core::fold_level<Reducer, Voxels, value>{
                                 reducer, voxels, extent, l, l == 1 ? nullptr : levels.values[at - 1].data(),
                                 l == 1 ? nullptr : levels.exists[at - 1].data(), levels.values[at].data(),
                                 levels.exists[at].data()});
        }
        return levels;
    }
}

} // namespace voxelpipe
