// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_cells_async into bricks: cut cells in the caller's memory, without waits and allocations, as a CUDA graph
// needs it, with the bricks, tiles and values of voxelize_cells. The records are those of cells_async.cuh. Where the
// shader makes tiles, memory is in proportion to the records and the result. Otherwise every voxel with a fragment is
// listed: in proportion to sparse_cell_limits::voxels, times the draws for bodies::draw. A call that goes on
// (sparse_result::start), or keeps sums, lists them always.

#include <voxelpipe/cells/device/bounded_cell_bricks.cuh>
#include <voxelpipe/cells/device/cells_async.cuh>
#include <voxelpipe/cells/sparse_cells.hpp>
#include <voxelpipe/sparse/device/sparse_async.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace voxelpipe {

// Room of a call with cut cells into bricks. Beside `records`, tiles count as bricks and as voxels.
struct sparse_cell_limits : cell_limits {
    std::uint64_t bricks = 0; // of 8 x 8 x 8 voxels, and tiles, at most 2^32 - 80
    std::uint64_t voxels = 0; // that exist in bricks, and one a tile; without tiles below 2^32 - 16
    std::uint64_t nodes = 0;  // as workspace_limits::nodes; calls that make tiles need none
};

// The caller's memory, as workspace_view.
struct sparse_cell_workspace_view {
    void* memory = nullptr;    // on the device, aligned to 256 bytes
    std::size_t bytes = 0;     // at least cell_workspace_bytes(...)
    sparse_cell_limits limits; // that `bytes` was computed for
};

namespace device {

[[nodiscard]] inline workspace_limits to_workspace_limits(const sparse_cell_limits& l) {
    workspace_limits limits;
    limits.bricks = l.bricks;
    limits.voxels = l.voxels;
    limits.nodes = l.nodes;
    return limits;
}

// Ends the lists of a call's voxels. If they do not fit, they are empty, and the call is stopped.
struct bound_cell_lists {
    std::uint64_t max_voxels, max_fragments;
    cell_state* state;
    list_counts* counts;
    std::uint64_t* offsets;
    __device__ void operator()(std::uint64_t) const {
        const std::uint64_t voxels = state->counts[core::index_of(core::cell_count::voxels)],
                            fragments = state->counts[core::index_of(core::cell_count::fragments)];
        state->listed_voxels = voxels;
        if (voxels > max_voxels || fragments > max_fragments) state->call.index_error |= stopped;
        *counts = state->call.index_error == 0 ? list_counts{voxels, fragments} : list_counts{0, 0};
        offsets[counts->voxels] = counts->fragments;
    }
};

// One call in the caller's memory.
template <class Draw, class... Targets>
struct bounded_cells_call {
    using records_type = async_cells<Draw>;
    using cell_shader = typename records_type::cell_shader;
    using payload = typename outputs_payload<core::cell_output<cell_shader>>::type;
    using values_type = core::pack<typename Targets::value_type...>;

    std::span<const Draw> draws;
    const grid& g;
    const cell_options& options;
    std::uint64_t triangles;
    sparse_cell_limits limits;
    cudaStream_t stream;

    // Run: launches everything; otherwise only adds up the bytes. False if the records or the result cannot be
    // numbered.
    template <bool Run>
    [[nodiscard]] bool operator()(arena& memory, sparse_result<Targets...>& result) const {
        if (!are_numbered_bricks(to_workspace_limits(limits), result)) return false;
        if (triangles == 0) {
            keep<Run>(memory, result);
            return true;
        }
        const records_type records(draws, g, options, limits.records, memory); // its state comes first
        if (!records.fits()) return false;
        const glm::ivec3 extent = core::turn(g.extent, options.axis);
        const bounded_cell_rows<> rows(extent, limits.records, memory);
        auto* const cursors = records.take_cursors(rows.room(), memory);
        if constexpr (core::may_make_cell_tiles<cell_shader, Targets...>) {
            if (!result.keeps_voxels() && !result.keeps_any_sums()) {
                // Runs, which may be twice as many as records, and their bounds.
                if (limits.records >= core::max_numbered / 4) return false;
                by_runs<Run>(records, rows, cursors, memory, result);
                return true;
            }
        }
        // The fragments of a row are counted in 32 bits.
        const auto most_in_row = static_cast<std::uint64_t>(extent.x) * records.num_bodies();
        if (limits.voxels >= core::max_numbered || most_in_row >= core::max_numbered) return false;
        by_lists<Run>(records, rows, cursors, memory, result);
        return true;
    }

private:
    static constexpr stage where = stage::tile_resolve;

    // What goes along the rows that have records. Looks at their sums first.
    [[nodiscard]] auto walk_rows(const records_type& call, const bounded_cell_rows<>& rows,
                                 typename records_type::cursor* cursors) const {
        using terms_type = typename records_type::terms_type;
        const auto records = call.list(stream);
        rows.find(records, &call.state()->records, stream);
        auto measure = call.measure(records);
        measure.rows = rows.rows();
        for_each(rows.room() * call.num_bodies(), measure_listed_rows<terms_type>{measure, rows.count()}, where,
                 stream);
        for_each(1, stop_large_windings{call.state()}, where, stream);
        return call.walk(records, cursors);
    }
    // Bricks and tiles of the rows' runs of equal values.
    template <bool Run>
    void by_runs(const records_type& call, const bounded_cell_rows<>& rows, typename records_type::cursor* cursors,
                 arena& memory, sparse_result<Targets...>& result) const {
        const workspace_limits room = to_workspace_limits(limits);
        bounded_result<bounded_arrays<>, Targets...> made({to_room(room), memory}, room, result, memory);
        bounded_cell_bricks<values_type> bricks(g, options.axis, limits.records, rows.room(), to_room(room), stream,
                                                memory);
        if constexpr (Run) {
            const auto walk = walk_rows(call, rows, cursors);
            core::passes::cell_start<Targets...> start{result.next_background(), {}};
            for (std::size_t i = 0; i < sizeof...(Targets); ++i)
                start.is_drawn[i] = result.loads[i] != load_operation::off;
            const core::passes::run_shaded_cells<cell_shader, Targets...> shade{
                walk,   rows.rows(),          nullptr, 0,       core::turn(g.offset, options.axis).x,
                start,  call.state()->counts, nullptr, nullptr, nullptr,
                nullptr};
            bricks.write_runs(rows, walk.list.keys_of.rows_y, shade);
            made.bricks.clear(stream);
            bricks.launch(made.bricks);
            made.publish(&call.state()->call, bricks.num_tiles(), nullptr, stream);
            bricks.end_tiles(made.bricks.counts);
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using target = typename core::pack_element<I, Targets...>::type;
                bricks.template store_values<I, target>(made.bricks, limits.voxels, get<I>(made.values));
            });
            made.set(result, g, bricks.tiles(), limits.bricks);
            result.is_tiled = true;
        }
    }
    // By way of lists of all voxels with their fragments.
    template <bool Run>
    void by_lists(const records_type& call, const bounded_cell_rows<>& rows, typename records_type::cursor* cursors,
                  arena& memory, sparse_result<Targets...>& result) const {
        using shade_type = core::passes::list_shaded_cells<cell_shader, payload>;
        using write_type = for_listed_rows<shade_type, false>;
        workspace_limits room = to_workspace_limits(limits);
        room.fragments = limits.voxels; // of the fold, which has one for each voxel
        const std::uint64_t max_fragments = limits.voxels * call.num_bodies(), behind = rows.room() + 1;
        auto* const num_voxels = memory.take<std::uint32_t>(behind);
        auto* const num_fragments = memory.take<std::uint32_t>(behind);
        auto* const first_voxel = memory.take<unsigned long long>(behind);
        auto* const first_fragment = memory.take<unsigned long long>(behind);
        const std::size_t scan_bytes = cell_scan_bytes(static_cast<std::uint32_t>(behind));
        auto* const scan = memory.take<std::byte>(scan_bytes);
        auto* const voxels = memory.take<std::uint64_t>(limits.voxels);
        auto* const offsets = memory.take<std::uint64_t>(limits.voxels + 1);
        auto* const payloads = memory.take<payload>(max_fragments);
        auto* const counts = memory.take<list_counts>(1);
        const bounded_fold<payload, Targets...> fold(g.whole_extent(), room, result, memory);
        if constexpr (Run) {
            cell_state* const state = call.state();
            const auto walk = walk_rows(call, rows, cursors);
            shade_type shade{walk,
                             rows.rows(),
                             0,
                             g.extent,
                             state->counts,
                             num_voxels,
                             num_fragments,
                             reinterpret_cast<const std::uint64_t*>(first_voxel),
                             reinterpret_cast<const std::uint64_t*>(first_fragment),
                             nullptr,
                             nullptr,
                             nullptr,
                             nullptr};
            for (std::uint32_t* const numbers : {num_voxels, num_fragments})
                check(cudaMemsetAsync(numbers, 0, behind * sizeof(std::uint32_t), stream), where);
            for_each(behind, for_listed_rows<shade_type, true>{shade, rows.count()}, where, stream);
            for (const bool of_fragments : {false, true})
                sum_counts(of_fragments ? num_fragments : num_voxels, of_fragments ? first_fragment : first_voxel,
                           static_cast<std::uint32_t>(behind), scan, scan_bytes, where, stream);
            for_each(1, bound_cell_lists{limits.voxels, max_fragments, state, counts, offsets}, where, stream);
            shade.num_voxels = nullptr;
            shade.voxels = voxels;
            shade.offsets = offsets;
            shade.payloads = payloads;
            for_each(rows.room(), unless_stopped<write_type>{{shade, rows.count()}, &state->call.index_error}, where,
                     stream);
            const abuffer_view<payload> lists{counts, voxels, offsets, nullptr, payloads, g.extent};
            fold.launch(lists, g, true, &state->call, result, stream);
        }
    }
    // A call without triangles: what stays.
    template <bool Run>
    void keep(arena& memory, sparse_result<Targets...>& result) const {
        auto* const state = memory.take<cell_state>(1);
        auto* const counts = memory.take<list_counts>(1);
        const bounded_fold<payload, Targets...> fold(g.whole_extent(), to_workspace_limits(limits), result, memory);
        if constexpr (Run) {
            check(cudaMemsetAsync(state, 0, sizeof(cell_state), stream));
            check(cudaMemsetAsync(counts, 0, sizeof(list_counts), stream));
            abuffer_view<payload> none;
            none.counts = counts;
            fold.launch(none, g, true, &state->call, result, stream);
        }
    }
};

} // namespace device

// Bytes that voxelize_cells_async needs for such a call on the current device; 0 if the arguments are invalid, or the
// call closes holes, which takes waits.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] std::size_t cell_workspace_bytes(std::span<const draw<Mesh, VertexShader, CellShader>> draws,
                                               const grid& g, const sparse_result<Targets...>& result,
                                               const cell_options& options, const sparse_cell_limits& limits) {
    using call_type = device::bounded_cells_call<draw<Mesh, VertexShader, CellShader>, Targets...>;
    const status s = core::validate_draws(draws);
    if (!s.ok() || !device::validate_async(options, g).ok() || !core::validate_start(result, g).ok()) return 0;
    return device::bytes_or_none([&] {
        return device::bounded_bytes(result, call_type{draws, g, options, s.counts.triangles_in, limits, nullptr});
    });
}

// Puts the call on the backend's stream, sets `result` to where its bricks, tiles and values will be, and returns: what
// voxelize_cells makes of a sparse framebuffer, byte for byte. The memory is the caller's: views of `result` point into
// it, and stay valid as long as it serves the same call. A status other than ok means that nothing was launched, or
// that a launch failed; read_cells_status reports what the device finds out. If something does not fit, the result is
// empty. strategy_unavailable: the call closes holes. size_overflow: limits beyond what is numbered, such as 2^30 - 4
// records or more where the call makes tiles. extent_mismatch: result.start is of another grid. null_view: it has no
// values of a target that is not cleared.
template <class Mesh, class VertexShader, class CellShader, class... Targets>
[[nodiscard]] status voxelize_cells_async(cuda_backend& backend,
                                          std::span<const draw<Mesh, VertexShader, CellShader>> draws, const grid& g,
                                          sparse_result<Targets...>& result, const cell_options& options,
                                          const sparse_cell_workspace_view& workspace) {
    if constexpr (core::cell_fits_targets<Mesh, VertexShader, CellShader, Targets...>()) {
        using call_type = device::bounded_cells_call<draw<Mesh, VertexShader, CellShader>, Targets...>;
        device::forget_made(result);
        if (const status s = device::validate_async(options, g); !s.ok()) return s;
        if (const status s = core::validate_start(result, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        return device::launch_bounded(
            {workspace.memory, workspace.bytes, device::to_workspace_limits(workspace.limits), nullptr}, s, result,
            call_type{draws, g, options, s.counts.triangles_in, workspace.limits, backend.stream});
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// Waits for the stream and returns the status of the last call in this workspace, that of voxelize_cells. `need` may be
// null. Where something did not fit (capacity_exceeded), status::where is coarse_raster for records, of which
// cells.cell_records are needed, and tile_resolve for bricks, voxels and nodes, of which status::required has the first
// two. *need receives larger limits, with which the same call may fail once more: what did not come to be for want of
// room has not been counted.
[[nodiscard]] inline status read_cells_status(cuda_backend& backend, const sparse_cell_workspace_view& workspace,
                                              sparse_cell_limits* need = nullptr) {
    device::cell_state state{};
    const status s = device::read_cells(backend, workspace.memory, state);
    if (!s.ok()) return s;
    const sparse_cell_limits& limits = workspace.limits;
    sparse_cell_limits needed;
    needed.records = state.list.num_terms;
    needed.bricks = state.call.sparse.bricks;
    needed.voxels = std::max(std::uint64_t{state.call.sparse.voxels}, state.listed_voxels);
    needed.nodes = state.call.sparse.nodes;
    const bool lacks_records = needed.records > limits.records;
    if (!lacks_records && needed.bricks <= limits.bricks && needed.voxels <= limits.voxels &&
        needed.nodes <= limits.nodes)
        return s;
    if (need != nullptr) {
        sparse_cell_limits larger; // `need` may be that of the workspace
        larger.records = std::max(limits.records, needed.records);
        larger.bricks = std::max(limits.bricks, needed.bricks);
        larger.voxels = std::max(limits.voxels, needed.voxels);
        larger.nodes = std::max(limits.nodes, needed.nodes);
        *need = larger;
    }
    status failed =
        core::failure(status_code::capacity_exceeded, lacks_records ? stage::coarse_raster : stage::tile_resolve);
    failed.counts.triangles_in = state.triangles_in;
    failed.cells.cell_records = needed.records;
    failed.required.bricks = needed.bricks;
    failed.required.voxels = needed.voxels;
    return failed;
}

} // namespace voxelpipe
