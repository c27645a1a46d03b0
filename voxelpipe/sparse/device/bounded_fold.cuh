// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A sparse result in memory of the caller: its bricks and values (bounded_result), and how lists of fragments, and what
// the call goes on from, become one (bounded_fold). Nothing here waits or allocates.

#include <voxelpipe/device/abuffer_async.cuh>
#include <voxelpipe/sparse/device/bounded_bricks.cuh>
#include <voxelpipe/sparse/device/bounded_tiles.cuh>
#include <voxelpipe/sparse/device/sparse.cuh>
#include <voxelpipe/sparse/device/sparse_result.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

[[nodiscard]] inline brick_room to_room(const workspace_limits& l) { return {l.nodes, l.bricks, l.voxels}; }
// Bricks are numbered with 32 bits, and so are the words of their nodes.
[[nodiscard]] inline bool are_numbered_bricks(const workspace_limits& l) {
    return l.bricks <= core::max_numbered - spare_cells && l.nodes < std::uint64_t{1} << 25 &&
           l.fragments <= core::max_numbered && l.voxels < std::uint64_t{1} << 40;
}
// True if the bricks of a result are numbered with 32 bits. Where voxels stay, ranks have 32 bits, and so have the
// words of masks and the parts of tiles.
template <class... Targets>
[[nodiscard]] bool are_numbered_bricks(const workspace_limits& l, const sparse_result<Targets...>& result) {
    if (!are_numbered_bricks(l)) return false;
    if (!result.keeps_voxels()) return true;
    const brick_table& before = result.start.view.table;
    return l.voxels <= core::max_numbered && before.count <= core::max_numbered / 8 &&
           before.num_tiles < core::max_numbered - l.bricks;
}

// A sparse result in an arena: its bricks, and values, and sums where they are kept, for each voxel, and tile, that
// there is room for. Bricks: bounded_arrays, or bounded_bricks.
template <class Bricks, class... Targets>
struct bounded_result {
    using values_type = core::pack<typename core::rank_map<Targets>::element*...>;
    workspace_limits limits;
    Bricks bricks;
    values_type values{};
    core::pack<core::kept_sum<Targets>*...> sums{};

    bounded_result(const Bricks& empty, const workspace_limits& l, const sparse_result<Targets...>& result,
                   arena& memory)
        : limits(l), bricks(empty) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            using map = core::rank_map<target>;
            get<I>(values) = memory.take<typename map::element>(map::elements(limits.voxels));
            if (result.keeps_sums(I)) get<I>(sums) = memory.take<core::kept_sum<target>>(limits.voxels);
        });
    }
    // When the masks are complete, as bounded_bricks. read_status would take triangles that were left to the deferred
    // pass for missing ones.
    void publish(pipeline_state* state, const unsigned long long* tiles, const unsigned long long* drawn,
                 cudaStream_t stream) const {
        bricks.publish(state, to_capacities(limits), tiles, drawn, stream);
        check(cudaMemsetAsync(&state->deferred, 0, sizeof(state->deferred), stream));
    }
    // tiles: with room for `num_tiles`.
    void set(sparse_result<Targets...>& result, const grid& g, const brick_tile* tiles, std::uint64_t num_tiles) const {
        result.counts = bricks.counts;
        result.where = g;
        result.is_tiled = false;
        result.view.table = {bricks.keys, bricks.masks, bricks.offsets, limits.bricks,
                             g.extent,    g.offset,     tiles,          num_tiles};
        result.view.clear_values = result.next_background();
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            get<I>(result.view.values) = get<I>(values);
            get<I>(result.sums) = get<I>(sums);
        });
    }
};

// A result that is made of lists with all outputs of the shader, at most limits.fragments, and of the voxels that stay.
template <class Payload, class... Targets>
struct bounded_fold {
    bounded_result<bounded_bricks<>, Targets...> made;
    brick_table before;               // what stays; empty, if nothing does
    bounded_kept_tiles<> tiles;       // of `before`
    std::uint32_t *listed, *existing; // of each voxel, by rank: its number in the lists, and its rank in `before`

    bounded_fold(const glm::ivec3& whole, const workspace_limits& limits, const sparse_result<Targets...>& result,
                 arena& memory)
        : made({whole, to_room(limits), memory}, limits, result, memory),
          before(result.keeps_voxels() ? result.start.view.table : brick_table{}),
          tiles(before, to_room(limits), memory), listed(memory.take<std::uint32_t>(num_ranks())),
          existing(keeps() ? memory.take<std::uint32_t>(num_ranks()) : nullptr) {}
    [[nodiscard]] std::uint64_t num_ranks() const { return made.limits.voxels + spare_ranks; }
    [[nodiscard]] bool keeps() const { return before.count != 0 || before.num_tiles != 0; }

    // `state`: of the call that made the lists.
    void launch(const abuffer_view<Payload>& lists, const grid& g, bool count_voxels, pipeline_state* state,
                sparse_result<Targets...>& result, cudaStream_t stream) const {
        const bounded_bricks<>& bricks = made.bricks;
        bricks.clear(stream);
        build(lists, g, count_voxels, state, stream);
        const auto background = result.next_background();
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            using map = core::rank_map<target>;
            auto* const values = get<I>(made.values);
            const auto* const earlier = get<I>(result.start.view.values);
            auto* const sums = get<I>(made.sums);
            const fold_target<target> fold{
                get<I>(background), result.loads[I], result.keeps_sums(I), earlier, values, sums};
            const std::uint64_t most =
                keeps() ? made.limits.voxels : std::min(made.limits.voxels, made.limits.fragments);
            if (most == 0) return;
            if (map::is_bit && !tiles.is_empty()) // no kernel writes words of tiles as a whole
                check(cudaMemsetAsync(values, 0, map::elements(most) * sizeof(*values), stream));
            launch_kernel(false, fold_voxels<I, target, Payload>, num_blocks(most), threads_per_block, 0, stream,
                          stage::tile_resolve, fold, static_cast<const std::uint64_t*>(&bricks.counts->voxels),
                          static_cast<const std::uint32_t*>(listed), static_cast<const std::uint32_t*>(existing),
                          lists.offsets, lists.payloads);
            tiles.template store<target>(earlier, values, sums, result.loads[I] != load_operation::clear,
                                         get<I>(background), bricks.counts, stream);
        });
        made.set(result, g, tiles.tiles(), tiles.capacity());
    }

private:
    // Bricks, ranks and tiles, and where each voxel comes from.
    void build(const abuffer_view<Payload>& lists, const grid& g, bool count_voxels, pipeline_state* state,
               cudaStream_t stream) const {
        constexpr stage where = stage::tile_resolve;
        const workspace_limits& limits = made.limits;
        const bounded_bricks<>& bricks = made.bricks;
        const brick_voxels from{lists.voxels,
                                static_cast<std::uint32_t>(limits.fragments),
                                g.extent,
                                g.offset,
                                g.whole_extent(),
                                before,
                                &lists.counts->voxels};
        const auto by_voxels = [&](auto* listed_kernel, auto* kept_kernel, std::uint64_t kept_threads,
                                   const auto&... rest) {
            if (limits.fragments != 0)
                launch_kernel(false, listed_kernel, num_blocks(limits.fragments), threads_per_block, 0, stream, where,
                              from, rest...);
            if (kept_threads != 0)
                launch_kernel(false, kept_kernel, num_blocks(kept_threads), threads_per_block, 0, stream, where, before,
                              rest...);
        };
        const auto by_bricks_of_tiles = [&](auto* kernel, const auto&... rest) {
            if (!tiles.is_empty() && limits.bricks != 0)
                launch_kernel(false, kernel, num_blocks(limits.bricks), threads_per_block, 0, stream, where, before,
                              static_cast<const std::uint64_t*>(bricks.keys), limits.bricks, rest...);
        };
        const auto mark = [&](const index_level& level, int log2_cell) {
            by_voxels(mark_listed_voxels<0>, mark_kept_bricks<0>, before.count, level, log2_cell);
        };
        bricks.index.mark_above(mark, &state->sparse.nodes, stream);
        mark(bricks.index.bricks(), index_level::log2_brick);
        bricks.number(stream);
        by_voxels(mask_listed_voxels<0>, mask_kept_voxels<0>, before.count * 8, bricks.index.bricks(), bricks.masks);
        by_bricks_of_tiles(mask_bricks_of_tiles<0>, bricks.masks);
        tiles.count(bricks.keys, stream);
        made.publish(state, tiles.total(),
                     count_voxels ? reinterpret_cast<const unsigned long long*>(&lists.counts->voxels) : nullptr,
                     stream);
        tiles.list(bricks.keys, bricks.counts, stream);
        if (keeps()) // otherwise each voxel is listed
            for (std::uint32_t* const sources : {listed, existing})
                check(cudaMemsetAsync(sources, 0xff, num_ranks() * sizeof(std::uint32_t), stream), where);
        by_voxels(place_listed_voxels<0>, place_kept_voxels<0>, before.count * 8, bricks.index.bricks(),
                  brick_arrays{bricks.keys, bricks.masks, bricks.offsets, listed, existing});
        by_bricks_of_tiles(place_voxels_of_tiles<0>, static_cast<const std::uint64_t*>(bricks.offsets), existing);
    }
};

// A call without triangles: what stays. Run as for calls with some.
template <class Payload, bool Run, class... Targets>
void keep_bricks(arena& memory, const grid& g, bool count_voxels, const workspace_view& workspace,
                 sparse_result<Targets...>& result, cudaStream_t stream) {
    workspace_limits limits = workspace.limits;
    limits.fragments = 0;
    auto* const state = memory.take<pipeline_state>(1);
    auto* const counts = memory.take<list_counts>(1);
    const bounded_fold<Payload, Targets...> fold(g.whole_extent(), limits, result, memory);
    if constexpr (Run) {
        check(cudaMemsetAsync(state, 0, sizeof(pipeline_state), stream));
        check(cudaMemsetAsync(counts, 0, sizeof(list_counts), stream));
        take_stop(workspace, state, stream);
        abuffer_view<Payload> none;
        none.counts = counts;
        fold.launch(none, g, count_voxels, state, result, stream);
    }
}

} // namespace voxelpipe::device
