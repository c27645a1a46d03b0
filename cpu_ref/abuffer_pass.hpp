// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Fine raster into an A-buffer. A tile's fragments come in primitive order, so a stable bucketing by voxel sorts each
// voxel's list. Rows of voxels are then put into the grid's order. Memory is proportional to the fragments; only one
// tile's counters per thread are dense.

#include <cpu_ref/bin_triangles.hpp>
#include <cpu_ref/tile_fragments.hpp>

#include <array>

namespace voxelpipe::cpu {

// The finished fragments of one thread: by tile, and within a tile by voxel.
template <class Payload>
struct bucket_store {
    std::vector<std::uint32_t> counts; // fragments of each occupied voxel
    std::vector<std::uint8_t> columns; // x of each occupied voxel within its tile
    std::vector<std::uint32_t> primitives;
    std::vector<Payload> payloads; // empty if the A-buffer has none
};

// The occupied voxels of one row of a tile, at most 32. They are copied together.
struct row_segment {
    std::uint64_t key; // position in the grid: (z * ny + y) * tiles along x + tile x
    std::uint32_t worker;
    std::uint32_t num_voxels;
    std::uint64_t voxel, fragment; // first of each in the thread's store
    std::uint64_t num_fragments;
};

// One thread's part of the lists.
template <class Payload>
struct list_part {
    bucket_store<Payload> store;
    std::vector<row_segment> segments;
    counters counts{};
};

template <class Payload>
struct abuffer_scratch : list_part<Payload> {
    struct emitted {
        std::uint32_t primitive;
        std::uint16_t voxel; // within the tile
        [[no_unique_address]] Payload payload;
    };
    std::vector<emitted> fragments; // of one tile, as emitted
    std::array<std::uint32_t, tile_voxels> count{};
    std::array<std::uint32_t, tile_rows> touched{};
};

// `primitives` are `stride` bytes apart, because they are members of sorted pairs with keys of either type.
template <coverage Rule, class Payload, class Scene>
void bucket_tile(const Scene& s, const core::tile_grid& tiles, std::uint64_t tile, const std::uint32_t* primitives,
                 std::size_t stride, std::size_t count, std::uint32_t worker, abuffer_scratch<Payload>& scratch) {
    static_assert(tile_voxels <= 65536);
    constexpr bool has_payload = !std::is_same_v<Payload, no_payload>;
    const core::voxel_box box = core::tile_box(tiles, tile, s.where.extent);
    const auto x0 = static_cast<int>(box.lo[0]), y0 = static_cast<int>(box.lo[1]), z0 = static_cast<int>(box.lo[2]);
    scratch.fragments.clear();
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t id =
            *reinterpret_cast<const std::uint32_t*>(reinterpret_cast<const std::byte*>(primitives) + i * stride);
        const std::uint32_t number = s.numberings.empty() ? id : s.numbers_of(s.find(id), id).primitive;
        shade_in_tile<Rule>(s, id, box, [&](int x, int y, int z, const auto& out) VOXELPIPE_INLINE_LAMBDA {
            if (!out.keep) {
                ++scratch.counts.fragments_discarded;
                return;
            }
            const int row = y + tile_size * z;
            const std::size_t voxel = tile_voxel(row, x);
            ++scratch.count[voxel];
            scratch.touched[static_cast<std::size_t>(row)] |= 1u << x;
            if constexpr (has_payload)
                scratch.fragments.push_back({number, static_cast<std::uint16_t>(voxel), get<0>(out.values)});
            else
                scratch.fragments.push_back({number, static_cast<std::uint16_t>(voxel), {}});
        });
    }
    scratch.counts.fragments += scratch.fragments.size();

    // Turns counts into offsets in the store and moves the fragments there, in order.
    bucket_store<Payload>& store = scratch.store;
    const std::size_t base = store.primitives.size();
    std::size_t next = base;
    for (std::size_t row = 0; row < tile_rows; ++row) {
        std::uint32_t word = scratch.touched[row];
        if (word == 0) continue;
        const int y = y0 + static_cast<int>(row) % tile_size, z = z0 + static_cast<int>(row) / tile_size;
        row_segment segment{};
        segment.key = (static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(s.where.extent.y) +
                       static_cast<std::uint64_t>(y)) *
                          static_cast<std::uint64_t>(tiles.tiles.x) +
                      static_cast<std::uint64_t>(x0 >> tiles.log2_size);
        segment.worker = worker;
        segment.voxel = store.counts.size();
        segment.fragment = next;
        for (; word != 0; word &= word - 1) {
            const int column = std::countr_zero(word);
            std::uint32_t& n = scratch.count[row * tile_size + static_cast<std::size_t>(column)];
            store.counts.push_back(n);
            store.columns.push_back(static_cast<std::uint8_t>(column));
            const std::size_t here = next - base;
            next += n;
            n = static_cast<std::uint32_t>(here);
            ++segment.num_voxels;
        }
        segment.num_fragments = next - segment.fragment;
        scratch.segments.push_back(segment);
    }
    store.primitives.resize(next);
    if constexpr (has_payload) store.payloads.resize(next);
    for (const auto& e : scratch.fragments) {
        const std::size_t at = base + scratch.count[e.voxel]++;
        store.primitives[at] = e.primitive;
        if constexpr (has_payload) store.payloads[at] = e.payload;
    }
    for (std::size_t row = 0; row < tile_rows; ++row) {
        for (std::uint32_t word = scratch.touched[row]; word != 0; word &= word - 1)
            scratch.count[row * tile_size + static_cast<std::size_t>(std::countr_zero(word))] = 0;
        scratch.touched[row] = 0;
    }
}

// Merges the threads' parts: rows of voxels in the order of the whole grid. `parts` are pointers to objects derived
// from list_part; emit_lists takes their segments. Adds the counts of fragments and voxels to `result`.
template <class Parts, class Backend, class Payload>
[[nodiscard]] status emit_lists(const execution& how, Backend& backend, glm::ivec3 extent, const Parts& parts,
                                status result, abuffer<Backend, Payload>& lists) {
    using payload = payload_storage<Payload>;
    const core::tile_grid tiles(extent, log2_tile_size);
    how.enter(stage::abuffer_emit);
    const stopwatch watch(how.times, &stage_times::abuffer_emit);
    std::size_t num_segments = 0;
    for (const auto& w : parts) num_segments += w->segments.size();
    raw_array<row_segment> segments(num_segments);
    row_segment* next_segment = segments.begin();
    for (const auto& w : parts) {
        next_segment = std::copy(w->segments.begin(), w->segments.end(), next_segment);
        w->segments = {};
        result.counts.fragments += w->counts.fragments;
        result.counts.fragments_discarded += w->counts.fragments_discarded;
    }
    const std::uint64_t keys = static_cast<std::uint64_t>(extent.z) * static_cast<std::uint64_t>(extent.y) *
                               static_cast<std::uint64_t>(tiles.tiles.x);
    radix_sort(how.threads, segments, static_cast<int>(std::bit_width(keys - 1)));
    // The first voxel and fragment of each segment in the result, and finally the totals.
    struct segment_start {
        std::uint64_t voxel, fragment;
    };
    std::vector<segment_start> starts(segments.size());
    segment_start total{0, 0};
    for (std::size_t i = 0; i < segments.size(); ++i) {
        starts[i] = total;
        total.voxel += segments[i].num_voxels;
        total.fragment += segments[i].num_fragments;
    }
    using lists_type = abuffer<Backend, Payload>;
    typename Backend::template buffer<std::uint64_t> voxels(backend, total.voxel);
    typename Backend::template buffer<std::uint64_t> offsets(backend, total.voxel == 0 ? 0 : total.voxel + 1);
    typename Backend::template buffer<std::uint32_t> primitives(backend, total.fragment);
    typename Backend::template buffer<payload> payloads(backend, lists_type::has_payload ? total.fragment : 0);

    const auto nx = static_cast<std::uint64_t>(extent.x), tiles_x = static_cast<std::uint64_t>(tiles.tiles.x);
    constexpr std::size_t block = 1024;
    parallel_for(how.threads, (segments.size() + block - 1) / block, [&](unsigned, std::size_t b) {
        const std::size_t last = std::min(segments.size(), (b + 1) * block);
        for (std::size_t i = b * block; i < last; ++i) {
            const row_segment& g = segments[i];
            const bucket_store<payload>& from = parts[g.worker]->store;
            const std::uint64_t row_start = g.key / tiles_x * nx + g.key % tiles_x * tile_size;
            std::uint64_t at = starts[i].fragment;
            for (std::uint32_t v = 0; v < g.num_voxels; ++v) {
                voxels.data()[starts[i].voxel + v] = row_start + from.columns[g.voxel + v];
                offsets.data()[starts[i].voxel + v] = at;
                at += from.counts[g.voxel + v];
            }
            const auto first = static_cast<std::ptrdiff_t>(g.fragment),
                       n = static_cast<std::ptrdiff_t>(g.num_fragments);
            std::copy_n(from.primitives.begin() + first, n, primitives.data() + starts[i].fragment);
            if constexpr (lists_type::has_payload)
                std::copy_n(from.payloads.begin() + first, n, payloads.data() + starts[i].fragment);
        }
    });
    if (total.voxel != 0) offsets.data()[total.voxel] = total.fragment;
    result.counts.voxels = total.voxel;
    lists.voxels = std::move(voxels);
    lists.offsets = std::move(offsets);
    lists.primitives = std::move(primitives);
    lists.payloads = std::move(payloads);
    lists.extent = extent;
    return result;
}

template <coverage Rule, class Key, class Scene, class Backend, class Payload>
[[nodiscard]] status draw_abuffer(const execution& how, Backend& backend, const Scene& s,
                                  abuffer<Backend, Payload>& lists) {
    using payload = payload_storage<Payload>;
    binned_triangles<Key> binned = bin_triangles<Rule, Key>(how, s);
    if (!binned.result.ok()) return binned.result;

    how.enter(stage::fine_raster);
    const unsigned workers = binned.workers(how.threads);
    std::vector<std::unique_ptr<abuffer_scratch<payload>>> scratch;
    for (unsigned w = 0; w < workers; ++w) scratch.push_back(std::make_unique<abuffer_scratch<payload>>());
    {
        const stopwatch watch(how.times, &stage_times::fine_raster);
        progress_meter meter(how, binned.ranges.size());
        parallel_for(how.threads, binned.ranges.size(), [&](unsigned worker, std::size_t r) {
            const tile_range& range = binned.ranges[r];
            bucket_tile<Rule>(s, binned.tiles, range.tile, &binned.pairs[range.first].primitive, sizeof(tile_pair<Key>),
                              range.last - range.first, worker, *scratch[worker]);
            meter.advance();
        });
    }
    binned.pairs = {};
    return emit_lists(how, backend, s.where.extent, scratch, binned.result, lists);
}

} // namespace voxelpipe::cpu
