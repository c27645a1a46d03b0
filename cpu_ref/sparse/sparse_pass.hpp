// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Into a sparse framebuffer: vertex shade -> coarse raster -> tile sort in Morton order -> tile by tile: fine raster
// into a thread's dense tile, then its bricks. Nothing is dense but one tile a thread, so memory is in proportion to
// the result. Tiles lie on the lattice of the whole grid, also where a part of it is drawn.
//
// The fragments come from a source:
//   num_tiles(), key(i)   the tiles that it may draw in: Morton keys in the whole grid, ascending
//   make_scratch()        a unique_ptr to what a thread needs to draw
//   draw(i, ...)          blends the tile's fragments into scratch.view, counts, and ends the tile (scratch.end_...)
// Triangles are a source (surface_source), and so are solids (sparse_solid.hpp).

#include <cpu_ref/sparse/sparse_tile.hpp>
#include <voxelpipe/core/same_bits.hpp>
#include <voxelpipe/sparse/passes/kept_tiles.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace voxelpipe::cpu {

// The grid that a sparse call is drawn in: `g` from the corner of the tile that its first voxel lies in.
[[nodiscard]] inline grid tile_aligned(const grid& g) {
    grid aligned = g;
    aligned.whole = g.whole_extent();
    for (int a = 0; a < 3; ++a) aligned.offset[a] = g.offset[a] / tile_size * tile_size;
    aligned.extent = g.extent + g.offset - aligned.offset;
    return aligned;
}
// The voxels of `g` in it.
[[nodiscard]] inline core::voxel_box part_of_aligned(const grid& g) {
    core::voxel_box box{};
    for (int a = 0; a < 3; ++a) {
        box.lo[a] = g.offset[a] % tile_size;
        box.hi[a] = box.lo[a] + g.extent[a] - 1;
    }
    return box;
}

// Triangles of a scene that was made for tile_aligned(g).
template <coverage Rule, class Scene>
class surface_source {
public:
    // The coarse raster and the sort; `code` is not ok where a triangle has a bad index.
    surface_source(const execution& how, const Scene& s) : s_(s) {
        const core::tile_grid tiles(s.where.extent, log2_tile_size);
        auto coarse = coarse_raster<Rule, std::uint64_t>(how, s, tiles);
        code = coarse.code;
        counts = coarse.counts;
        if (code != status_code::ok) return;
        pairs_ = std::move(coarse.pairs);
        const glm::ivec3 corner = s.where.offset / tile_size;
        constexpr std::size_t block = 65536;
        parallel_for(how.threads, (pairs_.size() + block - 1) / block, [&](unsigned, std::size_t b) {
            const std::size_t last = std::min(pairs_.size(), (b + 1) * block);
            for (std::size_t i = b * block; i < last; ++i)
                pairs_[i].key = core::morton_key(corner + tiles.position(pairs_[i].key));
        });
        ranges_ = tile_sort(how, pairs_, core::morton_key(corner + tiles.tiles - 1) + 1);
        if constexpr (core::is_constant<typename Scene::fragment_shader>) all_same_ = core::have_same_values(s.draws);
    }

    status_code code = status_code::ok;
    counters counts{};

    [[nodiscard]] std::size_t num_tiles() const { return ranges_.size(); }
    [[nodiscard]] std::uint64_t key(std::size_t i) const { return ranges_[i].tile; }

    struct no_scratch {};
    [[nodiscard]] std::unique_ptr<no_scratch> make_scratch() const { return nullptr; }
    // `box`: the tile, or what is drawn of it.
    template <class... Targets>
    void draw(std::size_t i, const core::voxel_box& box, bool keeps_sums, const no_scratch*,
              sparse_scratch<Targets...>& scratch) const {
        const tile_range& range = ranges_[i];
        const std::uint32_t* const primitives = &pairs_[range.first].primitive;
        const std::size_t count = range.last - range.first;
        constexpr std::size_t stride = sizeof(tile_pair<std::uint64_t>);
        if constexpr (core::is_constant<typename Scene::fragment_shader>) {
            if (all_same_ && !keeps_sums) {
                if (needs_repeats(scratch.view)) {
                    scratch.count_repeats();
                    cover_tile<Rule, true>(s_, box, primitives, stride, count, scratch.constant);
                } else {
                    cover_tile<Rule, false>(s_, box, primitives, stride, count, scratch.constant);
                }
                scratch.end_constant(s_.draws[0].fragment_shader.values);
                return;
            }
        }
        raster_tile<Rule, true>(s_, box, glm::ivec3(0), primitives, stride, count, scratch.view, scratch.shaded);
        scratch.end_shaded();
    }

private:
    const Scene& s_;
    raw_array<tile_pair<std::uint64_t>> pairs_;
    std::vector<tile_range> ranges_;
    bool all_same_ = false;
};

// Draws nothing: what vp::clear does.
struct empty_source {
    [[nodiscard]] std::size_t num_tiles() const { return 0; }
    [[nodiscard]] std::uint64_t key(std::size_t) const { return 0; }
    struct no_scratch {};
    [[nodiscard]] std::unique_ptr<no_scratch> make_scratch() const { return nullptr; }
    template <class... Targets>
    void draw(std::size_t, const core::voxel_box&, bool, const no_scratch*, sparse_scratch<Targets...>&) const {}
};

// A tile that has bricks after the call, or may have: what is drawn there, and the bricks that it has before.
struct sparse_tile {
    static constexpr std::size_t none = ~std::size_t{0};
    std::uint64_t key;
    std::size_t source;
    std::size_t first_brick, last_brick;
};

template <class Source, class Contents>
[[nodiscard]] std::vector<sparse_tile> join_tiles(const Source& source, const Contents& before, bool keeps_voxels) {
    std::vector<sparse_tile> tiles;
    const std::size_t bricks = keeps_voxels ? before.keys.size() : 0;
    const std::uint64_t* const keys = before.keys.data();
    std::size_t i = 0, b = 0;
    tiles.reserve(source.num_tiles());
    while (i < source.num_tiles() || b < bricks) {
        std::uint64_t key = ~std::uint64_t{0};
        if (i < source.num_tiles()) key = source.key(i);
        if (b < bricks) key = std::min(key, keys[b] / tile_bricks);
        sparse_tile tile{key, sparse_tile::none, b, b};
        if (i < source.num_tiles() && source.key(i) == key) tile.source = i++;
        while (b < bricks && keys[b] / tile_bricks == key) ++b;
        tile.last_brick = b;
        tiles.push_back(tile);
    }
    return tiles;
}

// Copies `count` bits to the place `first` of an array that is zero from there on.
inline void append_bits(std::uint32_t* to, std::uint64_t first, const std::uint32_t* from, std::uint64_t count) {
    const auto shift = static_cast<unsigned>(first % 32);
    to += first / 32;
    for (std::uint64_t w = 0; w < (count + 31) / 32; ++w) {
        const std::uint64_t bits = std::uint64_t{from[w]} << shift;
        to[w] |= static_cast<std::uint32_t>(bits);
        if ((bits >> 32) != 0) to[w + 1] |= static_cast<std::uint32_t>(bits >> 32);
    }
}

// Tiles of the framebuffer that stay: what bricks with these keys, list by list, have not taken.
template <class Backend, class... Targets>
[[nodiscard]] core::kept_tiles<Backend> find_kept_tiles(Backend& backend,
                                                        const sparse_framebuffer<Backend, Targets...>& fb,
                                                        const std::vector<std::vector<std::uint64_t>>& lists) {
    std::vector<std::uint64_t> keys;
    for (const auto& l : lists) keys.insert(keys.end(), l.begin(), l.end());
    return core::keep_tiles(backend, fb.contents().tiles, keys.data(), keys.size());
}

// Lists of consecutive stretches of tiles become the arrays of the result, which has room for `num_tiles` values more;
// each list is freed once it is copied.
template <class Backend, class... Targets>
[[nodiscard]] sparse_contents<Backend, Targets...>
join_lists(const execution& how, Backend& backend, const sparse_plan<Targets...>& plan,
           std::vector<std::unique_ptr<brick_list<Targets...>>>& lists, std::uint64_t num_tiles) {
    using contents = sparse_contents<Backend, Targets...>;
    struct place {
        std::uint64_t brick, voxel;
    };
    std::vector<place> places(lists.size());
    place total{0, 0};
    for (std::size_t i = 0; i < lists.size(); ++i) {
        places[i] = total;
        total.brick += lists[i]->keys.size();
        total.voxel += lists[i]->num_voxels;
    }
    contents out(backend);
    out.num_voxels = total.voxel;
    out.keys = typename contents::template buffer<std::uint64_t>(backend, total.brick);
    out.masks = typename contents::template buffer<brick_mask>(backend, total.brick);
    out.offsets = typename contents::template buffer<std::uint64_t>(backend, total.brick == 0 ? 0 : total.brick + 1);
    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename core::pack_element<I, Targets...>::type;
        using map = core::rank_map<target>;
        const auto& t = get<I>(plan.targets);
        if (!t.enabled) return;
        get<I>(out.values) =
            typename contents::template buffer<typename map::element>(backend, map::elements(total.voxel + num_tiles));
        if (t.keeps_sums)
            get<I>(out.sums) =
                typename contents::template buffer<core::kept_sum<target>>(backend, total.voxel + num_tiles);
        if constexpr (map::is_bit) { // lists share words
            std::fill_n(get<I>(out.values).data(), get<I>(out.values).size(), 0u);
            for (std::size_t i = 0; i < lists.size(); ++i)
                append_bits(get<I>(out.values).data(), places[i].voxel, get<I>(lists[i]->values).data(),
                            lists[i]->num_voxels);
        }
    });
    parallel_for(how.threads, lists.size(), [&](unsigned, std::size_t i) {
        const brick_list<Targets...>& from = *lists[i];
        const std::uint64_t brick = places[i].brick, voxel = places[i].voxel;
        std::copy(from.keys.begin(), from.keys.end(), out.keys.data() + brick);
        std::copy(from.masks.begin(), from.masks.end(), out.masks.data() + brick);
        std::uint64_t offset = voxel;
        for (std::size_t b = 0; b < from.masks.size(); ++b) {
            out.offsets.data()[brick + b] = offset;
            offset += from.masks[b].count();
        }
        // Targets that are off have no values, and most have no sums.
        const auto append = [voxel](const auto& list, auto& all) {
            if (!list.empty()) std::copy(list.begin(), list.end(), all.data() + voxel);
        };
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
            if constexpr (!map::is_bit) append(get<I>(from.values), get<I>(out.values));
            append(get<I>(from.sums), get<I>(out.sums));
        });
        lists[i].reset();
    });
    if (total.brick != 0) out.offsets.data()[total.brick] = total.voxel;
    return out;
}

// Draws a source in the grid `g` and makes the result the framebuffer's contents. `result` has what the source has
// counted.
template <class Backend, class Source, class... Targets>
[[nodiscard]] status draw_sparse(const execution& how, Backend& backend, const grid& g, const Source& source,
                                 bool count_voxels, status result, sparse_framebuffer<Backend, Targets...>& fb) {
    how.enter(stage::fine_raster);
    const sparse_plan<Targets...> plan{fb.targets(), fb.next_background(), core::keeps_voxels(fb)};
    bool keeps_sums = false;
    core::for_each_index<sizeof...(Targets)>(
        [&]<std::size_t I>() { keeps_sums = keeps_sums || get<I>(plan.targets).keeps_sums; });
    const std::vector<sparse_tile> tiles = join_tiles(source, fb.contents(), plan.keeps_voxels);

    constexpr std::size_t block = 32; // tiles of a list
    std::vector<std::unique_ptr<brick_list<Targets...>>> lists((tiles.size() + block - 1) / block);
    std::vector<std::unique_ptr<sparse_scratch<Targets...>>> scratch;
    const auto workers = static_cast<unsigned>(std::min<std::size_t>(how.threads, lists.size()));
    std::vector<decltype(source.make_scratch())> of_source;
    for (unsigned w = 0; w < workers; ++w) {
        scratch.push_back(std::make_unique<sparse_scratch<Targets...>>(plan));
        of_source.push_back(source.make_scratch());
    }
    const core::voxel_box drawn = part_of_aligned(g);
    const glm::ivec3 corner = tile_aligned(g).offset / tile_size;
    std::atomic<std::uint64_t> bricks{0}, voxels{0};
    const bool has_tiles = plan.keeps_voxels && fb.num_tiles() != 0;
    std::vector<std::vector<std::uint64_t>> keys(has_tiles ? lists.size() : 0); // of bricks
    {
        const stopwatch watch(how.times, &stage_times::fine_raster);
        progress_meter meter(how, tiles.size());
        parallel_for(how.threads, lists.size(), [&](unsigned worker, std::size_t l) {
            auto& mine = *scratch[worker];
            mine.found.clear();
            for (std::size_t i = l * block; i < std::min(tiles.size(), (l + 1) * block); ++i) {
                const sparse_tile& tile = tiles[i];
                const glm::ivec3 low = (core::morton_position(tile.key) - corner) * tile_size;
                const core::voxel_box whole{{{low.x, low.y, low.z}},
                                            {{low.x + tile_size - 1, low.y + tile_size - 1, low.z + tile_size - 1}}};
                const core::voxel_box box = core::intersect(whole, drawn);
                mine.begin(lowest(box) - low);
                if (tile.first_brick != tile.last_brick)
                    mine.take_over(fb.contents(), tile.first_brick, tile.last_brick);
                if (tile.source != sparse_tile::none && has_tiles) mine.take_over_tiles(fb.contents(), tile.key);
                if (tile.source != sparse_tile::none)
                    source.draw(tile.source, box, keeps_sums, of_source[worker].get(), mine);
                mine.pack_bricks(tile.key);
                meter.advance();
            }
            const std::uint64_t b = bricks += mine.found.keys.size(), v = voxels += mine.found.num_voxels;
            if (has_tiles) keys[l] = mine.found.keys;
            // Beyond the limits only the need is counted.
            if (b <= fb.limits().bricks && v <= fb.limits().voxels)
                lists[l] = std::make_unique<brick_list<Targets...>>(mine.found);
        });
    }
    core::kept_tiles<Backend> kept(backend);
    if (has_tiles) kept = find_kept_tiles(backend, fb, keys);
    bricks += kept.size();
    voxels += kept.size();
    if (bricks > fb.limits().bricks || voxels > fb.limits().voxels) {
        status failed = core::failure(status_code::capacity_exceeded, stage::fine_raster);
        failed.counts.triangles_in = result.counts.triangles_in;
        failed.required.bricks = bricks;
        failed.required.voxels = voxels;
        return failed;
    }
    for (const auto& w : scratch) {
        const counters both[] = {w->shaded.counts, w->constant.counts}; // named for nvcc
        for (const counters& c : both) {
            result.counts.fragments += c.fragments;
            result.counts.fragments_discarded += c.fragments_discarded;
            result.counts.voxels += c.voxels;
        }
    }
    if (!count_voxels) result.counts.voxels = 0;
    scratch.clear();
    const stopwatch watch(how.times, &stage_times::tile_resolve);
    how.enter(stage::tile_resolve);
    sparse_contents<Backend, Targets...> made = join_lists(how, backend, plan, lists, kept.size());
    core::store_kept_tiles(backend, fb, kept, made);
    fb.take(std::move(made), g);
    return result;
}

template <coverage Rule, class Backend, class Scene, class... Targets>
[[nodiscard]] status draw_sparse_surface(const execution& how, Backend& backend, const grid& g, const Scene& s,
                                         bool count_voxels, sparse_framebuffer<Backend, Targets...>& fb) {
    const surface_source<Rule, Scene> source(how, s);
    if (source.code != status_code::ok) {
        status failed = core::failure(source.code, stage::coarse_raster);
        failed.counts.triangles_in = s.first_primitive.back();
        return failed;
    }
    status result;
    result.counts = source.counts;
    return draw_sparse(how, backend, g, source, count_voxels, result, fb);
}

} // namespace voxelpipe::cpu
