// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells into an A-buffer on any backend: rows that triangles reach are shaded twice, to count their voxels and
// fragments and to write them. Sparse framebuffers whose voxels make no tiles get theirs from such lists, too.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/cells/passes/cell_passes.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

namespace voxelpipe::core {

namespace passes {

// ---- rows -----------------------------------------------------------------------------------------------------------

// 1 for the first term of a row of the grid; a last element of 0.
struct mark_cell_rows {
    const std::uint64_t* keys;
    std::uint64_t count, keys_a_row;
    std::uint32_t* is_first;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        is_first[i] = i < count && (i == 0 || keys[i] / keys_a_row != keys[i - 1] / keys_a_row) ? 1 : 0;
    }
};
struct list_cell_rows {
    const std::uint64_t* keys;
    std::uint64_t keys_a_row;
    const std::uint32_t* is_first;
    const std::uint64_t* place;
    std::uint64_t* rows; // of the grid, ascending

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (is_first[i] != 0) rows[place[i]] = keys[i] / keys_a_row;
    }
};
// ---- lists ----------------------------------------------------------------------------------------------------------

// Voxels with their outputs, row by row: a payload is all of a fragment's outputs, its one output, or no_payload.
// Counted where `num_voxels` is not null, with a 0 behind the last row.
template <class CellShader, class Payload>
struct list_shaded_cells {
    cell_walk<CellShader> walk;
    const std::uint64_t* rows;
    std::uint64_t num_rows;
    glm::ivec3 extent;
    std::uint64_t* counts; // of the call; null where voxels are written
    std::uint32_t *num_voxels, *num_fragments;
    const std::uint64_t *first_voxel, *first_fragment; // of each row
    std::uint64_t *voxels, *offsets;                   // linear numbers in the part of the grid
    std::uint32_t* bodies;                             // of the fragments; null where nobody asks
    Payload* payloads;

    VOXELPIPE_ANY_CALLABLE
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        cell_tally tally;
        if (num_voxels != nullptr) {
            counted_voxels none;
            if (i < num_rows) walk.template go<true>(rows[i], i, tally, none);
            num_voxels[i] = static_cast<std::uint32_t>(tally.voxels);
            num_fragments[i] = static_cast<std::uint32_t>(tally.fragments);
            tally.add_to(counts);
        } else {
            written_voxels to{*this, first_voxel[i], first_fragment[i]};
            walk.template go<true>(rows[i], i, tally, to);
        }
    }

private:
    struct counted_voxels {
        VOXELPIPE_HD void begin(const glm::ivec3&) {}
        template <class Values>
        VOXELPIPE_HD void add(std::uint32_t, const Values&) {}
        VOXELPIPE_HD void end(const glm::ivec3&, int, int) {}
    };
    struct written_voxels {
        const list_shaded_cells& of;
        std::uint64_t voxel, fragment;

        VOXELPIPE_HD void begin(const glm::ivec3& p) {
            const auto wide = [](int n) { return static_cast<std::uint64_t>(n); };
            of.voxels[voxel] = (wide(p.z) * wide(of.extent.y) + wide(p.y)) * wide(of.extent.x) + wide(p.x);
            of.offsets[voxel++] = fragment;
        }
        template <class Values>
        VOXELPIPE_HD void add(std::uint32_t body, const Values& values) {
            if (of.bodies != nullptr) of.bodies[fragment] = body;
            if constexpr (std::is_same_v<Payload, Values>)
                of.payloads[fragment] = values;
            else if constexpr (!std::is_same_v<Payload, no_payload>)
                of.payloads[fragment] = voxelpipe::get<0>(values);
            ++fragment;
        }
        VOXELPIPE_HD void end(const glm::ivec3&, int, int) {}
    };
};
struct end_offsets {
    std::uint64_t* last;
    std::uint64_t value;
    VOXELPIPE_HD void operator()(std::uint64_t) const { *last = value; }
};

// ---- order ----------------------------------------------------------------------------------------------------------

struct number_voxels {
    std::uint32_t* order;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { order[i] = static_cast<std::uint32_t>(i); }
};
// The numbers of fragments of voxels in another order, with a 0 behind the last one.
struct count_in_order {
    const std::uint64_t* offsets;
    const std::uint32_t* order; // the former places
    std::uint64_t num_voxels;
    std::uint32_t* counts;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        counts[i] =
            i < num_voxels ? static_cast<std::uint32_t>(offsets[order[i] + std::uint64_t{1}] - offsets[order[i]]) : 0;
    }
};
// Their fragments.
template <class Payload>
struct take_in_order {
    const std::uint64_t *from_offsets, *offsets;
    const std::uint32_t *order, *from_bodies;
    const Payload* from_payloads;
    std::uint32_t* bodies;
    Payload* payloads;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        std::uint64_t from = from_offsets[order[i]];
        for (std::uint64_t to = offsets[i]; to < offsets[i + 1]; ++to, ++from) {
            bodies[to] = from_bodies[from];
            if constexpr (!std::is_same_v<Payload, no_payload>) payloads[to] = from_payloads[from];
        }
    }
};

} // namespace passes

// The rows of the grid that terms lie in, ascending.
template <class Backend, class Terms>
[[nodiscard]] typename Backend::template buffer<std::uint64_t> find_cell_rows(Backend& backend,
                                                                              const passes::record_list<Terms>& list) {
    const std::uint64_t keys_a_row = list.keys_of.slots * list.keys_of.bodies;
    typename Backend::template buffer<std::uint32_t> is_first(backend, list.count + 1);
    typename Backend::template buffer<std::uint64_t> place(backend, list.count + 1);
    backend.for_each(list.count + 1, passes::mark_cell_rows{list.keys, list.count, keys_a_row, is_first.data()});
    typename Backend::template buffer<std::uint64_t> rows(backend, backend.sum(is_first, place));
    backend.for_each(list.count,
                     passes::list_cell_rows{list.keys, keys_a_row, is_first.data(), place.data(), rows.data()});
    return rows;
}

// Shades the listed rows of the grid into lists whose voxels are in the order of the rows, with their fragments' bodies
// if asked for. Returns the call's status: size_overflow for more than most_voxels voxels, or more than 2^32 - 1
// fragments in a row; the lists are empty then.
template <class Backend, class CellShader, class Payload>
[[nodiscard]] status shade_into_lists(Backend& backend, listed_cells<Backend, CellShader>& cells,
                                      const typename Backend::template buffer<std::uint64_t>& rows,
                                      const glm::ivec3& extent, bool has_bodies, std::uint64_t most_voxels,
                                      abuffer<Backend, Payload>& lists) {
    using payload = typename abuffer<Backend, Payload>::payload_type;
    using numbers = typename Backend::template buffer<std::uint64_t>;
    using counts = typename Backend::template buffer<std::uint32_t>;
    const std::size_t n = rows.size();
    lists.extent = extent;
    counts num_voxels(backend, n + 1), num_fragments(backend, n + 1);
    numbers first_voxel(backend, n + 1), first_fragment(backend, n + 1);
    passes::list_shaded_cells<CellShader, payload> shade{cells.walk(n),
                                                         rows.data(),
                                                         n,
                                                         extent,
                                                         cells.counts(),
                                                         num_voxels.data(),
                                                         num_fragments.data(),
                                                         first_voxel.data(),
                                                         first_fragment.data(),
                                                         nullptr,
                                                         nullptr,
                                                         nullptr,
                                                         nullptr};
    backend.for_each(n + 1, shade);
    const std::uint64_t voxels = backend.sum(num_voxels, first_voxel);
    const std::uint64_t fragments = backend.sum(num_fragments, first_fragment);
    const status s = cells.result();
    // A row's fragments are counted in 32 bits, all of them in 64.
    if (voxels > most_voxels || fragments != s.counts.fragments) return cells.fail(status_code::size_overflow);
    if (voxels == 0) return s;
    lists.voxels = numbers(backend, static_cast<std::size_t>(voxels));
    lists.offsets = numbers(backend, static_cast<std::size_t>(voxels + 1));
    if (has_bodies) lists.primitives = counts(backend, static_cast<std::size_t>(fragments));
    if constexpr (abuffer<Backend, Payload>::has_payload)
        lists.payloads = typename Backend::template buffer<payload>(backend, static_cast<std::size_t>(fragments));
    shade.num_voxels = nullptr;
    shade.voxels = lists.voxels.data();
    shade.offsets = lists.offsets.data();
    if (has_bodies) shade.bodies = lists.primitives.data();
    shade.payloads = lists.payloads.data();
    backend.for_each(n, shade);
    backend.for_each(1, passes::end_offsets{lists.offsets.data() + voxels, fragments});
    return s;
}

// Puts the voxels of lists into ascending order, each with its fragments. They are fewer than 2^32.
template <class Backend, class Payload>
void sort_voxels(Backend& backend, abuffer<Backend, Payload>& lists) {
    using payload = typename abuffer<Backend, Payload>::payload_type;
    const std::size_t n = lists.num_voxels();
    const glm::ivec3& e = lists.extent;
    const std::uint64_t grid_voxels =
        static_cast<std::uint64_t>(e.x) * static_cast<std::uint64_t>(e.y) * static_cast<std::uint64_t>(e.z);
    typename Backend::template buffer<std::uint32_t> order(backend, n), counts(backend, n + 1);
    backend.for_each(n, passes::number_voxels{order.data()});
    backend.sort_by_key(lists.voxels, order, static_cast<int>(std::bit_width(grid_voxels)));
    abuffer<Backend, Payload> sorted(backend);
    sorted.extent = e;
    sorted.voxels = std::move(lists.voxels);
    sorted.offsets = typename Backend::template buffer<std::uint64_t>(backend, n + 1);
    sorted.primitives = typename Backend::template buffer<std::uint32_t>(backend, lists.num_fragments());
    sorted.payloads = typename Backend::template buffer<payload>(backend, lists.payloads.size());
    backend.for_each(n + 1, passes::count_in_order{lists.offsets.data(), order.data(), n, counts.data()});
    (void)backend.sum(counts, sorted.offsets); // of the last element too: the end
    backend.for_each(n, passes::take_in_order<payload>{lists.offsets.data(), sorted.offsets.data(), order.data(),
                                                       lists.primitives.data(), lists.payloads.data(),
                                                       sorted.primitives.data(), sorted.payloads.data()});
    lists = std::move(sorted);
}

// Implements voxelize_cells into an A-buffer on any backend. Arguments are validated. Throws what the backend's buffers
// throw.
template <class Backend, class Mesh, class VertexShader, class CellShader, class Payload>
[[nodiscard]] status run_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                               const grid& g, abuffer<Backend, Payload>& lists, const cell_options& options,
                               std::uint64_t triangles_in) {
    status failed;
    if (has_too_many_vertices<Backend>(draws, triangles_in, failed)) return failed;
    listed_cells<Backend, CellShader> cells(backend, draws, g, options, triangles_in);
    if (const status s = cells.list(); !s.ok()) return s;
    const auto rows = find_cell_rows(backend, cells.terms());
    if (const status s = cells.measure(rows.size(), rows.data()); !s.ok()) return s;
    abuffer<Backend, Payload> made(backend); // so that a call that fails leaves `lists` as they were
    const std::uint64_t most = options.axis == 0 ? ~std::uint64_t{0} : listed_cells<Backend, CellShader>::most - 1;
    const status s = shade_into_lists(backend, cells, rows, g.extent, true, most, made);
    if (!s.ok()) return s;
    if (options.axis != 0 && made.num_voxels() != 0) sort_voxels(backend, made);
    lists = std::move(made);
    return s;
}

} // namespace voxelpipe::core
