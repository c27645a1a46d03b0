// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells into a sparse framebuffer on any backend: rows that triangles reach are shaded into runs of equal
// values, and the runs become bricks and tiles; or their fragments are listed, and the lists become bricks.

#include <voxelpipe/cells/passes/cell_bricks.hpp>
#include <voxelpipe/cells/passes/cell_lists.hpp>
#include <voxelpipe/cells/passes/cell_runs.hpp>
#include <voxelpipe/cells/sparse_cells.hpp>
#include <voxelpipe/sparse/passes/all_outputs.hpp>
#include <voxelpipe/sparse/passes/solid_bricks.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// The runs of a level's rows, and a run of voxels that has the value of each.
template <class Backend>
struct equal_runs {
    run_list<Backend> runs;
    typename Backend::template buffer<std::uint32_t> sources;

    explicit equal_runs(Backend& backend) : runs(backend), sources(backend, std::size_t{0}) {}
};

// Bricks and tiles of a call's cells, without values.
template <class Backend, class Contents>
class cell_bricks {
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using level_type = row_level<Backend>;

public:
    // values: of the runs of voxels, in the backend's memory, as all that is given here.
    template <class Values>
    cell_bricks(Backend& backend, level_type&& voxel_rows, const run_list<Backend>& runs, const Values* values,
                const glm::ivec3& whole_extent, int axis, Contents& made)
        : backend_(backend), axis_(axis), key_bits_(bits_of(morton_key((whole_extent - 1) / sparse_brick_size))),
          voxel_rows_(std::move(voxel_rows)), runs_(runs), rows_(backend, std::size_t{0}),
          first_row_(backend, std::size_t{0}), sources_(backend, std::size_t{0}) {
        // Rows of bricks: what is one value, and what is at all.
        level_type twos = parents_of(backend, voxel_rows_), fours = parents_of(backend, twos),
                   bricks = parents_of(backend, fours);
        equal_runs<Backend> all(backend);
        all = equal_parents(twos, runs, nullptr, values);
        run_list<Backend> any = runs_of_parents<false>(backend, twos, runs);
        for (const level_type* level : {&fours, &bricks}) {
            all = equal_parents(*level, all.runs, all.sources.data(), values);
            any = runs_of_parents<false>(backend, *level, any);
        }
        const auto beams = static_cast<std::size_t>(bricks.size());
        first_row_ = buffer<std::uint64_t>(backend, beams + 1);
        backend.for_each(beams + 1, compose_first_rows{bricks.first_child.data(), fours.first_child.data(),
                                                       twos.first_child.data(), first_row_.data()});
        make_bricks(
            list_cells(backend, cells_beyond{bricks.keys.data(), beams, any.view(), all.runs.view(), nullptr, 1}),
            made);
        any = run_list<Backend>(backend);
        make_tiles(std::move(bricks), std::move(all), values, made);
    }

    // Stores the values of target I of all ranks; `made` is what the constructor made.
    template <std::size_t I, class Target, class Values>
    void store_values(const Values* values, const Contents& made, typename rank_map<Target>::element* to) {
        const std::size_t n = made.keys.size();
        if constexpr (rank_map<Target>::is_bit)
            backend_.for_each(rank_map<Target>::elements(made.num_values()), pool::zero_words{to});
        backend_.for_each(std::uint64_t{64} * n,
                          passes::store_brick_values<I, Target, Values>{rows_of(made), made.masks.data(),
                                                                        made.offsets.data(), values, to});
        backend_.for_each(sources_.size(),
                          passes::store_tile_values<I, Target, Values>{sources_.data(), values, made.num_voxels, to});
    }

private:
    [[nodiscard]] static int bits_of(std::uint64_t most) { return std::max(1, static_cast<int>(std::bit_width(most))); }

    template <class Values>
    [[nodiscard]] equal_runs<Backend> equal_parents(const level_type& level, const run_list<Backend>& below,
                                                    const std::uint32_t* sources, const Values* values) {
        const auto n = static_cast<std::size_t>(level.size());
        buffer<std::uint32_t> counts(backend_, n + 1);
        equal_runs<Backend> made(backend_);
        made.runs.first = buffer<std::uint64_t>(backend_, n + 1);
        passes::join_equal_rows<Values> join{
            level.first_child.data(), n, below.view(), sources, values, counts.data(), nullptr, nullptr, nullptr};
        backend_.for_each(n + 1, join);
        const auto bounds = static_cast<std::size_t>(backend_.sum(counts, made.runs.first));
        made.runs.bounds = buffer<std::uint32_t>(backend_, bounds);
        made.sources = buffer<std::uint32_t>(backend_, bounds / 2);
        join.counts = nullptr;
        join.first = made.runs.first.data();
        join.bounds = made.runs.bounds.data();
        join.to_sources = made.sources.data();
        backend_.for_each(n, join);
        return made;
    }
    [[nodiscard]] passes::brick_rows rows_of(const Contents& made) const {
        return {made.keys.data(), rows_.data(), first_row_.data(), voxel_rows_.keys.data(), runs_.view(), axis_};
    }
    void make_bricks(cell_list<Backend>&& cells, Contents& made) {
        const std::size_t n = cells.keys.size();
        if (axis_ != 0) backend_.for_each(n, passes::turn_keys{cells.keys.data(), axis_});
        backend_.sort_by_key(cells.keys, cells.rows, key_bits_);
        buffer<std::uint32_t> counts(backend_, n + 1);
        made.keys = std::move(cells.keys);
        rows_ = std::move(cells.rows);
        made.masks = buffer<brick_mask>(backend_, n);
        backend_.for_each(n + 1, passes::make_cell_masks{rows_of(made), n, made.masks.data(), counts.data()});
        buffer<std::uint64_t> offsets(backend_, n + 1);
        made.num_voxels = backend_.sum(counts, offsets);
        if (n != 0) made.offsets = std::move(offsets);
    }
    // Cubes that no larger one of their value has, level by level.
    template <class Values>
    void make_tiles(level_type&& bricks, equal_runs<Backend>&& of_bricks, const Values* values, Contents& made) {
        std::vector<buffer<std::uint64_t>> tiles; // of each level
        std::vector<buffer<std::uint32_t>> sources;
        std::size_t num_tiles = 0;
        level_type here = std::move(bricks);
        equal_runs<Backend> all = std::move(of_bricks);
        for (int level = 0; all.runs.bounds.size() != 0; ++level) {
            level_type above = parents_of(backend_, here);
            equal_runs<Backend> all_above = equal_parents(above, all.runs, all.sources.data(), values);
            const auto cells = list_cells(backend_, cells_beyond{here.keys.data(), here.size(), all.runs.view(),
                                                                 all_above.runs.view(), here.parent.data(), 2});
            const std::size_t n = cells.keys.size();
            tiles.emplace_back(backend_, n);
            sources.emplace_back(backend_, n);
            backend_.for_each(n, passes::make_cell_tiles{cells.keys.data(), cells.rows.data(), all.runs.view(),
                                                         all.sources.data(), level, axis_, tiles.back().data(),
                                                         sources.back().data()});
            num_tiles += n;
            made.tile_voxels += n * brick_tile::of(0, level).num_voxels();
            here = std::move(above);
            all = std::move(all_above);
        }
        buffer<std::uint64_t> bits(backend_, num_tiles);
        sources_ = buffer<std::uint32_t>(backend_, num_tiles);
        std::size_t at = 0;
        for (std::size_t l = 0; l < tiles.size(); ++l) {
            const std::size_t n = tiles[l].size();
            backend_.for_each(n, passes::copy_items<std::uint64_t>{tiles[l].data(), bits.data() + at});
            backend_.for_each(n, passes::copy_items<std::uint32_t>{sources[l].data(), sources_.data() + at});
            at += n;
        }
        backend_.sort_by_key(bits, sources_, key_bits_ + brick_tile::level_bits);
        made.tiles = buffer<brick_tile>(backend_, num_tiles);
        backend_.for_each(num_tiles, take_tiles{bits.data(), made.tiles.data()});
    }

    Backend& backend_;
    int axis_, key_bits_;
    level_type voxel_rows_;
    const run_list<Backend>& runs_;
    buffer<std::uint32_t> rows_;      // of bricks, of each brick
    buffer<std::uint64_t> first_row_; // of voxels
    buffer<std::uint32_t> sources_;   // of the tiles: runs of voxels
};

// Ends a call that makes_cell_tiles.
template <class Backend, class CellShader, class... Targets>
[[nodiscard]] status store_cell_runs(Backend& backend, listed_cells<Backend, CellShader>& cells,
                                     const typename Backend::template buffer<std::uint64_t>& rows, const grid& g,
                                     int axis, sparse_framebuffer<Backend, Targets...>& fb) {
    using values_type = pack<typename Targets::value_type...>;
    const std::size_t n = rows.size();
    const glm::ivec3 whole = turn(g.whole_extent(), axis), offset = turn(g.offset, axis);
    row_level<Backend> voxel_rows(backend);
    voxel_rows.keys = typename Backend::template buffer<std::uint64_t>(backend, n);
    typename Backend::template buffer<std::uint32_t> order(backend, n), num_bounds(backend, n + 1);
    backend.for_each(n, passes::key_cell_rows{rows.data(), cells.terms().keys_of.rows_y, offset, voxel_rows.keys.data(),
                                              order.data()});
    backend.sort_by_key(voxel_rows.keys, order,
                        static_cast<int>(std::bit_width(morton_key(0, whole.y - 1, whole.z - 1) | 1)));
    run_list<Backend> runs(backend);
    runs.first = typename Backend::template buffer<std::uint64_t>(backend, n + 1);
    passes::cell_start<Targets...> start{fb.next_background(), {}};
    for_each_index<sizeof...(Targets)>(
        [&]<std::size_t I>() { start.is_drawn[I] = voxelpipe::get<I>(fb.targets()).load != load_operation::off; });
    passes::run_shaded_cells<CellShader, Targets...> shade{
        cells.walk(n),  rows.data(),       order.data(), n,       offset.x, start,
        cells.counts(), num_bounds.data(), nullptr,      nullptr, nullptr};
    backend.for_each(n + 1, shade);
    const std::uint64_t bounds = backend.sum(num_bounds, runs.first);
    if (bounds / 2 >> 32 != 0) return cells.fail(status_code::size_overflow);
    runs.bounds = typename Backend::template buffer<std::uint32_t>(backend, static_cast<std::size_t>(bounds));
    typename Backend::template buffer<values_type> values(backend, static_cast<std::size_t>(bounds / 2));
    shade.num_bounds = nullptr;
    shade.first = runs.first.data();
    shade.bounds = runs.bounds.data();
    shade.values = values.data();
    backend.for_each(n, shade);

    using contents = sparse_contents<Backend, Targets...>;
    contents made(backend);
    made.is_tiled = true;
    if (bounds != 0) {
        cell_bricks<Backend, contents> bricks(backend, std::move(voxel_rows), runs, values.data(), g.whole_extent(),
                                              axis, made);
        const std::uint64_t num_bricks = made.keys.size() + made.tiles.size(), num_values = made.num_values();
        if (num_bricks > fb.limits().bricks || num_values > fb.limits().voxels) {
            status limited = cells.fail(status_code::capacity_exceeded);
            limited.where = stage::tile_resolve;
            limited.required.bricks = num_bricks;
            limited.required.voxels = num_values;
            return limited;
        }
        for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename pack_element<I, Targets...>::type;
            using map = rank_map<target>;
            if (!voxelpipe::get<I>(fb.targets()).enabled) return;
            auto& to = voxelpipe::get<I>(made.values);
            to = typename Backend::template buffer<typename map::element>(backend, map::elements(num_values));
            bricks.template store_values<I, target>(values.data(), made, to.data());
        });
    }
    status s = cells.result();
    fb.take(std::move(made), g);
    return s;
}

// Ends any other call: by way of lists of all voxels with their fragments.
template <class Backend, class CellShader, class... Targets>
[[nodiscard]] status store_cell_lists(Backend& backend, listed_cells<Backend, CellShader>& cells,
                                      const typename Backend::template buffer<std::uint64_t>& rows, const grid& g,
                                      sparse_framebuffer<Backend, Targets...>& fb) {
    using payload = typename outputs_payload<cell_output<CellShader>>::type;
    abuffer<Backend, payload> lists(backend);
    constexpr std::uint64_t most_voxels = listed_cells<Backend, CellShader>::most - 3;
    const status s = shade_into_lists(backend, cells, rows, g.extent, false, most_voxels, lists);
    if (!s.ok()) return s;
    const status stored = run_module(store_sparse_tag{}, backend, g, lists, fb, s);
    return stored.ok() ? s : stored;
}

// Implements voxelize_cells into a sparse framebuffer on any backend. Arguments are validated. Throws what the
// backend's buffers throw.
template <class Backend, class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status run_sparse_cells(Backend& backend, std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                                      const grid& g, sparse_framebuffer<Backend, Targets...>& fb,
                                      const cell_options& options, std::uint64_t triangles_in) {
    status failed;
    if (has_too_many_vertices<Backend>(draws, triangles_in, failed)) return failed;
    listed_cells<Backend, CellShader> cells(backend, draws, g, options, triangles_in);
    if (const status s = cells.list(); !s.ok()) return s;
    const auto rows = find_cell_rows(backend, cells.terms());
    if (const status s = cells.measure(rows.size(), rows.data()); !s.ok()) return s;
    if constexpr (may_make_cell_tiles<CellShader, Targets...>)
        if (makes_cell_tiles<CellShader>(fb)) return store_cell_runs(backend, cells, rows, g, options.axis, fb);
    return store_cell_lists(backend, cells, rows, g, fb);
}

} // namespace voxelpipe::core
