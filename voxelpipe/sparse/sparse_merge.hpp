// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Joins sparse framebuffers of parts of one grid, in host memory, to what one call in the whole gives: bricks that a
// border cuts, and tiles that meet at one.

#include <voxelpipe/core/same_bits.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>

#include <glm/common.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

namespace core {

// True if two ranks have the same bits in all targets, and the same sums where these are kept.
template <class... Targets>
[[nodiscard]] bool have_same_values(const host_sparse<Targets...>& a, std::uint64_t i, const host_sparse<Targets...>& b,
                                    std::uint64_t j) {
    bool same = true;
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename pack_element<I, Targets...>::type;
        using map = rank_map<target>;
        const auto &x = voxelpipe::get<I>(a.values), &y = voxelpipe::get<I>(b.values);
        if (!x.empty()) same = same && is_same_value(map::load(x.data(), i), map::load(y.data(), j));
        if constexpr (has_wide_sums<target>) {
            using sum = kept_sum<target>;
            static_assert(std::has_unique_object_representations_v<sum>);
            const auto &s = voxelpipe::get<I>(a.sums), &t = voxelpipe::get<I>(b.sums);
            if (!s.empty()) same = same && has_same_bits(s[i], t[j]);
        }
    });
    return same;
}

// A tile, and where its value is.
template <class... Targets>
struct tile_source {
    brick_tile tile;
    const host_sparse<Targets...>* from;
    std::uint64_t rank;
};

// Makes one of eight siblings with the same values, again and again. Source has a `tile`; is_same(source, source): of
// the values. In the order of the tiles, before and after.
template <class Source, class IsSame>
[[nodiscard]] std::vector<Source> join_siblings(std::vector<Source> tiles, const IsSame& is_same) {
    std::size_t count = 0; // of the tiles that are done
    // The last eight are all children of a tile: of one level and without a gap.
    const auto end_in_siblings = [&] {
        if (count < 8) return false;
        const Source& first = tiles[count - 8];
        const int level = first.tile.level();
        const std::uint64_t size = std::uint64_t{1} << (3 * level);
        if ((first.tile.first() & (8 * size - 1)) != 0 || tiles[count - 1].tile.end() - first.tile.first() != 8 * size)
            return false;
        return std::all_of(tiles.data() + count - 8, tiles.data() + count,
                           [&](const Source& t) { return t.tile.level() == level && is_same(first, t); });
    };
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        tiles[count++] = tiles[i];
        while (end_in_siblings()) {
            count -= 7;
            const brick_tile child = tiles[count - 1].tile;
            tiles[count - 1].tile = brick_tile::of(child.first(), child.level() + 1);
        }
    }
    tiles.erase(tiles.begin() + static_cast<std::ptrdiff_t>(count), tiles.end());
    return tiles;
}

} // namespace core

// Joins the results of two parts of one grid: crops, whose borders may run through bricks. Both have the same targets
// enabled and no voxel in common; throws std::invalid_argument otherwise. The result's part is the box around both.
// Parts that each are drawn by one call are joined to the bytes of one call in the whole, tiles included: eight
// siblings with the same values are one tile, and where both parts are tiled, a brick that a border cuts and that is
// full of one value is a tile. After a call that loads into tiles, such bricks stay bricks.
template <class... Targets>
[[nodiscard]] host_sparse<Targets...> merge(const host_sparse<Targets...>& a, const host_sparse<Targets...>& b) {
    if (a.where.uncropped() != b.where.uncropped())
        throw std::invalid_argument("voxelpipe::merge: the parts are not of one grid");
    host_sparse<Targets...> out;
    out.clear_values = a.clear_values;
    out.is_tiled = (a.is_tiled || a.num_values() == 0) && (b.is_tiled || b.num_values() == 0);
    const glm::ivec3 low = glm::min(a.where.offset, b.where.offset),
                     high = glm::max(a.where.offset + a.where.extent, b.where.offset + b.where.extent);
    out.where = a.where.uncropped().crop(low, high - low);
    const std::uint64_t values = a.num_values() + b.num_values();
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename core::pack_element<I, Targets...>::type;
        if (a.num_values() != 0 && b.num_values() != 0 &&
            (get<I>(a.values).empty() != get<I>(b.values).empty() || get<I>(a.sums).empty() != get<I>(b.sums).empty()))
            throw std::invalid_argument("voxelpipe::merge: the parts have different targets");
        if (!get<I>(a.values).empty() || !get<I>(b.values).empty())
            get<I>(out.values).resize(core::rank_map<target>::elements(values));
        if (!get<I>(a.sums).empty() || !get<I>(b.sums).empty()) get<I>(out.sums).resize(values);
    });
    std::uint64_t rank = 0;
    const auto copy = [&](const host_sparse<Targets...>& from, std::uint64_t first) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
            if (!get<I>(out.values).empty())
                map::store(get<I>(out.values).data(), rank, map::load(get<I>(from.values).data(), first));
            if (!get<I>(out.sums).empty()) get<I>(out.sums)[rank] = get<I>(from.sums)[first];
        });
        ++rank;
    };
    std::vector<core::tile_source<Targets...>> tiles;
    for (std::size_t i = 0, j = 0; i < a.keys.size() || j < b.keys.size();) {
        const bool from_a = j == b.keys.size() || (i < a.keys.size() && a.keys[i] <= b.keys[j]);
        const bool from_b = i == a.keys.size() || (j < b.keys.size() && b.keys[j] <= a.keys[i]);
        const std::uint64_t key = from_a ? a.keys[i] : b.keys[j];
        const brick_mask in_a = from_a ? a.masks[i] : brick_mask{}, in_b = from_b ? b.masks[j] : brick_mask{};
        std::uint64_t next_a = from_a ? a.offsets[i] : 0, next_b = from_b ? b.offsets[j] : 0;
        i += from_a ? 1 : 0;
        j += from_b ? 1 : 0;
        brick_mask mask;
        for (int w = 0; w < 8; ++w) {
            if ((in_a.words[w] & in_b.words[w]) != 0)
                throw std::invalid_argument("voxelpipe::merge: a voxel is in both parts");
            mask.words[w] = in_a.words[w] | in_b.words[w];
        }
        if (out.is_tiled && from_a && from_b && mask.count() == core::sparse_brick_voxels) {
            const std::uint64_t of_a = in_a.count(), first = next_a;
            bool is_uniform = true;
            for (std::uint64_t k = 0; k < core::sparse_brick_voxels; ++k)
                is_uniform = is_uniform && (k < of_a ? core::have_same_values(a, first, a, first + k)
                                                     : core::have_same_values(a, first, b, next_b + k - of_a));
            if (is_uniform) {
                tiles.push_back({brick_tile::of(key, 0), &a, first});
                continue;
            }
        }
        out.keys.push_back(key);
        out.masks.push_back(mask);
        out.offsets.push_back(rank);
        for (int w = 0; w < 8; ++w)
            for (std::uint64_t word = mask.words[w]; word != 0; word &= word - 1) {
                if ((in_a.words[w] & word & (0 - word)) != 0)
                    copy(a, next_a++);
                else
                    copy(b, next_b++);
            }
    }
    if (!out.keys.empty()) out.offsets.push_back(rank);
    for (const host_sparse<Targets...>* part : {&a, &b})
        for (std::size_t t = 0; t < part->tiles.size(); ++t)
            tiles.push_back({part->tiles[t], part, part->num_values() - part->tiles.size() + t});
    std::sort(tiles.begin(), tiles.end(), [](const auto& x, const auto& y) { return x.tile.bits < y.tile.bits; });
    using source = core::tile_source<Targets...>;
    tiles = core::join_siblings(std::move(tiles), [](const source& x, const source& y) {
        return core::have_same_values(*x.from, x.rank, *y.from, y.rank);
    });
    for (const source& t : tiles) {
        out.tiles.push_back(t.tile);
        copy(*t.from, t.rank);
    }
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename core::pack_element<I, Targets...>::type;
        if (!get<I>(out.values).empty()) get<I>(out.values).resize(core::rank_map<target>::elements(rank));
        if (!get<I>(out.sums).empty()) get<I>(out.sums).resize(rank);
    });
    return out;
}

// Merges any number of parts, at least one; each voxel is copied about log2(parts) times.
template <class... Targets>
[[nodiscard]] host_sparse<Targets...> merge(std::span<const host_sparse<Targets...>> parts) {
    if (parts.empty()) throw std::invalid_argument("voxelpipe::merge: no parts");
    if (parts.size() == 1) return parts[0];
    return merge(merge(parts.first(parts.size() / 2)), merge(parts.subspan(parts.size() / 2)));
}

} // namespace voxelpipe
