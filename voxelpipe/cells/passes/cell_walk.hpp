// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Goes along a row of the grid with all its bodies, and shades what is cut or inside; and shade_cells, which blends
// that into a framebuffer. Between voxels with terms nothing but a fragment's place changes, so a caller whose shader
// ignores that is shown such voxels as a run.

#include <voxelpipe/cells/passes/cell_rows.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <cstddef>
#include <cstdint>

namespace voxelpipe::core::passes {

// The float nearest to a multiple of u; never -0.
[[nodiscard]] VOXELPIPE_HD inline float to_fraction(std::int64_t units) {
    return exact::mul(exact::to_float(units), 0x1p-44f); // exact: a power of two
}

// What the shaded voxels add to the counts.
struct cell_tally {
    std::uint64_t cut = 0, below = 0, above = 0, fragments = 0, discarded = 0, voxels = 0, lost = 0;
    int128 volume = 0;

    VOXELPIPE_HD void add_to(std::uint64_t* counts) const {
        add_count(counts, cell_count::cut_voxels, cut);
        add_count(counts, cell_count::below_zero, below);
        add_count(counts, cell_count::above_one, above);
        add_count(counts, cell_count::fragments, fragments);
        add_count(counts, cell_count::discarded, discarded);
        add_count(counts, cell_count::voxels, voxels);
        add_count(counts, cell_count::lost_centroids, lost);
        add_count(counts, cell_count::volume_low, static_cast<std::uint64_t>(volume) & 0xffffffffu);
        add_count(counts, cell_count::volume_middle, static_cast<std::uint64_t>(volume) >> 32);
        add_count(counts, cell_count::volume_high, static_cast<std::uint64_t>(volume >> 64));
    }
};

// The voxel (w along the rows, u, v along the two other axes) of the part of the grid.
[[nodiscard]] VOXELPIPE_HD inline glm::ivec3 place_in_part(int w, int u, int v, int axis) {
    return axis == 0 ? glm::ivec3(w, u, v) : axis == 1 ? glm::ivec3(v, w, u) : glm::ivec3(u, v, w);
}

template <class CellShader>
struct cell_walk {
    using fragment = cell_fragment_of<CellShader>;
    using terms_type = terms_of_needs<needs_of_cells<fragment>>;
    using cursor = cell_cursor<terms_type>;

    record_list<terms_type> list;
    cell_mesh mesh;
    const CellShader* shaders; // one a body
    cursor* cursors;           // one a body, for each place that rows are given; null with one body
    glm::ivec3 offset;
    int axis, row_extent;

    // Goes along a row of the grid; place: of its cursors. For each voxel that keeps a fragment, or for each run of
    // them (unless Each), calls visit.begin(voxel in the part), visit.add(body, values) for the fragments by ascending
    // body, and visit.end(voxel, w, end), of the voxels [w, end) of the row.
    VOXELPIPE_ANY_CALLABLE
    template <bool Each, class Visit>
    VOXELPIPE_HD void go(std::uint64_t row, std::uint64_t place, cell_tally& tally, Visit& visit) const {
        const std::uint64_t bodies = list.keys_of.bodies, first = row * bodies, slots = list.keys_of.slots;
        cursor one{};
        cursor* const all = cursors != nullptr ? cursors + place * bodies : &one;
        bool has_any = false;
        for (std::uint64_t b = 0; b < bodies; ++b) {
            all[b] = {list.find((first + b) * slots), (first + b) * slots, 0, 0, 0};
            const std::uint64_t at = all[b].at;
            has_any = has_any || (at < list.count && list.keys[at] < (first + b + 1) * slots);
            all[b].aperture = static_cast<std::int64_t>(all[b].take(list).cover);
        }
        if (!has_any) return;
        // The next voxel with terms, or one behind the row.
        const auto find_next = [&] {
            auto next = static_cast<std::uint64_t>(row_extent);
            for (std::uint64_t b = 0; b < bodies; ++b) {
                if (all[b].at >= list.count) continue;
                const std::uint64_t voxel = list.keys[all[b].at] - (first + b) * slots - 1; // of other rows: far
                next = voxel < next ? voxel : next;
            }
            return static_cast<int>(next);
        };
        const auto u = static_cast<int>(row % list.keys_of.rows_y), v = static_cast<int>(row / list.keys_of.rows_y);
        int next = find_next();
        for (int w = 0; w < row_extent;) {
            const bool has_terms = w == next;
            if (!has_terms) {
                bool is_inside = false;
                for (std::uint64_t b = 0; b < bodies; ++b) is_inside = is_inside || all[b].aperture != 0;
                if (!is_inside) {
                    w = next;
                    continue;
                }
            }
            const int end = Each || has_terms ? w + 1 : next;
            shade(all, first, {w, u, v}, end, tally, visit);
            if (has_terms) next = find_next();
            w = end;
        }
    }

    // Shades voxels for a body: the one at `at` and those behind it up to `end`, which differ in their place alone;
    // none whose sums are 0. aperture: before them; behind: the end of their terms. Sets is_drawn where it is the first
    // fragment that is kept.
    VOXELPIPE_ANY_CALLABLE
    template <class Visit>
    VOXELPIPE_HD void shade_body(std::uint64_t body, const glm::ivec3& at, int end,
                                 const typename cursor::slot_sums& sums, std::int64_t aperture, std::uint64_t behind,
                                 bool& is_drawn, cell_tally& tally, Visit& visit) const {
        constexpr std::int64_t unit = std::int64_t{1} << cell_unit_bits, margin = std::int64_t{1} << 20;
        const auto n = static_cast<std::uint64_t>(end - at.x);
        const auto units = static_cast<std::int64_t>(static_cast<std::uint64_t>(aperture) + sums.volume);
        if (!sums.has_any && units == 0) return;
        const auto next = static_cast<std::int64_t>(static_cast<std::uint64_t>(aperture) + sums.cover);
        const glm::ivec3 p = place_in_part(at.x, at.y, at.z, axis);
        tally.cut += sums.has_any ? n : 0;
        tally.below += units < -margin ? n : 0;
        tally.above += units > unit + margin ? n : 0;
        tally.volume += static_cast<int128>(units) * static_cast<std::int64_t>(n);
        fragment f{};
        static_cast<cell_fragment&>(f) = {
            p + offset, static_cast<std::uint32_t>(body), sums.has_any, to_fraction(units), units, aperture, next};
        tally.lost += measure_cell(mesh, list, axis, at, behind, sums, f) ? 0 : n;
        const auto out = shaders[body](f);
        if (!out.keep) {
            tally.discarded += n;
            return;
        }
        tally.fragments += n;
        if (!is_drawn) visit.begin(p);
        is_drawn = true;
        visit.add(static_cast<std::uint32_t>(body), out.values);
    }

private:
    // at: the first voxel along the rows and the two other axes.
    VOXELPIPE_ANY_CALLABLE
    template <class Visit>
    VOXELPIPE_HD void shade(cursor* all, std::uint64_t first, const glm::ivec3& at, int end, cell_tally& tally,
                            Visit& visit) const {
        bool is_drawn = false;
        for (std::uint64_t b = 0; b < list.keys_of.bodies; ++b) {
            all[b].next_key = (first + b) * list.keys_of.slots + static_cast<std::uint64_t>(at.x) + 1;
            const auto sums = all[b].take(list);
            const std::int64_t aperture = all[b].aperture;
            all[b].aperture = static_cast<std::int64_t>(static_cast<std::uint64_t>(aperture) + sums.cover);
            shade_body(b, at, end, sums, aperture, all[b].at, is_drawn, tally, visit);
        }
        if (!is_drawn) return;
        visit.end(place_in_part(at.x, at.y, at.z, axis), at.x, end);
        tally.voxels += static_cast<std::uint64_t>(end - at.x);
    }
};

// A voxel, or a run of voxels, that takes fragments for a framebuffer.
template <class... Targets>
struct blended_voxel {
    const framebuffer_view<Targets...>& fb;
    int axis; // that runs lie along
    // What the targets sum a voxel's fragments in, which is rounded once.
    pack<decltype(Targets::traits::begin(typename Targets::value_type{}))...> sums;

    VOXELPIPE_HD void begin(const glm::ivec3& p) {
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target_type = typename pack_element<I, Targets...>::type;
            using map = typename target_type::map;
            const auto& t = voxelpipe::get<I>(fb.targets);
            if (t.load == load_operation::off) return;
            if constexpr (map::is_bit) // other rows may change other bits of the word
                voxelpipe::get<I>(sums) = target_type::traits::begin(
                    (load_shared(t.elements[map::cell(t.extent, p.x, p.y, p.z)]) >> (p.x & 31) & 1u) != 0);
            else
                voxelpipe::get<I>(sums) = target_type::traits::begin(map::load(t.elements, t.extent, p.x, p.y, p.z));
        });
    }
    template <class Values>
    VOXELPIPE_HD void add(std::uint32_t, const Values& values) {
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            pack_element<I, Targets...>::type::traits::apply(voxelpipe::get<I>(sums), voxelpipe::get<I>(values));
        });
    }
    VOXELPIPE_HD void end(const glm::ivec3& p, int first, int last) const {
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target_type = typename pack_element<I, Targets...>::type;
            using map = typename target_type::map;
            const auto& t = voxelpipe::get<I>(fb.targets);
            if (t.load == load_operation::off) return;
            const auto value = target_type::traits::end(voxelpipe::get<I>(sums));
            glm::ivec3 at = p;
            for (int i = first; i < last; ++i, ++at[axis])
                if constexpr (map::is_bit)
                    store_shared(t.elements[map::cell(t.extent, at.x, at.y, at.z)], 1u << (at.x & 31), value);
                else
                    map::store(t.elements, t.extent, at.x, at.y, at.z, value);
        });
    }
};

// Shades the voxels of a row, and blends them. i: a row of the grid, with all its bodies.
template <class CellShader, class... Targets>
struct shade_cells {
    cell_walk<CellShader> walk;
    framebuffer_view<Targets...> fb;
    std::uint64_t* counts;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        cell_tally tally;
        blended_voxel<Targets...> voxel{fb, walk.axis, {}};
        bool goes_by_runs = false; // whose voxels had one value before, and get one
        if constexpr (ignores_voxel<CellShader>) goes_by_runs = is_cleared();
        if constexpr (ignores_voxel<CellShader>)
            if (goes_by_runs) walk.template go<false>(i, i, tally, voxel);
        if (!goes_by_runs) walk.template go<true>(i, i, tally, voxel);
        tally.add_to(counts);
    }

private:
    [[nodiscard]] VOXELPIPE_HD bool is_cleared() const {
        bool all = true;
        for_each_index<sizeof...(Targets)>(
            [&]<std::size_t I>() { all = all && voxelpipe::get<I>(fb.targets).load != load_operation::load; });
        return all;
    }
};

} // namespace voxelpipe::core::passes
