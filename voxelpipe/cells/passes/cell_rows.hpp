// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Passes that list the terms of triangles by row and voxel, look at the rows' sums, and shade their voxels. Functors
// for Backend::for_each, the same on every backend.

#include <voxelpipe/cells/passes/cell_sums.hpp>
#include <voxelpipe/framebuffer.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// Classifies a triangle, and calls visit(y, z, slot, terms) for its terms.
VOXELPIPE_ANY_CALLABLE
template <bool OnlyCount, class Terms, class Visit>
VOXELPIPE_HD triangle_class visit_cells(const cell_mesh& mesh, std::uint64_t i, Visit&& visit) {
    const snapped_position a = mesh.corner(i, 0), b = mesh.corner(i, 1), c = mesh.corner(i, 2);
    const triangle_class kind = classify_positions(a, b, c);
    if (kind != triangle_class::drawn) return kind;
    const std::int64_t extent[3] = {mesh.extent.x, mesh.extent.y, mesh.extent.z};
    const voxel_box all = bounds(a, b, c, mesh.fraction);
    for (int axis = 1; axis < 3; ++axis)
        if (all.hi[axis] < 0 || all.lo[axis] >= extent[axis]) return triangle_class::outside;
    const auto run = [&](auto t) {
        area_ratio areas{0, 0.0};
        if constexpr (has_areas<Terms>) {
            lift(t);
            if (!OnlyCount) areas = ratio_of(t, mesh.areas);
        }
        const cell_box box = make_cell_box(t, extent);
        for_each_cell<OnlyCount, Terms>(
            t, box,
            [&](std::int64_t y, std::int64_t z, std::int64_t x, const Terms& terms) {
                visit(static_cast<std::uint64_t>(y - box.lo[1]), static_cast<std::uint64_t>(z - box.lo[2]),
                      static_cast<std::uint64_t>(x - box.lo[0] + 1), terms);
            },
            areas);
    };
    if (is_narrow_cell(a, b, c, mesh.fraction))
        run(make_cell_triangle<std::int64_t>(a, b, c, mesh.fraction));
    else
        run(make_cell_triangle<int128>(a, b, c, mesh.fraction));
    return kind;
}

// The number of a triangle's terms; 0 behind the last triangle, for the sums.
template <class Terms>
struct count_cells {
    cell_mesh mesh;
    std::uint32_t* num_terms;
    std::uint64_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        num_terms[i] = 0;
        if (i == mesh.num_triangles) return;
        std::uint32_t n = 0;
        const triangle_class kind =
            visit_cells<true, Terms>(mesh, i, [&](std::uint64_t, std::uint64_t, std::uint64_t, const Terms&) {
                n += static_cast<std::uint32_t>(n != ~0u);
            });
        num_terms[i] = n;
        if (i >= mesh.num_drawn) return; // cones are nobody's triangles
        if (kind == triangle_class::nonfinite) add_count(counts, cell_count::nonfinite, 1);
        if (kind == triangle_class::too_far) add_count(counts, cell_count::too_far, 1);
        if (kind == triangle_class::outside) add_count(counts, cell_count::outside, 1);
    }
};

template <class Terms>
struct list_cells {
    cell_mesh mesh;
    cell_keys keys_of;
    const std::uint64_t* first_term; // of each triangle
    std::uint64_t* keys;
    std::uint32_t* order;
    Terms* terms;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint64_t to = first_term[i];
        if (first_term[i + 1] == to) return;
        const std::uint64_t body = keys_of.bodies == 1 ? 0 : mesh.draw_of(i);
        visit_cells<false, Terms>(mesh, i,
                                  [&](std::uint64_t y, std::uint64_t z, std::uint64_t slot, const Terms& of_voxel) {
                                      keys[to] = keys_of.key(y, z, body, slot);
                                      order[to] = static_cast<std::uint32_t>(to);
                                      terms[to] = of_voxel;
                                      if constexpr (has_sheets<Terms>)
                                          terms[to].triangle = static_cast<std::uint32_t>(i);
                                      ++to;
                                  });
    }
};

// Finds open rows, and rows whose sums might wrap. i: a row of a body.
template <class Terms>
struct measure_rows {
    record_list<Terms> list;
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
    using fragment = cell_fragment_of<CellShader>;
    using terms_type = terms_of_needs<needs_of_cells<fragment>>;
    using cursor = cell_cursor<terms_type>;

    record_list<terms_type> list;
    cell_mesh mesh;
    const CellShader* shaders; // one a body
    cursor* cursors;           // a row's bodies; null with one body
    framebuffer_view<Targets...> fb;
    glm::ivec3 offset;
    int axis, row_extent;
    std::uint64_t* counts;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const std::uint64_t bodies = list.keys_of.bodies, row = i * bodies, slots = list.keys_of.slots;
        cursor one{};
        cursor* const all = cursors != nullptr ? cursors + row : &one;
        bool has_any = false;
        for (std::uint64_t b = 0; b < bodies; ++b) {
            all[b] = {list.find((row + b) * slots), (row + b) * slots, 0, 0, 0};
            const std::uint64_t at = all[b].at;
            has_any = has_any || (at < list.count && list.keys[at] < (row + b + 1) * slots);
            all[b].aperture = static_cast<std::int64_t>(all[b].take(list).cover);
        }
        if (!has_any) return;
        const auto u = static_cast<int>(i % list.keys_of.rows_y), v = static_cast<int>(i / list.keys_of.rows_y);
        std::uint64_t cut = 0, below = 0, above = 0, fragments = 0, discarded = 0, voxels = 0, lost = 0;
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
                fragment f{};
                static_cast<cell_fragment&>(f) = {
                    p + offset, static_cast<std::uint32_t>(b), sums.has_any, to_fraction(units), units, aperture, next};
                lost += static_cast<std::uint64_t>(!measure_cell(mesh, list, axis, {w, u, v}, all[b].at, sums, f));
                const auto out = shaders[b](f);
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
        add_count(counts, cell_count::lost_centroids, lost);
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
