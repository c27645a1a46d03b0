// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bricks and tiles of a solid whose voxels all have one value, from its rows, on any backend. Bricks that are partly
// inside get masks; those that are wholly inside are part of the largest cubes that are, which become tiles. Nothing is
// ever in proportion to the volume.

#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/sparse/passes/kept_tiles.hpp>
#include <voxelpipe/sparse/passes/row_runs.hpp>
#include <voxelpipe/sparse/sparse.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// True if a second fragment of the same value changes nothing.
template <class Blend>
inline constexpr bool ignores_repeats =
    std::is_same_v<Blend, blend::replace> || std::is_same_v<Blend, blend::min> || std::is_same_v<Blend, blend::max> ||
    std::is_same_v<Blend, blend::bit_and> || std::is_same_v<Blend, blend::bit_or>;

// True if a solid call whose shader is constant gives all voxels one value. is_drawn(I): target I takes fragments.
template <class... Targets, class Draw, class IsDrawn>
[[nodiscard]] bool has_one_value(std::span<const Draw> draws, const solid_options& options, const IsDrawn& is_drawn) {
    if (options.bodies == bodies::call || draws.size() == 1) return true;
    bool repeats = false;
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using blend_type = typename pack_element<I, Targets...>::type::blend_type;
        repeats = repeats || (is_drawn(I) && !ignores_repeats<blend_type>);
    });
    // Value by value, since between values there may be padding.
    const auto bytes = [](const auto& v) { return std::bit_cast<std::array<std::byte, sizeof(v)>>(v); };
    return !repeats && std::all_of(draws.begin(), draws.end(), [&](const Draw& d) {
        bool equal = true;
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            equal = equal && bytes(voxelpipe::get<I>(d.fragment_shader.values)) ==
                                 bytes(voxelpipe::get<I>(draws[0].fragment_shader.values));
        });
        return equal;
    });
}
// True if a solid call makes tiles: one constant decides every voxel, and nothing that existed stays.
template <class Draw, class Backend, class... Targets>
[[nodiscard]] bool makes_tiles(std::span<const Draw> draws, const solid_options& options,
                               const sparse_framebuffer<Backend, Targets...>& fb) {
    if constexpr (is_constant<std::remove_cvref_t<decltype(draws[0].fragment_shader)>>) {
        bool keeps_sums = false;
        std::array<bool, sizeof...(Targets)> is_drawn{};
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            const auto& t = voxelpipe::get<I>(fb.targets());
            keeps_sums = keeps_sums || t.keeps_sums;
            is_drawn[I] = t.load != load_operation::off;
        });
        return !keeps_sums && !keeps_voxels(fb) &&
               has_one_value<Targets...>(draws, options, [&](std::size_t i) { return is_drawn[i]; });
    } else {
        return false;
    }
}
// The value of target I in the voxels of such a call. background: what they start from.
template <std::size_t I, class Target, class SolidShader>
[[nodiscard]] typename Target::value_type solid_value(const SolidShader& shader, load_operation load,
                                                      const typename Target::value_type& background) {
    using traits = typename Target::traits;
    if (load == load_operation::off) return background;
    auto folded = traits::begin(background);
    if constexpr (std::is_same_v<typename Target::blend_type, blend::count>)
        traits::apply(folded, typename Target::value_type{});
    else
        traits::apply(folded, voxelpipe::get<I>(shader.values));
    return typename Target::value_type(traits::end(folded));
}

// The first row of voxels of each row of bricks, and one more, by way of the rows in between.
struct compose_first_rows {
    const std::uint64_t *of_bricks, *of_fours, *of_twos;
    std::uint64_t* first;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { first[i] = of_twos[of_fours[of_bricks[i]]]; }
};

// The masks of bricks that are listed by key with their rows, and the numbers of their voxels, with a 0 behind the
// last.
struct make_masks {
    const std::uint64_t* keys;
    const std::uint32_t* rows; // of bricks
    std::uint64_t count;
    const std::uint64_t* first_row; // of voxels, for each row of bricks
    const std::uint64_t* row_keys;  // of rows of voxels
    run_view runs;
    brick_mask* masks;
    std::uint32_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == count) {
            counts[i] = 0;
            return;
        }
        brick_mask mask;
        const std::uint32_t low = gather_bits(keys[i]) * 8;
        for (std::uint64_t r = first_row[rows[i]]; r < first_row[rows[i] + 1]; ++r) {
            const std::uint64_t bits = bits_of(r, low);
            // Four voxels along x are bits 0, 1, 8 and 9 of a word.
            const auto within = static_cast<unsigned>(row_keys[r] & 511u);
            mask.words[within >> 6] |= ((bits & 3u) | (bits & 12u) << 6) << (within & 63u);
            mask.words[(within >> 6) + 1] |= ((bits >> 4 & 3u) | (bits >> 4 & 12u) << 6) << (within & 63u);
        }
        masks[i] = mask;
        counts[i] = mask.count();
    }

private:
    // The eight voxels of row r from `low` on.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t bits_of(std::uint64_t r, std::uint32_t low) const {
        const std::uint64_t end = runs.first[r + 1];
        std::uint64_t a = runs.first[r], b = end; // the first run that ends behind `low`
        while (a < b) {
            const std::uint64_t middle = a + (b - a) / 4 * 2;
            if (runs.bounds[middle + 1] <= low)
                a = middle + 2;
            else
                b = middle;
        }
        unsigned bits = 0;
        for (; a < end && runs.bounds[a] < low + 8; a += 2) {
            const std::uint32_t from = runs.bounds[a] > low ? runs.bounds[a] - low : 0;
            const std::uint32_t to = runs.bounds[a + 1] < low + 8 ? runs.bounds[a + 1] - low : 8;
            bits |= (1u << to) - (1u << from);
        }
        return bits;
    }
};

// Cells of 2^log2_bricks bricks a side as tiles.
struct make_tiles {
    const std::uint64_t* keys;
    int log2_bricks;
    std::uint64_t* to;
    std::uint32_t* unused; // moves with `to` in the sort
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        to[i] = brick_tile::of(keys[i] << (3 * log2_bricks), log2_bricks).bits;
        unused[i] = 0;
    }
};

// One value for all ranks; of bits, a word a call.
template <class Target>
struct fill_ranks {
    using map = rank_map<Target>;
    typename map::element* values;
    std::uint64_t count;
    typename Target::value_type value;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if constexpr (map::is_bit) {
            const std::uint64_t left = count - 32 * i;
            values[i] = !value ? 0u : left >= 32 ? ~0u : (1u << left) - 1;
        } else {
            values[i] = value;
        }
    }
};

// Bricks and tiles of the rows of a call that makes_tiles, without values.
template <class Backend, class Contents>
void make_solid_bricks(Backend& backend, found_rows<Backend>&& found, const glm::ivec3& whole_extent, Contents& made) {
    using level_type = row_level<Backend>;
    using list_type = run_list<Backend>;
    if (found.places.size() == 0) return;
    if (std::uint64_t{found.places.size()} >> 32 != 0)
        throw std::length_error("voxelpipe: a solid has 2^32 - 1 rows at most");
    const auto bits_of = [](std::uint64_t most) { return std::max(1, static_cast<int>(std::bit_width(most))); };
    auto [voxel_rows, runs] =
        sort_rows(backend, std::move(found), bits_of(morton_key(0, whole_extent.y - 1, whole_extent.z - 1)));

    const int brick_bits = bits_of(morton_key((whole_extent - 1) / sparse_brick_size));

    // Rows of bricks: what is wholly inside, and what is at all.
    level_type twos = parents_of(backend, voxel_rows), fours = parents_of(backend, twos),
               bricks = parents_of(backend, fours);
    list_type all = runs_of_parents<true>(backend, twos, runs), any = runs_of_parents<false>(backend, twos, runs);
    for (const level_type* level : {&fours, &bricks}) {
        all = runs_of_parents<true>(backend, *level, all);
        any = runs_of_parents<false>(backend, *level, any);
    }
    const auto beams = static_cast<std::size_t>(bricks.size());
    {
        auto cells = list_cells(backend, cells_beyond{bricks.keys.data(), beams, any.view(), all.view(), nullptr, 1});
        any = list_type(backend);
        const std::size_t n = cells.keys.size();
        backend.sort_by_key(cells.keys, cells.rows, brick_bits);
        typename Backend::template buffer<std::uint64_t> first_row(backend, beams + 1);
        backend.for_each(beams + 1, compose_first_rows{bricks.first_child.data(), fours.first_child.data(),
                                                       twos.first_child.data(), first_row.data()});
        typename Backend::template buffer<std::uint32_t> counts(backend, n + 1);
        made.keys = std::move(cells.keys);
        made.masks = typename Backend::template buffer<brick_mask>(backend, n);
        backend.for_each(n + 1, make_masks{made.keys.data(), cells.rows.data(), n, first_row.data(),
                                           voxel_rows.keys.data(), runs.view(), made.masks.data(), counts.data()});
        typename Backend::template buffer<std::uint64_t> offsets(backend, n + 1);
        made.num_voxels = backend.sum(counts, offsets);
        if (n != 0) made.offsets = std::move(offsets);
    }
    runs = list_type(backend);

    // Cubes that no larger one has, level by level.
    std::vector<typename Backend::template buffer<std::uint64_t>> levels; // keys of cubes of 2^level bricks a side
    std::size_t num_tiles = 0;
    level_type here = std::move(bricks);
    while (all.bounds.size() != 0) {
        level_type above = parents_of(backend, here);
        list_type all_above = runs_of_parents<true>(backend, above, all);
        auto cells = list_cells(
            backend, cells_beyond{here.keys.data(), here.size(), all.view(), all_above.view(), here.parent.data(), 2});
        num_tiles += cells.keys.size();
        levels.push_back(std::move(cells.keys));
        here = std::move(above);
        all = std::move(all_above);
    }
    if (num_tiles == 0) return;
    typename Backend::template buffer<std::uint64_t> tiles(backend, num_tiles); // brick_tile::bits
    typename Backend::template buffer<std::uint32_t> unused(backend, num_tiles);
    std::size_t at = 0;
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const int level = static_cast<int>(l);
        backend.for_each(levels[l].size(), make_tiles{levels[l].data(), level, tiles.data() + at, unused.data() + at});
        at += levels[l].size();
        made.tile_voxels += levels[l].size() * brick_tile::of(0, level).num_voxels();
    }
    backend.sort_by_key(tiles, unused, brick_bits + brick_tile::level_bits);
    made.tiles = typename Backend::template buffer<brick_tile>(backend, num_tiles);
    backend.for_each(num_tiles, take_tiles{tiles.data(), made.tiles.data()});
}

// Ends a call that makes_tiles: bricks, tiles and values become the framebuffer's, unless its limits are too low.
// `drawn`: of the call.
template <class Backend, class Draw, class... Targets>
[[nodiscard]] status store_solid_rows(Backend& backend, std::span<const Draw> draws, const grid& g,
                                      found_rows<Backend>&& found, const status& drawn,
                                      sparse_framebuffer<Backend, Targets...>& fb) {
    sparse_contents<Backend, Targets...> made(backend);
    make_solid_bricks(backend, std::move(found), g.whole_extent(), made);
    const std::uint64_t bricks = made.keys.size() + made.tiles.size(), values = made.num_values();
    if (bricks > fb.limits().bricks || values > fb.limits().voxels) {
        status limited = failure(status_code::capacity_exceeded, stage::tile_resolve);
        limited.counts.triangles_in = drawn.counts.triangles_in;
        limited.required.bricks = bricks;
        limited.required.voxels = values;
        return limited;
    }
    made.is_tiled = true;
    const auto background = fb.next_background();
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        using target = typename pack_element<I, Targets...>::type;
        const auto& t = voxelpipe::get<I>(fb.targets());
        if (!t.enabled) return;
        const auto value = solid_value<I, target>(draws[0].fragment_shader, t.load, voxelpipe::get<I>(background));
        const std::size_t n = rank_map<target>::elements(values);
        auto& to = voxelpipe::get<I>(made.values);
        to = typename Backend::template buffer<typename rank_map<target>::element>(backend, n);
        backend.for_each(n, fill_ranks<target>{to.data(), values, value});
    });
    fb.take(std::move(made), g);
    return drawn;
}

} // namespace voxelpipe::core
