// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tiles of a sparse framebuffer that stay in a call which loads, on any backend: what the call draws in has become
// bricks, and the rest of each tile is the largest cubes of bricks again.

#include <voxelpipe/core/bisect.hpp>
#include <voxelpipe/core/brick_tile.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::core {

// The tiles between bricks that were taken out: call i is for what follows the begin of tile i, or behind all tiles,
// for what follows a brick. They have places in the order of where they begin. Counted where `counts` is not null, with
// a 0 behind the last place.
struct list_kept_tiles {
    const brick_tile* tiles; // ascending; brick_tile::none() behind the last
    std::uint64_t num_tiles;
    const std::uint64_t* keys; // of all bricks, ascending; ~0 behind the last
    std::uint64_t count;
    std::uint32_t* counts = nullptr;
    const std::uint64_t* first = nullptr;
    std::uint64_t* bits = nullptr;
    std::uint32_t* sources = nullptr; // the tile that each was a part of

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint32_t made = 0;
        std::uint64_t tile = i, begin = 0, next = 0; // next: the first brick from `begin` on
        std::uint64_t place = i;
        if (i < num_tiles) {
            begin = tiles[i].first();
            next = count_below(keys, count, begin);
            place = i + next;
        } else if (i < num_tiles + count) {
            const std::uint64_t brick = i - num_tiles, behind = num_tiles_up_to(tiles, num_tiles, keys[brick]);
            next = brick + 1;
            tile = behind != 0 && keys[brick] < tiles[behind - 1].end() ? behind - 1 : num_tiles;
            begin = keys[brick] + 1;
            place = brick + behind;
        } else {
            tile = num_tiles;
        }
        if (tile < num_tiles && tiles[tile].bits != brick_tile::none().bits) {
            std::uint64_t end = tiles[tile].end();
            if (next < count && keys[next] < end) end = keys[next];
            while (begin < end) {
                const int level = level_of_tile(begin, end);
                if (counts == nullptr) {
                    bits[first[place] + made] = brick_tile::of(begin, level).bits;
                    sources[first[place] + made] = static_cast<std::uint32_t>(tile);
                }
                ++made;
                begin += std::uint64_t{1} << (3 * level);
            }
        }
        if (counts != nullptr) counts[place] = made;
    }
};

// 1 for bricks that were in a tile; the last count is 0.
struct count_taken_bricks {
    const brick_tile* tiles;
    std::uint64_t num_tiles;
    const std::uint64_t* keys;
    std::uint64_t count;
    std::uint32_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        counts[i] = i < count && find_tile(tiles, num_tiles, keys[i]) != num_tiles ? 1 : 0;
    }
};

// Tiles, and the number of the one that each was a part of.
template <class Backend>
struct kept_tiles {
    typename Backend::template buffer<std::uint64_t> bits; // brick_tile::bits
    typename Backend::template buffer<std::uint32_t> sources;
    std::uint64_t num_taken = 0; // bricks that are in no tile any more

    explicit kept_tiles(Backend& backend) : bits(backend, std::size_t{0}), sources(backend, std::size_t{0}) {}
    [[nodiscard]] std::uint64_t size() const { return bits.size(); }
};

// What is left of `tiles` beside the bricks with these keys.
template <class Backend>
[[nodiscard]] kept_tiles<Backend> keep_tiles(Backend& backend,
                                             const typename Backend::template buffer<brick_tile>& tiles,
                                             const std::uint64_t* keys, std::uint64_t count) {
    kept_tiles<Backend> kept(backend);
    const std::uint64_t items = tiles.size() + count;
    typename Backend::template buffer<std::uint32_t> counts(backend, static_cast<std::size_t>(items + 1));
    typename Backend::template buffer<std::uint64_t> first(backend, static_cast<std::size_t>(items + 1));
    list_kept_tiles list{tiles.data(), tiles.size(), keys, count, counts.data()};
    backend.for_each(items + 1, list);
    const auto n = static_cast<std::size_t>(backend.sum(counts, first));
    kept.bits = typename Backend::template buffer<std::uint64_t>(backend, n);
    kept.sources = typename Backend::template buffer<std::uint32_t>(backend, n);
    list.counts = nullptr;
    list.first = first.data();
    list.bits = kept.bits.data();
    list.sources = kept.sources.data();
    backend.for_each(items, list);
    backend.for_each(items + 1, count_taken_bricks{tiles.data(), tiles.size(), keys, count, counts.data()});
    kept.num_taken = backend.sum(counts, first);
    return kept;
}

struct take_tiles {
    const std::uint64_t* bits;
    brick_tile* to;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { to[i] = {bits[i]}; }
};

// Values of tiles that stay, behind those of the voxels; of bits, a word a call.
template <class Target>
struct keep_tile_values {
    using map = rank_map<Target>;
    using traits = typename Target::traits;
    const typename map::element* before;
    std::uint64_t first_before; // rank of the first tile
    const std::uint32_t* sources;
    std::uint64_t count;
    typename map::element* values;
    kept_sum<Target>* sums; // null where they are not kept
    std::uint64_t first;    // rank of the first tile that stays
    bool is_loaded;         // not cleared
    typename Target::value_type background;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if constexpr (map::is_bit) {
            const std::uint64_t begin = (first / 32 + i) * 32;
            for (std::uint64_t rank = begin < first ? first : begin; rank < begin + 32 && rank < first + count; ++rank)
                map::store(values, rank, value_of(rank - first));
        } else {
            map::store(values, first + i, value_of(i));
        }
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_calls() const {
        return map::is_bit ? (first + count + 31) / 32 - first / 32 : count;
    }

private:
    [[nodiscard]] VOXELPIPE_HD typename Target::value_type value_of(std::uint64_t i) const {
        typename Target::value_type value = background;
        if (is_loaded) value = map::load(before, first_before + sources[i]);
        if constexpr (has_wide_sums<Target>) {
            if (sums != nullptr) {
                auto sum = traits::begin(is_loaded ? value : traits::identity());
                sums[first + i] = sum;
                if (!is_loaded) add_sums(sum, traits::begin(background));
                value = typename Target::value_type(traits::end(sum));
            }
        }
        return value;
    }
};

// Gives `made` the tiles that stay with their values. Its arrays have room for them, and those of voxels are written.
template <class Backend, class... Targets>
void store_kept_tiles(Backend& backend, const sparse_framebuffer<Backend, Targets...>& fb,
                      const kept_tiles<Backend>& kept, sparse_contents<Backend, Targets...>& made) {
    const auto n = static_cast<std::size_t>(kept.size());
    if (n == 0) return;
    made.tile_voxels = fb.contents().tile_voxels - kept.num_taken * sparse_brick_voxels;
    made.tiles = typename Backend::template buffer<brick_tile>(backend, n);
    backend.for_each(n, take_tiles{kept.bits.data(), made.tiles.data()});
    const auto& before = fb.contents();
    const auto background = fb.next_background();
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename pack_element<I, Targets...>::type;
        const auto& t = voxelpipe::get<I>(fb.targets());
        if (!t.enabled) return;
        const keep_tile_values<target> keep{voxelpipe::get<I>(before.values).data(),
                                            before.num_voxels,
                                            kept.sources.data(),
                                            n,
                                            voxelpipe::get<I>(made.values).data(),
                                            t.keeps_sums ? voxelpipe::get<I>(made.sums).data() : nullptr,
                                            made.num_voxels,
                                            t.load != load_operation::clear,
                                            voxelpipe::get<I>(background)};
        backend.for_each(keep.num_calls(), keep);
    });
}

} // namespace voxelpipe::core
