// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Terms of triangles, listed by row and voxel, and the rows that sum them. A row is one of a body: rows by ascending y,
// then z, each with the bodies in order. In a row, slot 0 stands for all that lies before the grid, slot i + 1 for
// voxel i, and the last slot for all behind. Functors for Backend::for_each, the same on every backend.

#include <voxelpipe/cells/passes/cell_source.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

struct cell_keys {
    std::uint64_t slots; // of a row: its voxels and two more
    std::uint64_t rows_y;
    std::uint64_t bodies; // 1, or the number of draws

    [[nodiscard]] VOXELPIPE_HD std::uint64_t key(std::uint64_t y, std::uint64_t z, std::uint64_t body,
                                                 std::uint64_t slot) const {
        return ((z * rows_y + y) * bodies + body) * slots + slot;
    }
};

// Classifies a triangle, and calls visit(y, z, slot, terms) for its terms.
VOXELPIPE_ANY_CALLABLE
template <bool OnlyCount, class Visit>
VOXELPIPE_HD triangle_class visit_cells(const cell_mesh& mesh, std::uint64_t i, Visit&& visit) {
    const snapped_position a = mesh.corner(i, 0), b = mesh.corner(i, 1), c = mesh.corner(i, 2);
    const triangle_class kind = classify_positions(a, b, c);
    if (kind != triangle_class::drawn) return kind;
    const std::int64_t extent[3] = {mesh.extent.x, mesh.extent.y, mesh.extent.z};
    const voxel_box all = bounds(a, b, c, mesh.fraction);
    for (int axis = 1; axis < 3; ++axis)
        if (all.hi[axis] < 0 || all.lo[axis] >= extent[axis]) return triangle_class::outside;
    const auto run = [&](const auto& t) {
        const cell_box box = make_cell_box(t, extent);
        for_each_cell<OnlyCount>(t, box, [&](std::int64_t y, std::int64_t z, std::int64_t x, const cell_terms& terms) {
            visit(static_cast<std::uint64_t>(y - box.lo[1]), static_cast<std::uint64_t>(z - box.lo[2]),
                  static_cast<std::uint64_t>(x - box.lo[0] + 1), terms);
        });
    };
    if (is_narrow_cell(a, b, c, mesh.fraction))
        run(make_cell_triangle<std::int64_t>(a, b, c, mesh.fraction));
    else
        run(make_cell_triangle<int128>(a, b, c, mesh.fraction));
    return kind;
}

// The number of a triangle's terms; 0 behind the last triangle, for the sums.
struct count_cells {
    cell_mesh mesh;
    std::uint32_t* num_terms;
    std::uint64_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        num_terms[i] = 0;
        if (i == mesh.num_triangles) return;
        std::uint32_t n = 0;
        const triangle_class kind =
            visit_cells<true>(mesh, i, [&](std::uint64_t, std::uint64_t, std::uint64_t, const cell_terms&) {
                n += static_cast<std::uint32_t>(n != ~0u);
            });
        num_terms[i] = n;
        if (kind == triangle_class::nonfinite) add_count(counts, cell_count::nonfinite, 1);
        if (kind == triangle_class::too_far) add_count(counts, cell_count::too_far, 1);
        if (kind == triangle_class::outside) add_count(counts, cell_count::outside, 1);
    }
};

struct list_cells {
    cell_mesh mesh;
    cell_keys keys_of;
    const std::uint64_t* first_term; // of each triangle
    std::uint64_t* keys;
    std::uint32_t* order;
    cell_terms* terms;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint64_t to = first_term[i];
        if (first_term[i + 1] == to) return;
        const std::uint64_t body = keys_of.bodies == 1 ? 0 : find_owner(mesh.first_triangle, mesh.num_draws, i);
        visit_cells<false>(mesh, i,
                           [&](std::uint64_t y, std::uint64_t z, std::uint64_t slot, const cell_terms& of_voxel) {
                               keys[to] = keys_of.key(y, z, body, slot);
                               order[to] = static_cast<std::uint32_t>(to);
                               terms[to] = of_voxel;
                               ++to;
                           });
    }
};

// The sorted terms.
struct record_list {
    cell_keys keys_of;
    const std::uint64_t* keys;
    const std::uint32_t* order;
    const cell_terms* terms;
    std::uint64_t count;

    // The first term whose key is not less.
    [[nodiscard]] VOXELPIPE_HD std::uint64_t find(std::uint64_t key) const {
        std::uint64_t lo = 0, hi = count;
        while (lo < hi) {
            const std::uint64_t middle = lo + (hi - lo) / 2;
            if (keys[middle] < key)
                lo = middle + 1;
            else
                hi = middle;
        }
        return lo;
    }
};

// Goes along a row of a body, slot by slot.
struct cell_cursor {
    std::uint64_t at;       // the next term
    std::uint64_t next_key; // of the next slot
    std::int64_t aperture;  // s: the sum of covers before the voxel

    // Adds up the terms of the next slot, in two's complement: sums may wrap on their way.
    struct slot_sums {
        std::uint64_t cover, volume;
        bool has_any;
    };
    [[nodiscard]] VOXELPIPE_HD slot_sums take(const record_list& list) {
        slot_sums s{0, 0, false};
        for (; at < list.count && list.keys[at] == next_key; ++at) {
            const cell_terms& t = list.terms[list.order[at]];
            s.cover += static_cast<std::uint64_t>(t.cover);
            s.volume += static_cast<std::uint64_t>(t.volume);
            s.has_any = true;
        }
        ++next_key;
        return s;
    }
};

// Finds open rows, and rows whose sums might wrap. i: a row of a body.
struct measure_rows {
    record_list list;
    bool checks_size;
    std::uint64_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t end_key = (i + 1) * list.keys_of.slots;
        std::uint64_t sum = 0, size = 0; // size in units of 2^-20, each term rounded up
        for (std::uint64_t at = list.find(i * list.keys_of.slots); at < list.count && list.keys[at] < end_key; ++at) {
            const std::int64_t cover = list.terms[list.order[at]].cover;
            sum += static_cast<std::uint64_t>(cover);
            size += (static_cast<std::uint64_t>(cover < 0 ? -cover : cover) + 0xffffffu) >> 24;
        }
        if (sum != 0) add_count(counts, cell_count::open_rows, 1);
        if (checks_size && size > std::uint64_t{1} << 38) add_count(counts, cell_count::too_large, 1);
    }
};

// The float nearest to a multiple of u; never -0.
[[nodiscard]] VOXELPIPE_HD inline float to_fraction(std::int64_t units) {
    return exact::mul(exact::to_float(units), 0x1p-44f); // exact: a power of two
}

// Shades the voxels of a row, and blends them. i: a row of the grid, with all its bodies.
template <class CellShader, class... Targets>
struct shade_cells {
    record_list list;
    const CellShader* shaders; // one a body
    cell_cursor* cursors;      // a row's bodies; null with one body
    framebuffer_view<Targets...> fb;
    glm::ivec3 offset;
    int axis, row_extent;
    std::uint64_t* counts;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t bodies = list.keys_of.bodies, row = i * bodies, slots = list.keys_of.slots;
        cell_cursor one{};
        cell_cursor* const all = cursors != nullptr ? cursors + row : &one;
        bool has_any = false;
        for (std::uint64_t b = 0; b < bodies; ++b) {
            all[b] = {list.find((row + b) * slots), (row + b) * slots, 0};
            const std::uint64_t at = all[b].at;
            has_any = has_any || (at < list.count && list.keys[at] < (row + b + 1) * slots);
            all[b].aperture = static_cast<std::int64_t>(all[b].take(list).cover);
        }
        if (!has_any) return;
        const auto u = static_cast<int>(i % list.keys_of.rows_y), v = static_cast<int>(i / list.keys_of.rows_y);
        std::uint64_t cut = 0, below = 0, above = 0, fragments = 0, discarded = 0, voxels = 0;
        int128 volume = 0;
        constexpr std::int64_t unit = std::int64_t{1} << cell_unit_bits, margin = std::int64_t{1} << 20;
        for (int w = 0; w < row_extent; ++w) {
            const glm::ivec3 p = axis == 0   ? glm::ivec3(w, u, v)
                                 : axis == 1 ? glm::ivec3(v, w, u)
                                             : glm::ivec3(u, v, w);
            bool is_drawn = false;
            sums_type blended{};
            for (std::uint64_t b = 0; b < bodies; ++b) {
                const auto sums = all[b].take(list);
                const std::int64_t aperture = all[b].aperture;
                const auto units = static_cast<std::int64_t>(static_cast<std::uint64_t>(aperture) + sums.volume);
                const auto next = static_cast<std::int64_t>(static_cast<std::uint64_t>(aperture) + sums.cover);
                all[b].aperture = next;
                if (!sums.has_any && units == 0) continue;
                cut += static_cast<std::uint64_t>(sums.has_any);
                below += static_cast<std::uint64_t>(units < -margin);
                above += static_cast<std::uint64_t>(units > unit + margin);
                volume += units;
                const auto out = shaders[b](cell_fragment{p + offset, static_cast<std::uint32_t>(b), sums.has_any,
                                                          to_fraction(units), units, aperture, next});
                if (!out.keep) {
                    ++discarded;
                    continue;
                }
                ++fragments;
                if (!is_drawn) load(p, blended);
                is_drawn = true;
                apply(out.values, blended);
            }
            if (is_drawn) store(p, blended);
            voxels += static_cast<std::uint64_t>(is_drawn);
        }
        add_count(counts, cell_count::cut_voxels, cut);
        add_count(counts, cell_count::below_zero, below);
        add_count(counts, cell_count::above_one, above);
        add_count(counts, cell_count::fragments, fragments);
        add_count(counts, cell_count::discarded, discarded);
        add_count(counts, cell_count::voxels, voxels);
        add_count(counts, cell_count::volume_low, static_cast<std::uint64_t>(volume) & 0xffffffffu);
        add_count(counts, cell_count::volume_middle, static_cast<std::uint64_t>(volume) >> 32);
        add_count(counts, cell_count::volume_high, static_cast<std::uint64_t>(volume >> 64));
    }

private:
    // What the targets sum a voxel's fragments in, which is rounded once.
    using sums_type = pack<decltype(Targets::traits::begin(typename Targets::value_type{}))...>;

    VOXELPIPE_HD void load(const glm::ivec3& p, sums_type& sums) const {
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
    VOXELPIPE_HD void apply(const Values& values, sums_type& sums) const {
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            pack_element<I, Targets...>::type::traits::apply(voxelpipe::get<I>(sums), voxelpipe::get<I>(values));
        });
    }
    VOXELPIPE_HD void store(const glm::ivec3& p, const sums_type& sums) const {
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target_type = typename pack_element<I, Targets...>::type;
            using map = typename target_type::map;
            const auto& t = voxelpipe::get<I>(fb.targets);
            if (t.load == load_operation::off) return;
            const auto value = target_type::traits::end(voxelpipe::get<I>(sums));
            if constexpr (map::is_bit)
                store_shared(t.elements[map::cell(t.extent, p.x, p.y, p.z)], 1u << (p.x & 31), value);
            else
                map::store(t.elements, t.extent, p.x, p.y, p.z, value);
        });
    }
};

} // namespace voxelpipe::core::passes
