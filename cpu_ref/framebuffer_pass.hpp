// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fine raster into render targets. The triangles of a tile are drawn in order; each fragment is shaded and folded into
// its targets. Blends with an accumulator format of their own (reproducible sums) use a tile of accumulators; all
// others work in place. A shader whose values are constant is handled by constant_tile.hpp.

#include <cpu_ref/bin_triangles.hpp>
#include <cpu_ref/constant_tile.hpp>
#include <voxelpipe/core/same_bits.hpp>

#include <array>
#include <atomic>
#include <cstring>

namespace voxelpipe::cpu {

// Clears a target, including its padding. Padding bits become 0.
template <class Target>
void clear_target(const execution& how, const target_view<Target>& t) {
    using map = typename Target::map;
    using element = typename Target::element_type;
    const std::size_t n = map::elements(t.extent);
    constexpr std::size_t block = (std::size_t{4} << 20) / sizeof(element) + 1;
    const std::size_t blocks = (n + block - 1) / block;
    if constexpr (map::is_bit) {
        if (t.clear_value) {
            // Rows end within a word: sets bits only up to the extent.
            const std::uint32_t tail = t.extent.x % 32 == 0 ? ~0u : (1u << (t.extent.x % 32)) - 1;
            const auto y_end = t.extent.y, z_end = t.extent.z;
            parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
                std::fill(t.elements + b * block, t.elements + std::min(n, (b + 1) * block), 0u);
            });
            parallel_for(how.threads, static_cast<std::size_t>(z_end), [&](unsigned, std::size_t z) {
                for (int y = 0; y < y_end; ++y)
                    for (int x = 0; x < t.extent.x; x += 32)
                        t.elements[map::cell(t.extent, x, y, static_cast<int>(z))] = x + 32 <= t.extent.x ? ~0u : tail;
            });
            return;
        }
    }
    const auto fill = [&](element* first, element* last, const element& v) {
        std::array<std::byte, sizeof(element)> raw;
        std::memcpy(raw.data(), &v, sizeof(element));
        const bool zero = std::all_of(raw.begin(), raw.end(), [](std::byte x) { return x == std::byte{0}; });
        if (zero)
            std::memset(static_cast<void*>(first), 0, static_cast<std::size_t>(last - first) * sizeof(element));
        else
            std::fill(first, last, v);
    };
    parallel_for(how.threads, blocks, [&](unsigned, std::size_t b) {
        const std::size_t first = b * block, last = std::min(n, first + block);
        if constexpr (map::is_bit) {
            fill(t.elements + first, t.elements + last, 0u);
        } else if constexpr (map::planes) {
            const std::size_t plane = map::cells(t.extent);
            for (std::size_t i = first; i < last;) {
                const std::size_t c = i / plane, end = std::min(last, (c + 1) * plane);
                fill(t.elements + i, t.elements + end, t.clear_value[static_cast<glm::length_t>(c)]);
                i = end;
            }
        } else {
            fill(t.elements + first, t.elements + last, t.clear_value);
        }
    });
}

template <class Target>
inline constexpr bool works_in_place =
    std::is_same_v<typename Target::traits::accumulator, typename Target::value_type>;

// One thread's data of its current tile.
template <class... Targets>
struct tile_scratch {
    template <class Target>
    using accumulators = std::unique_ptr<typename Target::traits::accumulator[]>;

    std::array<std::uint32_t, tile_rows> touched{}; // one bit per voxel: it has a fragment
    core::pack<accumulators<Targets>...> sums;      // tile_voxels each, for targets that do not work in place
    counters counts{};
};

// Allocates the sums of a tile for active targets.
template <class... Targets>
void reserve_sums(const framebuffer_view<Targets...>& fb, tile_scratch<Targets...>& scratch) {
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target_type = typename core::pack_element<I, Targets...>::type;
        if constexpr (!works_in_place<target_type>)
            if (get<I>(fb.targets).load != load_operation::off)
                get<I>(scratch.sums) =
                    std::make_unique_for_overwrite<typename target_type::traits::accumulator[]>(tile_voxels);
    });
}

template <class... Targets>
inline constexpr bool all_in_place = (works_in_place<Targets> && ...);

template <class Target, class Value>
VOXELPIPE_INLINE void blend_in_place(const target_view<Target>& t, int x, int y, int z, const Value& v) {
    using map = typename Target::map;
    using traits = typename Target::traits;
    if constexpr (map::is_bit || map::planes) {
        auto stored = map::load(t.elements, t.extent, x, y, z);
        traits::apply(stored, v);
        map::store(t.elements, t.extent, x, y, z, stored);
    } else {
        traits::apply(t.elements[map::cell(t.extent, x, y, z)], v);
    }
}

// Blends a fragment's values into a voxel, x, y, z in the targets, row and column in the tile. Track: marks the voxel,
// which sums need.
template <bool Track, class Values, class... Targets>
VOXELPIPE_INLINE void blend_in_tile(const framebuffer_view<Targets...>& fb, tile_scratch<Targets...>& scratch, int row,
                                    int column, int x, int y, int z, const Values& values) {
    bool first = false;
    if constexpr (Track) {
        std::uint32_t& word = scratch.touched[static_cast<std::size_t>(row)];
        first = ((word >> column) & 1u) == 0;
        word |= 1u << column;
    }
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target_type = typename core::pack_element<I, Targets...>::type;
        const auto& t = get<I>(fb.targets);
        if (t.load == load_operation::off) return;
        if constexpr (works_in_place<target_type>) {
            blend_in_place(t, x, y, z, get<I>(values));
        } else {
            auto& sum = get<I>(scratch.sums)[tile_voxel(row, column)];
            if (first) sum = target_type::traits::begin(t.load == load_operation::clear ? t.clear_value : t(x, y, z));
            target_type::traits::apply(sum, get<I>(values));
        }
    });
}

// `at`: position in the targets of the tile's lowest voxel.
template <coverage Rule, bool Track, class Scene, class... Targets>
void raster_tile(const Scene& s, const core::voxel_box& box, const glm::ivec3& at, const std::uint32_t* primitives,
                 std::size_t stride, std::size_t count, const framebuffer_view<Targets...>& fb,
                 tile_scratch<Targets...>& scratch) {
    const int x0 = at.x, y0 = at.y, z0 = at.z;
    std::uint64_t fragments = 0, discarded = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t id =
            *reinterpret_cast<const std::uint32_t*>(reinterpret_cast<const std::byte*>(primitives) + i * stride);
        shade_in_tile<Rule>(s, id, box, [&](int column, int j, int k, const auto& out) VOXELPIPE_INLINE_LAMBDA {
            if (!out.keep) {
                ++discarded;
                return;
            }
            ++fragments;
            blend_in_tile<Track>(fb, scratch, k * tile_size + j, column, x0 + column, y0 + j, z0 + k, out.values);
        });
    }
    scratch.counts.fragments += fragments;
    scratch.counts.fragments_discarded += discarded;
}

// Ends the tile: stores sums, counts voxels, and resets the marks.
template <class... Targets>
void resolve_tile(const glm::ivec3& at, const framebuffer_view<Targets...>& fb, tile_scratch<Targets...>& scratch) {
    [[maybe_unused]] const int x0 = at.x, y0 = at.y, z0 = at.z;
    for (std::size_t row = 0; row < tile_rows; ++row) {
        std::uint32_t word = scratch.touched[row];
        if (word == 0) continue;
        scratch.touched[row] = 0;
        scratch.counts.voxels += static_cast<unsigned>(std::popcount(word));
        if constexpr (!all_in_place<Targets...>) {
            const int y = y0 + static_cast<int>(row) % tile_size, z = z0 + static_cast<int>(row) / tile_size;
            for (; word != 0; word &= word - 1) {
                const int column = std::countr_zero(word);
                core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                    using target_type = typename core::pack_element<I, Targets...>::type;
                    if constexpr (!works_in_place<target_type>) {
                        const auto& t = get<I>(fb.targets);
                        if (t.load == load_operation::off) return;
                        const auto& sum = get<I>(scratch.sums)[row * tile_size + static_cast<std::size_t>(column)];
                        t.store(x0 + column, y, z, target_type::traits::end(sum));
                    }
                });
            }
        }
    }
}

template <class... Targets>
void clear_targets(const execution& how, const framebuffer_view<Targets...>& fb) {
    const stopwatch watch(how.times, &stage_times::clear);
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        const auto& t = get<I>(fb.targets);
        if (t.load == load_operation::clear) clear_target(how, t);
    });
}

template <coverage Rule, class Key, class Scene, class... Targets>
void raster_tiles(const execution& how, const Scene& s, const core::tile_grid& tiles,
                  const std::vector<tile_range>& ranges, const raw_array<tile_pair<Key>>& pairs, unsigned workers,
                  const framebuffer_view<Targets...>& fb, bool count_voxels, counters& counts) {
    // Allocates everything before the first voxel is written.
    std::vector<std::unique_ptr<tile_scratch<Targets...>>> scratch;
    for (unsigned w = 0; w < workers; ++w) {
        scratch.push_back(std::make_unique<tile_scratch<Targets...>>());
        reserve_sums(fb, *scratch.back());
    }
    clear_targets(how, fb);
    const stopwatch watch(how.times, &stage_times::fine_raster);
    progress_meter meter(how, ranges.size());
    parallel_for(how.threads, ranges.size(), [&](unsigned worker, std::size_t r) {
        const tile_range& range = ranges[r];
        const core::voxel_box box = core::tile_box(tiles, range.tile, s.where.extent);
        const std::uint32_t* const primitives = &pairs[range.first].primitive;
        const std::size_t count = range.last - range.first;
        constexpr std::size_t stride = sizeof(tile_pair<Key>);
        auto& mine = *scratch[worker];
        if (count_voxels || !all_in_place<Targets...>) {
            raster_tile<Rule, true>(s, box, lowest(box), primitives, stride, count, fb, mine);
            resolve_tile(lowest(box), fb, mine);
        } else if constexpr (all_in_place<Targets...>) {
            raster_tile<Rule, false>(s, box, lowest(box), primitives, stride, count, fb, mine);
        }
        meter.advance();
    });
    add_counts(counts, scratch);
}

template <coverage Rule, class Key, class Scene, class... Targets>
void raster_constant_tiles(const execution& how, const Scene& s, const core::tile_grid& tiles,
                           const std::vector<tile_range>& ranges, const raw_array<tile_pair<Key>>& pairs,
                           unsigned workers, const framebuffer_view<Targets...>& fb, counters& counts) {
    const bool repeats = needs_repeats(fb);
    std::vector<std::unique_ptr<constant_scratch>> scratch;
    for (unsigned w = 0; w < workers; ++w) {
        scratch.push_back(std::make_unique<constant_scratch>());
        if (repeats) scratch.back()->repeats = std::make_unique<std::uint32_t[]>(tile_voxels);
    }
    clear_targets(how, fb);
    const stopwatch watch(how.times, &stage_times::fine_raster);
    progress_meter meter(how, ranges.size());
    parallel_for(how.threads, ranges.size(), [&](unsigned worker, std::size_t r) {
        const tile_range& range = ranges[r];
        const core::voxel_box box = core::tile_box(tiles, range.tile, s.where.extent);
        const std::uint32_t* const primitives = &pairs[range.first].primitive;
        const std::size_t count = range.last - range.first;
        constexpr std::size_t stride = sizeof(tile_pair<Key>);
        auto& mine = *scratch[worker];
        if (repeats)
            cover_tile<Rule, true>(s, box, primitives, stride, count, mine);
        else
            cover_tile<Rule, false>(s, box, primitives, stride, count, mine);
        resolve_constant_tile(lowest(box), fb, s.draws[0].fragment_shader.values, mine);
        meter.advance();
    });
    add_counts(counts, scratch);
}

template <coverage Rule, class Key, class Scene, class... Targets>
[[nodiscard]] status draw_framebuffer(const execution& how, const Scene& s, const framebuffer_view<Targets...>& fb,
                                      bool count_voxels) {
    const binned_triangles<Key> binned = bin_triangles<Rule, Key>(how, s);
    status result = binned.result;
    if (!result.ok()) return result;

    how.enter(stage::fine_raster);
    if (fb.changes != nullptr)
        core::change_log::forget(fb.changes); // the targets are cleared whole, and no changes are logged
    const unsigned workers = binned.workers(how.threads);
    bool constant_output = false;
    if constexpr (core::is_constant<typename Scene::fragment_shader>) {
        constant_output = core::have_same_values(s.draws);
        if (constant_output)
            raster_constant_tiles<Rule>(how, s, binned.tiles, binned.ranges, binned.pairs, workers, fb, result.counts);
    }
    if (!constant_output)
        raster_tiles<Rule>(how, s, binned.tiles, binned.ranges, binned.pairs, workers, fb, count_voxels, result.counts);
    if (!count_voxels) result.counts.voxels = 0;
    return result;
}

} // namespace voxelpipe::cpu
