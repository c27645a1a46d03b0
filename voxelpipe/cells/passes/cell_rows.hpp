// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Passes that list the terms of triangles by row and voxel, and look at the rows' sums. Functors for Backend::for_each,
// the same on every backend.

#include <voxelpipe/cells/passes/cell_sums.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// Classifies a triangle, and calls visit(y, z, slot, terms) for its terms.
VOXELPIPE_ANY_CALLABLE
template <class Terms, class Visit>
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
            areas = ratio_of(t, mesh.areas);
        }
        const cell_box box = make_cell_box(t, extent);
        for_each_cell<Terms>(
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

// Counts a triangle that is not drawn. Cones are nobody's triangles.
VOXELPIPE_HD inline void count_triangle(const cell_mesh& mesh, std::uint64_t i, triangle_class kind,
                                        std::uint64_t* counts) {
    if (i >= mesh.num_drawn) return;
    if (kind == triangle_class::nonfinite) add_count(counts, cell_count::nonfinite, 1);
    if (kind == triangle_class::too_far) add_count(counts, cell_count::too_far, 1);
    if (kind == triangle_class::outside) add_count(counts, cell_count::outside, 1);
}

// Calls emit(key, terms) for a triangle's terms.
VOXELPIPE_ANY_CALLABLE
template <class Terms, class Emit>
VOXELPIPE_HD triangle_class emit_cells(const cell_mesh& mesh, const cell_keys& keys_of, std::uint64_t i, Emit&& emit) {
    const std::uint64_t body = keys_of.bodies == 1 ? 0 : mesh.draw_of(i);
    VOXELPIPE_CALLS_ANY
    const auto visit = [&](std::uint64_t y, std::uint64_t z, std::uint64_t slot, const Terms& of_voxel) {
        Terms terms = of_voxel;
        if constexpr (has_sheets<Terms>) terms.triangle = static_cast<std::uint32_t>(i);
        emit(keys_of.key(y, z, body, slot), terms);
    };
    VOXELPIPE_CALLS_ANY_END
    return visit_cells<Terms>(mesh, i, visit);
}

// |cover| in units of 2^-20, rounded up.
[[nodiscard]] VOXELPIPE_HD inline std::uint64_t size_of_cover(std::int64_t cover) {
    return (static_cast<std::uint64_t>(cover < 0 ? -cover : cover) + 0xffffffu) >> 24;
}

// What a backend's threads keep until all of them are counted (Backend::collect). The terms of a voxel that one block
// of triangles has become one. At most 1024 triangles are a block.
template <class Terms>
struct cell_record {
    std::uint64_t key;
    Terms terms;
    std::uint32_t size; // of the covers, at most 2^20 each

    void merge(const cell_record& other) requires(!has_sheets<Terms>) { // which need all triangles
        size += other.size;
        const auto add = [](std::int64_t& to, std::int64_t v) { // sums may wrap on their way
            to = static_cast<std::int64_t>(static_cast<std::uint64_t>(to) + static_cast<std::uint64_t>(v));
        };
        const Terms& t = other.terms;
        add(terms.cover, t.cover);
        add(terms.volume, t.volume);
        if constexpr (has_cover_moments<Terms>) {
            add(terms.cover_y, t.cover_y);
            add(terms.cover_z, t.cover_z);
        }
        if constexpr (has_moments<Terms>) {
            add(terms.volume_x, t.volume_x);
            add(terms.volume_y, t.volume_y);
            add(terms.volume_z, t.volume_z);
        }
        if constexpr (has_areas<Terms>) { // of a triangle less than 2^45, so these do not wrap
            add(terms.area, t.area);
            add(terms.area_x, t.area_x);
            add(terms.area_y, t.area_y);
            add(terms.area_z, t.area_z);
        }
    }
};
template <class Terms>
struct collect_cells {
    cell_mesh mesh;
    cell_keys keys_of;
    std::uint64_t* counts;

    template <class Add>
    void operator()(std::uint64_t i, const Add& add) const {
        const triangle_class kind = emit_cells<Terms>(mesh, keys_of, i, [&](std::uint64_t key, const Terms& terms) {
            add(cell_record<Terms>{key, terms, static_cast<std::uint32_t>(size_of_cover(terms.cover))});
        });
        count_triangle(mesh, i, kind, counts);
    }
};
template <class Terms>
struct store_record {
    std::uint64_t* keys;
    std::uint32_t *order, *sizes;
    Terms* terms;

    void operator()(std::uint64_t to, const cell_record<Terms>& r) const {
        keys[to] = r.key;
        order[to] = static_cast<std::uint32_t>(to);
        terms[to] = r.terms;
        if (sizes != nullptr) sizes[to] = r.size;
    }
};

// Finds open rows, and rows whose sums might wrap. i: a row of a body; of the listed rows, if there is a list.
template <class Terms>
struct measure_rows {
    record_list<Terms> list;
    bool checks_size;
    std::uint64_t* counts;
    const std::uint64_t* rows = nullptr;  // of the grid
    const std::uint32_t* sizes = nullptr; // of merged terms; null: of each term's cover

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (rows != nullptr) i = rows[i / list.keys_of.bodies] * list.keys_of.bodies + i % list.keys_of.bodies;
        const std::uint64_t end_key = (i + 1) * list.keys_of.slots;
        std::uint64_t sum = 0, size = 0;
        for (std::uint64_t at = list.find(i * list.keys_of.slots); at < list.count && list.keys[at] < end_key; ++at) {
            const std::int64_t cover = list.terms[list.order[at]].cover;
            sum += static_cast<std::uint64_t>(cover);
            size += sizes != nullptr ? sizes[list.order[at]] : size_of_cover(cover);
        }
        if (sum != 0) add_count(counts, cell_count::open_rows, 1);
        if (checks_size && size > std::uint64_t{1} << 38) add_count(counts, cell_count::too_large, 1);
    }
};

} // namespace voxelpipe::core::passes
